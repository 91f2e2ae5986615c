"""Slip events from named sites that leave the plate's line."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.slip import EventSettings, PeakSettings, acceleration_events, peak_signal, reference_events
from fingerslip.slip.receptors import tangential_acceleration
from unit.synthetic import PRESS_END, SPEED, Process, make

HISTORY = make(Process(jump=False))
SITES = ("FA-I-10", "FA-I-12", "FA-I-14")


def leaving(times: dict[str, float]):
    """Return the history with sites that follow the plate up to a time each."""
    displacement = HISTORY["displacement"].values.copy()
    plate = HISTORY["counterface_displacement"].values[:, 0, 0]
    names = HISTORY["site"].values.tolist()
    for name, time in times.items():
        displacement[:, names.index(name), 0] = np.minimum(plate, SPEED * (time - PRESS_END))
    return HISTORY.assign(displacement=(HISTORY["displacement"].dims, displacement))


@pytest.mark.parametrize("tolerance", [20e-6, 100e-6])
def test_first_and_last_site_leave_the_line_when_they_lag_by_the_tolerance(tolerance: float) -> None:
    history = leaving(dict(zip(SITES, (1.2, 1.3, 1.5), strict=True)))
    events = reference_events(history, SITES, EventSettings(displacement_tolerance=tolerance))
    assert events.incipient == pytest.approx(1.2 + tolerance / SPEED, abs=1e-3)
    assert events.overall == pytest.approx(1.5 + tolerance / SPEED, abs=1e-3)
    assert events.noticed == pytest.approx(1.3 + tolerance / SPEED, abs=1e-3)


def test_a_site_that_stays_on_the_line_leaves_overall_slip_out() -> None:
    events = reference_events(leaving({"FA-I-10": 1.2, "FA-I-12": 9.0}), SITES[:2])
    assert events.incipient is not None
    assert events.overall is None


def test_sites_that_are_not_recorded_are_said_to_be_missing() -> None:
    assert not reference_events(HISTORY, ("skin-h2",)).recorded
    assert not reference_events(HISTORY, ()).recorded
    assert not acceleration_events(HISTORY, PeakSettings(sites=("skin-h2",))).recorded


def test_peaks_are_read_at_named_sites_alone() -> None:
    settings = PeakSettings(sites=("SA-II-3",))
    signal = peak_signal(HISTORY, settings)
    assert signal is not None
    row = HISTORY["site"].values.tolist().index("SA-II-3")
    own = np.abs(tangential_acceleration(HISTORY, np.array([row])))[:, 0]
    assert signal.values == pytest.approx(own[-signal.size :])
