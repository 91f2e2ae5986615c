"""The standard report of a study: the tables and figures that its runs call for."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from fingerslip.report.figures.contact import energy_figure, force_overview_figure
from fingerslip.report.figures.receptors import acceleration_overview_figure
from fingerslip.report.figures.study import convergence_figure
from fingerslip.report.page.answer import answer
from fingerslip.report.page.content import MOST_RUNS, ReportContent
from fingerslip.report.page.definitions import definitions
from fingerslip.report.page.hero import are_held, hero_pictures, swept_pictures
from fingerslip.report.page.motion import run_motions
from fingerslip.report.page.notes import bibtex_entries
from fingerslip.report.page.page import DrawnPicture, Picture, Report, ReportSection
from fingerslip.report.page.pictures import RunToDraw
from fingerslip.report.page.run import has_receptors, model_pictures, picture_set, run_section
from fingerslip.report.page.samples import sample_sections, samples_in_motion
from fingerslip.report.page.sensor import cameras_section
from fingerslip.report.tables.compare import compare_table, convergence_table, statements_table
from fingerslip.report.tables.parameters import conditions_table, models_table, value_tables
from fingerslip.report.tables.runs import energies_table, events_table, measures_table
from fingerslip.results import RunResult
from fingerslip.slip.front import edge_warning
from fingerslip.slip.windows import NOTICED_NOTE, READINGS

__all__ = ["study_report"]


def study_report(content: ReportContent) -> Report:
    """Assemble the report of a study."""
    if content.study.ranges:
        sections = (
            *sample_sections(content),
            samples_in_motion(content),
            _conditions_section(content),
            _notes_section(content),
        )
        return _assemble(content, (*sections, _values_section(content)))
    runs = [
        run_section(
            run,
            content.histories[run.name],
            content.titles[run.name],
            content.settings.peaks,
            content.drawn_already(run.name).contact,
        )
        for run in content.detailed_runs
    ]
    sections = (
        _events_section(content),
        _definitions_section(content),
        _comparison_section(content),
        _motion_section(content),
        _side_by_side_section(content),
        cameras_section(content),
        _conditions_section(content),
        _notes_section(content),
        _energy_section(content),
        _convergence_section(content),
        _model_section(content),
        _values_section(content),
        *runs,
    )
    return _assemble(content, sections, hero_pictures(content))


def _assemble(content: ReportContent, sections: Sequence[ReportSection], hero: tuple[Picture, ...] = ()) -> Report:
    citations = bibtex_entries(content.values, content.references)
    said = "What these results rest on, as BibTeX."
    shown = (*sections, ReportSection("Citations", (said,), code=citations, folded=True))
    return Report(
        content.title,
        tuple(section for section in shown if not section.is_empty),
        content.provenance,
        question=content.study.description,
        answer=answer(content.study, content.starts, content.references),
        hero=hero,
    )


def _motion_section(content: ReportContent) -> ReportSection:
    """Show runs in motion, as many as keep the page small."""
    motions = run_motions((content.histories[run.name], run.events, content.titles[run.name]) for run in content.drawn)
    text = [f"Move the slider or the plots; a body that was recorded is drawn deformed, to scale. {NOTICED_NOTE}"]
    if len(motions) < len(content.study.runs):
        text.append(
            f"The first {len(motions)} of {len(content.study.runs)} runs can be seen here, to keep the page small."
        )
    return ReportSection("In motion", tuple(text), motions=motions)


def _conditions_section(content: ReportContent) -> ReportSection:
    table = conditions_table(content.values, content.titled_histories())
    return ReportSection("What was run", (), (table,) if content.values else ())


def _notes_section(content: ReportContent) -> ReportSection:
    return ReportSection("Notes", body=content.notes)


def _energy_section(content: ReportContent) -> ReportSection:
    histories = content.titled_histories()
    if not histories:
        return ReportSection("Energy balance")
    title, history = next(iter(histories.items()))
    said = "Where the work of the plate goes." if len(histories) == 1 else f"Where the work of the plate goes: {title}."
    picture = Picture("energy-balance", said, energy_figure(history, "" if len(histories) == 1 else title))
    return ReportSection("Energy balance", (), (energies_table(histories),), (picture,))


def _events_section(content: ReportContent) -> ReportSection:
    runs = content.study.runs
    recorded = [name for name in READINGS if any(run.events.reading(name).recorded for run in runs)]
    lacking = [name for name in READINGS if name not in recorded]
    text = tuple(f"No times from {READINGS[name]}: no run records the signals." for name in lacking)
    warning = edge_warning({content.titles[run.name]: run.edge for run in runs})
    tables = tuple(events_table(runs, name) for name in recorded)
    return ReportSection("Slip events", text, tables, warnings=(warning,) if warning else ())


def _definitions_section(content: ReportContent) -> ReportSection:
    sentences = definitions(content.settings)
    recorded = [name for name in READINGS if any(run.events.reading(name).recorded for run in content.study.runs)]
    body = "".join(f"<p>{escape(sentences[name])}</p>" for name in (*recorded, "latency"))
    return ReportSection("How slip events are defined", body=body, folded=True)


def _comparison_section(content: ReportContent) -> ReportSection:
    tables = (
        *(compare_table(content.study.runs, reference) for reference in content.references),
        *(statements_table(reference) for reference in content.references),
    )
    notes = tuple(dict.fromkeys(reference.note for reference in content.references))
    return ReportSection("Comparison with published values", notes, tuple(table for table in tables if table.rows))


def _convergence_section(content: ReportContent) -> ReportSection:
    found = {content.titles[name]: (name, one) for name, one in list(content.convergences.items())[:MOST_RUNS]}
    tables = tuple(convergence_table(quantities, title) for title, (_, quantities) in found.items())
    said = "How the slip events change as the element size, the time step and the contact compliance go to zero."
    pictures = tuple(
        Picture(f"{name}-convergence", said, convergence_figure(quantities, title))
        for title, (name, quantities) in found.items()
    )
    return ReportSection("Numerical uncertainty", (), tables, pictures, folded=True)


def _side_by_side_section(content: ReportContent) -> ReportSection:
    runs = content.study.runs[:MOST_RUNS]
    tables = (measures_table(runs, [content.titles[run.name] for run in runs]),) if len(runs) > 1 else ()
    pictures = (*swept_pictures(content, slice(1, None)), *_overview_pictures(content))
    return ReportSection("The runs side by side", (), tables, pictures)


def _overview_pictures(content: ReportContent) -> list[Picture]:
    histories, events = content.titled_histories(), content.titled_events()
    if are_held(histories) or len(histories) < 2:
        return []
    kinds = [picture_set(history) for history in histories.values()]
    pictures = kinds[0].side_by_side(histories, events) if all(kind is kinds[0] for kind in kinds) else []
    said = "Tangential over normal force and the area fraction that slips at each time."
    pictures.append(Picture("forces", said, force_overview_figure(histories, events)))
    if all(has_receptors(history) for history in histories.values()):
        said = "The signal in which acceleration peaks are looked for."
        figure = acceleration_overview_figure(histories, events, content.settings.peaks)
        pictures.append(Picture("acceleration-peaks", said, figure))
    return pictures


def _model_section(content: ReportContent) -> ReportSection:
    pictures = [picture for run in content.study.runs for picture in _model_pictures(content, run)]
    return ReportSection("The model", (), (), tuple(pictures))


def _model_pictures(content: ReportContent, run: RunResult) -> Sequence[Picture | DrawnPicture]:
    drawn = content.drawn_already(run.name).model
    if drawn is not None:
        return drawn
    if run.name not in content.meshes or run.name not in content.histories:
        return ()
    history = content.histories[run.name]
    shown = RunToDraw(run.name, content.titles[run.name], history, run.events)
    return model_pictures(shown, content.meshes[run.name])


def _values_section(content: ReportContent) -> ReportSection:
    said = (
        "All values that the runs were made with, as their run.yaml says, with the source of each. 'study file' stands "
        "for what the study sets, 'default' for what it leaves to the program, 'not used' for values of the specimen "
        "that no equation of these runs contains."
    )
    tables = value_tables(content.values)
    computed = models_table(content.titled_histories())
    shown = (*tables, computed) if computed.rows else tables
    return ReportSection("Values and their sources", (said,) if tables else (), shown)
