"""The preferred solver that is available is taken; a file in the folder of solvers is all that a new one needs."""

from __future__ import annotations

import sys
import textwrap

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.linear import solvers
from fingerslip.linear.solver import factorise, known_solvers, preferred_solver
from fingerslip.linear.solvers.pardiso import Pardiso
from fingerslip.linear.solvers.superlu import SuperLU
from problems.matrices import needs_mkl, positive_definite
from problems.pushed import push_and_slide

SHORT = {"programme": (fs.Press(0.02e-3, 1e-3),)}


def test_pardiso_comes_before_superlu():
    assert [solver.name for solver in known_solvers()] == ["MKL PARDISO", "SuperLU"]


@needs_mkl
def test_pardiso_is_taken_where_it_is_installed():
    assert preferred_solver() == Pardiso()
    assert fs.simulate(push_and_slide(**SHORT)).attrs["linear_solver"] == "MKL PARDISO"


def test_superlu_is_taken_where_pardiso_is_missing(monkeypatch):
    monkeypatch.setattr(Pardiso, "is_available", lambda _: False)
    assert preferred_solver() == SuperLU()
    assert fs.simulate(push_and_slide(**SHORT)).attrs["linear_solver"] == "SuperLU"


def test_a_solver_that_is_asked_for_is_taken():
    assert fs.simulate(push_and_slide(**SHORT), solver=SuperLU()).attrs["linear_solver"] == "SuperLU"


DENSE = """
    from dataclasses import dataclass

    import numpy as np

    @dataclass(frozen=True)
    class Factor:
        lower: np.ndarray

        def forward(self, right_hand_side):
            return np.linalg.solve(self.lower, right_hand_side)

        def backward(self, halfway):
            return np.linalg.solve(self.lower.T, halfway)

        transposed_backward = forward

    class Dense:
        name, preference = "dense Cholesky", 99

        def is_available(self):
            return True

        def rough(self):
            return self

        def factorise(self, matrix):
            return Factor(np.linalg.cholesky(matrix.toarray()))

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


def test_a_file_is_all_that_a_new_solver_needs(another_folder):
    (another_folder / "dense.py").write_text(textwrap.dedent(DENSE))
    (another_folder / "helpers.py").write_text("ONE = 1")
    assert [solver.name for solver in known_solvers()] == ["dense Cholesky", "MKL PARDISO", "SuperLU"]
    matrix, right = positive_definite(20), np.arange(20.0)
    factor = factorise(matrix)
    np.testing.assert_allclose(matrix @ factor.backward(factor.forward(right)), right, atol=1e-10)
    history, usual = (fs.simulate(push_and_slide(), solver=solver) for solver in (None, SuperLU()))
    assert history.attrs["linear_solver"] == "dense Cholesky"
    force = usual.counterface_force.values
    np.testing.assert_allclose(history.counterface_force.values, force, atol=1e-9 * np.abs(force).max())
