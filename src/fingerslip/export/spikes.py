"""Spikes for the programs of neurophysiology: files of Neurodata Without Borders, and Neo."""

from __future__ import annotations

import dataclasses
import datetime as dt
import math
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from pydantic.dataclasses import is_pydantic_dataclass

from fingerslip.afferents.model import AFFERENTS, CAVEAT, AfferentModel, human_afferents, spike_notes
from fingerslip.afferents.signals import STIMULI, record_bandwidth
from fingerslip.afferents.spikes import SIMULATED, Spikes, resolved_spikes, spike_places
from fingerslip.errors import InputError, optional_module
from fingerslip.parameters import walk_values
from fingerslip.slip.events import find_events
from fingerslip.slip.windows import EVENTS, counterface_normal, slide_window, split_along
from fingerslip.snapshot import in_space
from fingerslip.storage.files import digest, new_file
from fingerslip.units import millimetres
from fingerslip.version import __version__

_NWB = ("neural", "spikes", "files of NWB need it")
_KEYWORDS = "fingertip, slip, tactile afferents"
_MODELS = f"models of afferents {CAVEAT}"
_ABOUT = f"Simulated by fingerslip {__version__}: a finite-element model and models of afferents, not a recording."


def neo_block(spikes: Spikes, history: xr.Dataset | None = None, *, models: str = _MODELS) -> Any:
    """Return spikes as a block of Neo, which Elephant and other libraries take.

    Parameters
    ----------
    spikes : Spikes
        Spikes of afferents; the block says their `origin`.
    history : xarray.Dataset, optional
        The history that they are of: force and motion of the counterfaces become signals, slip events an event, phases
        and partial slip epochs, and each train is annotated with the `position` of its receptor at rest [m].
    models : str, optional
        What the block says of the models that simulated spikes are of.

    Returns
    -------
    neo.Block
        One segment with a spike train for each afferent, in seconds, annotated with `kind`, and with `resolved`, False
        where the records are too coarse for its type. Its time of writing is the start of the session, which files of
        NWB need.

    Raises
    ------
    InputError
        Where Neo is not installed.

    Examples
    --------
    With ``pip install "fingerslip[neural]"``::

        block = fs.neo_block(fs.spikes_of(history, fs.human_afferents()), history)
        trains = [train for train in block.segments[0].spiketrains if train.annotations["kind"] == "SA-I"]
    """
    neo = optional_module("neo", "neural", "spikes", "blocks of Neo need it")
    said = _origin_of(spikes, models)
    block, segment = neo.Block(name="fingerslip", description=said), neo.Segment(name="run", description=said)
    block.segments.append(segment)
    block.annotate(session_start_time=dt.datetime.now(dt.UTC))
    span = {"units": "s", "t_start": spikes.start, "t_stop": spikes.end}
    places = None if history is None else spike_places(spikes, history).tolist()
    for number, (name, kind, times) in enumerate(zip(spikes.names, spikes.kinds, spikes.times, strict=True)):
        where = {} if places is None else {"position": places[number]}
        about = {"kind": kind, "resolved": kind not in spikes.beyond, **where}
        segment.spiketrains.append(neo.SpikeTrain(times, name=name, **about, **span))
    if history is not None:
        times = history["time"].values
        for name, unit, values in _signals(history):
            signal = neo.IrregularlySampledSignal(times, values, units=unit, time_units="s", name=name)
            segment.irregularlysampledsignals.append(signal)
        slip = slip_times(history)
        segment.events.append(neo.Event(list(slip.values()), labels=list(slip), units="s", name="slip"))
        epochs = list(_epochs(history))
        spans = [first for _, first, _ in epochs], [last - first for _, first, last in epochs]
        segment.epochs.append(neo.Epoch(*spans, labels=[label for label, *_ in epochs], units="s", name="programme"))
    return block


def write_nwb(
    spikes: Spikes,
    path: str | Path,
    history: xr.Dataset | None = None,
    *,
    start: dt.datetime | None = None,
    models: str | Mapping[str, AfferentModel] = _MODELS,
) -> Path:
    """Write spikes as a file of Neurodata Without Borders, whole or not at all.

    Parameters
    ----------
    spikes : Spikes
        Spikes of afferents: a unit for each, with the columns `site` and `kind`, and the interval of observation.
        The file says their `origin`; a subject it has where that is "simulated".
    path : path
        The file, such as ``spikes.nwb``; one that is there is replaced.
    history : xarray.Dataset, optional
        The history that they are of: force and motion of the counterfaces become stimuli, phases and partial slip
        epochs, and each unit has the place of its receptor.
    start : datetime, optional
        What the file calls the start of the session, which it must; without it the time at which it is written.
    models : mapping of str to AfferentModel or str, optional
        The models that the spikes are of, by type: their parameters, with units and where they are from, become a
        table `models` under ``processing["afferents"]``, of a model of one's own the fields of a dataclass. Or what the
        file says of them.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        Where PyNWB is not installed; of no afferents, and of those of receptors that the history does not have.
    """
    pynwb = optional_module("pynwb", *_NWB)
    if not spikes.names:
        raise InputError("spikes", "have no afferents", "need one or more")
    origin = _origin_of(spikes, models if isinstance(models, str) else _about_models(spikes.kinds, models))
    simulated = spikes.origin == SIMULATED
    run = "" if history is None else history.attrs.get("run", "")
    file = pynwb.NWBFile(
        session_description=f"{origin} Run: {run}." if run else origin,
        identifier=digest(list(spikes.names), *spikes.times),
        session_start_time=start or dt.datetime.now(dt.UTC),
        # Keywords proper are a list, which Neo cannot read.
        data_collection=f"{origin} Keywords: {'simulation, ' * simulated}{_KEYWORDS}.",
        **({} if history is None else _about_run(spikes, history)),
    )
    if simulated:
        species = "Homo sapiens" if {kind.lower() for kind in spikes.kinds} <= {*AFFERENTS.names} else None
        about = "No living subject: a simulated body."
        file.subject = pynwb.file.Subject(subject_id="virtual", description=about, sex="U", species=species)
    resolution = None if isinstance(models, str) else _spike_resolution(spikes, models)
    file.units = pynwb.misc.Units(name="units", description=f"Spikes [s]. {origin}", resolution=resolution)
    if not isinstance(models, str):
        _add_models(file, spikes.kinds, models)
    places = None if history is None else in_space(spike_places(spikes, history))
    file.add_unit_column("site", "name of the receptor")
    file.add_unit_column("kind", "type of afferent")
    if places is not None:
        file.add_unit_column("position", f"place of the receptor at rest [m]: {_AXES}")
    for number, (name, kind, times) in enumerate(zip(spikes.names, spikes.kinds, spikes.times, strict=True)):
        where = {} if places is None else {"position": places[number]}
        file.add_unit(spike_times=times, obs_intervals=[[spikes.start, spikes.end]], site=name, kind=kind, **where)
    if history is not None:
        for name, unit, values in _signals(history):
            times = history["time"].values
            about = f"{_MEANINGS[name.partition('_')[0]]}, simulated: {_AXES}"
            file.add_stimulus(pynwb.TimeSeries(name=name, data=values, unit=unit, timestamps=times, description=about))
        for kind, first, last in _epochs(history):
            file.add_epoch(first, last, [kind])
    with new_file(Path(path)) as partial, pynwb.NWBHDF5IO(str(partial), "w") as stream:
        stream.write(file)
    return Path(path)


def _origin_of(spikes: Spikes, models: str) -> str:
    """Say where spikes come from: models, or what their caller says."""
    if spikes.origin == SIMULATED:
        return f"{_ABOUT} Spikes come from {models}."
    return f"Origin of the spikes: {spikes.origin or 'not stated'}. Written by fingerslip {__version__}."


def _spike_resolution(spikes: Spikes, models: Mapping[str, AfferentModel]) -> float | None:
    """Return the shortest time step [s] of the membranes of models; None where one has none."""
    steps: list[Any] = [getattr(models.get(kind), "longest_step", None) for kind in {*spikes.kinds}]
    span = spikes.end - spikes.start
    return float(min(span / math.ceil(span / step) for step in steps)) if all(steps) and span > 0.0 else None


def _about_models(kinds: Iterable[str], models: Mapping[str, AfferentModel]) -> str:
    """Say which types have models of the project's, and which others."""
    others = [kind for kind in dict.fromkeys(kinds) if kind in models and not _ships(kind, models[kind])]
    if not others:
        return _MODELS
    said = f"models of the caller's own ({', '.join(others)})"
    return said if set(kinds) <= {*others} else f"{_MODELS} and {said}"


def _ships(kind: str, model: AfferentModel) -> bool:
    return kind.lower() in AFFERENTS.names and model == AFFERENTS.read(kind.lower())


_COLUMNS = {
    "kind": "type of afferent",
    "parameter": "its name",
    "value": "in the unit beside",
    "unit": "SI unit, 1 for ratios; empty for words and pure numbers",
    "source": "key of a paper, 'assumed' where nobody published the value, empty where the caller set it",
    "note": "what the value rests on",
}


def _add_models(file: Any, kinds: Iterable[str], models: Mapping[str, AfferentModel]) -> None:
    """Add a table of the parameters of models to a file of NWB."""
    import pynwb

    if absent := [kind for kind in kinds if kind not in models]:
        raise InputError("models", f"have none of {absent[0]}", "need one for each type of afferent")
    rows = [row for kind in dict.fromkeys(kinds) for row in _model_parameters(kind, models[kind])]
    assumed = dict.fromkeys(f"{kind} {parameter}" for kind, parameter, _, _, source, _ in rows if source == "assumed")
    caveat = f" Assumed, so that counts of spikes are no result: {', '.join(assumed)}." if assumed else ""
    columns = [
        pynwb.core.VectorData(name=name, description=about, data=list(values))
        for (name, about), values in zip(_COLUMNS.items(), zip(*rows, strict=True), strict=True)
    ]
    words = f"Parameters of the models of afferents.{caveat}"
    table = pynwb.core.DynamicTable(name="models", description=words, columns=columns)
    file.create_processing_module("afferents", "Models that spikes are computed with.").add(table)


def _model_parameters(kind: str, model: AfferentModel) -> Iterator[tuple[str, ...]]:
    """Yield type, parameter, value, unit, source and note of each parameter of a model."""
    stimulus = STIMULI.get(model.stimulus.removesuffix("_rate"), ("",))[0]
    table = AFFERENTS.table(kind.lower()) if _ships(kind, model) else ()
    sources = {value.path: (value.source, value.note) for value in table}
    values = {"stimulus": (model.stimulus, ""), "highest_frequency": (str(model.highest_frequency), "1/s")}
    if is_pydantic_dataclass(type(model)):
        values |= {leaf.path: (str(leaf.value), leaf.unit.si if leaf.unit else "") for leaf in walk_values(model)}
    elif dataclasses.is_dataclass(model):
        values = {field.name: (str(getattr(model, field.name)), "") for field in dataclasses.fields(model)} | values
    steady = _per_second(stimulus) if model.stimulus.endswith("_rate") else stimulus
    units = {"least_steady": steady, "least_rate": _per_second(steady)}
    for parameter, (value, unit) in values.items():
        yield kind, parameter, value, units.get(parameter, unit), *sources.get(parameter, ("", ""))


def _per_second(unit: str) -> str:
    """Return the unit of a rate, such as m/s^3 for m/s^2."""
    of, slash, power = unit.partition("/s")
    return f"{of}/s^{int(power.removeprefix('^') or 1) + 1}" if slash else f"{unit}/s"


_AXES = "x, y (in 3D z); the description of the experiment says which way the counterface slides"
_MEANINGS = {"force": "force of the counterface on the body", "displacement": "displacement of the counterface"}


def _about_run(spikes: Spikes, history: xr.Dataset) -> dict[str, str]:
    """Return what a file says of the run: which it is, what was done, and notes."""
    frictions = zip(history["counterface"].values, history["counterface_friction_coefficient"].values, strict=True)
    said = [f"Friction coefficient at {name}: {friction:.3g}." for name, friction in frictions]
    if (window := slide_window(history)) is not None:
        path = history["counterface_displacement"].values[[window.first, window.last], 0]
        _, travel = split_along(path[1] - path[0], counterface_normal(history, 0))
        direction = ", ".join(f"{share:.2g}" for share in travel / (np.linalg.norm(travel) or 1.0) + 0.0)
        said.append(f"The counterface slides towards ({direction}).")
    if "depth" in history.attrs:
        said.append(f"Forces are those of a section {millimetres(float(history.attrs['depth']))} deep, no finger's.")
    notes = [f"The records resolve {record_bandwidth(history):.3g} Hz."]
    notes += [f"{note}." for note in spike_notes(spikes.kinds, spikes.beyond, history)]
    if slip := [f"{name.replace('_', '-')} at {time:.4g} s" for name, time in slip_times(history).items()]:
        notes.append(f"Slip: {', '.join(slip)}.")
    about = {
        "experiment_description": " ".join(said),
        "protocol": ", ".join(f"{kind} {first:.4g} to {last:.4g} s" for kind, first, last in _phases(history)),
        "notes": " ".join(notes),
    }
    return about | ({"session_id": str(history.attrs["run"]).replace("/", "_")} if "run" in history.attrs else {})


def _phases(history: xr.Dataset) -> Iterator[tuple[Any, ...]]:
    """Yield kind, start and end [s] of each phase."""
    return zip(*(history[f"phase_{name}"].values for name in ("kind", "start", "end")), strict=True)


def _epochs(history: xr.Dataset) -> Iterator[tuple[str, float, float]]:
    """Yield name, start and end [s] of each phase and of partial slip."""
    yield from ((str(kind), float(first), float(last)) for kind, first, last in _phases(history))
    slip = slip_times(history)
    if {"incipient", "overall"} <= slip.keys():
        yield "partial slip", slip["incipient"], slip["overall"]


def write_history_nwb(history: xr.Dataset, folder: Path) -> None:
    """Write the spikes that the human afferents of a history whose stimulus it resolves have into ``spikes.nwb``."""
    optional_module("pynwb", *_NWB)
    write_nwb(resolved_spikes(history), folder / "spikes.nwb", history, models=human_afferents())


def _signals(history: xr.Dataset) -> Iterator[tuple[str, str, Any]]:
    """Yield name, unit and values (n_times, dim) of the force on and the motion of each counterface."""
    for variable, words in (("counterface_force", "force"), ("counterface_displacement", "displacement")):
        for number, name in enumerate(history["counterface"].values):
            yield f"{words}_{name}", str(history[variable].attrs["units"]), history[variable].values[:, number]


def slip_times(history: xr.Dataset) -> dict[str, float]:
    """Return the times [s] of the slip events that happened, by their names."""
    slip = find_events(history).slip
    return {name: time for name in EVENTS if (time := slip.time(name)) is not None}
