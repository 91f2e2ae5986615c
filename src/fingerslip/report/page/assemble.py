"""The standard report of a study: the tables and figures that its runs call for."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence

import xarray as xr

from fingerslip.published import PublishedSet
from fingerslip.report.figures.convergence import convergence_figure
from fingerslip.report.figures.forces import force_overview_figure
from fingerslip.report.figures.held import held_figure, is_held
from fingerslip.report.figures.receptors import acceleration_overview_figure
from fingerslip.report.figures.study import event_times_figure, latency_figure
from fingerslip.report.labels import swept_text
from fingerslip.report.page.content import MOST_RUNS, ReportContent
from fingerslip.report.page.definitions import definitions
from fingerslip.report.page.page import DrawnPicture, Picture, Report, ReportSection
from fingerslip.report.page.pictures import RunToDraw
from fingerslip.report.page.run import has_receptors, model_pictures, picture_set, run_section
from fingerslip.report.page.samples import sample_sections
from fingerslip.report.page.sensor import cameras_section
from fingerslip.report.tables.compare import compare_table, statements_table
from fingerslip.report.tables.convergence import convergence_table
from fingerslip.report.tables.events import events_table, swept_paths
from fingerslip.report.tables.measures import measures_table
from fingerslip.report.tables.models import models_table
from fingerslip.report.tables.parameters import value_tables
from fingerslip.results import RunResult
from fingerslip.slip.free_edge import edge_warning
from fingerslip.slip.names import READINGS

__all__ = ["study_report"]


def study_report(content: ReportContent) -> Report:
    """Assemble the report of a study.

    Parameters
    ----------
    content : ReportContent
        Runs, histories, and what they are compared with.

    Returns
    -------
    Report
        Sections: slip events and how they are defined, comparison with published values, numerical uncertainty where it
        was studied, the runs side by side, what cameras saw, the model, all values with their sources, and each run in
        detail (folded, the first twelve). Of a study with samples: the intervals of the slip times, what moves them,
        all samples and all values.
    """
    if content.study.ranges:
        return _assembled(content, (*sample_sections(content), _values_section(content)))
    runs = [
        run_section(
            run,
            content.histories[run.name],
            content.titles[run.name],
            content.settings.peaks,
            content.drawn_already(run.name).contact,
        )
        for run in content.drawn
    ]
    sections = (
        _events_section(content),
        _comparison_section(content),
        _convergence_section(content),
        _side_by_side_section(content),
        cameras_section(content),
        _model_section(content),
        _values_section(content),
        *runs,
    )
    return _assembled(content, sections)


def _assembled(content: ReportContent, sections: Sequence[ReportSection]) -> Report:
    shown = tuple(section for section in sections if section.tables or section.pictures)
    return Report(content.title, shown, content.provenance)


def _events_section(content: ReportContent) -> ReportSection:
    runs, sentences = content.study.runs, definitions(content.settings)
    recorded = [name for name in READINGS if any(run.events.reading(name).recorded for run in runs)]
    lacking = [name for name in READINGS if name not in recorded]
    text = (
        *(sentences[name] for name in recorded),
        *(f"No times from {READINGS[name]}: no run records the signals." for name in lacking),
        sentences["latency"],
    )
    warning = edge_warning({content.titles[run.name]: run.edge for run in runs})
    tables = tuple(events_table(runs, name) for name in recorded)
    return ReportSection("Slip events", text, tables, warnings=(warning,) if warning else ())


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
    pictures = (*_swept_pictures(content), *_overview_pictures(content))
    return ReportSection("The runs side by side", (), tables, pictures)


def _swept_pictures(content: ReportContent) -> list[Picture]:
    """Draw event times against every swept number, and latency by every swept word; nothing where nothing slid."""
    if _are_held(content.titled_histories()):
        return []
    pictures, runs, reference = [], content.study.runs, _merged(content.references)
    for path in swept_paths(runs):
        values = list(dict.fromkeys(swept_text(run.swept[path]) for run in runs if path in run.swept))
        if len(values) < 2:
            continue
        name = path.replace(".", "-").replace("_", "-")
        if all(_is_quantity(value) for value in values):
            figure = event_times_figure(runs, path, reference)
            pictures.append(Picture(f"events-{name}", f"Slip events against {path}.", figure))
        else:
            figure = latency_figure(runs, path, reference)
            pictures.append(Picture(f"latency-{name}", f"Time from incipient to overall slip by {path}.", figure))
    return pictures


def _are_held(histories: Mapping[str, xr.Dataset]) -> bool:
    return bool(histories) and all(map(is_held, histories.values()))


def _overview_pictures(content: ReportContent) -> list[Picture]:
    histories, events = content.titled_histories(), content.titled_events()
    if _are_held(histories):
        said = "How the force changes, and how far bodies move, while nothing slides."
        return [Picture("held", said, held_figure(histories))]
    if len(histories) < 2:
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


def _merged(references: Sequence[PublishedSet]) -> PublishedSet | None:
    """Join published sets for a figure; the first stands for the paper."""
    if not references:
        return None
    values = tuple(value for reference in references for value in reference.values)
    return dataclasses.replace(references[0], values=values)


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


def _is_quantity(value: object) -> bool:
    if isinstance(value, bool):
        return False
    return isinstance(value, int | float) or (isinstance(value, str) and value.lstrip("+-.")[:1].isdigit())
