"""Line contact of a large curved body with a rigid plate, in dynamic steps nearly without inertia.

The closed forms and their tolerances are those of :mod:`fingerslip.verification.line`, whose own problems are
quasi-static.
"""

from dataclasses import replace

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.verification import line


def rounded(x):
    """Return the lower side of a round body: a parabola, and straight from 2 half widths on."""
    near = np.minimum(np.abs(x), 2 * line.HALF_WIDTH)
    return near**2 / (2 * line.RADIUS) + near / line.RADIUS * (np.abs(x) - near)


def run(profile, depth):
    """Press in 40 steps, then slide in 16."""
    programme = (fs.Press(depth, depth / 2), fs.Slide(0.6 * depth, 0.75 * depth))
    light = {"bulk": fs.Elastic(line.MODULUS, line.RATIO, 1e-4)}
    model = line.line_model("Q4", profile, fs.Plane(), programme)
    return fs.simulate(replace(model, materials=light, time=fs.TimeStepping(0.05)))


@pytest.fixture(scope="module")
def histories():
    return {"round": run(rounded, 2.5e-6), "flattened": run(line.flattened, 1.5e-6)}


def assert_held(checks):
    assert not [check for check in checks if not check.holds]


def test_hertz_half_width_peak_and_profile_and_a_normal_force_that_stays_while_sliding(histories):
    history = histories["round"]
    x, pressures, _, _ = line.order_nodes(history)
    for step in (20, 30, 40):
        assert_held(line.hertz_checks(history, step))
        half_width, _ = line.closed_form(float(history["counterface_force"].values[step, 0, 1]))
        assert not pressures[step][np.abs(x) > half_width + line.HALF_WIDTH / 20].any()
    assert_held([line.drift_check(history)])


def partial_slip(history, step):
    tangential, normal = history["counterface_force"].values[step, 0]
    return 0.05 < tangential / (line.MU * normal) < 0.98


def test_cattaneo_stick_zone_and_traction(histories):
    for step in (44, 48, 52, 56):
        assert partial_slip(histories["round"], step)
        assert_held(line.cattaneo_checks(histories["round"], step))


@pytest.mark.parametrize(("profile", "tolerance"), [("round", 0.05), ("flattened", 0.08)])
def test_ciavarella_jaeger_from_two_normal_loads(histories, profile, tolerance):
    for step in (44, 48, 52):
        assert partial_slip(histories[profile], step)
        assert_held(line.jaeger_checks(histories[profile], step, tolerance, 0.04))
