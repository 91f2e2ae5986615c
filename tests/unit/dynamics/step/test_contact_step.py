"""The contact of a step: what is not solved to the tolerance is an error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.contact.solve.forces import solve_contact
from fingerslip.contact.solve.newton import ContactSolution
from fingerslip.dynamics.step import contact_step
from fingerslip.dynamics.system.system import build_system
from problems.pushed import push_and_slide


def test_unsolved_contact_is_an_error_that_says_when_where_and_how_badly(monkeypatch):
    calls = []

    def broken(compliance, free, friction, start, tolerance, *, working_set, origin):
        calls.append(None)
        bad = 0.25 if len(calls) == 3 else 0.0
        return ContactSolution(np.zeros_like(free), bad, 7, 2), working_set

    monkeypatch.setattr(contact_step, "solve_contact", broken)
    model = push_and_slide()
    with pytest.raises(fs.ConvergenceError) as caught:
        fs.simulate(model)
    error = caught.value
    assert error.time == pytest.approx(3 * 5e-3)
    assert error.node == build_system(model).candidates.nodes[2]
    assert error.residual == 0.25
    assert f"t = 0.015 s, node {error.node}: residual 2.50e-01, needs <= 1e-10; try a smaller time step" in str(error)


def test_a_residual_that_is_no_number_is_an_error_too(monkeypatch):
    def broken(compliance, free, friction, start, tolerance, *, working_set, origin):
        return ContactSolution(np.full_like(free, np.nan), np.nan, 7, 0), working_set

    monkeypatch.setattr(contact_step, "solve_contact", broken)
    with pytest.raises(fs.ConvergenceError):
        fs.simulate(push_and_slide())


@pytest.mark.parametrize("residual", [0.99e-10, 1.01e-10])
def test_the_residual_that_the_solver_states_decides(monkeypatch, residual):
    """The solver is asked for more than what a step has to have, and the forces themselves are not looked at."""
    asked = []

    def stated(compliance, free, friction, start, tolerance, *, working_set, origin):
        asked.append(tolerance)
        solution, working_set = solve_contact(
            compliance, free, friction, start, tolerance, working_set=working_set, origin=origin
        )
        return replace(solution, residual=residual), working_set

    monkeypatch.setattr(contact_step, "solve_contact", stated)
    if residual > 1e-10:
        with pytest.raises(fs.ConvergenceError):
            fs.simulate(push_and_slide())
    else:
        assert fs.simulate(push_and_slide())["normal_traction"].values.any()
    assert set(asked) == {1e-12}
