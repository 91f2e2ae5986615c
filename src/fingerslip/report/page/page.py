"""One self-contained HTML page: the answer, sections of text, tables and figures, and the provenance."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from html import escape
from importlib import resources
from pathlib import Path
from types import MappingProxyType
from typing import Any

from matplotlib.figure import Figure

from fingerslip.report.figures.style import figure_bytes
from fingerslip.report.page.motion import language
from fingerslip.storage.files import write_text
from fingerslip.tables.table import Cell, Missing, Table, is_numeric, texts

__all__ = ["DrawnPicture", "Picture", "Report", "ReportSection", "render_page", "write_page"]


@dataclass(frozen=True)
class Picture:
    """A figure in a report."""

    name: str  # short name, also that of its file
    caption: str  # what it shows, in a sentence
    figure: Figure  # the figure

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
    """A section of a report."""

    title: str  # its heading
    text: tuple[str, ...] = ()  # paragraphs
    tables: tuple[Table, ...] = ()  # tables, below the text
    pictures: tuple[Picture | DrawnPicture, ...] = ()  # figures, below the tables
    folded: bool = False  # whether the page shows the section only when it is opened
    warnings: tuple[str, ...] = ()  # paragraphs that stand out, above the text
    # runs in motion, as :func:`~fingerslip.report.page.motion.run_motion` gives them
    motions: tuple[Mapping[str, Any], ...] = ()
    body: str = ""  # finished HTML below the figures, such as the user's notes
    code: str = ""  # text that is shown as it is, to be copied

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing below its text."""
        return not (self.tables or self.pictures or self.motions or self.body or self.code)


@dataclass(frozen=True)
class Report:
    """A report."""

    title: str  # its title
    sections: tuple[ReportSection, ...]  # its sections, in order
    provenance: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    question: str = ""  # what was asked, in a sentence
    answer: tuple[str, ...] = ()  # what was found, in a few sentences
    hero: tuple[Picture | DrawnPicture, ...] = ()  # the picture of the answer

    @property
    def pictures(self) -> tuple[Picture | DrawnPicture, ...]:
        """All its pictures."""
        return (*self.hero, *(picture for section in self.sections for picture in section.pictures))


def render_page(report: Report) -> str:
    """Write a report as one HTML page that needs no other file."""
    anchors = {f"s{number}": section.title for number, section in enumerate(report.sections)}
    if report.provenance:
        anchors["provenance"] = "Provenance"
    moving = any(section.motions for section in report.sections)
    return _PAGE.format(
        title=escape(report.title),
        style=_asset("page.css"),
        lead=_lead(report),
        contents="".join(f'<li><a href="#{anchor}">{escape(title)}</a></li>' for anchor, title in anchors.items()),
        hero=f'<div class="hero">{"".join(map(_picture, report.hero))}</div>' if report.hero else "",
        sections="\n".join(_section(section, f"s{number}") for number, section in enumerate(report.sections)),
        provenance=_provenance(report.provenance),
        footer="Made with fingerslip. This page needs no other file and no network.",
        scripts=_scripts(("page.js", *(("motion.js", "solid.js") if moving else ())), moving),
    )


def _asset(name: str) -> str:
    return resources.files("fingerslip.report.page").joinpath("assets", name).read_text(encoding="utf-8")


def _scripts(names: Sequence[str], moving: bool) -> str:
    """Return the scripts of a page as one, and what they draw with."""
    code = "\n".join(_asset(name) for name in names)
    colours = _json("colour-language", language()) if moving else ""
    return f"{colours}<script>{code}</script>"


def _json(anchor: str, values: Mapping[str, Any]) -> str:
    """Return plain data for the scripts of a page; no text in it can end the script, or keep it from ending."""
    text = json.dumps(values, ensure_ascii=False, separators=(",", ":")).replace("<", "\\u003c")
    return f'<script type="application/json" id="{anchor}">{text}</script>'


def _lead(report: Report) -> str:
    question = f'<p class="question">{escape(report.question)}</p>' if report.question else ""
    sentences = "".join(f"<p>{escape(sentence)}</p>" for sentence in report.answer)
    return question + (f'<div class="answer">{sentences}</div>' if sentences else "")


def write_page(report: Report, path: str | Path) -> None:
    """Write a report to a file, whole or not at all."""
    write_text(Path(path), render_page(report))


def _section(section: ReportSection, anchor: str) -> str:
    body = "\n".join(
        (
            *(f'<p class="warning">{escape(paragraph)}</p>' for paragraph in section.warnings),
            *(f"<p>{escape(paragraph)}</p>" for paragraph in section.text),
            *((_player(section.motions, anchor),) if section.motions else ()),
            *(_table(table) for table in section.tables),
            *(_picture(picture) for picture in section.pictures),
            section.body,
            f'<pre tabindex="0"><code>{escape(section.code)}</code></pre>' if section.code else "",
        )
    )
    heading = f'<h2 id="{anchor}">{escape(section.title)}</h2>'
    if section.folded:
        return f"<details><summary>{heading}</summary>\n{body}\n</details>"
    return f'<section aria-labelledby="{anchor}">\n{heading}\n{body}\n</section>'


def _player(motions: Sequence[Mapping[str, Any]], anchor: str) -> str:
    """Return the player of runs in motion and their data."""
    choices = "".join(f'<option value="{n}">{escape(str(own["title"]))}</option>' for n, own in enumerate(motions))
    data = "\n".join(
        _json(f"{anchor}-run{number}", own).replace("<script ", "<script data-motion ", 1)
        for number, own in enumerate(motions)
    )
    return _PLAYER.format(choices=choices, hidden="" if len(motions) > 1 else " hidden") + data


def _table(table: Table) -> str:
    kinds = [
        f"{'number' if is_numeric(table, index) else 'text'}{' answers' if column.answers else ''}"
        for index, column in enumerate(table.columns)
    ]
    headings = [column.heading for column in table.columns]
    head = "".join(_cell("th", kind, heading, ' scope="col"') for kind, heading in zip(kinds, headings, strict=True))
    rows = "\n".join(
        _row(kinds, row, cells, number in table.marked)
        for number, (row, cells) in enumerate(zip(table.rows, texts(table), strict=True))
    )
    note = f'<p class="note">{escape(table.remarks)}</p>' if table.remarks else ""
    caption = f"<caption>{escape(table.title)}</caption>" if table.title else ""
    sortable = " data-sortable" if len(table.rows) >= _LEAST_SORTED else ""
    return (
        f'<div class="table" tabindex="0"><table{sortable}>{caption}<thead><tr>{head}</tr></thead>\n'
        f"<tbody>\n{rows}\n</tbody></table></div>{note}"
    )


def _row(kinds: Sequence[str], row: Sequence[Cell], shown: Sequence[str], marked: bool) -> str:
    cells = "".join(
        _cell("td", kind, text, f' title="{escape(cell.meaning, quote=True)}"' if isinstance(cell, Missing) else "")
        for kind, text, cell in zip(kinds, shown, row, strict=True)
    )
    return f'<tr class="marked">{cells}</tr>' if marked else f"<tr>{cells}</tr>"


def _cell(tag: str, kind: str, text: str, more: str = "") -> str:
    """Write a cell; short texts keep to one line, and an uncertainty to its sign."""
    words = f"{kind} short" if len(text) <= _SHORT else kind
    return f'<{tag} class="{words}"{more}>{escape(text).replace("± ", "±&nbsp;")}</{tag}>'


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
    return f'<section aria-labelledby="provenance"><h2 id="provenance">Provenance</h2>\n<dl>\n{items}\n</dl></section>'


_SHORT = 24  # letters
_LEAST_SORTED = 3  # rows

_PLAYER = """<div class="motion">
<div class="controls">
<label{hidden}>run <select data-part="run">{choices}</select></label>
<button type="button" data-part="play">Play</button>
<input type="range" min="0" max="1" value="0" step="1" data-part="time" aria-label="time">
<label>colour <select data-part="field"><option value="stress">von Mises stress</option>\
<option value="layers">layers</option><option value="contact">contact</option></select></label>
<label><input type="checkbox" data-part="open" checked> cut open</label>
</div>
<output data-part="said"></output>
<div class="views">
<div><canvas data-part="body" role="img" aria-label="The deformed body at the time of the slider."></canvas>
<div class="bar" data-part="bar"></div></div>
<div><canvas data-part="plots" role="img" aria-label="Slip map and signals over time, with the events."></canvas></div>
</div>
<ul class="keys" data-part="keys"></ul>
</div>
"""

_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="generator" content="fingerslip">
<link rel="icon" href="data:,">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<a class="skip" href="#content">To the content</a>
<header>
<h1>{title}</h1>
{lead}
</header>
<nav aria-label="Contents"><ul>{contents}</ul></nav>
<main id="content" tabindex="-1">
{hero}
{sections}
{provenance}
</main>
<footer>{footer}</footer>
{scripts}
</body>
</html>
"""
