"""Simulate a model: the one loop over time."""

from __future__ import annotations

import math
import platform
from collections.abc import Callable
from importlib.metadata import version

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fingerslip.contact.candidates import check_outsiders
from fingerslip.dynamics.recorder import Recorder
from fingerslip.dynamics.step import State, Stepper, Stopwatch, advance, build_stepper, first_state
from fingerslip.dynamics.system import System, build_system
from fingerslip.dynamics.threads import suitable_threads
from fingerslip.errors import InputError
from fingerslip.history import make_history
from fingerslip.model import Model

__all__ = ["simulate", "step_times"]

Array = NDArray[np.float64]


def step_times(model: Model) -> Array:
    """Return the times of the steps [s], the start included: whole steps until the end is reached.

    Raises
    ------
    InputError
        Where the end is not even one step away.
    """
    steps = model.end / model.time.step
    if steps < 1.0 - 1e-9:
        found = f"got {model.time.step:g} s for a run of {model.end:g} s"
        raise InputError("time.step", found, "needs at least one step", "write a smaller step")
    times: Array = model.time.step * np.arange(math.ceil(steps - 1e-9) + 1, dtype=np.float64)
    return times


def simulate(model: Model, *, progress: Callable[[float], None] | None = None) -> xr.Dataset:
    """Compute the motion of a model.

    Parameters
    ----------
    model : Model
        What to compute.
    progress : callable, optional
        Called after every step with the fraction that is done.

    Returns
    -------
    xarray.Dataset
        The history, with the variables of :data:`fingerslip.history.VARIABLES`.

    Raises
    ------
    InputError
        For a model that cannot be computed, before anything is.
    ConvergenceError
        Where the contact problem of a step was not solved to its tolerance.
    SlipOutsideContactError
        Where the boundary reaches a rigid body at a node that is no candidate.
    """
    times = step_times(model)
    with suitable_threads(model.mesh.dim() * model.mesh.nvertices):
        return _simulate(model, times, progress)


def _simulate(model: Model, times: Array, progress: Callable[[float], None] | None) -> xr.Dataset:
    watch = Stopwatch()
    with watch.part("assembly"):
        system = build_system(model)
        recorder = Recorder(model, system, times)
    with watch.part("factorisation"):
        stepper = build_stepper(system, model.time, model.damping)
    with watch.part("stepping"):
        _march(stepper, recorder, times, watch, progress)
    if system.motions:
        recorder.values["body_velocity"] += np.stack([motion.velocity(times) for motion in system.motions], axis=1)
    return make_history(recorder.values, _provenance(system, stepper.condensed.factor.name, watch))


def _march(
    stepper: Stepper, recorder: Recorder, times: Array, watch: Stopwatch, progress: Callable[[float], None] | None
) -> None:
    """Step through `times` and record every state."""
    system = stepper.system
    bodies = _body_displacements(system, times)
    state = first_state(stepper)
    recorder.record(state)
    for step in range(1, times.size):
        state = advance(stepper, state, float(times[step]), bodies[step], watch)
        with watch.part("recording"):
            _check_outside(system, state)
            recorder.record(state)
        if progress is not None:
            progress(step / (times.size - 1))


def _body_displacements(system: System, times: Array) -> Array:
    """Return the displacement of every rigid body at every time, shape (n_times, n_bodies, dim) [m]."""
    if not system.motions:
        return np.zeros((times.size, 0, system.space.dim))
    return np.stack([motion.displacement(times) for motion in system.motions], axis=1)


def _check_outside(system: System, state: State) -> None:
    """Refuse penetration by boundary nodes that are no contact candidates."""
    for outsiders, body, shift in zip(system.outsiders, system.surfaces.bodies, state.bodies, strict=True):
        moved = (outsiders.relative @ state.displacement).reshape(outsiders.positions.shape) - shift
        gaps = body.gap(outsiders.positions + moved)
        check_outsiders(gaps, outsiders.nodes, outsiders.positions, state.time)


def _provenance(system: System, solver: str, watch: Stopwatch) -> dict[str, object]:
    """Return what made the history: versions, solver, sizes and seconds."""
    seconds = dict(watch.seconds)
    seconds["substitution"] = seconds.pop("solve", 0.0) - seconds.get("contact", 0.0)
    return {
        "title": "fingerslip history",
        "fingerslip_version": version("fingerslip"),
        "python_version": platform.python_version(),
        "linear_solver": solver,
        "element": system.space.element,
        "regions": ", ".join(system.space.mesh.subdomains or {}),
        "n_degrees_of_freedom": len(system.free),
        "n_nodes": len(system.space.positions),
        "n_contact_candidates": len(system.candidates.nodes),
        "normal_penalty": _mean_penalty(system.candidates.normal_stiffness, system.candidates.area),
        "tangential_penalty": _mean_penalty(system.candidates.tangential_stiffness, system.candidates.area),
        **{f"seconds_{name}": value for name, value in seconds.items()},
    }


def _mean_penalty(stiffness: Array, area: Array) -> float:
    return float(stiffness.sum() / area.sum()) if area.size else 0.0
