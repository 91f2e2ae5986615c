"""The integrate-and-fire model against its closed form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fingerslip as fs
from fingerslip.afferents.integrate_and_fire import AFFERENTS, IntegrateAndFire, human_afferents
from fingerslip.afferents.stimuli import STIMULI
from fingerslip.sites import RECEPTOR_KINDS

TIMES = np.linspace(0.0, 2.0, 401)


def afferent(**changes):
    given_values = {
        "stimulus": "equivalent_strain",
        "highest_frequency": 1e9,
        "membrane_time": 0.02,
        "least_steady": 0.1,
    }
    return IntegrateAndFire(**(given_values | changes))


@given(drive=st.floats(1.05, 20.0), membrane=st.floats(1e-3, 0.1), rest=st.floats(1e-3, 5e-3))
@settings(max_examples=8, deadline=None)
def test_a_steady_stimulus_fires_with_the_period_of_the_closed_form(drive, membrane, rest):
    model = afferent(membrane_time=membrane, rest=rest)
    (found,) = model.spikes(TIMES, np.full((TIMES.size, 1), 0.1 * drive))
    period = membrane * np.log(drive / (drive - 1.0)) + rest
    step = min(0.02 * membrane, 0.2 * rest)
    np.testing.assert_allclose(np.diff(found), period, atol=2.0 * step)


def test_below_the_least_stimulus_it_is_silent():
    (found,) = afferent().spikes(TIMES, np.full((TIMES.size, 1), 0.0999))
    assert found.size == 0


def test_a_ramp_fires_an_afferent_of_rates_and_a_hold_does_not():
    model = afferent(least_steady=None, least_rate=0.1)
    ramp = np.clip(TIMES, 0.0, 1.0)[:, None]
    (found,) = model.spikes(TIMES, ramp)
    assert found.size > 5
    assert found.max() < 1.01


def test_the_delay_moves_all_spikes():
    steady = np.full((TIMES.size, 2), 0.3)
    now, later = afferent().spikes(TIMES, steady), afferent(delay=5e-3).spikes(TIMES, steady)
    np.testing.assert_allclose(later[1], now[1] + 5e-3)


def test_the_low_pass_takes_what_is_fast():
    fast = (0.2 * np.sign(np.sin(2.0 * np.pi * 100.0 * TIMES)))[:, None]
    (kept,), (lost,) = afferent().spikes(TIMES, fast), afferent(highest_frequency=2.0).spikes(TIMES, fast)
    assert kept.size > 0
    assert lost.size == 0


def test_an_afferent_that_responds_to_nothing_is_refused():
    with pytest.raises(fs.InputError, match="least_steady"):
        afferent(least_steady=None)


def test_every_type_ships_with_a_known_stimulus_and_a_source_for_every_value():
    for kind, model in human_afferents().items():
        assert kind in RECEPTOR_KINDS
        assert model.stimulus in STIMULI
        assert {row.source for row in AFFERENTS.table(kind.lower())} <= {"assumed", "saal2017"}
