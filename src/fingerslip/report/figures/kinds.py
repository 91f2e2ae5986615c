"""The figures that can be asked for by name: what each shows, and of what; loading this loads nothing that draws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING

from fingerslip.published import PublishedSet
from fingerslip.report.scene.options import SceneOptions
from fingerslip.results import RunResult
from fingerslip.slip import Events

if TYPE_CHECKING:
    import xarray as xr

#: How figures may look: :data:`fingerslip.report.figures.style.LOOKS` has the numbers.
STYLES = ("page", "paper", "slides")

#: Figures of a study by their names.
OF_STUDIES: Mapping[str, str] = MappingProxyType(
    {
        "latency": "latency against a swept value",
        "events": "slip events against a swept value, from the start of the slide",
        "slip-maps": "slip maps of all runs",
        "force-ratios": "force ratios of all runs",
        "slip-onset": "where slip begins, in 3D",
        "stick-ratio": "stick ratio against force, in 3D",
    }
)

#: Figures of a run by their names.
OF_RUNS: Mapping[str, str] = MappingProxyType(
    {
        "deformed": "deformed sections, or lit views in 3D, with a field",
        "slip-map": "stick and slip over time",
        "forces": "forces and slipping area",
        "energy": "energy balance",
        "displacement": "skin against plate",
        "acceleration": "acceleration at receptors",
        "strain-energy-density": "strain energy density at receptors",
        "slip-frames": "the contact in 3D from below",
        "cut": "stress on a cut in 3D",
        "surface-strain": "strain of the skin in 3D",
        "reference-nodes": "motion of the reference nodes",
    }
)
#: Of these the history has to be one in 2D, or one in 3D.
NEEDED_DIMENSIONS: Mapping[str, int] = MappingProxyType(
    {
        **dict.fromkeys(("slip-map", "slip-maps", "displacement", "acceleration", "strain-energy-density"), 2),
        **dict.fromkeys(("slip-frames", "cut", "surface-strain", "reference-nodes", "slip-onset", "stick-ratio"), 3),
    }
)


@dataclass(frozen=True)
class StudySubject:
    """A study as its figures need it."""

    runs: Sequence[RunResult]  # its runs
    histories: Mapping[str, xr.Dataset]  # histories by the titles of the runs that are drawn
    events: Mapping[str, Events]  # their events by title
    reference: PublishedSet | None = None  # published values
    starts: Mapping[str, float] = field(default_factory=dict)  # when slides begin [s], by the names of runs
    path: str = ""  # dotted path of the swept value on the axis


@dataclass(frozen=True)
class RunSubject:
    """A run as its figures need it."""

    history: xr.Dataset  # its history
    events: Events  # its events
    options: SceneOptions = field(default_factory=SceneOptions)
    times: tuple[float, ...] = ()  # times of the panels [s]
    name: str = ""  # with which the names of its pictures begin
    title: str = ""  # which the titles of its figures have
