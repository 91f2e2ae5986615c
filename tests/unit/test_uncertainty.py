"""Observed orders, limits and uncertainties of series whose law is known."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.uncertainty import Convergence, Refinement, Series, combine, refine

SIZES = (1.0, 2.0 / 3.0, 0.5)


def series(*values, sizes=SIZES):
    return Series("mesh", sizes, values)


@given(
    order=st.floats(0.55, 2.0),
    limit=st.floats(-10.0, 10.0),
    slope=st.floats(0.1, 5.0) | st.floats(-5.0, -0.1),
    sizes=st.sampled_from([SIZES, (1.0, 0.5, 0.25), (1.0, 1.5, 2.0), (1.0, 0.7, 1.4)]),
)
def test_a_power_law_gives_its_order_and_its_limit(order, limit, slope, sizes):
    found = refine(series(*(limit + slope * size**order for size in sizes), sizes=sizes), 2.0)
    assert found.behaviour == "monotone"
    assert found.order == pytest.approx(order, rel=1e-5)
    assert found.limit == pytest.approx(limit, abs=1e-5)
    assert found.uncertainty == pytest.approx(1.25 * abs(slope), rel=1e-4)
    assert found.converges


@given(st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=3), st.floats(1e-3, 1e3), st.floats(-1e3, 1e3))
def test_uncertainty_goes_with_the_unit_and_not_with_the_zero(values, scale, shift):
    plain = refine(series(*values), 2.0)
    moved = refine(series(*(scale * value for value in values)), 2.0)
    if plain.behaviour == "unchanged" or moved.behaviour != plain.behaviour:
        return  # differences of the size of rounding
    assert plain.uncertainty is not None
    assert moved.uncertainty == pytest.approx(scale * plain.uncertainty, rel=1e-3, abs=1e-9 * scale)
    there = refine(series(*(value + shift for value in values)), 2.0)
    if there.behaviour == plain.behaviour:
        assert there.uncertainty == pytest.approx(plain.uncertainty, rel=1e-2, abs=1e-6)


@given(st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=3))
def test_uncertainty_is_never_less_than_what_was_seen(values):
    """The finest value lies between the one in use and the limit, or the range counts threefold."""
    found = refine(series(*values), 2.0)
    assert found.uncertainty is not None
    assert found.uncertainty >= 0.999 * abs(values[0] - values[2])


@pytest.mark.parametrize(
    ("values", "behaviour"),
    [
        ((1.0, 2.0, 1.5), "oscillatory"),
        ((1.0, 2.0, 2.0), "oscillatory"),
        ((1.0, 1.1, 4.0), "divergent"),
        ((1.0, 2.0, 2.66), "slow"),
        ((3.0, 3.0, 3.0), "unchanged"),
        ((1.0, None, 3.0), "missing"),
    ],
)
def test_what_gives_no_limit_is_called_by_its_name(values, behaviour):
    found = refine(series(*values), 2.0)
    assert (found.behaviour, found.limit) == (behaviour, None)
    if behaviour in {"oscillatory", "divergent", "slow"}:
        known = [value for value in values if value is not None]
        assert found.uncertainty == pytest.approx(3.0 * (max(known) - min(known)))
        assert not found.converges


def test_an_order_beyond_the_elements_is_not_trusted_and_a_small_change_has_settled():
    """h^4 fits the values, but the limit is that of second order, three times as far, and the misfit is added."""
    values = tuple(1.0 + size**4 for size in SIZES)
    found = refine(series(*values), 2.0)
    assert found.order == pytest.approx(4.0, rel=1e-5)
    assert found.behaviour == "fast"
    assert found.converges
    slope = (values[0] - values[2]) / (1.0 - 0.25)
    limit = values[0] - slope
    misfit = abs(values[1] - (limit + slope * SIZES[1] ** 2))
    assert found.limit == pytest.approx(limit)
    assert found.uncertainty == pytest.approx(3.0 * slope + misfit)
    assert refine(series(*(1.0 + size**2.09 for size in SIZES)), 2.0).behaviour == "monotone"
    # A small change has settled, whatever its way.
    found = refine(series(1.000, 1.001, 1.0005), 2.0)
    assert found.behaviour == "oscillatory"
    assert found.settled
    assert found.converges


def test_a_choice_has_its_largest_change_as_uncertainty_and_two_levels_are_too_few_for_an_order():
    found = refine(Series("alpha", (-0.4, -0.05, -0.3), (1.0, 1.5, 0.9)), None)
    assert found == Refinement("divergent", 0.5)
    assert refine(Series("alpha", (-0.4, -0.05), (1.0, 1.001)), None).converges
    with pytest.raises(ValueError, match="needs 3 levels"):
        refine(series(1.0, 2.0, sizes=(1.0, 0.5)), 2.0)


def test_a_number_converges_when_it_does_with_every_setting_and_their_uncertainties_add_as_squares():
    good = Series("mesh", SIZES, tuple(1.0 + size for size in SIZES))
    bad = Series("step", SIZES, (2.0, 4.0, 1.0))
    assert Convergence("q", "s", 2.0, {"mesh": good}).unsettled_settings == ()
    both = Convergence("q", "s", 2.0, {"mesh": good, "step": bad})
    assert both.unsettled_settings == ("step",)
    assert Convergence("q", "s", 2.0, {"mesh": good}, resolution=2.0).uncertainty == 2.0, "no better than half a step"
    still = {"step": series(2.0, 2.0, 2.0)}
    assert [Convergence("q", "s", 2.0, still, size).uncertainty for size in (0.5, 0.0)] == [0.5, None]
    assert Convergence("q", "s", 2.0, {"step": series(2.0, None, 2.0)}, 0.5).uncertainty is None
    assert both.uncertainty == pytest.approx(math.hypot(1.25, 9.0))
    assert (combine([3.0, 4.0]), combine([3.0, None]), combine([])) == (5.0, None, None)
