"""Manufactured solution: the error must fall at the rate that the element's polynomial degree gives.

Source: a priori estimates of the displacement method (Ciarlet 1978): for smooth solutions and degree k the
error falls with h^(k+1) in L2 and h^k in H1. The slope over the last refinement may differ from the
asymptotic one by 0.1, the usual pre-asymptotic remainder at 1/32.
"""

import numpy as np
import pytest

from fingerslip.verification.elements import manufactured_errors


@pytest.mark.parametrize(
    ("element", "formulation", "poisson_ratio", "degree"),
    [
        ("Q4", "plane_strain", 0.3, 1),
        ("Q4", "plane_stress", 0.3, 1),
        ("T3", "plane_strain", 0.3, 1),
        ("T3", "plane_stress", 0.48, 1),
        ("T6", "plane_strain", 0.3, 2),
        ("T6", "plane_stress", 0.48, 2),
    ],
)
def test_convergence_at_the_elements_rate(element, formulation, poisson_ratio, degree):
    coarse, fine = (np.array(manufactured_errors(element, count, poisson_ratio, formulation)) for count in (16, 32))
    l2, h1 = np.log2(coarse / fine)
    assert degree + 0.9 <= l2 <= degree + 1.5
    assert h1 >= degree - 0.1
