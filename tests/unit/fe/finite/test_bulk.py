"""A body at large strain: forces, energy and stiffness belong together, of every law, also of a user's own."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingerslip.errors import FingerslipError, InputError, InvertedCellError
from fingerslip.fe.finite.powers import laws_of_points
from fingerslip.fe.finite.thickness import Pulled, check_thickness, thickness_strain
from fingerslip.fe.finite.volumes import selective_energy
from fingerslip.fe.forms import stiffness_matrix
from fingerslip.materials.neo_hookean import NeoHookean
from problems.blocks import KINDS
from unit.fe.finite.bodies import (
    EVERY,
    EVERY_LAW,
    EVERY_PAIR,
    LAWS,
    SOFT,
    STEP,
    STIFF,
    TERMS,
    body,
    moved,
    relaxing_body,
    slopes,
    stepped,
)

SMALL = 1e-6


def assert_tangent(bulk, state_at, at, allowed=1e-6, skew=1e-10):
    """Hold that the tangent is the derivative of the force and symmetric, and its positive part semidefinite."""
    tangent = bulk.tangent(state_at(at))
    assert np.abs(tangent - tangent.T).max() <= skew * np.abs(tangent).max()
    change = SMALL * moved(bulk, 1.0, 1)
    slope = slopes(lambda u: bulk.force(state_at(u)), at, change) / SMALL
    np.testing.assert_allclose(slope, tangent @ change / SMALL, atol=allowed * np.abs(tangent).max())
    positive = bulk.tangent(state_at(at), positive=True).toarray()
    assert np.linalg.eigvalsh(positive)[0] >= -1e-10 * np.abs(positive).max()


@EVERY_PAIR
def test_force_and_tangent_are_the_derivatives_of_the_energy(element, integration, formulation, law):
    bulk = body(element, integration, formulation, law=law, beside=SOFT, depth=0.3)
    at = moved(bulk, 0.03)
    force = bulk.force(bulk.deformed(at))
    for seed in (1, 2, 3):
        change = SMALL * moved(bulk, 1.0, seed)
        slope = slopes(lambda u: bulk.energy(bulk.deformed(u)), at, change)
        assert slope == pytest.approx(force @ change, abs=1e-7 * np.abs(force).max() * SMALL)
    assert_tangent(bulk, bulk.deformed, at)


@EVERY_PAIR
def test_tangent_of_a_step_of_a_body_that_relaxes(element, integration, formulation, law):
    """A step has an energy of its own, so that its stiffness is symmetric."""
    bulk = relaxing_body((element, integration, formulation), replace(law, prony=TERMS))
    begun = bulk.begun(stepped(bulk), STEP)
    assert_tangent(bulk, lambda u: bulk.deformed(u, begun), moved(bulk, 0.03))


@pytest.mark.slow
@settings(max_examples=40)
@given(
    kind=st.sampled_from([kind for kind in KINDS if kind[1] != "full"]),
    law=st.sampled_from(LAWS),
    entries=st.lists(st.floats(-0.35, 0.35), min_size=9, max_size=9),
    seed=st.integers(0, 1000),
)
def test_mean_volumes_at_random_deformation_gradients(kind, law, entries, seed):
    """On a random gradient with a ripple on it, energy, force and stiffness belong together."""
    bulk = body(*kind, law=law)
    dim = bulk.space.dim
    at = (bulk.space.positions @ np.reshape(entries, (3, 3))[:dim, :dim].T).ravel() + moved(bulk, 0.01, seed)
    try:
        force = bulk.force(bulk.deformed(at))
    except InvertedCellError:
        return
    change = SMALL * moved(bulk, 1.0, seed + 1)
    size = max(float(np.abs(force).max()), 1e-3)
    slope = slopes(lambda u: bulk.energy(bulk.deformed(u)), at, change)
    assert slope == pytest.approx(force @ change, abs=1e-6 * size * SMALL)
    assert_tangent(bulk, bulk.deformed, at, allowed=1e-5, skew=1e-9)


@EVERY
def test_all_tangents_have_one_pattern_which_solvers_analyse_once(element, integration, formulation):
    bulk = body(element, integration, formulation, law=SOFT, beside=STIFF)
    rest, *others = (
        bulk.tangent(bulk.deformed(moved(bulk, amount)), positive=positive)
        for amount, positive in ((0.0, False), (0.03, False), (0.0, True), (0.03, True))
    )
    for each in others:
        # Sums drop zeros, as those with other matrices of a step do.
        np.testing.assert_array_equal((each + 0.0 * each).indices, (rest + 0.0 * rest).indices)


def test_positive_tangent_of_a_crushed_body_is_semidefinite_and_the_state_near_changes_no_thickness():
    bulk = body("Q4", law=STIFF)
    state = bulk.deformed((bulk.space.positions * [-0.1, -0.5]).ravel())
    assert np.linalg.eigvalsh(bulk.tangent(state).toarray())[0] < -1e-2
    positive = bulk.tangent(state, positive=True).toarray()
    assert np.linalg.eigvalsh(positive)[0] >= -1e-12 * np.abs(positive).max()
    bulk = body("Q4", "selective", "plane_stress")
    near = bulk.deformed(moved(bulk, 0.03))
    at = moved(bulk, 0.04, 5)
    np.testing.assert_allclose(bulk.deformed(at, near).log_strain, bulk.deformed(at).log_strain, atol=1e-9)


@EVERY
def test_stiffness_at_rest_is_that_of_small_strain(element, integration, formulation):
    bulk = body(element, integration, formulation, law=STIFF, beside=SOFT, depth=0.7)
    rest = bulk.deformed(np.zeros(bulk.space.n_dofs))
    assert bulk.energy(rest) == pytest.approx(0.0, abs=1e-28)
    np.testing.assert_allclose(bulk.force(rest), 0.0, atol=1e-13)
    small = type(bulk.materials)(
        tuple(law.at_rest() for law in bulk.materials.materials), bulk.materials.number, formulation
    )
    expected = stiffness_matrix(bulk.space, small, 0.7, integration).toarray()
    np.testing.assert_allclose(bulk.tangent(rest).toarray(), expected, atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize(
    "kind", [("Q4", "selective", "plane_strain"), ("H8", "selective", "solid"), ("T4", "nodal", "solid")]
)
def test_a_cell_that_is_turned_inside_out_is_named_with_its_place(kind):
    bulk = body(*kind)
    mesh, cell = bulk.space.mesh, 3
    inside = np.zeros_like(bulk.space.positions)
    node = mesh.t[0, cell]
    centre = mesh.p[:, mesh.t[:, cell]].mean(axis=1)
    inside[node] = 3.0 * (centre - bulk.space.positions[node])
    with pytest.raises(InvertedCellError, match="turned inside out") as caught:
        bulk.deformed(inside.ravel())
    with pytest.raises(InvertedCellError):
        bulk.deformed(np.full(bulk.space.n_dofs, np.nan))
    # Other cells around the node may be worse; the place is that of the one that is named.
    assert node in mesh.t[:, caught.value.cell]
    np.testing.assert_allclose(caught.value.position, mesh.p[:, mesh.t[:, caught.value.cell]].mean(axis=1))


def test_the_groups_of_quadrilaterals_are_their_cells_and_nodes_between_materials_have_one_for_each():
    """The mean of the ratios of areas is the ratio of the areas of the cell."""
    bulk = body("Q4")
    at = moved(bulk, 0.05)

    def areas(positions):
        first, second, third, fourth = np.moveaxis(positions[bulk.nodes], 1, 0)
        return np.linalg.det(np.stack([third - first, fourth - second], axis=1))

    start = bulk.space.positions
    np.testing.assert_allclose(bulk.deformed(at).mean_volume, areas(start + at.reshape(-1, 2)) / areas(start))
    one, two = body("T3", "nodal"), body("T3", "nodal", law=STIFF, beside=SOFT)
    nodes = len(one.space.positions)
    between = np.intersect1d(*(two.nodes[two.materials.number == number] for number in (0, 1))).size
    assert one.volumes.size.size == nodes + between  # two regions of one law are still two materials
    assert np.bincount(two.volumes.material).sum() == nodes + between


def test_selective_integration_does_not_lock_and_takes_no_mean_volumes_without_lateral_contraction():
    """The force that bends a nearly incompressible block does not grow with the bulk modulus."""
    forces = []
    for ratio in (0.49, 0.49999):
        bulk = body("Q4", law=NeoHookean(3.0, ratio, 1.0))
        x, y = bulk.space.positions.T
        bent = 0.05 * np.column_stack([(x - 0.5) * (y - 0.5), -0.5 * (x - 0.5) ** 2 - 0.5 * (y - 0.5) ** 2])
        forces.append(bulk.energy(bulk.deformed(bent.ravel())))
    assert forces[1] < 3.0 * forces[0]
    found = selective_energy(NeoHookean(50e3, 0.0, 1000.0), "plane_strain", np.array([-0.1, 0.0, 0.1]))
    np.testing.assert_array_equal(found, np.zeros((3, 3)))
    bulk = body("Q4", law=NeoHookean(50e3, 0.0, 1000.0))
    assert np.isfinite(bulk.deformed(moved(bulk, 0.05)).mean_volume).all()


@EVERY_LAW
@pytest.mark.parametrize("guess", [0.0, 0.4, -0.8])
def test_no_stress_is_left_across_the_plane(law, guess):
    strain = np.random.default_rng(2).uniform(-0.5, 0.5, (50, 3))
    strain[:, 2] = guess
    kept = strain.copy()
    across = thickness_strain(law, strain)
    np.testing.assert_array_equal(strain, kept)
    found = np.column_stack([strain[:, :2], across])
    np.testing.assert_allclose(law.kirchhoff_stress(found)[:, 2], 0.0, atol=1e-8)
    np.testing.assert_array_equal(thickness_strain(SOFT, np.zeros((3, 3))), 0.0)
    assert thickness_strain(law, np.zeros((0, 3))).shape == (0,)


def test_what_a_step_finds_at_its_start_pulls_across_as_well():
    generator = np.random.default_rng(4)
    pulled = Pulled(generator.uniform(-0.5, 0.5, 20), generator.uniform(-0.3, 0.3, 20))
    strain, step = generator.uniform(-0.3, 0.3, (20, 3)), 1e-6
    ahead, back = (pulled.stress(strain + sign * step * np.eye(3)[2])[0] for sign in (1, -1))
    np.testing.assert_allclose((ahead - back) / 2 / step, pulled.stress(strain)[1], atol=1e-8)
    found = np.column_stack([strain[:, :2], thickness_strain(SOFT, strain, pulled)])
    np.testing.assert_allclose(SOFT.kirchhoff_stress(found)[:, 2] + pulled.stress(found)[0], 0.0, atol=1e-8)
    scale, third = np.exp(-2.0 / 3.0 * found.sum(axis=1)), pulled.across * np.exp(2.0 * found[:, 2])
    np.testing.assert_allclose(pulled.stress(found)[0], scale * ((pulled.in_plane + third) / 3.0 - third))


class Sheet:
    """A law without stiffness across the plane, or with a stress there at rest [Pa]."""

    def __init__(self, stiffness, stress):
        self.stiffness, self.stress = stiffness, stress

    def kirchhoff_stress(self, log_strain):
        return log_strain @ np.diag([1e4, 1e4, self.stiffness]) + [0.0, 0.0, self.stress]

    def kirchhoff_tangent(self, log_strain):
        return np.tile(np.diag([1e4, 1e4, self.stiffness]), (len(log_strain), 1, 1))


class Pushing:
    """A law that always pushes across the plane."""

    def kirchhoff_stress(self, strain):
        return np.ones_like(strain)

    def kirchhoff_tangent(self, strain):
        return np.ones((len(strain), 3, 3))


@pytest.mark.parametrize(("stiffness", "stress"), [(0.0, 0.0), (-1.0, 0.0), (np.nan, np.nan), (1e4, 3.0)])
def test_laws_without_a_thickness_are_refused(stiffness, stress):
    found = rf"is {stress:g} Pa at rest and grows by {stiffness:g} Pa"
    with pytest.raises(InputError, match=rf"materials\.skin: got Sheet, .* {found}.*take plane_strain"):
        check_thickness("skin", Sheet(stiffness, stress))
    for law in (*LAWS, Sheet(1.0, 0.0)):
        check_thickness("skin", law)
    with pytest.raises(FingerslipError, match=r"Pushing: no thickness .* take plane strain"):
        thickness_strain(Pushing(), np.zeros((1, 3)))
    with pytest.raises(InputError, match="integration"):
        body("Q4", "nodal")


@dataclass(frozen=True)
class Own:
    """A law that says nothing of powers."""

    law: object

    def __getattr__(self, name):
        if name == "sum_of_powers":
            raise AttributeError(name)
        return getattr(self.law, name)


class Locking(NeoHookean):
    """A law that is derived from one of powers, with another stress beyond a strain."""

    def kirchhoff_stress(self, log_strain):
        return super().kirchhoff_stress(log_strain) + 1e6 * np.maximum(log_strain - 0.5, 0.0)


class Softer(NeoHookean):
    """Another, with another tangent."""

    def kirchhoff_tangent(self, log_strain):
        return 0.5 * super().kirchhoff_tangent(log_strain)


class Named(NeoHookean):
    """One that is derived without functions of its own."""


@EVERY_PAIR
def test_a_body_is_that_of_the_laws_of_its_materials(element, integration, formulation, law):
    pairs = (law, SOFT), (Own(law), Own(SOFT))
    bodies = [body(element, integration, formulation, law=near, beside=far) for near, far in pairs]
    at = moved(bodies[0], 0.03)
    states = [bulk.deformed(at, bulk.deformed(0.9 * at)) for bulk in bodies]
    some = np.arange(states[0].log_strain.shape[0])[1::3]
    for read in (
        lambda bulk, state: bulk.force(state),
        lambda bulk, state: bulk.energy(state),
        lambda bulk, state: bulk.tangent(state).toarray(),
        lambda bulk, state: bulk.energy_densities(state, some),
    ):
        values, expected = map(read, bodies, states)
        np.testing.assert_allclose(values, expected, rtol=0.0, atol=1e-10 * np.abs(expected).max())


def test_a_law_of_its_own_is_no_sum_of_powers():
    number = np.array([0, 1, 0])
    assert laws_of_points([SOFT, *LAWS, Named(34e3, 0.48, 1000.0)], number) is not None
    for law in (Own(SOFT), Locking(34e3, 0.48, 1000.0), Softer(34e3, 0.48, 1000.0)):
        assert laws_of_points([SOFT, law], number) is None


def test_a_thickness_that_is_not_found_is_an_error_with_the_name_of_the_law():
    bulk = body("Q4", formulation="plane_stress", law=SOFT)
    nothing = np.zeros(bulk.space.n_dofs)
    near = bulk.deformed(nothing)
    near.log_strain[:, 2] = np.nan
    with pytest.raises(FingerslipError, match="NeoHookean: no thickness"):
        bulk.deformed(nothing, near)
