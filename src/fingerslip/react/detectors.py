"""Detectors: each takes what there is to see after a step, and says whether it noticed slip."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Protocol

import numpy as np
import pydantic
from numpy.typing import NDArray

from fingerslip.contact.states import OPEN, STICK
from fingerslip.dynamics.steering.steering import Observation
from fingerslip.parameters import Duration, Fraction, PositiveLength, one_of, parameters
from fingerslip.slip.settings import EventSettings

__all__ = [
    "Alarm",
    "AtOnce",
    "Detector",
    "DetectorChoice",
    "ForceRatio",
    "Moment",
    "Never",
    "SlippedArea",
    "StickRatio",
]

Array = NDArray[np.float64]

_SLIPPED = EventSettings().slip_tolerance


@dataclass(frozen=True)
class Alarm:
    """What a detector says when it notices slip.

    Parameters
    ----------
    time : float
        When, since the load began [s].
    value : float
        What it measured, such as the share of the contact that has slipped.
    """

    time: float
    value: float


@dataclass(frozen=True)
class Moment:
    """What there is to see after a step.

    Parameters
    ----------
    time : float
        Time since the load began [s].
    observation : Observation
        All that was recorded of the step, by the names of the history.
    areas : (n,) array
        Tributary areas of the contact candidates [m^2].
    slips : (n,) array
        Their slip distances when the load began [m].
    """

    time: float
    observation: Observation
    areas: Array
    slips: Array

    @cached_property
    def touching(self) -> NDArray[np.bool_]:
        """Which candidates touch, (n,)."""
        return np.asarray(self.observation["contact_state"] != OPEN)

    def slipped_fraction(self, tolerance: float = _SLIPPED) -> float:
        """Return the share of the contact area that has slipped by more than a tolerance [m] since the load began."""
        return self._share(self.observation["slip_distance"] - self.slips > tolerance)

    @property
    def stick_ratio(self) -> float:
        """Share of the contact area that sticks."""
        return self._share(self.observation["contact_state"] == STICK)

    @property
    def force_ratio(self) -> float:
        """Tangential over normal force."""
        tangential, normal = np.abs(self.observation["counterface_force"][0])
        return float(tangential / normal) if normal > 0.0 else 0.0

    def _share(self, nodes: NDArray[np.bool_]) -> float:
        area = float(self.areas[self.touching].sum())
        return float(self.areas[nodes & self.touching].sum() / area) if area > 0.0 else 0.0


class Detector(Protocol):
    """What notices slip; it may read all that a step recorded, `moment.observation`."""

    @property
    def delay(self) -> float:
        """Time from what it measures to its alarm [s], apart from the latency of the reflex."""

    def take(self, moment: Moment) -> Alarm | None:
        """Return an alarm, or None, after a step."""


@parameters
class SlippedArea:
    """The truth: a share of the contact area has slipped since the load began.

    Parameters
    ----------
    fraction : float
        The share [-]; people notice slip at 0.48 (Barrea et al. 2018).
    tolerance : float
        Slip from which a node counts [m].
    delay : float
        Time from what it measures to its alarm [s].
    """

    fraction: Fraction = 0.48
    tolerance: PositiveLength = _SLIPPED
    delay: Duration = 0.0

    def take(self, moment: Moment) -> Alarm | None:
        """Return an alarm, or None, after a step."""
        value = moment.slipped_fraction(self.tolerance)
        return Alarm(moment.time, value) if value >= self.fraction else None


@parameters
class StickRatio:
    """The truth: no more than a share of the contact area sticks.

    Parameters
    ----------
    ratio : float
        The share [-].
    delay : float
        Time from what it measures to its alarm [s].
    """

    ratio: Fraction = 0.5
    delay: Duration = 0.0

    def take(self, moment: Moment) -> Alarm | None:
        """Return an alarm, or None, after a step."""
        value = moment.stick_ratio
        return Alarm(moment.time, value) if value <= self.ratio else None


@parameters
class ForceRatio:
    """Normal and tangential force, and a friction coefficient that is known.

    Parameters
    ----------
    friction : float
        The coefficient that the detector believes in [-].
    share : float
        Share of it that the ratio of the forces has to reach [-].
    delay : float
        Time from what it measures to its alarm [s].
    """

    friction: Annotated[float, pydantic.Field(gt=0)]
    share: Fraction = 0.9
    delay: Duration = 0.0

    def take(self, moment: Moment) -> Alarm | None:
        """Return an alarm, or None, after a step."""
        value = moment.force_ratio
        return Alarm(moment.time, value) if value >= self.share * self.friction else None


@parameters
class AtOnce:
    """An alarm as soon as the load begins.

    Parameters
    ----------
    delay : float
        Time from the load to the alarm [s].
    """

    delay: Duration = 0.0

    def take(self, moment: Moment) -> Alarm | None:
        """Return an alarm."""
        return Alarm(moment.time, 1.0)


@parameters
class Never:
    """No alarm, whatever happens.

    Parameters
    ----------
    delay : float
        Of no consequence [s].
    """

    delay: Duration = 0.0

    def take(self, moment: Moment) -> Alarm | None:  # noqa: ARG002  as for all detectors
        """Return None."""
        return None


BuiltInDetector = SlippedArea | StickRatio | ForceRatio | AtOnce | Never
_WORDS = "A detector, under the key that names its kind; exactly one is given."
#: A detector as a parameter; files write ``slipped_area: {...}``.
DetectorChoice = Annotated[BuiltInDetector, one_of(BuiltInDetector, "detector", "DetectorChoice", _WORDS)]
