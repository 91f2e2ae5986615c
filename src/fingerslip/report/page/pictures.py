"""The pictures of a page: those of one run, those that answer, and those of runs side by side."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from fingerslip.history import is_solid
from fingerslip.marker_tracks import marker_tracks
from fingerslip.published import PublishedSet
from fingerslip.report.figures.catalogue import RUN_FIGURES, has_markers, has_receptors
from fingerslip.report.figures.contact import force_overview_figure, held_figure, slip_maps_figure
from fingerslip.report.figures.deformed import deformed_frames_figure, has_frames, scene_figure
from fingerslip.report.figures.kinds import RunSubject
from fingerslip.report.figures.marks import is_held
from fingerslip.report.figures.receptors import acceleration_overview_figure
from fingerslip.report.figures.sensor import marker_places_figure
from fingerslip.report.figures.solid import slip_frames_figure, slip_onset_figure, stick_ratio_figure
from fingerslip.report.figures.specimens import receptor_positions, section_figure
from fingerslip.report.figures.study import event_times_figure, latency_figure
from fingerslip.report.labels import path_label
from fingerslip.report.page.content import ReportContent, RunPictures
from fingerslip.report.page.page import DrawnPicture, Picture
from fingerslip.report.tables.runs import differing_paths

if TYPE_CHECKING:
    import skfem
    import xarray as xr


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
