"""MKL PARDISO through its own interface: its memory, and matrices that it refuses."""

from __future__ import annotations

import os
import sys
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse

from fingerslip.errors import FingerslipError
from fingerslip.linear.solvers import pardiso
from fingerslip.linear.solvers.pardiso import Pardiso
from problems.matrices import needs_mkl, positive_definite

SOLVER = Pardiso()


def without_a_list_of_files(*_):
    raise metadata.PackageNotFoundError


@pytest.mark.slow
@needs_mkl
def test_it_is_found_by_the_list_of_its_package_or_by_search(monkeypatch):
    listed = pardiso._mkl()
    monkeypatch.setattr(metadata, "files", without_a_list_of_files)
    assert Path(pardiso._mkl()._name).resolve() == Path(listed._name).resolve()


@needs_mkl
@pytest.mark.parametrize(("given", "found"), [(None, "0"), ("5", "5")])
def test_idle_threads_sleep_unless_the_user_wants_them_to_spin(given, found, monkeypatch):
    monkeypatch.delenv("KMP_BLOCKTIME", raising=False)
    if given is not None:
        monkeypatch.setenv("KMP_BLOCKTIME", given)
    pardiso._mkl()
    assert os.environ["KMP_BLOCKTIME"] == found


def test_it_is_not_available_without_its_package(monkeypatch):
    pardiso._mkl_pardiso.cache_clear()
    monkeypatch.setattr(metadata, "files", without_a_list_of_files)
    monkeypatch.setitem(sys.modules, "pypardiso", None)
    assert not SOLVER.is_available()
    monkeypatch.undo()
    pardiso._mkl_pardiso.cache_clear()


@needs_mkl
def test_a_factor_is_unchanged_by_a_schur_complement_beside_it():
    matrix = positive_definite(60)
    factor, right = SOLVER.factorise(matrix), np.arange(60.0)
    SOLVER.factorise_around(matrix, np.arange(20))
    np.testing.assert_allclose(matrix @ factor.backward(factor.forward(right)), right, atol=1e-9)


@needs_mkl
def test_an_indefinite_matrix_is_refused():
    with pytest.raises(FingerslipError, match="the matrix is not positive definite"):
        SOLVER.factorise(sparse.csr_matrix(np.diag([1.0, -1.0, 2.0])))


@needs_mkl
@pytest.mark.parametrize("coupling", [0.0, 2.0])
def test_an_indefinite_matrix_has_no_schur_complement(coupling):
    """One has a negative entry on the diagonal, without neighbours; the other is indefinite by its coupling."""
    ends = -1.0 if coupling == 0.0 else 1.0
    matrix = np.array([[1.0, coupling, 0, 0], [coupling, ends, 0, 0], [0, 0, 2.0, 0.5], [0, 0, 0.5, 3.0]])
    with pytest.raises(FingerslipError, match="the matrix is not positive definite"):
        SOLVER.factorise_around(sparse.csr_matrix(matrix), np.array([3]))


@needs_mkl
def test_the_analysis_tells_the_memory():
    """At least the entries of a dense lower triangle, for a dense matrix of 600 unknowns, and not ten times that."""
    matrix = sparse.csr_matrix(np.eye(600) + 0.001)
    assert 8 * 600**2 / 2 < SOLVER.bytes_around(matrix, np.arange(100)) < 80 * 600**2


@needs_mkl
@pytest.mark.parametrize("fails", [False, True])
def test_factors_that_go_give_their_memory_back(fails, monkeypatch):
    phases, call = [], pardiso._Call.__call__

    def counted(self, phase, *given):
        phases.append(phase)
        if fails and phase == pardiso._FACTORISE:
            raise FingerslipError("memory ran out")
        return call(self, phase, *given)

    monkeypatch.setattr(pardiso._Call, "__call__", counted)
    if fails:
        with pytest.raises(FingerslipError):
            SOLVER.factorise(positive_definite(20))
    else:
        factor = SOLVER.factorise(positive_definite(20))
        assert pardiso._RELEASE not in phases
        del factor
    assert phases[-1] == pardiso._RELEASE


def counted_phases(monkeypatch):
    """Return the phases of MKL that are called from now on."""
    phases, original = [], pardiso._Call.__call__

    def call(self, phase, *arguments):
        phases.append(phase)
        return original(self, phase, *arguments)

    monkeypatch.setattr(pardiso._Call, "__call__", call)
    return phases


@needs_mkl
@pytest.mark.parametrize("kept", [np.zeros(0, dtype=np.int64), np.array([3, 5, 30])])
def test_a_series_analyses_a_pattern_once(kept, monkeypatch):
    phases, series, right = counted_phases(monkeypatch), SOLVER.series(), np.arange(60.0)
    for factor in (1.0, 3.0):
        matrix = positive_definite(60)
        matrix = sparse.csr_matrix(factor * matrix + sparse.diags(matrix.diagonal()))
        if kept.size:
            series.bytes_around(matrix, kept)
            made, schur = series.factorise_around(matrix, kept)
            np.testing.assert_array_equal(schur, SOLVER.factorise_around(matrix, kept)[1])
        else:
            made = series.factorise(matrix)
            np.testing.assert_array_equal(made.forward(right), SOLVER.factorise(matrix).forward(right))
        del made
    # One analysis of the series, and one of each solver that it is compared with.
    assert phases.count(11) == 3


@needs_mkl
def test_a_series_leaves_factors_alone_that_are_still_in_use_or_of_another_pattern():
    series, matrix, right = SOLVER.series(), positive_definite(60), np.arange(60.0)
    first = series.factorise(matrix)
    expected = first.backward(first.forward(right))
    second = series.factorise(sparse.csr_matrix(2.0 * matrix))
    np.testing.assert_array_equal(first.backward(first.forward(right)), expected)
    np.testing.assert_allclose(second.backward(second.forward(right)), 0.5 * expected, rtol=1e-12)
    del first, second
    other = series.factorise(sparse.identity(60, format="csr"))
    np.testing.assert_allclose(other.backward(other.forward(right)), right)


@needs_mkl
def test_a_series_goes_on_after_a_matrix_that_is_not_definite():
    series, matrix = SOLVER.series(), positive_definite(60)
    series.factorise(matrix)
    with pytest.raises(FingerslipError, match="not positive definite"):
        series.factorise(sparse.csr_matrix(-1.0 * matrix))
    made = series.factorise(matrix)
    np.testing.assert_allclose(matrix @ made.backward(made.forward(np.ones(60))), np.ones(60))


@needs_mkl
@pytest.mark.parametrize("columns", [(), (3,)])
def test_rough_factors_are_of_single_precision_and_keep_what_is_put_into_them(columns):
    matrix, kept, right = (
        positive_definite(60),
        np.array([3, 5, 30]),
        np.random.default_rng(0).normal(size=(60, *columns)),
    )
    exact, rough = SOLVER.series(), SOLVER.rough()
    assert rough.bytes_around(matrix, kept) <= exact.bytes_around(matrix, kept)
    solutions = []
    for series, precision in ((exact, np.float64), (rough, np.float32)):
        factor, schur = series.factorise_around(matrix, kept)
        assert schur.dtype == precision
        halfway = factor.forward(right)
        halfway[kept] = np.linalg.solve(schur, halfway[kept])
        solutions.append(factor.backward(halfway))
        assert solutions[-1].dtype == np.float64
        np.testing.assert_array_equal(solutions[-1][kept], halfway[kept])
    error = np.abs(solutions[1] - solutions[0]).max() / np.abs(solutions[0]).max()
    assert 1e-10 < error < 1e-5


@needs_mkl
def test_rough_solvers_have_exact_factors_of_all_unknowns():
    matrix, right = positive_definite(60), np.arange(60.0)
    factor, exact = SOLVER.rough().rough().factorise(matrix), SOLVER.factorise(matrix)
    np.testing.assert_array_equal(factor.backward(factor.forward(right)), exact.backward(exact.forward(right)))
