"""A body that is pressed at large strain: what it answers to contact forces there, and in states along a slide.

One press serves several depths: at each the body is slid, and from there it is pressed further.
"""

from __future__ import annotations

import functools
import logging
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.arrays import Flags, Floats
from fingerslip.contact.candidates import Candidates
from fingerslip.contact.interface import InterfaceState, rest_state
from fingerslip.contact.states import OPEN, STICK
from fingerslip.dynamics.finite.large import Large
from fingerslip.dynamics.loop import Loop, Observer, OutsideCheck, Steps
from fingerslip.dynamics.statics.body import (
    REPAIR,
    StaticBody,
    answers_of,
    check_kind,
    depth_in_hull,
    patches,
    shear_distances,
    surface,
)
from fingerslip.dynamics.step.state import State
from fingerslip.dynamics.step.stepper import Stopwatch
from fingerslip.dynamics.system.bodies import counterface_motion
from fingerslip.dynamics.system.operators import Outsiders, relative_operator
from fingerslip.dynamics.system.system import System, build_system
from fingerslip.errors import ConvergenceError, InputError, SlipOutsideContactError
from fingerslip.linear.resources import single_dense_thread
from fingerslip.linear.solver import preferred_solver
from fingerslip.materials.elastic import RayleighDamping
from fingerslip.model.model import Model
from fingerslip.model.programme import Press
from fingerslip.model.timing import QuasiStatic

_logger = logging.getLogger(__name__)

# Share of the area that touches which sticks, below which all slips and the body is sheared no further. Bodies that are
# sheared until half of it slips let the whole contact slip too late, by 23 % of a smooth skin at 3 mm; the last of it
# to slip gives the sensor no more states, and strides that take minutes.
_LEAST_STICKING = 0.05
# Over how near to the counterface skin is after the press that may touch later: how deep skin that touches may lie at
# rest, how near skin is that is watched, and how near skin that is divided as if it touched.
_DEEP, _WATCHED, _TOUCHES = 2.0, 1.5, 0.02
# Patches that what touches after the press is divided into, or its nodes where they are fewer.
_PATCHES = 200
# How often a step of the slide may be halved: where that is not enough no smaller step was seen to be, at any cost.
_HALVINGS = 1
# Skin that may touch while a body is pressed further is within this many times the way of a leg, which is as long as
# this at most [m]: factors around 5,000 unknowns of contact take twice the time of those around 3,700.
_REACH, _LEG = 1.25, 1e-3


def pressed_bodies(
    model: Model,
    depths: Sequence[float],
    *,
    spacing: float,
    near: float,
    patch: float = 0.0,
    stride: float | None = None,
    progress: Callable[[float, float], None] = lambda *_: None,
) -> Iterator[StaticBody]:
    """Press the body of a model at large strain, slide it at each depth, and yield what it answers to contact forces.

    The programme is a press as far as the largest depth, and what follows at each. The first state of a body is the end
    of its press; others follow where the skin that it pressed has moved by `spacing` times the depth since the last,
    until all of it slips. Steps of the press are those of the model, steps of the slide `stride`, or else those
    of the model, too. Skin that is nearer than `near` to the counterface after the press may touch later. `progress`
    takes the depth and the share of the slide. Lengths are in m, the stride in s.
    """
    check_kind(model, is_finite=True)
    press, *others = model.programme
    if not isinstance(press, Press):
        raise InputError("programme.0", f"is {press}", "needs a press")
    system = build_system(model)
    if system.require_body().relaxes:
        raise InputError("materials", "relax", "needs elastic ones", REPAIR)
    (plane,), model = system.counterfaces.shapes, replace(model, damping=RayleighDamping())
    hidden = depth_in_hull(system.space.positions, plane.unit_normal)[system.candidates.nodes]
    system, state, begin = _narrow(system, hidden <= _DEEP * near), None, 0.0
    sliding = model if stride is None else replace(model, time=QuasiStatic(stride))
    for depth in sorted(depths):
        motion = counterface_motion((replace(press, depth=depth), *others), plane)
        with single_dense_thread():
            try:
                state = _press(model, system, state, (begin, motion.knots[1]))
                skin = _skin(replace(system, motions=(motion,)), state, near, patch)
                body = _slide(sliding, skin, spacing * depth, functools.partial(progress, depth))
            except SlipOutsideContactError as error:
                raise InputError("near", f"got {1e3 * near:.4g} mm, and {error.found}", "needs more") from None
        yield body
        begin = motion.knots[1]


def _press(model: Model, system: System, state: State | None, span: tuple[float, float]) -> State:
    """Press on from a state, or from rest, over a span of time [s], in legs with few candidates."""
    way = float(np.linalg.norm(system.displacements(span[1]) - system.displacements(span[0])))
    middle = 0.5 * (span[0] + span[1])
    if way > _LEG:
        return _press(model, system, _press(model, system, state, (span[0], middle)), (middle, span[1]))
    nearest = _narrow(system, _gaps(system, state) <= _REACH * way)
    integrator = Large(model, nearest, preferred_solver(), Stopwatch(), 0)
    states = None if state is None else {0: _transfer(state, system, nearest)}
    loop = Loop(integrator, [_Checked(nearest)], [_times(span, model.time.step)], Stopwatch(), states)
    loop.run()
    integrator.release()
    return _transfer(loop.states[0], nearest, system)


def _slide(model: Model, skin: _Skin, spacing: float, progress: Callable[[float], None]) -> StaticBody:
    """Slide from the end of a press until all slips, and return the body with states apart by a spacing [m]."""
    times = _times((skin.state.time, float(skin.system.motions[0].knots[-1])), model.time.step)
    integrator = Large(model, skin.system, preferred_solver(), Stopwatch(), 0, halvings=_HALVINGS)
    states = _States(skin, integrator, spacing)
    loop = Loop(integrator, [states], [times], Stopwatch(), {0: skin.state})
    try:
        while not states.slips and loop.steps_taken < loop.n_steps:
            loop.step()
            progress(loop.steps_taken / loop.n_steps)
    except ConvergenceError as error:
        _logger.warning("a body is slid no further, and its last state stands for what follows: %s", error)
    integrator.release()
    return states.body()


def _times(span: tuple[float, float], step: float) -> Floats:
    """Return the times of equal steps over a span, its start included, at most of a length [s]."""
    return np.linspace(*span, math.ceil((span[1] - span[0]) / step - 1e-9) + 1)


class _Checked(Observer[State]):
    """Looks at every state, so that no node beside touches."""

    def __init__(self, system: System) -> None:
        self._check = OutsideCheck(system, 0)

    def record(self, state: State) -> None:
        """Check the next state."""
        self._check.look(Steps.of(state))


def _narrow(system: System, rows: Flags) -> System:
    """Return a system of which some candidates (n_c,) alone may touch its only counterface."""
    candidates = Candidates(**{name: values[rows] for name, values in vars(system.candidates).items()})
    nodes = np.union1d(system.outsiders[0].nodes, system.candidates.nodes[~rows])
    relative, beside = (
        relative_operator(system.space, system.unknowns, some, np.zeros_like(some))
        for some in (candidates.nodes, nodes)
    )
    outsiders = (Outsiders(nodes, system.space.positions[nodes], beside),)
    return replace(system, candidates=candidates, relative=relative, outsiders=outsiders)


def _gaps(system: System, state: State | None) -> Floats:
    """Return how far the candidates (n_c,) are from the only counterface in a state, or at rest [m]."""
    moved = 0.0 if state is None else system.moved(state.displacement, state.counterfaces)
    return system.counterfaces.shapes[0].gap(system.candidates.positions + moved)


def _transfer(state: State, before: System, system: System) -> State:
    """Return a state of a system as one of the same with other candidates; those that it did not have are open."""
    old, new = np.intersect1d(before.candidates.nodes, system.candidates.nodes, return_indices=True)[1:]

    def transfer(values: NDArray[Any], others: NDArray[Any]) -> NDArray[Any]:
        result = others.copy()
        result[new] = values[old]
        return result

    rest = rest_state(system.candidates, _gaps(system, state))
    return replace(
        state,
        moved=system.moved(state.displacement, state.counterfaces),
        contact_forces=transfer(state.contact_forces, rest.forces),
        contact_forces_before=transfer(state.contact_forces_before, rest.forces),
        interface=InterfaceState(
            **{name: transfer(vars(state.interface)[name], vars(rest)[name]) for name in vars(rest)}
        ),
        working_set=None,
        release=None,
    )


@dataclass(frozen=True)
class _Skin:
    """The skin that may touch, divided into patches at the end of a press."""

    system: System  # with its nodes as candidates
    state: State  # after the press
    reads: list[sparse.csr_matrix]  # what reads patches, sites and watched nodes
    sums: sparse.csr_matrix  # (n_p, n_c), sums over the nodes of patches [-]
    body: StaticBody  # without answers


def _skin(system: System, state: State, near: float, patch: float) -> _Skin:
    """Divide the skin near the counterface into patches."""
    if not state.contact_forces.any():
        raise InputError("programme.0", "does not touch", "needs a press that does, and then a slide")
    gaps, plane, shift = _gaps(system, state), system.counterfaces.shapes[0], state.counterfaces[0]
    nearest = _narrow(system, gaps <= near)
    state, candidates = _transfer(state, system, nearest), nearest.candidates
    watched = system.candidates.nodes[(gaps > near) & (gaps <= _WATCHED * near)]
    touching = candidates.area @ (state.interface.state != OPEN)
    fine = min(patch, float(touching / _PATCHES) ** (1.0 / (candidates.dim - 1)))
    sizes = np.where(gaps[gaps <= near] <= _TOUCHES * near, fine, patch)
    division = patches(candidates.positions, candidates.area, sizes)
    reads, sums, body = surface(nearest, candidates.nodes, candidates.area, watched, division)
    pressing = sums @ (state.contact_forces @ plane.unit_normal)
    moved = (reads[0] @ state.displacement).reshape(body.positions.shape) - shift
    present = plane.gap(body.positions + moved)
    # A patch is as far from the counterface as its force says; the mean of its nodes is not.
    wanted = np.where(pressing > 0.0, -pressing / (sums @ candidates.normal_stiffness), present)
    places = body.positions + (wanted - present)[:, None] * plane.unit_normal
    body = replace(body, positions=places, skin=system.candidates.positions, shift=shift)
    return _Skin(nearest, state, reads, sums, body)


class _States(_Checked):
    """The states of a slide in which answers are computed."""

    def __init__(self, skin: _Skin, integrator: Large, spacing: float) -> None:
        super().__init__(skin.system)
        self._skin, self._integrator, self._spacing = skin, integrator, spacing
        self._answers: list[Floats] = []
        self._moved: list[Floats] = []
        self._forces: list[Floats] = []
        self.slips = False

    def record(self, state: State) -> None:
        """Check the next state, and take it where the body has been sheared far enough since the last."""
        super().record(state)
        skin = self._skin
        moved = np.concatenate([read @ state.displacement for read in skin.reads])
        area, states = skin.system.candidates.area, state.interface.state
        self.slips = bool(self._moved) and bool((states == STICK) @ area < _LEAST_STICKING * ((states != OPEN) @ area))
        if self._moved:
            shape = self._forces[0].shape
            last, here = (some[: self._forces[0].size].reshape(shape) for some in (self._moved[-1], moved))
            if shear_distances(here, last[None], self._forces[0])[0] < self._spacing:
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
        self._forces.append(np.asarray(skin.sums @ state.contact_forces))

    def body(self) -> StaticBody:
        """Return the body with its answers in all states that were taken."""
        answers, moved, forces = map(np.stack, (self._answers, self._moved, self._forces))
        return replace(self._skin.body, answers=answers, moved=moved, forces=forces)
