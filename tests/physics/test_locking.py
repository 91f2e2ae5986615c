"""A pressed thick ring near incompressibility against Lame's closed form, on 8 cells through the wall.

Tolerance 2 %: the error of interpolation there is below 1 % for all elements at nu = 0.3, so that more is locking.
"""

from __future__ import annotations

import pytest

from fingerslip.verification.elements import ring_ratio


@pytest.mark.parametrize("poisson_ratio", [0.3, 0.48, 0.4999])
@pytest.mark.parametrize(("element", "integration"), [("Q4", "selective"), ("T6", "full"), ("T3", "nodal")])
def test_these_elements_do_not_lock(element, integration, poisson_ratio):
    assert ring_ratio(element, integration, poisson_ratio) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("element", ["Q4", "T3"])
def test_these_elements_do_lock(element):
    """They are right at nu = 0.3, worse at 0.48 and lose a quarter or more of the displacement at 0.4999."""
    right, worse, locked = (ring_ratio(element, "full", ratio) for ratio in (0.3, 0.48, 0.4999))
    assert right == pytest.approx(1.0, abs=0.02)
    assert locked < 0.8
    assert locked < worse < right
