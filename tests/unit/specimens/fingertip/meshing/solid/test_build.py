"""The coarsest finger in 3D has all names; what does not fit is refused."""

from __future__ import annotations

import numpy as np
import pytest
import skfem

from fingerslip.errors import InputError
from fingerslip.specimens.fingertip.meshing.solid.build import solid_cells
from fingerslip.specimens.fingertip.meshing.solid.source import SolidSizes, build_solid
from unit.fingers import change, change_solid, coarse_solid

COARSE = {"contact_size": 0.8e-3, "bulk_size": 1.6e-3}


def test_coarse_finger_has_all_names():
    mesh = coarse_solid()
    assert type(mesh) is skfem.MeshTet1
    assert list(mesh.subdomains) == ["epidermis", "dermis", "tissue", "phalanx"]
    outside = np.concatenate([mesh.boundaries["skin"], mesh.boundaries["base"]])
    assert np.array_equal(np.sort(outside), np.sort(mesh.boundary_facets()))


def test_number_of_tetrahedra_grows_like_the_volume_over_that_of_one():
    finger = change_solid()
    coarse, fine = (solid_cells(finger, SolidSizes("T4", size, size)) for size in (1e-3, 0.5e-3))
    assert fine == pytest.approx(8 * coarse)


@pytest.mark.parametrize(
    ("fingertip", "sizes", "message"),
    [
        (change(), COARSE, "fingertip.solid: is missing"),
        (change_solid(), {"contact_size": 1e-3, "bulk_size": 0.5e-3}, "bulk_size: got 0.5 mm, needs >= 1 mm"),
        (change_solid(), {**COARSE, "element": "Q4"}, "element"),
    ],
)
def test_what_does_not_fit_is_refused(fingertip, sizes, message):
    with pytest.raises(InputError, match=message):
        build_solid(fingertip, **sizes)
