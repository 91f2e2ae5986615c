"""Motions with steps that control their own error."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.contact.friction import Coulomb
from fingerslip.dynamics.adaptive import march
from fingerslip.errors import ConvergenceError
from fingerslip.materials.prony import PronyTerm
from problems.pushed import push_and_slide
from unit.dynamics.oscillator import STATIC, oscillator

SITE = (fs.Site("inside", "", (0.0, 1e-3)),)
TERMS = (PronyTerm(0.3, 4e-3), PronyTerm(0.3, 0.07))
# A material that relaxes and a damper, so that steps matter.
RELAXING = {"materials": {"bulk": fs.Elastic(34e3, 0.4, 1000.0, prony=TERMS)}, "sites": SITE}
LARGE = {"materials": {"bulk": fs.NeoHookean(34e3, 0.4, 1000.0)}, "kinematics": "finite", "sites": SITE}
SOFTER = {**LARGE, "materials": {"bulk": fs.NeoHookean(34e3, 0.4, 1000.0, prony=TERMS)}}
# No step has so small an error: all are the shortest ones.
NEVER = 1e-15


def timed(scheme, step):
    return fs.QuasiStatic(step) if scheme == "quasi_static" else fs.TimeStepping(step)


@pytest.mark.parametrize("changes", [{"sites": SITE}, RELAXING], ids=["elastic", "relaxing"])
@pytest.mark.parametrize("scheme", ["quasi_static", "hht_alpha"])
def test_shortest_steps_are_those_of_a_fixed_step(scheme, changes):
    """Every second state is recorded; forces of supports and stresses know of the steps between."""
    step, damping = 2.5e-3, fs.RayleighDamping(0.0, 1e-3)
    fixed = fs.simulate(push_and_slide(time=timed(scheme, step), damping=damping, **changes))
    time = fs.Adaptive(2 * step, NEVER, scheme, smallest=step)
    found = fs.simulate(push_and_slide(time=time, damping=damping, **changes))
    assert found.attrs["steps_taken"] == fixed.sizes["time"] - 1
    assert found.attrs["shortest_step"] == found.attrs["longest_step"] == pytest.approx(step)
    assert found.attrs["steps_above_tolerance"] > 0
    for name in fixed.data_vars:
        if name in {"contact_iterations", "contact_residual", "energy_imbalance"} or "time" not in fixed[name].dims:
            continue
        wanted = fixed[name].values[::2]
        scale = np.abs(wanted).max(initial=0.0)
        np.testing.assert_allclose(found[name].values, wanted, atol=1e-7 * scale + 1e-300, err_msg=name)


BODIES = {"elastic": {}, "relaxing": RELAXING, "large": LARGE, "both": SOFTER}
# Each scheme with each of the bodies at small strain that it can make a difference to.
FAST = (("quasi_static", "relaxing"), ("hht_alpha", "elastic"))


@pytest.mark.parametrize(
    ("scheme", "changes"),
    [
        pytest.param(scheme, body, id=f"{scheme}-{name}", marks=[pytest.mark.slow] * ((scheme, name) not in FAST))
        for scheme in ("quasi_static", "hht_alpha")
        for name, body in BODIES.items()
    ],
)
def test_a_press_and_slide_is_that_of_fine_steps(scheme, changes):
    fine = fs.simulate(push_and_slide(time=timed(scheme, 0.25e-3), **changes))
    found = fs.simulate(push_and_slide(time=fs.Adaptive(10e-3, 1e-3, scheme), **changes))
    at = np.rint(found["time"].values / 0.25e-3).astype(int)
    assert fine["time"].values[at] == pytest.approx(found["time"].values)
    for name in ("counterface_force", "contact_displacement"):
        wanted = fine[name].values[at]
        assert np.abs(found[name].values - wanted).max() <= 0.01 * np.abs(wanted).max(), name
    assert np.abs(found["energy_imbalance"]).max() <= 1e-7 * found["external_work"].max()
    assert found.attrs["steps_taken"] < fine.sizes["time"]


def creep(tolerance, **changes):
    time = fs.Adaptive(**({"output": 0.02, "scheme": "quasi_static", "smallest": 1e-5, "end": 60.0} | changes))
    time = dataclasses.replace(time, tolerance=tolerance, records_per_decade=10)
    model = dataclasses.replace(oscillator(1.0, 0.0, 1.0), damping=fs.RayleighDamping(0.0, 0.5), time=time)
    return fs.simulate(model)


def test_creep_follows_the_tolerance_with_few_steps():
    errors, steps = [], []
    for tolerance in (1e-2, 1e-3):
        history = creep(tolerance)
        exact = -STATIC * np.expm1(-history["time"].values / 0.5)
        errors.append(np.abs(history["displacement"].values[:, 0, 0] - exact).max() / STATIC)
        steps.append(history.attrs["steps_taken"])
        assert history.attrs["steps_above_tolerance"] == 0
        assert errors[-1] < tolerance
    assert 4 < errors[0] / errors[1] < 25
    assert steps[1] < 60.0 / 0.5 * 100, "not a hundred steps for each retardation time"


def test_phases_begin_with_the_shortest_step(monkeypatch):
    taken = []
    original = march._Walk._take_step

    def spied(self, state, at, size):
        taken.append((state.time, size * self._tick))
        return original(self, state, at, size)

    monkeypatch.setattr(march._Walk, "_take_step", spied)
    fs.simulate(push_and_slide(time=fs.Adaptive(5e-3, 1e-2, smallest=0.625e-3)))
    for knot in (0.0, 0.1, 0.12):
        lengths = [length for time, length in taken if time == pytest.approx(knot, abs=1e-9)]
        assert lengths
        assert lengths == pytest.approx([0.625e-3] * len(lengths))
    assert max(length for _, length in taken) > 1e-3


def test_steps_are_no_longer_than_the_largest():
    history = creep(1e-2, largest=0.5)
    assert history.attrs["longest_step"] <= 0.5
    assert creep(1e-2).attrs["longest_step"] > 0.5


def test_friction_knows_the_rate_of_slip_whatever_the_steps_were():
    """In a slide the plate is twice and half as fast as it is, where a slip is over the length of another step."""
    rates, times = [], []

    class Watched(Coulomb):
        def coefficients(self, conditions):
            rates.append(float(np.max(conditions.slip_rate, initial=0.0)))
            times.append(conditions.time)
            return super().coefficients(conditions)

    contact = fs.Contact(boundary="bottom", friction=Watched(0.05))
    time = fs.Adaptive(20e-3, 1e-3, "quasi_static", smallest=0.3e-3)
    history = fs.simulate(push_and_slide(contacts=(contact,), time=time))
    assert history.attrs["longest_step"] > 4 * history.attrs["shortest_step"]
    late = np.array(rates)[np.array(times) > 0.18]
    assert late == pytest.approx(np.full(late.size, 8e-3), rel=0.05)


def test_a_step_that_is_not_solved_is_halved(monkeypatch):
    refused = []
    original = march._Walk._take_step

    def fails(self, state, at, size):
        if state.time > 0.05 and size * self._tick > 1e-3:
            refused.append(size)
            raise ConvergenceError(state.time, 0, 1.0, 1e-10, "try again")
        return original(self, state, at, size)

    monkeypatch.setattr(march._Walk, "_take_step", fails)
    history = fs.simulate(push_and_slide(time=fs.Adaptive(5e-3, 0.5)))
    assert refused
    assert history.attrs["steps_rejected"] >= len(refused)
    assert np.isfinite(history["counterface_force"].values).all()


def test_what_the_shortest_step_does_not_solve_is_refused(monkeypatch):
    def fails(self, state, at, size):
        raise ConvergenceError(state.time, 7, 1.0, 1e-10, "try softer contact")

    monkeypatch.setattr(march._Walk, "_take_step", fails)
    with pytest.raises(ConvergenceError, match="node 7"):
        fs.simulate(push_and_slide(time=fs.Adaptive(5e-3)))


def test_models_that_are_simulated_together_are_computed_one_by_one():
    time = fs.Adaptive(5e-3, 1e-3)
    models = [push_and_slide(friction=friction, time=time) for friction in (0.2, 0.6)]
    for model, history in zip(models, fs.simulate_together(models), strict=True):
        alone = fs.simulate(model)
        assert history.attrs["steps_taken"] == alone.attrs["steps_taken"]
        np.testing.assert_array_equal(history["counterface_force"], alone["counterface_force"])
    with pytest.raises(fs.InputError, match=r"models\.1\.time"):
        fs.simulate_together([models[0], push_and_slide(time=fs.TimeStepping(5e-3))])


def test_a_reduced_basis_and_commands_need_a_fixed_step():
    time = fs.Adaptive(5e-3)
    with pytest.raises(fs.InputError, match=r"basis: .* fixed length"):
        push_and_slide(time=time, basis=fs.ReducedBasis())
    with pytest.raises(fs.InputError, match="time: controls its own steps"):
        fs.Simulation(push_and_slide(time=time))


def test_relaxation_times_that_no_step_can_follow_are_refused():
    with pytest.raises(fs.InputError, match=r"materials\.bulk\.prony\.0\.time: got 0\.004 s for a step of 0\.01 s"):
        fs.simulate(push_and_slide(time=fs.Adaptive(20e-3, smallest=10e-3), **RELAXING))
    fs.simulate(push_and_slide(time=fs.Adaptive(20e-3, 0.1, smallest=2.5e-3), **RELAXING))
