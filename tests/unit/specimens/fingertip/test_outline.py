"""The outer outline as a curve by arc length."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from scipy.special import ellipe

from fingerslip.specimens.fingertip import at_depth, outline_curve, preset
from fingerslip.specimens.fingertip.outline import arc_length_at_cut, inward_normal, position
from unit.fingers import SECTIONS, change, shoelace


@pytest.mark.parametrize("section", SECTIONS)
def test_lowest_point_is_the_origin_of_arc_length(section):
    finger = change(section=section)
    curve = outline_curve(finger)
    lowest = int(curve.points[:, 1].argmin())
    assert curve.arc_length[lowest] == pytest.approx(0.0, abs=1e-12)
    assert curve.points[lowest] == pytest.approx([0.0, -finger.outline.half_height], abs=1e-9)


def test_sagittal_outline_goes_through_its_dimensions():
    curve = outline_curve(preset("wang2014-2d"))
    assert curve.points[:, 0].max() == pytest.approx(8e-3, abs=1e-9)
    assert curve.points[:, 1].max() == pytest.approx(7e-3)
    palmar = curve.arc_length < 0
    assert np.interp(-16e-3, *curve.points[palmar].T) == pytest.approx(-3e-3, abs=1e-8)


def test_transverse_outline_has_the_area_of_its_ellipse():
    curve = outline_curve(change(section="transverse"))
    assert shoelace(curve.points[:-1]) == pytest.approx(np.pi * 8e-3 * 6.5e-3, rel=1e-6)


@pytest.mark.parametrize("section", SECTIONS)
@given(depth=st.floats(1e-5, 4e-3))
def test_offset_curve_keeps_its_distance(section, depth):
    curve = outline_curve(change(section=section))
    inner = at_depth(curve, np.linspace(-15e-3, 20e-3, 100), depth)
    distance, _ = cKDTree(curve.points).query(inner)
    assert distance == pytest.approx(depth, rel=1e-3, abs=2e-6)


def test_transverse_outline_has_the_circumference_of_its_ellipse():
    curve = outline_curve(change(section="transverse"))
    circumference = 4 * 8e-3 * ellipe(1 - (6.5 / 8) ** 2)
    assert np.ptp(curve.arc_length) == pytest.approx(circumference, rel=1e-7)
    assert curve.arc_length[[0, -1]] == pytest.approx([-circumference / 2, circumference / 2], rel=1e-7)
    assert curve.closed
    assert curve.points[0] == pytest.approx(curve.points[-1], abs=1e-15)


@pytest.mark.parametrize("section", SECTIONS)
def test_tangents_are_those_of_the_points(section):
    curve = outline_curve(change(section=section))
    chords = np.diff(curve.points, axis=0)
    chords /= np.linalg.norm(chords, axis=1, keepdims=True)
    assert np.linalg.norm(curve.tangents, axis=1) == pytest.approx(1.0)
    # The parabola of the pad has no curvature break at its lowest point large enough to show over one chord.
    assert np.abs(0.5 * (curve.tangents[1:] + curve.tangents[:-1]) - chords).max() < 2e-3


@pytest.mark.parametrize("section", SECTIONS)
def test_normals_are_upright_and_point_into_the_finger(section):
    curve = outline_curve(change(section=section))
    s = np.linspace(-10e-3, 15e-3, 200)
    normals = inward_normal(curve, s)
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0)
    assert inward_normal(curve, np.array([0.0])) == pytest.approx(np.array([[0.0, 1.0]]), abs=1e-9)
    ahead, behind = position(curve, s + 1e-6), position(curve, s - 1e-6)
    assert np.sum(normals * (ahead - behind), axis=1) == pytest.approx(0.0, abs=2e-9)
    centre = np.array([-3e-3, 0.0])
    assert np.all(np.sum(normals * (centre - position(curve, s)), axis=1) > 0.0)


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


def test_a_closed_section_has_no_cut():
    fingertip = change(section="transverse")
    curve = outline_curve(fingertip)
    assert arc_length_at_cut(fingertip, curve, 1e-3) == (curve.arc_length[0], curve.arc_length[-1])
    assert curve.points[0] == pytest.approx([0.0, 6.5e-3], abs=1e-9)
