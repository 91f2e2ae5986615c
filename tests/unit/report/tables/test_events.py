"""Tables of slip events and peaks: every missing time says why it is missing."""

from __future__ import annotations

import dataclasses
import io

import pytest
from rich.console import Console

from fingerslip.report.tables.runs import events_table, peaks_table, readings_table, run_notes, time_cell
from fingerslip.results import RunResult
from fingerslip.slip import Events, Peak, PeakTable
from fingerslip.slip import windows as names
from fingerslip.tables.table import Measured, Missing, to_markdown, to_rich
from unit.report.tables.runs import CUT_OFF, EVENTS, RUNS, UNRECORDED


def test_events_table_is_for_people() -> None:
    lines = to_markdown(events_table(RUNS)).splitlines()
    assert lines[0].startswith("| friction coefficient | phalanx | incipient [s] | 48 % [s] | three-quarter [s] |")
    assert lines[1] == "| ---: | --- | ---: | ---: | ---: | ---: | ---: |"
    assert lines[2] == "| 0.6 | original | 1.500 | 1.600 | 1.650 | 1.750 | 250 |"
    assert lines[3] == "| 0.8 | original | none | none | none | none | none |"
    assert lines[-1] == "none: the event did not happen."


@pytest.mark.parametrize(
    ("step", "row"), [(0.1, "1.5 | 1.6 | 1.6 | 1.8 | 200"), (2e-3, "1.500 | 1.600 | 1.650 | 1.750 | 250")]
)
def test_times_have_the_digits_that_the_step_allows(step: float, row: str) -> None:
    run = RunResult("r", {}, EVENTS, numbers={"slide_step_s": step})
    assert row in to_markdown(events_table([run]))
    known = dataclasses.replace(run, uncertainty={"slip.overall": 0.004})
    assert "1.750 ± 0.004" in to_markdown(events_table([known]))


def test_runs_without_sweep_are_named_where_there_are_several() -> None:
    one, other = (RunResult(name, {}, EVENTS) for name in ("run", "again"))
    assert [column.name for column in events_table([one]).columns] == [*names.EVENTS.values(), names.LATENCY]
    table = events_table([one, other])
    assert table.columns[0].name == "run"
    assert [row[0] for row in table.rows] == ["run", "again"]


def test_swept_paths_with_one_ending_keep_their_whole_names() -> None:
    run = RunResult("r", {"a.speed": "1 mm/s", "b.speed": "2 mm/s"}, EVENTS)
    assert [column.name for column in events_table([run]).columns[:2]] == ["a.speed", "b.speed"]


def test_readings_table_has_a_row_for_each_reading() -> None:
    table = readings_table(RunResult("r", {}, EVENTS))
    assert [row[0] for row in table.rows] == ["accumulated slip", "displacement", "acceleration peaks"]
    assert table.rows[0][-1] == pytest.approx(250.0)
    none, undefined = Missing.NO_EVENT, Missing.NOT_DEFINED
    assert table.rows[2][1:] == (none, undefined, none, 1.71, none)


def test_a_reading_that_was_not_recorded_is_told_from_an_event_that_did_not_happen() -> None:
    run = RunResult("r", {}, UNRECORDED)
    assert time_cell(run, "acceleration", "overall") is Missing.NOT_RECORDED
    assert time_cell(run, "displacement", "overall") is Missing.NO_EVENT
    assert time_cell(run, "acceleration", "noticed") is Missing.NOT_DEFINED
    table = readings_table(run)
    assert to_markdown(table).splitlines()[4] == "| acceleration peaks | n/r | n/a | n/r | n/r | n/r |"
    for text in ("none: the event did not happen", "n/r: not recorded in this run", "n/a: not applicable"):
        assert text in table.legend


def test_units_survive_the_terminal() -> None:
    console = Console(width=150, record=True, file=io.StringIO())
    console.print(to_rich(events_table(RUNS)))
    text = console.export_text()
    assert "[s]" in text
    assert "[ms]" in text
    assert "none: the event did not happen" in text


def test_peaks_are_ranked() -> None:
    peaks = PeakTable((Peak(1.5, 0.06, 0.05), Peak(1.7, 0.6, 0.59)), noise_floor=0.01, noise_spread=0.005)
    rows = peaks_table(peaks).rows
    assert rows[0] == (1, 1.7, 0.6, 0.59, pytest.approx(118.0))
    assert rows[1][:2] == (2, 1.5)


def test_a_signal_without_peaks_says_so() -> None:
    table = peaks_table(PeakTable(noise_floor=0.02, noise_spread=0.005))
    assert table.rows == ()
    assert table.note.startswith("No peak stands out from the noise. Noise floor 0.02 m/s²")


def test_known_uncertainties_stand_beside_their_times() -> None:
    known = RunResult("run", {"mu": 0.6}, EVENTS, uncertainty={"slip.overall": 0.0123, "slip.latency": 0.02})
    lines = to_markdown(events_table([known, RUNS[1]])).splitlines()
    assert "| 1.500 | 1.600 | 1.650 | 1.750 ± 0.012 | 250 ± 20 |" in lines[2]
    assert "±" in events_table([known]).note
    for table in (events_table(RUNS), events_table(RUNS, "displacement"), readings_table(RUNS[0])):
        assert table.note == names.NOTICED_NOTE
    assert events_table(RUNS, "acceleration").note == "", "no peak belongs to 48 %"
    assert "1.750 ± 0.012" in to_markdown(readings_table(known))
    assert time_cell(known, "slip", "latency", 1e3) == Measured(pytest.approx(250.0), pytest.approx(20.0))


def test_contact_at_a_free_edge_is_warned_of_in_every_table_of_events() -> None:
    expected = "angle 30 deg ('skin' from 0.12 s on, smallest distance 0.3 mm)"
    for table in (events_table([RUNS[0], CUT_OFF]), readings_table(CUT_OFF)):
        assert expected in table.note
        assert "cut off" in table.note
    assert run_notes(RUNS) == ""
    away = dataclasses.replace(CUT_OFF, edge=None)
    assert run_notes([away]) == ""


def test_swept_lists_and_mappings_become_text_that_tables_can_show() -> None:
    """Directions are lists and friction laws mappings; numbers stay numbers."""
    given = {"slide.direction": [1, 0, -1], "contact.friction": {"law": "kinetic", "drop": [0.1, 0.2]}, "depth": 0.6}
    row = events_table([RunResult("run", given, Events())]).rows[0]
    assert row[:3] == ("1, 0, -1", "law kinetic, drop 0.1, 0.2", 0.6)
    hash(row)
