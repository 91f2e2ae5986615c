"""Which material each cell has; models whose materials and regions do not match are refused."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.fe.cell_materials import cell_materials, small_strain_law
from fingerslip.fe.forms import stiffness_matrix
from fingerslip.fe.space import build_space
from fingerslip.materials.neo_hookean import NeoHookean
from fingerslip.verification.meshes import box
from problems.blocks import distorted, elastic


def halves(first, second):
    grid = np.linspace(0.0, 1.0, 3)
    return build_space(box("Q4", grid, grid, regions={"a": first, "b": second}))


LOW, HIGH = (lambda c: c[1] < 0.5), (lambda c: c[1] > 0.5)


def test_materials_follow_the_regions():
    space = halves(LOW, HIGH)
    soft, stiff = elastic(1e5, 0.25, 900.0), elastic(2e5, 0.0, 1100.0)
    found = cell_materials(space, {"b": stiff, "a": soft}, "plane_strain")
    low, high = space.mesh.subdomains["a"], space.mesh.subdomains["b"]
    assert {material: cells.tolist() for material, cells in found} == {soft: low.tolist(), stiff: high.tolist()}
    np.testing.assert_allclose(found.density[low], 900.0)
    np.testing.assert_allclose(found.density[high], 1100.0)


def test_laws_of_large_strain_are_taken_at_rest():
    law = NeoHookean(34e3, 0.48, 1000.0)
    found = cell_materials(halves(LOW, HIGH), {"a": law, "b": elastic()}, "plane_strain")
    assert found.materials == (law.at_rest(), elastic())
    assert small_strain_law(elastic()) == elastic()


def test_a_material_without_region_is_refused():
    with pytest.raises(InputError, match=r"materials.nail: no such region in the mesh, it has: a, b"):
        cell_materials(halves(LOW, HIGH), {"nail": elastic()}, "plane_strain")


def test_a_region_without_material_is_refused():
    with pytest.raises(InputError, match="region 'b' has no material"):
        cell_materials(halves(LOW, HIGH), {"a": elastic()}, "plane_strain")


def test_cells_in_no_region_are_refused():
    space = halves(LOW, lambda c: (c[1] > 0.5) & (c[0] < 0.5))
    with pytest.raises(InputError, match="some cells are in no region"):
        cell_materials(space, {"a": elastic(), "b": elastic()}, "plane_strain")


@pytest.mark.parametrize(
    ("element", "repair"), [("Q4", "write 0.4999"), ("T3", "take Q4, T6 or integration 'nodal' because T3 locks")]
)
def test_incompressible_plane_strain_is_refused_with_a_way_out(element, repair):
    space = build_space(distorted(element))
    with pytest.raises(InputError, match=f"poisson_ratio: got 0.5, .*{repair}"):
        cell_materials(space, {"bulk": elastic(poisson_ratio=0.5)}, "plane_strain")


def test_incompressible_plane_stress_is_allowed():
    space = build_space(distorted("Q4"))
    materials = cell_materials(space, {"bulk": elastic(3.0, 0.5)}, "plane_stress")
    assert stiffness_matrix(space, materials, 1.0, "selective").nnz


def test_regions_that_share_cells_are_refused():
    with pytest.raises(InputError, match="region 'b' shares cells with another, a cell has one material"):
        cell_materials(halves(LOW, lambda c: c[1] > 0.0), {"a": elastic(), "b": elastic()}, "plane_strain")


@pytest.mark.parametrize(
    ("element", "formulation", "needed"),
    [("T4", "plane_strain", "solid"), ("Q4", "solid", "plane_strain or plane_stress")],
)
def test_formulation_has_to_fit_the_dimension(element, formulation, needed):
    dim = 2 if element == "Q4" else 3
    with pytest.raises(InputError, match=f"got {formulation} for a mesh in {dim} dimensions, needs {needed}"):
        cell_materials(build_space(distorted(element, 2)), {"bulk": elastic()}, formulation)
