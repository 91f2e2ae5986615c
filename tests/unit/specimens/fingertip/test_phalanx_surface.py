"""The phalanx in 3D: its cuts are the contours of the sections, whatever its variant."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fingerslip.errors import InputError
from fingerslip.specimens.fingertip import depth_below_skin, phalanx_contour, phalanx_surface
from unit.fingers import VARIANTS, change, change_solid

MARKED = [pytest.param(one, marks=[pytest.mark.slow] * (one == "flattened")) for one in VARIANTS]


@functools.cache
def surface(variant):
    """Return the finger of a variant and the surface of its phalanx."""
    finger = change_solid(phalanx={"variant": variant})
    return finger, phalanx_surface(finger)


def cut(fingertip, section):
    return phalanx_contour(dataclasses.replace(fingertip, section=section))


@pytest.mark.parametrize("variant", MARKED)
def test_cuts_are_the_contours_of_both_sections(variant):
    finger, found = surface(variant)
    points = found.points
    quarter = points.shape[1] // 4
    middle = points[:, [0, 2 * quarter]].reshape(-1, 3)
    assert np.abs(middle[:, 2]).max() < 1e-12
    distance, _ = cKDTree(cut(finger, "sagittal")).query(middle[:, :2])
    on_face = middle[:, 0] > points[..., 0].max() - 1e-9  # inside the flat end
    assert distance[~on_face].max() < 2e-5
    origin = int(np.abs(points[:, 0, 0]).argmin())
    assert np.abs(points[origin, :, 0]).max() < 1e-9
    distance, _ = cKDTree(cut(finger, "transverse")).query(points[origin][:, [2, 1]])
    assert distance.max() < 2e-5


@pytest.mark.parametrize("variant", MARKED)
def test_phalanx_is_symmetric_and_keeps_clear_of_the_skin(variant):
    finger, found = surface(variant)
    points = found.points
    mirrored = np.roll(points[:, ::-1], 1, axis=1) * [1.0, 1.0, -1.0]
    assert np.allclose(points, mirrored, atol=1e-12)
    assert depth_below_skin(finger, points.reshape(-1, 3)).min() > 1.1e-3


def test_phalanx_is_narrow_at_the_waist_and_wide_at_the_tuft():
    points = surface("original")[1].points
    widths = {x: points[np.abs(points[:, 0, 0] - x).argmin(), :, 2].max() for x in (-16e-3, -6e-3, 0.0)}
    assert list(widths.values()) == pytest.approx([5e-3, 3.5e-3, 5.5e-3], rel=1e-3)


def test_scaled_phalanx_has_tissue_of_even_thickness_under_the_pad():
    finger, phalanx = surface("scaled")
    assert not phalanx.open
    below = phalanx.points[:, 0][np.abs(phalanx.points[:, 0, 0]) < 2e-3]
    assert depth_below_skin(finger, below) == pytest.approx(4.5e-3, abs=2e-5)


@pytest.mark.parametrize(
    ("fingertip", "message"),
    [
        (change(), "fingertip.solid: is missing"),
        (change_solid(solid={"phalanx": {"base_half_width": "7.5 mm"}}), "of tissue at x = .* z = "),
        (change_solid(solid={"phalanx": {"end_half_width": "0.2 mm"}}), "end_half_width: got 0.2 mm"),
        (change_solid(phalanx={"sagittal": {"distal_end": "0.2 mm"}}), "distal_end: got 0.2 mm, needs to reach beyond"),
    ],
)
def test_phalanges_that_do_not_fit_are_refused(fingertip, message):
    with pytest.raises(InputError, match=message):
        phalanx_surface(fingertip)
