"""Tables of slip events, peaks and published statements."""

from __future__ import annotations

import csv
import io

import pytest
from rich.console import Console

from fingerslip.published import published
from fingerslip.report.tables.events import (
    RunEvents,
    compare_table,
    events_table,
    flatten,
    peaks_table,
    statements_table,
    summary_table,
    ways_table,
)
from fingerslip.report.tables.table import to_csv, to_markdown, to_rich
from fingerslip.slip import Events, Peak, PeakTable, SlipEvents

FULL = SlipEvents(incipient=1.5, noticed=1.6, three_quarter=1.65, overall=1.75)
EVENTS = Events(slip=FULL, displacement=SlipEvents(incipient=1.45), acceleration=SlipEvents(overall=1.71))
RUNS = (
    RunEvents(
        "friction_coefficient-0.6",
        {"contact.friction_coefficient": 0.6, "fingertip.phalanx.variant": "original"},
        EVENTS,
        {"fingertip.fingerprint.enabled": False},
    ),
    RunEvents(
        "friction_coefficient-0.8",
        {"contact.friction_coefficient": 0.8, "fingertip.phalanx.variant": "original"},
        Events(),
        {"fingertip.fingerprint.enabled": False},
    ),
)


def test_summary_has_the_swept_paths_and_twelve_times_in_seconds() -> None:
    first, second = csv.DictReader(io.StringIO(to_csv(summary_table(RUNS))))
    assert list(first) == [
        "contact.friction_coefficient",
        "fingertip.phalanx.variant",
        *("incipient_s", "three_quarter_s", "overall_s", "latency_s"),
        *("incipient_s_displacement", "three_quarter_s_displacement", "overall_s_displacement"),
        "latency_s_displacement",
        *("incipient_s_acceleration", "three_quarter_s_acceleration", "overall_s_acceleration"),
        "latency_s_acceleration",
    ]
    assert (first["incipient_s"], first["latency_s"], first["overall_s_acceleration"]) == ("1.5", "0.25", "1.71")
    assert (first["overall_s_displacement"], first["latency_s_acceleration"]) == ("", "")
    assert set(list(second.values())[2:]) == {""}


def test_events_table_is_for_people() -> None:
    lines = to_markdown(events_table(RUNS)).splitlines()
    assert lines[0].startswith("| friction coefficient | variant | incipient [s] | 48 % [s] | three-quarter [s] |")
    assert lines[1] == "| ---: | --- | ---: | ---: | ---: | ---: | ---: |"
    assert lines[2] == "| 0.6 | original | 1.500 | 1.600 | 1.650 | 1.750 | 250 |"
    assert lines[3] == "| 0.8 | original | - | - | - | - | - |"


def test_run_without_sweep_is_named() -> None:
    table = events_table([RunEvents("run", {}, EVENTS)])
    assert table.columns[0].name == "run"
    assert table.rows[0][0] == "run"


def test_swept_paths_with_one_ending_keep_their_whole_names() -> None:
    run = RunEvents("r", {"a.speed": "1 mm/s", "b.speed": "2 mm/s"}, EVENTS)
    assert [column.name for column in events_table([run]).columns[:2]] == ["a.speed", "b.speed"]


def test_ways_table_has_a_row_for_each_way() -> None:
    table = ways_table(RunEvents("r", {}, EVENTS))
    assert [row[0] for row in table.rows] == ["accumulated slip", "displacement", "acceleration peaks"]
    assert table.rows[0][-1] == pytest.approx(250.0)
    assert table.rows[2][1:] == (None, None, None, 1.71, None)


def test_units_survive_the_terminal() -> None:
    console = Console(width=150, record=True, file=io.StringIO())
    console.print(to_rich(events_table(RUNS)))
    text = console.export_text()
    assert "[s]" in text
    assert "[ms]" in text


def test_peaks_are_ranked() -> None:
    peaks = PeakTable((Peak(1.5, 0.06, 0.05), Peak(1.7, 0.6, 0.59)), noise_floor=0.01, noise_spread=0.005)
    rows = peaks_table(peaks).rows
    assert rows[0] == (1, 1.7, 0.6, 0.59, pytest.approx(118.0))
    assert rows[1][:2] == (2, 1.5)


def test_comparison_takes_runs_that_meet_the_conditions() -> None:
    table = compare_table(RUNS, published("wang2014-table2"))
    assert [row[:4] for row in table.rows] == [
        (0.6, "original", "incipient", "1.53"),
        (0.6, "original", "overall", "1.71"),
        (0.6, "original", "latency", "0.18"),
    ]
    assert [column.unit for column in table.columns] == ["", "", "", "s", "s", "ms", "s", "ms", "s", "ms"]
    slip, displacement, acceleration = (table.rows[1][4:6], table.rows[1][6:8], table.rows[1][8:10])
    assert slip == (1.75, pytest.approx(40.0))
    assert displacement == (None, None)
    assert acceleration == (1.71, pytest.approx(0.0))


def test_difference_to_a_range_is_to_its_nearer_end() -> None:
    row = compare_table(RUNS, published("wang2014-peaks")).rows[1]
    assert row[2:4] == ("three-quarter", "1.63 to 1.65")
    assert row[4:6] == (1.65, pytest.approx(0.0, abs=1e-9))


def test_terminal_table_fits_eighty_columns() -> None:
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(to_rich(compare_table(RUNS, published("wang2014-table2"))))
    text = console.export_text()
    assert "…" not in text
    assert "original" in text


def test_run_whose_values_are_not_known_is_not_compared() -> None:
    unknown = RunEvents("r", {"fingertip.phalanx.variant": "original"}, EVENTS)
    assert compare_table([unknown], published("wang2014-table2")).rows == ()


def test_statements_are_shown_with_their_check() -> None:
    table = statements_table(published("wang2014-qualitative"))
    assert any("edges of the contact" in str(row[0]) for row in table.rows)
    assert all(row[1] for row in table.rows)
    assert statements_table(published("wang2014-table2")).rows == ()


def test_flatten_keeps_leaves_and_numbers_lists() -> None:
    nested = {"contact": {"friction_coefficient": 0.6}, "programme": [{"press": {"depth": "1 mm"}}], "none": {}}
    assert flatten(nested) == {
        "contact.friction_coefficient": 0.6,
        "programme.0.press.depth": "1 mm",
        "none": {},
    }


def test_known_uncertainties_stand_beside_their_times() -> None:
    known = RunEvents(
        "run", {"mu": 0.6}, EVENTS, {}, {"slip.overall": 0.0123, "slip.latency": 0.02, "peak_height": 9.0}
    )
    lines = to_markdown(events_table([known, RUNS[1]])).splitlines()
    assert "| 1.500 | 1.600 | 1.650 | 1.750 ± 0.012 | 250 ± 20 |" in lines[2]
    assert "±" in events_table([known]).note
    assert events_table(RUNS).note == ""
    assert "1.750 ± 0.012" in to_markdown(ways_table(known))
    (row,) = csv.DictReader(io.StringIO(to_csv(summary_table([known]))))
    assert (row["overall_s"], row["slip_overall_uncertainty_s"]) == ("1.75", "0.0123")
    assert not any("peak" in name for name in row)


def test_swept_lists_and_mappings_become_text_that_tables_can_show() -> None:
    """Directions are lists and friction laws mappings; numbers stay numbers."""
    given = {"slide.direction": [1, 0, -1], "contact.friction": {"law": "kinetic", "drop": [0.1, 0.2]}, "depth": 0.6}
    run = RunEvents("run", given, EVENTS)
    assert run.swept == {"slide.direction": "1, 0, -1", "contact.friction": "law kinetic, drop 0.1, 0.2", "depth": 0.6}
    assert "1, 0, -1" in to_markdown(events_table([run]))
    hash(tuple(run.swept.values()))
