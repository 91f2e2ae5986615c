"""What a refinement leaves beside the runs of a study, and what is read back of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from fingerslip.slip import Events, SlipEvents, events_mapping
from fingerslip.study.convergence.uncertainties import (
    FOLDER,
    RunConvergence,
    read_convergences,
    read_uncertainties,
    stored_numbers,
    write_convergences,
)
from fingerslip.uncertainty import Convergence, Series

SIZES = (1.0, 0.5, 0.25)
KNOWN = Convergence("overall slip", "s", 1.7, {"step": Series("step", SIZES, (1.7, 1.65, 1.625))})
LACKING = Convergence("incipient slip", "s", 1.2, {"step": Series("step", SIZES, (1.2, None, 1.1))})
FOUND = RunConvergence("run", "key", {"slip.overall": KNOWN, "slip.incipient": LACKING})


def stored(events: Events, peaks: list[tuple[float, float]]) -> dict[str, Any]:
    names = ("normal_force_max_N", "friction_force_max_N", "contact_area_max_m2", "normal_traction_max_Pa")
    return {
        "events_s": events_mapping(events),
        "numbers": dict.fromkeys(names, 1.0),
        "acceleration_peaks": [{"time_s": time, "height_m_per_s2": height} for time, height in peaks],
    }


def test_series_come_back_as_they_were(tmp_path: Path) -> None:
    write_convergences(tmp_path, {"run": FOUND})
    assert read_convergences(tmp_path, {"run": "key"}) == {"run": FOUND}
    assert (tmp_path / FOLDER / "convergence.json").is_file()


def test_only_known_uncertainties_are_given(tmp_path: Path) -> None:
    write_convergences(tmp_path, {"run": FOUND})
    assert read_uncertainties(tmp_path, {"run": "key"}) == {"run": {"slip.overall": pytest.approx(1.25 * 0.1)}}


def test_runs_with_other_inputs_have_no_uncertainty(tmp_path: Path) -> None:
    write_convergences(tmp_path, {"run": FOUND})
    assert read_uncertainties(tmp_path, {"run": "changed"}) == {}
    assert read_uncertainties(tmp_path, {"other": "key"}) == {}


@pytest.mark.parametrize("text", [None, "", "{"])
def test_without_a_readable_file_nothing_is_known(tmp_path: Path, text: str | None) -> None:
    if text is not None:
        (tmp_path / FOLDER).mkdir()
        (tmp_path / FOLDER / "convergence.json").write_text(text)
    assert read_uncertainties(tmp_path, {"run": "key"}) == {}


def test_numbers_of_a_run_are_events_forces_areas_and_peaks() -> None:
    events = Events(SlipEvents(1.0, 1.1, 1.2, 1.5), acceleration=SlipEvents(incipient=1.1, overall=1.6))
    numbers = stored_numbers(stored(events, [(1.1, 0.1), (1.2, 0.2), (1.6, 0.5)]))
    assert numbers["slip.latency"] == ("latency (accumulated slip)", "s", 0.5)
    assert numbers["displacement.overall"][2] is None
    assert numbers["peak_height"][1:] == ("m/s^2", 0.5)
    assert numbers["peak_count"][2] == 2.0
    assert "acceleration.noticed" not in numbers


def test_without_a_peak_of_overall_slip_there_is_no_height() -> None:
    numbers = stored_numbers(stored(Events(), [(1.1, 0.1)]))
    assert (numbers["peak_height"][2], numbers["peak_count"][2]) == (None, None)
