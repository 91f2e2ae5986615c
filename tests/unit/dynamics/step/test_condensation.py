"""The condensed step is one substitution and gives what the full system gives."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest
from scipy import sparse

from fingerslip.dynamics.step import condensation
from fingerslip.dynamics.step.condensation import ByColumns, BySchur, condense
from fingerslip.linear.solvers.superlu import SuperLU
from problems.matrices import SOLVERS, positive_definite


def operator(count, size, seed=1):
    """Return rows with two entries each, as contact frames have."""
    rng = np.random.default_rng(seed)
    columns = rng.permutation(size)[: 2 * count].reshape(count, 2).ravel()
    rows = np.repeat(np.arange(count), 2)
    return sparse.csr_matrix((rng.normal(size=2 * count), (rows, columns)), shape=(count, size))


def solve(condensed, right_hand_side, contact):
    """Take a step with the forces that `contact` makes of the local part; return the solution and the forces."""
    halfway = condensed.forward(right_hand_side)
    forces = contact(halfway.local)
    return condensed.backward(halfway, forces), forces


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("count", [1, 7, 25])
def test_condensed_compliance_is_that_of_the_inverse(solver, count):
    matrix, local = positive_definite(60), operator(count, 60)
    exact = local @ np.linalg.solve(matrix.toarray(), local.toarray().T)
    _, compliance = condense(matrix, local, solver)
    np.testing.assert_allclose(compliance, exact, atol=1e-12 * np.abs(exact).max())
    np.testing.assert_array_equal(compliance, compliance.T)


def test_columns_beyond_one_block_are_condensed_alike():
    """More contact columns than are substituted at once, so that the blocks must be put together in order."""
    matrix, local = positive_definite(700), operator(300, 700)
    exact = local @ np.linalg.solve(matrix.toarray(), local.toarray().T)
    np.testing.assert_allclose(condense(matrix, local, SuperLU())[1], exact, atol=1e-11 * np.abs(exact).max())


@pytest.mark.parametrize("solver", SOLVERS)
def test_one_substitution_with_contact_forces_in_its_middle(solver):
    matrix, local = positive_definite(60), operator(8, 60)
    right = np.random.default_rng(4).normal(size=60)
    condensed, _ = condense(matrix, local, solver)
    halfway = condensed.forward(right)
    free = local @ np.linalg.solve(matrix.toarray(), right)
    np.testing.assert_allclose(halfway.local, free, atol=1e-12)
    forces = 3.0 * np.arange(8) - 5.0 * free
    np.testing.assert_allclose(matrix @ condensed.backward(halfway, forces), right + local.T @ forces, atol=1e-11)


@pytest.mark.parametrize("solver", SOLVERS)
def test_without_contact_it_is_a_plain_solution(solver):
    matrix, right = positive_definite(40), np.arange(40.0)
    condensed, _ = condense(matrix, sparse.csr_matrix((0, 40)), solver)
    solution, forces = solve(condensed, right, lambda free: free)
    np.testing.assert_allclose(matrix @ solution, right, atol=1e-10)
    assert forces.shape == (0,)


@dataclass(frozen=True)
class Counted:
    """A factor that counts its substitutions."""

    factor: object
    calls: list

    def forward(self, right_hand_side):
        self.calls.append("forward")
        return self.factor.forward(right_hand_side)

    def backward(self, halfway):
        self.calls.append("backward")
        return self.factor.backward(halfway)

    def transposed_backward(self, right_hand_side):
        return self.factor.transposed_backward(right_hand_side)

    @property
    def substitutions(self):
        return self.factor.substitutions

    @property
    def is_single(self):
        return self.factor.is_single


@dataclass(frozen=True)
class Counting(SuperLU):
    """A solver whose factors count their substitutions."""

    calls: list = field(default_factory=list)

    def factorise(self, matrix):
        return Counted(super().factorise(matrix), self.calls)

    def factorise_around(self, matrix, kept):
        factor, schur = super().factorise_around(matrix, kept)
        return Counted(factor, self.calls), schur


@pytest.mark.parametrize("force", [0.0, 2.0])
@pytest.mark.parametrize("largest", [0, 10**9], ids=["schur", "columns"])
def test_a_step_costs_one_substitution_with_and_without_contact_forces(force, largest, monkeypatch):
    monkeypatch.setattr(condensation, "_COLUMNS_UP_TO", largest)
    solver = Counting()
    condensed, _ = condense(positive_definite(40), operator(6, 40), solver)
    solver.calls.clear()
    solve(condensed, np.ones(40), lambda free: force + 0.0 * free)
    assert solver.calls == ["forward", "backward"]


@pytest.mark.parametrize(("force", "products"), [(0.0, 1), (2.0, 2)])
def test_the_schur_complement_costs_a_product_in_each_half_and_none_without_forces(force, products, monkeypatch):
    monkeypatch.setattr(condensation, "_COLUMNS_UP_TO", 0)
    condensed, _ = condense(positive_definite(40), operator(6, 40), SuperLU())
    made, times = [], condensation._symmetric_times
    monkeypatch.setattr(condensation, "_symmetric_times", lambda *given: made.append(None) or times(*given))
    solve(condensed, np.ones(40), lambda free: force + 0.0 * free)
    assert len(made) == products


@pytest.mark.parametrize("columns", [(), (3,)])
def test_what_contact_has_found_of_its_forces_saves_a_product(columns, monkeypatch):
    monkeypatch.setattr(condensation, "_COLUMNS_UP_TO", 0)
    matrix, local = positive_definite(60), sparse.csr_matrix(np.eye(60)[3:48:5])
    condensed, compliance = condense(matrix, local, SuperLU())
    right, forces = (np.random.default_rng(k).normal(size=(size, *columns)) for k, size in ((4, 60), (5, 9)))
    halfway = condensed.forward(right)
    exact = condensed.backward(halfway, forces)
    monkeypatch.setattr(condensation, "_symmetric_times", None)
    found = condensed.backward(halfway, forces, compliance @ forces)
    np.testing.assert_allclose(found, exact, atol=1e-13 * np.abs(exact).max())


@pytest.mark.parametrize("largest", [0, 10**9], ids=["schur", "columns"])
def test_a_forward_half_may_be_finished_with_different_forces(largest, monkeypatch):
    monkeypatch.setattr(condensation, "_COLUMNS_UP_TO", largest)
    matrix, local, right = positive_definite(60), operator(8, 60), np.arange(60.0)
    condensed, _ = condense(matrix, local, SuperLU())
    halfway = condensed.forward(right)
    for forces in (np.zeros(8), np.arange(8.0), np.ones(8)):
        np.testing.assert_allclose(matrix @ condensed.backward(halfway, forces), right + local.T @ forces, atol=1e-10)


@pytest.mark.parametrize("columns", [4, 30])
def test_sparse_and_dense_storage_give_the_same(columns, monkeypatch):
    """A banded matrix fills little along the path of one column; many columns of a dense one are stored densely."""
    matrix = sparse.diags([-1.0, 2.5, -1.0], [-1, 0, 1], shape=(60, 60), format="csr")
    local, right = operator(columns, 60), np.arange(60.0)
    found = []
    for share in (0.0, 2.0):
        monkeypatch.setattr(condensation, "_SPARSE_BELOW", share)
        condensed, _ = condense(matrix, local, SuperLU())
        assert sparse.issparse(condensed.forward_columns) == (share > 1.0)
        found.append(solve(condensed, right, lambda free: 1.0 - free)[0])
    np.testing.assert_allclose(found[0], found[1], atol=1e-12 * np.abs(found[0]).max())


@pytest.fixture
def by_schur(monkeypatch):
    """Have everything condensed by the Schur complement."""
    monkeypatch.setattr(condensation, "_COLUMNS_UP_TO", 0)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("columns", [(), (1,), (4,)])
def test_the_schur_complement_gives_what_columns_give(columns, solver, by_schur):
    matrix, local = positive_definite(60), operator(8, 60)
    right = np.random.default_rng(4).normal(size=(60, *columns))
    condensed, compliance = condense(matrix, local, solver)
    assert isinstance(condensed, BySchur)
    exact = local @ np.linalg.solve(matrix.toarray(), local.toarray().T)
    np.testing.assert_allclose(compliance, exact, atol=1e-12 * np.abs(exact).max())
    solution, forces = solve(condensed, right, lambda free: 2.0 - 5.0 * free)
    np.testing.assert_allclose(matrix @ solution, right + local.T @ forces, atol=1e-10)
    np.testing.assert_allclose(forces, 2.0 - 5.0 * (local @ np.linalg.solve(matrix.toarray(), right)), atol=1e-10)
    assert ("one substitution" in condensed.description) == (solver.name == "MKL PARDISO")


@pytest.mark.parametrize("solver", SOLVERS)
def test_nodes_that_are_picked_as_they_are_need_no_copy_of_the_compliance(solver, by_schur):
    matrix = positive_definite(60)
    local = sparse.csr_matrix((np.ones(9), (np.arange(9), 3 + 5 * np.arange(9))), shape=(9, 60))
    exact = np.linalg.inv(matrix.toarray())[3:48:5, 3:48:5]
    condensed, compliance = condense(matrix, local, solver)
    assert compliance is condensed.inverse
    np.testing.assert_allclose(compliance, exact, atol=1e-12 * np.abs(exact).max())


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("columns", [(), (3,)])
@pytest.mark.parametrize("picked", [True, False])
def test_rough_factors_keep_the_contact_law_to_double_precision(columns, picked, solver, by_schur):
    """What contact takes its forces to do is what they do in the solution, though this is rounded."""
    matrix, solver = positive_definite(60), solver.rough()
    local = sparse.csr_matrix(np.eye(60)[3:48:5]) if picked else operator(9, 60)
    condensed, compliance = condense(matrix, local, solver)
    right, forces = (np.random.default_rng(k).normal(size=(size, *columns)) for k, size in ((4, 60), (5, 9)))
    halfway = condensed.forward(right)
    solution = condensed.backward(halfway, forces)
    moved = halfway.local + compliance.astype(float) @ forces
    np.testing.assert_allclose(local @ solution, moved, atol=1e-14 * np.abs(moved).max() * 60)
    missed = np.abs(matrix @ solution - right - local.T @ forces).max()
    assert (1e-9 < missed < 1e-3) == condensed.factor.is_single
    assert (compliance.dtype == np.float32) == (picked and condensed.factor.is_single)


def test_columns_are_kept_only_while_they_are_small(monkeypatch):
    """8 of 60 unknowns are 480 entries; a matrix with short rows may have twelve times the entries of a full one."""
    matrix, local = positive_definite(60), operator(8, 60)
    full = sparse.csr_matrix(matrix + 1e-9 * np.ones((60, 60)))
    monkeypatch.setattr(condensation, "_COLUMNS_UP_TO", 40)
    assert isinstance(condense(full, local, SuperLU())[0], BySchur)
    assert isinstance(condense(matrix, local, SuperLU())[0], ByColumns)
    monkeypatch.setattr(condensation, "_COLUMNS_UP_TO", 39)
    assert isinstance(condense(matrix, local, SuperLU())[0], BySchur)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("largest", [0, 10**9], ids=["schur", "columns"])
def test_columns_march_together_as_they_do_alone(largest, solver, monkeypatch):
    monkeypatch.setattr(condensation, "_COLUMNS_UP_TO", largest)
    matrix, local = positive_definite(60), operator(8, 60)
    right = np.random.default_rng(4).normal(size=(60, 3))
    condensed, _ = condense(matrix, local, solver)
    together, _ = solve(condensed, right, lambda free: 2.0 - 5.0 * free)
    for column in range(3):
        alone, _ = solve(condensed, right[:, column], lambda free: 2.0 - 5.0 * free)
        np.testing.assert_allclose(together[:, column], alone, atol=1e-11 * np.abs(alone).max())
