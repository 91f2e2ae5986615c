"""What figures and reports are made of: runs, studies, films; loading this loads nothing that draws."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError, ResultError
from fingerslip.history import is_solid, phase_times, reference_kinds, sites_of_kinds
from fingerslip.libraries import xr
from fingerslip.published import PublishedSet
from fingerslip.report.labels import groups, run_title
from fingerslip.report.scene.options import SceneOptions
from fingerslip.report.tables.parameters import ShownValue
from fingerslip.results import RunResult, StudyResult
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.slip import Events, EventSettings, PeakSettings, slide_window
from fingerslip.uncertainty import Convergence

if TYPE_CHECKING:
    from fingerslip.afferents.model import AfferentModel
    from fingerslip.afferents.spikes import Spikes
    from fingerslip.report.page.page import Picture
    from fingerslip.sampling.indices import Sensitivity

#: How figures may look: :data:`fingerslip.report.figures.style.LOOKS` has the numbers.
STYLES = ("page", "paper", "column", "slides")


@dataclass(frozen=True)
class FigureKind:
    """A figure that can be asked for by its name, or that stands on pages."""

    words: str = ""  # what it shows, where it can be asked for
    caption: str = ""  # what stands below it on a page; pages do not show those without
    dimensions: int | None = None  # those of the histories that it can show; any where it is None
    needs: Sequence[str] = ()  # what a history needs besides for a page to show it

    def fits(self, history: xr.Dataset) -> bool:
        """Tell whether it shows histories of these dimensions."""
        return self.dimensions in {None, 3 if is_solid(history) else 2}

    def can_show(self, history: xr.Dataset) -> bool:
        """Tell whether a history has all that it needs."""
        return self.fits(history) and all(HAS[need](history) for need in self.needs)


def has_receptors(history: xr.Dataset) -> bool:
    """Tell whether a history has any mechanoreceptors."""
    return sites_of_kinds(history, RECEPTOR_KINDS).size > 0


def is_held(history: xr.Dataset) -> bool:
    """Tell whether a counterface presses and nothing slides."""
    return bool(history.sizes.get("counterface", 0)) and not phase_times(history, "slide")


#: What figures need, by the words of their kinds.
HAS: Mapping[str, Callable[[xr.Dataset], bool]] = {
    "swept value": lambda _: False,
    "motion": lambda history: not is_held(history),
    "slide": lambda history: slide_window(history) is not None,
    "snapshots": lambda history: history.sizes.get("snapshot_time", 0) > 0,
    "receptors": has_receptors,
    "markers": lambda history: sites_of_kinds(history, ("internal marker", "external marker")).size > 0,
    "reference nodes": lambda history: bool(reference_kinds(history)),
}

#: Figures of runs and of studies by their names, in the order of a page.
RUN_FIGURES: Mapping[str, FigureKind] = {name: FigureKind(**row) for name, row in groups()["run_figures"].items()}
STUDY_FIGURES: Mapping[str, FigureKind] = {name: FigureKind(**row) for name, row in groups()["study_figures"].items()}
#: What those of them show that can be asked for by their names.
OF_RUNS: Mapping[str, str] = {name: kind.words for name, kind in RUN_FIGURES.items() if kind.words}
OF_STUDIES: Mapping[str, str] = {name: kind.words for name, kind in STUDY_FIGURES.items() if kind.words}

#: Those of them that have pictures at times.
TIMED = ("composed", "deformed", "slip-frames")


def check_times(kind: str, times: Sequence[object], where: str) -> None:
    """Refuse times for a figure that has no pictures at times."""
    if times and kind not in TIMED:
        needs, repair = f"needs one of {', '.join(TIMED)}", "leave the times out: this one has an axis of time"
        raise InputError(where, f"got {len(times)} for {kind}", needs, repair)


@dataclass(frozen=True)
class StudySubject:
    """A study as its figures need it."""

    runs: Sequence[RunResult]  # its runs
    histories: Mapping[str, xr.Dataset]  # histories by the titles of the runs that are drawn
    events: Mapping[str, Events]  # their events by title
    reference: PublishedSet | None = None  # published values
    starts: Mapping[str, float] = field(default_factory=dict)  # when slides begin [s], by the names of runs
    path: str = ""  # dotted path of the swept value on the axis
    peaks: PeakSettings = field(default_factory=PeakSettings)  # how acceleration peaks are read
    sensitivities: Sequence[Sensitivity] = ()  # of the latency, of a study with samples


@dataclass(frozen=True)
class RunSubject:
    """A run as its figures need it."""

    history: xr.Dataset  # its history
    events: Events  # its events
    options: SceneOptions = field(default_factory=SceneOptions)
    times: tuple[float, ...] = ()  # times of the panels [s]
    afferents: Mapping[str, AfferentModel] | None = None  # models of afferents; those of the human fingertip
    recorded: Spikes | xr.Dataset | None = None  # spikes of a recording, below those of the models, or tracks
    name: str = ""  # with which the names of its pictures begin
    title: str = ""  # which the titles of its figures have


def check_subject(name: str, subject: StudySubject | RunSubject) -> None:
    """Refuse a figure of which a study or a run has nothing."""
    if isinstance(subject, StudySubject):
        kind, histories = STUDY_FIGURES[name], list(subject.histories.values())
        if "swept value" in kind.needs and not subject.path:
            raise InputError("figure", f"'{name}' has nothing on its axis", "needs a study with a sweep")
    else:
        kind, histories = RUN_FIGURES[name], [subject.history]
    for history in histories:
        if not kind.fits(history):
            needed, actual = ("three", "two") if kind.dimensions == 3 else ("two", "three")
            every = {**RUN_FIGURES, **STUDY_FIGURES}
            names = sorted(name for name, other in every.items() if other.words and other.fits(history))
            fault = f"'{name}' shows runs of {needed}, this one has {actual} dimensions"
            raise InputError("figure: --kind", fault, f"needs one of {', '.join(names)}")
        recorded = {"receptors": "receptors: [FA-I, SA-I]", "markers": "groups: [internal_markers]"}
        for need, group in recorded.items():
            if need in kind.needs and not HAS[need](history):
                raise ResultError(f"history: has no {need}, needs some; write record: {{{group}}} and run again")


#: Runs that a page shows in figures: more panels are too small to read, more runs in detail too long a page.
MOST_RUNS = 12
#: Runs of a study with more than that which have a section of their own: all that are drawn can be seen in motion.
MOST_DETAILED = 1

_EMPTY: Mapping[str, Any] = MappingProxyType({})


def detailed_of(runs: int) -> int:
    """Return how many runs of a study of so many have a section of their own at most."""
    return runs if runs <= MOST_RUNS else MOST_DETAILED


@dataclass(frozen=True)
class RunPictures:
    """Pictures of one run that were drawn before its report is made."""

    contact: tuple[Picture, ...] | None = None  # those of the section that shows it in detail
    model: tuple[Picture, ...] | None = None  # those of its model at the start
    process: int = field(default_factory=os.getpid, compare=False)  # which has drawn them


@dataclass(frozen=True)
class Film:
    """What one camera saw of one run."""

    run: str  # name of the run
    kind: str  # which camera
    tracks: xr.Dataset  # tracks in pixels of the tracker, with the markers of the truth
    numbers: Mapping[str, float | None]  # how far they are from each other
    frames: Mapping[float, NDArray[np.uint8]]  # (height, width), some frames by their times [s]


@dataclass(frozen=True)
class ReportContent:
    """What a study's report is made of."""

    study: StudyResult  # the study and its finished runs
    histories: Mapping[str, xr.Dataset]  # their histories by name of the run
    pictures: Mapping[str, RunPictures] = field(default_factory=lambda: _EMPTY)
    references: tuple[PublishedSet, ...] = ()  # published values to compare with
    values: tuple[ShownValue, ...] = ()  # all values of the runs with their sources
    provenance: Mapping[str, str] = field(default_factory=lambda: _EMPTY)
    settings: EventSettings = field(default_factory=EventSettings)
    convergences: Mapping[str, Mapping[str, Convergence]] = field(default_factory=lambda: _EMPTY)
    starts: Mapping[str, float] = field(default_factory=lambda: _EMPTY)  # when slides begin [s]
    notes: str = ""  # the user's own notes and figures as HTML
    representatives: Mapping[str, xr.Dataset] = field(default_factory=lambda: _EMPTY)
    films: tuple[Film, ...] = ()  # what the cameras of the study saw

    @property
    def title(self) -> str:
        """Title of the study, or the name of its folder."""
        return self.study.title or self.study.folder.name

    @cached_property
    def titles(self) -> dict[str, str]:
        """Title of each run by its name."""
        return {run.name: run_title(run, "the run") for run in self.study.runs}

    @property
    def drawn(self) -> tuple[RunResult, ...]:
        """The runs that are shown in figures: the first that have a history."""
        return tuple(run for run in self.study.runs if run.name in self.histories)[:MOST_RUNS]

    @property
    def detailed_runs(self) -> tuple[RunResult, ...]:
        """The runs that have a section of their own: all that are shown in figures, of a large study the first."""
        return self.drawn[: detailed_of(len(self.study.runs))]

    @property
    def modelled_runs(self) -> tuple[RunResult, ...]:
        """The runs whose models are shown: the first with each mesh, and of samples none."""
        first: dict[str, RunResult] = {}
        for run in () if self.study.ranges else self.study.runs:
            first.setdefault(run.mesh_hash, run)
        return tuple(first.values())

    def titled_histories(self) -> dict[str, xr.Dataset]:
        """Return the histories of the drawn runs by title."""
        return {self.titles[run.name]: self.histories[run.name] for run in self.drawn}

    def subject(self, path: str = "") -> StudySubject:
        """Return the study as its figures need it; the first published set stands for the paper of all."""
        sets = self.references
        published = tuple(value for reference in sets for value in reference.values)
        return StudySubject(
            self.study.runs,
            self.titled_histories(),
            {self.titles[run.name]: run.events for run in self.drawn},
            dataclasses.replace(sets[0], values=published) if sets else None,
            self.starts,
            path,
            self.settings.peaks,
        )
