"""The programme as motion of the plate."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.system.motion import counterface_motion, largest_approach, phase_table
from fingerslip.errors import InputError
from fingerslip.model.programme import phase_duration

PROGRAMME = (fs.Press(1.5e-3, 1.5e-3), fs.Hold(0.5), fs.Slide(6e-3, 3e-3), fs.Lift(1e-3, 2e-3))


def test_phases_follow_each_other():
    kinds, knots = phase_table(PROGRAMME)
    assert kinds == ["press", "hold", "slide", "lift"]
    np.testing.assert_allclose(knots, [0.0, 1.0, 1.5, 3.5, 4.0])
    assert [phase_duration(phase) for phase in PROGRAMME] == pytest.approx([1.0, 0.5, 2.0, 0.5])


def test_plate_below_presses_up_and_slides_along_x():
    motion = counterface_motion(PROGRAMME, fs.Plane())
    times = np.array([0.0, 0.5, 1.0, 1.25, 2.5, 3.5, 3.75, 4.0, 9.0])
    expected = [[0, 0], [0, 0.75], [0, 1.5], [0, 1.5], [3, 1.5], [6, 1.5], [6, 1.0], [6, 0.5], [6, 0.5]]
    np.testing.assert_allclose(motion.displacement(times), 1e-3 * np.array(expected), atol=1e-12)


def test_velocity_is_the_slope_and_at_a_knot_that_of_the_phase_before():
    motion = counterface_motion(PROGRAMME, fs.Plane())
    times = np.array([0.0, 0.5, 1.0, 1.2, 1.5, 2.0, 3.5, 3.6, 4.0, 5.0])
    expected = [[0, 1.5], [0, 1.5], [0, 1.5], [0, 0], [0, 0], [3, 0], [3, 0], [0, -2], [0, -2], [0, 0]]
    np.testing.assert_allclose(motion.velocity(times), 1e-3 * np.array(expected), atol=1e-12)


def test_inclined_plane_presses_along_its_normal_and_slides_along_its_tangent():
    motion = counterface_motion((fs.Press(1e-3, 1e-3), fs.Slide(2e-3, 1e-3)), fs.Plane(normal=(3.0, 4.0)))
    np.testing.assert_allclose(motion.positions[1], [0.6e-3, 0.8e-3])
    np.testing.assert_allclose(motion.positions[2] - motion.positions[1], [1.6e-3, -1.2e-3])


@pytest.mark.parametrize(
    ("direction", "expected"), [((-2.0, 0.0), [-1, 0]), ((3.0, 4.0), [1, 0]), ((-1e-3, 5e-3), [-1, 0])]
)
def test_direction_is_projected_on_the_plane_at_full_length(direction, expected):
    motion = counterface_motion((fs.Slide(1e-3, 1e-3, direction=direction),), fs.Plane())
    np.testing.assert_allclose(motion.positions[-1], 1e-3 * np.array(expected), atol=1e-18)


@pytest.mark.parametrize("direction", [(0.0, 1.0), (0.0, 0.0), (1e-9, 1.0)])
def test_direction_along_the_normal_is_refused(direction):
    with pytest.raises(
        InputError, match=r"programme.1.slide.direction: got .*, needs a direction along the counterface"
    ):
        counterface_motion((fs.Press(1e-3, 1e-3), fs.Slide(1e-3, 1e-3, direction=direction)), fs.Plane())


def test_direction_of_the_wrong_dimension_is_refused():
    with pytest.raises(InputError, match="got 3 components, needs 2"):
        counterface_motion((fs.Slide(1e-3, 1e-3, direction=(1.0, 0.0, 0.0)),), fs.Plane())


def test_largest_approach_is_the_deepest_press():
    programme = (fs.Press(1e-3, 1e-3), fs.Press(0.5e-3, 1e-3), fs.Slide(5e-3, 1e-3), fs.Lift(1.2e-3, 1e-3))
    assert largest_approach(counterface_motion(programme, fs.Plane()), fs.Plane()) == pytest.approx(1.5e-3)
    lifted = counterface_motion((fs.Lift(1e-3, 1e-3),), fs.Plane())
    assert largest_approach(lifted, fs.Plane()) == 0.0


def test_rounding_of_the_steps_does_not_move_a_knot():
    for speed in np.linspace(1e-3, 9e-3, 200):
        motion = counterface_motion((fs.Press(1.5e-3, speed), fs.Slide(6e-3, 3e-3)), fs.Plane())
        step = motion.knots[1] / 30.0
        times = step * np.arange(31)
        np.testing.assert_allclose(motion.velocity(times)[1:], [[0.0, speed]] * 30, atol=1e-12)


def test_an_empty_programme_stands_still():
    motion = counterface_motion((), fs.Plane())
    assert not motion.displacement(np.array([0.0, 1.0])).any()
    assert not motion.velocity(np.array([0.0, 1.0])).any()


def test_a_direction_may_have_components_of_any_size():
    for size in (1e-300, 1.0, 1e300):
        slide = fs.Slide(1e-3, 1e-3, (size, 0.5 * size, 0.0))
        motion = counterface_motion((slide,), fs.Plane((0.0, 0.0, 1.0)))
        np.testing.assert_allclose(motion.positions[-1], 1e-3 * np.array([2.0, 1.0, 0.0]) / np.sqrt(5.0), rtol=1e-12)
