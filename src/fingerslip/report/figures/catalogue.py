"""The figures that can be asked for by name: of a study, and of one run of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import xarray as xr
from matplotlib.figure import Figure

from fingerslip.errors import InputError
from fingerslip.history import is_solid
from fingerslip.report.figures.contact import (
    energy_figure,
    force_figure,
    force_overview_figure,
    slip_frames_figure,
    slip_onset_figure,
    stick_ratio_figure,
    surface_strain_figure,
)
from fingerslip.report.figures.deformed import deformed_frames_figure
from fingerslip.report.figures.kinds import OF_RUNS, OF_STUDIES, RunSubject, StudySubject
from fingerslip.report.figures.receptors import acceleration_figure, strain_energy_density_figure
from fingerslip.report.figures.slip import contact_displacement_figure, slip_maps_figure
from fingerslip.report.figures.solid import cut_frames_figure, reference_nodes_figure, solid_views_figure
from fingerslip.report.figures.study import event_times_figure, latency_figure

__all__ = ["RUN_DRAWERS", "STUDY_DRAWERS", "draw_of_run", "draw_of_study"]


def _deformed_figure(subject: RunSubject) -> Figure:
    if is_solid(subject.history):
        return solid_views_figure(subject.history, subject.events, subject.options, subject.times or None)
    return deformed_frames_figure(subject.history, subject.events, subject.options.scalar, subject.times or None)


#: How the figures of a study are drawn, by their names in :data:`~fingerslip.report.figures.kinds.OF_STUDIES`.
STUDY_DRAWERS: Mapping[str, Callable[[StudySubject], Figure]] = MappingProxyType(
    {
        "latency": lambda own: latency_figure(own.runs, own.path, own.reference),
        "events": lambda own: event_times_figure(own.runs, own.path, own.reference, own.starts),
        "slip-maps": lambda own: slip_maps_figure(own.histories, own.events),
        "force-ratios": lambda own: force_overview_figure(own.histories, own.events),
        "slip-onset": lambda own: slip_onset_figure(own.histories),
        "stick-ratio": lambda own: stick_ratio_figure(own.histories),
    }
)

#: How those of a run are drawn, by their names in :data:`~fingerslip.report.figures.kinds.OF_RUNS`.
RUN_DRAWERS: Mapping[str, Callable[[RunSubject], Figure]] = MappingProxyType(
    {
        "deformed": _deformed_figure,
        "slip-map": lambda own: slip_maps_figure({"": own.history}, {"": own.events}),
        "forces": lambda own: force_figure(own.history, own.events),
        "energy": lambda own: energy_figure(own.history),
        "displacement": lambda own: contact_displacement_figure(own.history, own.events),
        "acceleration": lambda own: acceleration_figure(own.history, own.events),
        "strain-energy-density": lambda own: strain_energy_density_figure(own.history, own.events),
        "slip-frames": lambda own: slip_frames_figure(own.history, own.events, own.times or None),
        "cut": lambda own: cut_frames_figure(own.history, own.events),
        "surface-strain": lambda own: surface_strain_figure(own.history, own.events),
        "reference-nodes": lambda own: reference_nodes_figure(own.history, own.events),
    }
)
# Of these the history has to be one in 3D, or one of a section.
_SOLID = {"slip-frames", "cut", "surface-strain", "reference-nodes", "slip-onset", "stick-ratio"}
_PLANE = {"slip-map", "slip-maps", "displacement", "acceleration", "strain-energy-density"}


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
    return RUN_DRAWERS[kind](subject)


def _check_dimension(kind: str, history: xr.Dataset) -> None:
    if kind in (_PLANE if is_solid(history) else _SOLID):
        has, needs = ("three", "two") if is_solid(history) else ("two", "three")
        others = ", ".join(sorted({*OF_STUDIES, *OF_RUNS} - (_PLANE if is_solid(history) else _SOLID)))
        raise InputError(
            "figure: --kind", f"'{kind}' shows runs of {needs}, this one has {has} dimensions", f"needs one of {others}"
        )
