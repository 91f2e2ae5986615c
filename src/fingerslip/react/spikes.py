"""A detector that counts the spikes of afferents, step by step.

Each afferent is that of :mod:`fingerslip.afferents.model`, whose filter and membrane carry on from one
step to the next; between two steps its stimulus is linear.
"""

from __future__ import annotations

import warnings
from collections import deque

import numpy as np
import xarray as xr
from scipy import signal

from fingerslip.afferents.model import AFFERENTS, IntegrateAndFire
from fingerslip.afferents.signals import STEPS_A_PERIOD, STIMULI, BandwidthWarning, step_text
from fingerslip.arrays import Floats
from fingerslip.dynamics.steering.steering import Observation
from fingerslip.history import VARIABLES
from fingerslip.react.moment import Alarm, Moment
from fingerslip.sites import ReceptorKind

_SIGNALS = ("strain", "stress", "strain_energy_density", "velocity", "acceleration")


class SpikeWatch:
    """Counts the spikes of afferents of a kind in one run: so many within a window [s] are an alarm."""

    def __init__(self, kind: ReceptorKind, count: int, window: float) -> None:
        self._kind, self._count, self._window = kind, count, window
        self._model = AFFERENTS.read(kind.lower())
        self._stream: SpikeStream | None = None
        self._arrivals: deque[float] = deque()
        self._began, self._has_warned = 0.0, False

    def take(self, moment: Moment) -> Alarm | None:
        """Return an alarm, or None, after a step."""
        stimulus = stimulus_of(moment.observation, self._kind)
        if self._stream is None:
            self._stream, self._began = SpikeStream(self._model, moment.time, stimulus), moment.time
            return None
        # Warn once where the first step does not resolve what the afferents respond to.
        longest = 1.0 / (STEPS_A_PERIOD * self._model.highest_frequency)
        if moment.time - self._began > longest * (1.0 + 1e-6) and not self._has_warned:
            text = f"{self._kind} responds to {self._model.highest_frequency:g} Hz, which needs steps of"
            warnings.warn(f"{text} {step_text(self._model.highest_frequency)}", BandwidthWarning, stacklevel=2)
        self._has_warned = True
        self._arrivals.extend(self._stream.advance(moment.time, stimulus))
        while self._arrivals and self._arrivals[0] < self._arrivals[-1] - self._window:
            self._arrivals.popleft()
        count = len(self._arrivals)
        return Alarm(max(self._arrivals[-1], moment.time), count) if count >= self._count else None


def stimulus_of(seen: Observation, kind: ReceptorKind) -> Floats:
    """Return the stimulus of each recorded afferent of a kind, (k,) in its SI unit."""
    recorded = seen.recorder.coordinates
    rows = np.flatnonzero(np.asarray(recorded["site_kind"]) == kind)
    values = {name: (VARIABLES[name].dims, np.asarray(seen[name])[None][:, rows]) for name in _SIGNALS}
    at = xr.Dataset(values, {"stress_component": recorded["stress_component"]})
    stimulus: Floats = np.asarray(STIMULI[AFFERENTS.read(kind.lower()).stimulus][2](at))[0]
    return stimulus


class SpikeStream:
    """Afferents of one type whose stimuli come step by step."""

    def __init__(self, model: IntegrateAndFire, time: float, stimuli: Floats) -> None:
        """Begin at rest under stimuli (k,) at a time [s]."""
        self._model, self._time, self._stimuli = model, time, stimuli
        self._low, self._membrane, self._last = stimuli, np.zeros(stimuli.size), np.full(stimuli.size, -np.inf)
        self._drive = model.drive(stimuli, np.zeros(stimuli.size))
        self._sections: Floats | None = None
        self._left = np.zeros(0)

    def advance(self, time: float, stimuli: Floats) -> list[float]:
        """Take the stimuli (k,) at the next time [s], and return the times at which spikes arrive [s]."""
        model, length = self._model, time - self._time
        count = int(np.ceil(length / model.longest_step - 1e-9))
        step = length / count
        shares = np.arange(1, count + 1)[:, None] / count
        low = self._filter(self._stimuli + shares * (stimuli - self._stimuli), 1.0 / step)
        decay, arrivals = np.exp(-step / model.membrane_time), []
        for number, values in enumerate(low, start=1):
            drive = model.drive(values, (values - self._low) / step)
            now = self._time + number * step
            target = 0.5 * (drive + self._drive) - model.inhibition(now - 0.5 * step - self._last)
            membrane = target + (self._membrane - target) * decay
            membrane = np.where(now > self._last + model.rest, membrane, np.minimum(membrane, 0.0))
            fires = membrane >= 1.0
            arrivals += [now + model.delay] * int(fires.sum())
            self._membrane = np.where(fires, 0.0, membrane)
            self._last = np.where(fires, now, self._last)
            self._low, self._drive = values, drive
        self._time, self._stimuli = time, stimuli
        return arrivals

    def _filter(self, values: Floats, rate: float) -> Floats:
        """Return values (m, k) at a rate [1/s] without what is above the highest frequency, on from the last ones."""
        if self._sections is None:
            if (sections := self._model.low_pass(rate)) is None:
                return values
            self._sections, self._left = sections, signal.sosfilt_zi(sections)[:, :, None] * self._stimuli
        smoothed, self._left = signal.sosfilt(self._sections, values, axis=0, zi=self._left)
        return np.asarray(smoothed)
