"""Spikes of afferents: those of a history by their models, their rates and where they are."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
import xarray as xr

from fingerslip.afferents.model import AfferentModel, answering_models, beyond_records, check_models
from fingerslip.afferents.signals import BandwidthWarning, receptor_stimuli, warn_beyond
from fingerslip.arrays import Floats
from fingerslip.errors import InputError, ResultError

#: The origin of spikes that models make.
SIMULATED = "simulated"
# Longest delay of a spike behind its stimulus [s], far above that of any nerve.
_DELAY = 1.0


@dataclass(frozen=True, repr=False)
class Spikes:
    """Spikes of some afferents.

    Parameters
    ----------
    names, kinds : tuple of str
        Name and type of the receptor of each afferent.
    times : tuple of array
        Spike times of each [s]. Lists, columns and trains of Neo in seconds become arrays (n,).
    start, end : float
        Between which times was looked [s].
    beyond : mapping of str to float, optional
        Types whose model responds to higher frequencies than the records resolve, and how high these go [Hz].
    origin : str, optional
        Where they come from, such as "microneurography, subject 3", as exported files say. Those of a run, and only
        those, are "simulated" without being told.

    Raises
    ------
    InputError
        Where afferents do not have a type and times each, or times are not in order between start and end.

    Examples
    --------
    Spikes around an event such as ``fs.find_events(history).slip.incipient``: a raster, and rates after it (PSTH).

    >>> import numpy as np
    >>> import fingerslip as fs
    >>> spikes = fs.Spikes(("a", "b"), ("FA-I", "FA-I"), (np.array([0.45, 0.52]), np.array([0.53])), 0.0, 1.0)
    >>> event, edges = 0.5, np.linspace(-0.1, 0.1, 5)  # [s]
    >>> aligned = [times - event for times in spikes.times]  # what ``axes.eventplot(aligned)`` draws
    >>> counts, _ = np.histogram(np.concatenate(aligned), edges)
    >>> (counts / len(aligned) / np.diff(edges)).round(3).tolist()  # spikes per second and afferent
    [0.0, 10.0, 20.0, 0.0]
    """

    names: tuple[str, ...]
    kinds: tuple[str, ...]
    times: tuple[Floats, ...]
    start: float
    end: float
    beyond: Mapping[str, float] = field(default_factory=dict)
    origin: str = ""

    def __post_init__(self) -> None:
        try:
            trains = tuple(np.asarray(train, dtype=np.float64).ravel() for train in self.times)
        except (TypeError, ValueError) as error:
            raise InputError("times", f"are no numbers ({error})", "need some for each name, in seconds") from None
        labels = {name: tuple(map(str, getattr(self, name))) for name in ("names", "kinds")}
        for name, entries in {**labels, "times": trains}.items():
            object.__setattr__(self, name, entries)
        for name, entries in (("kinds", self.kinds), ("times", self.times)):
            if len(entries) != len(self.names):
                fault, needs = f"have {len(entries)} entries", f"need one for each of {len(self.names)} names"
                raise InputError(name, fault, needs, "of one afferent write ['unit 7'], ['FA-I'], [[0.31, 1.42]]")
        if not self.start <= self.end:
            raise InputError("end", f"is {self.end:g} s", f"must not be before start, {self.start:g} s")
        span = f"need seconds from {self.start:g} to {self.end:g} s, ascending"
        for name, times in zip(self.names, self.times, strict=True):
            faults = (
                (np.isnan(times), "which is no number", "leave it out"),
                ((times < self.start) | (times > self.end), "outside", "divide ms by 1000, and give start and end"),
                (np.r_[False, times[1:] < times[:-1]], "after a later time", "sort them"),
            )
            for wrong, fault, repair in faults:
                if wrong.any():
                    raise InputError(f"times of {name}", f"have {times[wrong.argmax()]:g}, {fault}", span, repair)

    def __repr__(self) -> str:
        trains = [(kind, time.size) for kind, time in zip(self.kinds, self.times, strict=True)]
        counts = {kind: [size for other, size in trains if other == kind] for kind in dict.fromkeys(self.kinds)}
        listed = ", ".join(f"{len(sizes)} {kind} with {sum(sizes)} spikes" for kind, sizes in counts.items())
        return f"Spikes({listed or 'no afferents'}, {self.start:g} to {self.end:g} s)"

    def to_dataframe(self) -> pd.DataFrame:
        """Return a row for each spike: `site`, `kind` and `time` [s]."""
        counts = [time.size for time in self.times]
        labels = {"site": self.names, "kind": self.kinds}
        columns = {name: np.repeat(np.array(texts, dtype=str), counts) for name, texts in labels.items()}
        return pd.DataFrame({**columns, "time": np.concatenate([np.empty(0), *self.times])})

    def rates(self, window: float) -> xr.DataArray:
        """Return the mean rates of the receptor types in windows [s] one after the other, (kind, time) [1/s].

        They are spikes per second and afferent; time is the middle of a window, the last of which may reach beyond the
        end.
        """
        if not 0.0 < window < np.inf:
            raise InputError("window", f"got {window:g} s", "must be above 0 s")
        count = max(1, math.ceil((self.end - self.start) / window - 1e-9))
        edges: Floats = self.start + window * np.arange(count + 1, dtype=np.float64)
        trains: dict[str, list[Floats]] = {}
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
        The model of each receptor type, such as :func:`~fingerslip.afferents.model.human_afferents`.

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

    Examples
    --------
    A slowly adapting receptor 1 mm above the skin of a block that is pressed:

    >>> import skfem
    >>> import fingerslip as fs
    >>> block = skfem.MeshQuad().refined(2).scaled(10e-3).with_defaults()
    >>> model = fs.Model(
    ...     mesh=block.with_subdomains({"pulp": lambda x: x[0] > 0.0}),
    ...     materials={"pulp": fs.material("pulp")},
    ...     formulation="plane_strain",
    ...     supports={"top": ("x", "y")},
    ...     contacts=(fs.Contact("bottom", fs.Plane(), fs.Coulomb(0.6)),),
    ...     programme=(fs.Press(depth=1e-3, speed=20e-3),),
    ...     time=fs.TimeStepping(step=0.4e-3),
    ...     record=fs.Recording(sites=(fs.Site("below", "SA-I", (5e-3, 1e-3)),)),
    ... )
    >>> history = fs.simulate(model)
    >>> fs.spikes_of(history, fs.human_afferents()).times[0].size
    3
    >>> float(fs.receptor_stimuli(history)["strain_energy_density"].max().round())
    107.0
    """
    check_models(models)
    stimuli = receptor_stimuli(history, tuple(models))
    times, available = stimuli["time"].values, stimuli["site_kind"].values
    result: dict[int, Floats] = {}
    recorded = tuple(dict.fromkeys(map(str, available)))
    for kind in recorded:
        model, rows = models[kind], np.flatnonzero(available == kind)
        values = stimuli[model.stimulus].values[:, rows]
        # Values that are not known would give no spikes.
        if len(values) < 2:
            raise ResultError(f"history.time: has {len(values)} values, needs two or more; simulate for longer")
        if not np.isfinite(values).all():
            fault = "is not known at some receptor, needs numbers; choose a model with another stimulus"
            raise ResultError(f"history.{model.stimulus}: {fault}")
        warn_beyond(history, model.highest_frequency, f"the model of {kind}")
        trains = [np.asarray(train, dtype=np.float64) for train in model.spikes(times, values)]
        if len(trains) != rows.size:
            raise InputError(f"{kind}.spikes", f"gave {len(trains)} arrays", f"needs {rows.size}, one a receptor")
        spikes = np.concatenate([times[:1], *trains])
        latest = times[-1] + max(_DELAY, times[-1] - times[0])
        if not (spikes.min() >= times[0] and spikes.max() <= latest):
            fault = f"are at {spikes.min():g} to {spikes.max():g} s"
            allowed = f"needs seconds of the history, {times[0]:g} to {times[-1]:g} s"
            raise InputError(f"{kind}.spikes", fault, allowed, "give neither milliseconds nor numbers of samples")
        # What a delay carries past the last record is not observed.
        result |= {int(row): train[train <= times[-1]] for row, train in zip(rows, trains, strict=True)}
    order = sorted(result)
    names, kinds = (tuple(str(labels[row]) for row in order) for labels in (stimuli["site"].values, available))
    beyond = beyond_records({kind: models[kind] for kind in recorded}, history)
    trains = [result[row] for row in order]
    return Spikes(names, kinds, tuple(trains), float(times[0]), float(times[-1]), beyond, SIMULATED)


def spike_places(spikes: Spikes, history: xr.Dataset) -> Floats:
    """Return where the receptors of afferents are at rest in the history that their spikes are of, (n, dim) [m]."""
    places = dict(zip(map(str, history["site"].values), history["site_position"].values, strict=True))
    if strangers := [name for name in spikes.names if name not in places]:
        fault, needs = f"are of '{strangers[0]}', which the history does not record", "need the sites of their history"
        raise InputError("spikes", fault, needs, "take spikes_of(history, models), or no history for a recording")
    return np.array([places[name] for name in spikes.names])


def resolved_spikes(history: xr.Dataset, models: Mapping[str, AfferentModel] | None = None) -> Spikes:
    """Return the spikes of the recorded receptors whose stimulus a history resolves."""
    spikes = available_spikes(history, models)
    if spikes is None:
        fault = "has no receptors whose stimulus it resolves, needs some"
        raise ResultError(f"history: {fault}; write record: {{receptors: [FA-I, SA-I]}} and run again")
    return spikes


def available_spikes(history: xr.Dataset, models: Mapping[str, AfferentModel] | None = None) -> Spikes | None:
    """Return the same; None where a history resolves the stimulus of no receptor."""
    resolved = answering_models(history, models)
    if not resolved:
        return None
    with warnings.catch_warnings():
        # How far records resolve them is said where figures are explained, not each time.
        warnings.simplefilter("ignore", BandwidthWarning)
        return spikes_of(history, resolved)
