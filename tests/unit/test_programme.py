"""The phases of a programme: how far they go and how long they last."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.system.motion import counterface_motion
from fingerslip.model.programme import phase_duration, phase_travel
from fingerslip.parameters import from_mapping
from problems.pushed import push_and_slide

PHASES = (fs.Press(1.5e-3, 1e-3), fs.Hold(0.5), fs.Slide(6e-3, 3e-3), fs.Lift(1e-3, 2e-3))


def test_travel_and_duration_of_every_phase():
    assert [phase_travel(phase) for phase in PHASES] == [1.5e-3, 0.0, 6e-3, 1e-3]
    assert [phase_duration(phase) for phase in PHASES] == pytest.approx([1.5, 0.5, 2.0, 0.5])


def test_a_slide_may_press_or_lift_on_its_way():
    programme = (fs.Press(1e-3, 1e-3), fs.Slide(2e-3, 1e-3, press=0.5e-3), fs.Slide(2e-3, 1e-3, press=-1e-3))
    motion = counterface_motion(programme, fs.Plane())
    np.testing.assert_allclose(motion.knots, [0.0, 1.0, 3.0, 5.0])
    np.testing.assert_allclose(1e3 * motion.positions, [[0, 0], [0, 1], [2, 1.5], [4, 0.5]], atol=1e-12)
    inclined = counterface_motion((fs.Slide(2e-3, 1e-3, press=0.5e-3),), fs.Plane(normal=(3.0, 4.0)))
    np.testing.assert_allclose(1e3 * inclined.positions[-1], [2 * 0.8 + 0.5 * 0.6, -2 * 0.6 + 0.5 * 0.8])


def test_a_slide_of_a_file_gives_its_press_with_a_unit():
    values = {"distance": "6 mm", "speed": "3 mm/s", "press": "-200 um"}
    assert from_mapping(fs.Slide, values, "f") == fs.Slide(6e-3, 3e-3, press=-0.2e-3)


@pytest.mark.parametrize(("press", "sign"), [(0.1e-3, 1.0), (-0.05e-3, -1.0)])
def test_the_normal_force_grows_or_falls_while_the_plate_slides(press, sign):
    programme = (fs.Press(0.1e-3, 1e-3), fs.Slide(0.5e-3, 5e-3, press=press))
    history = fs.simulate(push_and_slide(programme=programme, time=fs.QuasiStatic(5e-3)))
    normal = history["counterface_force"].sel(time=slice(0.1, 0.2)).values[:, 0, 1]
    assert (sign * np.diff(normal) > 0.0).all()
    friction = history["counterface_force"].values[-1, 0]
    assert abs(friction[0]) == pytest.approx(0.4 * friction[1], rel=1e-6)
