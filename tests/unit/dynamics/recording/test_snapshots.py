"""Snapshots: what follows from the motion of the whole body, however many are computed at once and whenever."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.recording import snapshots
from problems.pushed import push_and_slide

EVERY = 0.02
NAMES = ("displacement", "velocity", "strain_energy_density", "von_mises", "stress", "strain")
RELAXING = fs.Elastic(50e3, 0.45, 1000.0, prony=(fs.PronyTerm(0.3, 0.1),))


@pytest.mark.parametrize("at_once", [1, 10**9])
def test_snapshots_are_the_same_one_by_one_and_all_at_once(at_once, monkeypatch):
    model = push_and_slide(record=fs.Recording(snapshots_every=EVERY))
    expected = fs.simulate(model)
    monkeypatch.setattr(snapshots, "_AT_ONCE", at_once)
    found = fs.simulate(model)
    for name in NAMES:
        np.testing.assert_array_equal(found[f"snapshot_{name}"], expected[f"snapshot_{name}"])


@pytest.mark.parametrize("material", [fs.Elastic(50e3, 0.45, 1000.0), RELAXING], ids=["elastic", "relaxing"])
def test_snapshots_so_far_are_those_of_the_whole_run(material):
    model = push_and_slide(materials={"bulk": material}, record=fs.Recording(snapshots_every=EVERY))
    whole = fs.simulate(model)
    assert whole.sizes["snapshot_time"] > 5
    with fs.Simulation(model) as sim:
        for taken in range(1, whole.sizes["time"]):
            sim.step()
            if taken % 9 == 0:
                so_far = sim.history()
                count = so_far.sizes["snapshot_time"]
                assert count == (whole.snapshot_time <= whole.time[taken]).sum()
                for name in NAMES:
                    np.testing.assert_array_equal(so_far[f"snapshot_{name}"], whole[f"snapshot_{name}"][:count])
