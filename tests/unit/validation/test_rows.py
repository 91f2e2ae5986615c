"""Verdicts, the table, and the rows from evidence."""

import dataclasses
import json
from dataclasses import dataclass
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.errors import DamagedError, ResultError
from fingerslip.published import PublishedValue
from fingerslip.report.tables.compare import difference_from
from fingerslip.storage.files import write_json
from fingerslip.study.definition.spec import read_study
from fingerslip.tables.table import texts, to_markdown
from fingerslip.validation import rows as module
from fingerslip.validation.evidence import Work
from fingerslip.validation.measures import SOLID_READINGS
from fingerslip.validation.rows import Row, rows_markdown, rows_table
from places import ROOT
from unit.sampled import study_of

TIME = PublishedValue("overall", "overall", "published", "paper, Table 1", "s", 1.72, resolution=0.01)
RANGE = PublishedValue("middle", "three_quarter", "published", "paper, text", "s", 1.64, (1.63, 1.65), 0.01)
STATEMENT = PublishedValue(
    "order", "overall", "qualitative", "paper, text", "s", statement="A first.", check="B less A; holds above 0.02"
)


@pytest.mark.parametrize(
    ("ours", "uncertainty", "resolution", "expected"),
    [
        (1.73, None, 0.01, "agrees"),
        (1.7301, None, 0.01, "misses"),
        (1.71, 0.001, 0.01, "agrees"),
        (1.75, 0.03, 0.01, "agrees"),
        (1.75, 0.029, 0.01, "misses"),
        (None, 0.5, 0.01, "not found"),
        (1.72, 9.0, None, "not judged"),
        (None, None, None, "not found"),
    ],
)
def test_number_agrees_within_resolution_or_uncertainty(ours, uncertainty, resolution, expected):
    value = dataclasses.replace(TIME, resolution=resolution)
    row, other = (module.number_row("q", value, ours, uncertainty, comparable=either) for either in (True, False))
    assert (row.verdict, other.verdict) == (expected, "not comparable")
    assert (row.ours, row.difference) == (other.ours, other.difference) == (ours, ours and pytest.approx(ours - 1.72))


@given(st.floats(0.0, 3.0))
def test_difference_leads_back_to_the_range(ours):
    low, high = 1.63, 1.65
    difference = difference_from(ours, (low, high))
    assert low - 1e-12 <= ours - difference <= high + 1e-12
    assert (difference == 0.0) == (low <= ours <= high)
    row = module.number_row("q", RANGE, ours, None)
    assert (row.published, row.difference) == ((1.63, 1.65), difference)


@pytest.mark.parametrize(
    ("rule", "ours", "expected"),
    [
        ("above 1.5", 1.5, "fails"),
        ("from 2", 2.0, "holds"),
        ("below 0.5", 0.5, "fails"),
        ("up to 0.1", 0.1, "holds"),
        ("at 3", 3.0, "holds"),
        ("at 3", 2.0, "fails"),
        ("when only the first has any", (2, 0), "holds"),
        ("when only the first has any", (2, 1), "fails"),
        ("when only the first has any", (0, 0), "fails"),
        ("above 1", None, "not found"),
    ],
)
def test_statement_holds_by_its_own_rule(rule, ours, expected):
    value = dataclasses.replace(STATEMENT, check=f"B less A; holds {rule}")
    row = module.statement_row(value, ours, 0.007)
    number = ours[0] - ours[1] if isinstance(ours, tuple) else ours
    assert (row.quantity, row.statement, row.ours, row.uncertainty) == (value.check, "A first.", number, 0.007)
    assert (row.verdict, row.published, row.difference) == (expected, None, None)
    assert module.statement_row(value, ours, None, comparable=False).verdict == "not comparable"


def test_what_is_no_number_and_what_has_no_rule_is_a_fault_of_the_data():
    with pytest.raises(ValueError, match="order is no number"):
        module.number_row("q", STATEMENT, 1.0, None)
    with pytest.raises(ValueError, match="order: no rule"):
        module.statement_row(dataclasses.replace(STATEMENT, check="B less A"), 1.0, None)


def test_table_json_and_markdown_have_the_same_rows_and_keep_misses():
    rows = (
        module.number_row("overall slip", TIME, 1.84, 0.002),
        module.statement_row(STATEMENT, None, None),
    )
    table = rows_table(rows)
    assert table.rows[0][:5] == ("overall slip", "paper, Table 1", "1.72", 1.84, pytest.approx(0.12))
    assert table.rows[1][0] == "A first. (B less A; holds above 0.02)"
    plain = json.loads(json.dumps(module.rows_mapping(rows)))
    assert [entry["verdict"] for entry in plain] == ["misses", "not found"]
    assert plain[1]["ours"] is None
    assert set(plain[0]) == set(Row.__dataclass_fields__)
    (plain,) = module.rows_mapping([module.number_row("overall slip", TIME, float("nan"), None)])
    assert (plain["ours"], plain["uncertainty"]) == (None, None), "JSON has no other word for what is no number"
    text = rows_markdown([module.number_row("overall slip", RANGE, 1.84, None)])
    assert "fingerslip validate --markdown" in text
    assert "| overall slip | paper, text | 1.63 to 1.65 | 1.840 | 0.190 | n/s | s | misses | predicted |" in text


@dataclass(frozen=True)
class One:
    """A row."""

    name: str
    span: tuple[float, float]


FILE = module.RowFile("ones.json", "ones", "fingerslip validate --ones", "an hour", ("wang2014_friction",), One)
ROWS = (One("a", (1.0, 2.0)),)
OTHER_VERSION = r"ones.json: is of another version \(.*\); run fingerslip validate --ones"


def test_computed_rows_are_stored_and_read_back_before_those_that_ship(tmp_path):
    work, reference = Work(ROOT / "studies", tmp_path), tmp_path / "reference"
    nothing = module.stored_rows(FILE, Work(tmp_path, tmp_path))
    assert nothing.rows == ()
    assert nothing.origin == "No ones are stored; fingerslip validate --ones computes them, which takes an hour."
    reference.mkdir()
    module.stored_rows(FILE, Work(ROOT / "studies", reference), lambda: ROWS)
    assert str(reference) in module.stored_rows(FILE, work).origin
    made = module.stored_rows(FILE, work, lambda: ROWS)
    assert (made.rows, made.origin, made.computed) == (ROWS, "", True)
    again = module.stored_rows(FILE, work)
    assert (again.rows, again.computed) == (ROWS, False)
    assert again.origin.startswith(f"Ones are stored in {tmp_path / 'ones.json'} by fingerslip")
    assert "the studies are the same" in again.origin


def test_rows_say_that_studies_have_changed_or_that_runs_are_read_in_another_way(tmp_path):
    read = dataclasses.replace(FILE, reading={"tolerance [m]": 50e-6})
    module.stored_rows(read, Work(ROOT / "studies", tmp_path), lambda: ROWS)
    assert "the studies are the same" in module.stored_rows(read, Work(ROOT / "studies", tmp_path)).origin
    for reading in ({"tolerance [m]": 20e-6}, {}):
        other = dataclasses.replace(FILE, reading=reading)
        again = module.stored_rows(other, Work(ROOT / "studies", tmp_path))
        assert "how their runs are read has changed since" in again.origin
    (tmp_path / "wang2014_friction.yaml").write_text("title: another\n")
    assert "the studies have changed since" in module.stored_rows(read, Work(tmp_path, tmp_path)).origin


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{broken", "run fingerslip validate --ones"),
        ("{}", "run fingerslip validate --ones"),
        ({"rows": [{"name": "alone"}], "made": {"version": "0", "inputs": {}}}, OTHER_VERSION),
        ({"rows": [], "made": "fingerslip validate --ones"}, OTHER_VERSION),
        ({"made": {"version": "0", "inputs": {}}}, OTHER_VERSION),
    ],
)
def test_files_that_are_damaged_or_of_another_version_say_what_makes_them_again(tmp_path, content, message):
    path = tmp_path / "ones.json"
    path.write_text(content) if isinstance(content, str) else write_json(path, content)
    with pytest.raises(DamagedError if isinstance(content, str) else ResultError, match=message):
        module.stored_rows(FILE, Work(tmp_path, tmp_path))


GEOMETRY_ROWS = (
    module.GeometryRow("overall slip", "Table 2", 1.71, (1.5, 1.55, 1.6, 1.7, 1.8), "within, at 97 %", 50, 50),
    module.GeometryRow("incipient slip", "Table 2", (1.63, 1.65), None, "", 0, 50),
)


def section(folder):
    return dataclasses.replace(study_of(), folder=folder / "wang2014_geometry")


def test_rows_name_model_and_reading_and_those_in_3d_are_read_at_the_reference_nodes(tmp_path, monkeypatch):
    rows, times = module.geometry_rows(section(tmp_path)), ("incipient slip", "overall slip", "latency")
    assert [row.quantity for row in rows] == [f"{time}, original, section (accumulated slip)" for time in times]
    overall = rows[1]
    assert (overall.published, overall.found, overall.samples) == (1.71, 12, 12)
    assert list(overall.interval) == sorted(overall.interval)
    read = []
    monkeypatch.setattr(module, "measure_folder", lambda at, run, _: read.append(at) or SimpleNamespace(run=run))
    study = dataclasses.replace(study_of(compare="wang2014-solid"), folder=tmp_path / "wang2014_geometry_3d")
    rows = module.geometry_rows(study)
    assert read == [study.folder / run.name for run in study.runs]
    assert rows[0].quantity == f"incipient slip, in 3D ({SOLID_READINGS['slip']})"


@pytest.mark.slow
def test_computed_intervals_are_stored_and_read_back(tmp_path, monkeypatch):
    ran = []
    monkeypatch.setattr(
        "fingerslip.validation.evidence.run_plans", lambda plans, **_: ran.append(plans) or (section(tmp_path),)
    )
    made = module.allowed_geometry(Work(ROOT / "studies", tmp_path), compute=True)
    assert [plan.source.stem for plan in ran[0]] == list(module.GEOMETRY)
    again = module.allowed_geometry(Work(ROOT / "studies", tmp_path))
    assert (made.rows, made.computed) == (again.rows, True)
    assert (len(ran), again.computed) == (1, False)


def test_table_has_a_row_for_each_published_time():
    table = module.geometry_table(GEOMETRY_ROWS, "Stored.")
    assert texts(table) == [
        ["overall slip", "Table 2", "1.71", "1.500", "1.550", "1.600", "1.700", "1.800", "within, at 97 %", "50 of 50"],
        ["incipient slip", "Table 2", "1.63 to 1.65", *["none"] * 5, "n/a", "0 of 50"],
    ]
    assert "below '5 %'" in table.note
    assert table.note.endswith("Stored.")
    assert json.loads(json.dumps(module.rows_mapping(GEOMETRY_ROWS)))[1]["published"] == [1.63, 1.65]
    shipped = module.allowed_geometry(Work(ROOT / "studies", ROOT / "results")).rows
    page = (ROOT / "results" / "reference" / "geometry.md").read_text(encoding="utf-8")
    assert shipped
    assert to_markdown(module.geometry_table(shipped)) in page


@pytest.mark.parametrize("name", module.GEOMETRY)
def test_every_range_of_the_shipped_studies_has_its_reason(name):
    path = ROOT / "studies" / f"{name}.yaml"
    sample = read_study(path).sample
    lines = path.read_text(encoding="utf-8").splitlines()
    numbers = [lines.index(next(line for line in lines if line.strip().startswith(f"{one}:"))) for one in sample.ranges]
    without = [lines[number] for number in numbers if not lines[number - 1].strip().startswith("#")]
    assert [line.split(":")[0].strip() for line in without] in ([], ["fingertip.ridges.limiting_height"])
    assert sample.count >= len(sample.ranges) + 15
