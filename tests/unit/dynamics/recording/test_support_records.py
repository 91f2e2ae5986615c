"""Forces of supports in records that are cut short."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import fingerslip as fs
from problems.pushed import push_and_slide


@pytest.mark.parametrize("kinematics", ["small", "finite"])
def test_forces_so_far_are_those_of_the_whole_run(kinematics):
    material = {"bulk": fs.NeoHookean(50e3, 0.45, 1000.0)}
    model = push_and_slide(kinematics=kinematics, materials=material)
    whole = fs.simulate(model).support_force.values
    assert np.abs(whole).max() > 0.0
    with fs.Simulation(model) as sim:
        for taken in range(1, len(whole)):
            sim.step()
            if taken % 7 == 0:
                np.testing.assert_array_equal(sim.history().support_force.values, whole[: taken + 1])


def test_a_plate_at_rest_and_its_support_are_in_balance_without_inertia():
    model = push_and_slide()
    history = fs.simulate(replace(model, time=fs.QuasiStatic(model.time.step)))
    total = history.support_force.sum("support") + history.counterface_force.sum("counterface")
    assert np.abs(total).max() < 1e-9 * np.abs(history.counterface_force).max()
