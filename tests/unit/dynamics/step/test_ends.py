"""Ends of steps of several motions, beside their definition with dense matrices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.step.ends import ends
from fingerslip.dynamics.step.prediction import predict
from problems.pushed import push_and_slide
from problems.verification.reference import condensed_states, make_stepper


@pytest.fixture(scope="module")
def begun():
    """Return a stepper, and two motions in the middle of a press, ready for a step."""
    model = push_and_slide(damping=fs.RayleighDamping(2.0, 1e-4), tractions={"left": (3.0, 0.0)})
    stepper = make_stepper(model)
    states = [state for state, _ in zip(condensed_states(stepper, model), range(12), strict=False)]
    shifts = [np.array([[0.0, 3e-4]])] * 2
    return stepper, predict([stepper] * 2, [states[-1], states[-3]], 0.06, shifts)


@pytest.mark.parametrize("is_added", [False, True])
def test_fields_and_energies_are_those_of_the_equation_of_motion(begun, is_added):
    stepper, starts = begun
    rng = np.random.default_rng(0)
    mass, stiffness = stepper.system.mass.toarray(), stepper.system.stiffness.toarray()
    unknowns, scheme = rng.normal(size=(2, len(mass))), stepper.scheme
    prescribed, added = rng.normal(size=(2, len(mass)))
    if is_added:
        starts = [starts[0], replace(starts[1], prescribed=prescribed)]
    found = ends(stepper, starts, unknowns, [None, added if is_added else None], is_small=True)
    for number, (end, start, unknown) in enumerate(zip(found, starts, unknowns, strict=True)):
        before, has = start.before, is_added and number == 1
        displacement = start.free.displacement + scheme.displacement_factor * unknown
        velocity = start.free.velocity + scheme.velocity_factor * unknown
        acceleration = scheme.inertia_factor * unknown + (prescribed if has else 0.0)
        force = scheme.start_weight * before.unbalance - mass @ acceleration + (added if has else 0.0)
        for name, expected in (
            ("displacement", displacement),
            ("velocity", velocity),
            ("acceleration", acceleration),
            ("inertia", mass @ acceleration),
        ):
            np.testing.assert_allclose(getattr(end, name), expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())
        unbalance = force / scheme.end_weight
        np.testing.assert_allclose(end.change.unbalance[2], unbalance, atol=1e-12 * np.abs(unbalance).max())
        assert end.change.unbalance[:2] == (before.unbalance_before, before.unbalance)
        np.testing.assert_array_equal(end.change.displacement, end.displacement - before.displacement)
        np.testing.assert_array_equal(end.change.velocity, end.velocity - before.velocity)
        np.testing.assert_array_equal(end.change.inertia, end.inertia - before.inertia)
        assert end.kinetic == pytest.approx(0.5 * velocity @ mass @ velocity, rel=1e-12)
        assert end.elastic == pytest.approx(0.5 * displacement @ stiffness @ displacement, rel=1e-12)


def test_at_large_strain_the_stiffness_at_rest_stores_nothing(begun):
    stepper, starts = begun
    unknowns = np.ones((2, stepper.system.mass.shape[0]))
    assert [end.elastic for end in ends(stepper, starts, unknowns, [None, None], is_small=False)] == [0.0, 0.0]
