"""Lines of the skin: thickness, height of ridges, ends at the window."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.specimens.tactip.parts import Dome, Ridges, Skin
from fingerslip.specimens.tactip.profile import inward, place_points, skin_lines

DOME = Dome(20e-3, 20e-3)
FLAT = Dome(5e-3, 8e-3, 15e-3)
RIDGES = Ridges(True, 3.3e-3, 3e-3, 4)


def test_points_of_a_dome_lie_on_circles():
    along = np.linspace(0.0, 30e-3, 7)
    points = place_points(DOME, along, np.full(7, 2e-3)) - [0.0, 20e-3]
    assert np.hypot(*points.T) == pytest.approx(18e-3)
    assert place_points(DOME, along, np.zeros(7)) + 2e-3 * inward(DOME, along) == pytest.approx(
        points + np.array([0.0, 20e-3])
    )


def test_a_flat_sensor_is_flat_then_turns_then_rises():
    along = np.array([10e-3, 15e-3 + 2.5e-3 * np.pi, 15e-3 + 2.5e-3 * np.pi + 1e-3])
    assert place_points(FLAT, along, np.zeros(3)) == pytest.approx(
        np.array([[10e-3, 0.0], [20e-3, 5e-3], [20e-3, 6e-3]])
    )


@pytest.mark.parametrize("dome", [DOME, FLAT, Dome(20e-3, 12e-3)])
@pytest.mark.parametrize("enabled", [True, False])
def test_both_lines_run_from_the_axis_to_the_window(dome, enabled):
    lines = skin_lines(dome, Skin(1e-3, Ridges(enabled, 3.3e-3, 3e-3, 4)), 3.3e-3)
    for line in (lines.outer, lines.inner):
        assert line[0, 0] == 0.0
        assert line[-1, 1] == dome.height
        assert np.linalg.norm(np.diff(line, axis=0), axis=1).min() > 1e-6
    assert len(lines.outer) == len(lines.inner) == lines.corners[-1] + 1
    assert lines.inner[0, 1] - lines.outer[0, 1] == pytest.approx(1e-3)


def test_ridges_of_a_wide_dome_have_the_thickness_and_the_height_of_the_paper():
    lines = skin_lines(Dome(2.0, 2.0), Skin(1e-3, RIDGES), 3.3e-3)
    ridged = lines.outer[: lines.corners[-2] + 1]
    away = np.linalg.norm(lines.inner[: lines.corners[-2] + 1, None] - ridged[None], axis=2)
    # Splines join the points, so points alone are a little farther apart than the lines.
    assert away.min(axis=1) == pytest.approx(1e-3, rel=0.03)
    crowns, valleys = lines.outer[lines.corners[:-1:2], 1], lines.outer[lines.corners[1:-1:2], 1]
    assert valleys - crowns == pytest.approx(3e-3, rel=0.02)


def test_low_ridges_have_no_upright_flanks():
    lines = skin_lines(DOME, Skin(0.5e-3, Ridges(True, 3.3e-3, 0.5e-3, 4)), 3.3e-3)
    assert np.linalg.norm(np.diff(lines.outer, axis=0), axis=1).min() > 1e-6
