"""One look for all figures: sizes, panels, legends, files."""

from __future__ import annotations

import contextlib
import functools
import io
import math
import string
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.text import Text
from matplotlib.ticker import FixedFormatter, FuncFormatter
from numpy.typing import NDArray
from PIL import Image

from fingerslip.contact.states import OPEN
from fingerslip.errors import InputError
from fingerslip.report import colours as palette
from fingerslip.storage.files import write_bytes

_LEAST_WIDTH = 5.2  # inch: of a figure
_KEY_WIDTH, _LETTER_WIDTH = 0.5, 0.07  # inch
_BESIDE_PANELS, _KEY_HEIGHT = 0.8, 0.19  # inch: of a figure what is not panels; a row of its legend
_TITLE_LETTER_WIDTH, _PANEL_TITLE_LETTER_WIDTH, _LABEL_LETTER_WIDTH = 0.09, 0.08, 0.072  # inch


@dataclass(frozen=True)
class Look:
    """How figures look in one kind of place."""

    width: float | None = None  # width of figures with several panels beside each other [inch]
    single: float | None = None  # width of figures with one panel beside each other [inch]
    letters: float = 1.0  # factor on the size of letters
    lines: float = 1.0  # factor on the width of lines and the size of marks
    least_height: float = 1.0  # of a panel that is scaled to the width [inch]
    beside: int | None = None  # most panels beside each other
    titled: bool = True  # whether figures have a title; without one their panels have letters, for a caption


_COLUMN = 85.0 / 25.4  # inch
#: Looks by name: pages, journal columns of 3.5 and 7.2 inches, one column of 85 mm for all figures, and slides of 13.3
#: inches with room for a heading.
LOOKS: Mapping[str, Look] = {
    "page": Look(),
    "paper": Look(width=7.2, single=3.5, letters=0.85, lines=0.8, titled=False),
    "column": Look(_COLUMN, _COLUMN, letters=0.76, lines=0.65, least_height=0.8, beside=2, titled=False),
    "slides": Look(width=12.0, single=9.0, letters=1.75, lines=1.7),
}
_look: ContextVar[Look] = ContextVar("look", default=LOOKS["page"])

P = ParamSpec("P")
R = TypeVar("R")


with resources.as_file(resources.files("fingerslip.report") / "templates" / "figures.mplstyle") as _sheet:
    _STYLE: Any = mpl.rc_params_from_file(_sheet, use_default_template=False)


def with_style(draw: Callable[P, R]) -> Callable[P, R]:
    """Run a drawing function under the style of this package, whatever the user's own settings are."""

    @functools.wraps(draw)
    def drawn(*args: P.args, **values: P.kwargs) -> R:
        with mpl.rc_context():
            mpl.rcdefaults()
            look = _look.get()
            letters = {name: look.letters * size for name, size in _STYLE.items() if name.endswith("size")}
            lines = {name: look.lines * width for name, width in _STYLE.items() if name.endswith("width")}
            mpl.rcParams.update({**_STYLE, **letters, **lines, "lines.markersize": look.lines * 6.0})
            figure = draw(*args, **values)
            if isinstance(figure, Figure):
                _write_texts_as_they_are(figure)
            return figure

    return drawn


def _write_texts_as_they_are(figure: Figure) -> None:
    """Keep matplotlib from reading the dollars of titles and names as mathematics; numbers on axes keep theirs."""
    legends = [*figure.legends, *(axes.get_legend() for axes in figure.axes)]
    texts = [*figure.texts, *(text for legend in legends if legend for text in legend.get_texts())]
    for axes in figure.axes:
        texts += [artist for artist in axes.get_children() if isinstance(artist, Text)]
        for axis in (axes.xaxis, axes.yaxis):
            has_words = isinstance(axis.get_major_formatter(), FixedFormatter | FuncFormatter)
            texts += [axis.label, *(axis.get_ticklabels() if has_words else ())]
    for text in texts:
        text.set_parse_math(False)


@contextlib.contextmanager
def looking(name: str) -> Iterator[None]:
    """Draw figures with one of :data:`LOOKS` as long as the context lasts."""
    token = _look.set(LOOKS[name])
    try:
        yield
    finally:
        _look.reset(token)


def is_narrow() -> bool:
    """Tell whether every figure has to fit into one column of a journal."""
    return _look.get().beside is not None


def figure_grid(
    count: int,
    columns: int,
    panel: tuple[float, float],
    title: str,
    labels: tuple[str, str],
    *,
    share: str = "all",
    widths: Sequence[float] | None = None,
    heights: Sequence[float] | None = None,
    lettered: bool = True,
    full: bool = False,
) -> tuple[Figure, list[Axes]]:
    """Make a figure of `count` panels, each of a size [inch]; the lowest of every column has the horizontal label.

    A single column has the width of one in a journal, or the `full` width of a page.
    """
    look = _look.get()
    most = look.beside if look.beside and lettered and not widths else columns
    wide = max(min(columns, count, most), 1)
    rows = max(math.ceil(count / wide), 1)
    size = (max(wide * panel[0] + 0.6, _LEAST_WIDTH), rows * panel[1] + _BESIDE_PANELS)
    if (width := look.single if wide == 1 and not full else look.width) is not None:
        # Scaled to the width of the look.
        scale = (width - 0.6) / (wide * panel[0])
        size = (width, rows * max(panel[1] * scale, look.least_height) + _BESIDE_PANELS * look.letters)
    figure = Figure(figsize=size, layout="constrained")
    FigureCanvasAgg(figure)
    shared_x, shared_y = {"all": (True, True), "x": (True, False), "none": (False, False)}[share]
    ratios: dict[str, Any] = {"width_ratios": widths, "height_ratios": heights}
    grid = figure.subplots(rows, wide, sharex=shared_x, sharey=shared_y, squeeze=False, **ratios)
    panels: list[Axes] = list(np.asarray(grid).flat)
    for unused in panels[count:]:
        unused.set_visible(False)
    for lowest in panels[max(count - wide, 0) : count]:
        lowest.tick_params(labelbottom=True)
        lowest.set_xlabel(labels[0])
    # The label is as long as the panels, not the figure: the rest holds titles, ticks and the legend.
    label = _wrap(labels[1], (size[1] - _BESIDE_PANELS * look.letters) / (look.letters * _LABEL_LETTER_WIDTH))
    figure.supylabel(label, fontsize=mpl.rcParams["axes.labelsize"])
    if lettered and count > 1:
        letter_panels(panels[:count])
    if look.titled:
        figure.suptitle(_wrap(title, size[0] / (look.letters * _TITLE_LETTER_WIDTH)), x=0.01, ha="left")
    return figure, panels[:count]


def letter_panels(panels: Sequence[Axes]) -> None:
    """Write a, b, c and on at the top left of panels, outside of them, where the look has letters."""
    look: dict[str, Any] = {"xycoords": "axes fraction", "textcoords": "offset points", "ha": "right", "va": "bottom"}
    for letter, axes in zip("" if _look.get().titled else string.ascii_lowercase, panels, strict=False):
        axes.annotate(letter, (0.0, 1.0), (-4.0, 4.0), fontweight="bold", **look)


def panel_width(axes: Axes) -> tuple[float, int]:
    """Return the width of the figure of a panel [inch], and how many panels are beside each other in it."""
    figure, cell = axes.get_figure(root=True), axes.get_subplotspec()
    assert figure is not None  # panels are made with one
    return figure.get_figwidth(), cell.get_gridspec().ncols if cell else 1


def name_panel(axes: Axes, title: str, above: float | None = None) -> None:
    """Write the title of one of some panels beside each other, in as many lines as it needs, `above` them [points]."""
    width, columns = panel_width(axes)
    axes.set_title(_wrap(title, (width - 0.6) / columns / (_look.get().letters * _PANEL_TITLE_LETTER_WIDTH)), pad=above)


def _wrap(title: str, letters: float) -> str:
    return textwrap.fill(title, max(int(letters), 10), break_long_words=False)


def add_keys_inside(axes: Axes, **where: Any) -> None:
    """Put a legend into a panel where it covers least, on white so that lines behind it do not cross letters."""
    look = {"loc": "best", "frameon": True, "facecolor": "white", "edgecolor": "none", "framealpha": 1.0, **where}
    axes.legend(**look).set_zorder(6)


def note_below(axes: Axes, text: str) -> None:
    """Write a sentence below the horizontal label of the lowest panel."""
    wrapped = _wrap(text, (panel_width(axes)[0] - 0.9) / (_look.get().letters * _LABEL_LETTER_WIDTH))
    axes.set_xlabel("\n".join(filter(None, (axes.get_xlabel(), wrapped))))


def say(axes: Axes, text: str, height: float = 0.5) -> None:
    """Write in the middle of a panel why nothing is drawn in it; `height` is a share of the panel's."""
    axes.text(0.5, height, text, transform=axes.transAxes, ha="center", color=palette.GREY)


def columns_for(count: int) -> int:
    """Return how many panels of `count` go beside each other: at most three, or what the look has, four two by two."""
    return 2 if count == 4 else max(min(count, _look.get().beside or 3), 1)


def add_legend(figure: Figure, keys: Mapping[str, Artist]) -> None:
    """Put a legend below all panels, in as many columns as the width of the figure holds; none without keys.

    The figure grows by the rows behind the first, so that the panels keep their height.
    """
    if not keys:
        return
    widths = [_look.get().letters * (_KEY_WIDTH + _LETTER_WIDTH * len(name)) for name in keys]
    columns = len(widths)
    # The widest keys of all columns have to fit, filled column by column as matplotlib shares keys out.
    while columns > 1 and sum(float(part.max()) for part in np.array_split(widths, columns)) > figure.get_figwidth():
        columns -= 1
    rows, row = math.ceil(len(keys) / columns), _KEY_HEIGHT * _look.get().letters
    figure.set_figheight(figure.get_figheight() + (rows - 1) * row)
    # The label of the vertical axes stays in the middle of what is above the legend.
    middle = 0.5 + 0.5 * rows * row / figure.get_figheight()
    figure.supylabel(figure.get_supylabel(), y=middle, fontsize=mpl.rcParams["axes.labelsize"])
    figure.legend(list(keys.values()), list(keys), loc="outside lower left", ncols=columns, columnspacing=1.4)


def layer_keys(colours: Mapping[str, str], edge: str, **look: Any) -> dict[str, Artist]:
    """Return keys of layers for a legend."""
    return {name: Patch(facecolor=colour, edgecolor=edge, **look) for name, colour in colours.items()}


def state_keys(states: Sequence[int]) -> dict[str, Artist]:
    """Return keys of states of the contact for a legend; what is open is as white as the page, and has an edge."""
    colours = {state: palette.STATE_COLOURS[state] for state in states}
    return {
        palette.STATE_NAMES[state]: Patch(facecolor=colour, edgecolor="#999999" if state == OPEN else colour)
        for state, colour in colours.items()
    }


def crop(pictures: Iterable[NDArray[np.uint8]]) -> list[NDArray[np.uint8]]:
    """Cut the white margins off pictures (height, width, 3) of one size, the same off all of them."""
    whole = list(pictures)
    inked = np.any([(picture < 250).any(axis=2) for picture in whole], axis=0)  # of 255, which is white
    rows, columns = np.flatnonzero(inked.any(axis=1)), np.flatnonzero(inked.any(axis=0))
    if rows.size == 0:
        return whole
    return [picture[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] for picture in whole]


def show_picture(axes: Axes, picture: NDArray[np.uint8], title: str = "") -> None:
    """Fill a panel with a picture."""
    axes.imshow(picture)
    axes.set_axis_off()
    axes.set_title(title)


def join_title(title: str, more: str) -> str:
    """Join the title of a figure with what it is of, such as the title of a run."""
    return f"{title}: {more}" if more else title


_ENDINGS, _DOTS_PER_INCH, _FEWEST_DOTS, _MOST_DOTS = (".png", ".svg", ".pdf"), 150, 50, 1200


def pixels(figure: Figure) -> NDArray[np.uint8]:
    """Draw a figure once, and return it as a picture (height, width, 3)."""
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def figure_bytes(figure: Figure, kind: str = "png", dpi: int | None = None) -> bytes:
    """Render a figure."""
    stream = io.BytesIO()
    if kind == "png":
        # Drawn once, where ``savefig`` draws twice, and packed quickly: a report renders dozens of figures.
        dots = dpi or _DOTS_PER_INCH
        figure.set_dpi(dots)
        Image.fromarray(pixels(figure)).save(stream, "png", compress_level=2, dpi=(dots, dots))
    else:
        # Text can be searched and edited: whole fonts, which journals ask for, and words. Fields are pixels, for print.
        with mpl.rc_context({"pdf.fonttype": 42, "svg.fonttype": "none"}):
            figure.savefig(stream, format=kind, dpi=dpi or 2 * _DOTS_PER_INCH)
    return stream.getvalue()


def final_bytes(figure: Figure) -> bytes:
    """Render a figure that stays as it is, some per cent faster: labels without text have their places."""
    for axis in (axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis) if not axis.get_label_text()):
        axis.set_label_coords(0.5, 0.5)
    return figure_bytes(figure)


def picture_bytes(pictures: Iterable[NDArray[np.uint8]], ending: str) -> bytes:
    """Return a picture (height, width, 3) as a file of an ending such as ``.png``; several move, 80 ms each."""
    stream, (first, *others) = io.BytesIO(), map(Image.fromarray, pictures)
    moving: dict[str, Any] = {"save_all": True, "append_images": others, "duration": 80, "loop": 0}
    first.save(stream, Image.registered_extensions()[ending.lower()], **(moving if others else {}))
    return stream.getvalue()


def save_figure(figure: Figure, path: str | Path, dpi: int | None = None) -> None:
    """Save a figure, whole or not at all, with text that stays text.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        The figure.
    path : str or Path
        Where; its ending says the format, ``.png``, ``.svg`` or ``.pdf``. PDF has TrueType fonts, SVG words.
    dpi : int, optional
        Dots per inch: 150 of ``.png``, and 300 of fields in the others, without it. Journals ask for 300 to 600.

    Raises
    ------
    InputError
        For another ending, and for fewer than 50 or more than 1,200 dots, which would take gigabytes.
    ResultError
        Where the file cannot be written.

    Examples
    --------
    For a paper::

        fs.save_figure(fs.draw(history, style="paper"), "slip.pdf")
    """
    path = Path(path)
    if path.suffix.lower() not in _ENDINGS:
        raise InputError("save_figure", f"got '{path}'", f"needs a file that ends in {', '.join(_ENDINGS)}")
    if dpi is not None and not _FEWEST_DOTS <= dpi <= _MOST_DOTS:
        allowed = f"needs {_FEWEST_DOTS} to {_MOST_DOTS} dots per inch"
        raise InputError("save_figure.dpi", f"got {dpi}", allowed, "journals ask for 300 to 600")
    # The layout of panels to scale settles in a second pass, which a file is worth.
    figure.draw_without_rendering()
    write_bytes(path, figure_bytes(figure, path.suffix.removeprefix(".").lower(), dpi))
