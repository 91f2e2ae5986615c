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

__all__ = ["OF_RUNS", "OF_STUDIES", "STYLES", "RunSubject", "StudySubject"]

#: How figures may look: :data:`fingerslip.report.figures.style.LOOKS` has the numbers.
STYLES = ("page", "paper", "slides")

#: Figures of a study by their names.
OF_STUDIES: Mapping[str, str] = MappingProxyType(
    {
        "latency": "latency against a swept value",
        "events": "slip events against a swept value, from the start of the slide",
        "slip-maps": "slip maps of all runs",
        "force-ratios": "force ratios of all runs",
        "slip-onset": "where slip begins, in space",
        "stick-ratio": "stick ratio against force, in space",
    }
)

#: Figures of a run by their names.
OF_RUNS: Mapping[str, str] = MappingProxyType(
    {
        "deformed": "deformed sections, or lit views in space, with a field",
        "slip-map": "stick and slip over time",
        "forces": "forces and slipping area",
        "energy": "energy balance",
        "displacement": "skin against plate",
        "acceleration": "acceleration at receptors",
        "strain-energy-density": "strain energy density at receptors",
        "slip-frames": "the contact in space from below",
        "cut": "stress on a cut in space",
        "surface-strain": "strain of the skin in space",
        "reference-nodes": "motion of the reference nodes",
    }
)


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
