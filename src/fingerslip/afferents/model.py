"""What every model of an afferent answers, and the spikes that it makes of a history."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import pandas as pd
import xarray as xr
from numpy.typing import NDArray

from fingerslip.afferents.signals import warn_beyond
from fingerslip.afferents.stimuli import STIMULI, receptor_stimuli
from fingerslip.errors import InputError, ResultError

Array = NDArray[np.float64]


class AfferentModel(Protocol):
    """A model of an afferent: arrays in, spike times out.

    A model of someone else's becomes one by two attributes and one method; nothing else of this package is needed.
    """

    @property
    def stimulus(self) -> str:
        """Name of what it responds to, one of :data:`~fingerslip.afferents.stimuli.STIMULI`."""

    @property
    def highest_frequency(self) -> float:
        """Highest frequency of the stimulus that matters to it [Hz]."""

    def spikes(self, times: Array, values: Array) -> Sequence[Array]:
        """Return the spike times [s] of each receptor, from times (n,) [s] and the stimulus (n, k) in SI units."""


@dataclass(frozen=True)
class Spikes:
    """Spikes of some afferents.

    Parameters
    ----------
    names, kinds : tuple of str
        Name and type of the receptor of each afferent.
    times : tuple of array
        Spike times of each [s].
    start, end : float
        Between which times was looked [s].
    """

    names: tuple[str, ...]
    kinds: tuple[str, ...]
    times: tuple[Array, ...]
    start: float
    end: float

    def to_dataframe(self) -> pd.DataFrame:
        """Return a row for each spike: `site`, `kind` and `time` [s]."""
        counts = [time.size for time in self.times]
        labels = {"site": self.names, "kind": self.kinds}
        columns = {name: np.repeat(np.array(texts, dtype=str), counts) for name, texts in labels.items()}
        return pd.DataFrame({**columns, "time": np.concatenate([np.empty(0), *self.times])})

    def rates(self, window: float) -> xr.DataArray:
        """Return the mean rate [1/s] of each receptor type in windows one after the other.

        Parameters
        ----------
        window : float
            Length of a window [s].

        Returns
        -------
        xarray.DataArray
            Spikes per second and afferent, dimensions (kind, time); time is the middle of the window [s]. The last
            window may reach beyond the end.

        Raises
        ------
        InputError
            Where the window has no length.
        """
        if not 0.0 < window < np.inf:
            raise InputError("window", f"got {window:g} s", "must be above 0 s")
        count = max(1, math.ceil((self.end - self.start) / window - 1e-9))
        edges: Array = self.start + window * np.arange(count + 1, dtype=np.float64)
        trains: dict[str, list[Array]] = {}
        for kind, times in zip(self.kinds, self.times, strict=True):
            trains.setdefault(kind, []).append(times)
        # Spikes per afferent of a type in each window.
        counts = [np.histogram(np.concatenate(times), edges)[0] / len(times) for times in trains.values()]
        values = np.reshape(counts, (len(trains), count)) / window
        coordinates = {"kind": list(trains), "time": 0.5 * (edges[1:] + edges[:-1])}
        return xr.DataArray(values, coordinates, ("kind", "time"), attrs={"units": "1/s"})


def spikes_of(history: xr.Dataset, models: Mapping[str, AfferentModel]) -> Spikes:
    """Return the spikes of the afferents of all recorded receptors.

    Parameters
    ----------
    history : xarray.Dataset
        A history with receptors.
    models : mapping of str to AfferentModel
        The model of each receptor type, such as :func:`~fingerslip.afferents.integrate_and_fire.human_afferents`.

    Raises
    ------
    InputError
        Where a model responds to a stimulus that is not known, or does not answer for every receptor.
    ResultError
        Where the history has no receptor of these types, no strain, less than two times, or a stimulus without values.

    Warns
    -----
    BandwidthWarning
        Where a model responds to higher frequencies than the records resolve.
    """
    for kind, model in models.items():
        if model.stimulus not in STIMULI:
            allowed = f"needs one of {', '.join(STIMULI)}"
            raise InputError(f"{kind}.stimulus", f"'{model.stimulus}' is not known", allowed)
    stimuli = receptor_stimuli(history, tuple(models))
    times, available = stimuli["time"].values, stimuli["site_kind"].values
    result: dict[int, Array] = {}
    for kind in dict.fromkeys(str(name) for name in available):
        model, rows = models[kind], np.flatnonzero(available == kind)
        values = stimuli[model.stimulus].values[:, rows]
        # Values that are not known would give no spikes.
        if len(values) < 2:
            raise ResultError(f"history.time: has {len(values)} values, needs two or more; simulate for longer")
        if not np.isfinite(values).all():
            fault = "is not known at some receptor, needs numbers; choose a model with another stimulus"
            raise ResultError(f"history.{model.stimulus}: {fault}")
        warn_beyond(history, model.highest_frequency, f"the model of {kind}")
        trains = model.spikes(times, values)
        if len(trains) != rows.size:
            raise InputError(f"{kind}.spikes", f"gave {len(trains)} arrays", f"needs {rows.size}, one a receptor")
        result |= dict(zip(rows.tolist(), trains, strict=True))
    order = sorted(result)
    names, kinds = (tuple(str(labels[row]) for row in order) for labels in (stimuli["site"].values, available))
    return Spikes(names, kinds, tuple(result[row] for row in order), float(times[0]), float(times[-1]))
