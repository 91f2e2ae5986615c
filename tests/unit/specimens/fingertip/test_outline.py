"""The outer outline as a curve by arc length, and depths of fingerprint, ridges and borders below it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from scipy.special import ellipe

from fingerslip.specimens.fingertip.fingertip import preset
from fingerslip.specimens.fingertip.outline import (
    arc_length_at_cut,
    at_depth,
    fade,
    interface_depth,
    inward_normal,
    outline_curve,
    position,
    surface_depth,
)
from unit.fingers import SECTIONS, change, shoelace


@pytest.mark.parametrize("section", SECTIONS)
def test_arc_length_begins_at_the_lowest_point_and_tangents_and_normals_are_those_of_the_points(section):
    finger = change(section=section)
    curve = outline_curve(finger)
    lowest = int(curve.points[:, 1].argmin())
    assert curve.arc_length[lowest] == pytest.approx(0.0, abs=1e-12)
    assert curve.points[lowest] == pytest.approx([0.0, -finger.outline.half_height], abs=1e-9)
    chords = np.diff(curve.points, axis=0)
    chords /= np.linalg.norm(chords, axis=1, keepdims=True)
    assert np.linalg.norm(curve.tangents, axis=1) == pytest.approx(1.0)
    # The parabola of the pad has no curvature break at its lowest point large enough to show over one chord.
    assert np.abs(0.5 * (curve.tangents[1:] + curve.tangents[:-1]) - chords).max() < 2e-3
    s = np.linspace(-10e-3, 15e-3, 200)
    normals = inward_normal(curve, s)
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0)
    assert inward_normal(curve, np.array([0.0])) == pytest.approx(np.array([[0.0, 1.0]]), abs=1e-9)
    ahead, behind = position(curve, s + 1e-6), position(curve, s - 1e-6)
    assert np.sum(normals * (ahead - behind), axis=1) == pytest.approx(0.0, abs=2e-9)
    centre = np.array([-3e-3, 0.0])
    assert np.all(np.sum(normals * (centre - position(curve, s)), axis=1) > 0.0)


def test_outlines_go_through_their_dimensions_and_the_transverse_one_has_the_area_of_its_ellipse():
    sagittal = outline_curve(preset("wang2014-2d"))
    assert sagittal.points[:, 0].max() == pytest.approx(8e-3, abs=1e-9)
    assert sagittal.points[:, 1].max() == pytest.approx(7e-3)
    palmar = sagittal.arc_length < 0
    assert np.interp(-16e-3, *sagittal.points[palmar].T) == pytest.approx(-3e-3, abs=1e-8)
    finger = change(section="transverse")
    curve = outline_curve(finger)
    circumference = 4 * 8e-3 * ellipe(1 - (6.5 / 8) ** 2)
    assert shoelace(curve.points[:-1]) == pytest.approx(np.pi * 8e-3 * 6.5e-3, rel=1e-6)
    assert curve.arc_length[[0, -1]] == pytest.approx([-circumference / 2, circumference / 2], rel=1e-7)
    assert curve.closed
    assert curve.points[0] == pytest.approx(curve.points[-1], abs=1e-15)
    assert curve.points[0] == pytest.approx([0.0, 6.5e-3], abs=1e-9)
    assert arc_length_at_cut(finger, curve, 1e-3) == (curve.arc_length[0], curve.arc_length[-1]), "it has no cut"


@pytest.mark.parametrize("section", SECTIONS)
@given(depth=st.floats(1e-5, 4e-3))
def test_offset_curve_keeps_its_distance(section, depth):
    curve = outline_curve(change(section=section))
    inner = at_depth(curve, np.linspace(-15e-3, 20e-3, 100), depth)
    distance, _ = cKDTree(curve.points).query(inner)
    assert distance == pytest.approx(depth, rel=1e-3, abs=2e-6)


@given(s=st.floats(-17e-3, 15e-3), way=st.floats(1e-5, 1e-3))
def test_arc_length_is_the_way_along_the_curve(s, way):
    curve = outline_curve(preset("wang2014-2d"))
    path = position(curve, np.linspace(s, s + way, 50))
    assert np.linalg.norm(np.diff(path, axis=0), axis=1).sum() == pytest.approx(way, rel=1e-4)


@pytest.mark.parametrize("depth", [0.0, 0.5e-3, 1.5e-3, 3e-3])
def test_every_layer_meets_the_proximal_cut_at_both_ends(depth):
    fingertip = preset("wang2014-2d")
    curve = outline_curve(fingertip)
    ends = np.array(arc_length_at_cut(fingertip, curve, depth))
    points = at_depth(curve, ends, depth)
    assert points[:, 0] == pytest.approx(-16e-3, abs=1e-8)
    assert points[1] == pytest.approx([-16e-3, 7e-3 - depth], abs=1e-8)
    assert points[0, 1] < points[1, 1]


def test_ridges_alternate_and_leave_the_mean_thickness_of_the_epidermis():
    fingertip, pitch = preset("wang2014-2d"), 0.47e-3
    depth = interface_depth(fingertip, np.arange(20_000) / 20_000 * 10 * pitch)
    assert depth.mean() == pytest.approx(0.5e-3, rel=1e-9)
    assert np.ptp(depth) == pytest.approx(0.15e-3, rel=1e-6)
    tips = interface_depth(fingertip, np.array([0.0, 0.5, 1.0, 1.5]) * pitch)
    feet = interface_depth(fingertip, np.array([0.25, 0.75]) * pitch)
    assert tips - feet[0] == pytest.approx([0.15e-3, 0.1e-3, 0.15e-3, 0.1e-3])
    assert feet[1] == pytest.approx(feet[0])


@given(s=st.floats(-8e-3, 5e-3), pitch=st.floats(0.3e-3, 0.8e-3))
def test_ridges_repeat_with_their_pitch(s, pitch):
    fingertip = change(ridges={"pitch": f"{pitch!r} m"})
    here, there = interface_depth(fingertip, np.array([s, s + pitch]))
    assert here == pytest.approx(there, abs=1e-12)


def test_fingerprint_crests_are_above_the_intermediate_ridges_and_layers_plain_outside_the_zone_and_without_them():
    fingertip = change(fingerprint={"enabled": True})
    crest, groove = surface_depth(fingertip, np.array([0.0, 0.235e-3]))
    assert (crest, groove) == pytest.approx((-0.05e-3, 0.05e-3))
    shifted = change(fingerprint={"enabled": True, "phase": "180 deg"})
    assert surface_depth(shifted, np.array([0.0]))[0] == pytest.approx(0.05e-3)
    within, outside = np.linspace(-10e-3, 5e-3, 50), np.array([-20e-3, -12e-3, 7e-3, 15e-3])
    plain = change(ridges={"enabled": False})
    for fingertip, s in ((change(fingerprint={"enabled": True}), outside), (plain, within)):
        assert np.all(interface_depth(fingertip, s) == 0.5e-3)
        assert np.all(surface_depth(fingertip, s) == 0)
    assert fade(plain.zone, np.array([-11e-3, 0.0, 6e-3])) == pytest.approx(1.0)


def test_ridges_and_ripples_fade_smoothly_over_their_length_and_half_faded_ones_are_half_as_high():
    """3 x^2 - 2 x^3 of the way in: 0, 5/32, 1/2, 27/32 and 1 at the quarters, the same at both ends.

    At 6 mm, half a fade from the end of the zone, there are both a crest and the tip of an intermediate ridge.
    """
    zone, quarters = preset("wang2014-2d").zone, np.linspace(0.0, 1e-3, 5)
    shares = np.array([0.0, 5 / 32, 1 / 2, 27 / 32, 1.0])
    assert fade(zone, -12e-3 + quarters) == pytest.approx(shares)
    assert fade(zone, 7e-3 - quarters) == pytest.approx(shares)
    ridges, zone = {"pitch": "0.5 mm"}, {"zone": {"end": "6.5 mm"}}
    fingertip = change(fingerprint={"enabled": True, **ridges}, ridges=ridges, sagittal=zone)
    here = np.array([2e-3, 6e-3])
    assert surface_depth(fingertip, here) == pytest.approx([-0.05e-3, -0.025e-3])
    assert interface_depth(fingertip, here) - 0.5e-3 == pytest.approx([0.0875e-3, 0.04375e-3])
