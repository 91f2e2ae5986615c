"""A simulation that is taken step by step, steered, saved and restored: what controllers and learning code drive."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.dynamics.motions import Motions, Outcome, prepare
from fingerslip.dynamics.recording.recorder import Recorder
from fingerslip.dynamics.recording.schedule import require_record_memory, step_times
from fingerslip.dynamics.reduced.basis import BasisStore, in_basis
from fingerslip.dynamics.steering.commands import Command, with_command
from fingerslip.dynamics.steering.packing import is_like, read_archive, write_archive
from fingerslip.dynamics.step.stepper import Stopwatch
from fingerslip.dynamics.system.system import build_system
from fingerslip.errors import DamagedError, FingerslipError, InputError
from fingerslip.history import VARIABLES
from fingerslip.libraries import xr
from fingerslip.linear.resources import (
    allowed_threads,
    limited_threads,
    single_dense_thread,
    suitable_threads,
)
from fingerslip.linear.solver import LinearSolver, preferred_solver
from fingerslip.model.model import Model, ReducedBasis
from fingerslip.model.timing import Adaptive
from fingerslip.storage.files import digest

# Raised where saved simulations hold something else than before.
_FORMAT = 8
_NUMBER = re.compile(r"(?<![A-Za-z0-9_])\d+\.?\d*(?:e[+-]?\d+)?")
_ROUNDING = 1e-9  # what processors may differ by, of a number or of the size of a mesh
_REPAIR = "save the simulation again"
# What of an observation would need all steps before it.
_OF_ALL_STEPS = frozenset({"support_force"})


@dataclass(frozen=True)
class Observation:
    """What was recorded of one step.

    See :class:`Simulation`.

    Parameters
    ----------
    time : float
        Time [s].
    step : int
        Number of the step; 0 is the start.
    recorder : Recorder
        The records.
    """

    time: float
    step: int
    recorder: Recorder

    @cached_property
    def values(self) -> Mapping[str, Any]:
        """The variables of :data:`fingerslip.history.VARIABLES` over time, at this time, but for `support_force`."""
        result = self.recorder.values(self.step, self.step + 1)
        names = (name for name, variable in VARIABLES.items() if variable.dims[:1] == ("time",))
        return {name: result[name][0].copy() for name in names if name in result and name not in _OF_ALL_STEPS}

    def __getitem__(self, name: str) -> Any:
        """Return a variable at this time."""
        values = vars(self).get("values")
        value = None if values else self.recorder.at(self.step, name)
        return self.values[name] if value is None else value


class Simulation:
    """A simulation that is taken step by step.

    Every step may have a command, which changes how a counterface or a rigid body moves from now on, or the force on
    it. Steps that were taken without commands are those of :func:`fingerslip.simulate`, to the last bit.

    Contact candidates are chosen by the model's programme. Where commands go further, give the contacts a
    `search_distance`.

    Parameters
    ----------
    model : Model
        What to compute.
    threads : int, optional
        As for :func:`fingerslip.simulate`.
    solver : LinearSolver, optional
        As for :func:`fingerslip.simulate`.
    bases : BasisStore, optional
        As for :func:`fingerslip.simulate`. A model with a reduced basis is stepped in it; the history's attributes say
        which errors it has left, and a warning where they are beyond its tolerances.

    Raises
    ------
    InputError
        For a model that cannot be computed, and for one with steps that control their error.

    Examples
    --------
    A controller that stops the plate when it presses by 0.2 N:

    >>> import skfem
    >>> import fingerslip as fs
    >>> block = skfem.MeshQuad().refined(4).scaled(10e-3).with_defaults()
    >>> model = fs.Model(
    ...     mesh=block.with_subdomains({"pulp": lambda x: x[0] > 0.0}),
    ...     materials={"pulp": fs.material("pulp")},
    ...     formulation="plane_strain",
    ...     depth=10e-3,
    ...     supports={"top": ("x", "y")},
    ...     contacts=(fs.Contact("bottom", fs.Plane()),),
    ...     programme=(fs.Press(depth=1e-3, speed=1e-3),),
    ...     time=fs.QuasiStatic(step=20e-3),
    ... )
    >>> with fs.Simulation(model) as sim:
    ...     seen = sim.step()
    ...     while seen["counterface_force"][0, 1] < 0.2:
    ...         seen = sim.step()
    ...     after = sim.step(fs.Command("bottom", velocity=(0.0, 0.0)))
    >>> f"{seen.time:.2f} s: {seen['counterface_force'][0, 1]:.3f} N, then {after['counterface_force'][0, 1]:.3f} N"
    '0.42 s: 0.205 N, then 0.205 N'
    """

    def __init__(
        self,
        model: Model,
        *,
        threads: int | None = None,
        solver: LinearSolver | None = None,
        bases: BasisStore | None = None,
    ) -> None:
        if isinstance(model.time, Adaptive):
            repair = "take TimeStepping or QuasiStatic"
            raise InputError("time", "controls its own steps", "simulations that are stepped have a fixed step", repair)
        self._model, self._watch = model, Stopwatch()
        self._commands: tuple[tuple[Command, int], ...] = ()
        self._is_closed = False
        allowed = allowed_threads(threads)
        with contextlib.ExitStack() as stack:
            stack.enter_context(limited_threads(suitable_threads(model.mesh.p.size, allowed, model.mesh.dim())))
            stack.enter_context(single_dense_thread())
            with self._watch.part("assembly"):
                times, system = step_times(model), build_system(model)
            motions = Motions((model,), (system,), (times,), solver or preferred_solver(), self._watch)
            require_record_memory(model, motions.record_bytes)
            self._system, self._residual = system, None
            if model.basis and not model.is_finite:
                self._system, self._residual = in_basis(motions, bases) or (system, None)
            checks = [] if self._residual is None else self._residual.motions
            self._loop, self._integrator, (self._recorder,) = prepare(motions, [self._system], checks)
            self._stack = stack.pop_all()

    def __enter__(self) -> Simulation:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Give the threads back; a closed simulation takes no more steps."""
        self._is_closed = True
        self._stack.close()

    def __repr__(self) -> str:
        return f"<Simulation at {self.time:g} s, step {self._loop.steps_taken} of {self._loop.n_steps}>"

    @property
    def time(self) -> float:
        """Time that was reached [s]."""
        return self._loop.time

    @property
    def is_finished(self) -> bool:
        """Whether the end of the model is reached."""
        return self._loop.steps_taken == self._loop.n_steps

    def step(self, command: Command | Sequence[Command] = ()) -> Observation:
        """Take a step.

        Parameters
        ----------
        command : Command or sequence of Command, optional
            What changes from now on, over this step and all that follow.

        Returns
        -------
        Observation
            What was recorded at the end of the step.

        Raises
        ------
        InputError
            For a command that the model cannot follow, beyond the end of the model, and when it is closed.
        ConvergenceError, SlipOutsideContactError
            As :func:`fingerslip.simulate`.
        """
        if self._is_closed:
            repair = "take the steps inside its with block, or restore a saved one"
            raise InputError("simulation", "is closed", "takes no more steps", repair)
        if self.is_finished:
            fault, repair = f"is reached, {self.time:g} s", "give the model a later end: time.end"
            raise InputError("end", fault, "is where a simulation ends", repair)
        for command_of_step in (command,) if isinstance(command, Command) else tuple(command):
            self._follow(command_of_step, self._loop.steps_taken)
        with self._watch.part("stepping"):
            self._loop.step()
        return self.observation

    @property
    def observation(self) -> Observation:
        """What was recorded at the present time."""
        return Observation(self.time, self._loop.steps_taken, self._recorder)

    def history(self) -> xr.Dataset:
        """Return the history so far."""
        self._loop.finish()
        attributes = self._loop.attributes
        if self._residual is not None:
            self._residual.warn(self._model.basis or ReducedBasis())
            attributes = {**attributes, **self._residual.attributes}
        outcome = Outcome(tuple(self._integrator.steppers), (self._recorder,), attributes)
        return outcome.histories(self._watch)[0].copy(deep=True)

    def save(self, path: str | Path) -> None:
        """Write the simulation to a file, from which it goes on to the last bit, on the same machine and threads.

        Parameters
        ----------
        path : path
            The file; one that is there is replaced.
        """
        self._loop.finish()
        value = {
            "format": _FORMAT,
            "model": _description(self._model),
            "commands": self._commands,
            "taken": self._loop.steps_taken,
            "state": self._loop.states[0],
            "integrator": self._integrator.saved_state(),
            "residual": [] if self._residual is None else self._residual.motions[0].saved_state(),
            "recorder": self._recorder.saved_state(),
        }
        write_archive(Path(path), value, self._outside())

    @classmethod
    def restore(
        cls,
        path: str | Path,
        model: Model,
        *,
        threads: int | None = None,
        solver: LinearSolver | None = None,
        bases: BasisStore | None = None,
    ) -> Simulation:
        """Return a simulation that goes on where it was saved.

        Parameters
        ----------
        path : path
            The file.
        model : Model
            The model that was simulated.
        threads : int, optional
            As for :func:`fingerslip.simulate`.
        solver : LinearSolver, optional
            As for :func:`fingerslip.simulate`.
        bases : BasisStore, optional
            As for :func:`fingerslip.simulate`.

        Raises
        ------
        InputError
            For another model.
        DamagedError
            For a file that holds no simulation.
        """
        simulation = cls(model, threads=threads, solver=solver, bases=bases)
        with contextlib.ExitStack() as stack:
            stack.callback(simulation.close)
            try:
                simulation._restore(Path(path))
            except FingerslipError:
                raise
            # What fits in part fails in any way where it does not.
            except Exception as error:
                raise DamagedError(str(path), "holds no simulation of this model", _REPAIR) from error
            stack.pop_all()
        return simulation

    def _restore(self, path: Path) -> None:
        """Go on where another simulation of the model was saved."""
        saved = read_archive(path, self._outside())
        if saved["format"] != _FORMAT:
            raise InputError(
                str(path), "is of another version of fingerslip", "needs one that this version has saved", _REPAIR
            )
        if not _is_same(saved["model"], _description(self._model)):
            repair = "restore it with the model that was saved"
            raise InputError("model", f"is not the one that {path} was saved from", "needs the same model", repair)
        for command, step in saved["commands"]:
            self._follow(command, step)
        self._integrator.restore(saved["integrator"])
        if self._residual is not None:
            self._residual.motions[0].restore(*saved["residual"])
        # The factors are made anew, and with them the compliance that the last step's contact refers to.
        again = read_archive(path, self._outside())
        steps, recorder = again["taken"], self._recorder
        is_whole = is_like(again["state"], self._loop.states[0]) and is_like(again["recorder"], recorder.saved_state())
        is_placed = isinstance(steps, int) and 0 <= steps <= self._loop.n_steps
        if not (is_whole and is_placed and again["recorder"]["next"] == steps + 1):
            raise DamagedError(str(path), "holds another state than this model has", _REPAIR)
        self._loop.states[0], self._loop.steps_taken = again["state"], steps
        recorder.restore(again["recorder"])

    def _follow(self, command: Command, step: int) -> None:
        """Change the system by a command that is given at a step."""
        time = float(self._loop.times[step])
        self._system = with_command(self._system, self._model, command, time)
        self._commands = (*self._commands, (command, step))
        self._integrator.steer(self._system)
        self._recorder.steer(self._system)

    def _outside(self) -> Mapping[str, Floats]:
        """Return the arrays that states refer to, and that the model gives again."""
        flat = self._system.space.dim == 2 and self._system.counterfaces.are_flat
        return {"compliance": self._integrator.steppers[0].compliance.matrix} if flat else {}


def _description(model: Model) -> dict[str, Any]:
    """Return what tells models apart: nodes (dim, n_nodes) [m], cells, and all else as text, numbers apart.

    Objects of a user count by what they print.
    """
    others = {field.name: getattr(model, field.name) for field in fields(model) if field.name != "mesh"}
    text = re.sub(r" at 0x[0-9a-f]+|\s+", "", repr(others))
    numbers = [float(number) for number in _NUMBER.findall(text)]
    points, cells = np.array(model.mesh.p, dtype=np.float64), digest(np.asarray(model.mesh.t))
    return {"points": points, "cells": cells, "text": _NUMBER.sub("#", text), "numbers": np.array(numbers)}


def _is_same(saved: Mapping[str, Any], model: Mapping[str, Any]) -> bool:
    """Tell whether two descriptions are of one model; other processors round nodes and numbers otherwise."""
    if any(saved[name] != model[name] for name in ("cells", "text")):
        return False
    if any(saved[name].shape != model[name].shape for name in ("points", "numbers")):
        return False
    points = np.allclose(saved["points"], model["points"], rtol=0.0, atol=_ROUNDING * np.ptp(model["points"]))
    return bool(points and np.allclose(saved["numbers"], model["numbers"], rtol=_ROUNDING, atol=0.0))
