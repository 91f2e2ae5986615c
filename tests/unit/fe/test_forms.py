"""Matrices of small strain: the material of every cell, stiffness, mass, loads, and viscoelastic layers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import get_args

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.fe.cell_materials import cell_materials, small_strain_law
from fingerslip.fe.forms import mass_matrix, stiffness_matrix, traction_load, viscoelastic_layers
from fingerslip.fe.integration import Integration, check_integration, is_mean_of_cell
from fingerslip.fe.recovery import cell_recovery, von_mises
from fingerslip.fe.space import boundary_nodes, build_space, nodal_areas, vector_dofs
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.neo_hookean import NeoHookean
from fingerslip.materials.prony import PronyTerm
from fingerslip.verification.meshes import box
from problems.blocks import ELEMENTS, distorted, elastic, solve_static, stiffness_of


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


BOTH = {"a": elastic(), "b": elastic()}
CORNER = (LOW, lambda c: (c[1] > 0.5) & (c[0] < 0.5))


@pytest.mark.parametrize(
    ("space", "materials", "formulation", "message"),
    [
        (halves(LOW, HIGH), {"nail": elastic()}, "plane_strain", r"materials.nail: no such region in the mesh, it has"),
        (halves(LOW, HIGH), {"a": elastic()}, "plane_strain", "region 'b' has no material"),
        (halves(*CORNER), BOTH, "plane_strain", "some cells are in no region"),
        (halves(LOW, lambda c: c[1] > 0.0), BOTH, "plane_strain", "region 'b' shares cells with another"),
        ("Q4", elastic(poisson_ratio=0.5), "plane_strain", "poisson_ratio: got 0.5, .*write 0.4999"),
        ("T3", elastic(poisson_ratio=0.5), "plane_strain", "take Q4, T6 or integration 'nodal' because T3 locks"),
        ("T4", elastic(), "plane_strain", "got plane_strain for a mesh in 3 dimensions, needs solid"),
        ("Q4", elastic(), "solid", "got solid for a mesh in 2 dimensions, needs plane_strain or plane_stress"),
    ],
)
def test_materials_that_do_not_fit_the_mesh_are_refused(space, materials, formulation, message):
    if isinstance(space, str):
        space, materials = build_space(distorted(space, 2)), {"bulk": materials}
    with pytest.raises(InputError, match=message):
        cell_materials(space, materials, formulation)


def test_tractions_and_integration_have_to_fit_the_element():
    with pytest.raises(InputError, match=r"tractions.top: got 3 components, needs 2"):
        traction_load(build_space(distorted("Q4")), {"top": (0.0, 1.0, 0.0)}, 1.0)
    with pytest.raises(InputError, match="got 'nodal' for H8, needs linear triangles or tetrahedra"):
        stiffness_of(distorted("H8", 2), SOLID, "solid", "nodal")


def test_incompressible_plane_stress_is_allowed():
    space = build_space(distorted("Q4"))
    materials = cell_materials(space, {"bulk": elastic(3.0, 0.5)}, "plane_stress")
    assert stiffness_matrix(space, materials, 1.0, "selective").nnz


EVERY_ELEMENT = ("Q4", "T3", "T6", "H8", "T4", "T10")


def test_selective_integration_is_for_quadrilaterals_and_hexahedra():
    assert [element for element in EVERY_ELEMENT if is_mean_of_cell(element, "selective")] == ["Q4", "H8"]
    assert not any(is_mean_of_cell(element, kind) for element in EVERY_ELEMENT for kind in ("full", "nodal"))


@pytest.mark.parametrize("element", EVERY_ELEMENT)
@pytest.mark.parametrize("integration", get_args(Integration))
def test_nodal_integration_is_for_linear_simplices(element, integration):
    if integration == "nodal" and element not in ("T3", "T4"):
        with pytest.raises(InputError, match=f"integration: got 'nodal' for {element}, .*; write 'selective'"):
            check_integration(element, integration)
    else:
        check_integration(element, integration)


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
    space, materials, stiffness = stiffness_of(distorted(element), material, formulation, integration)
    exact = linear_field(space)
    found = solve_static(stiffness, np.zeros(space.n_dofs), vector_dofs(sides(space), 2).ravel(), exact)
    np.testing.assert_allclose(found, exact, atol=1e-13 * np.abs(exact).max())
    recovery = cell_recovery(space, materials)
    stresses = recovery.stresses(recovery.strains(found))
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
    space = build_space(box(element, grid, 2 * grid, regions=halves))
    materials = {"light": elastic(density=500.0), "heavy": elastic(density=1500.0)}
    mass = mass_matrix(space, cell_materials(space, materials, "plane_strain"), depth=0.1)
    sideways = np.tile([1.0, 0.0], len(space.positions))
    assert sideways @ mass @ sideways == pytest.approx(2.0 * 0.1 * 1000.0, rel=1e-13)
    assert sideways @ mass @ np.tile([0.0, 1.0], len(space.positions)) == 0.0
    assert abs(mass - mass.T).max() <= 1e-14 * abs(mass).max()
    assert np.linalg.eigvalsh(mass.toarray()).min() > 0.0


@pytest.mark.parametrize("element", ELEMENTS)
def test_mass_gives_the_exact_inertia_of_a_rotation(element):
    """Quadratic integrand of linear velocities: 1/2 rho (b h^3 + h b^3)/12 about the centre."""
    grid = np.linspace(0.0, 1.0, 4)
    space = build_space(box(element, grid, grid))
    mass = mass_matrix(space, cell_materials(space, {"bulk": elastic(density=12.0)}, "plane_stress"), 1.0)
    x, y = (space.positions - 0.5).T
    spin = np.column_stack([-y, x]).ravel()
    assert spin @ mass @ spin == pytest.approx(12.0 * 2.0 / 12.0, rel=1e-12)


@pytest.mark.parametrize("element", ELEMENTS)
def test_traction_load_has_the_resultant_and_moment_of_the_traction(element):
    space = build_space(box(element, np.linspace(0, 2, 4), np.linspace(0, 1, 3)))
    load = traction_load(space, {"right": (30.0, -20.0), "top": (0.0, 5.0)}, depth=0.5).reshape(-1, 2)
    np.testing.assert_allclose(load.sum(axis=0), [15.0, -10.0 + 5.0], rtol=1e-13)
    x, y = space.positions.T
    moment = x @ load[:, 1] - y @ load[:, 0]
    assert moment == pytest.approx(2.0 * -10.0 - 0.5 * 15.0 + 1.0 * 5.0, rel=1e-13)


SOLID_VARIANTS = [("H8", "selective"), ("H8", "full"), ("T4", "full"), ("T4", "nodal"), ("T10", "full")]

SOLID_GRADIENT = np.array([[1e-3, 4e-4, -2e-4], [-3e-4, -5e-4, 6e-4], [2e-4, 1e-4, 7e-4]])

SOLID = Elastic(2e5, 0.48, 1200.0)


def sides(space):
    """Return the nodes on all sides."""
    return np.unique(np.concatenate([boundary_nodes(space, side) for side in space.mesh.boundaries]))


@pytest.mark.parametrize(("element", "integration"), SOLID_VARIANTS)
def test_patch_test_in_space_is_exact_to_rounding(element, integration):
    space, materials, stiffness = stiffness_of(distorted(element, 3), SOLID, "solid", integration)
    assert space.element == element
    exact = (space.positions @ SOLID_GRADIENT.T).ravel()
    found = solve_static(stiffness, np.zeros(space.n_dofs), vector_dofs(sides(space), 3).ravel(), exact)
    np.testing.assert_allclose(found, exact, atol=1e-12 * np.abs(exact).max())
    strain = 0.5 * (SOLID_GRADIENT + SOLID_GRADIENT.T)
    ratio, modulus = SOLID.poisson_ratio, SOLID.youngs_modulus
    tensor = modulus / (1 + ratio) * (strain + ratio / (1 - 2 * ratio) * np.trace(strain) * np.eye(3))
    expected = tensor[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    recovery = cell_recovery(space, materials)
    stresses = recovery.stresses(recovery.strains(found))
    np.testing.assert_allclose(stresses, np.tile(expected, (len(stresses), 1)), atol=1e-9 * np.abs(expected).max())
    density = recovery.energy_densities(recovery.strains(found))
    np.testing.assert_allclose(density, 0.5 * np.sum(tensor * strain), rtol=1e-9)
    assert 0.5 * found @ stiffness @ found == pytest.approx(density[0], rel=1e-9)
    deviator = tensor - np.trace(tensor) / 3 * np.eye(3)
    np.testing.assert_allclose(von_mises(stresses), np.sqrt(1.5 * np.sum(deviator**2)), rtol=1e-9)


@pytest.mark.parametrize(("element", "integration"), SOLID_VARIANTS)
def test_only_the_six_rigid_body_modes_are_free_of_force(element, integration):
    _, _, stiffness = stiffness_of(distorted(element, 3), SOLID, "solid", integration)
    values = np.linalg.eigvalsh(stiffness.toarray())
    assert np.abs(values[:6]).max() < 1e-10 * values[-1]
    assert values[6] > 1e-6 * values[-1]


@pytest.mark.parametrize("element", ["H8", "T4", "T10"])
def test_mass_areas_and_loads_are_those_of_the_cube(element):
    space = build_space(distorted(element, 3))
    mass = mass_matrix(space, cell_materials(space, {"bulk": SOLID}, "solid"), 1.0)
    assert mass.sum() == pytest.approx(3 * SOLID.density, rel=1e-12)
    areas = nodal_areas(space, "top", 1.0)
    assert areas.sum() == pytest.approx(1.0, rel=1e-12)
    assert areas @ space.positions[:, 0] == pytest.approx(0.5, rel=1e-12)
    load = traction_load(space, {"top": (1.0, 2.0, -3.0)}, 1.0).reshape(-1, 3)
    np.testing.assert_allclose(load.sum(axis=0), [1.0, 2.0, -3.0], rtol=1e-12)


@dataclass(frozen=True)
class Fibred:
    """A law of one's own: stiff along x, with the dilatational part of a nearly incompressible rubber."""

    along: float = 3e5
    density: float = 1000.0
    stiffness: float = 1e5

    def tangent(self, strain, formulation):
        dim = 3 if formulation == "solid" else 2
        matrix = np.diag([2e4] * dim + [1e4] * (strain.shape[1] - dim))
        matrix[:dim, :dim] += self.dilatational_modulus(formulation)
        matrix[0, 0] += self.along
        return np.broadcast_to(matrix, (len(strain), *matrix.shape))

    def stress(self, strain, formulation):
        return np.einsum("nij,nj->ni", self.tangent(strain, formulation), strain)

    def stress_across(self, strain, formulation):
        return self.dilatational_modulus(formulation) * strain[:, :2].sum(axis=1)

    def energy(self, strain, formulation):
        return 0.5 * np.sum(strain * self.stress(strain, formulation), axis=1)

    def dilatational_modulus(self, _):
        return 1e6


@pytest.mark.parametrize(("element", "integration"), VARIANTS + SOLID_VARIANTS)
def test_any_law_that_answers_the_protocol_passes_the_patch_test(element, integration):
    law, formulation = Fibred(), "plane_strain" if element in ELEMENTS else "solid"
    space, materials, stiffness = stiffness_of(distorted(element, 3), law, formulation, integration)
    gradient = GRADIENT if space.dim == 2 else SOLID_GRADIENT
    exact = (space.positions @ gradient.T).ravel()
    found = solve_static(stiffness, np.zeros(space.n_dofs), vector_dofs(sides(space), space.dim).ravel(), exact)
    np.testing.assert_allclose(found, exact, atol=1e-11 * np.abs(exact).max())
    recovery = cell_recovery(space, materials)
    strains = recovery.strains(found)
    in_plane = [0, 1, 3] if space.dim == 2 else slice(None)
    np.testing.assert_allclose(recovery.stresses(strains)[:, in_plane], law.stress(strains, formulation), rtol=1e-12)
    assert 0.5 * found @ stiffness @ found == pytest.approx(law.energy(strains, formulation)[0], rel=1e-10)


def test_every_material_is_assembled_on_its_own_cells():
    """The stiffness of two regions is the sum of those of either alone, with the other next to nothing."""
    regions = {"low": lambda c: c[1] < 0.5, "high": lambda c: c[1] > 0.5}
    grid = np.linspace(0.0, 1.0, 5)
    space = build_space(box("Q4", grid, grid, regions=regions))
    soft, stiff, nothing = elastic(1e4, 0.48), elastic(1e7, 0.3), elastic(1e-9, 0.0)

    def assembled(low, high):
        return stiffness_matrix(
            space, cell_materials(space, {"high": high, "low": low}, "plane_strain"), 1.0, "selective"
        )

    both = assembled(soft, stiff)
    parts = assembled(soft, nothing) + assembled(nothing, stiff)
    assert abs(both - parts).max() <= 1e-12 * abs(both).max()
    assert abs(both - assembled(stiff, soft)).max() > 0.1 * abs(both).max()


def test_more_cells_than_are_computed_at_once(monkeypatch):
    whole = stiffness_of(distorted("Q4", 5), elastic())[2]
    monkeypatch.setattr("fingerslip.fe.forms._CHUNK", 4)
    assert abs(stiffness_of(distorted("Q4", 5), elastic())[2] - whole).max() <= 1e-14 * abs(whole).max()


SOME, OTHER = (PronyTerm(0.3, 0.1),), (PronyTerm(0.3, 0.2),)


def space_of(element):
    grid = np.linspace(0.0, 1.0, 3)
    regions = {"a": lambda c: c[0] < 0.5, "b": lambda c: c[0] > 0.5}
    return build_space(box(element, *[grid] * (3 if element in ("H8", "T4", "T10") else 2), regions=regions))


def relaxed(law, left):
    """Return the law with a part of its shear modulus left and the same bulk modulus."""
    bulk, shear = law.youngs_modulus / (3 * (1 - 2 * law.poisson_ratio)), left * law.shear_modulus
    young = 9 * bulk * shear / (3 * bulk + shear)
    return Elastic(young, young / (2 * shear) - 1, law.density)


KINDS = [("Q4", "selective"), ("T3", "nodal"), ("T6", "selective"), ("H8", "selective"), ("T4", "nodal")]


@pytest.mark.parametrize(("element", "integration"), KINDS)
def test_stiffness_less_a_share_of_the_shape_is_that_of_relaxed_moduli(element, integration):
    space, formulation = space_of(element), "solid" if element in ("H8", "T4") else "plane_strain"
    law, elastic = Elastic(34e3, 0.45, 1000.0, prony=SOME), Elastic(1e5, 0.3, 1000.0)
    materials = cell_materials(space, {"a": law, "b": elastic}, formulation)
    (layers,) = viscoelastic_layers(space, materials, 1.0, integration)
    assert (layers.prony, layers.thickness, layers.across) == (SOME, None, None)
    slow = cell_materials(space, {"a": relaxed(law, 0.7), "b": elastic}, formulation)
    expected = stiffness_matrix(space, slow, 1.0, integration)
    found = stiffness_matrix(space, materials, 1.0, integration) - 0.3 * layers.shape
    np.testing.assert_allclose(found.toarray(), expected.toarray(), atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("integration", ["selective", "full"])
def test_in_plane_stress_both_parts_make_the_elastic_stiffness(integration):
    space, law = space_of("Q4"), Elastic(34e3, 0.45, 1000.0, prony=SOME)
    materials = cell_materials(space, {"a": law, "b": law}, "plane_stress")
    (layers,) = viscoelastic_layers(space, materials, 2.0, integration)
    expected = stiffness_matrix(space, materials, 2.0, integration)
    found = layers.shape + layers.across.along * layers.thickness
    np.testing.assert_allclose(found.toarray(), expected.toarray(), atol=1e-9 * np.abs(expected).max())


def test_layers_are_joined_where_they_relax_alike():
    space = space_of("Q4")
    soft, stiff = Elastic(1e4, 0.4, 1.0, prony=SOME), Elastic(1e5, 0.3, 1.0, prony=SOME)

    def count(a, b, formulation):
        return len(viscoelastic_layers(space, cell_materials(space, {"a": a, "b": b}, formulation), 1.0, "selective"))

    assert count(soft, stiff, "plane_strain") == 1
    assert count(soft, stiff, "plane_stress") == 2, "the strain across is another one"
    assert count(soft, Elastic(1e5, 0.3, 1.0, prony=OTHER), "plane_strain") == 2
    assert count(Elastic(1e4, 0.4, 1.0), Elastic(1e5, 0.3, 1.0), "plane_strain") == 0


def test_layers_know_their_materials_and_take_maps():
    space, law = space_of("Q4"), Elastic(34e3, 0.45, 1000.0, prony=SOME)
    materials = cell_materials(space, {"a": law, "b": law}, "plane_stress")
    (layers,) = viscoelastic_layers(space, materials, 1.0, "selective")
    assert layers.belongs_to(law)
    assert not layers.belongs_to(Elastic(34e3, 0.3, 1000.0, prony=SOME))
    assert not layers.belongs_to(Elastic(34e3, 0.45, 1000.0, prony=OTHER))
    rows = layers.apply_map(lambda matrix: matrix[:2])
    assert rows.shape.shape == rows.thickness.shape == (2, space.n_dofs)
