"""Named groups of a mesh, and the answer to a name that it does not have."""

from __future__ import annotations

import numpy as np
import pytest
import skfem

from fingerslip.errors import MeshError
from fingerslip.mesh import require_boundary, require_region


@pytest.fixture
def finger() -> skfem.MeshQuad1:
    mesh = skfem.MeshQuad1().refined(2)
    return mesh.with_boundaries({"skin": lambda x: x[1] == 0.0, "base": lambda x: x[0] == 0.0}).with_subdomains(
        {"dermis": lambda x: x[1] < 0.5, "tissue": lambda x: x[1] > 0.5}
    )


def test_groups_are_the_facets_and_cells_of_the_mesh(finger: skfem.MeshQuad1) -> None:
    facets = require_boundary(finger, "skin", "study")
    assert np.all(finger.p[1, finger.facets[:, facets]] == 0.0)
    assert len(facets) == 4
    cells = require_region(finger, "dermis", "study")
    assert np.all(finger.p[1, finger.t[:, cells]] <= 0.5)
    assert len(cells) == 8


def test_a_name_that_is_not_there_is_answered_with_the_others_and_the_nearest(finger: skfem.MeshQuad1) -> None:
    with pytest.raises(MeshError) as caught:
        require_boundary(finger, "skim", "study")
    assert str(caught.value) == "study: boundary 'skim' is not in the mesh, it has: skin, base; did you mean 'skin'?"
    with pytest.raises(MeshError) as caught:
        require_region(finger, "nail", "study")
    assert str(caught.value) == "study: region 'nail' is not in the mesh, it has: dermis, tissue"


def test_a_boundary_is_no_region(finger: skfem.MeshQuad1) -> None:
    with pytest.raises(MeshError, match="region 'skin' is not in the mesh"):
        require_region(finger, "skin", "study")


def test_a_mesh_without_groups_says_so() -> None:
    for require, kind in ((require_boundary, "boundary"), (require_region, "region")):
        with pytest.raises(MeshError, match=f"{kind} 'nail' is not in the mesh, it has: none"):
            require(skfem.MeshQuad1(), "nail", "study")
