"""Forces are the derivative of the energy and the stiffness that of the forces, on every element at large strain."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fingerslip.errors import InputError, InvertedCellError
from fingerslip.fe.forms import stiffness_matrix
from unit.fe.finite.bodies import EVERY, KINDS, LAWS, SOFT, STIFF, body, moved
from unit.fe.finite.relaxing import RELAXING, relaxing_body, stepped
from unit.fe.finite.relaxing import STEP as TIME_STEP

STEP = 1e-6


@EVERY
@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_force_is_the_derivative_of_the_energy(element, integration, formulation, law):
    bulk = body(element, integration, formulation, law=law, beside=SOFT, depth=0.3)
    at = moved(bulk, 0.03)
    force = bulk.force(bulk.deformed(at))
    for seed in (1, 2, 3):
        change = STEP * moved(bulk, 1.0, seed)
        ahead, back = (bulk.energy(bulk.deformed(at + sign * change)) for sign in (1, -1))
        assert (ahead - back) / 2 == pytest.approx(force @ change, abs=1e-7 * np.abs(force).max() * STEP)


@EVERY
@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_tangent_is_the_symmetric_derivative_of_the_force(element, integration, formulation, law):
    bulk = body(element, integration, formulation, law=law, beside=SOFT)
    at = moved(bulk, 0.03)
    tangent = bulk.tangent(bulk.deformed(at))
    assert np.abs(tangent - tangent.T).max() <= 1e-10 * np.abs(tangent).max()
    change = STEP * moved(bulk, 1.0, 1)
    ahead, back = (bulk.force(bulk.deformed(at + sign * change)) for sign in (1, -1))
    np.testing.assert_allclose((ahead - back) / 2 / STEP, tangent @ change / STEP, atol=1e-6 * np.abs(tangent).max())


@EVERY
@pytest.mark.parametrize("law", RELAXING, ids=lambda law: type(law).__name__)
def test_tangent_of_a_step_of_a_body_that_relaxes(element, integration, formulation, law):
    """A step has an energy of its own, so that its stiffness is symmetric."""
    bulk = relaxing_body((element, integration, formulation), law)
    begun, at = bulk.begun(stepped(bulk), TIME_STEP), moved(bulk, 0.03)
    tangent = bulk.tangent(bulk.deformed(at, begun))
    assert np.abs(tangent - tangent.T).max() <= 1e-10 * np.abs(tangent).max()
    change = STEP * moved(bulk, 1.0, 1)
    ahead, back = (bulk.force(bulk.deformed(at + sign * change, begun)) for sign in (1, -1))
    np.testing.assert_allclose((ahead - back) / 2 / STEP, tangent @ change / STEP, atol=1e-6 * np.abs(tangent).max())
    positive = bulk.tangent(bulk.deformed(at, begun), positive=True).toarray()
    assert np.linalg.eigvalsh(positive)[0] >= -1e-10 * np.abs(positive).max()


@settings(max_examples=40)
@given(
    kind=st.sampled_from([kind for kind in KINDS if kind[1] != "full"]),
    law=st.sampled_from(LAWS),
    parts=st.lists(st.floats(-0.35, 0.35), min_size=9, max_size=9),
    seed=st.integers(0, 1000),
)
def test_mean_volumes_at_random_deformation_gradients(kind, law, parts, seed):
    """On a random gradient with a ripple on it, energy, force and stiffness belong together."""
    bulk = body(*kind, law=law)
    dim = bulk.space.dim
    slope = np.reshape(parts, (3, 3))[:dim, :dim]
    at = (bulk.space.positions @ slope.T).ravel() + moved(bulk, 0.01, seed)
    try:
        state = bulk.deformed(at)
    except InvertedCellError:
        return
    force, change = bulk.force(state), STEP * moved(bulk, 1.0, seed + 1)
    ahead, back = (bulk.deformed(at + sign * change) for sign in (1, -1))
    size = max(float(np.abs(force).max()), 1e-3)
    assert (bulk.energy(ahead) - bulk.energy(back)) / 2 == pytest.approx(force @ change, abs=1e-6 * size * STEP)
    tangent = bulk.tangent(state)
    slope = (bulk.force(ahead) - bulk.force(back)) / 2 / STEP
    np.testing.assert_allclose(slope, tangent @ change / STEP, atol=1e-5 * np.abs(tangent).max())
    assert np.abs(tangent - tangent.T).max() <= 1e-9 * np.abs(tangent).max()
    positive = bulk.tangent(state, positive=True).toarray()
    assert np.linalg.eigvalsh(positive)[0] >= -1e-10 * np.abs(positive).max()


@EVERY
def test_positive_tangent_is_the_tangent_where_nothing_is_indefinite(element, integration, formulation):
    bulk = body(element, integration, formulation)
    rest = bulk.deformed(np.zeros(bulk.space.n_dofs))
    plain, positive = bulk.tangent(rest), bulk.tangent(rest, positive=True)
    np.testing.assert_allclose(positive.toarray(), plain.toarray(), atol=1e-12 * np.abs(plain).max())


def test_positive_tangent_of_a_crushed_body_is_semidefinite_where_the_tangent_is_not():
    bulk = body("Q4", law=STIFF)
    state = bulk.deformed((bulk.space.positions * [-0.1, -0.5]).ravel())
    assert np.linalg.eigvalsh(bulk.tangent(state).toarray())[0] < -1e-2
    positive = bulk.tangent(state, positive=True).toarray()
    assert np.linalg.eigvalsh(positive)[0] >= -1e-12 * np.abs(positive).max()


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


@EVERY
def test_a_turned_body_has_no_energy_and_no_forces(element, integration, formulation):
    bulk = body(element, integration, formulation)
    start, turn = bulk.space.positions, np.eye(bulk.space.dim)
    turn[:2, :2] = [[0.0, -1.0], [1.0, 0.0]]
    state = bulk.deformed((start @ turn.T - start + 3.0).ravel())
    assert bulk.energy(state) == pytest.approx(0.0, abs=1e-14)
    np.testing.assert_allclose(bulk.force(state), 0.0, atol=1e-13)


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
    # Other cells around the node may be worse; the place is that of the one that is named.
    assert node in mesh.t[:, caught.value.cell]
    np.testing.assert_allclose(caught.value.position, mesh.p[:, mesh.t[:, caught.value.cell]].mean(axis=1))


@pytest.mark.parametrize("element", ["Q4", "H8"])
def test_what_is_no_number_is_inverted(element):
    bulk = body(element, formulation="plane_strain" if element == "Q4" else "solid")
    with pytest.raises(InvertedCellError):
        bulk.deformed(np.full(bulk.space.n_dofs, np.nan))


@EVERY
def test_densities_of_energy_add_up_to_the_energy(element, integration, formulation):
    bulk = body(element, integration, formulation, law=STIFF, beside=SOFT)
    state = bulk.deformed(moved(bulk, 0.03))
    points = np.arange(bulk.weights.size)
    densities = bulk.energy_densities(state, points)
    assert densities @ bulk.weights.ravel() == pytest.approx(bulk.energy(state))
    np.testing.assert_allclose(bulk.energy_densities(state, points[3:7]), densities[3:7])


def test_the_state_near_does_not_change_the_thickness():
    bulk = body("Q4", "selective", "plane_stress")
    near = bulk.deformed(moved(bulk, 0.03))
    at = moved(bulk, 0.04, 5)
    found, plain = bulk.deformed(at, near), bulk.deformed(at)
    np.testing.assert_allclose(found.log_strain, plain.log_strain, atol=1e-9)
    np.testing.assert_allclose(found.volume, np.linalg.det(found.deformation))


def test_nodal_integration_of_other_elements_is_refused():
    with pytest.raises(InputError, match="integration"):
        body("Q4", "nodal")
