"""The shape of a fingertip: its outline and the layers below it, the skin in 3D, and the bone."""

import dataclasses
import functools
import itertools

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
from fingerslip.specimens.fingertip.phalanx import phalanx_contour, phalanx_surface, reaches_cut
from fingerslip.specimens.fingertip.skin import (
    below_skin,
    depth_below_skin,
    inward_skin_normal,
    onto_skin,
    pose_points,
    relief_depth,
    skin_grid,
    skin_ring,
)
from unit.fingers import SECTIONS, VARIANTS, change, change_solid, shoelace


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


FINGER = change_solid(solid={"base_half_width": "7 mm"})


def section(name):
    return dataclasses.replace(FINGER, section=name)


def in_3d(points, name):
    """Put the points of a section where they are in 3D."""
    along, up = points.T
    zero = np.zeros_like(up)
    return np.column_stack([along, up, zero] if name == "sagittal" else [zero, up, along])


@pytest.mark.parametrize("name", ["sagittal", "transverse"])
@pytest.mark.parametrize("depth", [0.0, 1e-3])
def test_cuts_are_the_sections_with_their_layers(name, depth):
    curve = outline_curve(section(name))
    s = curve.arc_length[(curve.points[:, 0] >= -16e-3)][::50]
    skin = in_3d(at_depth(curve, s, 0.0), name)
    assert np.abs(onto_skin(FINGER, skin) - skin).max() < 1e-9
    assert np.allclose(below_skin(FINGER, skin, depth), in_3d(at_depth(curve, s, depth), name), atol=1e-8)
    normal = in_3d(inward_normal(curve, s), name)
    assert np.allclose(inward_skin_normal(FINGER, skin), normal, atol=1e-5)


@given(x=st.floats(-16e-3, 7.9e-3), angle=st.floats(0.0, 6.3))
def test_normals_are_those_of_the_surface(x, angle):
    def at(dx, da):
        return skin_ring(FINGER, np.array([x + dx]), np.array([angle + da]))

    along, across = at(1e-8, 0.0) - at(-1e-8, 0.0), at(0.0, 1e-5) - at(0.0, -1e-5)
    normal = inward_skin_normal(FINGER, at(0.0, 0.0))
    for tangent in (along, across):
        assert abs(float(np.sum(normal * tangent))) < 2e-5 * np.linalg.norm(tangent)


def test_depth_is_measured_along_normals_and_projection_goes_back_along_them():
    skin = skin_grid(FINGER)[10:-10:15, ::20].reshape(-1, 3)
    for depth in (-1e-4, 0.0, 1e-4, 1e-3):
        assert np.allclose(depth_below_skin(FINGER, below_skin(FINGER, skin, depth)), depth, atol=5e-6)
    assert np.abs(onto_skin(FINGER, below_skin(FINGER, skin, 1e-4)) - skin).max() < 5e-6


RIPPLED = change_solid(fingerprint={"enabled": True})


def test_middle_line_has_the_ripples_of_the_section_and_back_and_sides_are_smooth():
    curve = outline_curve(dataclasses.replace(RIPPLED, section="sagittal"))
    s = np.linspace(-11e-3, 6e-3, 500)
    x, y = (np.interp(s, curve.arc_length, column) for column in curve.points.T)
    relief = relief_depth(RIPPLED, np.column_stack([x, y, np.zeros_like(x)]))
    assert np.allclose(relief, surface_depth(RIPPLED, s), atol=1e-9)
    assert np.ptp(relief) > 0.09e-3
    places = np.array([[0.0, 6.5e-3, 0.0], [0.0, 1e-4, 8e-3], [0.0, -1e-4, -8e-3]])
    assert not relief_depth(RIPPLED, places).any()
    assert not relief_depth(change_solid(), np.array([[0.0, -6.5e-3, 0.0]])).any()


@pytest.mark.parametrize("angle", [-0.4, 0.0, 0.3])
def test_lowest_point_stays_and_distances_too(angle):
    finger = change_solid(solid={"angle": f"{angle} rad"})
    grid = skin_grid(finger)
    turned = pose_points(finger, grid.reshape(-1, 3)).reshape(grid.shape)
    lowest = turned.reshape(-1, 3)[turned[..., 1].argmin()]
    assert lowest == pytest.approx([0.0, -6.5e-3, 0.0], abs=2e-4)
    assert lowest[1] == pytest.approx(-6.5e-3, abs=2e-6)
    before, after = (np.linalg.norm(points[5] - points[60], axis=1) for points in (grid, turned))
    assert np.allclose(before, after, rtol=1e-12)
    tip = np.array([[8e-3, 0.0, 0.0]])
    assert np.sign(pose_points(finger, tip)[0, 1].round(3)) == np.sign(angle), "a positive angle lifts the tip"


@functools.cache
def contour_of(section, variant):
    return phalanx_contour(change(section=section, phalanx={"variant": variant}))


def test_palmar_face_of_the_original_is_concave_and_of_the_flattened_flat():
    x = np.linspace(-10e-3, 2e-3, 200)
    faces = []
    for variant in ("original", "flattened"):
        contour = contour_of("sagittal", variant)
        faces.append(np.interp(x, *contour[: int(contour[:, 0].argmax())].T))
    assert np.all(faces[1] == pytest.approx(-1.5e-3))
    raised = faces[0] - faces[1]
    assert raised.max() == pytest.approx(1e-3, rel=1e-3)
    assert x[raised.argmax()] == pytest.approx(-5e-3, abs=1e-4)
    across = contour_of("transverse", "flattened")
    assert across[:, 1].min() == pytest.approx(-2.4e-3)
    assert np.ptp(across[across[:, 1] < -2.3999e-3][:, 0]) > 5e-3


@pytest.mark.parametrize("section", SECTIONS)
def test_tissue_round_the_scaled_phalanx_has_uniform_thickness(section):
    contour = contour_of(section, "scaled")
    distance, _ = cKDTree(outline_curve(change(section=section)).points).query(contour)
    thickness = distance - 1.5e-3
    # Only the rounded ends are further from the skin.
    uniform = np.abs(thickness - 3.5e-3) < 1e-6
    assert thickness.min() == pytest.approx(3.5e-3, abs=1e-6)
    palmar = (contour[:, 1] < 0) & (np.abs(contour[:, 0] - (-3e-3 if section == "sagittal" else 0.0)) < 2.5e-3)
    assert palmar.sum() > 100
    assert np.all(uniform[palmar])


def test_contours_run_counter_clockwise_and_end_on_the_proximal_cut_or_keep_clear_of_it():
    for section, variant in itertools.product(SECTIONS, VARIANTS):
        contour = contour_of(section, variant)
        assert shoelace(contour) > 0, (section, variant)
        assert reaches_cut(contour) == (section == "sagittal" and variant != "scaled"), (section, variant)
    contour = contour_of("sagittal", "original")
    assert contour[[0, -1], 0] == pytest.approx(-16e-3)
    assert contour[0, 1] < contour[-1, 1] == pytest.approx(3e-3)
    reaching = phalanx_contour(change(sagittal={"pad_rise": "0 mm"}, phalanx={"variant": "scaled"}))
    assert reaches_cut(reaching)
    assert reaching[[0, -1]] == pytest.approx(np.array([[-16e-3, -2e-3], [-16e-3, 2e-3]]), abs=1e-6)
    clear = contour_of("sagittal", "scaled")
    assert not reaches_cut(clear)
    assert clear[:, 0].min() > -16e-3 + 0.3e-3 - 1e-9


def test_distal_corners_are_arcs_of_the_corner_radius():
    contour = phalanx_contour(change(phalanx={"corner_radius": "0.5 mm"}))
    centre = np.array([5e-3 - 0.5e-3, 3e-3 - 0.5e-3])
    corner = contour[np.all(contour > centre + 1e-9, axis=1)]
    assert len(corner) > 50
    assert np.linalg.norm(corner - centre, axis=1) == pytest.approx(0.5e-3, rel=1e-9)
    assert contour[:, 0].max() == pytest.approx(5e-3, abs=1e-12)


@pytest.mark.parametrize("least", [1.0, 1.8])
def test_tissue_under_the_palmar_face_keeps_its_least_thickness(least):
    fingertip = change(phalanx={"sagittal": {"minimum_tissue": f"{least} mm"}})
    contour = phalanx_contour(fingertip)
    palmar = contour[: int(contour[:, 0].argmax())]
    distance, _ = cKDTree(outline_curve(fingertip).points).query(palmar[palmar[:, 0] < 0.0])
    assert distance.min() - 1.5e-3 == pytest.approx(least * 1e-3, abs=2e-6)


@pytest.mark.parametrize("width", [0.5, 2.0])
def test_transverse_hollow_has_its_depth_and_width(width):
    fingertip = change(section="transverse", phalanx={"transverse": {"concavity_width": f"{width} mm"}})
    contour = phalanx_contour(fingertip)
    palmar = contour[contour[:, 1] < 0.0]
    palmar = palmar[np.argsort(palmar[:, 0])]
    x = np.array([0.0, width * 1e-3])
    ellipse = 3e-3 * np.sqrt(1.0 - (x / 5.5e-3) ** 2)
    expected = -ellipse + 1e-3 * ellipse / 3e-3 * np.exp(-((x / (width * 1e-3)) ** 2))
    assert np.interp(x, *palmar.T) == pytest.approx(expected, abs=1e-6)


MARKED = [pytest.param(one, marks=[pytest.mark.slow] * (one != "original")) for one in VARIANTS]


@functools.cache
def surface(variant):
    """Return the finger of a variant and the surface of its phalanx."""
    finger = change_solid(phalanx={"variant": variant})
    return finger, phalanx_surface(finger)


@pytest.mark.parametrize("variant", MARKED)
def test_cuts_are_the_contours_of_both_sections_and_the_surface_keeps_clear_of_the_skin(variant):
    finger, phalanx = surface(variant)
    points = phalanx.points
    quarter = points.shape[1] // 4
    middle = points[:, [0, 2 * quarter]].reshape(-1, 3)
    assert np.abs(middle[:, 2]).max() < 1e-12
    distance, _ = cKDTree(phalanx_contour(dataclasses.replace(finger, section="sagittal"))).query(middle[:, :2])
    on_face = middle[:, 0] > points[..., 0].max() - 1e-9  # inside the flat end
    assert distance[~on_face].max() < 2e-5
    origin = int(np.abs(points[:, 0, 0]).argmin())
    assert np.abs(points[origin, :, 0]).max() < 1e-9
    distance, _ = cKDTree(phalanx_contour(dataclasses.replace(finger, section="transverse"))).query(
        points[origin][:, [2, 1]]
    )
    assert distance.max() < 2e-5
    assert np.allclose(points, np.roll(points[:, ::-1], 1, axis=1) * [1.0, 1.0, -1.0], atol=1e-12), "symmetric"
    # Thickness changes little from row to row, and distances to the skin are slow to compute.
    assert depth_below_skin(finger, points[::2, ::3].reshape(-1, 3)).min() > 1.1e-3


@pytest.mark.slow
def test_phalanx_is_narrow_at_the_waist_and_wide_at_the_tuft_and_a_scaled_one_has_even_tissue_under_the_pad():
    points = surface("original")[1].points
    widths = {x: points[np.abs(points[:, 0, 0] - x).argmin(), :, 2].max() for x in (-16e-3, -6e-3, 0.0)}
    assert list(widths.values()) == pytest.approx([5e-3, 3.5e-3, 5.5e-3], rel=1e-3)

    finger, phalanx = surface("scaled")
    assert not phalanx.open
    below = phalanx.points[:, 0][np.abs(phalanx.points[:, 0, 0]) < 2e-3]
    assert depth_below_skin(finger, below) == pytest.approx(4.5e-3, abs=2e-5)
