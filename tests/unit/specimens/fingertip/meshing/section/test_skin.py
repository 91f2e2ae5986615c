"""The skin as rows and columns: layers, ridge tips, even columns in the contact, ends on the cut."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from fingerslip.errors import InputError
from fingerslip.specimens.fingertip import (
    Fingertip,
    interface_depth,
    outline_curve,
    phalanx_contour,
    preset,
    surface_depth,
)
from fingerslip.specimens.fingertip.meshing.section.build import SkinGrid, sweep_skin
from fingerslip.specimens.fingertip.meshing.section.source import MeshSizes
from unit.fingers import SECTIONS, change


def swept(fingertip: Fingertip, sizes: MeshSizes | None = None) -> SkinGrid:
    return sweep_skin(fingertip, sizes or MeshSizes(), phalanx_contour(fingertip))


def depths(fingertip: Fingertip, points: np.ndarray) -> np.ndarray:
    """Return the depths below the outline, negative outside the finger."""
    curve = outline_curve(fingertip)
    _, nearest = cKDTree(curve.points).query(points)
    inward = np.column_stack([-curve.tangents[nearest, 1], curve.tangents[nearest, 0]])
    return np.sum((points - curve.points[nearest]) * inward, axis=1)


@pytest.mark.parametrize("section", SECTIONS)
def test_rows_are_the_surfaces_of_the_layers(section: str) -> None:
    fingertip = change(section=section, ridges={"enabled": False})
    grid = swept(fingertip)
    assert grid.closed == (section == "transverse")
    expected = {0: 0.0, grid.epidermis_rows: 0.5e-3, grid.points.shape[0] - 1: 1.5e-3}
    for row, depth in expected.items():
        # The last nodes of an open section are shifted onto the cut.
        assert depths(fingertip, grid.points[row])[2:-2] == pytest.approx(depth, abs=5e-7)


def test_rows_within_a_layer_are_evenly_spaced() -> None:
    fingertip = change(ridges={"enabled": False})
    grid = swept(fingertip)
    middle = np.abs(grid.arc_length) < 3e-3
    thickness = np.diff([depths(fingertip, row[middle]).mean() for row in grid.points])
    epidermis, dermis = thickness[: grid.epidermis_rows], thickness[grid.epidermis_rows :]
    assert epidermis == pytest.approx(0.5e-3 / len(epidermis), rel=1e-3)
    assert dermis == pytest.approx(1e-3 / len(dermis), rel=1e-3)


@pytest.mark.parametrize(("size", "rows"), [(0.12e-3, (4, 7)), (0.15e-3, (3, 5)), (0.5e-3, (1, 2)), (2e-3, (1, 1))])
def test_number_of_rows_follows_the_contact_size(size: float, rows: tuple[int, int]) -> None:
    """Epidermis: thickness over size; dermis: thickness over one and a quarter of the size; never none."""
    grid = swept(change(ridges={"enabled": False}), MeshSizes(contact_size=size, bulk_size=3e-3))
    assert (grid.epidermis_rows, grid.points.shape[0] - 1 - grid.epidermis_rows) == rows


@pytest.mark.parametrize("size", [0.08e-3, 0.12e-3, 0.15e-3])
def test_every_ridge_tip_has_a_column_and_columns_in_the_contact_are_even(size: float) -> None:
    grid = swept(preset("wang2014-2d"), MeshSizes(contact_size=size))
    within = (grid.arc_length >= grid.contact[0]) & (grid.arc_length <= grid.contact[1])
    spacing = np.diff(grid.arc_length[within])
    assert spacing == pytest.approx(spacing[0])
    assert spacing[0] == pytest.approx(size, rel=0.35)
    tips = np.arange(-14, 15) * 0.235e-3
    assert np.abs(tips[:, None] - grid.arc_length).min(axis=1).max() < 1e-12


def test_the_contact_reaches_as_high_as_asked_for() -> None:
    for reach in (1e-3, 2e-3):
        grid = swept(preset("wang2014-2d"), MeshSizes(contact_reach=reach))
        curve = outline_curve(preset("wang2014-2d"))
        heights = np.interp(grid.contact, curve.arc_length, curve.points[:, 1])
        assert heights == pytest.approx(-7e-3 + reach, abs=2e-5)


@pytest.mark.parametrize("section", SECTIONS)
def test_columns_widen_outside_the_contact_but_keep_their_shape(section: str) -> None:
    grid = swept(change(section=section), MeshSizes(bulk_size=2e-3))
    width = np.diff(grid.arc_length)
    height = np.linalg.norm(np.diff(grid.points, axis=0), axis=2).min(axis=0)
    beside = np.minimum(height[1:], height[:-1])[: len(width)]
    assert width.max() > 1.5 * width[np.abs(grid.arc_length[:-1]) < 2e-3].max()
    assert np.all(width <= 10.0 * beside)
    assert np.all(np.diff(grid.arc_length) > 0.0)


def test_ends_of_all_rows_lie_on_the_proximal_cut() -> None:
    grid = swept(preset("wang2014-2d"))
    assert np.all(grid.points[:, [0, -1], 0] == -16e-3)
    assert np.all(np.diff(grid.points[:, 0, 1]) > 0.0), "inward is up at the palmar end"
    assert np.all(np.diff(grid.points[:, -1, 1]) < 0.0), "and down at the dorsal one"


def test_ridges_and_fingerprint_shape_the_rows() -> None:
    fingertip = change(fingerprint={"enabled": True})
    grid = swept(fingertip)
    middle = np.abs(grid.arc_length) < 3e-3
    s = grid.arc_length[middle]
    surface, interface, border = (grid.points[row][middle] for row in (0, grid.epidermis_rows, -1))
    assert depths(fingertip, surface) == pytest.approx(surface_depth(fingertip, s), abs=1e-6)
    assert depths(fingertip, interface) == pytest.approx(interface_depth(fingertip, s), abs=1e-6)
    assert depths(fingertip, border) == pytest.approx(1.5e-3, abs=1e-6)


@pytest.mark.parametrize(
    ("groups", "message"),
    [
        (
            {"sagittal": {"zone": {"start": "-20 mm"}}},
            "sagittal.zone: reaches from -20 mm to 7 mm, needs to lie within",
        ),
        ({"sagittal": {"zone": {"end": "40 mm"}}}, "sagittal.zone: reaches from -12 mm to 40 mm"),
    ],
)
def test_a_ridge_zone_beyond_the_section_is_refused(groups: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        swept(change(**groups))


def test_a_contact_size_that_cannot_show_the_ridges_is_refused_just_beyond_a_third_of_the_pitch() -> None:
    sizes = {"bulk_size": 1e-3}
    assert swept(preset("wang2014-2d"), MeshSizes(contact_size=0.47e-3 / 3, **sizes)).epidermis_rows >= 1
    with pytest.raises(InputError, match=r"mesh.contact_size: got 0.157 mm, needs <= 0.1567 mm, a third of ridges"):
        swept(preset("wang2014-2d"), MeshSizes(contact_size=0.157e-3, **sizes))
