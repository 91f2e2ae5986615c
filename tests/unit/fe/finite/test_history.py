"""What bodies that relax remember, what a step finds of it, and what their springs store."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fingerslip.fe.finite import history_kernels as kernels
from fingerslip.fe.finite.history import PACKED, end_history, selective_excess, spring_excess
from fingerslip.materials.prony import PronyTerm, recurrence
from fingerslip.materials.relaxing import Constants, shape_energy
from problems.verification.large_relaxation import relaxed_law
from unit.fe.finite.bodies import KINDS, LAWS, RELAXING, SOFT, STEP, TERMS, body, moved, relaxing_body, stepped


def test_an_elastic_body_has_no_history():
    bulk = body("Q4", law=SOFT)
    assert bulk.relaxation is None
    state = bulk.at_rest(STEP)
    assert (state.left, state.history) == (None, None)
    assert bulk.begun(state, STEP) is state
    assert bulk.ended(state) is state


@pytest.mark.parametrize("kind", KINDS, ids="-".join)
def test_dashpots_follow_what_is_remembered(kind):
    """All that is remembered obeys the recurrence of its material; the elastic half has no dashpots."""
    bulk = relaxing_body(kind)
    states = [stepped(bulk, steps) for steps in (1, 2, 3)]
    follow = recurrence(TERMS, STEP)
    near = bulk.relaxation.points == 0
    values = np.stack([np.zeros_like(states[0].history.points), *(state.history.points for state in states)])
    np.testing.assert_allclose(
        states[-1].history.point_dashpots[:, near], follow.follow(values[:, near])[:, -1], atol=1e-12
    )
    assert not states[-1].history.point_dashpots[:, ~near].any()
    own = bulk.relaxation.groups == 0
    means = np.stack([np.zeros_like(states[0].history.groups), *(state.history.groups for state in states)])
    np.testing.assert_allclose(states[-1].history.group_dashpots[:, own], follow.follow(means[:, own])[:, -1])


@pytest.mark.parametrize("kind", KINDS, ids="-".join)
def test_sizes_and_what_a_step_finds_at_rest(kind):
    bulk = relaxing_body(kind)
    rest, dim = bulk.at_rest(STEP), bulk.space.dim
    assert rest.history.points.shape == (bulk.weights.size, PACKED[dim] + 3)
    assert rest.history.point_dashpots.shape[0] == len(TERMS)
    assert rest.left.terms.taken_share == pytest.approx(
        [recurrence(TERMS, STEP).shares @ recurrence(TERMS, STEP).end, 0.0]
    )
    for left in (rest.left.points, rest.left.groups, rest.left.offsets, rest.left.group_offsets, rest.pulled):
        assert not left.any()
    assert rest.left.moduli[1] == pytest.approx(0.0, abs=1e-12)


def test_halved_steps_have_their_own_weights_and_the_state_keeps_its_history():
    bulk = relaxing_body(("H8", "selective", "solid"))
    state = stepped(bulk)
    whole, half = bulk.begun(state, STEP), bulk.begun(state, STEP / 2)
    assert half.left.terms.taken_share[0] < whole.left.terms.taken_share[0]
    assert whole.history is half.history is state.history
    ended = bulk.ended(bulk.deformed(moved(bulk, 0.02), whole))
    assert ended.history is not state.history
    np.testing.assert_array_equal(state.history.points, stepped(bulk).history.points)


def test_two_halves_are_nearly_a_step():
    """Strain is linear within a step: with the middle on the line, halves differ by what the law is nonlinear."""
    bulk = relaxing_body(("Q4", "full", "plane_strain"))
    start, at = bulk.at_rest(STEP), moved(bulk, 1e-4)
    whole = bulk.ended(bulk.deformed(at, bulk.begun(start, STEP)))
    middle = bulk.ended(bulk.deformed(at / 2, bulk.begun(start, STEP / 2)))
    halves = bulk.ended(bulk.deformed(at, bulk.begun(middle, STEP / 2)))
    scale = np.abs(bulk.force(whole)).max()
    np.testing.assert_allclose(bulk.force(halves), bulk.force(whole), atol=1e-3 * scale)


def test_selective_excess_is_none_at_once_and_the_relaxed_energy_in_the_end():
    """In 3D K x^2/2 - G/3 x^2 with what is left of G; in plane stress with the strain across eliminated."""
    constants = Constants(2.0, 10.0, 0.4, TERMS)
    along = np.array([[0.1, 0.0], [-0.2, 0.0]])
    modulus, left = 10.0 - 4.0 / 3.0, 1.0 - sum(term.share for term in TERMS)
    nothing = [np.zeros_like(along)] * len(TERMS)
    np.testing.assert_allclose(selective_excess(constants, modulus, along, nothing), 0.0, atol=1e-15)
    relaxed = selective_excess(constants, modulus, along, [along] * len(TERMS))
    np.testing.assert_allclose(relaxed, (1.0 - left) * 2.0 / 3.0 * along[:, 0] ** 2)


EVERY_KIND = pytest.mark.parametrize("kind", KINDS, ids="-".join)

EVERY_LAW = pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)


def strained_for(bulk, at, step, steps):
    """Return a body that is at a displacement for some steps."""
    state = bulk.at_rest(step)
    for _ in range(steps):
        state = bulk.ended(bulk.deformed(at, bulk.begun(state, step)))
    return state


@EVERY_KIND
@EVERY_LAW
def test_energy_force_and_stiffness_at_once_are_those_of_the_law(kind, law):
    bulk, elastic = (body(*kind, law=own) for own in (replace(law, prony=(PronyTerm(0.6, 1e12),)), law))
    at = moved(bulk, 0.03)
    state, wanted = strained_for(bulk, at, STEP, 1), elastic.deformed(at)
    assert bulk.energy(state) == pytest.approx(elastic.energy(wanted), rel=1e-9)
    np.testing.assert_allclose(bulk.force(state), elastic.force(wanted), atol=1e-9)
    difference = np.abs(bulk.tangent(state) - elastic.tangent(wanted)).max()
    assert difference <= 1e-9 * np.abs(elastic.tangent(wanted)).max()


@EVERY_KIND
@EVERY_LAW
def test_energy_and_force_in_the_end_are_those_of_the_relaxed_law(kind, law):
    """But for what the neo-Hookean law stores in the shape where only the volume changes."""
    relaxing, rest = replace(law, prony=(PronyTerm(0.6, 0.02),)), relaxed_law(law, 0.6)
    bulk, elastic = (body(*kind, law=own) for own in (relaxing, rest))
    at = moved(bulk, 0.03)
    state, wanted = strained_for(bulk, at, 0.04, 25), elastic.deformed(at)
    alone = shape_energy(law, np.tile(state.log_strain.mean(axis=1, keepdims=True), 3))
    missed = 0.6 * float(np.abs(alone) @ bulk.weights.ravel())
    assert missed < 1e-2 * bulk.energy(state)
    assert bulk.energy(state) == pytest.approx(elastic.energy(wanted), abs=1e-8 * bulk.energy(state) + missed)
    np.testing.assert_allclose(
        bulk.force(state), elastic.force(wanted), atol=1e-8 * np.abs(elastic.force(wanted)).max()
    )


@EVERY_KIND
def test_held_strain_loses_energy_in_every_step(kind):
    bulk = relaxing_body(kind)
    at, state, energies = moved(bulk, 0.03), bulk.at_rest(STEP), []
    for _ in range(6):
        state = bulk.ended(bulk.deformed(at, bulk.begun(state, STEP)))
        energies.append(bulk.energy(state))
    assert (np.diff(energies) < 0.0).all()


def test_energy_densities_of_some_points_are_those_of_all():
    bulk = relaxing_body(("Q4", "selective", "plane_stress"))
    state, every = stepped(bulk), np.arange(bulk.weights.size)
    some = every[::3]
    np.testing.assert_allclose(bulk.energy_densities(state, some), bulk.energy_densities(state, every)[::3])


def test_an_elastic_layer_stores_nothing_more_and_a_step_that_was_not_begun_has_no_end():
    bulk = relaxing_body(("Q4", "selective", "plane_strain"), RELAXING[1])
    state = stepped(bulk)
    far = np.flatnonzero(bulk.relaxation.points == 1)
    assert not spring_excess(bulk.relaxation, 1, bulk.materials.materials[1], state, far).any()
    with pytest.raises(ValueError, match="was not begun"):
        end_history(bulk.relaxation, bulk.materials.materials, bulk.deformed(moved(bulk, 0.01)))


PLANE, SPACE = ((0, 0), (1, 1), (0, 1), (2, 2)), ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))

COUNT = 7


def full(packed, dim):
    """Return tensors (n, 3, 3)."""
    found = np.zeros((len(packed), 3, 3))
    for own, (i, j) in zip(packed.T, PLANE if dim == 2 else SPACE, strict=True):
        found[:, i, j] = found[:, j, i] = own
    return found


def points(dim, seed=3):
    """Return deformation gradients (n, dim, dim), logarithmic strains (n, 3) and tensors (n, k)."""
    generator = np.random.default_rng(seed)
    deformation = np.eye(dim) + generator.uniform(-0.2, 0.2, (COUNT, dim, dim))
    gradient = np.tile(np.eye(3), (COUNT, 1, 1))
    gradient[:, :dim, :dim] = deformation
    if dim == 2:
        gradient[:, 2, 2] = generator.uniform(0.8, 1.2, COUNT)
    return deformation, gradient, generator.normal(size=(COUNT, 4 if dim == 2 else 6))


def log_strains(gradient, dim):
    """Return squares of stretches (n, dim), directions (n, dim, dim) and logarithmic strains (n, 3)."""
    squared, directions = np.linalg.eigh((np.transpose(gradient, (0, 2, 1)) @ gradient)[:, :dim, :dim])
    strain = np.zeros((COUNT, 3))
    strain[:, :dim] = 0.5 * np.log(squared)
    if dim == 2:
        strain[:, 2] = np.log(gradient[:, 2, 2])
    return squared, directions, strain


@pytest.mark.parametrize("dim", [2, 3])
def test_tensors_are_pushed_forward(dim):
    deformation, gradient, packed = points(dim)
    found = np.empty_like(packed)
    kernels.push_forward(deformation, log_strains(gradient, dim)[2], packed, found)
    scale = np.linalg.det(gradient)[:, None, None] ** (-2 / 3)
    expected = scale * gradient @ full(packed, dim) @ np.transpose(gradient, (0, 2, 1))
    np.testing.assert_allclose(full(found, dim), expected, atol=1e-13)


@pytest.mark.parametrize("dim", [2, 3])
def test_stress_of_the_shape_comes_back_when_it_is_pushed_forward(dim):
    deformation, gradient, packed = points(dim)
    squared, directions, strain = log_strains(gradient, dim)
    stress, reference, current = np.random.default_rng(1).normal(size=(COUNT, 3)), np.empty_like(packed), packed.copy()
    kernels.shape_tensors(squared, directions, strain, stress, reference)
    kernels.push_forward(deformation, strain, reference, current)
    values = np.empty((COUNT, 3))
    kernels.principal_values(current, dim, values)
    expected = np.sort(stress - stress.mean(axis=1, keepdims=True), axis=1)
    np.testing.assert_allclose(np.sort(values, axis=1), expected, atol=1e-12)
    np.testing.assert_allclose(np.trace(full(current, dim), axis1=1, axis2=2), 0.0, atol=1e-12)


@pytest.mark.parametrize("dim", [2, 3])
def test_principal_values_are_those_of_the_deviators(dim):
    _, _, packed = points(dim)
    values = np.empty((COUNT, 3))
    kernels.principal_values(packed, dim, values)
    tensors = full(packed, dim)
    deviators = tensors - np.trace(tensors, axis1=1, axis2=2)[:, None, None] / 3.0 * np.eye(3)
    np.testing.assert_allclose(np.sort(values, axis=1), np.linalg.eigvalsh(deviators), atol=1e-12)
    if dim == 2:
        np.testing.assert_allclose(values[:, 2], deviators[:, 2, 2])


def test_dashpots_follow_and_leave_what_numpy_says():
    generator = np.random.default_rng(2)
    number = np.array([0, 1, 1, 0, 0, 1, 0])
    shares, decay, end, start = generator.uniform(0.0, 1.0, (4, 2, 3))
    given0, given = generator.normal(size=(2, COUNT, 5))
    dashpots0, dashpots, left = generator.normal(size=(3, COUNT, 5)), np.empty((3, COUNT, 5)), np.empty((COUNT, 5))

    def of(table):
        return table[number].T[:, :, None]

    kept = of(decay) * dashpots0 + of(start) * given0
    kernels.leave(number, shares, decay, start, given0, dashpots0, left)
    np.testing.assert_allclose(left, (of(shares) * kept).sum(axis=0))
    kernels.follow(number, decay, end, start, given0, given, dashpots0, dashpots)
    np.testing.assert_allclose(dashpots, kept + of(end) * given)
