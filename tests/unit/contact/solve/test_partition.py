"""Contact in 2D by partitions: what the compiled solver finds, with an inverse that serves over steps."""

import numpy as np
import pytest

from fingerslip.contact.solve import partition as module
from fingerslip.contact.solve.compliance import Compliance
from fingerslip.contact.solve.forces import solve_contact
from fingerslip.contact.solve.newton import solve_friction
from fingerslip.contact.solve.partition import first_partition, solve_in_partitions
from problems.contact import TOLERANCE, pressed_row


def to_and_fro():
    return np.concatenate([np.linspace(0.0, 0.5, 60), np.linspace(0.5, -0.5, 120)])


@pytest.mark.parametrize("most_updates", [0, module._MOST_UPDATES])
@pytest.mark.parametrize("wear", [0.0, 1e-3, 0.3], ids=lambda wear: f"friction falls by {wear:g} a step")
def test_paths_are_those_of_the_compiled_solver(most_updates, wear):
    """Pulled to and fro, nodes stick and slip, and slopes change: forces and iterations are those of the other one."""
    compliance, penalty, free, friction = pressed_row(40, 0.0)
    forces, exact, counts = np.zeros((40, 2)), np.zeros((40, 2)), np.zeros(2)
    partition = first_partition(compliance, penalty)
    for step, slide in enumerate(to_and_fro()):
        rows = free + np.array([0.0, slide]), friction * np.exp(-wear * (step % 10))
        other = solve_friction(compliance, *rows, exact, 1e-12)
        partition.updates[0] = max(partition.updates[0], module._MOST_UPDATES - most_updates)
        solution, partition = solve_in_partitions(partition, penalty, *rows, forces, 1e-12)
        np.testing.assert_allclose(solution.forces, other.forces, atol=1e-10 * np.abs(other.forces).max())
        product = compliance @ solution.forces.ravel()
        np.testing.assert_allclose(partition.product.ravel(), product, rtol=1e-10, atol=1e-13)
        np.testing.assert_allclose(
            solution.response, partition.product - penalty * solution.forces, rtol=1e-12, atol=1e-15
        )
        counts += solution.iterations, other.iterations
        forces, exact = solution.forces, other.forces
    assert counts[0] <= 1.2 * counts[1]


def solution_of(row, start=None, partition=None):
    compliance, penalty, free, friction = row
    start = np.zeros_like(free) if start is None else start
    partition = partition or first_partition(compliance, penalty)
    return solve_in_partitions(partition, penalty, free, friction, start, 1e-12)


def test_a_partition_of_another_compliance_is_not_used():
    compliance, penalty, free, friction = pressed_row(20, 0.2)
    soft, hard = (
        Compliance(factor * (compliance - np.diag(penalty.ravel())), factor * penalty) for factor in (2.0, 1.0)
    )
    first, partition = solve_contact(hard, free, friction, np.zeros_like(free), 1e-12)
    again, _ = solve_contact(soft, 2.0 * free, friction, first.forces, 1e-12, working_set=partition)
    np.testing.assert_allclose(again.forces, first.forces, rtol=1e-9, atol=1e-12)


def test_a_partition_stays_as_it_is_when_a_step_begins_with_it():
    """Two motions may go on from one state, and a restored one from where it was saved."""
    compliance, penalty, free, friction = pressed_row(40, 0.1)
    first, partition = solution_of((compliance, penalty, free, friction))

    def slid(slide):
        row = compliance, penalty, free + np.array([0.0, slide]), friction
        return solution_of(row, first.forces, partition=partition)

    copies = {name: np.copy(value) for name, value in vars(partition).items()}
    paths = [slid(slide)[0].forces for slide in (0.7, -0.7, 0.7)]
    np.testing.assert_array_equal(paths[0], paths[2])
    assert np.abs(paths[0] - paths[1]).max() > 0.0
    for name, value in copies.items():
        np.testing.assert_array_equal(getattr(partition, name), value)
    assert slid(1e-6)[1].inverse is partition.inverse


def test_the_compiled_solver_takes_over_where_no_step_helps(monkeypatch):
    monkeypatch.setattr(module, "solve_partitions", lambda *arguments: (*arguments[-4:-2], np.inf, 0, 0))
    compliance, _, free, friction = row = pressed_row(20, 0.2)
    exact, (solution, _) = solve_friction(compliance, free, friction, np.zeros_like(free), 1e-12), solution_of(row)
    np.testing.assert_array_equal(solution.forces, exact.forces)
    assert solution.iterations == exact.iterations


def test_a_residual_that_is_no_number_is_not_below_the_tolerance():
    compliance, penalty, free, friction = pressed_row(5, 0.2)
    free[2, 0] = np.nan
    assert not solution_of((compliance, penalty, free, friction))[0].residual <= TOLERANCE
