"""What a body answers to contact forces."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.statics.body import static_body
from fingerslip.errors import InputError
from problems.domes import pressed_dome

WIDE = {"reach": 1e-3, "hidden": 1e-3}


def test_the_compliance_is_symmetric_and_of_the_nodes_within_reach():
    body = static_body(pressed_dome(), **WIDE)
    assert np.array_equal(body.compliance, body.compliance.T)
    assert body.positions[:, 1].max() <= 1e-3
    assert (np.linalg.eigvalsh(body.compliance)[6:] > -1e-15).all()
    assert body.at_sites.shape == (3, 3 * len(body.nodes))


def test_a_site_that_is_a_contact_node_moves_as_it_does():
    body = static_body(pressed_dome(), **WIDE)
    crown = int(np.argmin(np.linalg.norm(body.positions, axis=1)))
    assert body.at_sites == pytest.approx(body.compliance[3 * crown : 3 * crown + 3], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"time": fs.TimeStepping(1e-3)}, "time: has inertia"),
        ({"gravity": (0.0, -9.81, 0.0)}, "loads: act beside"),
        ({"kinematics": "finite", "materials": {"bulk": fs.NeoHookean(1e5, 0.45, 1e3)}}, "kinematics: is finite"),
    ],
)
def test_other_models_are_refused(changes, message):
    with pytest.raises(InputError, match=message):
        static_body(pressed_dome(**changes), **WIDE)


def test_a_reach_without_nodes_is_refused():
    with pytest.raises(InputError, match="reach: got -1"):
        static_body(pressed_dome(), reach=-1.0, hidden=1e-3)


def test_a_curved_counterface_is_refused():
    model = pressed_dome()
    ball = dataclasses.replace(model.contacts[0], counterface=fs.Sphere(5e-3, (0.0, 1.0, 0.0)))
    with pytest.raises(InputError, match="is curved"):
        static_body(dataclasses.replace(model, contacts=(ball,)), **WIDE)
