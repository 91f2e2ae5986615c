"""Detectors: each takes what there is to see after a step, and says whether it noticed slip."""

from __future__ import annotations

from typing import Annotated, Self

import pydantic

from fingerslip.parameters import Fraction, PositiveDuration, PositiveLength, ShortDuration, one_of, parameters
from fingerslip.react.moment import SLIPPED, Alarm, Moment, Watch
from fingerslip.sites import ReceptorKind

Delay = Annotated[ShortDuration, "Time from what it measures to its alarm [s]."]


class _Stateless:
    """A detector that remembers nothing from step to step, and needs no sites."""

    @property
    def groups(self) -> tuple[str, ...]:
        """Return none."""
        return ()

    def start(self) -> Self:
        """Return itself."""
        return self


@parameters
class SlippedArea(_Stateless):
    """The truth: a share of the contact area has slipped since the load began.

    See :class:`Grasp`.
    """

    fraction: Annotated[Fraction, "The share [-]; people notice slip at 0.48 (Barrea et al. 2018)."] = 0.48
    tolerance: Annotated[PositiveLength, "Slip from which a node counts [m]."] = SLIPPED
    delay: Delay = 0.0

    def take(self, moment: Moment) -> Alarm | None:
        """Return an alarm, or None, after a step."""
        value = moment.slipped_fraction(self.tolerance)
        return Alarm(moment.time, value) if value >= self.fraction else None


@parameters
class StickRatio(_Stateless):
    """The truth: no more than a share of the contact area sticks.

    See :class:`Grasp`.
    """

    ratio: Annotated[Fraction, "The share [-]."] = 0.5
    delay: Delay = 0.0

    def take(self, moment: Moment) -> Alarm | None:
        """Return an alarm, or None, after a step."""
        value = moment.stick_ratio
        return Alarm(moment.time, value) if value <= self.ratio else None


@parameters
class ForceRatio(_Stateless):
    """Normal and tangential force, and a friction coefficient that is known.

    See :class:`Grasp`.
    """

    friction: Annotated[float, pydantic.Field(gt=0), "The coefficient that the detector believes in [-]."]
    share: Annotated[Fraction, "Share of it that the ratio of the forces has to reach [-]."] = 0.9
    delay: Delay = 0.0

    def take(self, moment: Moment) -> Alarm | None:
        """Return an alarm, or None, after a step."""
        value = moment.force_ratio
        return Alarm(moment.time, value) if value >= self.share * self.friction else None


@parameters
class AtOnce(_Stateless):
    """An alarm as soon as the load begins.

    See :class:`Grasp`.
    """

    delay: Annotated[ShortDuration, "Time from the load to the alarm [s]."] = 0.0

    def take(self, moment: Moment) -> Alarm | None:
        """Return an alarm."""
        return Alarm(moment.time, 1.0)


@parameters
class Never(_Stateless):
    """No alarm, whatever happens.

    See :class:`Grasp`.
    """

    delay: Annotated[ShortDuration, "Of no consequence [s]."] = 0.0

    def take(self, moment: Moment) -> Alarm | None:  # noqa: ARG002  as for all detectors
        """Return None."""
        return None


@parameters
class SpikeCount:
    """Spikes of a population of afferents.

    See :class:`Grasp`.
    """

    kind: Annotated[ReceptorKind, "Type of the afferents; the holder has to record their receptors."] = "FA-I"
    count: Annotated[
        int, pydantic.Field(gt=0), "Spikes of all of them together, since the load began, that are an alarm."
    ] = 10
    window: Annotated[PositiveDuration, "Time within which they have to arrive [s]."] = 20e-3
    delay: Annotated[
        ShortDuration, "Time from where spikes are counted, after each afferent's own conduction, to the alarm [s]."
    ] = 0.0

    @property
    def groups(self) -> tuple[str, ...]:
        """The kind of the receptors."""
        return (self.kind,)

    def start(self) -> Watch:
        """Return what watches one run."""
        # Afferents are slow to load, and a study is also read where nothing is computed.
        from fingerslip.react.spikes import SpikeWatch

        return SpikeWatch(self.kind, self.count, self.window)


BuiltInDetector = SlippedArea | StickRatio | ForceRatio | SpikeCount | AtOnce | Never
_WORDS = "A detector, under the key that names its kind; exactly one is given."
#: A detector as a parameter; files write ``slipped_area: {...}``.
DetectorChoice = Annotated[BuiltInDetector, one_of(BuiltInDetector, "detector", "DetectorChoice", _WORDS)]
