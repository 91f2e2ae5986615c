"""Steps of any length: factors of the last lengths are kept, at small and at large strain."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.adaptive.takers import KEPT, Kept, make_taker
from fingerslip.dynamics.motions import Motions
from fingerslip.dynamics.recording.steps import step_times
from fingerslip.dynamics.step.stepper import Stopwatch
from fingerslip.dynamics.system.system import build_system
from fingerslip.linear.solver import preferred_solver
from problems.pushed import push_and_slide


def taker(**changes):
    model = push_and_slide(time=fs.Adaptive(5e-3, scheme="quasi_static"), **changes)
    motions = Motions(
        (model,), (build_system(model),), (step_times(model),), preferred_solver(), Stopwatch(), None, threads=1
    )
    return make_taker(motions, 0, 0)


def test_lengths_that_differ_by_rounding_are_one():
    kept = Kept(lambda length: [length])
    assert kept.at(0.1) is kept.at(0.1 * (1 + 1e-14))
    assert kept.at(0.1) is not kept.at(0.1 * (1 + 1e-6))


def test_the_factors_of_the_last_lengths_are_kept():
    small = taker()
    state = small.first()
    lengths = [5e-3 / 2**level for level in range(KEPT)]
    for _ in range(2):
        for length in lengths:
            state = small.take(state, state.time + length, length)
    made = small.attributes["factorisations"]
    assert made == KEPT + 1, "the first one was that of the shortest step"
    assert small.stepper.scheme.step == lengths[-1]
    assert state.step == lengths[-1]


@pytest.mark.parametrize(
    "changes", [{}, {"materials": {"bulk": fs.NeoHookean(34e3, 0.4, 1000.0)}, "kinematics": "finite"}]
)
def test_a_step_in_two_halves_ends_where_the_whole_one_does(changes):
    """In a quasi-static press without friction, the way does not matter."""
    found = taker(friction=0.0, **changes)
    start = found.first()
    whole = found.take(start, 5e-3, 5e-3)
    halves = found.take(found.take(start, 2.5e-3, 2.5e-3), 5e-3, 2.5e-3)
    size = np.abs(whole.displacement).max()
    assert size > 0.0
    assert halves.displacement == pytest.approx(whole.displacement, abs=1e-7 * size)
