"""The standard report of a study: which tables and figures its runs call for."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
import skfem
import xarray as xr

from fingerslip.published import PublishedSet
from fingerslip.report.figures.convergence import convergence_figure
from fingerslip.report.figures.save import (
    acceleration_figure,
    acceleration_overview_figure,
    contact_displacement_figure,
    energy_figure,
    event_times_figure,
    force_figure,
    force_overview_figure,
    latency_figure,
    section_figure,
    slip_maps_figure,
    strain_energy_density_figure,
)
from fingerslip.report.figures.section import receptor_positions
from fingerslip.report.page.assemble_solid import is_solid, solid_overview, solid_pictures, solid_scene
from fingerslip.report.page.page import Picture, Report, ReportSection, parameters_table
from fingerslip.report.tables.convergence import convergence_table
from fingerslip.report.tables.events import (
    WAYS,
    RunEvents,
    compare_table,
    events_table,
    peaks_table,
    statements_table,
    ways_table,
)
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.slip import Events, EventSettings, acceleration_peaks
from fingerslip.specimens.fingertip import PresetValue
from fingerslip.uncertainty import Convergence

__all__ = ["StudyResults", "definitions", "study_report"]

# More panels than this in one figure are too small to read, more runs in detail too long a page.
_PANELS_AT_MOST = 12


@dataclass(frozen=True)
class StudyResults:
    """What a study's report is made of.

    Parameters
    ----------
    title : str
        The study's title.
    runs : tuple of RunEvents
        The finished runs.
    histories : mapping of str to xarray.Dataset
        Their histories by label; a run without one appears in the tables only.
    meshes : mapping of str to skfem.Mesh
        Meshes by label of the run, for the figure of the section.
    references : tuple of PublishedSet
        Published values to compare with.
    parameters : tuple of PresetValue
        Parameters with their sources.
    provenance : mapping of str to str
        What made the results.
    settings : EventSettings
        The constants that the events were found with.
    convergences : mapping of str to mapping of str to Convergence
        What refinement gave, by label of the run and key of the number; runs that were not refined are left out.
    """

    title: str
    runs: tuple[RunEvents, ...]
    histories: Mapping[str, xr.Dataset]
    meshes: Mapping[str, skfem.Mesh] = field(default_factory=lambda: MappingProxyType({}))
    references: tuple[PublishedSet, ...] = ()
    parameters: tuple[PresetValue, ...] = ()
    provenance: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    settings: EventSettings = field(default_factory=EventSettings)
    convergences: Mapping[str, Mapping[str, Convergence]] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def events(self) -> dict[str, Events]:
        """Events by label of the run."""
        return {run.label: run.events for run in self.runs}


def study_report(results: StudyResults) -> Report:
    """Assemble the report of a study.

    Parameters
    ----------
    results : StudyResults
        Runs, histories and what they are compared with.

    Returns
    -------
    Report
        Sections: slip events and how they are defined, comparison with published values, numerical
        uncertainty where it was studied, the runs side by side,
        the section, the parameters with the assumed ones first, and each run in detail (folded, the first twelve).
    """
    sections = (
        _events_section(results),
        _comparison_section(results),
        _convergence_section(results),
        _overview_section(results),
        _section_section(results),
        _parameters_section(results),
        *(_run_section(results, run) for run in results.runs[:_PANELS_AT_MOST] if run.label in results.histories),
    )
    shown = tuple(section for section in sections if section.tables or section.pictures)
    return Report(results.title, shown, results.provenance)


def definitions(settings: EventSettings) -> tuple[str, ...]:
    """Say in a sentence for each way of reading how the slip events are defined."""
    slip, line = 1e6 * settings.slip_tolerance, 1e6 * settings.displacement_tolerance
    shares = [
        f"{100 * share:g} %"
        for share in (
            settings.incipient_fraction,
            settings.noticed_fraction,
            settings.three_quarter_fraction,
            settings.overall_fraction,
        )
    ]
    kinds = " and ".join(settings.peaks.kinds)
    by_slip = (
        f"From accumulated slip: incipient, noticed, three-quarter and overall slip are the first times from which at "
        f"least {', '.join(shares[:-1])} and {shares[-1]} of the area that has been in contact since the slide began "
        f"has slipped by more than {slip:g} µm since then, for {1e3 * settings.sustained:g} ms or up to the end of the "
        f"slide."
    )
    by_displacement = (
        f"From displacement: the times at which the first node, {shares[1]}, {shares[2]} and all of the nodes in "
        f"contact when the slide began have left the plate's line by more than {line:g} µm."
    )
    by_acceleration = (
        f"From acceleration: overall slip is the most prominent peak of the largest acceleration along the plate at "
        f"{kinds} around the edges of the contact after the transient of the press-to-slide change, after which the "
        f"skin no longer goes along; incipient slip is the first peak before it that stands "
        f"{settings.peaks.over_noise:g} spreads out of the noise, three-quarter slip the most prominent one between."
    )
    latency = "Latency is the time from incipient to overall slip. A dash stands for an event that did not happen."
    return (by_slip, by_displacement, by_acceleration, latency)


def _events_section(results: StudyResults) -> ReportSection:
    tables = tuple(events_table(results.runs, way) for way in WAYS)
    return ReportSection("Slip events", definitions(results.settings), tables)


def _comparison_section(results: StudyResults) -> ReportSection:
    beside = [compare_table(results.runs, reference) for reference in results.references]
    said = [statements_table(reference) for reference in results.references]
    notes = tuple(dict.fromkeys(reference.note for reference in results.references))
    return ReportSection("Beside published values", notes, tuple(table for table in (*beside, *said) if table.rows))


def _convergence_section(results: StudyResults) -> ReportSection:
    found = dict(list(results.convergences.items())[:_PANELS_AT_MOST])
    tables = tuple(convergence_table(quantities.values(), label) for label, quantities in found.items())
    said = "How the slip events move as the element size, the time step and the contact compliance go to zero."
    pictures = tuple(
        Picture(f"{label}-convergence", said, convergence_figure(quantities, label))
        for label, quantities in found.items()
    )
    return ReportSection("Numerical uncertainty", (), tables, pictures, folded=True)


def _overview_section(results: StudyResults) -> ReportSection:
    pictures = [*_swept_pictures(results)]
    histories = dict(list(results.histories.items())[:_PANELS_AT_MOST])
    if len(histories) > 1:
        events = results.events
        if any(is_solid(history) for history in histories.values()):
            pictures += solid_overview(histories)
        else:
            said = "Where and when the surface sticks and slips."
            pictures.append(Picture("slip-maps", said, slip_maps_figure(histories, events)))
        pictures += [
            Picture(
                "forces",
                "Tangential over normal force and the area fraction that slips at each time.",
                force_overview_figure(histories, events),
            ),
        ]
        if all(_has_receptors(history) for history in histories.values()):
            pictures.append(_peaks_picture(histories, results))
    return ReportSection("The runs side by side", (), (), tuple(pictures))


def _peaks_picture(histories: Mapping[str, xr.Dataset], results: StudyResults) -> Picture:
    figure = acceleration_overview_figure(histories, results.events, results.settings.peaks)
    return Picture("acceleration-peaks", "The signal in which acceleration peaks are looked for.", figure)


def _swept_pictures(results: StudyResults) -> list[Picture]:
    """Draw event times against every swept number and latency by every swept word."""
    pictures = []
    reference = _merged(results.references)
    for path in dict.fromkeys(path for run in results.runs for path in run.swept):
        values = list(dict.fromkeys(run.swept[path] for run in results.runs if path in run.swept))
        if len(values) < 2:
            continue
        name = path.replace(".", "-").replace("_", "-")
        if all(_is_quantity(value) for value in values):
            figure = event_times_figure(results.runs, path, reference)
            pictures.append(Picture(f"events-{name}", f"Slip events against {path}.", figure))
        else:
            figure = latency_figure(results.runs, path, reference)
            pictures.append(Picture(f"latency-{name}", f"Time from incipient to overall slip by {path}.", figure))
    return pictures


def _merged(references: Sequence[PublishedSet]) -> PublishedSet | None:
    """Join published sets for a figure; the first stands for the paper."""
    if not references:
        return None
    values = tuple(value for reference in references for value in reference.values)
    return dataclasses.replace(references[0], values=values)


def _section_section(results: StudyResults) -> ReportSection:
    shown = {label: results.histories[label] for label in results.meshes if label in results.histories}
    pictures = [
        Picture(
            f"section-{label}",
            f"Layers, elements, receptors and plate of {label}, before the plate moves.",
            section_figure(results.meshes[label], receptor_positions(history), title=label),
        )
        for label, history in shown.items()
        if not is_solid(history)
    ]
    pictures += [
        Picture(f"scene-{label}", f"Layers, elements and plate of {label}, cut open.", solid_scene(history, label))
        for label, history in shown.items()
        if is_solid(history) and history.sizes.get("snapshot_time", 0)
    ]
    return ReportSection("The fingertip", (), (), tuple(pictures))


def _parameters_section(results: StudyResults) -> ReportSection:
    tables = (parameters_table(results.parameters),) if results.parameters else ()
    return ReportSection("Parameters and their sources", (), tables)


def _run_section(results: StudyResults, run: RunEvents) -> ReportSection:
    history, label, events = results.histories[run.label], run.label, run.events
    pictures = solid_pictures(history, events, label) if is_solid(history) else _plane_pictures(history, events, label)
    said = "Forces, their ratio, and the slipping area."
    pictures.append(Picture(f"{label}-forces", said, force_figure(history, events, label)))
    tables = [ways_table(run)]
    if _has_receptors(history):
        tables.append(peaks_table(acceleration_peaks(history, results.settings.peaks)))
        pictures += _receptor_pictures(history, events, label)
    balance = energy_figure(history, label)
    pictures.append(Picture(f"{label}-energy", "Where the work of the plate goes.", balance))
    return ReportSection(f"Run {label}", (), tuple(tables), tuple(pictures), folded=True)


def _plane_pictures(history: xr.Dataset, events: Events, label: str) -> list[Picture]:
    return [
        Picture(
            f"{label}-slip-map",
            "Where and when the surface sticks and slips.",
            slip_maps_figure({label: history}, {label: events}),
        ),
        Picture(
            f"{label}-displacement",
            "Displacement of nodes over the contact, against the plate's.",
            contact_displacement_figure(history, events, label),
        ),
    ]


def _has_receptors(history: xr.Dataset) -> bool:
    return "site" in history.coords and bool(np.isin(history["site_kind"].values, RECEPTOR_KINDS).any())


def _receptor_pictures(history: xr.Dataset, events: Events, label: str) -> list[Picture]:
    return [
        Picture(
            f"{label}-acceleration",
            "Acceleration along the plate at the receptors round both edges of the contact.",
            acceleration_figure(history, events, label),
        ),
        Picture(
            f"{label}-strain-energy-density",
            "Strain energy density at the receptors round both edges of the contact.",
            strain_energy_density_figure(history, events, label),
        ),
    ]


def _is_quantity(value: object) -> bool:
    if isinstance(value, bool):
        return False
    return isinstance(value, int | float) or (isinstance(value, str) and value.lstrip("+-.")[:1].isdigit())
