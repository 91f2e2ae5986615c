"""Matrices, and both kinds of factors, for tests of factorisation and condensation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from fingerslip.linear.factorisation import PardisoFactor, SuperLUFactor, pardiso_available

needs_mkl = pytest.mark.skipif(not pardiso_available(), reason="MKL is not installed")
FACTORS = [pytest.param(PardisoFactor, marks=needs_mkl), SuperLUFactor]


def positive_definite(size, seed=0):
    rng = np.random.default_rng(seed)
    root = sparse.random(size, size, density=0.05, rng=rng, format="csr") + sparse.diags(rng.uniform(1, 2, size))
    return sparse.csr_matrix(root @ root.T)
