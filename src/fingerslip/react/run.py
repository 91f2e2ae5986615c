"""A run of a study with the block `reaction`: computed, and as data in the folder of the run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pydantic

from fingerslip.errors import DamagedError
from fingerslip.model.model import Model
from fingerslip.react.loads import RampLoad
from fingerslip.react.reflex import Reaction
from fingerslip.react.scenario import HeldObject
from fingerslip.react.settings import ReactionSettings
from fingerslip.storage.files import write_bytes, write_text

if TYPE_CHECKING:
    import xarray as xr

    from fingerslip.dynamics.reduced.basis import BasisStore
    from fingerslip.react.loop import Grasp

__all__ = ["FILM", "STILL", "ReactionResult", "Trial", "compute_reactions", "read_reactions"]

#: Files in the folder of a run: what came of its reactions, and the film of two of them with its last frame.
REACTIONS, FILM, STILL = "reactions.json", "reaction-film.mp4", "reaction-film.png"


@dataclass(frozen=True)
class Trial:
    """What came of one reaction after one detector."""

    reaction: str
    detector: str
    delay: float  # from the alarm, or the load, to the first change of the force [s]
    since_load: bool  # whether the delay counts from the start of the load
    force_rate: float  # of the grip at most [N/s]
    critical: float | None  # the longest such delay that saves the object [s]
    chance: float | None  # share of trials that save it, by the jitter of the reflex [-]
    saved: bool
    travel: float  # largest [m]
    slip: float  # largest of a node [m]
    grip_added: float  # [N]
    false_grip: bool  # whether the object would have been held without it

    @property
    def spare(self) -> float | None:
        """How much longer the delay may be [s]."""
        return None if self.critical is None else self.critical - self.delay


@dataclass(frozen=True)
class ReactionResult:
    """What came of the reactions of a run; times count from the start of the load [s]."""

    friction: float  # friction coefficient [-]
    load_rate: float | None  # of a ramp [N/s]
    grip: float  # first grip force [N]
    alarms: Mapping[str, float | None]  # of each detector
    gross: float | None  # when all of the contact slips
    lost: float | None  # when the object is lost without a reaction
    critical: Mapping[str, float | None]  # critical latency after each alarm; None: even none is too much, or not lost
    error: float  # how much longer they may be
    trials: tuple[Trial, ...] = ()
    travels: Mapping[float, float] = pydantic.Field(default_factory=dict)  # largest travel [m] by latency [s]

    def latency(self, detector: str) -> float:
        """Return the critical latency [s] after a detector's alarm: NaN where none saves, inf where none is needed."""
        value = self.critical[detector]
        return np.inf if self.lost is None else np.nan if value is None else value

    @property
    def times(self) -> dict[str, float | None]:
        """Its times by what they are called in tables [s]."""
        critical = {f"critical latency after {name}": value for name, value in self.critical.items()}
        return {"gross slip": self.gross, "lost": self.lost, **self.alarms, **critical}


_STORED: pydantic.TypeAdapter[ReactionResult] = pydantic.TypeAdapter(ReactionResult)


def read_reactions(folder: Path) -> ReactionResult:
    """Read what came of the reactions of a finished run."""
    try:
        return _STORED.validate_json((folder / REACTIONS).read_bytes())
    except (OSError, pydantic.ValidationError) as error:
        raise DamagedError(str(folder / REACTIONS), f"cannot be read ({error})", "run the study again") from None


def compute_reactions(
    settings: ReactionSettings,
    held: HeldObject,
    model: Model,
    folder: Path,
    *,
    bases: BasisStore,
    progress: Callable[[float], None],
) -> xr.Dataset:
    """Compute a run, write what comes of its reactions into its folder, and return the history without a reaction."""
    from fingerslip.react.loop import Grasp, MemoryBases

    with Grasp(held, model, settings.detectors, bases=MemoryBases(bases)) as grasp:
        result = _result(settings, grasp, progress)
        write_text(folder / REACTIONS, _STORED.dump_json(result, indent=1).decode())
        filmed = filmed_reactions(result, settings)
        # Films are written by OpenCV, of the extra `vision`.
        if filmed and model.mesh.dim() == 2 and find_spec("cv2"):
            from fingerslip.react.film import SHOWN_FILM, film_frames, write_film

            frames = film_frames(grasp, settings.detector, filmed, SHOWN_FILM)
            write_bytes(folder / STILL, write_film(folder / FILM, frames, SHOWN_FILM))
        return grasp.open_loop.history


def _result(settings: ReactionSettings, grasp: Grasp, progress: Callable[[float], None]) -> ReactionResult:
    from fingerslip.react.latency import critical_start

    held, loop = grasp.held, grasp.open_loop
    steps = iter(np.linspace(0.0, 1.0, 2 + len(settings.tried) + len(settings.latencies))[1:].tolist())
    progress(next(steps))
    critical = critical_start(grasp, settings.rise, settings.tolerance)
    progress(next(steps, 1.0))
    trials = list[Trial]()
    for name, reaction in settings.tried.items():
        trials += _trials(name, reaction, settings, grasp)
        progress(next(steps, 1.0))
    travels = {}
    for latency in settings.latencies:
        travels[latency] = grasp.react(_with_delay(settings.rise, latency), settings.detector).travel
        progress(next(steps, 1.0))
    return ReactionResult(
        friction=held.friction,
        load_rate=held.load.rate if isinstance(held.load, RampLoad) else None,
        grip=held.first_grip,
        alarms={name: None if alarm is None else alarm.time for name, alarm in loop.alarms.items()},
        gross=loop.gross,
        lost=loop.lost,
        critical={name: _finite(critical.latency(grasp, name)) for name in settings.detectors},
        error=critical.error,
        trials=tuple(trials),
        travels=travels,
    )


def _trials(name: str, reaction: Reaction, settings: ReactionSettings, grasp: Grasp) -> list[Trial]:
    """Try a reaction after every detector."""
    from fingerslip.react.latency import critical_start

    critical, since_load = critical_start(grasp, reaction, settings.tolerance), reaction.reflex.since == "load"
    trials = []
    for detector in settings.detectors:
        longest = _finite(critical.time if since_load else critical.latency(grasp, detector))
        outcome = grasp.react(reaction, detector)
        trials.append(
            Trial(
                reaction=name,
                detector=detector,
                delay=reaction.delay,
                since_load=since_load,
                force_rate=reaction.actuator.force_rate,
                critical=longest,
                chance=None if longest is None else reaction.reflex.share_within(longest - reaction.actuator.dead_time),
                saved=outcome.saved,
                travel=outcome.travel,
                slip=outcome.largest_slip,
                grip_added=outcome.grip_added,
                false_grip=outcome.false_grip,
            )
        )
    return trials


def _finite(time: float | None) -> float | None:
    return None if time is None or np.isinf(time) else time


def _with_delay(reaction: Reaction, delay: float) -> Reaction:
    """Return a reaction that changes the force a time after the alarm [s]."""
    return Reaction(replace(reaction.reflex, latency=delay), replace(reaction.actuator, dead_time=0.0))


def filmed_reactions(result: ReactionResult, settings: ReactionSettings) -> dict[str, Any]:
    """Return the slowest reaction that saves the object, and the quickest that loses it, by title."""
    tried = [trial for trial in result.trials if trial.detector == settings.detector and not trial.since_load]
    ordered = sorted(tried, key=lambda trial: trial.delay)
    saved, lost = ([trial for trial in ordered if trial.saved is kind] for kind in (True, False))
    return {
        f"{trial.reaction}, {1e3 * trial.delay:.0f} ms": settings.tried[trial.reaction]
        for trial in (*saved[-1:], *lost[:1])
    }
