"""The map: how long a reflex may take, over friction, rate of the load and shape of the phalanx."""

from __future__ import annotations

import functools
import itertools
import multiprocessing
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pydantic

from fingerslip.errors import InputError, unknown_name
from fingerslip.model.model import Model
from fingerslip.parameters import Duration, PositiveDuration, PositiveLength, from_mapping, parameters
from fingerslip.parameters.yaml_text import parse_document
from fingerslip.react.detectors import DetectorChoice, SlippedArea
from fingerslip.react.latency import critical_start
from fingerslip.react.loads import RampLoad
from fingerslip.react.loop import Grasp, MemoryBases, Outcome, require_whole_step
from fingerslip.react.reflex import REACTIONS, ForceRate, Reaction, reaction
from fingerslip.react.scenario import HeldObject, holder_of
from fingerslip.specimens.fingertip.fingertip import preset, preset_names
from fingerslip.specimens.fingertip.meshing.sources import MeshSizes

__all__ = [
    "Cell",
    "MapCentre",
    "MapResult",
    "ReactionMap",
    "Trial",
    "grasp_of",
    "map_holder",
    "reaction_map",
    "read_reaction_map",
]

PhalanxVariant = Literal["original", "flattened", "scaled"]
_Friction = Annotated[float, pydantic.Field(gt=0)]
_DETECTORS = {"48 % slipped": SlippedArea()}


@parameters
class MapCentre:
    """The cell of a map that is looked at closely.

    Parameters
    ----------
    friction : float
        Its friction coefficient [-].
    load_rate : float
        Its rate of the load [N/s].
    phalanx : {'original', 'flattened', 'scaled'}
        Its phalanx.
    """

    friction: _Friction = 0.6
    load_rate: ForceRate = 4.0
    phalanx: PhalanxVariant = "original"


@parameters
class ReactionMap:
    """A map of critical latencies: every friction with every rate of the load and every phalanx.

    Parameters
    ----------
    title : str
        What it shows.
    fingertip : str
        Preset of the fingertip.
    phalanges : tuple of {'original', 'flattened', 'scaled'}
        Shapes of its phalanx.
    depth : float
        Width of the contact, out of the section [m].
    contact_size, bulk_size : float
        Element sizes [m].
    held : HeldObject
        The object; its load is a ramp, whose rate the map changes.
    friction : tuple of float
        Friction coefficients [-].
    load_rates : tuple of float
        Rates of the load [N/s].
    detectors : mapping of str to detector
        What notices slip; the first one is that of the answer.
    reaction : str
        Name of the reaction whose rise of the grip the map takes.
    reactions : tuple of str
        Reactions that are tried at the centre.
    centre : MapCentre
        The cell at which all reactions, and travel against latency, are computed.
    latencies : tuple of float
        Latencies of the curve of travel [s].
    tolerance : float
        Largest error of a critical latency [s].
    """

    title: str = ""
    fingertip: str = "wang2014-2d"
    phalanges: tuple[PhalanxVariant, ...] = ("original", "flattened", "scaled")
    depth: PositiveLength = 12e-3
    contact_size: PositiveLength = 0.15e-3
    bulk_size: PositiveLength = 0.5e-3
    held: HeldObject = HeldObject(step=2e-3)
    friction: tuple[_Friction, ...] = (0.3, 0.45, 0.6, 0.75, 0.9)
    load_rates: tuple[ForceRate, ...] = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
    detectors: Mapping[str, DetectorChoice] = pydantic.Field(default_factory=lambda: dict(_DETECTORS))
    reaction: str = "human-slip"
    reactions: tuple[str, ...] = REACTIONS.names
    centre: MapCentre = MapCentre()
    latencies: tuple[Duration, ...] = ()
    tolerance: PositiveDuration = 1e-3

    def __post_init__(self) -> None:
        if not isinstance(self.held.load, RampLoad):
            raise InputError("held.load", "is no ramp", "needs one: the map changes its rate", "write ramp_load")
        if not self.detectors:
            raise InputError("detectors", "has none", "needs one or more", "leave it out for 48 % slipped")
        for where, name, names in (
            ("fingertip", self.fingertip, preset_names()),
            ("reaction", self.reaction, REACTIONS.names),
            *(("reactions", name, REACTIONS.names) for name in self.reactions),
        ):
            if name not in names:
                raise unknown_name(where, name, names)
        for name, value, values in (
            ("friction", self.centre.friction, self.friction),
            ("load_rate", self.centre.load_rate, self.load_rates),
            ("phalanx", self.centre.phalanx, self.phalanges),
        ):
            if value not in values:
                allowed = f"needs one of the map's: {', '.join(map(str, values)) or 'none'}"
                raise InputError(f"centre.{name}", f"got {value}", allowed)
        self._check_numbers()
        self._check_reactions()

    def _check_numbers(self) -> None:
        """Refuse numbers that do not ascend, and latencies within a step."""
        rows = {"friction": self.friction, "load_rates": self.load_rates, "latencies": self.latencies}
        for name, numbers in rows.items():
            if any(first >= second for first, second in itertools.pairwise(numbers)):
                raise InputError(
                    name, f"got {', '.join(f'{number:g}' for number in numbers)}", "needs ascending numbers"
                )
        for number, latency in enumerate(self.latencies):
            require_whole_step(f"latencies.{number}", latency, self.held.step)

    def _check_reactions(self) -> None:
        """Refuse reactions that are quicker than a step, or cannot even hold a first grip."""
        largest = replace(self.held, friction=min(self.friction)).first_grip
        for name in dict.fromkeys((self.reaction, *self.reactions)):
            try:
                require_whole_step("reflex.latency", reaction(name).reflex.latency, self.held.step)
                reaction(name).response(0.0, largest)
            except InputError as error:
                raise error.moved(lambda where, name=name: f"reactions: {name}: {where}") from None  # type: ignore[misc]

    @property
    def detector(self) -> str:
        """Name of the detector of the answer."""
        return next(iter(self.detectors))

    @property
    def cells(self) -> tuple[MapCentre, ...]:
        """All cells, phalanx after phalanx."""
        rows = itertools.product(self.phalanges, self.friction, self.load_rates)
        return tuple(MapCentre(friction, rate, phalanx) for phalanx, friction, rate in rows)

    def held_at(self, cell: MapCentre) -> HeldObject:
        """Return the object of a cell."""
        assert isinstance(self.held.load, RampLoad)
        return replace(self.held, friction=cell.friction, load=RampLoad(cell.load_rate, self.held.load.force))


@dataclass(frozen=True)
class Cell:
    """What came of one cell of a map; times count from the start of the load [s]."""

    at: MapCentre
    grip: float  # first grip force [N]
    alarms: Mapping[str, float | None]  # of each detector
    gross: float | None  # when all of the contact slips
    lost: float | None  # when the object is lost without a reaction
    critical: Mapping[str, float | None]  # critical latency after each detector's alarm; None: even none is too much
    error: float  # how much longer they may be
    runs: int  # reactions that were computed


@dataclass(frozen=True)
class Trial:
    """One reaction at the centre of a map."""

    reaction: str
    detector: str
    delay: float  # from the alarm, or the load, to the first change of the force [s]
    critical: float | None  # the longest such delay that saves the object [s]
    outcome: Outcome

    @property
    def since_load(self) -> bool:
        """Whether its delay counts from the start of the load."""
        return reaction(self.reaction).reflex.since == "load"


@dataclass(frozen=True)
class MapResult:
    """A map that was computed.

    Parameters
    ----------
    settings : ReactionMap
        What was computed.
    cells : tuple of Cell
        What came of every cell, phalanx after phalanx, friction after friction.
    trials : tuple of Trial
        What came of every reaction at the centre.
    latencies : tuple of float
        Latencies of the curve of travel [s].
    travels : mapping of str to tuple of float
        Largest travel after each of them, for each phalanx [m].
    refined : mapping of str to float or None
        The critical latency of the centre with half the step, and with finer cells [s].
    """

    settings: ReactionMap
    cells: tuple[Cell, ...]
    trials: tuple[Trial, ...]
    latencies: tuple[float, ...]
    travels: Mapping[str, tuple[float, ...]]
    refined: Mapping[str, float | None]

    @property
    def uncertainty(self) -> float:
        """Numerical uncertainty of the critical latency of the centre [s]: of search, step and mesh together."""
        centre = self.cell(self.settings.centre)
        critical = centre.critical[self.settings.detector]
        values = [value for value in (critical, *self.refined.values()) if value is not None and np.isfinite(value)]
        return float(centre.error + sum(abs(value - values[0]) for value in values[1:]))

    def cell(self, at: MapCentre) -> Cell:
        """Return the result of a cell."""
        return next(cell for cell in self.cells if cell.at == at)

    def latency(self, phalanx: str, detector: str) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Return critical latencies [s], (n_frictions, n_rates): NaN where none saves, inf where none is needed."""
        values = [cell.critical[detector] for cell in self.cells if cell.at.phalanx == phalanx]
        shape = (len(self.settings.friction), len(self.settings.load_rates))
        return np.array([np.nan if value is None else value for value in values], dtype=float).reshape(shape)


def read_reaction_map(path: str | Path) -> ReactionMap:
    """Read the settings of a map from a YAML file.

    Parameters
    ----------
    path : path
        The file; quantities are text with units.

    Returns
    -------
    ReactionMap
        The settings.

    Raises
    ------
    InputError
        For all mistakes in the file.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        repair = "studies/reactions has some"
        raise InputError(str(path), f"cannot be read ({error.strerror})", "needs a file", repair) from None
    content = parse_document(text, str(path)).content
    if not isinstance(content, dict):
        raise InputError(str(path), "holds no mapping", "needs 'key: value' lines")
    return from_mapping(ReactionMap, content, str(path))


def reaction_map(
    settings: ReactionMap, *, workers: int = 1, progress: Callable[[float], None] | None = None
) -> MapResult:
    """Compute the map of critical latencies.

    Parameters
    ----------
    settings : ReactionMap
        What to compute.
    workers : int, optional
        Processes at once.
    progress : callable, optional
        Called with the fraction that is done.

    Returns
    -------
    MapResult
        Critical latencies, the reactions at the centre, and travel against latency.
    """
    jobs: list[Callable[[], Any]] = [functools.partial(_compute_centre, settings)]
    jobs += [functools.partial(_compute_cell, finer, finer.centre) for finer in _refinements(settings).values()]
    jobs += [functools.partial(_compute_curve, settings, phalanx) for phalanx in settings.phalanges]
    jobs += [functools.partial(_compute_cell, settings, cell) for cell in settings.cells]
    results = []
    for result in _run_all(jobs, workers):
        results.append(result)
        if progress is not None:
            progress(len(results) / len(jobs))
    trials, rest = results[0], iter(results[1:])
    refined = {name: next(rest).critical[settings.detector] for name in _refinements(settings)}
    travels: dict[str, tuple[float, ...]] = {phalanx: next(rest) for phalanx in settings.phalanges}
    return MapResult(settings, tuple(rest), trials, settings.latencies, travels, refined)


def _refinements(settings: ReactionMap) -> dict[str, ReactionMap]:
    """Return the map with half the step, and with cells of two thirds."""
    finer = {name: getattr(settings, name) / 1.5 for name in ("contact_size", "bulk_size")}
    halved = replace(settings.held, step=0.5 * settings.held.step)
    return {"half the step": replace(settings, held=halved), "finer cells": replace(settings, **finer)}


def _run_all(jobs: Iterable[Callable[[], Any]], workers: int) -> Iterator[Any]:
    """Yield what jobs return, in their order, from this process or from several."""
    if workers == 1:
        yield from (job() for job in jobs)
        return
    with ProcessPoolExecutor(workers, multiprocessing.get_context("spawn")) as pool:
        yield from (future.result() for future in [pool.submit(job) for job in jobs])


@functools.cache
def _holder(fingertip: str, phalanx: PhalanxVariant, sizes: MeshSizes, depth: float, groups: tuple[str, ...]) -> Model:
    """Return a fingertip with one shape of the phalanx; meshes are kept as long as the process lives."""
    finger = preset(fingertip)
    shaped = replace(finger, phalanx=replace(finger.phalanx, variant=phalanx))
    return holder_of(shaped, sizes, depth=depth, groups=groups)


_BASES = MemoryBases()


def map_holder(settings: ReactionMap, phalanx: PhalanxVariant, groups: Iterable[str] = ()) -> Model:
    """Return the fingertip of a map with one shape of the phalanx, and with groups of sites that are recorded."""
    sizes = MeshSizes(contact_size=settings.contact_size, bulk_size=settings.bulk_size)
    return _holder(settings.fingertip, phalanx, sizes, settings.depth, tuple(sorted(set(groups))))


def grasp_of(settings: ReactionMap, cell: MapCentre) -> Grasp:
    """Return the object of a cell, held and watched."""
    groups = (group for detector in settings.detectors.values() for group in detector.groups)
    holder = map_holder(settings, cell.phalanx, groups)
    return Grasp(settings.held_at(cell), holder, settings.detectors, bases=_BASES)


def _compute_cell(settings: ReactionMap, at: MapCentre) -> Cell:
    with grasp_of(settings, at) as grasp:
        loop = grasp.open_loop
        critical = critical_start(grasp, reaction(settings.reaction), settings.tolerance)
        return Cell(
            at=at,
            grip=grasp.held.first_grip,
            alarms={name: None if alarm is None else alarm.time for name, alarm in loop.alarms.items()},
            gross=loop.gross,
            lost=loop.lost,
            critical={name: critical.latency(grasp, name) for name in grasp.detectors},
            error=critical.error,
            runs=critical.runs,
        )


def _compute_centre(settings: ReactionMap) -> tuple[Trial, ...]:
    """Try all reactions at the centre, after every detector."""
    with grasp_of(settings, settings.centre) as grasp:
        rows: list[Trial] = []
        for name in settings.reactions:
            tried = reaction(name)
            critical, since_load = critical_start(grasp, tried, settings.tolerance), tried.reflex.since == "load"
            for detector in settings.detectors:
                longest = critical.time if since_load else critical.latency(grasp, detector)
                rows.append(Trial(name, detector, tried.delay, longest, grasp.react(tried, detector)))
        return tuple(rows)


def _compute_curve(settings: ReactionMap, phalanx: PhalanxVariant) -> tuple[float, ...]:
    """Return the travel [m] after each latency, from the alarm of the detector of the answer on."""
    shape = reaction(settings.reaction)
    with grasp_of(settings, replace(settings.centre, phalanx=phalanx)) as grasp:
        delayed = (_with_delay(shape, latency) for latency in settings.latencies)
        return tuple(grasp.react(tried, settings.detector).travel for tried in delayed)


def _with_delay(tried: Reaction, delay: float) -> Reaction:
    """Return a reaction that changes the force a time after the alarm [s]."""
    return Reaction(replace(tried.reflex, latency=delay), replace(tried.actuator, dead_time=0.0))
