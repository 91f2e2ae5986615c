"""How the figures of runs and studies are drawn, and which of them a page shows."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Literal

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from fingerslip.afferents.model import AfferentModel
from fingerslip.afferents.spikes import Spikes, available_spikes, resolved_spikes
from fingerslip.errors import InputError
from fingerslip.history import is_solid
from fingerslip.marker_tracks import marker_tracks
from fingerslip.parameters.schema import require_kind
from fingerslip.report.content import (
    HAS,
    OF_RUNS,
    RUN_FIGURES,
    STUDY_FIGURES,
    STYLES,
    FigureKind,
    ReportContent,
    RunPictures,
    RunSubject,
    StudySubject,
    check_subject,
    check_times,
    is_held,
)
from fingerslip.report.figures import bodies, markers, patches, signals, study
from fingerslip.report.figures.composed import composed_figure, spike_figure
from fingerslip.report.figures.specimens import mesh_figure
from fingerslip.report.figures.style import looking
from fingerslip.report.labels import of_histories, path_label, prose
from fingerslip.report.page.page import Picture
from fingerslip.report.tables.runs import differing_paths
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.slip import Events, find_events, slide_window
from fingerslip.vision.tracks import check_tracks

_OF_SPIKES = ("composed", "spikes")  # kinds that a recording can be beside
_DRAW_STUDIES: Mapping[str, Callable[[StudySubject], Figure]] = {
    "latency": lambda s: study.latency_figure(s.runs, s.path, s.reference),
    "events": lambda s: study.event_times_figure(s.runs, s.path, s.reference, s.starts or None),
    "sensitivity": lambda s: study.indices_figure(s.sensitivities),
    "slip-onset": lambda s: patches.slip_onset_figure(s.histories),
    "stick-ratio": lambda s: patches.stick_ratio_figure(s.histories),
    "slip-maps": lambda s: signals.slip_maps_figure(s.histories, s.events),
    "force-ratios": lambda s: signals.force_overview_figure(s.histories, s.events),
    "acceleration-peaks": lambda s: signals.acceleration_overview_figure(s.histories, s.events, s.peaks),
}
_DRAW_RUNS: Mapping[str, Callable[[RunSubject], Figure]] = {
    "composed": lambda r: composed_figure(
        r.history, r.events, available_spikes(r.history, r.afferents), r.title, r.times, **_of_spikes(r)
    ),
    "deformed": lambda r: bodies.deformed_figure(r.history, r.events, r.options, r.times or None),
    "slip-map": lambda r: signals.slip_maps_figure({r.title: r.history}, {r.title: r.events}),
    "displacement": lambda r: signals.contact_displacement_figure(r.history, r.events, r.title),
    "slip-frames": lambda r: patches.slip_frames_figure(r.history, r.events, r.times or None, r.title),
    "stick-ratio": lambda r: patches.stick_ratio_figure({r.title: r.history}, title=r.title),
    "surface-strain": lambda r: patches.surface_strain_figure(r.history, r.events, title=r.title),
    "reference-nodes": lambda r: bodies.reference_nodes_figure(r.history, r.events, r.title),
    "cut": lambda r: bodies.cut_frames_figure(r.history, r.events, r.title),
    "markers": lambda r: markers.slide_tracks_figure(marker_tracks(r.history), r.history, r.title, r.recorded),
    "forces": lambda r: signals.force_figure(r.history, r.events, r.title),
    "acceleration": lambda r: signals.acceleration_figure(r.history, r.events, r.title),
    "strain-energy-density": lambda r: signals.strain_energy_density_figure(r.history, r.events, r.title),
    "energy": lambda r: signals.energy_figure(r.history, r.title),
    "spikes": lambda r: spike_figure(
        resolved_spikes(r.history, r.afferents), r.history, r.events, r.title, **_of_spikes(r)
    ),
    "mesh": lambda r: (bodies.scene_figure if is_solid(r.history) else mesh_figure)(r.history, r.title),
}


def _of_spikes(run: RunSubject) -> dict[str, Any]:
    return {"assumed": run.afferents is None, "recorded": run.recorded}


def _is_on_page(kind: FigureKind, histories: Iterable[xr.Dataset]) -> bool:
    return bool(kind.caption) and all(map(kind.can_show, histories))


def draw_of_study(name: str, subject: StudySubject) -> Figure:
    """Draw a figure of a study."""
    check_subject(name, subject)
    return _DRAW_STUDIES[name](subject)


def draw_of_run(name: str, subject: RunSubject) -> Figure:
    """Draw a figure of a run."""
    check_subject(name, subject)
    check_times(name, subject.times, "times")
    return _DRAW_RUNS[name](subject)


def draw(
    history: xr.Dataset,
    kind: str = "composed",
    *,
    events: Events | None = None,
    title: str = "",
    times: Sequence[float] = (),
    afferents: Mapping[str, AfferentModel] | None = None,
    recorded: Spikes | xr.Dataset | None = None,
    style: Literal["page", "paper", "column", "slides"] = "page",
) -> Figure:
    """Draw a figure of a history.

    Parameters
    ----------
    history : xarray.Dataset
        What :func:`fingerslip.simulate` or :func:`fingerslip.read_history` returned.
    kind : str, optional
        One of the names that ``fingerslip figure`` lists for runs; ``composed`` has all on one axis of time.
    events : Events, optional
        The events that are marked; those of :func:`fingerslip.find_events` without it.
    title : str, optional
        What the title adds; figures for papers have none.
    times : sequence of float, optional
        Times of the pictures of ``composed``, ``deformed`` and ``slip-frames`` [s].
    afferents : mapping of str to AfferentModel, optional
        Models by type of receptor, for ``spikes`` and ``composed``; else :func:`fingerslip.human_afferents`.
    recorded : Spikes or xarray.Dataset, optional
        A recording on the clock of the history: spikes, as rasters of the same two, each below that of its type; or
        tracks of a sensor in metres, over the simulated ``markers``.
    style : {'page', 'paper', 'column', 'slides'}, optional
        Its size and that of its letters; ``paper`` has the widths of journal columns, ``column`` always that of one,
        85 mm, and both have letters at panels.

    Returns
    -------
    matplotlib.figure.Figure
        The figure, for :func:`fingerslip.save_figure`.

    Raises
    ------
    InputError
        For a kind or style that is not there, a kind that shows histories of another dimension or takes no recording,
        or a recording without spikes at the history's times.
    ResultError
        Where the history lacks what the figure shows, such as snapshots.

    Examples
    --------
    Of a history with receptors::

        fs.save_figure(fs.draw(history, "spikes", style="paper"), "spikes.pdf")
    """
    for name, value, allowed in (("kind", kind, OF_RUNS), ("style", style, STYLES)):
        if value not in allowed:
            raise InputError(name, f"got '{value}'", f"needs one of {', '.join(allowed)}")
    if isinstance(recorded, xr.Dataset):
        _check_recorded_tracks(recorded, kind, history)
    elif recorded is not None:
        require_kind(recorded, Spikes, "fs.Spikes(names, kinds, times, start, end)", "recorded")
        if kind not in _OF_SPIKES:
            needed = f"needs the kind {' or '.join(_OF_SPIKES)}"
            raise InputError("recorded", f"is given for '{kind}'", needed, "leave it out")
        spikes, (first, last) = np.concatenate([[], *recorded.times]), history["time"].values[[0, -1]]
        if spikes.size and not ((first <= spikes) & (spikes <= last)).any():
            fault, span = f"has spikes from {spikes.min():g} to {spikes.max():g} s", f"from {first:g} to {last:g} s"
            raise InputError("recorded", fault, f"needs some {span}", "shift its times [s] to the clock of the history")
        if others := sorted({*recorded.kinds} - {*RECEPTOR_KINDS}):
            warnings.warn(f"recorded: {', '.join(others)} is none of {', '.join(RECEPTOR_KINDS)}", stacklevel=2)
    marked = find_events(history) if events is None else events
    subject = RunSubject(history, marked, times=tuple(times), title=title, afferents=afferents, recorded=recorded)
    with looking(style):
        return draw_of_run(kind, subject)


def _check_recorded_tracks(tracks: xr.Dataset, kind: str, history: xr.Dataset) -> None:
    """Refuse tracks of a recording that a figure cannot draw beside simulated ones."""
    units, window = check_tracks(tracks, "recorded")["position"].attrs["units"], slide_window(history)
    times = tracks.dropna("time", how="all", subset=["position"])["time"].values
    if kind != "markers":
        raise InputError("recorded", f"is tracks, given for '{kind}'", "needs the kind markers", "leave it out")
    if units != "m":
        raise InputError(
            "recorded", f"is in {units}", "needs metres", "fs.make_tracks(scale * position, ..., units='m')"
        )
    if window and ((window.start <= times) & (times <= window.end)).sum() < 2:
        fault = f"sees markers up to {times.max(initial=0.0):g} s"
        allowed = f"needs some in the slide, {window.start:g} to {window.end:g} s"
        raise InputError("recorded", fault, allowed, "shift its times [s] to the clock of the history")


def run_pictures(run: RunSubject) -> list[Picture]:
    """Return the pictures that show a run in detail."""
    return [
        Picture(f"{run.name}-{name}", of_histories(RUN_FIGURES[name].caption, [run.history]), draw(run))
        for name, draw in _DRAW_RUNS.items()
        if _is_on_page(RUN_FIGURES[name], [run.history])
    ]


def model_pictures(run: RunSubject) -> list[Picture]:
    """Return the pictures of the model of a run at the start."""
    history, title = run.history, run.title
    figures: dict[str, Figure] = {}
    if is_solid(history) and history.sizes.get("snapshot_time", 0):
        figures["scene"] = bodies.scene_figure(history, title)
    elif not is_solid(history) and "cell_nodes" in history.coords:
        figures["section"] = mesh_figure(history, title)
    if HAS["markers"](history):
        figures["markers"] = markers.marker_places_figure(marker_tracks(history), title)
    return [
        Picture(f"{name}-{run.name}", of_histories(prose("captions", name, {"title": title}), [history]), figure)
        for name, figure in figures.items()
    ]


def draw_ahead(run: RunSubject, *, contact: bool, model: bool) -> RunPictures:
    """Draw the pictures of one run before its report is made."""

    def render(pictures: list[Picture]) -> tuple[Picture, ...]:
        return tuple(Picture(picture.name, picture.caption, None, picture.png) for picture in pictures)

    return RunPictures(render(run_pictures(run)) if contact else None, render(model_pictures(run)) if model else None)


def hero_pictures(content: ReportContent) -> list[Picture]:
    """Return the pictures below the answer: of the first swept value, and of the run in the middle; none of samples."""
    histories, swept = content.titled_histories(), swept_pictures(content, slice(1))
    if not content.drawn:
        return swept
    if are_held(histories):
        return [Picture("held", prose("captions", "held"), signals.held_figure(histories))]
    run = content.drawn[len(content.drawn) // 2]
    history = content.histories[run.name]
    if not bodies.has_pictures(history):
        return swept
    spikes = available_spikes(history)
    along = "" if is_solid(history) else prose("captions", "answer-along")
    caption = prose("captions", "answer-spikes" if spikes else "answer", {"along": along})
    title = content.titles[run.name] if swept else ""
    figure = composed_figure(history, run.events, spikes, title, assumed=True)
    return [*swept, Picture("answer", of_histories(caption, [history]), figure)]


def swept_pictures(content: ReportContent, which: slice = slice(None)) -> list[Picture]:
    """Draw event times from the start of the slide and latency against swept values; nothing where nothing slid."""
    if are_held(content.titled_histories()):
        return []
    pictures = []
    for path in differing_paths(content.study.runs)[which]:
        subject, swept = content.subject(path), path_label(path)
        for name in ("latency", "events"):
            said, figure = STUDY_FIGURES[name].caption.format(swept=swept), _DRAW_STUDIES[name](subject)
            pictures.append(Picture(f"{name}-{path.replace('.', '-').replace('_', '-')}", said, figure))
    return pictures


def are_held(histories: Mapping[str, xr.Dataset]) -> bool:
    """Tell whether nothing slides in any of some runs."""
    return bool(histories) and all(map(is_held, histories.values()))


def overview_pictures(content: ReportContent) -> list[Picture]:
    """Draw the contact of all runs side by side, where something slides in any."""
    subject = content.subject()
    histories = list(subject.histories.values())
    if are_held(subject.histories) or len(histories) < 2:
        return []
    return [
        Picture(name, of_histories(STUDY_FIGURES[name].caption, histories), draw(subject))
        for name, draw in _DRAW_STUDIES.items()
        if _is_on_page(STUDY_FIGURES[name], histories)
    ]
