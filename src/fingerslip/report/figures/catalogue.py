"""How figures are drawn that can be asked for by name, and which of them a page shows of a run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import xarray as xr
from matplotlib.figure import Figure

from fingerslip.errors import InputError
from fingerslip.history import is_solid, sites_of_kinds
from fingerslip.marker_tracks import marker_tracks
from fingerslip.report.figures import contact, deformed, receptors, sensor, solid, study
from fingerslip.report.figures.kinds import NEEDED_DIMENSIONS, OF_RUNS, OF_STUDIES, RunSubject, StudySubject
from fingerslip.report.figures.marks import is_held
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.slip import slide_window

MARKER_KINDS = ("internal marker", "external marker")

#: How the figures of a study are drawn, by their names in :data:`~fingerslip.report.figures.kinds.OF_STUDIES`.
STUDY_DRAWERS: Mapping[str, Callable[[StudySubject], Figure]] = MappingProxyType(
    {
        "latency": lambda s: study.latency_figure(s.runs, s.path, s.reference),
        "events": lambda s: study.event_times_figure(s.runs, s.path, s.reference, s.starts),
        "slip-maps": lambda s: contact.slip_maps_figure(s.histories, s.events),
        "force-ratios": lambda s: contact.force_overview_figure(s.histories, s.events),
        "slip-onset": lambda s: solid.slip_onset_figure(s.histories),
        "stick-ratio": lambda s: solid.stick_ratio_figure(s.histories),
    }
)


@dataclass(frozen=True)
class RunFigure:
    """A figure of a run."""

    draw: Callable[[RunSubject], Figure]
    caption: str = ""  # what stands below it on a page; pages do not show those without
    is_shown: Callable[[xr.Dataset], bool] = lambda _: True  # whether a page shows it of a history


def has_receptors(history: xr.Dataset) -> bool:
    """Tell whether a history has any mechanoreceptors."""
    return sites_of_kinds(history, RECEPTOR_KINDS).size > 0


def has_markers(history: xr.Dataset) -> bool:
    """Tell whether markers were recorded."""
    return sites_of_kinds(history, MARKER_KINDS).size > 0


def _deformed_figure(run: RunSubject) -> Figure:
    times = run.times or None
    if is_solid(run.history):
        return deformed.solid_views_figure(run.history, run.events, run.options, times)
    return deformed.deformed_frames_figure(run.history, run.events, run.options.scalar, times)


#: The figures of a run in the order of a page, by their names in :data:`~fingerslip.report.figures.kinds.OF_RUNS`;
#: those that have none there belong to a page only.
RUN_FIGURES: Mapping[str, RunFigure] = MappingProxyType(
    {
        "deformed": RunFigure(_deformed_figure),
        "slip-map": RunFigure(
            lambda run: contact.slip_maps_figure({run.title: run.history}, {run.title: run.events}),
            "Where and when the surface sticks and slips.",
            lambda history: not is_solid(history),
        ),
        "displacement": RunFigure(
            lambda run: contact.contact_displacement_figure(run.history, run.events, run.title),
            "Displacement of nodes over the contact, beside that of the plate.",
            lambda history: not is_solid(history) and not is_held(history),
        ),
        "slip-frames": RunFigure(
            lambda run: solid.slip_frames_figure(run.history, run.events, run.times or None, run.title),
            "Where the contact sticks and slips, seen from below; the plate moves to the right. Part of the edge slips "
            "already in the press. Events count what has slipped since the slide began.",
            is_solid,
        ),
        "stick-ratio": RunFigure(
            lambda run: solid.stick_ratio_figure({run.title: run.history}, title=run.title),
            "Stick ratio against the tangential force. It starts below one where the press has made the edge slip.",
            is_solid,
        ),
        "surface-strain": RunFigure(
            lambda run: solid.surface_strain_figure(run.history, run.events, title=run.title),
            "Green-Lagrange strain of the skin along the slide, and its rate; the plate moves to the right.",
            is_solid,
        ),
        "reference-nodes": RunFigure(
            lambda run: solid.reference_nodes_figure(run.history, run.events, run.title),
            "Motion of the reference nodes along the slide: h1 to h7 along the finger to the tip, v1 to v7 across.",
            lambda history: is_solid(history) and bool(solid.reference_kinds(history)),
        ),
        "cut": RunFigure(
            lambda run: deformed.cut_frames_figure(run.history, run.events, title=run.title),
            "von Mises stress inside the finger, on a cut along it. The colours are scaled to the soft layers; the "
            "stress in the phalanx exceeds them.",
            lambda history: is_solid(history) and history.sizes.get("snapshot_time", 0) > 0,
        ),
        "markers": RunFigure(
            lambda run: sensor.slide_tracks_figure(marker_tracks(run.history), run.history, run.title),
            "How far each marker moves along the slide, coloured by ring; dashed are those at x < 0.",
            lambda history: has_markers(history) and slide_window(history) is not None,
        ),
        "forces": RunFigure(
            lambda run: contact.force_figure(run.history, run.events, run.title),
            "Forces, their ratio, and the slipping area.",
        ),
        "acceleration": RunFigure(
            lambda run: receptors.acceleration_figure(run.history, run.events, run.title),
            "Acceleration along the plate at the receptors around both edges of the contact.",
            lambda history: has_receptors(history) and not is_held(history),
        ),
        "strain-energy-density": RunFigure(
            lambda run: receptors.strain_energy_density_figure(run.history, run.events, run.title),
            "Strain energy density at the receptors around both edges of the contact.",
            has_receptors,
        ),
        "energy": RunFigure(
            lambda run: contact.energy_figure(run.history, run.title), "Where the work of the plate goes."
        ),
    }
)


def draw_of_study(kind: str, subject: StudySubject) -> Figure:
    """Draw a figure of a study."""
    if kind in {"latency", "events"} and not subject.path:
        raise InputError("figure", f"'{kind}' has nothing on its axis", "needs a study with a sweep")
    for history in subject.histories.values():
        _check_dimension(kind, history)
    return STUDY_DRAWERS[kind](subject)


def draw_of_run(kind: str, subject: RunSubject) -> Figure:
    """Draw a figure of a run."""
    _check_dimension(kind, subject.history)
    return RUN_FIGURES[kind].draw(subject)


def _check_dimension(kind: str, history: xr.Dataset) -> None:
    dimensions, words = 3 if is_solid(history) else 2, {2: "two", 3: "three"}
    needed = NEEDED_DIMENSIONS.get(kind, dimensions)
    if needed != dimensions:
        fault = f"'{kind}' shows runs of {words[needed]}, this one has {words[dimensions]} dimensions"
        names = sorted(name for name in {*OF_STUDIES, *OF_RUNS} if NEEDED_DIMENSIONS.get(name, 0) in {0, dimensions})
        raise InputError("figure: --kind", fault, f"needs one of {', '.join(names)}")
