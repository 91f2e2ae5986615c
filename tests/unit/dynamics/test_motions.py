"""Motions on the mesh are recorded whole, with what histories say of the basis."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

import fingerslip as fs
from fingerslip.dynamics.motions import Motions, march_motions
from fingerslip.dynamics.recording.steps import step_times
from fingerslip.dynamics.step.stepper import Stopwatch
from fingerslip.dynamics.system.system import build_system
from fingerslip.linear.solver import preferred_solver
from problems.pushed import push_and_slide


def test_motions_are_marched_and_every_step_is_inspected():
    model, watch, seen = push_and_slide(), Stopwatch(), []
    system, times = build_system(model), step_times(model)
    motions = Motions((model,), (system,), (times,), preferred_solver(), watch, None, 1)

    def inspect(moving, before, after):
        seen.append((list(moving), before[0].time, after[0].time))

    marched = march_motions(motions, [system], {"basis": "full"}, inspect)
    assert seen == [([0], early, late) for early, late in pairwise(times)]
    values = marched.recorders[0].values
    np.testing.assert_array_equal(values["normal_traction"], fs.simulate(model).normal_traction.values)
    assert marched.basis == {"basis": "full"}
    assert {"assembly", "factorisation", "stepping", "recording"} <= watch.seconds.keys()
