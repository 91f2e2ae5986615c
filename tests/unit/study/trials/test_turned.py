"""A slide of the half in one direction is the slide of the whole in eight."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.specimens.tactip import PRESETS, marker_places
from fingerslip.specimens.tactip.sites import modelled_places, points_at
from fingerslip.study.trials.bodies import turned_whole

HALF = PRESETS.read("tactip-ridged-3d")
WHOLE = dataclasses.replace(HALF, part="whole")
PLACES = modelled_places(HALF), marker_places(HALF.markers)


@pytest.mark.parametrize("number", range(8))
def test_the_layout_is_the_same_after_an_eighth_of_a_turn(number):
    at_rest = points_at(HALF, PLACES[0], HALF.marker_depth)
    whole = points_at(WHOLE, PLACES[1], HALF.marker_depth)
    assert len(whole) == 81
    assert turned_whole(at_rest[None], *PLACES, number * np.pi / 4)[0] == pytest.approx(whole, abs=1e-12)


def test_displacements_turn_with_the_slide():
    at_rest = points_at(HALF, PLACES[0], HALF.marker_depth)
    moved = at_rest + np.array([1e-3, 2e-4, 0.0])
    whole = points_at(WHOLE, PLACES[1], HALF.marker_depth)
    found = turned_whole(moved[None], *PLACES, np.pi / 2)[0] - whole
    assert found == pytest.approx(np.tile([0.0, 2e-4, 1e-3], (81, 1)), abs=1e-12)


def test_the_other_half_is_the_mirror_image():
    half, whole = PLACES
    moved = np.zeros((1, len(half.ring), 3))
    moved[0, :, 2] = half.across
    found = turned_whole(moved, half, whole, 0.0)[0, :, 2]
    assert found == pytest.approx(whole.across, abs=1e-12)


def test_a_turn_that_changes_the_layout_is_refused():
    at_rest = points_at(HALF, PLACES[0], HALF.marker_depth)
    with pytest.raises(InputError, match=r"trials\.directions: turns ring 1 by 36 degrees"):
        turned_whole(at_rest[None], *PLACES, np.pi / 5)
