import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from fingerslip.anatomy import (
    at_depth,
    fingertip_from,
    interface_depth,
    outline_curve,
    phalanx_contour,
    preset,
    reaches_cut,
    surface_depth,
)
from fingerslip.anatomy.interfaces import fade


def change(**groups):
    return fingertip_from({"preset": "wang2014-2d", **groups}, "finger")


def shoelace(points):
    x, y = points.T
    return 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))


SECTIONS = ("sagittal", "transverse")
VARIANTS = ("original", "flattened", "scaled")


@pytest.mark.parametrize("section", SECTIONS)
def test_lowest_point_is_the_origin_of_arc_length(section):
    curve = outline_curve(change(section=section))
    lowest = int(curve.points[:, 1].argmin())
    assert curve.arc_length[lowest] == pytest.approx(0.0, abs=1e-12)
    assert curve.points[lowest] == pytest.approx([0.0, -6.5e-3], abs=1e-9)


def test_sagittal_outline_goes_through_its_dimensions():
    curve = outline_curve(preset("wang2014-2d"))
    assert curve.points[:, 0].max() == pytest.approx(8e-3, abs=1e-9)
    assert curve.points[:, 1].max() == pytest.approx(6.5e-3)
    palmar = curve.arc_length < 0
    assert np.interp(-16e-3, *curve.points[palmar].T) == pytest.approx(-2.5e-3, abs=1e-8)


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


def test_ridges_leave_the_mean_thickness_of_the_epidermis():
    fingertip = preset("wang2014-2d")
    whole_pitches = np.arange(20_000) / 20_000 * 10 * 0.47e-3
    depth = interface_depth(fingertip, whole_pitches)
    assert depth.mean() == pytest.approx(0.5e-3, rel=1e-9)
    assert np.ptp(depth) == pytest.approx(0.15e-3, rel=1e-6)


def test_intermediate_and_limiting_ridges_alternate():
    fingertip, pitch = preset("wang2014-2d"), 0.47e-3
    tips = interface_depth(fingertip, np.array([0.0, 0.5, 1.0, 1.5]) * pitch)
    feet = interface_depth(fingertip, np.array([0.25, 0.75]) * pitch)
    assert tips - feet[0] == pytest.approx([0.15e-3, 0.1e-3, 0.15e-3, 0.1e-3])
    assert feet[1] == pytest.approx(feet[0])


@given(s=st.floats(-8e-3, 5e-3), pitch=st.floats(0.3e-3, 0.8e-3))
def test_ridges_repeat_with_their_pitch(s, pitch):
    fingertip = change(ridges={"pitch": f"{pitch!r} m"})
    here, there = interface_depth(fingertip, np.array([s, s + pitch]))
    assert here == pytest.approx(there, abs=1e-12)


def test_fingerprint_crests_are_above_the_intermediate_ridges():
    fingertip = change(fingerprint={"enabled": True})
    crest, groove = surface_depth(fingertip, np.array([0.0, 0.235e-3]))
    assert (crest, groove) == pytest.approx((-0.05e-3, 0.05e-3))
    shifted = change(fingerprint={"enabled": True, "phase": "180 deg"})
    assert surface_depth(shifted, np.array([0.0]))[0] == pytest.approx(0.05e-3)


def test_ridges_and_ripples_fade_to_nothing_outside_their_zone():
    fingertip = change(fingerprint={"enabled": True})
    outside = np.array([-20e-3, -12e-3, 7e-3, 15e-3])
    assert np.all(surface_depth(fingertip, outside) == 0)
    assert np.all(interface_depth(fingertip, outside) == 0.5e-3)
    assert fade(fingertip.zone, np.array([-11e-3, 0.0, 6e-3])) == pytest.approx(1.0)


def test_layers_without_ridges_and_ripples_are_plain():
    fingertip = change(ridges={"enabled": False})
    s = np.linspace(-10e-3, 5e-3, 50)
    assert np.all(interface_depth(fingertip, s) == 0.5e-3)
    assert np.all(surface_depth(fingertip, s) == 0)


def test_palmar_face_of_the_original_is_concave_and_of_the_flattened_flat():
    x = np.linspace(-10e-3, 2e-3, 200)
    faces = {}
    for variant in ("original", "flattened"):
        contour = phalanx_contour(change(phalanx={"variant": variant}))
        palmar = contour[: int(contour[:, 0].argmax())]
        faces[variant] = np.interp(x, *palmar.T)
    assert np.all(faces["flattened"] == pytest.approx(-1.5e-3))
    raised = faces["original"] - faces["flattened"]
    assert raised.max() == pytest.approx(1e-3, rel=1e-3)
    assert x[raised.argmax()] == pytest.approx(-5e-3, abs=1e-4)


def test_flattened_palmar_face_is_flat_across_the_finger_too():
    contour = phalanx_contour(change(section="transverse", phalanx={"variant": "flattened"}))
    assert contour[:, 1].min() == pytest.approx(-2.4e-3)
    assert np.ptp(contour[contour[:, 1] < -2.3999e-3][:, 0]) > 5e-3


@pytest.mark.parametrize("section", SECTIONS)
def test_tissue_round_the_scaled_phalanx_has_uniform_thickness(section):
    fingertip = change(section=section, phalanx={"variant": "scaled"})
    contour = phalanx_contour(fingertip)
    distance, _ = cKDTree(outline_curve(fingertip).points).query(contour)
    thickness = distance - 1.5e-3
    # Only the rounded ends are further from the skin.
    uniform = np.abs(thickness - 3.5e-3) < 1e-6
    assert thickness.min() == pytest.approx(3.5e-3, abs=1e-6)
    palmar = (contour[:, 1] < 0) & (np.abs(contour[:, 0] - (-3e-3 if section == "sagittal" else 0.0)) < 2.5e-3)
    assert palmar.sum() > 100
    assert np.all(uniform[palmar])


@pytest.mark.parametrize("section", SECTIONS)
@pytest.mark.parametrize("variant", VARIANTS)
def test_contours_run_counter_clockwise(section, variant):
    contour = phalanx_contour(change(section=section, phalanx={"variant": variant}))
    assert shoelace(contour) > 0
    assert reaches_cut(contour) == (section == "sagittal" and variant != "scaled")


def test_open_contours_end_on_the_proximal_cut():
    contour = phalanx_contour(preset("wang2014-2d"))
    assert contour[[0, -1], 0] == pytest.approx(-16e-3)
    assert contour[0, 1] < contour[-1, 1] == pytest.approx(3e-3)


def test_scaled_phalanx_that_reaches_the_cut_ends_on_it():
    contour = phalanx_contour(change(sagittal={"pad_rise": "0 mm"}, phalanx={"variant": "scaled"}))
    assert reaches_cut(contour)
    assert contour[[0, -1]] == pytest.approx(np.array([[-16e-3, -1.5e-3], [-16e-3, 1.5e-3]]), abs=1e-6)
