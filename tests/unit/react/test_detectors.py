"""Detectors on what a step might have recorded."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fingerslip.react.detectors import AtOnce, ForceRatio, Never, SlippedArea, StickRatio
from fingerslip.react.moment import Detector, Moment


def moment(**changes: Any) -> Moment:
    """Return four nodes that touch and one that does not; two stick, and one has slipped by 0.1 mm."""
    recorded = {
        "contact_state": np.array([1, 1, 2, 2, 0]),
        "slip_distance": np.array([0.0, 50e-6, 120e-6, 10e-6, 9e-3]),
        "counterface_force": np.array([[-0.9, 2.0]]),
        **changes,
    }
    slips = np.array([0.0, 50e-6, 20e-6, 0.0, 0.0])
    return Moment(0.1, recorded, np.array([1.0, 1.0, 2.0, 1.0, 5.0]), slips)  # type: ignore[arg-type]


def test_shares_are_those_of_the_area_that_touches() -> None:
    assert moment().slipped_fraction() == pytest.approx(2 / 5)
    assert moment().slipped_fraction(5e-6) == pytest.approx(3 / 5)
    assert moment().stick_ratio == pytest.approx(2 / 5)
    assert moment().force_ratio == pytest.approx(0.45)


def test_without_contact_there_is_no_share_and_no_ratio() -> None:
    apart = moment(contact_state=np.zeros(5, dtype=int), counterface_force=np.zeros((1, 2)))
    assert (apart.slipped_fraction(), apart.stick_ratio, apart.force_ratio) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("detector", "silent", "value"),
    [
        (SlippedArea(fraction=0.4), SlippedArea(fraction=0.41), 0.4),
        (StickRatio(ratio=0.4), StickRatio(ratio=0.39), 0.4),
        (ForceRatio(friction=0.5, share=0.9), ForceRatio(friction=0.5, share=0.91), 0.45),
        (AtOnce(), Never(), 1.0),
    ],
)
def test_alarm_comes_where_the_measure_reaches_its_limit(detector: Detector, silent: Detector, value: float) -> None:
    alarm = detector.start().take(moment())
    assert alarm is not None
    assert alarm.time == 0.1
    assert alarm.value == pytest.approx(value)
    assert silent.start().take(moment()) is None
