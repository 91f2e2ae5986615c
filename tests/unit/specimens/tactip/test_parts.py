"""The parts of a TacTip and what they refuse."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.specimens.tactip.parts import Markers, Ridges, Skin


def test_flanks_are_upright_for_high_ridges():
    assert Ridges(True, 3.3e-3, 3e-3, 4).steepness == pytest.approx(np.pi / 2)
    low = Ridges(True, 3.3e-3, 0.5e-3, 4)
    assert 2 * low.bend_radius * (1 - np.cos(low.steepness)) == pytest.approx(0.5e-3)


def test_a_skin_that_fills_its_grooves_is_refused():
    with pytest.raises(InputError, match="fills its grooves"):
        Skin(1.7e-3, Ridges(True, 3.3e-3, 3e-3, 4))


def test_a_smooth_skin_has_no_relief():
    assert Skin(1e-3, Ridges(False, 3.3e-3, 3e-3, 4)).relief == 0.0


@pytest.mark.parametrize("rings", [(), (2, 8), (1, 7)])
def test_rings_need_one_on_the_axis_and_even_ones(rings):
    with pytest.raises(InputError, match="needs 1 on the axis"):
        Markers("rings", rings, 1, 1e-3)
