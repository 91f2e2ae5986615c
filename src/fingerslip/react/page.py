"""The page of a study with reactions: answer, figures, a film, tables with sources."""

from __future__ import annotations

import base64
import dataclasses
from pathlib import Path

from fingerslip.react.answer import Reactions, answer, cell_table, paper_table, source_table, trial_table
from fingerslip.react.figures import map_figure, margin_figure, outcome_figure
from fingerslip.react.results import FILM, STILL
from fingerslip.report.content import ReportContent
from fingerslip.report.page.assemble import bibtex_entries, uncertainty_section
from fingerslip.report.page.page import Picture, Report, ReportSection
from fingerslip.report.tables.parameters import value_tables
from fingerslip.tables.table import Table

__all__ = ["reaction_report", "reaction_tables"]

_FILM_WORDS = (
    "The object between two fingers; colours are stress, dots on the skin stick or slip. Below: what the load pulls,"
    " and what friction bears; the object slides where the load is more. Slowed down."
)


def reaction_tables(reactions: Reactions) -> tuple[Table, ...]:
    """Return the tables that the command line prints: all runs, and the answer with the reactions at the centre."""
    trials, said = trial_table(reactions), " ".join(answer(reactions))
    tables = (cell_table(reactions), *((trials,) if trials.rows else ()))
    return (*tables[:-1], dataclasses.replace(tables[-1], note=f"{said} {tables[-1].note}"))


def reaction_report(content: ReportContent, reactions: Reactions) -> Report:
    """Assemble the page of a study with reactions."""
    settings, study = reactions.settings, content.study
    centre = study.folder / reactions.runs[reactions.centre].name
    trials, has_map = trial_table(reactions), bool(reactions.panels(settings.detector))
    map_words = (
        f"Longest latency after '{settings.detector}' that saves the object; lines bound what some reactions save."
    )
    margin_words = "Critical latency against the rate of the load, and the travel that a latency costs."
    outcome_words = f"What comes of each reaction after each detector, at {reactions.where}: time to spare, and travel."
    margin = has_map or reactions.result.travels
    sections = (
        ReportSection("Saved and lost", body=_film_html(centre / FILM, centre / STILL)),
        ReportSection(
            "What a latency costs",
            pictures=(Picture("reaction-margin", margin_words, margin_figure(reactions)),) if margin else (),
        ),
        ReportSection(
            "Which reactions save it",
            tables=(trials,) if trials.rows else (),
            pictures=(Picture("reaction-outcome", outcome_words, outcome_figure(reactions)),) if trials.rows else (),
        ),
        uncertainty_section(content),
        ReportSection("Reactions and their sources", tables=(source_table(), paper_table()), folded=True),
        ReportSection("All runs", tables=(cell_table(reactions),), folded=has_map),
        ReportSection("Notes", body=content.notes),
        ReportSection("Values and their sources", tables=tuple(value_tables(content.values)), folded=True),
        ReportSection("Citations", code=bibtex_entries(content.values, ()), folded=True),
    )
    return Report(
        content.title,
        tuple(section for section in sections if not section.is_empty),
        content.provenance,
        question=study.description,
        answer=answer(reactions),
        hero=(Picture("reaction-map", map_words, map_figure(reactions)),) if has_map else (),
    )


def _film_html(film: Path, still: Path) -> str:
    """Return a film and its last frame as HTML without any file beside it; nothing without a film."""
    if not film.is_file():
        return ""
    video, poster = (base64.b64encode(path.read_bytes()).decode("ascii") for path in (film, still))
    look = 'style="width:100%" controls muted loop playsinline'
    player = f'<video {look} poster="data:image/png;base64,{poster}" src="data:video/mp4;base64,{video}"></video>'
    return f"<figure>{player}<figcaption>{_FILM_WORDS}</figcaption></figure>"
