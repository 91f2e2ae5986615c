"""Numbers of a run by name."""

from __future__ import annotations

import pytest

from fingerslip.errors import InputError
from fingerslip.results import Quantity, RunResult
from fingerslip.sampling.designs import output_names, output_of, required_output
from fingerslip.slip.events import Events, SlipEvents

TRAVEL = Quantity("travel", "m", 2.0)
RUN = RunResult(
    "run", {}, Events(SlipEvents(1.0, overall=1.5)), numbers={"contact_area_max_m2": 3.0}, derived={"travel": TRAVEL}
)


def test_events_measures_and_derived_quantities_have_names() -> None:
    assert output_of(RUN, "latency") == Quantity("latency (accumulated slip)", "s", 0.5)
    assert output_of(RUN, "overall_slip_acceleration") == Quantity("overall slip (acceleration peaks)", "s", None)
    assert output_of(RUN, "contact_area_max") == Quantity("largest contact area", "m^2", 3.0)
    assert output_of(RUN, "penetration_max").value is None
    assert output_of(RUN, "travel") is TRAVEL
    assert all(output_of(RUN, name) is not None for name in output_names(RUN))


def test_other_names_are_refused() -> None:
    assert output_of(RUN, "latency_x") is None
    with pytest.raises(InputError, match="of: 'latency_x' is not known, needs one of incipient_slip"):
        required_output(RUN, "latency_x")
