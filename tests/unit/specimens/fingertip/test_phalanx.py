"""The phalanx: its contour in both sections and its surface in 3D, in all variants."""

import dataclasses
import functools
import itertools

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fingerslip.specimens.fingertip.outline import outline_curve
from fingerslip.specimens.fingertip.phalanx import phalanx_contour, phalanx_surface, reaches_cut
from fingerslip.specimens.fingertip.skin import depth_below_skin
from unit.fingers import SECTIONS, VARIANTS, change, change_solid, shoelace


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
