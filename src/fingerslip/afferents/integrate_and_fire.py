"""A leaky integrate-and-fire model of a tactile afferent.

The stimulus s is low-passed and drives a membrane with the time constant tau ::

    tau dV/dt = -V + |s| / s_0 + |ds/dt| / r_0

that fires when V reaches 1, falls to 0 and rests there for a while. So s_0 and r_0 are the least steady stimulus, and
the least steady rate of it, at which an afferent fires; under a drive d > 1 it fires every tau ln(d / (d - 1)) and
the time of rest.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Annotated

import numpy as np
import pydantic
from numpy.typing import NDArray
from scipy import signal

from fingerslip.afferents.signals import ORDER, filter_from_rest
from fingerslip.errors import InputError
from fingerslip.parameters import Duration, PositiveDuration, Rate, parameters
from fingerslip.parameters.presets import Presets
from fingerslip.sites import RECEPTOR_KINDS

Array = NDArray[np.float64]
_Positive = Annotated[float, pydantic.Field(gt=0)]

# Steps of the membrane are at most these shares of its time constant and of the rest after a spike.
_OF_MEMBRANE, _OF_REST = 0.02, 0.2


@parameters
class IntegrateAndFire:
    """One type of afferent.

    Parameters
    ----------
    stimulus : str
        What it responds to, one of :data:`~fingerslip.afferents.stimuli.STIMULI`.
    least_steady : float, optional
        Least steady stimulus at which it fires [SI unit of the stimulus]; None where it does not respond to that.
    least_rate : float, optional
        Least steady rate of the stimulus at which it fires [the same per second]; None likewise.
    highest_frequency : float
        Cutoff of the low pass of third order on the stimulus [Hz].
    membrane_time : float
        Time constant of the membrane [s].
    rest : float
        Time after a spike in which there is no other [s].
    delay : float
        Time from the receptor to where spikes are counted [s].

    Raises
    ------
    InputError
        Where it responds to nothing.
    """

    stimulus: str
    highest_frequency: Rate
    membrane_time: PositiveDuration
    least_steady: _Positive | None = None
    least_rate: _Positive | None = None
    rest: Duration = 1e-3
    delay: Duration = 0.0

    def __post_init__(self) -> None:
        if self.least_steady is None and self.least_rate is None:
            raise InputError("least_steady", "is missing, and least_rate too", "needs one of the two")

    def spikes(self, times: Array, values: Array) -> Sequence[Array]:
        """Return the spike times [s] of k receptors, from times (n,) [s] and the stimulus (n, k)."""
        fine, drive = self._drive(np.asarray(times, dtype=float), np.asarray(values, dtype=float))
        rows, columns = self._find_spikes(fine, drive)
        return [fine[rows[columns == column]] + self.delay for column in range(drive.shape[1])]

    def _drive(self, times: Array, values: Array) -> tuple[Array, Array]:
        """Return fine times (m,) [s] and the drive (m, k) [-] at them."""
        finest = _OF_MEMBRANE * self.membrane_time
        step = min(finest, _OF_REST * self.rest) if self.rest else finest
        fine = np.linspace(times[0], times[-1], int(np.ceil((times[-1] - times[0]) / step)) + 1)
        between = np.stack([np.interp(fine, times, column) for column in values.T], axis=1)
        low = self._low_pass(between, 1.0 / (fine[1] - fine[0]))
        drive = np.zeros_like(low)
        if self.least_steady is not None:
            drive += np.abs(low) / self.least_steady
        if self.least_rate is not None:
            drive += np.abs(np.gradient(low, fine, axis=0)) / self.least_rate
        return fine, drive

    def _low_pass(self, values: Array, rate: float) -> Array:
        """Return values (m, k) without what is above the highest frequency, from rest at the first of them."""
        if self.highest_frequency >= 0.5 * rate:
            return values
        return filter_from_rest(values, signal.butter(ORDER, self.highest_frequency, fs=rate, output="sos"), 0)

    def _find_spikes(self, times: Array, drive: Array) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return rows and columns of all spikes: V relaxes exactly towards the mean drive of each step."""
        step = times[1] - times[0]
        left, resting = np.exp(-step / self.membrane_time), round(self.rest / step)
        mean, membrane = 0.5 * (drive[1:] + drive[:-1]), np.zeros(drive.shape[1])
        free_from = np.zeros(drive.shape[1], dtype=np.intp)
        rows, columns = [], []
        for row, target in enumerate(mean, start=1):
            membrane = np.where(row > free_from, target + (membrane - target) * left, 0.0)
            if (fired := np.flatnonzero(membrane >= 1.0)).size:
                membrane[fired], free_from[fired] = 0.0, row + resting
                rows.append(np.full(fired.size, row))
                columns.append(fired)
        empty = np.empty(0, dtype=np.intp)
        return np.concatenate([empty, *rows]), np.concatenate([empty, *columns])


#: Afferents that ship.
AFFERENTS = Presets(IntegrateAndFire, "fingerslip.afferents")


def human_afferents() -> Mapping[str, IntegrateAndFire]:
    """Return the models of the four types of afferent of the human fingertip, by type.

    Time constants are published; thresholds are assumed (``fingerslip.afferents.integrate_and_fire.AFFERENTS.table``
    says of every value where it comes from). Spike times are as good as those.

    Examples
    --------
    >>> sorted(human_afferents())
    ['FA-I', 'FA-II', 'SA-I', 'SA-II']
    """
    return MappingProxyType({kind: AFFERENTS.read(kind.lower()) for kind in RECEPTOR_KINDS})
