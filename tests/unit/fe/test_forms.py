"""Matrices of small strain: the material of every cell, stiffness, mass, loads, and viscoelastic layers."""

from dataclasses import dataclass
from typing import get_args

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.fe.cell_materials import cell_materials, finite_cell_materials
from fingerslip.fe.forms import mass_matrix, stiffness_matrix, traction_load, viscoelastic_layers
from fingerslip.fe.integration import Integration, check_integration, is_mean_of_cell
from fingerslip.fe.recovery import cell_recovery, von_mises
from fingerslip.fe.space import build_space, vector_dofs
from fingerslip.materials.material import SHEARS
from fingerslip.verification.meshes import SIDES, box, components, dimension, formulation_of
from problems.blocks import EVERY_ELEMENT, KINDS, distorted, elastic, side_nodes, solve_static, stiffness_of


def halves(first, second, element="Q4", count=2):
    grid = np.linspace(0.0, 1.0, count + 1)
    return build_space(box(element, *[grid] * dimension(element), regions={"a": first, "b": second}))


LOW, HIGH = (lambda c: c[1] < 0.5), (lambda c: c[1] > 0.5)


BOTH = {"a": elastic(), "b": elastic()}
CORNER = (LOW, lambda c: (c[1] > 0.5) & (c[0] < 0.5))
SOLID = fs.Elastic(2e5, 0.48, 1200.0)


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
def test_materials_and_tractions_that_do_not_fit_the_mesh_are_refused(space, materials, formulation, message):
    if isinstance(space, str):
        space, materials = build_space(distorted(space, 2)), {"bulk": materials}
    with pytest.raises(fs.InputError, match=message):
        cell_materials(space, materials, formulation)
    with pytest.raises(fs.InputError, match=rf"tractions.top: got 4 components, needs {space.dim}"):
        traction_load(space, {"top": (0.0,) * 4}, 1.0)


def test_all_layers_whose_laws_are_of_small_strain_are_named_at_large_strain():
    with pytest.raises(fs.InputError, match=r"(?s)materials.a: got Elastic.*materials.b: got Elastic"):
        finite_cell_materials(halves(LOW, HIGH), {"a": elastic(), "b": elastic()}, "plane_strain")


@pytest.mark.parametrize("element", EVERY_ELEMENT)
@pytest.mark.parametrize("integration", get_args(Integration))
def test_selective_and_nodal_integration_are_for_their_elements(element, integration):
    assert is_mean_of_cell(element, integration) == (integration == "selective" and element in ("Q4", "H8"))
    if integration == "nodal" and element not in ("T3", "T4"):
        with pytest.raises(fs.InputError, match=f"integration: got 'nodal' for {element}, .*; write 'selective'"):
            check_integration(element, integration)
        with pytest.raises(fs.InputError, match=f"got 'nodal' for {element}, needs linear triangles or tetrahedra"):
            stiffness_of(distorted(element, 2), elastic(), formulation_of(element), "nodal")
    else:
        check_integration(element, integration)
        in_2d = dimension(element) == 2
        law = elastic(3.0, 0.5 if in_2d else 0.4999)
        assert stiffness_of(distorted(element, 1), law, "plane_stress" if in_2d else "solid", integration)[2].nnz


GRADIENTS = {
    2: np.array([[1.0e-2, 2.0e-3], [-3.0e-3, -4.0e-3]]),
    3: np.array([[1e-3, 4e-4, -2e-4], [-3e-4, -5e-4, 6e-4], [2e-4, 1e-4, 7e-4]]),
}
EVERY = pytest.mark.parametrize(("element", "integration", "formulation"), KINDS)


def linear_field(space):
    return (space.positions @ GRADIENTS[space.dim].T + np.array([5e-3, -7e-3, 2e-3])[: space.dim]).ravel()


def hooke(law, dim, formulation):
    """Return strain and stress (3, 3) of the linear field by Hooke's law, written with E and nu."""
    strain, ratio = np.zeros((3, 3)), law.poisson_ratio
    strain[:dim, :dim] = 0.5 * (GRADIENTS[dim] + GRADIENTS[dim].T)
    if formulation == "plane_stress":
        strain[2, 2] = -ratio / (1 - ratio) * np.trace(strain)
    return strain, law.youngs_modulus / (1 + ratio) * (strain + ratio / (1 - 2 * ratio) * np.trace(strain) * np.eye(3))


@EVERY
@pytest.mark.parametrize("poisson_ratio", [0.0, 0.3, 0.48])
def test_patch_test_is_exact_to_rounding(element, integration, formulation, poisson_ratio):
    """Displacement, stress, energy and the tractions of a constant state, all of which come back."""
    law, depth = elastic(poisson_ratio=poisson_ratio), 0.3 if dimension(element) == 2 else 1.0
    space, materials, stiffness = stiffness_of(distorted(element, 3), law, formulation, integration, depth)
    exact, dim = linear_field(space), space.dim
    moved = solve_static(stiffness, np.zeros(space.n_dofs), vector_dofs(side_nodes(space), dim).ravel(), exact)
    displacement_error, stress_error = (1e-13, 1e-11) if dim == 2 else (1e-12, 1e-9)
    np.testing.assert_allclose(moved, exact, atol=displacement_error * np.abs(exact).max())
    strain, stress = hooke(law, dim, formulation)
    recovery = cell_recovery(space, materials)
    strains = recovery.strains(moved)
    expected = np.array([*np.diag(stress), *(stress[pair] for pair in SHEARS[dim])])
    stresses = recovery.stresses(strains)
    largest = np.abs(expected).max()
    np.testing.assert_allclose(stresses, np.tile(expected, (len(stresses), 1)), atol=stress_error * largest)
    density = recovery.energy_densities(strains)
    np.testing.assert_allclose(density, 0.5 * np.sum(stress * strain), rtol=1e-9)
    assert 0.5 * moved @ stiffness @ moved == pytest.approx(depth * density[0], rel=1e-9)
    deviator = stress - np.trace(stress) / 3 * np.eye(3)
    np.testing.assert_allclose(von_mises(stresses), np.sqrt(1.5 * np.sum(deviator**2)), rtol=1e-9)
    pulled = {
        side: tuple(sign * stress[:dim, axis])
        for axis, sides in enumerate(SIDES[dim])
        for side, sign in zip(sides, (-1.0, 1.0), strict=True)
    }
    load = traction_load(space, pulled, depth)
    np.testing.assert_allclose(stiffness @ exact, load, atol=1e-12 * np.abs(load).max())


@EVERY
def test_only_rigid_body_modes_are_free_of_force(element, integration, formulation):
    """And no other mode is without energy, such as hourglassing."""
    space, _, stiffness = stiffness_of(distorted(element, 3), elastic(poisson_ratio=0.48), formulation, integration)
    values, count = np.linalg.eigvalsh(stiffness.toarray()), 3 if space.dim == 2 else 6
    assert np.abs(values[:count]).max() <= 1e-12 * values[-1]
    assert values[count] >= (1e-4 if space.dim == 2 else 1e-6) * values[-1]


@pytest.mark.parametrize("element", EVERY_ELEMENT)
def test_mass_is_that_of_the_body_and_of_its_rotation(element):
    """The inertia of two light and heavy halves, and that of a rotation: 1/12 rho (b h^3 + h b^3)."""
    grid, dim = np.linspace(0.0, 1.0, 3), dimension(element)
    regions = {"light": lambda c: c[0] < 0.5, "heavy": lambda c: c[0] > 0.5}
    space = build_space(box(element, grid, grid, 2 * grid, regions=regions))
    laws = {"light": elastic(density=500.0), "heavy": elastic(density=1500.0)}
    mass = mass_matrix(space, cell_materials(space, laws, formulation_of(element)), depth=0.1)
    sideways, up = (np.tile(np.eye(dim)[axis], len(space.positions)) for axis in (0, -1))
    volume = 2.0 * 0.1
    assert sideways @ mass @ sideways == pytest.approx(volume * 1000.0, rel=1e-13)
    assert sideways @ mass @ up == 0.0
    assert abs(mass - mass.T).max() <= 1e-14 * abs(mass).max()
    assert np.linalg.eigvalsh(mass.toarray()).min() > 0.0
    whole = mass_matrix(
        space, cell_materials(space, dict.fromkeys(laws, elastic(density=12.0)), formulation_of(element)), 1.0
    )
    spin = np.zeros_like(space.positions)
    spin[:, 0], spin[:, -1] = 1.0 - space.positions[:, -1], space.positions[:, 0] - 0.5
    assert spin.ravel() @ whole @ spin.ravel() == pytest.approx(12.0 * (2.0 + 8.0) / 12.0, rel=1e-12)


@pytest.mark.parametrize("element", EVERY_ELEMENT)
def test_traction_load_has_the_resultant_and_moment_of_the_traction(element):
    space = build_space(box(element, np.linspace(0, 2, 4), np.linspace(0, 1, 3), np.linspace(0, 1, 3)))
    pulled = {"right": components(element, 30.0, 4.0, -20.0), "top": components(element, 0.0, 0.0, 5.0)}
    depth = 0.5 if space.dim == 2 else 1.0
    load = traction_load(space, pulled, depth).reshape(-1, space.dim)
    resultant = np.array(components(element, 30.0, 4.0, -20.0 + 2.0 * 5.0))
    np.testing.assert_allclose(load.sum(axis=0), depth * resultant, rtol=1e-13)
    x, up = space.positions[:, 0], space.positions[:, -1]
    moment = x @ load[:, -1] - up @ load[:, 0]
    assert moment == pytest.approx(depth * (2.0 * -20.0 - 0.5 * 30.0 + 1.0 * 10.0), rel=1e-13)


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


@pytest.mark.parametrize(("element", "integration", "formulation"), [kind for kind in KINDS if "stress" not in kind[2]])
def test_any_law_that_answers_the_protocol_passes_the_patch_test(element, integration, formulation):
    law = Fibred()
    space, materials, stiffness = stiffness_of(distorted(element, 3), law, formulation, integration)
    exact = linear_field(space)
    moved = solve_static(stiffness, np.zeros(space.n_dofs), vector_dofs(side_nodes(space), space.dim).ravel(), exact)
    np.testing.assert_allclose(moved, exact, atol=1e-11 * np.abs(exact).max())
    recovery = cell_recovery(space, materials)
    strains = recovery.strains(moved)
    in_plane = [0, 1, 3] if space.dim == 2 else slice(None)
    np.testing.assert_allclose(recovery.stresses(strains)[:, in_plane], law.stress(strains, formulation), rtol=1e-12)
    assert 0.5 * moved @ stiffness @ moved == pytest.approx(law.energy(strains, formulation)[0], rel=1e-10)


def test_every_material_is_assembled_on_its_own_cells_some_cells_at_a_time(monkeypatch):
    """The stiffness of two regions is the sum of those of either alone, with the other next to nothing."""
    space = halves(LOW, HIGH, count=4)
    soft, stiff, nothing = elastic(1e4, 0.48), elastic(1e7, 0.3), elastic(1e-9, 0.0)

    def assembled(low, high):
        materials = cell_materials(space, {"b": high, "a": low}, "plane_strain")
        return stiffness_matrix(space, materials, 1.0, "selective")

    both = assembled(soft, stiff)
    apart = assembled(soft, nothing) + assembled(nothing, stiff)
    assert abs(both - apart).max() <= 1e-12 * abs(both).max()
    assert abs(both - assembled(stiff, soft)).max() > 0.1 * abs(both).max()
    whole = stiffness_of(distorted("Q4", 5), elastic())[2]
    monkeypatch.setattr("fingerslip.fe.forms._CHUNK", 4)
    assert abs(stiffness_of(distorted("Q4", 5), elastic())[2] - whole).max() <= 1e-14 * abs(whole).max()


SOME, OTHER = (fs.PronyTerm(0.3, 0.1),), (fs.PronyTerm(0.3, 0.2),)
LAW = fs.Elastic(34e3, 0.45, 1000.0, prony=SOME)


def layers_of(element, first, second, formulation, integration="selective"):
    """Return space, materials and viscoelastic layers of two halves."""
    space = halves(lambda c: c[0] < 0.5, lambda c: c[0] > 0.5, element)
    materials = cell_materials(space, {"a": first, "b": second}, formulation)
    return space, materials, viscoelastic_layers(space, materials, 1.0, integration)


@pytest.mark.parametrize(
    ("element", "integration"),
    [("Q4", "selective"), ("T3", "nodal"), ("T6", "selective"), ("H8", "selective"), ("T4", "nodal")],
)
def test_stiffness_less_a_share_of_the_shape_is_that_of_relaxed_moduli(element, integration):
    """The law with 0.7 of its shear modulus left and the same bulk modulus."""
    formulation, other = formulation_of(element), fs.Elastic(1e5, 0.3, 1000.0)
    space, materials, (layers,) = layers_of(element, LAW, other, formulation, integration)
    assert (layers.prony, layers.thickness, layers.across) == (SOME, None, None)
    bulk, shear = LAW.youngs_modulus / (3 * (1 - 2 * LAW.poisson_ratio)), 0.7 * LAW.shear_modulus
    young = 9 * bulk * shear / (3 * bulk + shear)
    slow = cell_materials(space, {"a": fs.Elastic(young, young / (2 * shear) - 1, 1.0), "b": other}, formulation)
    expected = stiffness_matrix(space, slow, 1.0, integration)
    relaxed = stiffness_matrix(space, materials, 1.0, integration) - 0.3 * layers.shape
    np.testing.assert_allclose(relaxed.toarray(), expected.toarray(), atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("integration", ["selective", "full"])
def test_in_plane_stress_both_parts_make_the_elastic_stiffness(integration):
    space, materials, (layers,) = layers_of("Q4", LAW, LAW, "plane_stress", integration)
    expected = stiffness_matrix(space, materials, 1.0, integration)
    both = layers.shape + layers.across.along * layers.thickness
    np.testing.assert_allclose(both.toarray(), expected.toarray(), atol=1e-9 * np.abs(expected).max())


def test_layers_know_their_materials_and_take_maps():
    space, _, (layers,) = layers_of("Q4", LAW, LAW, "plane_stress")
    assert layers.belongs_to(LAW)
    assert not layers.belongs_to(fs.Elastic(34e3, 0.3, 1000.0, prony=SOME))
    assert not layers.belongs_to(fs.Elastic(34e3, 0.45, 1000.0, prony=OTHER))
    rows = layers.apply_map(lambda matrix: matrix[:2])
    assert rows.shape.shape == rows.thickness.shape == (2, space.n_dofs)
