"""Layers between surfaces: bodies that are no finger are one clear error, before anything is meshed."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fingerslip.errors import InputError, MeshError
from fingerslip.mesh.scan.layered import LayerSizes, _bodies, _wanted_sizes, build_from_surfaces
from fingerslip.mesh.scan.surfaces import Surface
from unit.ellipsoids import ellipsoid, with_hole

SKIN = ellipsoid(points=400, name="skin.stl")
PHALANX = ellipsoid((7e-3, 3e-3, 3e-3), points=200, name="phalanx.stl")
SIZES = LayerSizes(
    skin_thickness=1.2e-3, contact_size=2e-3, bulk_size=4e-3, contact_reach=3e-3, tolerance=0.2e-3, cut=14e-3
)


def test_wanted_sizes_grow_from_the_pad():
    bodies = _bodies(SKIN, None, SIZES)
    # On the pad, two millimetres and a centimetre above it; the grid of the sizes has a spacing of one.
    places = np.array([[1e-3, -7.9e-3, 0.0], [1e-3, -5.9e-3, 0.0], [1e-3, 2.1e-3, 0.0]])
    on, above, far = _wanted_sizes(places, 1e-3, bodies, SIZES)
    assert on == SIZES.contact_size
    assert SIZES.contact_size < above < SIZES.contact_size + 0.4 * 1.1e-3
    assert far == SIZES.bulk_size


def test_phalanx_that_pokes_through_the_skin():
    with pytest.raises(MeshError, match=r"phalanx.stl: pokes 2.* mm through the skin at x = 14 mm, .*inside skin.stl"):
        build_from_surfaces(SKIN, dataclasses.replace(PHALANX, points=PHALANX.points + np.array([7e-3, 0, 0])), SIZES)


def test_phalanx_somewhere_else():
    with pytest.raises(MeshError, match=r"phalanx.stl: pokes .* with all points.*same unit and axes"):
        build_from_surfaces(SKIN, dataclasses.replace(PHALANX, points=PHALANX.points + np.array([0.1, 0, 0])), SIZES)


def test_phalanx_behind_the_cut():
    behind = ellipsoid((2e-3, 2e-3, 2e-3), (-6e-3, 0, 0), name="phalanx.stl")
    with pytest.raises(MeshError, match="wholly proximal of the cut"):
        build_from_surfaces(SKIN, behind, SIZES)


def test_open_skin():
    with pytest.raises(MeshError, match="is open: 1 hole"):
        build_from_surfaces(with_hole(SKIN, (6e-3, 7e-3, 0.0), 3e-3), PHALANX, SIZES)


def test_inside_out_skin():
    with pytest.raises(MeshError, match="inside out"):
        build_from_surfaces(Surface(SKIN.points, SKIN.triangles[:, ::-1]), PHALANX, SIZES)


def test_cut_that_misses_the_finger():
    with pytest.raises(MeshError, match=r"cut: got 30 mm from the tip, needs < 23.9"):
        build_from_surfaces(SKIN, PHALANX, dataclasses.replace(SIZES, cut=30e-3))


def test_skin_without_tissue():
    with pytest.raises(MeshError, match="smaller skin_thickness"):
        build_from_surfaces(SKIN, PHALANX, dataclasses.replace(SIZES, skin_thickness=7.5e-3))


@pytest.mark.parametrize(("field", "value"), [("bulk_size", 1e-3), ("tolerance", 0.5e-3), ("cut", -1.0)])
def test_sizes_that_do_not_fit(field: str, value: float):
    with pytest.raises(InputError, match=field):
        dataclasses.replace(SIZES, **{field: value})
