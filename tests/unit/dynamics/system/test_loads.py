"""Loads on the body: tractions, gravity and their factors over time."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.system.system import build_system
from fingerslip.model.model import Drive, Traction
from fingerslip.model.programme import Ramp
from fingerslip.model.timing import QuasiStatic
from problems.pushed import push_and_slide

LONG = fs.TimeStepping(1e-3, end=0.02)


def test_a_ramped_traction_grows_and_stays():
    ramp = Ramp((0.0, 0.01), (0.0, 1.0))
    model = push_and_slide(contacts=(), programme=(), tractions={"left": Traction((7.0, 0.0), ramp)}, time=LONG)
    system = build_system(model)
    total = [system.load(time).sum() for time in (0.0, 0.005, 0.01, 1.0)]
    np.testing.assert_allclose(np.array(total) / total[-1], [0.0, 0.5, 1.0, 1.0])


def test_gravity_weighs_the_whole_body():
    model = push_and_slide(contacts=(), programme=(), supports={}, gravity=(0.0, -9.81), time=LONG)
    system = build_system(model)
    load = system.load(0.0).reshape(-1, 2).sum(axis=0)
    np.testing.assert_allclose(load, [0.0, -9.81 * system.mass.sum() / 2], atol=1e-12)


def test_a_free_body_with_an_initial_velocity_flies_on():
    free = {"contacts": (), "programme": (), "supports": {}, "time": LONG}
    model = push_and_slide(**free, initial_velocity=(0.3, -0.1), sites=(fs.Site("a", "", (0.0, 2e-3)),))
    history = fs.simulate(model)
    np.testing.assert_allclose(history.displacement.values[-1, 0], [0.3 * 0.02, -0.1 * 0.02], rtol=1e-9)
    assert np.abs(history.energy_imbalance.values).max() <= 1e-10 * history.kinetic_energy.values[0]


def test_a_driven_plate_rests_with_its_force_on_the_body():
    contact = fs.Contact("bottom", friction=fs.Coulomb(0.4), drive=Drive(1e-4, 1e-3))
    damping = fs.RayleighDamping(30.0, 5e-3)
    model = push_and_slide(contacts=(contact,), programme=(), damping=damping, time=fs.TimeStepping(2e-3, end=1.5))
    history = fs.simulate(model)
    assert history.counterface_force.values[-1, 0, 1] == pytest.approx(1e-3, rel=1e-3)
    assert history.counterface_displacement.values[-1, 0, 1] > 0.0
    scale = np.abs(history.external_work.values).max()
    assert np.abs(history.energy_imbalance.values).max() <= 1e-9 * scale


def test_a_quasi_static_press_and_slide_ends_as_the_slow_dynamic_one():
    static = fs.simulate(push_and_slide(time=QuasiStatic(5e-3)))
    dynamic = fs.simulate(push_and_slide(alpha=-1 / 3))
    np.testing.assert_allclose(static.counterface_force.values[-1], dynamic.counterface_force.values[-1], rtol=1e-3)
    assert not static.kinetic_energy.values.any()
    work = static.external_work.values[-1]
    assert np.abs(static.energy_imbalance.values).max() <= 1e-12 * work


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"gravity": (9.81,)}, "gravity: got 1 components, needs 2"),
        ({"initial_velocity": (1.0,)}, "initial_velocity: got 1 components, needs 2"),
        (
            {"initial_velocity": (1.0, 0.0), "time": QuasiStatic(5e-3)},
            "initial_velocity: is given for a model without inertia",
        ),
        (
            {"contacts": (fs.Contact("bottom", drive=Drive(1.0, 1.0)),), "time": QuasiStatic(5e-3)},
            "contacts.0.drive: got a force that drives a counterface in a model without inertia",
        ),
    ],
)
def test_loads_that_do_not_fit_are_refused(changes, message):
    with pytest.raises(fs.InputError) as caught:
        build_system(push_and_slide(**changes))
    assert message in str(caught.value)


def test_ramps_need_ascending_times():
    with pytest.raises(fs.InputError, match="needs ascending times, a factor for each"):
        Ramp((0.0, 0.0), (1.0, 2.0))
