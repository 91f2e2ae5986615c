"""Matrices, and both linear solvers, for tests of factorisation and condensation."""

import numpy as np
import pytest
from scipy import sparse

from fingerslip.linear.solvers.pardiso import Pardiso
from fingerslip.linear.solvers.superlu import SuperLU

needs_mkl = pytest.mark.skipif(not Pardiso().is_available(), reason="MKL is not installed")
SOLVERS = [pytest.param(Pardiso(), marks=needs_mkl, id="pardiso"), pytest.param(SuperLU(), id="superlu")]


class ExactPardiso(Pardiso):
    """MKL PARDISO, all of whose factors are of double precision."""

    def rough(self):
        return self.series()


EXACT = ExactPardiso() if Pardiso().is_available() else SuperLU()


def positive_definite(size, seed=0):
    rng = np.random.default_rng(seed)
    root = sparse.random(size, size, density=0.05, rng=rng, format="csr") + sparse.diags(rng.uniform(1, 2, size))
    return sparse.csr_matrix(root @ root.T)
