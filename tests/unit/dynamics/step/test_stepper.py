"""What stays the same: the compliance of a step, alone and of several systems together, and the stopwatch."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.step import condensation
from fingerslip.dynamics.step import stepper as stepper_module
from fingerslip.dynamics.step.stepper import Stopwatch, build_steppers
from fingerslip.dynamics.system.system import build_system
from fingerslip.linear.solvers.superlu import SuperLU
from problems.matrices import needs_mkl
from problems.pushed import push_and_slide


def test_the_stopwatch_adds_up_also_when_the_work_fails(monkeypatch):
    moments = iter([1.0, 3.0, 10.0, 10.5])
    monkeypatch.setattr(stepper_module.clock, "perf_counter", lambda: next(moments))
    watch = Stopwatch()
    with watch.part("work"):
        pass
    with pytest.raises(ZeroDivisionError), watch.part("work"):
        raise ZeroDivisionError
    assert watch.seconds == {"work": 2.5}


def test_compliance_of_a_step_is_that_of_the_scheme_and_the_penalties():
    """W = (1 + a) beta h^2 B A^-1 B' + 1/k with A = M + (1 + a) beta h^2 K, written with dense matrices."""
    contact = fs.Contact("bottom", friction=fs.Coulomb(0.4), normal_penalty=1e8, tangential_penalty=2e7)
    model = push_and_slide(contacts=(contact,), alpha=-0.1)
    system = build_system(model)
    stepper = build_steppers([system], model.time, model.damping)[0]
    factor = 0.9 * (1.1**2 / 4) * 5e-3**2
    local = system.relative.toarray().reshape(-1, 2, len(system.free))[:, ::-1].reshape(-1, len(system.free))
    body = factor * local @ np.linalg.solve((system.mass + factor * system.stiffness).toarray(), local.T)
    penalties = np.column_stack([1e8 * system.candidates.area, 2e7 * system.candidates.area]).ravel()
    np.testing.assert_allclose(
        stepper.compliance.matrix, body + np.diag(1 / penalties), rtol=1e-9, atol=1e-12 * body.max()
    )


def test_systems_with_other_candidates_share_a_matrix():
    """The shallower motion has fewer candidates: its compliance is the part of the deeper one's among them."""
    deep = push_and_slide()
    shallow = dataclasses.replace(deep, programme=(fs.Press(1e-4, 4e-3),))
    one = build_system(shallow)
    systems = [one, build_system(deep, one)]
    assert systems[0].candidates.nodes.size < systems[1].candidates.nodes.size
    together = build_steppers(systems, deep.time, deep.damping)
    for system, stepper in zip(systems, together, strict=True):
        alone = build_steppers([system], deep.time, deep.damping)[0]
        np.testing.assert_allclose(stepper.compliance.matrix, alone.compliance.matrix, rtol=1e-10, atol=1e-20)
        np.testing.assert_array_equal(alone.rows, np.arange(alone.rows.size))
    assert together[0].condensed is together[1].condensed


def test_friction_that_turns_no_frames_shares_one_compliance():
    systems = [build_system(push_and_slide(friction=value)) for value in (0.2, 0.8)]
    one, other = build_steppers(systems, push_and_slide().time, fs.RayleighDamping())
    assert one.compliance is other.compliance


@needs_mkl
def test_the_next_step_corrects_what_factors_of_single_precision_miss(monkeypatch):
    monkeypatch.setattr(condensation, "_COLUMNS_UP_TO", 0)
    found, exact = (fs.simulate(push_and_slide(), solver=solver) for solver in (None, SuperLU()))
    assert found.attrs["condensation"].endswith("single precision")
    assert not exact.attrs["condensation"].endswith("single precision")
    for name, share in {"contact_displacement": 1e-6, "contact_acceleration": 1e-3, "counterface_force": 1e-5}.items():
        expected = exact[name].values
        np.testing.assert_allclose(found[name].values, expected, atol=share * np.abs(expected).max(), err_msg=name)
    largest = float(exact["external_work"].max())
    assert float(np.abs(found["energy_imbalance"]).max()) <= 1e-6 * largest


@needs_mkl
def test_steps_without_inertia_have_exact_factors(monkeypatch):
    monkeypatch.setattr(condensation, "_COLUMNS_UP_TO", 0)
    history = fs.simulate(push_and_slide(time=fs.QuasiStatic(5e-3)))
    assert not history.attrs["condensation"].endswith("single precision")
