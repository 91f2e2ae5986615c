"""One self-contained HTML page: the answer, sections of text, tables and figures, and the provenance.

Pictures go from one process to another: loading this loads nothing that draws.
"""

from __future__ import annotations

import base64
import functools
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from fingerslip.report.labels import asset
from fingerslip.storage.files import write_text
from fingerslip.tables.table import Table, is_numeric, texts

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Picture:
    """A figure in a report."""

    name: str  # short name, also that of its file
    caption: str  # what it shows, in a sentence
    figure: Figure | None  # the figure; None where it is rendered already
    rendered: bytes = b""  # the figure as PNG, where it is

    @cached_property
    def png(self) -> bytes:
        """The figure as PNG, rendered once."""
        if self.figure is None:
            return self.rendered
        from fingerslip.report.figures.style import final_bytes

        return final_bytes(self.figure)


@dataclass(frozen=True)
class ReportSection:
    """A section of a report."""

    title: str  # its heading
    text: tuple[str, ...] = ()  # paragraphs
    tables: tuple[Table, ...] = ()  # tables, below the text
    pictures: tuple[Picture, ...] = ()  # figures, below the tables
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
    hero: tuple[Picture, ...] = ()  # the picture of the answer
    quote: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))  # what to quote, under headings

    @property
    def pictures(self) -> tuple[Picture, ...]:
        """All its pictures."""
        return (*self.hero, *(picture for section in self.sections for picture in section.pictures))


def render_page(report: Report) -> str:
    """Write a report as one HTML page that needs no other file."""
    from fingerslip.report.page.motion import language

    moving = any(section.motions for section in report.sections)
    text: str = _page_template().render(report=report, language=language() if moving else None)
    return text


@functools.cache
def _page_template() -> Any:
    # Only who writes a page needs templates.
    import jinja2

    environment = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters["texts"] = texts
    environment.filters["base64"] = lambda data: base64.b64encode(data).decode("ascii")
    environment.globals |= {"is_numeric": is_numeric, "asset": asset}
    environment.policies["json.dumps_kwargs"] = {"ensure_ascii": False, "separators": (",", ":")}
    return environment.from_string(asset("page.html"))


def write_page(report: Report, path: str | Path) -> None:
    """Write a report to a file, whole or not at all."""
    write_text(Path(path), render_page(report))
