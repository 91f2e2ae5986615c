"""Strains, stresses and energies from displacements."""

import numpy as np
import pytest

from fingerslip.errors import MeshError
from fingerslip.fe.cell_materials import cell_materials
from fingerslip.fe.forms import stiffness_matrix
from fingerslip.fe.recovery import (
    cell_dofs,
    cell_recovery,
    divergence_operator,
    site_recovery,
    strain_operator,
    stress_components,
    von_mises,
)
from fingerslip.fe.space import build_space
from fingerslip.verification.meshes import box, jiggle
from problems.blocks import ELEMENTS, EVERY_ELEMENT, distorted, elastic, stiffness_of
from unit.fe.test_forms import GRADIENTS

LAYERS = {"soft": lambda c: c[1] < 0.5, "stiff": lambda c: c[1] > 0.5}
MATERIALS = {"soft": elastic(1e4, 0.0), "stiff": elastic(8e4, 0.0)}


def layered(element, laws=None, formulation="plane_strain"):
    """Return two layers that meet at y = 1/2, where the mesh has nodes."""
    grid = np.linspace(0.0, 1.0, 5)

    def shift(points):
        return np.where(np.isclose(points[1], 0.5), points, jiggle(0.2)(points))

    space = build_space(box(element, grid, grid, regions=LAYERS, shift=shift))
    return space, cell_materials(space, laws or MATERIALS, formulation)


def node_at(space, *position):
    return int(np.flatnonzero(np.isclose(space.positions, position).all(axis=1))[0])


@pytest.mark.parametrize("element", EVERY_ELEMENT)
def test_a_linear_field_has_its_strain_at_points_nodes_and_in_cells_and_a_rotation_has_none(element):
    space, materials, _ = stiffness_of(
        distorted(element, 2), elastic(), "plane_strain" if element in ELEMENTS else "solid"
    )
    gradient, cells = GRADIENTS[space.dim], np.array([0, 2])
    pairs = [(0, 1)] if space.dim == 2 else [(0, 1), (1, 2), (0, 2)]
    strain = np.concatenate([np.diag(gradient), [gradient[i, j] + gradient[j, i] for i, j in pairs]])
    field = (space.positions @ gradient.T).ravel()
    local = field[cell_dofs(space.full, cells)]
    strains = np.einsum("kqmn,kn->kqm", strain_operator(space.full, cells), local)
    assert strains.shape[:2] == (2, space.full.dx.shape[1])
    np.testing.assert_allclose(strains, np.broadcast_to(strain, strains.shape), atol=1e-15)
    divergence = np.sum(divergence_operator(space.full, cells) * local, axis=1)
    np.testing.assert_allclose(divergence, np.trace(gradient), atol=1e-15)
    nodes = np.arange(space.mesh.nvertices)
    turn = np.zeros_like(space.positions)
    turn[:, 0], turn[:, 1] = -space.positions[:, 1], space.positions[:, 0]
    for recovery in (cell_recovery(space, materials), site_recovery(space, materials, nodes, [None] * len(nodes))):
        strains = recovery.strains(field)
        np.testing.assert_allclose(strains, np.tile(strain, (len(strains), 1)), atol=1e-15)
        np.testing.assert_allclose(recovery.strains(turn.ravel()), 0.0, atol=1e-13)


@pytest.mark.parametrize("element", ["Q4", "T6"])
def test_cells_are_recovered_at_their_centres(element):
    """The strain xx of the field x^2 is 2 x: exact at the centre of a quadratic or rectangular cell."""
    grid = np.linspace(0.0, 1.0, 4)
    space, materials, _ = stiffness_of(box(element, grid, grid), elastic())
    x = space.positions[:, 0]
    strains = cell_recovery(space, materials).strains(np.column_stack([x**2, 0.0 * x]).ravel())
    centres = space.mesh.p[0, space.mesh.t[: 4 if element == "Q4" else 3]].mean(axis=0)
    np.testing.assert_allclose(strains[:, 0], 2.0 * centres, atol=1e-13)


@pytest.mark.parametrize("formulation", ["plane_strain", "plane_stress"])
def test_energy_is_half_stress_times_strain_and_tensors_follow_by_hookes_law(formulation):
    space, materials, _ = stiffness_of(distorted("Q4"), elastic(), formulation)
    recovery = cell_recovery(space, materials)
    strains = recovery.strains((space.positions @ GRADIENTS[2].T).ravel())
    stresses, (law,) = recovery.stresses(strains), materials.materials
    energies = 0.5 * np.sum(stresses[:, [0, 1, 3]] * strains, axis=1)
    np.testing.assert_allclose(recovery.energy_densities(strains), energies, rtol=1e-12)
    expected = (1.0 + law.poisson_ratio) / law.youngs_modulus * stresses
    expected[:, :3] -= law.poisson_ratio / law.youngs_modulus * stresses[:, :3].sum(axis=1, keepdims=True)
    np.testing.assert_allclose(recovery.tensors(strains), expected, atol=1e-15)


@pytest.mark.parametrize("element", ELEMENTS)
def test_each_side_of_a_layer_interface_has_its_own_stress(element):
    """Uniaxial tension through two layers: the stress is one, strain and energy density jump by the moduli."""
    space, materials = layered(element)
    y = space.positions[:, 1]
    tension = 800.0
    lift = np.where(y < 0.5, tension / 1e4 * y, tension / 1e4 * 0.5 + tension / 8e4 * (y - 0.5))
    field, node = np.column_stack([np.zeros_like(y), lift]).ravel(), node_at(space, 0.5, 0.5)
    sides = site_recovery(space, materials, np.array([node, node]), ["soft", "stiff"])
    np.testing.assert_allclose(sides.stresses(sides.strains(field))[:, 1], tension, rtol=1e-12)
    expected = 0.5 * tension**2 / np.array([1e4, 8e4])
    np.testing.assert_allclose(sides.energy_densities(sides.strains(field)), expected, rtol=1e-12)
    stiffness = stiffness_matrix(space, materials, 1.0, "selective")
    assert 0.5 * field @ stiffness @ field == pytest.approx(0.5 * expected.sum(), rel=1e-12)


def test_without_a_region_the_cells_around_are_weighted_by_area():
    space, materials = layered("Q4")
    y = space.positions[:, 1]
    field = np.column_stack([np.zeros_like(y), np.where(y < 0.5, 0.0, y - 0.5)]).ravel()
    node = node_at(space, 0.5, 0.5)
    around = np.flatnonzero((space.mesh.t == node).any(axis=0))
    areas, above = space.full.dx.sum(axis=1)[around], np.isin(around, space.mesh.subdomains["stiff"])
    strains = site_recovery(space, materials, np.array([node]), [None]).strains(field)
    assert strains[0, 1] == pytest.approx(areas[above].sum() / areas.sum(), rel=1e-12)


@pytest.mark.parametrize("formulation", ["plane_strain", "plane_stress"])
def test_without_a_region_stress_and_energy_are_the_mean_of_the_materials_in_the_mean_strain(formulation):
    grid = np.linspace(0.0, 1.0, 5)
    space = build_space(box("Q4", grid, grid, regions=LAYERS))
    materials = cell_materials(space, {"soft": elastic(1e4, 0.48), "stiff": elastic(8e4, 0.2)}, formulation)
    nodes = np.array([node_at(space, 0.5, 0.5)])
    field = np.random.default_rng(1).standard_normal(space.n_dofs)
    strains = site_recovery(space, materials, nodes, [None]).strains(field)

    def read(region):
        recovery = site_recovery(space, materials, nodes, [region])
        return np.append(recovery.stresses(strains), recovery.energy_densities(strains))

    np.testing.assert_allclose(read(None), (read("soft") + read("stiff")) / 2, rtol=1e-12)


def test_a_site_off_its_region_is_refused_no_sites_have_no_stresses_and_components_are_in_order():
    space, materials = layered("T3")
    corner = node_at(space, 0.0, 0.0)
    with pytest.raises(MeshError, match=f"site 0: no cell of region 'stiff' at node {corner}"):
        site_recovery(space, materials, np.array([corner]), ["stiff"])
    recovery = site_recovery(space, materials, np.zeros(0, dtype=np.int64), [])
    strains = recovery.strains(np.zeros(space.n_dofs))
    assert recovery.stresses(strains).shape == (0, 4)
    assert recovery.energy_densities(strains).shape == (0,)
    space = build_space(distorted("T4", 2))
    dofs = cell_dofs(space.full, np.array([5]))
    np.testing.assert_array_equal(dofs[0, ::3] // 3, space.mesh.t[:, 5])
    np.testing.assert_array_equal(dofs[0] % 3, np.tile([0, 1, 2], 4))
    assert stress_components(2) == ("xx", "yy", "zz", "xy")
    assert stress_components(3) == ("xx", "yy", "zz", "xy", "yz", "xz")


def test_several_displacements_are_read_as_one_by_one_and_the_mean_divergence_is_weighted_by_the_quadrature():
    """On a distorted quadrilateral the divergence of a bilinear field differs from point to point."""
    space, materials = layered("Q4")
    recovery = cell_recovery(space, materials)
    fields = np.random.default_rng(3).normal(size=(3, space.n_dofs))
    strains = recovery.strains(fields)
    for read in (recovery.stresses, recovery.tensors, recovery.energy_densities):
        for whole, field in zip(read(strains), fields, strict=True):
            np.testing.assert_array_equal(whole, read(recovery.strains(field)))
    stresses = recovery.stresses(strains)
    np.testing.assert_array_equal(von_mises(stresses), list(map(von_mises, stresses)))
    space = build_space(distorted("Q4", 3))
    x, y = space.positions.T
    field, cells = np.column_stack([x * y, 0.0 * x]).ravel(), np.arange(space.mesh.nelements)
    local = field[cell_dofs(space.full, cells)]
    divergence = np.einsum("kqmn,kn->kqm", strain_operator(space.full, cells), local)[:, :, :2].sum(axis=2)
    assert np.ptp(divergence, axis=1).max() > 0.1
    mean = np.sum(divergence * space.full.dx, axis=1) / space.full.dx.sum(axis=1)
    np.testing.assert_allclose(np.sum(divergence_operator(space.full, cells) * local, axis=1), mean, rtol=1e-13)
