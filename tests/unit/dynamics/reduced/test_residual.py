"""The residual of the full equations says how far a reduced motion is from that on the mesh."""

from __future__ import annotations

import dataclasses
from itertools import pairwise

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.reduced.reduction import reduced_system
from fingerslip.dynamics.reduced.residual import ResidualCheck, missing_displacements, steps_remembered
from fingerslip.dynamics.step.stepper import build_steppers
from fingerslip.dynamics.system.scheme import make_scheme
from fingerslip.verification.reference import condensed_states
from problems.reduced import deep_push_and_slide, difference
from unit.dynamics.reduced.test_reduction import parts


def states(model, count):
    """Return the system on the mesh, the reduced one, and its states."""
    system, body, basis = parts(model, count)
    reduced = reduced_system(system, body, basis)
    (stepper,) = build_steppers([reduced], model.time, model.damping)
    return system, reduced, list(condensed_states(stepper, model))


def missing(model, count):
    system, reduced, found = states(model, count)
    scheme = make_scheme(model.time)
    pairs = list(pairwise(found))
    known = missing_displacements([system] * len(pairs), reduced.coordinates, scheme, model.damping, pairs)
    return list(zip(*known, strict=True))


@pytest.mark.parametrize("damping", [fs.RayleighDamping(), fs.RayleighDamping(mass=5.0, stiffness=1e-3)])
@pytest.mark.parametrize("count", [5, 20])
def test_what_is_missing_is_what_the_mesh_adds(damping, count):
    model = deep_push_and_slide(damping=damping)
    estimated = max(float(np.abs(one).max()) for _, one in missing(model, count))
    full = fs.simulate(dataclasses.replace(model, record=fs.Recording(snapshots_every=5e-3)))
    _, reduced, found = states(model, count)
    moved = np.array([reduced.coordinates.on_mesh(state.displacement) for state in found])
    error = np.abs(moved - full.snapshot_displacement.values.reshape(moved.shape)).max()
    assert 0.3 * error < estimated < 10.0 * error


def test_quasi_static_motions_miss_nothing():
    model = deep_push_and_slide(time=fs.QuasiStatic(5e-3), gravity=(0.0, -3.0))
    for displacement, one in missing(model, 3):
        assert np.abs(one).max() <= 1e-9 * np.abs(displacement).max() + 1e-18


def test_steps_are_looked_at_regularly_and_where_the_motion_is_fastest():
    model = deep_push_and_slide()
    system, reduced, found = states(model, 20)
    check = ResidualCheck([model], [system], [reduced.coordinates], len(found) - 1)
    speeds = [float(np.sqrt(state.acceleration @ state.inertia)) for state in found[1:]]
    for before, after in pairwise(found):
        check([0], [before], [after])
    check.finish()
    assert 16 <= check.count < len(found) - 1
    regular = ResidualCheck([model], [system], [reduced.coordinates], 1)
    fastest = int(np.argmax(speeds))
    regular([0], [found[fastest]], [found[fastest + 1]])
    regular.finish()
    assert 0.2 * check.error < regular.error
    assert 0.0 < check.error < 1e-2


def test_steps_that_are_looked_at_together_are_judged_as_alone():
    model = deep_push_and_slide()
    system, reduced, found = states(model, 12)
    together, alone = (ResidualCheck([model], [system], [reduced.coordinates], len(found) - 1) for _ in range(2))
    for before, after in pairwise(found):
        together([0], [before], [after])
        alone([0], [before], [after])
        alone.finish()
    together.finish()
    assert together.count == alone.count
    assert together.error == pytest.approx(alone.error, rel=1e-9)
    assert together.acceleration_error == pytest.approx(alone.acceleration_error, rel=1e-9)


def test_a_motion_that_does_not_move_has_no_error():
    model = deep_push_and_slide()
    system, reduced, found = states(model, 3)
    check = ResidualCheck([model], [system], [reduced.coordinates], 1)
    check([0], [found[0]], [found[0]])
    check.finish()
    assert (check.count, check.error) == (1, 0.0)


def test_the_estimate_of_a_history_is_near_its_error():
    model = deep_push_and_slide()
    reduced = fs.simulate(dataclasses.replace(model, basis=fs.ReducedBasis(0.5, 0.99)))
    error = difference(reduced, fs.simulate(model), "snapshot_displacement")
    assert 0.2 * error < reduced.attrs["basis_error"] < 20.0 * error


def test_the_error_of_accelerations_is_as_estimated_where_the_scheme_damps():
    model = deep_push_and_slide(alpha=-0.3)
    reduced = fs.simulate(dataclasses.replace(model, basis=fs.ReducedBasis(0.5, 0.99)))
    full = fs.simulate(model)
    size = np.linalg.norm
    inside, at_contact = (
        size((reduced[name] - full[name]).values) / size(full[name].values)
        for name in ("acceleration", "contact_acceleration")
    )
    assert 0.1 * inside < reduced.attrs["basis_acceleration_error"] < 10.0 * inside
    # The interface is part of the basis.
    assert at_contact < reduced.attrs["basis_acceleration_error"]


def test_little_damping_counts_what_is_missed_in_more_steps():
    found = []
    for alpha in (-0.3, -0.05, 0.0):
        model = deep_push_and_slide(alpha=alpha)
        system, reduced, states_of = states(model, 40)
        check = ResidualCheck([model], [system], [reduced.coordinates], 44)
        check([0], [states_of[9]], [states_of[10]])
        found.append(check._remembered)
    assert found == pytest.approx([(1 + 0.3) / 0.6, (1 + 0.05) / 0.1, 44.0], rel=0.1)


def test_a_scheme_without_inertia_remembers_one_step():
    assert steps_remembered(make_scheme(fs.QuasiStatic(1e-3)), fs.RayleighDamping(), 1e3) == pytest.approx(1.0)


def test_material_damping_makes_steps_forgotten():
    scheme = make_scheme(fs.TimeStepping(1e-3, 0.0))
    free, damped = (steps_remembered(scheme, fs.RayleighDamping(stiffness=part), 1e2) for part in (0.0, 1e-2))
    assert free > 1e6 * damped
