"""Times of a run are between its start and its end."""

from __future__ import annotations

import pytest
import xarray as xr

import fingerslip as fs
from fingerslip.study.inspection.times import time_of_run

HISTORY = xr.Dataset(coords={"time": [0.0, 0.5, 1.0]})


@pytest.mark.parametrize(("given", "seconds"), [("0 s", 0.0), ("500 ms", 0.5), ("1 s", 1.0)])
def test_a_time_has_a_unit(given, seconds):
    assert time_of_run(HISTORY, given, "view: --time") == pytest.approx(seconds)


@pytest.mark.parametrize(
    ("given", "said"), [("1.1 s", "0 to 1 s"), ("-1 ms", "0 to 1 s"), ("1", "unit"), ("1 mm", "s")]
)
def test_other_times_are_refused(given, said):
    with pytest.raises(fs.InputError, match=f"^view: --time: .*{said}"):
        time_of_run(HISTORY, given, "view: --time")
