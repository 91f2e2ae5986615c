"""Words of a page from files of a study: notes, and the works to cite."""

from __future__ import annotations

import base64
import html
import mimetypes
import re
from collections.abc import Iterable, Sequence
from importlib import resources
from pathlib import Path
from urllib.parse import unquote, urlparse

from markdown_it import MarkdownIt
from markdown_it.token import Token

from fingerslip.errors import ResultError
from fingerslip.published import PublishedSet
from fingerslip.report.tables.parameters import ShownValue
from fingerslip.version import __version__

# Every table of slip events has the share that people notice.
_NOTICED = "barrea2018"
_ENTRY = re.compile(r"^@\w+\{([^,]+),.*?^\}", re.MULTILINE | re.DOTALL)
_PROGRAM = f"""@misc{{fingerslip,
  title  = {{fingerslip: a finite-element toolkit for fingertip slip}},
  author = {{{{The fingerslip developers}}}},
  note   = {{Version {__version__}}},
  year   = {{2026}},
}}"""


def bibliography() -> dict[str, str]:
    """Return the entries of the papers that values and comparisons are from, by their keys."""
    text = resources.files("fingerslip").joinpath("references.bib").read_text(encoding="utf-8")
    return {entry.group(1): entry.group(0) for entry in _ENTRY.finditer(text)}


def bibtex_entries(values: Sequence[ShownValue], references: Iterable[PublishedSet]) -> str:
    """Return the entries of all that a study rests on."""
    named = {word for value in values for word in re.findall(r"\w+", value.source)}
    named |= {reference.name.partition("-")[0] for reference in references} | {_NOTICED}
    return "\n\n".join([_PROGRAM, *(entry for key, entry in bibliography().items() if key in named)])


#: File in the folder of a study's results, and the folder of figures beside it.
NOTES, PICTURES = "notes.md", "notes"

_TYPES = {".png", ".jpg", ".jpeg", ".gif", ".webp", ".svg"}
# Headings of the notes stand below the page's own.
_DEEPER = 2


def notes_html(folder: Path) -> str:
    """Return the notes of a study as HTML without any file beside it; empty where there are none.

    ``notes.md`` is Markdown; HTML in it is shown as text. Its pictures are files of the folder. Figures in ``notes/``
    that it does not show follow below it, each with its name.
    """
    embedded: set[Path] = set()
    path = folder / NOTES
    try:
        text = path.read_text(encoding="utf-8") if path.is_file() else ""
    except (OSError, UnicodeDecodeError) as error:
        raise ResultError(f"{path}: cannot be read as text ({error})") from None
    body = _render(text, folder, embedded) if text else ""
    others = (path for path in sorted((folder / PICTURES).glob("*")) if path.suffix.lower() in _TYPES)
    figures = (_figure(path) for path in others if path.resolve() not in embedded)
    return "\n".join(filter(None, (body, *figures)))


def _render(text: str, folder: Path, embedded: set[Path]) -> str:
    reader = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens = reader.parse(text)
    for token in tokens:
        if token.type.startswith("heading_"):
            token.tag = f"h{min(int(token.tag[1]) + _DEEPER, 6)}"
        for child in token.children or ():
            if child.type == "image":
                embedded.add(_embed_picture(child, folder))
    page = str(reader.renderer.render(tokens, reader.options, {}))
    return page.replace("<table>", '<div class="table"><table>').replace("</table>", "</table></div>")


def _embed_picture(image: Token, folder: Path) -> Path:
    """Put the bytes of a picture into its link, and return its path."""
    source = str(image.attrs["src"])
    if urlparse(source).scheme:
        raise ResultError(
            f"{folder / NOTES}: shows '{source}'; a report needs no network: save the picture beside the notes"
        )
    path = (folder / unquote(source)).resolve()
    if not path.is_file() or path.suffix.lower() not in _TYPES:
        raise ResultError(
            f"{folder / NOTES}: shows '{source}', which is not there; needs a file that ends in "
            f"{', '.join(sorted(_TYPES))}, named from {folder}"
        )
    image.attrs["src"] = _data(path)
    return path


def _data(path: Path) -> str:
    kind = mimetypes.guess_type(path.name)[0] or "image/png"
    return f"data:{kind};base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"


def _figure(path: Path) -> str:
    words = html.escape(re.sub(r"[-_]+", " ", path.stem), quote=True)
    return f'<figure><img alt="{words}" src="{_data(path)}"><figcaption>{words}</figcaption></figure>'
