"""What came of the reactions of a run of a study, as data, and its file in the folder of the run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pydantic

from fingerslip.errors import DamagedError
from fingerslip.storage.files import write_text

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
    def since(self) -> str:
        """Since when the delay counts, in words where that is not the alarm."""
        return " after the load" if self.since_load else ""

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


def write_reactions(result: ReactionResult, folder: Path) -> None:
    """Write what came of the reactions of a run into its folder."""
    write_text(folder / REACTIONS, _STORED.dump_json(result, indent=1).decode())
