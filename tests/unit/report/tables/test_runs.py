"""Tables of runs: events and peaks, measures, energies, the summary and data frames."""

import copy
import csv
import dataclasses
import io
from pathlib import Path

import numpy as np
import pytest

from fingerslip.report.labels import run_title
from fingerslip.report.tables import runs as tables
from fingerslip.results import RefusedRun, RunResult, StudyResult
from fingerslip.slip import Events, Peak, PeakTable, SlipEvents, measures
from fingerslip.slip import windows as names
from fingerslip.slip.measures import Measure
from fingerslip.tables.table import Measured, Missing, texts, to_csv, to_markdown
from fingerslip.units import Unit
from unit.report.scenes import block_history
from unit.report.tables.runs import CUT_OFF, EVENTS, RUNS, UNRECORDED


@pytest.mark.parametrize(
    ("step", "row"), [(0.1, "1.5 | 1.6 | 1.6 | 1.8 | 200"), (2e-3, "1.500 | 1.600 | 1.650 | 1.750 | 250")]
)
def test_times_have_the_digits_that_the_step_allows(step, row):
    run = RunResult("r", {}, EVENTS, numbers={"slide_step_s": step})
    assert row in to_markdown(tables.events_table([run]))
    known = dataclasses.replace(run, uncertainty={"slip.overall": 0.004})
    assert "1.750 ± 0.004" in to_markdown(tables.events_table([known]))


@pytest.mark.parametrize(
    ("step", "bar", "said"),
    [
        (0.01, None, "20"),
        (0.002, None, "17"),
        (1e-4, None, "17"),
        (0.01, 0.012, "17 ± 12"),
        (0.01, 0.0025, "16.8 ± 2.5"),
        (0.01, 0.004, "17 ± 4"),
        (0.01, 3e-4, "16.8 ± 0.3"),
    ],
)
def test_a_latency_is_that_of_times_as_they_are_with_the_digits_of_its_uncertainty_wherever_it_stands(step, bar, said):
    events = Events(SlipEvents(incipient=0.33834, overall=0.35514))
    uncertainty = {} if bar is None else {"slip.latency": bar}
    run = RunResult("r", {}, events, numbers={"slide_step_s": step}, uncertainty=uncertainty)
    others = [dataclasses.replace(run, name="other", uncertainty={"slip.latency": 1e-3}), run]
    for row in (texts(tables.events_table([run]))[0], texts(tables.events_table(others))[1]):
        assert row[-1] == said
    assert tables.latency_span([run]) == f"{said} ms"
    cell = copy.deepcopy(tables.time_cell(run, "slip", names.LATENCY, 1e3))
    assert (cell if bar is None else cell.value) == pytest.approx(16.8)


def test_runs_without_sweep_are_named_where_there_are_several():
    one, other = (RunResult(name, {}, EVENTS) for name in ("run", "again"))
    assert [column.name for column in tables.events_table([one]).columns] == [*names.EVENTS.values(), names.LATENCY]
    table = tables.events_table([one, other])
    assert table.columns[0].name == "run"
    assert [row[0] for row in table.rows] == ["run", "again"]
    run = RunResult("r", {"a.speed": "1 mm/s", "b.speed": "2 mm/s"}, EVENTS)
    assert [column.name for column in tables.events_table([run]).columns[:2]] == ["a speed", "b speed"]
    # Directions are lists and friction laws mappings, which tables show as text; numbers stay numbers.
    given = {"slide.direction": [1, 0, -1], "contact.friction": {"law": "kinetic", "drop": [0.1, 0.2]}, "depth": 0.6}
    row = tables.events_table([RunResult("run", given, Events())]).rows[0]
    assert row[:3] == ("1, 0, -1", "law kinetic, drop 0.1, 0.2", 0.6)
    hash(row)


def test_readings_have_a_row_each_and_what_was_not_recorded_is_told_from_what_did_not_happen():
    table = tables.readings_table(RunResult("r", {}, EVENTS))
    assert [row[0] for row in table.rows] == ["accumulated slip", "displacement", "acceleration peaks"]
    assert table.rows[0][-1] == pytest.approx(250.0)
    none, undefined = Missing.NO_EVENT, Missing.NOT_DEFINED
    assert table.rows[2][1:] == (none, undefined, none, 1.71, none)
    run = RunResult("r", {}, UNRECORDED)
    assert tables.time_cell(run, "acceleration", "overall") is Missing.NOT_RECORDED
    assert tables.time_cell(run, "displacement", "overall") is none
    assert tables.time_cell(run, "acceleration", "noticed") is undefined
    table = tables.readings_table(run)
    assert to_markdown(table).splitlines()[4] == "| acceleration peaks | n/r | n/a | n/r | n/r | n/r |"
    for text in ("none: the event did not happen", "n/r: not recorded in this run", "n/a: not applicable"):
        assert text in table.legend


def test_peaks_are_ranked():
    peaks = PeakTable((Peak(1.5, 0.06, 0.05), Peak(1.7, 0.6, 0.59)), noise_floor=0.01, noise_spread=0.005)
    rows = tables.peaks_table(peaks).rows
    assert rows[0] == (1, 1.7, 0.6, 0.59, pytest.approx(118.0))
    assert rows[1][:2] == (2, 1.5)
    table = tables.peaks_table(PeakTable(noise_floor=0.02, noise_spread=0.005))
    assert table.rows == ()
    assert table.note.startswith("No peak stands out from the noise. Noise floor 0.02 m/s²")


def test_known_uncertainties_stand_beside_their_times_and_contact_at_a_free_edge_is_warned_of():
    known = RunResult("run", {"mu": 0.6}, EVENTS, uncertainty={"slip.overall": 0.0123, "slip.latency": 0.02})
    lines = to_markdown(tables.events_table([known, RUNS[1]])).splitlines()
    assert "| 1.500 | 1.600 | 1.650 | 1.750 ± 0.012 | 250 ± 20 |" in lines[2]
    assert "±" in tables.events_table([known]).note
    for table in (tables.events_table(RUNS), tables.events_table(RUNS, "displacement"), tables.readings_table(RUNS[0])):
        assert table.note == names.NOTICED_NOTE
    assert tables.events_table(RUNS, "acceleration").note == "", "no peak belongs to 48 %"
    assert "1.750 ± 0.012" in to_markdown(tables.readings_table(known))
    assert tables.time_cell(known, "slip", "latency", 1e3) == Measured(pytest.approx(250.0), pytest.approx(20.0))
    (warning,) = tables.run_caveats([RUNS[0], CUT_OFF])
    assert "angle 30 deg ('skin' from 0.12 s on, smallest distance 0.3 mm)" in warning
    assert "cut off" in warning
    assert "cut off" not in tables.events_table([CUT_OFF]).note, "said once, beside the answer"
    assert tables.run_notes(RUNS) == tables.run_notes([CUT_OFF]) == ""
    whole = dataclasses.replace(CUT_OFF, edge=None)
    assert tables.run_caveats([whole]) == ()
    doubted = [dataclasses.replace(whole, swept={"n": number}, doubts=("contacts.0: turns",)) for number in range(5)]
    coarse = dataclasses.replace(whole, numbers={"slide_records": 5}, doubts=("contacts.0: turns",))
    assert [said.partition(":")[0] for said in tables.run_caveats([coarse])] == [
        f"Doubtful in {run_title(coarse, coarse.name)}", "Too coarse for the times of slip"
    ]  # fmt: skip
    assert tables.run_caveats([*doubted, whole]) == ("Doubtful in n 0, n 1, n 2 and 2 more: contacts.0: turns.",)


NUMBERS = {"normal_force_max_N": 0.159664, "contact_area_max_m2": 1.351e-5, "records": 601, "edge_distance_min_m": None}


def shown(run):
    return {row[0]: row[1:] for row in texts(tables.measures_table([run], ["value"]))}


def test_measures_are_shown_in_readable_units_with_four_digits():
    rows = shown(dataclasses.replace(RUNS[0], numbers=NUMBERS))
    assert rows["largest normal force"] == ["N", "0.1597"]
    assert rows["largest contact area"] == ["mm²", "13.51"]
    assert rows["records"] == ["", "601"]
    assert set(rows) == {measure.label for measure in measures.MEASURES}
    uncertainty = {"contact_area_max_m2": 1.18e-7, "friction_force_ratio_end_of_slide": 0.0123}
    numbers = {**NUMBERS, "friction_force_ratio_end_of_slide": 0.6}
    rows = shown(dataclasses.replace(RUNS[0], numbers=numbers, uncertainty=uncertainty))
    assert rows["largest contact area"] == ["mm²", "13.51 ± 0.12"]
    assert rows["friction over normal force at the end of the slide"] == ["", "0.6 ± 0.012"]
    assert rows["records"] == ["", "601"]


def test_a_missing_number_says_why_and_an_added_measure_has_a_row_and_a_column(monkeypatch):
    numbers = {**NUMBERS, "overall_peak_height_m_per_s2": None}
    recorded, lacking = (
        dataclasses.replace(RUNS[0], numbers=numbers, events=one) for one in (RUNS[0].events, UNRECORDED)
    )
    name = "height of the acceleration peak of overall slip"
    assert (shown(recorded)[name][1], shown(lacking)[name][1]) == ("none", "n/r")
    assert shown(recorded)["smallest distance from the contact to a free edge"][1] == "n/a"
    assert shown(recorded)["largest penetration"][1] == "n/r", "of a run that is older than the measure"
    added = Measure("rebound", "largest rebound", lambda _: 2e-3, Unit("m", "mm"))
    monkeypatch.setattr(measures, "MEASURES", (*measures.MEASURES, added))
    run = dataclasses.replace(RUNS[0], numbers={"rebound_m": 2e-3})
    assert shown(run)["largest rebound"] == ["mm", "2"]
    assert rows_of((run,))[0]["rebound_m"] == "0.002"


def test_the_balance_closes_and_older_histories_say_what_they_lack():
    history = block_history("Q4")
    table = tables.energies_table({"a": history, "older": history.drop_vars("viscous_dissipation")})
    rows = {str(row[0]): row[2:] for row in table.rows}
    work, *parts = (rows[name][0] for name in list(rows)[:-1])
    assert work == pytest.approx(sum(parts))
    assert rows["largest imbalance over largest work"][0] < 1e-9
    assert rows["relaxation of materials"][1] is Missing.NOT_RECORDED


TIMES = [
    f"{event}_s{suffix}"
    for suffix in ("", "_displacement", "_acceleration")
    for event in ("incipient", "noticed", "three_quarter", "overall", "latency")
    if (event, suffix) != ("noticed", "_acceleration")
]


def rows_of(runs):
    return list(csv.DictReader(io.StringIO(to_csv(tables.summary_table(runs)))))


def test_columns_are_swept_paths_all_times_what_was_recorded_all_measures_and_their_uncertainties():
    first, second = rows_of(RUNS)
    keys = [measure.key for measure in measures.MEASURES]
    swept = ["contact.friction_coefficient", "fingertip.phalanx.variant"]
    assert list(first) == ["run", *swept, *TIMES, "readings_recorded", *keys]
    assert (first["incipient_s"], first["latency_s"], first["overall_s_acceleration"]) == ("1.5", "0.25", "1.71")
    assert (first["overall_s_displacement"], first["latency_s_acceleration"]) == ("", "")
    assert {second[name] for name in TIMES} == {""}
    lacking, whole = rows_of((RunResult("a", {}, UNRECORDED), RunResult("b", {}, EVENTS)))
    assert (lacking["overall_s_acceleration"], lacking["readings_recorded"]) == ("", "slip displacement")
    assert whole["readings_recorded"] == "slip displacement acceleration"
    known = dataclasses.replace(
        RUNS[0],
        numbers={"normal_force_max_N": 0.4, "records": 3},
        uncertainty={"slip.overall": 0.0123, "normal_force_max_N": 0.01, "friction_force_ratio_end_of_slide": 0.2},
    )
    (row,) = rows_of((known,))
    assert (row["overall_s"], row["overall_uncertainty_s"]) == ("1.75", "0.0123")
    assert (row["normal_force_max_N"], row["normal_force_max_uncertainty_N"]) == ("0.4", "0.01")
    assert row["friction_force_ratio_end_of_slide_uncertainty"] == "0.2"
    assert (row["records"], row["contact_area_max_m2"]) == ("3", "")


def test_frames_have_numbers_words_and_quantities_in_si_whose_unit_is_known():
    frame = tables.runs_frame(StudyResult(Path("results/x"), (), RUNS, title="Friction"))
    assert frame["run"].tolist() == ["friction_coefficient-0.6", "friction_coefficient-0.8"]
    assert frame["contact.friction_coefficient"].tolist() == [0.6, 0.8]
    assert frame["fingertip.phalanx.variant"].tolist() == ["original", "original"]
    assert frame["overall_s"].dtype == np.float64
    assert frame["overall_s"].tolist() == pytest.approx([1.75, np.nan], nan_ok=True)
    assert frame.attrs["title"] == "Friction"
    assert frame["overall_s_displacement"].dtype == np.float64, "a number that no run has is missing, not a word"
    assert np.isnan(frame["overall_s_displacement"]).all()
    runs = tuple(
        RunResult(str(number), {"mesh.contact_size": size, "programme.1.slide.speed": speed}, EVENTS)
        for number, (size, speed) in enumerate((("0.12 mm", "3 mm/s"), ("100 um", "1 cm/s")))
    )
    frame = tables.runs_frame(StudyResult(Path("results/x"), (), runs))
    assert frame["mesh.contact_size_m"].tolist() == [0.12e-3, 1e-4]
    assert frame["programme.1.slide.speed_m_per_s"].tolist() == [3e-3, 1e-2]
    units = {"programme.1.slide.speed_m_per_s": "m/s", "latency_s_acceleration": "s", "normal_force_max_N": "N"}
    assert frame.attrs["units"].items() >= units.items()
    mixed = tuple(RunResult(text, {"x": text}, EVENTS) for text in ("1 mm", "auto", "1 s"))
    assert tables.runs_frame(StudyResult(Path("results/x"), (), mixed))["x"].tolist() == ["1 mm", "auto", "1 s"]
    assert len(tables.runs_frame(StudyResult(Path("results/x"), (), ()))) == 0
    known = dataclasses.replace(RUNS[0], uncertainty={"slip.overall": 0.0123})
    frame = tables.table_frame(tables.events_table([known, RUNS[1]]))
    assert frame["overall"].tolist() == pytest.approx([1.75, np.nan], nan_ok=True), "numbers alone, or none"
    assert frame.attrs["units"]["latency"] == "ms"


def test_refused_samples_have_a_row_and_a_reason():
    run = RunResult("sample-1", {"sample": 1}, UNRECORDED, sampled={"depth": "1 mm"}, uncertainty={"slip.overall": 0.1})
    refused = RefusedRun("sample-2", {"sample": 2}, {"depth": "9 mm"}, "too deep")
    frame = tables.runs_frame(StudyResult(Path("results/x"), (), (run,), refused=(refused,)))
    assert frame["depth_m"].tolist() == [1e-3, 9e-3]
    assert frame["refused"].tolist() == ["", "too deep"]
    assert frame["overall_uncertainty_s"].tolist() == pytest.approx([0.1, np.nan], nan_ok=True)
