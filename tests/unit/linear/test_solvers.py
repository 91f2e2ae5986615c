"""Solvers: two half substitutions are a solution, whichever one is taken; what each does by itself."""

import gc
import os
import sys
import textwrap
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse import linalg

import fingerslip as fs
from fingerslip.errors import FingerslipError
from fingerslip.linear import solver as factorisation
from fingerslip.linear import solvers
from fingerslip.linear.resources import limited_threads
from fingerslip.linear.solver import factorise_around, known_solvers, preferred_solver
from fingerslip.linear.solvers import pardiso, superlu
from fingerslip.linear.solvers.pardiso import Pardiso
from fingerslip.linear.solvers.superlu import SuperLU, nested_dissection
from problems.matrices import SOLVERS, needs_mkl, positive_definite
from problems.pushed import push_and_slide


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("large", [10, superlu._LARGE], ids=["dissected", "not"])
@pytest.mark.parametrize("columns", [(), (1,), (3,), (40,)])
def test_two_halves_are_a_solution(solver, columns, large, monkeypatch):
    """Whatever the order of elimination."""
    monkeypatch.setattr(superlu, "_LARGE", large)
    matrix = positive_definite(150)
    right = np.random.default_rng(2).normal(size=(150, *columns))
    right.flags.writeable = False
    factors = solver.factorise(matrix)
    exact = np.linalg.solve(matrix.toarray(), right)
    found = factors.backward(factors.forward(right))
    np.testing.assert_allclose(found, exact, atol=1e-12 * np.abs(exact).max())


@pytest.mark.parametrize("solver", SOLVERS)
def test_many_factors_live_side_by_side(solver):
    matrices = [positive_definite(30, seed) for seed in range(5)]
    factors = [solver.factorise(matrix) for matrix in matrices]
    right = np.arange(30.0)
    del factors[2], matrices[2]
    gc.collect()
    for matrix, one in zip(matrices, factors, strict=True):
        np.testing.assert_allclose(matrix @ one.backward(one.forward(right)), right, atol=1e-9)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("few", [0, 400])
@pytest.mark.parametrize("count", [1, 7, 59, 60, 300])
def test_the_inverse_among_some_unknowns_is_that_of_the_whole(solver, count, few, monkeypatch):
    """300 of 700 unknowns, all but one or all of 60, spread over the matrix; SuperLU has two ways to eliminate them.

    It has the precision of the factors.
    """
    monkeypatch.setattr(superlu, "_FEW", few)
    monkeypatch.setattr(factorisation, "_MIRRORED_AT_ONCE", 64)
    size = 700 if count == 300 else 60
    matrix = positive_definite(size)
    kept = np.sort(np.random.default_rng(1).permutation(size)[:count])
    exact = np.linalg.inv(matrix.toarray())[np.ix_(kept, kept)]
    for own in (solver, solver.rough())[: 2 if size == 60 else 1]:
        factor, found = factorise_around(matrix, kept, own)
        assert found.dtype == (np.float32 if factor.is_single else np.float64)
        np.testing.assert_allclose(found, exact, atol=(1e-5 if factor.is_single else 1e-11) * np.abs(exact).max())
        np.testing.assert_array_equal(found, found.T)
        assert own is not solver or not factor.is_single
        assert found.flags.c_contiguous


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("columns", [(), (1,), (3,)])
def test_halves_around_some_unknowns_are_a_solution(solver, columns):
    """Between them stands the dense problem: whatever is put in for its unknowns, the others follow."""
    matrix, kept = positive_definite(80), np.array([3, 4, 17, 40, 79])
    right = np.random.default_rng(2).normal(size=(80, *columns))
    given = right.copy()
    factors, schur = solver.factorise_around(matrix, kept)
    halfway = factors.forward(given)
    np.testing.assert_array_equal(given, right)
    exact = np.linalg.solve(matrix.toarray(), right)
    np.testing.assert_allclose(np.linalg.solve(schur, halfway[kept]), exact[kept], atol=1e-11)
    halfway[kept] += 1.0
    moved = factors.backward(halfway)
    others = np.setdiff1d(np.arange(80), kept)
    np.testing.assert_allclose((matrix @ moved)[others], right[others], atol=1e-11)
    np.testing.assert_array_equal(moved[kept], halfway[kept])


SHORT = {"programme": (fs.Press(0.02e-3, 1e-3),)}


@needs_mkl
def test_pardiso_is_taken_where_it_is_installed():
    assert preferred_solver().name == Pardiso.name
    assert fs.simulate(push_and_slide(**SHORT)).attrs["linear_solver"] == "MKL PARDISO"


def test_superlu_is_taken_where_pardiso_is_missing(monkeypatch):
    assert [solver.name for solver in known_solvers()] == ["MKL PARDISO", "SuperLU"]
    monkeypatch.setattr(Pardiso, "is_available", lambda _: False)
    assert preferred_solver().name == SuperLU.name
    assert fs.simulate(push_and_slide(**SHORT)).attrs["linear_solver"] == "SuperLU"


DENSE = """
    from dataclasses import dataclass

    import numpy as np

    from fingerslip.linear.solver import InnerFactor

    @dataclass(frozen=True)
    class Factor:
        lower: np.ndarray

        def forward(self, right_hand_side):
            return np.linalg.solve(self.lower, right_hand_side)

        def backward(self, halfway):
            return np.linalg.solve(self.lower.T, halfway)

    class Dense:
        name, preference = "dense Cholesky", 99

        def is_available(self):
            return True

        def rough(self):
            return self

        series = rough

        def factorise(self, matrix):
            return Factor(np.linalg.cholesky(matrix.toarray()))

        def factorise_around(self, matrix, interface):
            factor = InnerFactor(self, matrix, interface)
            return factor, factor.schur()

    SOLVER = Dense()
"""


@pytest.fixture
def another_folder(tmp_path, monkeypatch):
    """Let the package of solvers have a second folder, and forget what was imported from there."""
    monkeypatch.setattr(solvers, "__path__", [*solvers.__path__, str(tmp_path)])
    yield tmp_path
    for name in ("dense", "helpers"):
        sys.modules.pop(f"{solvers.__name__}.{name}", None)
        vars(solvers).pop(name, None)


@pytest.mark.parametrize(("machine", "count"), [("x86_64", 1), ("AMD64", 1), ("arm64", 0)])
def test_what_is_faster_for_large_models_is_said_once_where_it_exists(machine, count, monkeypatch, caplog):
    superlu._suggest_pardiso.cache_clear()
    monkeypatch.setattr("platform.machine", lambda: machine)
    SuperLU().factorise(positive_definite(30))
    assert caplog.messages == []
    monkeypatch.setattr(superlu, "_LARGE", 30)
    for _ in range(2):
        SuperLU().factorise(positive_definite(30))
    assert ["fingerslip[pardiso]" in message for message in caplog.messages] == [True] * count


def test_a_file_is_all_that_a_new_solver_needs(another_folder):
    (another_folder / "dense.py").write_text(textwrap.dedent(DENSE))
    (another_folder / "helpers.py").write_text("ONE = 1")
    assert [solver.name for solver in known_solvers()] == ["dense Cholesky", "MKL PARDISO", "SuperLU"]
    matrix, right = positive_definite(20), np.arange(20.0)
    factor = preferred_solver().factorise(matrix)
    np.testing.assert_allclose(matrix @ factor.backward(factor.forward(right)), right, atol=1e-10)
    history, usual = (fs.simulate(push_and_slide(), solver=solver) for solver in (None, SuperLU()))
    assert history.attrs["linear_solver"] == "dense Cholesky"
    force = usual.counterface_force.values
    np.testing.assert_allclose(history.counterface_force.values, force, atol=1e-9 * np.abs(force).max())


SUPERLU = SuperLU()


@pytest.mark.parametrize("few", [0, 400])
def test_separate_bodies_have_a_schur_complement_too(few, monkeypatch):
    """SuperLU then takes the unknowns of one body after the other, whatever order it is given."""
    monkeypatch.setattr(superlu, "_FEW", few)
    blocks = [positive_definite(40, seed) for seed in (1, 2)]
    matrix, kept = sparse.block_diag(blocks, format="csr"), np.array([3, 20, 45, 70])
    exact = np.linalg.inv(np.linalg.inv(matrix.toarray())[np.ix_(kept, kept)])
    _, found = SUPERLU.factorise_around(matrix, kept)
    np.testing.assert_allclose(found, exact, atol=1e-10 * np.abs(exact).max())


@pytest.mark.parametrize("seed", range(5))
def test_entries_are_counted_as_in_a_dense_factorisation(seed):
    """A few of the counted entries may cancel out."""
    matrix = positive_definite(50, seed)
    exact = np.count_nonzero(np.abs(np.linalg.cholesky(matrix.toarray())) > 1e-14)
    assert exact <= superlu._count_entries(matrix.indptr, matrix.indices) <= 1.03 * exact


def test_the_estimate_grows_with_what_is_kept_and_the_order_beats_the_natural_one_by_far_in_3d():
    """A cube of n^3 points fills like n^5 in natural order and like n^4 with nested dissection."""
    matrix = sparse.csr_matrix(sparse.kronsum(*[sparse.diags([-1.0, 3.0, -1.0], [-1, 0, 1], shape=(40, 40))] * 2))
    few, many = (SUPERLU.bytes_around(matrix, np.arange(count)) for count in (10, 400))
    assert 16 * 1600 < few < many
    matrix = grid(16, 16, 16)
    assert fill(matrix, nested_dissection(matrix)) < 0.4 * fill(matrix, np.arange(16**3))
    order = nested_dissection(grid(6, 6, 6, components=3))
    np.testing.assert_array_equal(np.diff(order.reshape(-1, 3)), 1)


def grid(*sizes: int, components: int = 1) -> sparse.csr_matrix:
    """Return the Laplacian of a grid, plus one; with several coupled unknowns at each point."""
    total = sparse.csr_matrix((1, 1))
    for size in sizes:
        line = sparse.diags([-1.0, 2.0, -1.0], [-1, 0, 1], shape=(size, size))
        total = sparse.kronsum(total, line)
    block = np.eye(components) + 0.1
    return sparse.csr_matrix(sparse.kron(total + sparse.identity(total.shape[0]), block))


def fill(matrix: sparse.csr_matrix, order: np.ndarray) -> int:
    ordered = sparse.csc_matrix(matrix[order][:, order])
    options = {"SymmetricMode": True}
    return int(linalg.splu(ordered, permc_spec="NATURAL", diag_pivot_thresh=0.0, options=options).nnz)


@pytest.mark.parametrize(
    "matrix",
    [
        *(grid(9), grid(40, 30), grid(9, 8, 7, components=3), sparse.block_diag([grid(15, 15), grid(14, 14)])),
        *(sparse.identity(500), sparse.csr_matrix((0, 0))),
    ],
)
def test_every_unknown_is_eliminated_once(matrix):
    order = nested_dissection(sparse.csr_matrix(matrix))
    np.testing.assert_array_equal(np.sort(order), np.arange(matrix.shape[0]))


PARDISO = Pardiso()


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
    assert not PARDISO.is_available()
    monkeypatch.undo()
    pardiso._mkl_pardiso.cache_clear()


@needs_mkl
def test_the_analysis_tells_the_memory():
    """At least the entries of a dense lower triangle, for a dense matrix of 600 unknowns, and not ten times that."""
    matrix = sparse.csr_matrix(np.eye(600) + 0.001)
    assert 8 * 600**2 / 2 < PARDISO.bytes_around(matrix, np.arange(100)) < 80 * 600**2


def counted_phases(monkeypatch, fails=False):
    """Return the phases of MKL that are called from now on."""
    phases, original = [], pardiso._Call.__call__

    def call(self, phase, *arguments):
        phases.append(phase)
        if fails and phase == pardiso._FACTORISE:
            raise FingerslipError("memory ran out")
        return original(self, phase, *arguments)

    monkeypatch.setattr(pardiso._Call, "__call__", call)
    return phases


@needs_mkl
@pytest.mark.parametrize("fails", [False, True])
def test_factors_that_go_give_their_memory_back(fails, monkeypatch):
    phases = counted_phases(monkeypatch, fails)
    if fails:
        with pytest.raises(FingerslipError):
            PARDISO.factorise(positive_definite(20))
    else:
        factor = PARDISO.factorise(positive_definite(20))
        assert pardiso._RELEASE not in phases
        del factor
    assert phases[-1] == pardiso._RELEASE


@needs_mkl
@pytest.mark.parametrize("kept", [np.zeros(0, dtype=np.int64), np.array([3, 5, 30])])
def test_a_series_analyses_a_pattern_once(kept, monkeypatch):
    phases, series, right = counted_phases(monkeypatch), PARDISO.series(), np.arange(60.0)
    for factor in (1.0, 3.0):
        matrix = positive_definite(60)
        matrix = sparse.csr_matrix(factor * matrix + sparse.diags(matrix.diagonal()))
        if kept.size:
            series.bytes_around(matrix, kept)
            made, schur = series.factorise_around(matrix, kept)
            np.testing.assert_array_equal(schur, PARDISO.factorise_around(matrix, kept)[1])
        else:
            made = series.factorise(matrix)
            np.testing.assert_array_equal(made.forward(right), PARDISO.factorise(matrix).forward(right))
        del made
    # One analysis of the series, and one of each solver that it is compared with.
    assert phases.count(11) == 3


@needs_mkl
def test_a_series_leaves_factors_in_use_alone_takes_another_pattern_and_goes_on_after_an_indefinite_matrix():
    series, matrix, right = PARDISO.series(), positive_definite(60), np.arange(60.0)
    first = series.factorise(matrix)
    expected = first.backward(first.forward(right))
    second = series.factorise(sparse.csr_matrix(2.0 * matrix))
    np.testing.assert_array_equal(first.backward(first.forward(right)), expected)
    np.testing.assert_allclose(second.backward(second.forward(right)), 0.5 * expected, rtol=1e-12)
    del first, second
    other = series.factorise(sparse.identity(60, format="csr"))
    np.testing.assert_allclose(other.backward(other.forward(right)), right)


@needs_mkl
@pytest.mark.parametrize("kept", [np.zeros(0, dtype=np.int64), np.array([3, 5, 30])])
def test_a_series_keeps_its_analysis_after_an_indefinite_matrix(kept, monkeypatch):
    phases, series, matrix = counted_phases(monkeypatch), PARDISO.series(), positive_definite(60)
    indefinite = sparse.csr_matrix(1e3 * matrix - 999.0 * sparse.diags(matrix.diagonal()))

    def solve(matrix):
        right = np.where(np.isin(np.arange(60), kept), 0.0, 1.0)
        factor = series.factorise_around(matrix, kept)[0] if kept.size else series.factorise(matrix)
        return factor.backward(factor.forward(right))

    expected = solve(matrix)
    with pytest.raises(FingerslipError, match="not positive definite"):
        solve(indefinite)
    np.testing.assert_array_equal(solve(matrix), expected)
    assert phases.count(11) == 1
    assert phases.count(pardiso._RELEASE_VALUES) == phases.count(22) == 3, "the one that fails half-way gives back, too"


@needs_mkl
@pytest.mark.parametrize("columns", [(), (3,)])
def test_rough_factors_are_of_single_precision_and_keep_what_is_put_into_them(columns):
    matrix, kept, right = (
        positive_definite(60),
        np.array([3, 5, 30]),
        np.random.default_rng(0).normal(size=(60, *columns)),
    )
    exact, rough = PARDISO.series(), PARDISO.rough()
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
@pytest.mark.parametrize("threads", [(1, 2), (2, 1)])
def test_substitutions_keep_the_threads_of_their_factors(threads):
    """Without that, solutions of large matrices are wrong where others set the threads in between."""
    of_factors, of_others = threads
    right = np.random.default_rng(1).normal(size=16**3)
    with limited_threads(of_factors):
        factor, _ = PARDISO.factorise_around(grid(16, 16, 16), np.arange(0, right.size, 16))
        halves = factor.forward(right), factor.backward(right)
    with limited_threads(of_others):
        before = pardiso._mkl_pardiso()[1]()
        for half, again in zip(halves, (factor.forward(right), factor.backward(right)), strict=True):
            np.testing.assert_allclose(again, half, atol=1e-12 * np.abs(half).max())
        assert pardiso._mkl_pardiso()[1]() == before == of_others


LAST = np.array([3])
NEGATIVE = [[1.0, 0, 0, 0], [0, -1.0, 0, 0], [0, 0, 2.0, 0.5], [0, 0, 0.5, 3.0]]
COUPLED = [[1.0, 2.0, 0, 0], [2.0, 1.0, 0, 0], [0, 0, 2.0, 0.5], [0, 0, 0.5, 3.0]]
DEFINITE = "matrix is not positive definite"


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: SUPERLU.factorise(sparse.csr_matrix((3, 3))), r"SuperLU: .*singular; the matrix is not positive"),
        pytest.param(lambda: PARDISO.factorise(sparse.csr_matrix(NEGATIVE)), DEFINITE, marks=needs_mkl),
        pytest.param(lambda: PARDISO.factorise_around(sparse.csr_matrix(NEGATIVE), LAST), DEFINITE, marks=needs_mkl),
        pytest.param(lambda: PARDISO.factorise_around(sparse.csr_matrix(COUPLED), LAST), DEFINITE, marks=needs_mkl),
        (lambda: factorisation._invert(np.diag([1.0, -1.0])), "contact nodes is not positive definite"),
    ],
)
def test_matrices_that_are_not_definite_are_refused(call, message):
    with pytest.raises(FingerslipError, match=message):
        call()
