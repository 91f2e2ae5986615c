"""Stiffness, mass and loads in the plane and in space: exact on linear fields, rigid modes alone free of force."""

from __future__ import annotations

import numpy as np
import pytest
import skfem

from fingerslip.errors import InputError
from fingerslip.fe.forms import cell_constants, mass_matrix, stiffness_matrix, traction_load
from fingerslip.fe.recovery import cell_recovery, strain_energy_density, stress, von_mises
from fingerslip.fe.space import boundary_nodes, build_space, nodal_areas, vector_dofs
from fingerslip.materials.elastic import Elastic
from problems.blocks import ELEMENTS, distorted, elastic, rectangle, solve_static, stiffness_of

VARIANTS = [("Q4", "selective"), ("Q4", "full"), ("T3", "full"), ("T3", "nodal"), ("T6", "full")]
FORMULATIONS = ["plane_strain", "plane_stress"]

GRADIENT = np.array([[1.0e-2, 2.0e-3], [-3.0e-3, -4.0e-3]])
OFFSET = np.array([5.0e-3, -7.0e-3])


def linear_field(space):
    return (space.positions @ GRADIENT.T + OFFSET).ravel()


def expected_stress(material, formulation):
    """Hooke's law for the linear field, written with E and nu instead of Lame's constants."""
    modulus, ratio = material.youngs_modulus, material.poisson_ratio
    xx, yy, xy = GRADIENT[0, 0], GRADIENT[1, 1], GRADIENT[0, 1] + GRADIENT[1, 0]
    if formulation == "plane_strain":
        factor = modulus / ((1 + ratio) * (1 - 2 * ratio))
        sigma_x = factor * ((1 - ratio) * xx + ratio * yy)
        sigma_y = factor * ((1 - ratio) * yy + ratio * xx)
        sigma_z = ratio * (sigma_x + sigma_y)
    else:
        factor = modulus / (1 - ratio**2)
        sigma_x, sigma_y, sigma_z = factor * (xx + ratio * yy), factor * (yy + ratio * xx), 0.0
    return np.array([sigma_x, sigma_y, sigma_z, modulus / (2 * (1 + ratio)) * xy])


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize(("element", "integration"), VARIANTS)
@pytest.mark.parametrize("poisson_ratio", [0.0, 0.3, 0.48])
def test_patch_test_is_exact_to_rounding(element, integration, formulation, poisson_ratio):
    material = elastic(poisson_ratio=poisson_ratio)
    space, constants, stiffness = stiffness_of(distorted(element), material, formulation, integration)
    exact = linear_field(space)
    edge = np.unique(np.concatenate([boundary_nodes(space, side) for side in ("left", "right", "top", "bottom")]))
    found = solve_static(stiffness, np.zeros(space.n_dofs), vector_dofs(edge, 2).ravel(), exact)
    np.testing.assert_allclose(found, exact, atol=1e-13 * np.abs(exact).max())
    stresses = stress(cell_recovery(space, constants).strains(found), constants)
    expected = expected_stress(material, formulation)
    np.testing.assert_allclose(stresses, np.tile(expected, (len(stresses), 1)), atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize(("element", "integration"), VARIANTS)
def test_patch_test_with_tractions(element, integration, formulation):
    """The tractions of a constant stress state must bring back its displacement: checks loads and stiffness."""
    material = elastic()
    space, _, stiffness = stiffness_of(distorted(element), material, formulation, integration, depth=0.3)
    sigma_x, sigma_y, _, tau = expected_stress(material, formulation)
    sides = {"right": (sigma_x, tau), "left": (-sigma_x, -tau), "top": (tau, sigma_y), "bottom": (-tau, -sigma_y)}
    load = traction_load(space, sides, depth=0.3)
    exact = linear_field(space)
    np.testing.assert_allclose(stiffness @ exact, load, atol=1e-13 * np.abs(load).max() * 10)


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize(("element", "integration"), VARIANTS)
def test_only_rigid_body_modes_are_free_of_force(element, integration, formulation):
    space, _, stiffness = stiffness_of(distorted(element, count=3), elastic(), formulation, integration)
    dense = stiffness.toarray()
    x, y = space.positions.T
    zero, one = np.zeros_like(x), np.ones_like(x)
    for mode in ((one, zero), (zero, one), (-y, x)):
        assert np.abs(dense @ np.column_stack(mode).ravel()).max() <= 1e-12 * np.abs(dense).max()
    values = np.linalg.eigvalsh(dense)
    assert np.abs(values[:3]).max() <= 1e-12 * values[-1], "three rigid-body modes"
    assert values[3] >= 1e-4 * values[-1], "and no other mode without energy, such as hourglassing"


@pytest.mark.parametrize(("element", "integration"), VARIANTS)
def test_stiffness_is_symmetric_and_scales_with_depth(element, integration):
    mesh = distorted(element)
    _, _, one = stiffness_of(mesh, elastic(), "plane_strain", integration, depth=1.0)
    _, _, half = stiffness_of(mesh, elastic(), "plane_strain", integration, depth=0.5)
    assert abs(one - one.T).max() <= 1e-13 * abs(one).max()
    np.testing.assert_allclose(half.toarray(), 0.5 * one.toarray(), atol=1e-13 * abs(one).max())


@pytest.mark.parametrize("element", ["T3", "T6"])
def test_selective_integration_changes_quadrilaterals_only(element):
    mesh = distorted(element)
    full, selective = (stiffness_of(mesh, elastic(), "plane_strain", kind)[2] for kind in ("full", "selective"))
    assert abs(full - selective).max() == 0.0
    quads = distorted("Q4")
    full, selective = (stiffness_of(quads, elastic(), "plane_strain", kind)[2] for kind in ("full", "selective"))
    assert abs(full - selective).max() > 1e-3 * abs(full).max()


@pytest.mark.parametrize("element", ELEMENTS)
def test_mass_is_symmetric_positive_and_totals_density_times_volume(element):
    halves = {"light": lambda c: c[0] < 0.5, "heavy": lambda c: c[0] > 0.5}
    grid = np.linspace(0.0, 1.0, 5)
    space = build_space(rectangle(element, grid, 2 * grid, regions=halves))
    materials = {"light": elastic(density=500.0), "heavy": elastic(density=1500.0)}
    constants = cell_constants(space, materials, "plane_strain")
    mass = mass_matrix(space, constants, depth=0.1)
    sideways = np.tile([1.0, 0.0], len(space.positions))
    assert sideways @ mass @ sideways == pytest.approx(2.0 * 0.1 * 1000.0, rel=1e-13)
    assert sideways @ mass @ np.tile([0.0, 1.0], len(space.positions)) == 0.0
    assert abs(mass - mass.T).max() <= 1e-14 * abs(mass).max()
    assert np.linalg.eigvalsh(mass.toarray()).min() > 0.0


@pytest.mark.parametrize("element", ELEMENTS)
def test_mass_gives_the_exact_inertia_of_a_rotation(element):
    """Quadratic integrand of linear velocities: 1/2 rho (b h^3 + h b^3)/12 about the centre."""
    grid = np.linspace(0.0, 1.0, 4)
    space = build_space(rectangle(element, grid, grid))
    mass = mass_matrix(space, cell_constants(space, {"bulk": elastic(density=12.0)}, "plane_stress"), 1.0)
    x, y = (space.positions - 0.5).T
    spin = np.column_stack([-y, x]).ravel()
    assert spin @ mass @ spin == pytest.approx(12.0 * 2.0 / 12.0, rel=1e-12)


@pytest.mark.parametrize("element", ELEMENTS)
def test_traction_load_has_the_resultant_and_moment_of_the_traction(element):
    space = build_space(rectangle(element, np.linspace(0, 2, 4), np.linspace(0, 1, 3)))
    load = traction_load(space, {"right": (30.0, -20.0), "top": (0.0, 5.0)}, depth=0.5).reshape(-1, 2)
    np.testing.assert_allclose(load.sum(axis=0), [15.0, -10.0 + 5.0], rtol=1e-13)
    x, y = space.positions.T
    moment = x @ load[:, 1] - y @ load[:, 0]
    assert moment == pytest.approx(2.0 * -10.0 - 0.5 * 15.0 + 1.0 * 5.0, rel=1e-13)


def test_traction_of_the_wrong_length_is_refused():
    with pytest.raises(InputError, match=r"tractions.top: got 3 components, needs 2"):
        traction_load(build_space(distorted("Q4")), {"top": (0.0, 1.0, 0.0)}, 1.0)


def halves(first, second):
    grid = np.linspace(0.0, 1.0, 3)
    return build_space(rectangle("Q4", grid, grid, regions={"a": first, "b": second}))


LOW, HIGH = (lambda c: c[1] < 0.5), (lambda c: c[1] > 0.5)


def test_cell_constants_follow_the_regions():
    space = halves(LOW, HIGH)
    materials = {"a": elastic(1e5, 0.25, 900.0), "b": elastic(2e5, 0.0, 1100.0)}
    constants = cell_constants(space, materials, "plane_strain")
    low, high = space.mesh.subdomains["a"], space.mesh.subdomains["b"]
    np.testing.assert_allclose(constants.first_lame[low], 1e5 * 0.25 / (1.25 * 0.5))
    np.testing.assert_allclose(constants.shear_modulus[low], 4e4)
    np.testing.assert_allclose(constants.first_lame[high], 0.0)
    np.testing.assert_allclose(constants.shear_modulus[high], 1e5)
    np.testing.assert_allclose(constants.density[high], 1100.0)
    np.testing.assert_allclose(constants.out_of_plane_ratio[low], 0.25)
    stressed = cell_constants(space, materials, "plane_stress")
    np.testing.assert_allclose(stressed.first_lame[low], 1e5 * 0.25 / (1 - 0.25**2))
    np.testing.assert_allclose(stressed.out_of_plane_ratio, 0.0)


def test_a_material_without_region_is_refused():
    with pytest.raises(InputError, match=r"materials.nail: no such region in the mesh, it has: a, b"):
        cell_constants(halves(LOW, HIGH), {"nail": elastic()}, "plane_strain")


def test_a_region_without_material_is_refused():
    with pytest.raises(InputError, match="region 'b' has no material"):
        cell_constants(halves(LOW, HIGH), {"a": elastic()}, "plane_strain")


def test_cells_in_no_region_are_refused():
    space = halves(LOW, lambda c: (c[1] > 0.5) & (c[0] < 0.5))
    with pytest.raises(InputError, match="some cells are in no region"):
        cell_constants(space, {"a": elastic(), "b": elastic()}, "plane_strain")


@pytest.mark.parametrize(
    ("element", "repair"), [("Q4", "write 0.4999"), ("T3", "take Q4, T6 or integration 'nodal' because T3 locks")]
)
def test_incompressible_plane_strain_is_refused_with_a_way_out(element, repair):
    space = build_space(distorted(element))
    with pytest.raises(InputError, match=f"poisson_ratio: got 0.5, .*{repair}"):
        cell_constants(space, {"bulk": elastic(poisson_ratio=0.5)}, "plane_strain")


def test_incompressible_plane_stress_is_allowed():
    space = build_space(distorted("Q4"))
    constants = cell_constants(space, {"bulk": elastic(3.0, 0.5)}, "plane_stress")
    np.testing.assert_allclose(constants.first_lame, 2.0)
    assert stiffness_matrix(space, constants, 1.0, "selective").nnz


SOLID_VARIANTS = [("H8", "selective"), ("H8", "full"), ("T4", "full"), ("T4", "nodal"), ("T10", "full")]
SOLID_GRADIENT = np.array([[1e-3, 4e-4, -2e-4], [-3e-4, -5e-4, 6e-4], [2e-4, 1e-4, 7e-4]])
SOLID = Elastic(2e5, 0.48, 1200.0)


def cube(element, count=3):
    """Return a unit cube with inner vertices moved at random, region `bulk`, boundaries `side` and `top`."""
    kind = skfem.MeshHex1 if element == "H8" else skfem.MeshTet1
    grid = np.linspace(0.0, 1.0, count + 1)
    mesh = kind.init_tensor(grid, grid, grid)
    inside = np.all((mesh.p > 1e-9) & (mesh.p < 1 - 1e-9), axis=0)
    points = mesh.p.copy()
    points[:, inside] += np.random.default_rng(3).uniform(-0.06, 0.06, size=(3, inside.sum()))
    mesh = kind(points, mesh.t)
    mesh = skfem.MeshTet2.from_mesh(mesh) if element == "T10" else mesh
    boundaries = {"side": mesh.boundary_facets(), "top": mesh.facets_satisfying(lambda x: x[2] > 1 - 1e-9)}
    return mesh.with_subdomains({"bulk": np.arange(mesh.nelements)}).with_boundaries(boundaries)


def assembled_cube(element, integration):
    space = build_space(cube(element))
    constants = cell_constants(space, {"bulk": SOLID}, "solid")
    return space, constants, stiffness_matrix(space, constants, 1.0, integration)


@pytest.mark.parametrize(("element", "integration"), SOLID_VARIANTS)
def test_patch_test_in_space_is_exact_to_rounding(element, integration):
    space, constants, stiffness = assembled_cube(element, integration)
    assert space.element == element
    exact = (space.positions @ SOLID_GRADIENT.T).ravel()
    edge = vector_dofs(boundary_nodes(space, "side"), 3).ravel()
    found = solve_static(stiffness, np.zeros(space.n_dofs), edge, exact)
    np.testing.assert_allclose(found, exact, atol=1e-12 * np.abs(exact).max())
    strain = 0.5 * (SOLID_GRADIENT + SOLID_GRADIENT.T)
    ratio, modulus = SOLID.poisson_ratio, SOLID.youngs_modulus
    tensor = modulus / (1 + ratio) * (strain + ratio / (1 - 2 * ratio) * np.trace(strain) * np.eye(3))
    expected = tensor[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    strains = cell_recovery(space, constants).strains(found)
    stresses = stress(strains, constants)
    np.testing.assert_allclose(stresses, np.tile(expected, (len(stresses), 1)), atol=1e-9 * np.abs(expected).max())
    density = strain_energy_density(strains, constants)
    np.testing.assert_allclose(density, 0.5 * np.sum(tensor * strain), rtol=1e-9)
    assert 0.5 * found @ stiffness @ found == pytest.approx(density[0], rel=1e-9)
    deviator = tensor - np.trace(tensor) / 3 * np.eye(3)
    np.testing.assert_allclose(von_mises(stresses), np.sqrt(1.5 * np.sum(deviator**2)), rtol=1e-9)


@pytest.mark.parametrize(("element", "integration"), SOLID_VARIANTS)
def test_only_the_six_rigid_body_modes_are_free_of_force(element, integration):
    _, _, stiffness = assembled_cube(element, integration)
    values = np.linalg.eigvalsh(stiffness.toarray())
    assert np.abs(values[:6]).max() < 1e-10 * values[-1]
    assert values[6] > 1e-6 * values[-1]


@pytest.mark.parametrize("element", ["H8", "T4", "T10"])
def test_mass_areas_and_loads_are_those_of_the_cube(element):
    space = build_space(cube(element))
    constants = cell_constants(space, {"bulk": SOLID}, "solid")
    mass = mass_matrix(space, constants, 1.0)
    assert mass.sum() == pytest.approx(3 * SOLID.density, rel=1e-12)
    areas = nodal_areas(space, "top", 1.0)
    assert areas.sum() == pytest.approx(1.0, rel=1e-12)
    assert areas @ space.positions[:, 0] == pytest.approx(0.5, rel=1e-12)
    load = traction_load(space, {"top": (1.0, 2.0, -3.0)}, 1.0).reshape(-1, 3)
    np.testing.assert_allclose(load.sum(axis=0), [1.0, 2.0, -3.0], rtol=1e-12)


def test_formulation_has_to_fit_the_dimension():
    with pytest.raises(InputError, match="got plane_strain for a mesh in 3 dimensions, needs solid"):
        cell_constants(build_space(cube("T4")), {"bulk": SOLID}, "plane_strain")


def test_nodal_integration_is_for_linear_simplices():
    with pytest.raises(InputError, match="got 'nodal' for H8, needs linear triangles or tetrahedra"):
        assembled_cube("H8", "nodal")
