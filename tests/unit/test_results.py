"""Results of runs: what a history gives, as JSON and in folders; damaged ones count as none."""

import dataclasses
import json

import pytest

from fingerslip import results
from fingerslip.errors import ResultError
from fingerslip.results import (
    HISTORY,
    LOG,
    RESULT,
    RUN,
    quantities,
    read_result,
    result_from_mapping,
    result_mapping,
    result_of,
    stored_result,
    write_result,
)
from fingerslip.slip import Events, SlipEvents, acceleration_peaks, find_events, measures, read_measures
from fingerslip.slip.measures import Measure
from fingerslip.storage.files import file_digest, write_json
from fingerslip.units import Unit
from unit.whole_result import MADE, SWEPT, WHOLE


def test_a_history_gives_events_peaks_numbers_and_edges():
    found = result_of(MADE, "run", SWEPT)
    assert found.events == find_events(MADE)
    assert found.peaks == acceleration_peaks(MADE).peaks
    assert found.numbers == read_measures(MADE)
    assert found.edge is None
    assert (found.name, found.swept) == ("run", SWEPT)


def test_quantities_are_the_times_of_all_recorded_readings_and_the_measures_of_mechanics():
    found = quantities(WHOLE)
    assert found["slip.latency"].label == "latency (accumulated slip)"
    assert found["displacement.three_quarter"].label == "three-quarter slip (displacement)"
    assert (found["slip.overall"].unit, found["slip.overall"].value) == ("s", WHOLE.events.overall)
    assert "acceleration.noticed" not in found, "no peak belongs to it"
    area = found["contact_area_max_m2"]
    assert (area.label, area.unit, area.value) == ("largest contact area", "m^2", WHOLE.numbers["contact_area_max_m2"])
    assert found["peaks_before_overall"].value == 2.0
    assert not {"records", "contact_iterations_max", "penetration_max_m"} & set(found)
    silent = dataclasses.replace(WHOLE, events=Events(acceleration=SlipEvents(recorded=False)))
    assert not [key for key in quantities(silent) if key.startswith(("acceleration", "overall_peak", "peaks"))]
    assert quantities(silent)["slip.overall"].value is None


def test_an_added_measure_is_among_the_numbers_and_the_quantities(monkeypatch):
    added = Measure("rebound", "largest rebound", lambda _: 2e-3, Unit("m", "mm"))
    monkeypatch.setattr(measures, "MEASURES", (*measures.MEASURES, added))
    found = result_of(MADE, "run", {})
    assert found.numbers["rebound_m"] == 2e-3
    assert quantities(found)["rebound_m"] == results.Quantity("largest rebound", "m", 2e-3)
    assert quantities(WHOLE)["rebound_m"].value is None, "of a run that is older than the measure"


def write(folder, values):
    (folder / HISTORY).write_text("")
    write_json(folder / RESULT, {"files": {HISTORY: file_digest(folder / HISTORY)}, **values})
    return folder


def test_a_result_survives_json_but_for_values_and_uncertainties():
    plain = json.loads(json.dumps(result_mapping(WHOLE)))
    assert result_from_mapping(plain) == WHOLE
    assert plain["swept"] == SWEPT
    assert plain["edge_contact"] == {"boundary": "skin", "time_s": 0.12, "distance_m": 0.3e-3}
    assert plain["numbers"]["records"] == MADE.sizes["time"]
    away = dataclasses.replace(WHOLE, edge=None)
    assert result_from_mapping(result_mapping(away)) == away
    known = dataclasses.replace(WHOLE, values={"depth": "1 mm"}, uncertainty={"slip.overall": 0.1})
    assert result_mapping(known) == result_mapping(WHOLE)
    assert known.all_values == {"depth": "1 mm", **SWEPT}


@pytest.mark.parametrize("text", ["", "{", "not json", "{}", "[]", "null", '{"run": "a"}', "\ud800"])
def test_a_damaged_result_counts_as_none(tmp_path, text):
    (tmp_path / RESULT).write_bytes(text.encode("utf-8", "surrogatepass"))
    (tmp_path / HISTORY).write_text("")
    assert read_result(tmp_path) is None


@pytest.mark.parametrize("key", sorted(result_mapping(WHOLE)))
def test_a_result_that_lacks_anything_or_has_another_kind_of_data_counts_as_none(tmp_path, key):
    values = result_mapping(WHOLE)
    assert read_result(write(tmp_path, {name: value for name, value in values.items() if name != key})) is None
    if key in ("events_s", "acceleration_peaks", "numbers", "swept", "versions"):
        assert read_result(write(tmp_path, values | {key: 3})) is None


def test_what_is_written_is_read_back_and_without_its_history_counts_as_none(tmp_path):
    (tmp_path / HISTORY).write_text("history")
    (tmp_path / RUN).write_text("title: a")
    write_result(WHOLE, tmp_path)
    assert stored_result(tmp_path) == read_result(tmp_path) == WHOLE
    (tmp_path / HISTORY).unlink()
    assert read_result(tmp_path) is read_result(tmp_path / "nowhere") is None


@pytest.mark.parametrize("name", [HISTORY, RESULT, RUN])
@pytest.mark.parametrize("damage", ["changed", "empty", "folder", "missing"])
def test_a_damaged_file_is_named_and_never_trusted(tmp_path, name, damage):
    (tmp_path / HISTORY).write_text("history")
    (tmp_path / RUN).write_text("title: a")
    write_result(WHOLE, tmp_path)
    content = (tmp_path / name).read_text()
    (tmp_path / name).unlink()
    if damage == "folder":
        (tmp_path / name).mkdir()
    elif damage != "missing":
        (tmp_path / name).write_text(
            content.replace("1", "2").replace("a", "b").replace("h", "i") * (damage != "empty")
        )
    assert read_result(tmp_path) is None
    lacks_all = damage == "missing" and name != RUN
    message = "holds no finished run" if lacks_all else rf"{name}: (is damaged|has no checksum|cannot be read)"
    with pytest.raises(ResultError, match=rf"{message}.*; run the study again$"):
        stored_result(tmp_path)


def test_every_file_but_the_log_is_proven_by_its_checksum(tmp_path):
    for name in (HISTORY, RUN, "snapshots/0.vtu", "snapshots.pvd", LOG):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("written")
    write_result(WHOLE, tmp_path)
    (tmp_path / LOG).write_text("written until the end")
    assert stored_result(tmp_path) == stored_result(tmp_path, is_whole=True) == WHOLE
    (tmp_path / "snapshots" / "0.vtu").write_text("writtem")
    with pytest.raises(ResultError, match=r"0\.vtu: is damaged: its checksum is another; run the study again"):
        stored_result(tmp_path)
    assert stored_result(tmp_path, is_whole=True) == WHOLE
