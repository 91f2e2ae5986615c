"""Make the figures of the documentation smaller than 150 KB each: few colours, fewer pixels where that is not enough.

Run after a script that draws: python docs/figures/shrink.py
"""

from __future__ import annotations

import io
from pathlib import Path

from PIL import Image

LIMIT = 150_000
_COLOURS, _SHRINKING = (256, 128, 64, 48), 0.9


def main() -> None:
    """Shrink all figures that are too large."""
    for path in sorted(Path(__file__).parent.glob("*.png")):
        if path.stat().st_size > LIMIT:
            path.write_bytes(shrunk(Image.open(path).convert("RGB")))


def shrunk(image: Image.Image) -> bytes:
    """Return a picture as PNG of no more than the limit."""
    content = io.BytesIO()
    image.quantize(palette=greys_and_colours(image), dither=Image.Dither.NONE).save(content, "PNG", optimize=True)
    if content.tell() <= LIMIT:
        return content.getvalue()
    while True:
        for colours in _COLOURS:
            content = io.BytesIO()
            image.quantize(colours, dither=Image.Dither.NONE).save(content, "PNG", optimize=True)
            if content.tell() <= LIMIT:
                return content.getvalue()
        image = image.resize([round(_SHRINKING * side) for side in image.size], Image.Resampling.LANCZOS)


def greys_and_colours(image: Image.Image) -> Image.Image:
    """Return a palette of 128 greys and 64 colours of a picture: photographs with a few coloured marks keep both."""
    colours = image.quantize(64, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).getpalette()
    palette = Image.new("P", (1, 1))
    palette.putpalette([level for step in range(128) for level in (2 * step,) * 3] + colours[:192])
    return palette


if __name__ == "__main__":
    main()
