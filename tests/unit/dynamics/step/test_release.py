"""Forces that a step must not count: what is dropped, what it leaves, and the energy of impacts with friction."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.step.release import LEAVES, TURNS, Release, drop, fade, fading_forces, find_changes
from fingerslip.dynamics.system.scheme import Static, hht
from fingerslip.verification.meshes import box
from problems.pushed import push_and_slide
from problems.verification.reference import condensed_states, make_stepper

ALPHAS = [0.0, -0.05, -0.2, -1 / 3, -0.5]


def one(*values):
    return np.array([values], dtype=float)


def impulse(scheme, start, end):
    return (1.0 - scheme.end_share) * start + scheme.end_share * end


@pytest.mark.parametrize("alpha", ALPHAS)
def test_a_node_that_leaves_gets_no_impulse_in_this_step_nor_in_later_ones(alpha):
    scheme = hht(1e-3, alpha)
    earlier, old = one(3.0, -1.0), one(2.0, 0.5)
    start = (1.0 + alpha) * old - alpha * earlier
    release, force = drop(scheme, (earlier, old), None, np.array([LEAVES]), one(1.0, 0.0))
    end = -alpha * old + force
    np.testing.assert_allclose(impulse(scheme, start, end), 0.0, atol=1e-15)
    np.testing.assert_allclose(release.correction, end + alpha * old, atol=1e-15)
    for _ in range(3):
        fading = fading_forces(scheme, release)
        np.testing.assert_allclose(impulse(scheme, release.fading, fading), 0.0, atol=1e-15)
        if (release := fade(scheme, release)) is None:
            break


@pytest.mark.parametrize("alpha", ALPHAS)
def test_turning_drops_the_tangential_part_alone(alpha):
    scheme, normal = hht(1e-3, alpha), one(0.6, 0.8)
    tangent = one(0.8, -0.6)
    _, force = drop(scheme, (one(0.0, 0.0), 5.0 * normal + 2.0 * tangent), None, np.array([TURNS]), normal)
    _, all_of_it = drop(scheme, (one(0.0, 0.0), 2.0 * tangent), None, np.array([LEAVES]), normal)
    np.testing.assert_allclose(force, all_of_it, atol=1e-15)


def test_nodes_without_a_mark_keep_their_forces():
    forces = np.array([[2.0, 1.0], [2.0, 1.0]])
    release, force = drop(hht(1e-3, -0.1), (forces, forces), None, np.array([0, LEAVES]), np.array([[1.0, 0.0]] * 2))
    assert not force[0].any()
    assert force[1].all()
    assert not release.correction[0].any()


def test_what_has_been_dropped_is_not_dropped_again():
    """A node that left a step ago lands and leaves at once: its old force is neither in q_0 nor in the history."""
    scheme, normal = hht(1e-3, -0.2), one(1.0, 0.0)
    left, _ = drop(scheme, (one(1.0, 0.0), one(2.0, 0.0)), None, np.array([LEAVES]), normal)
    again, force = drop(scheme, (one(2.0, 0.0), one(0.0, 0.0)), left, np.array([LEAVES]), normal)
    np.testing.assert_allclose(force, 0.0, atol=1e-15)
    np.testing.assert_allclose(again.fading, fading_forces(scheme, left), atol=1e-15)


def test_a_release_is_over_when_it_has_faded_beside_what_was_dropped():
    assert fade(hht(1e-3, -0.1), Release(one(1e-20, 0.0), one(0.0, 0.0), 1.0)) is None
    assert fade(hht(1e-3, -0.1), Release(one(1e-20, 0.0), one(0.0, 0.0), 1e-8)) is not None
    assert fade(hht(1e-3, -0.5), Release(one(1.0, 0.0), one(0.0, 0.0), 1.0)) is None


def test_marks():
    """One row a case: leaves; lands; slips against its friction; friction turns; sticks as it turns; was open."""
    start = np.array([[1.0, 0.5], [0.0, 0.0], [1.0, -0.5], [1.0, 0.5], [1.0, 0.5], [0.0, 0.0]])
    end = np.array([[0.0, 0.0], [1.0, 0.5], [1.0, -0.5], [0.5, -0.25], [0.5, -0.2], [0.0, 0.0]])
    moved = np.array([[0.1, 0.0], [-1.0, 2.0], [0.0, 3.0], [0.0, 3.0], [0.0, 0.7], [0.0, 1.0]])
    marks = find_changes((start, end), (np.zeros((6, 2)), moved), np.ones(6), np.full(6, 0.5))
    assert marks.tolist() == [LEAVES, 0, 0, TURNS, 0, 0]


def test_schemes_without_inertia_drop_nothing():
    model = push_and_slide(time=fs.QuasiStatic(5e-3), programme=(fs.Press(0.4e-3, 4e-3), fs.Lift(0.6e-3, 6e-3)))
    assert Static(1.0).end_share == 1.0
    assert all(state.release is None for state in condensed_states(make_stepper(model), model))


def test_a_lift_drops_forces_and_forgets_them():
    model = push_and_slide(alpha=-0.3, programme=(fs.Press(0.4e-3, 4e-3), fs.Lift(0.6e-3, 6e-3), fs.Hold(0.3)))
    states = list(condensed_states(make_stepper(model), model))
    assert any(state.release is not None for state in states)
    assert states[-1].release is None


def thrown(dim, alpha, ratio, friction):
    """Return the history of a soft block that is thrown obliquely at a rough plate, in steps of half a wave's time."""
    size, modulus, density = 1e-3, 1e6, 1000.0
    sides = [np.linspace(0.0, 4 * size, 5)] * dim
    up, speed = (0.0,) * (dim - 1) + (1.0,), (0.5,) + (0.0,) * (dim - 2) + (-1.0,)
    penalty = ratio * modulus / size
    contact = fs.Contact(
        "bottom",
        fs.Plane(up, -2e-4),
        fs.Coulomb(friction),
        normal_penalty=penalty,
        tangential_penalty=penalty,
        search_distance=1.0,
    )
    step = 0.5 * size * (density / modulus) ** 0.5
    return fs.simulate(
        fs.Model(
            mesh=box("Q4" if dim == 2 else "H8", *sides),
            materials={"bulk": fs.Elastic(modulus, 0.3, density)},
            formulation="plane_strain" if dim == 2 else "solid",
            contacts=(contact,),
            initial_velocity=speed,
            time=fs.TimeStepping(step, alpha, 100 * step),
        )
    )


# In 3D with one penalty and the larger friction; the others are in the slow tier.
@pytest.mark.parametrize(
    ("alpha", "ratio", "friction", "dim"),
    [
        pytest.param(*case, marks=[pytest.mark.slow] * (case[3] == 3 and case[1:3] != (100.0, 1.0)))
        for case in itertools.product([0.0, -0.05, -0.41421], [1.0, 100.0, 1e4], [0.3, 1.0], [2, 3])
    ],
)
def test_rough_impacts_make_no_energy(alpha, ratio, friction, dim):
    """Without dropping, that of 10 by 10 cells grew eightfold (alpha = 0), twofold (-0.05) and by 1 % (-0.41421)."""
    history = thrown(dim, alpha, ratio, friction)
    energy = sum(history[name].values for name in ("kinetic_energy", "strain_energy", "contact_energy"))
    assert energy.max() <= (1.0 + 1e-6) * energy[0]
    assert np.abs(history.energy_imbalance.values).max() <= 1e-11 * energy[0]
    assert energy[-1] > 0.5 * energy[0]
