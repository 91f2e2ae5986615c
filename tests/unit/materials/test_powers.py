"""Laws that are sums of powers of the isochoric stretches: one sum, whoever names its terms."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import fingerslip as fs

STRAINS = np.random.default_rng(5).uniform(-0.5, 0.5, (50, 3))


@given(c10=st.floats(1e3, 1e6), share=st.floats(0.0, 2.0), ratio=st.floats(0.3, 0.499))
def test_mooney_rivlin_is_ogden_with_the_exponents_two_and_minus_two(c10: float, share: float, ratio: float) -> None:
    c01 = share * c10
    mooney = fs.MooneyRivlin(c10=c10, c01=c01, density=1000.0, poisson_ratio=ratio)
    terms = (fs.OgdenTerm(2.0 * c10, 2.0), fs.OgdenTerm(-2.0 * c01, -2.0))
    ogden = fs.Ogden(terms=terms, density=1000.0, poisson_ratio=ratio)
    assert mooney.shear_modulus == ogden.shear_modulus
    for answer in ("stored_energy", "kirchhoff_stress", "kirchhoff_tangent"):
        one, other = (getattr(law, answer)(STRAINS) for law in (mooney, ogden))
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12 * np.abs(other).max())


def test_the_energy_is_that_of_the_invariants() -> None:
    law = fs.MooneyRivlin(c10=10e3, c01=3e3, density=1000.0, bulk_modulus=1e6)
    squares = np.exp(2.0 * (STRAINS - STRAINS.mean(axis=1, keepdims=True)))
    first, second = squares.sum(axis=1), (1.0 / squares).sum(axis=1)
    expected = 10e3 * (first - 3.0) + 3e3 * (second - 3.0) + 0.5e6 * STRAINS.sum(axis=1) ** 2
    np.testing.assert_allclose(law.stored_energy(STRAINS), expected, rtol=1e-12)
