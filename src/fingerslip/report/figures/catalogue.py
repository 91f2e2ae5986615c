"""The figures that can be asked for by name: of a study, and of one run of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import xarray as xr
from matplotlib.figure import Figure

from fingerslip.errors import InputError
from fingerslip.history import is_solid
from fingerslip.published import PublishedSet
from fingerslip.report.figures.cut import cut_frames_figure
from fingerslip.report.figures.deformed import deformed_frames_figure
from fingerslip.report.figures.forces import energy_figure, force_figure, force_overview_figure
from fingerslip.report.figures.onset import slip_onset_figure
from fingerslip.report.figures.patch import slip_frames_figure, surface_strain_figure
from fingerslip.report.figures.receptors import acceleration_figure, strain_energy_density_figure
from fingerslip.report.figures.reference_nodes import reference_nodes_figure
from fingerslip.report.figures.slip import contact_displacement_figure, slip_maps_figure
from fingerslip.report.figures.solid_views import solid_views_figure
from fingerslip.report.figures.stick_ratio import stick_ratio_figure
from fingerslip.report.figures.study import event_times_figure, latency_figure
from fingerslip.report.scene.scene import SceneOptions
from fingerslip.results import RunResult
from fingerslip.slip import Events

__all__ = ["OF_RUNS", "OF_STUDIES", "RunSubject", "StudySubject", "draw_of_run", "draw_of_study"]


@dataclass(frozen=True)
class StudySubject:
    """A study as its figures need it.

    Parameters
    ----------
    runs : sequence of RunResult
        Its runs.
    histories : mapping of str to xarray.Dataset
        Histories by the titles of the runs that are drawn.
    events : mapping of str to Events
        Their events by title.
    reference : PublishedSet, optional
        Published values.
    starts : mapping of str to float
        When the slide of each run begins [s], by its name.
    path : str
        Dotted path of the swept value on the axis.
    """

    runs: Sequence[RunResult]
    histories: Mapping[str, xr.Dataset]
    events: Mapping[str, Events]
    reference: PublishedSet | None = None
    starts: Mapping[str, float] = field(default_factory=dict)
    path: str = ""


@dataclass(frozen=True)
class RunSubject:
    """A run as its figures need it.

    Parameters
    ----------
    history : xarray.Dataset
        Its history.
    events : Events
        Its events.
    options : SceneOptions
        The field, and how scenes show it.
    times : tuple of float
        Times of the panels [s]; the figure chooses without them.
    """

    history: xr.Dataset
    events: Events
    options: SceneOptions = field(default_factory=SceneOptions)
    times: tuple[float, ...] = ()


def _deformed(own: RunSubject) -> Figure:
    if is_solid(own.history):
        return solid_views_figure(own.history, own.events, own.options, own.times or None)
    return deformed_frames_figure(own.history, own.events, own.options.scalar, own.times or None)


#: Figures of a study by their names: what they show, and how they are drawn.
OF_STUDIES: Mapping[str, tuple[str, Callable[[StudySubject], Figure]]] = MappingProxyType(
    {
        "latency": (
            "latency against a swept value",
            lambda own: latency_figure(own.runs, own.path, own.reference),
        ),
        "events": (
            "slip events against a swept value, from the start of the slide",
            lambda own: event_times_figure(own.runs, own.path, own.reference, own.starts),
        ),
        "slip-maps": ("slip maps of all runs", lambda own: slip_maps_figure(own.histories, own.events)),
        "force-ratios": ("force ratios of all runs", lambda own: force_overview_figure(own.histories, own.events)),
        "slip-onset": ("where slip begins, in space", lambda own: slip_onset_figure(own.histories)),
        "stick-ratio": ("stick ratio against force, in space", lambda own: stick_ratio_figure(own.histories)),
    }
)

#: Figures of a run by their names.
OF_RUNS: Mapping[str, tuple[str, Callable[[RunSubject], Figure]]] = MappingProxyType(
    {
        "deformed": (
            "deformed sections, or lit views in space, with a field",
            _deformed,
        ),
        "slip-map": (
            "stick and slip over time",
            lambda own: slip_maps_figure({"": own.history}, {"": own.events}),
        ),
        "forces": ("forces and slipping area", lambda own: force_figure(own.history, own.events)),
        "energy": ("energy balance", lambda own: energy_figure(own.history)),
        "displacement": (
            "skin against plate",
            lambda own: contact_displacement_figure(own.history, own.events),
        ),
        "acceleration": ("acceleration at receptors", lambda own: acceleration_figure(own.history, own.events)),
        "strain-energy-density": (
            "strain energy density at receptors",
            lambda own: strain_energy_density_figure(own.history, own.events),
        ),
        "slip-frames": (
            "the contact in space from below",
            lambda own: slip_frames_figure(own.history, own.events, own.times or None),
        ),
        "cut": ("stress on a cut in space", lambda own: cut_frames_figure(own.history, own.events)),
        "surface-strain": ("strain of the skin in space", lambda own: surface_strain_figure(own.history, own.events)),
        "reference-nodes": (
            "motion of the reference nodes",
            lambda own: reference_nodes_figure(own.history, own.events),
        ),
    }
)
# Of these the history has to be one in space, or one of a section.
_SOLID = {"slip-frames", "cut", "surface-strain", "reference-nodes", "slip-onset", "stick-ratio"}
_PLANE = {"slip-map", "slip-maps", "displacement", "acceleration", "strain-energy-density"}


def draw_of_study(kind: str, subject: StudySubject) -> Figure:
    """Draw a figure of a study.

    Raises
    ------
    InputError
        Where nothing is swept that the figure could have on its axis, or it is of runs of another dimension.
    """
    if kind in {"latency", "events"} and not subject.path:
        raise InputError("figure", f"'{kind}' has nothing on its axis", "needs a study with a sweep")
    for history in subject.histories.values():
        _check_dimension(kind, history)
    return OF_STUDIES[kind][1](subject)


def draw_of_run(kind: str, subject: RunSubject) -> Figure:
    """Draw a figure of a run.

    Raises
    ------
    InputError
        Where the figure is of runs of another dimension.
    ResultError
        Where the history lacks what the figure shows.
    """
    _check_dimension(kind, subject.history)
    return OF_RUNS[kind][1](subject)


def _check_dimension(kind: str, history: xr.Dataset) -> None:
    if kind in (_PLANE if is_solid(history) else _SOLID):
        has, needs = ("three", "two") if is_solid(history) else ("two", "three")
        others = ", ".join(sorted({*OF_STUDIES, *OF_RUNS} - (_PLANE if is_solid(history) else _SOLID)))
        raise InputError(
            "figure: --kind", f"'{kind}' shows runs of {needs}, this one has {has} dimensions", f"needs one of {others}"
        )
