"""Which figures there are of runs and studies: how each is drawn, what it is called, where a page shows it."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING

import xarray as xr
from matplotlib.figure import Figure

from fingerslip.errors import InputError
from fingerslip.history import is_solid, sites_of_kinds
from fingerslip.marker_tracks import marker_tracks
from fingerslip.published import PublishedSet
from fingerslip.report.content import (
    NEEDED_DIMENSIONS,
    OF_RUNS,
    OF_STUDIES,
    ReportContent,
    RunPictures,
    RunSubject,
    StudySubject,
)
from fingerslip.report.figures import deformed, markers, signals, solid, study
from fingerslip.report.figures.deformed import deformed_frames_figure, has_frames, scene_figure
from fingerslip.report.figures.markers import marker_places_figure
from fingerslip.report.figures.marks import is_held
from fingerslip.report.figures.signals import (
    acceleration_overview_figure,
    force_overview_figure,
    held_figure,
    slip_maps_figure,
)
from fingerslip.report.figures.solid import slip_frames_figure, slip_onset_figure, stick_ratio_figure
from fingerslip.report.figures.specimens import receptor_positions, section_figure
from fingerslip.report.figures.study import event_times_figure, latency_figure
from fingerslip.report.labels import path_label
from fingerslip.report.page.page import DrawnPicture, Picture
from fingerslip.report.tables.runs import differing_paths
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.slip import slide_window

if TYPE_CHECKING:
    import skfem
    import xarray as xr

MARKER_KINDS = ("internal marker", "external marker")

#: How the figures of a study are drawn, by their names in :data:`~fingerslip.report.content.OF_STUDIES`.
STUDY_DRAWERS: Mapping[str, Callable[[StudySubject], Figure]] = MappingProxyType(
    {
        "latency": lambda s: study.latency_figure(s.runs, s.path, s.reference),
        "events": lambda s: study.event_times_figure(s.runs, s.path, s.reference, s.starts),
        "slip-maps": lambda s: signals.slip_maps_figure(s.histories, s.events),
        "force-ratios": lambda s: signals.force_overview_figure(s.histories, s.events),
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


#: The figures of a run in the order of a page, by their names in :data:`~fingerslip.report.content.OF_RUNS`;
#: those that have none there belong to a page only.
RUN_FIGURES: Mapping[str, RunFigure] = MappingProxyType(
    {
        "deformed": RunFigure(_deformed_figure),
        "slip-map": RunFigure(
            lambda run: signals.slip_maps_figure({run.title: run.history}, {run.title: run.events}),
            "Where and when the surface sticks and slips.",
            lambda history: not is_solid(history),
        ),
        "displacement": RunFigure(
            lambda run: signals.contact_displacement_figure(run.history, run.events, run.title),
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
            lambda run: markers.slide_tracks_figure(marker_tracks(run.history), run.history, run.title),
            "How far each marker moves along the slide, coloured by ring; dashed are those at x < 0.",
            lambda history: has_markers(history) and slide_window(history) is not None,
        ),
        "forces": RunFigure(
            lambda run: signals.force_figure(run.history, run.events, run.title),
            "Forces, their ratio, and the slipping area.",
        ),
        "acceleration": RunFigure(
            lambda run: signals.acceleration_figure(run.history, run.events, run.title),
            "Acceleration along the plate at the receptors around both edges of the contact.",
            lambda history: has_receptors(history) and not is_held(history),
        ),
        "strain-energy-density": RunFigure(
            lambda run: signals.strain_energy_density_figure(run.history, run.events, run.title),
            "Strain energy density at the receptors around both edges of the contact.",
            has_receptors,
        ),
        "energy": RunFigure(
            lambda run: signals.energy_figure(run.history, run.title), "Where the work of the plate goes."
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


def run_pictures(run: RunSubject) -> list[Picture]:
    """Return the pictures that show a run in detail."""
    return [
        Picture(f"{run.name}-{name}", figure.caption, figure.draw(run))
        for name, figure in RUN_FIGURES.items()
        if figure.caption and figure.is_shown(run.history)
    ]


def model_pictures(run: RunSubject, mesh: skfem.Mesh) -> list[Picture]:
    """Return the pictures of the model of a run at the start."""
    pictures = []
    if not is_solid(run.history):
        said = f"Layers, elements, receptors and plate at the start: {run.title}."
        figure = section_figure(mesh, receptor_positions(run.history), title=run.title)
        pictures.append(Picture(f"section-{run.name}", said, figure))
    elif run.history.sizes.get("snapshot_time", 0):
        said = f"Layers, elements and plate at the start, cut open: {run.title}."
        pictures.append(Picture(f"scene-{run.name}", said, scene_figure(run.history, run.title)))
    if has_markers(run.history):
        said = f"Markers at rest, from inside and from below: {run.title}."
        figure = marker_places_figure(marker_tracks(run.history), run.title)
        pictures.append(Picture(f"markers-{run.name}", said, figure))
    return pictures


def draw_ahead(run: RunSubject, mesh: skfem.Mesh | None, *, contact: bool) -> RunPictures:
    """Draw the pictures of one run before its report is made."""
    return RunPictures(
        contact=_render(run_pictures(run)) if contact else None,
        model=None if mesh is None else _render(model_pictures(run, mesh)),
    )


def _render(pictures: Sequence[Picture]) -> tuple[DrawnPicture, ...]:
    return tuple(DrawnPicture(picture.name, picture.caption, picture.png) for picture in pictures)


def hero_pictures(content: ReportContent) -> tuple[Picture, ...]:
    """Return the pictures below the answer: of the first swept value, or of the only run; none of samples."""
    if swept := swept_pictures(content, slice(1)):
        return tuple(swept)
    if not content.drawn:
        return ()
    if are_held(content.titled_histories()):
        said = "How the force changes, and how far bodies move, while nothing slides."
        return (Picture("held", said, held_figure(content.titled_histories())),)
    run = content.drawn[len(content.drawn) // 2]
    history = content.histories[run.name]
    if is_solid(history):
        said = "Where the contact sticks and slips, seen from below; the plate moves to the right."
        return (Picture("answer", said, slip_frames_figure(history, run.events)),)
    if has_frames(history):
        said = (
            "The deformed section, to scale, at the snapshots nearest to the start of the slide and to the slip events."
        )
        return (Picture("answer", said, deformed_frames_figure(history, run.events)),)
    return ()


def swept_pictures(content: ReportContent, which: slice = slice(None)) -> list[Picture]:
    """Draw event times from the start of the slide and latency against swept values; nothing where nothing slid."""
    if are_held(content.titled_histories()):
        return []
    runs, pictures = content.study.runs, []
    for path in differing_paths(runs)[which]:
        name, words, reference = path.replace(".", "-").replace("_", "-"), path_label(path), _merge(content.references)
        latency, times = (
            latency_figure(runs, path, reference),
            f"Slip events against {words}, in seconds from the start",
        )
        events = event_times_figure(runs, path, reference, content.starts or None)
        said = f"Time from incipient to overall slip against {words}."
        pictures += [
            Picture(f"latency-{name}", said, latency),
            Picture(f"events-{name}", f"{times} of the slide.", events),
        ]
    return pictures


def are_held(histories: Mapping[str, xr.Dataset]) -> bool:
    """Tell whether nothing slides in any of some runs."""
    return bool(histories) and all(map(is_held, histories.values()))


def _merge(references: Sequence[PublishedSet]) -> PublishedSet | None:
    """Join published sets for a figure; the first stands for the paper."""
    values = tuple(value for reference in references for value in reference.values)
    return dataclasses.replace(references[0], values=values) if references else None


def overview_pictures(content: ReportContent) -> list[Picture]:
    """Draw the contact of all runs side by side, where something slides in any."""
    histories, events = content.titled_histories(), content.titled_events()
    if are_held(histories) or len(histories) < 2:
        return []
    pictures, dimensions = [], {is_solid(history) for history in histories.values()}
    if dimensions == {True}:
        said = (
            "When each part of the contact slips for good, in seconds from the start of the slide; the plate moves "
            "along the arrow. What sticks to the end is dark."
        )
        pictures.append(Picture("slip-onset", said, slip_onset_figure(histories)))
        said = "Sticking share of the contact against tangential over normal force, during the slide."
        pictures.append(Picture("stick-ratio", said, stick_ratio_figure(histories)))
    elif dimensions == {False}:
        said = RUN_FIGURES["slip-map"].caption
        pictures.append(Picture("slip-maps", said, slip_maps_figure(histories, events)))
    said = "Tangential over normal force and the area fraction that slips at each time."
    pictures.append(Picture("forces", said, force_overview_figure(histories, events)))
    if all(has_receptors(history) for history in histories.values()):
        said = "The signal in which acceleration peaks are looked for."
        figure = acceleration_overview_figure(histories, events, content.settings.peaks)
        pictures.append(Picture("acceleration-peaks", said, figure))
    return pictures
