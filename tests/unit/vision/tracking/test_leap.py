"""Motions of the whole pattern between two frames."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.vision.tracking.neighbours import common_shift, lost_suddenly
from problems import clips


def test_a_tenth_of_the_markers_lost_at_once_is_sudden():
    here = np.array([True] * 30 + [False] * 10)
    sure = here.copy()
    assert not lost_suddenly(here, sure)
    sure[:2] = False
    assert not lost_suddenly(here, sure)
    sure[2] = False
    assert lost_suddenly(here, sure)
    assert not lost_suddenly(np.array([True]), np.array([False]))


def test_a_shift_of_a_whole_distance_between_markers_is_found_in_bad_light():
    look, points = clips.with_look(clips.BAD, exposure=0.0, jpeg=0), clips.field(layout="hex", rings=6)
    shift = points[1] - points[0]
    before, image = (next(clips.filmed((points + by)[None], look, seed=4)) for by in (0.0, shift))
    found = common_shift(before, image, points, look.radius, -1)
    assert found == pytest.approx(shift, abs=2.0)
