"""Tables that compare: published values, refinements, two studies; of values with their sources and of models."""

import dataclasses

import pytest
import xarray as xr

from fingerslip.published import published_set
from fingerslip.report.tables import compare, parameters
from fingerslip.report.tables.parameters import ShownValue
from fingerslip.results import RunResult
from fingerslip.tables.table import Missing, texts, to_markdown
from fingerslip.uncertainty import Convergence, Series
from unit.report.scenes import block_history
from unit.report.tables.runs import EVENTS, RUNS, UNRECORDED
from unit.synthetic import Process, make

TABLE2, SOLID = published_set("wang2014-table2"), published_set("wang2014-solid")
NOT_COMPARED = Missing.NOT_COMPARED
PRINTED = {
    "original": ("1.53", "1.71", "0.18"),
    "flattened": ("1.50", "1.72", "0.22"),
    "scaled": ("1.48", "1.77", "0.29"),
}


def test_comparison_takes_runs_that_meet_the_conditions_and_says_which_published_rows_were_not_compared():
    table = compare.compare_table(RUNS, TABLE2)
    assert [row[:4] for row in table.rows] == [
        (0.6, variant, event, text)
        for variant, times in PRINTED.items()
        for event, text in zip(("incipient", "overall", "latency"), times, strict=True)
    ]
    assert [column.unit for column in table.columns] == ["", "", "", "s", "s", "ms", "s", "ms", "s", "ms"]
    slip, displacement, acceleration = (table.rows[1][4:6], table.rows[1][6:8], table.rows[1][8:10])
    assert slip == (1.75, pytest.approx(40.0))
    assert displacement == (Missing.NO_EVENT,) * 2
    assert acceleration == (1.71, pytest.approx(0.0))
    assert {cell for row in table.rows[3:] for cell in row[4:]} == {NOT_COMPARED}


def test_runs_of_other_or_unknown_values_are_not_compared_and_what_differs_is_noted():
    unknown = RunResult("r", {"fingertip.phalanx.variant": "original"}, EVENTS)
    rows = compare.compare_table([unknown], TABLE2).rows
    assert len(rows) == len(TABLE2.values)
    assert {cell for row in rows for cell in row[3:]} == {NOT_COMPARED}
    alone = compare.compare_table([RunResult("r", {}, EVENTS)], TABLE2)
    assert {len(row) for row in alone.rows} == {len(alone.columns)}, "a single run has no columns that tell it apart"
    assert {cell for row in alone.rows for cell in row[2:]} == {NOT_COMPARED}
    note = compare.compare_table(RUNS, TABLE2).note
    assert "Not compared: " in note
    assert "contact.friction_coefficient is 0.8, published for 0.6" in note
    assert "Not compared" not in compare.compare_table(RUNS[:1], TABLE2).note
    known = {**SOLID.values[0].conditions, **SOLID.values[0].programme}
    for path, value in (("programme.1.slide.direction.0", 1.0), ("fingertip.solid.angle", "10 deg")):
        table = compare.compare_table([RunResult("run", {}, UNRECORDED, values={**known, path: value})], SOLID)
        assert {cell for row in table.rows for cell in row[3:]} == {NOT_COMPARED}
        assert f"{path} is {value}, published for {known[path]}" in table.note


def test_readings_that_the_paper_does_not_print_are_told_from_no_event_and_statements_have_their_check():
    solid = RunResult("run", {}, UNRECORDED, values={**SOLID.values[0].conditions, **SOLID.values[0].programme})
    rows = {row[:2]: row[2:] for row in compare.compare_table([solid], SOLID).rows}
    assert rows["incipient", "0.90"] == (1.5, pytest.approx(600.0), *[NOT_COMPARED] * 4)
    assert rows["incipient", "0.80"] == (*[NOT_COMPARED] * 2, *[Missing.NO_EVENT] * 2, *[NOT_COMPARED] * 2)
    assert rows["overall", "1.11"] == (*[NOT_COMPARED] * 4, *[Missing.NOT_RECORDED] * 2)
    row = compare.compare_table(RUNS, published_set("wang2014-peaks")).rows[1]
    assert row[2:4] == ("three-quarter", "1.63 to 1.65")
    assert row[4:6] == (1.65, pytest.approx(0.0, abs=1e-9))
    table = compare.statements_table(published_set("wang2014-qualitative"))
    assert any("edges of the contact" in str(row[0]) for row in table.rows)
    assert all(row[1] for row in table.rows)
    assert compare.statements_table(TABLE2).rows == ()
    assert compare.compare_table(RUNS, published_set("wang2014-qualitative")).rows == ()


SIZES = (1.0, 0.5, 0.25)
GOOD = Convergence(
    "overall slip",
    "s",
    2.0,
    {
        "mesh": Series("mesh", SIZES, (2.0, 1.5, 1.25)),
        "step": Series("step", SIZES, (2.0, 2.2, 2.1)),
        "penalty": Series("penalty", SIZES, (2.0, 2.0, 2.0)),
        "alpha": Series("alpha", (-0.4, -0.05), (2.0, 2.001)),
    },
)
NEVER = Convergence("incipient slip", "s", None, {"mesh": Series("mesh", SIZES, (None, None, None))})


def test_a_number_has_its_uncertainty_by_setting_and_its_verdict():
    row = texts(compare.convergence_table({"slip.overall": GOOD}, "run"))[0]
    table = compare.convergence_table({"slip.overall": GOOD}, "run")
    assert "over element sizes, time steps, contact stiffness and numerical damping. It is" in table.note
    assert row == [
        "overall slip", "s", "2", "1.387", "1.25 (1.0)", "0.6 (up/down)", "unchanged", "0.001", "not with step"
    ]  # fmt: skip
    fast = Convergence("overall slip", "s", 2.0, {"mesh": Series("mesh", SIZES, tuple(2.0 + h**6 for h in SIZES))})
    assert texts(compare.convergence_table({"slip.overall": fast}, "run"))[0][4].endswith(" (fast)")
    rows = compare.series_table({"run": {"slip.overall": GOOD}}).rows
    assert len(rows) == 3 * 3 + 2, "one for every level"
    assert rows[1] == ("run", "slip.overall", "s", "mesh", 0.5, 1.5)


def test_what_did_not_happen_what_was_not_varied_and_what_nothing_changes_are_told_apart():
    table = compare.convergence_table({"slip.incipient": NEVER, "normal_force_max_N": NEVER}, "run")
    assert texts(table)[0][2:] == ["none"] * 7
    assert len(table.rows) == 1, "what the run does not have has no row"
    some = Convergence("largest force", "N", None, {"mesh": Series("mesh", SIZES, (None, 1.0, None))})
    table_of_some = compare.convergence_table({"normal_force_max_N": some}, "run")
    assert texts(table_of_some)[0][2:] == ["n/a"] * 7, "a measure is no event"
    assert "none: the event did not happen" in table.remarks
    lacking = Convergence("overall slip", "s", 2.0, {"step": Series("step", SIZES, (2.0, None, 1.9))})
    table = compare.convergence_table({"slip.overall": lacking}, "run")
    assert "of those over time steps. It is" in table.note
    assert "Not studied: element sizes, contact stiffness and numerical damping. ± leaves out" in table.note
    row = table.rows[0]
    assert row[3:8] == (Missing.NO_EVENT, Missing.NOT_STUDIED, Missing.NO_EVENT, *[Missing.NOT_STUDIED] * 2)
    still = Convergence("overall slip", "s", 1.748, {"step": Series("step", SIZES, (1.748,) * 3)})
    assert still.uncertainty is None
    assert texts(compare.convergence_table({"slip.overall": still}, "run"))[0][2:5] == ["1.748", "unchanged", "n/s"]
    still = dataclasses.replace(still, resolution=0.0025)
    assert texts(compare.convergence_table({"slip.overall": still}, "run"))[0][2:5] == ["1.748", "0.0025", "n/s"]


def test_what_differs_is_shown_and_what_is_only_recorded_is_named_below():
    first = {"time.step": "5 ms", "contact.friction_coefficient": "0.4", "record.snapshots_every": "50 ms"}
    second = {"time.step": "5 ms", "contact.friction_coefficient": "0.6", "damping.mass": "1 1/s"}
    table = compare.differences_table(first, second, same="Same.")
    assert table.rows == (
        ("contact.friction_coefficient", "0.4", "0.6"),
        ("damping.mass", Missing.NOT_DEFINED, "1 1/s"),
    )
    assert table.note == "Recorded differently, too, which moves no slip event: record.snapshots_every."
    table = compare.differences_table({f"record.sites.{n}.name": "a" for n in range(7)}, {}, same="Same.")
    assert table.rows == ()
    assert table.note.endswith("record.sites.3.name and 3 more.")
    table = compare.differences_table({"a": "1"}, {"a": "1"}, same="Both are the same.", note="A: x; B: y.")
    assert table.note == "Both are the same. A: x; B: y."
    assert to_markdown(table).count("\n") == 2
    assert "same" not in compare.differences_table({"record.a": "1"}, {"record.a": "2"}, same="the same").note


VALUES = (
    ShownValue("fingertip.depth", "1 mm", "not used", "of 2D sections only"),
    ShownValue("fingertip.layers.skin_thickness", "1.5 mm", "wang2014"),
    ShownValue("fingertip.sagittal.half_height", "6.5 mm", "assumed", "half the height of an adult index fingertip"),
    ShownValue("time.step", "5 ms", "study file"),
)


GROUP_OF = {
    "fingertip.materials.dermis.density": "Materials and damping",
    "materials.block.density": "Materials and damping",
    "fingertip.layers.skin_thickness": "Specimen",
    "mesh.contact_size": "Mesh and formulation",
    "depth": "Mesh and formulation",
    "contacts.0.friction.coulomb.coefficient": "Contact and friction",
    "programme.1.slide.speed": "Programme",
    "supports.top": "Supports and loads",
    "time.alpha": "Time",
    "record.sites.0.name": "Recording",
    "something.new": "Other values",
    "timetable": "Other values",
}


def test_every_value_has_its_group_assumed_ones_come_first_and_are_marked_and_unused_ones_come_last():
    assert {path: parameters.group_of(path) for path in GROUP_OF} == GROUP_OF
    tables = parameters.value_tables(VALUES)
    specimen, time = tables
    assert [specimen.title, time.title] == [title for title in parameters.GROUPS if title in ("Specimen", "Time")]
    assert sorted(str(row[0]) for table in tables for row in table.rows) == sorted(value.path for value in VALUES)
    assert [row[2] for row in specimen.rows] == ["assumed", "wang2014", "not used"]
    assert specimen.marked == (0,)
    assert specimen.note.startswith("1 of 3 values are assumed")
    assert (time.marked, time.note) == ((), "")
    assert "| time.step | 5 ms | study file |" in to_markdown(time)


CONDITIONS = (
    ShownValue("time.step", "5 ms", "study file"),
    ShownValue("fingertip.preset", "wang2014-2d", "study file"),
    ShownValue("fingertip.depth", "1 mm", "assumed", "scales all forces"),
    ShownValue("fingertip.materials.dermis.youngs_modulus", "80 kPa", "wang2014"),
    ShownValue("fingertip.layers.skin_thickness", "1.5 mm", "wang2014"),
    ShownValue("fingertip.ridges.pitch", "0.5 mm", "study file", "preset: 0.47 mm"),
    ShownValue("programme.0.press.depth", "1.5 mm", "study file"),
    ShownValue("fingertip.transverse.half_width", "8 mm", "not used"),
    ShownValue("record.receptors", "FA-I", "study file"),
)


def test_conditions_stand_in_one_order_with_overrides_and_marked_assumptions():
    histories = {name: xr.Dataset(attrs={"n_nodes": count}) for name, count in (("a", 10), ("b", 20))}
    table = parameters.conditions_table(CONDITIONS, histories)
    assert [row[:2] for row in table.rows] == [
        ("specimen, preset", "wang2014-2d"),
        ("depth out of the plane", "1 mm"),
        ("dermis: youngs modulus", "80 kPa"),
        ("press: depth", "1.5 mm"),
        ("time: step", "5 ms"),
        ("fingertip.ridges.pitch", "0.5 mm"),
        ("mesh: nodes", "10 to 20"),
    ]
    assert table.marked == (1,)
    assert "Assumed" in table.note


def test_sizes_contact_stiffness_and_solver_are_those_of_the_history():
    history = block_history("Q4")
    table = parameters.models_table({"one": history, "bare": make(Process())})
    rows = {row[0]: row[1:] for row in texts(table)}
    assert rows["element"] == ["Q4", "n/r"]
    assert rows["nodes"][0] == str(history.sizes["node"])
    assert rows["contact candidates"][0] == str(history.sizes["contact_node"])
    assert rows["mean normal penalty [Pa/m]"][0] == f"{history.attrs['normal_penalty']:.3g}"
    assert rows["linear solver"][0] == history.attrs["linear_solver"]
    assert parameters.models_table({"bare": make(Process())}).rows == ()
