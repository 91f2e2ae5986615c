"""Time settings: what is refused, and what follows from them."""

from __future__ import annotations

import pytest

import fingerslip as fs
from fingerslip.model.timing import shortest_step


@pytest.mark.parametrize(
    ("values", "where", "found"),
    [
        ({"smallest": 5e-3}, "smallest", "got 0.005 s for records every 0.005 s"),
        ({"smallest": 1e-3, "largest": 1e-3}, "largest", "got 0.001 s where the shortest step is 0.001 s"),
        ({"smallest": 2e-3, "largest": 1e-3}, "largest", "where the shortest step is 0.002 s"),
        ({"tolerance": 0.0}, "tolerance", "needs a number > 0"),
        ({"tolerance": 1.0}, "tolerance", "needs a number < 1"),
        ({"end": 1e-3}, "output", "got 0.005 s for a run of 0.001 s"),
        ({"scheme": "quasi_static", "alpha": -0.1}, "alpha", "got -0.1 for quasi-static steps"),
        ({"records_per_decade": 0}, "records_per_decade", "got 0"),
        ({"output": -1.0}, "output", "needs a value > 0"),
        ({"scheme": "euler"}, "scheme", "euler"),
    ],
)
def test_what_makes_no_sense_is_refused(values, where, found):
    with pytest.raises(fs.InputError, match=found) as caught:
        fs.Adaptive(**({"output": 5e-3} | values))
    assert caught.value.where == f"Adaptive.{where}"


def test_the_shortest_step_is_a_part_of_the_output_where_it_is_not_given():
    assert fs.Adaptive(16e-3).shortest == pytest.approx(1e-3)
    assert fs.Adaptive(16e-3, smallest=2e-3).shortest == pytest.approx(2e-3)
    assert shortest_step(fs.Adaptive(16e-3)) == pytest.approx(1e-3)
    assert shortest_step(fs.QuasiStatic(5e-3)) == pytest.approx(5e-3)


def test_a_fixed_step_has_the_same_scheme():
    assert fs.Adaptive(5e-3, alpha=-0.1, end=1.0).fixed(1e-3) == fs.TimeStepping(1e-3, -0.1, 1.0)
    assert fs.Adaptive(5e-3, scheme="quasi_static", end=1.0).fixed(1e-3) == fs.QuasiStatic(1e-3, 1.0)


@pytest.mark.parametrize(("scheme", "power"), [("quasi_static", 1), ("hht_alpha", 3)])
def test_refined_steps_have_a_tolerance_of_their_order(scheme, power):
    finer = fs.Adaptive(8e-3, 1e-2, scheme, smallest=1e-3, largest=4e-3).refined(0.5)
    assert finer.tolerance == pytest.approx(1e-2 * 0.5**power)
    assert (finer.output, finer.smallest, finer.largest) == pytest.approx((4e-3, 0.5e-3, 2e-3))
