"""Prony terms: what they leave of the modulus, and the recurrence of their dashpots."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.mooney_rivlin import MooneyRivlin
from fingerslip.materials.neo_hookean import NeoHookean
from fingerslip.materials.ogden import Ogden, OgdenTerm
from fingerslip.materials.prony import PronyTerm, check_prony, recurrence, relaxation

TERMS = (PronyTerm(0.3, 0.1), PronyTerm(0.2, 2.0))


def test_modulus_falls_from_all_to_what_never_relaxes():
    times = np.array([0.0, 0.1, 1e6])
    expected = [1.0, 0.5 + 0.3 * np.exp(-1.0) + 0.2 * np.exp(-0.05), 0.5]
    np.testing.assert_allclose(relaxation(TERMS, times), expected, rtol=1e-12)


@pytest.mark.parametrize("step", [0.01, 0.1, 0.2])
def test_recurrence_is_exact_where_strain_is_linear_in_a_step(step):
    """Of a strain that grows at rate 1 the dashpot is t - tau (1 - exp(-t/tau))."""
    times = step * np.arange(50)
    found = recurrence(TERMS, step).follow(times)
    for term, dashpot in zip(TERMS, found, strict=True):
        np.testing.assert_allclose(dashpot, times + term.time * np.expm1(-times / term.time), rtol=1e-10, atol=1e-15)


def test_recurrence_takes_fields_and_no_times():
    follow = recurrence(TERMS, 0.1)
    strains = np.random.default_rng(0).normal(size=(6, 4, 3))
    strains[0] = 0.0
    found = follow.follow(strains)
    assert found.shape == (2, 6, 4, 3)
    expected = follow.end[0] * strains[1] + follow.start[0] * strains[0]
    np.testing.assert_allclose(found[0, 1], expected)
    assert follow.follow(np.zeros((6, 0, 3))).shape == (2, 6, 0, 3)


def test_short_steps_leave_no_digits_out():
    follow = recurrence((PronyTerm(0.3, 1e6),), 1e-6)
    assert follow.end[0] == pytest.approx(0.5e-12, rel=1e-3)
    assert follow.start[0] == pytest.approx(0.5e-12, rel=1e-3)


@pytest.mark.parametrize(
    ("share", "time", "message"),
    [(0.0, 1.0, "share: got 0"), (1.0, 1.0, "share: got 1"), (0.3, 0.0, "time"), (0.3, -1.0, "time")],
)
def test_impossible_terms_are_refused(share, time, message):
    with pytest.raises(InputError, match=message):
        PronyTerm(share, time)


@pytest.mark.parametrize(
    "make",
    [
        lambda terms: Elastic(1e3, 0.4, 1.0, prony=terms),
        lambda terms: NeoHookean(1e3, 0.4, 1.0, prony=terms),
        lambda terms: MooneyRivlin(1e3, 1.0, poisson_ratio=0.4, prony=terms),
        lambda terms: Ogden((OgdenTerm(1e3, 2.0),), 1.0, poisson_ratio=0.4, prony=terms),
    ],
)
def test_every_law_takes_terms_and_hands_them_to_small_strain(make):
    law = make(TERMS)
    assert (law if isinstance(law, Elastic) else law.at_rest()).prony == TERMS
    with pytest.raises(InputError, match=r"prony: has shares with a sum of 1\.2, needs a sum < 1"):
        make((PronyTerm(0.6, 1.0), PronyTerm(0.6, 2.0)))


def test_shares_may_leave_little():
    check_prony((PronyTerm(0.5, 1.0), PronyTerm(0.49, 1.0)))


def test_steps_that_are_controlled_may_be_long():
    follow = recurrence((PronyTerm(0.3, 1e-3),), 10.0, controlled=True)
    assert follow.follow(np.array([0.0, 1.0, 1.0]))[0] == pytest.approx([0.0, 1.0 - 1e-4, 1.0], abs=1e-12)


def test_times_below_half_the_step_are_refused_with_the_limit():
    recurrence((PronyTerm(0.3, 0.05),), 0.1)
    with pytest.raises(InputError) as caught:
        recurrence((*TERMS, PronyTerm(0.1, 0.04)), 0.1, "materials.skin.prony")
    assert "materials.skin.prony.2.time: got 0.04 s for a step of 0.1 s, needs at least 0.05 s, half" in str(
        caught.value
    )
