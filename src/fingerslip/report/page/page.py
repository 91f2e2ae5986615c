"""One self-contained HTML page: sections of text, tables and figures, and the provenance."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from html import escape
from pathlib import Path
from types import MappingProxyType

from matplotlib.figure import Figure

from fingerslip.files import write_text
from fingerslip.report.figures.save import figure_bytes
from fingerslip.report.tables.table import Table, is_numeric, texts

__all__ = ["DrawnPicture", "Picture", "Report", "ReportSection", "render_page", "write_page"]


@dataclass(frozen=True)
class Picture:
    """A figure in a report.

    Parameters
    ----------
    name : str
        Short name, also that of its file.
    caption : str
        What it shows, in a sentence.
    figure : Figure
        The figure.
    """

    name: str
    caption: str
    figure: Figure

    @cached_property
    def png(self) -> bytes:
        """The figure as PNG, rendered once."""
        return figure_bytes(self.figure)


@dataclass(frozen=True)
class DrawnPicture:
    """A picture of a report that is rendered already; see :class:`Picture`."""

    name: str
    caption: str
    png: bytes


@dataclass(frozen=True)
class ReportSection:
    """A section of a report.

    Parameters
    ----------
    title : str
        Its heading.
    text : tuple of str
        Paragraphs.
    tables : tuple of Table
        Tables, below the text.
    pictures : tuple of Picture or DrawnPicture
        Figures, below the tables.
    folded : bool
        Whether the page shows the section only when it is opened.
    warnings : tuple of str
        Paragraphs that stand out, above the text.
    """

    title: str
    text: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    pictures: tuple[Picture | DrawnPicture, ...] = ()
    folded: bool = False
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Report:
    """A report.

    Parameters
    ----------
    title : str
        Its title.
    sections : tuple of ReportSection
        Its sections, in order.
    provenance : mapping of str to str
        Programs, commit and times that made the results.
    """

    title: str
    sections: tuple[ReportSection, ...]
    provenance: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))


def render_page(report: Report) -> str:
    """Write a report as one HTML page that needs no other file.

    Parameters
    ----------
    report : Report
        The report.

    Returns
    -------
    str
        The page; every text of the report is escaped.
    """
    contents = "".join(f'<li><a href="#s{i}">{escape(s.title)}</a></li>' for i, s in enumerate(report.sections))
    sections = "\n".join(_section(section, f"s{number}") for number, section in enumerate(report.sections))
    return _PAGE.format(
        title=escape(report.title),
        style=_STYLE,
        contents=contents,
        sections=sections,
        provenance=_provenance(report.provenance),
    )


def write_page(report: Report, path: str | Path) -> None:
    """Write a report to a file, whole or not at all.

    Raises
    ------
    ResultError
        Where the file cannot be written.
    """
    write_text(Path(path), render_page(report))


def _section(section: ReportSection, anchor: str) -> str:
    body = "\n".join(
        (
            *(f'<p class="warning">{escape(paragraph)}</p>' for paragraph in section.warnings),
            *(f"<p>{escape(paragraph)}</p>" for paragraph in section.text),
            *(_table(table) for table in section.tables),
            *(_picture(picture) for picture in section.pictures),
        )
    )
    heading = f'<h2 id="{anchor}">{escape(section.title)}</h2>'
    if section.folded:
        return f"<details><summary>{heading}</summary>\n{body}\n</details>"
    return f"<section>\n{heading}\n{body}\n</section>"


def _table(table: Table) -> str:
    kinds = ["number" if is_numeric(table, index) else "text" for index in range(len(table.columns))]
    headings = [column.heading for column in table.columns]
    head = "".join(_cell("th", kind, heading) for kind, heading in zip(kinds, headings, strict=True))
    rows = "\n".join(_row(kinds, row, number in table.marked) for number, row in enumerate(texts(table)))
    note = f'<p class="note">{escape(table.remarks)}</p>' if table.remarks else ""
    caption = f"<caption>{escape(table.title)}</caption>" if table.title else ""
    return (
        f'<div class="table"><table>{caption}<thead><tr>{head}</tr></thead>\n'
        f"<tbody>\n{rows}\n</tbody></table></div>{note}"
    )


def _row(kinds: Sequence[str], row: Sequence[str], marked: bool) -> str:
    cells = "".join(_cell("td", kind, text) for kind, text in zip(kinds, row, strict=True))
    return f'<tr class="marked">{cells}</tr>' if marked else f"<tr>{cells}</tr>"


def _cell(tag: str, kind: str, text: str) -> str:
    """Write a cell; short texts keep to one line."""
    words = f"{kind} short" if len(text) <= _SHORT else kind
    return f'<{tag} class="{words}">{escape(text)}</{tag}>'


def _picture(picture: Picture | DrawnPicture) -> str:
    data = base64.b64encode(picture.png).decode("ascii")
    alternative = escape(picture.caption, quote=True)
    source = f"data:image/png;base64,{data}"
    return (
        f'<figure id="{escape(picture.name, quote=True)}"><img alt="{alternative}" src="{source}">'
        f"<figcaption>{escape(picture.caption)}</figcaption></figure>"
    )


def _provenance(values: Mapping[str, str]) -> str:
    if not values:
        return ""
    items = "\n".join(f"<dt>{escape(name)}</dt><dd>{escape(str(value))}</dd>" for name, value in values.items())
    return f'<section><h2 id="provenance">Provenance</h2>\n<dl>\n{items}\n</dl></section>'


_SHORT = 24  # letters

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; color: #1c1c1c; background: #fff; margin: 0 auto; max-width: 1080px;
  padding: 2rem 1.5rem 4rem; }
h1 { font-size: 1.7rem; line-height: 1.25; margin: 0 0 .8rem; }
h2 { font-size: 1.2rem; margin: 2.2rem 0 .6rem; border-bottom: 1px solid #ddd; padding-bottom: .2rem; }
nav ul { columns: 2; padding-left: 1.1rem; margin: 0; }
a { color: #0072b2; }
summary { cursor: pointer; }
summary h2 { display: inline-block; margin: .6rem 0; border: 0; font-size: 1.05rem; }
.table { overflow-x: auto; }
table { border-collapse: collapse; font-size: .88rem; margin: .8rem 0 .3rem; }
caption { text-align: left; font-weight: 600; padding: .2rem 0; }
th, td { padding: .22rem .7rem; border-bottom: 1px solid #e4e4e4; vertical-align: top; text-align: left; }
thead th { border-bottom: 2px solid #888; vertical-align: bottom; }
.number { text-align: right; font-variant-numeric: tabular-nums; }
.short, td.number { white-space: nowrap; }
.marked td:nth-child(3) { font-weight: 600; color: #a84300; }
.warning { border-left: 4px solid #d55e00; background: #fdf1e8; padding: .5rem .8rem; margin: .8rem 0; }
.note, figcaption { color: #555; font-size: .86rem; margin: .2rem 0 1rem; }
figure { margin: 1.2rem 0; }
img { max-width: 100%; height: auto; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .15rem 1.2rem; font-size: .88rem; }
dt { color: #555; }
dd { margin: 0; overflow-wrap: anywhere; }
"""

_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<h1>{title}</h1>
<nav><ul>{contents}</ul></nav>
{sections}
{provenance}
</body>
</html>
"""
