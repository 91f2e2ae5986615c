"""A body that is pressed at large strain: what it answers to contact forces there, and in states along a slide."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.contact.states import OPEN, STICK
from fingerslip.dynamics.finite.large import Large
from fingerslip.dynamics.loop import Loop
from fingerslip.dynamics.recording.steps import step_times
from fingerslip.dynamics.state_checks import OutsideCheck, RotationCheck
from fingerslip.dynamics.statics.body import REPAIR, StaticBody, answers_of, check_kind, sheared, surface
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.step.stepper import Stopwatch
from fingerslip.dynamics.system.system import System, build_system
from fingerslip.errors import InputError
from fingerslip.linear.resources import single_dense_thread
from fingerslip.linear.solver import LinearSolver, preferred_solver
from fingerslip.materials.elastic import RayleighDamping
from fingerslip.model.model import Model
from fingerslip.model.programme import phase_duration

__all__ = ["pressed_body"]

Floats = NDArray[np.float64]

_logger = logging.getLogger(__name__)

# Share of the area that touches which sticks, below which the whole contact slips: the body is sheared no further.
_SLIPS = 0.01


def pressed_body(
    model: Model,
    *,
    spacing: float,
    near: float,
    patch: float = 0.0,
    solver: LinearSolver | None = None,
    progress: Callable[[float], None] | None = None,
) -> StaticBody:
    """Press and slide the body of a model at large strain, and compute what it answers to contact forces on the way.

    The first state is the end of the first phase, a press; others follow where the skin that it pressed has moved by
    `spacing` since the last, until all of it slips. Skin that is nearer than `near` to the counterface after the press
    may touch later.

    Units: spacing [m]; near [m]; patch [m].
    """
    check_kind(model, is_finite=True)
    system, watch, chosen = build_system(model), Stopwatch(), solver or preferred_solver()
    if system.require_body().relaxes:
        raise InputError("materials", "relax", "needs elastic ones", REPAIR)
    integrator = Large(replace(model, damping=RayleighDamping()), system, chosen, watch, 0)
    states = _States(system, phase_duration(model.programme[0]), (spacing, near, patch), integrator)
    with single_dense_thread():
        loop = Loop(integrator, [states], [step_times(model)], watch)
        while loop.taken < loop.last and not states.slips:
            loop.step()
            if progress is not None:
                progress(loop.taken / loop.last)
        loop.finish()
    return states.body()


@dataclass(frozen=True)
class _Skin:
    """The skin that may touch, divided into patches at the end of a press."""

    rows: NDArray[np.int64]  # (n_c,), its nodes among the candidates
    reads: list[sparse.csr_matrix]  # what reads patches, sites and watched nodes
    sums: sparse.csr_matrix  # (n_p, n_c), sums over the nodes of patches [-]
    body: StaticBody  # without answers


class _States:
    """The states of a slide in which answers are computed: see :class:`fingerslip.dynamics.loop.Observer`."""

    room = 1

    def __init__(self, system: System, begin: float, sizes: tuple[float, float, float], integrator: Large) -> None:
        self._system, self._begin, self._integrator = system, begin, integrator
        self._spacing, self._near, self._patch = sizes
        self._checks = OutsideCheck(system), RotationCheck(system)
        self._skin: _Skin | None = None
        self._answers: list[Floats] = []
        self._moved: list[Floats] = []
        self._forces: list[Floats] = []
        self.slips = False

    def record(self, state: State) -> None:
        """Check a state, and take it where the body has been sheared far enough since the last."""
        for check in self._checks:
            check.look(state)
        if state.time < (1.0 - 1e-9) * self._begin:
            return
        self._skin = skin = self._skin or self._divided(state)
        if np.delete(state.contact_forces, skin.rows, axis=0).any():
            fault = f"got {1e3 * self._near:.4g} mm, and at t = {state.time:g} s skin further away touches"
            raise InputError("near", fault, "needs more")
        moved = np.concatenate([read @ state.displacement for read in skin.reads])
        area, states = self._system.candidates.area, state.interface.state
        self.slips = bool(self._moved) and bool((states == STICK) @ area < _SLIPS * ((states != OPEN) @ area))
        if self._moved and self._shear(moved) < self._spacing:
            return
        stepper = self._integrator.renewed(state)
        if stepper is None:
            # Without the contact a body under much pressure may give way; the states before stand for this one.
            if not self._answers:
                raise InputError("programme.0", "presses a body that gives way", "needs less depth, or a finer mesh")
            _logger.warning("no state is taken at t = %g s, where the body gives way without its contact", state.time)
            return
        condensed, rows = stepper.condensed, stepper.system.relative.shape[0]

        def solve(right: Floats) -> Floats:
            return condensed.backward(condensed.forward(right), np.zeros((rows, right.shape[1])))

        self._answers.append(answers_of(solve, skin.reads))
        self._moved.append(moved)
        self._forces.append(np.asarray(skin.sums @ state.contact_forces[skin.rows]))

    def finish(self) -> None:
        """Finish the checks of what was recorded."""
        for check in self._checks:
            check.finish()

    def body(self) -> StaticBody:
        """Return the body with its answers in all states that were taken."""
        assert self._skin is not None, "a programme without a press"
        answers, moved, forces = map(np.stack, (self._answers, self._moved, self._forces))
        return replace(self._skin.body, answers=answers, moved=moved, forces=forces)

    def _divided(self, state: State) -> _Skin:
        """Divide the skin near the counterface into patches."""
        if abs(state.time - self._begin) > 1e-6 * self._begin:
            raise InputError("time.step", "goes past the end of the press", "needs whole steps in it")
        if not state.contact_forces.any():
            raise InputError("programme.0", "does not touch", "needs a press that does, and then a slide")
        candidates = self._system.candidates
        points = candidates.positions + state.moved
        is_near = self._system.counterfaces.gaps(points, candidates.counterface) <= self._near
        nodes, area = candidates.nodes[is_near], candidates.area[is_near]
        reads, sums, body = surface(self._system, nodes, area, candidates.nodes[~is_near], self._patch)
        plane, shift = self._system.counterfaces.shapes[0], state.counterfaces[0]
        pressing = sums @ (state.contact_forces[is_near] @ plane.unit_normal)
        moved = (reads[0] @ state.displacement).reshape(body.positions.shape) - shift
        gaps = plane.gap(body.positions + moved)
        # A patch is as far from the counterface as its force says; the mean of its nodes is not.
        wanted = np.where(pressing > 0.0, -pressing / (sums @ candidates.normal_stiffness[is_near]), gaps)
        places = body.positions + (wanted - gaps)[:, None] * plane.unit_normal
        body = replace(body, positions=places, skin=candidates.positions, shift=shift)
        return _Skin(np.flatnonzero(is_near), reads, sums, body)

    def _shear(self, moved: Floats) -> float:
        """Return how far the patches have moved since the last state [m]."""
        shape = self._forces[0].shape
        last, here = (some[: self._forces[0].size].reshape(shape) for some in (self._moved[-1], moved))
        return float(sheared(here, last[None], self._forces[0])[0])
