"""The folder of a study: summary, manifest and convergence."""

from __future__ import annotations

import csv
import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fingerslip import results
from fingerslip.errors import ResultError
from fingerslip.results import RefusedRun, RunResult, StudyResult
from fingerslip.slip import MEASURES, Events, Found, SlipEvents
from fingerslip.study.running.plan import plan_study
from fingerslip.study.running.runner import run_study
from fingerslip.study.storage.summary import (
    CONVERGENCE,
    RunConvergence,
    identities,
    read_convergences,
    read_manifest,
    read_uncertainties,
    refused_in,
    write_convergences,
    write_manifest,
    write_sensitivity,
    write_summary,
)
from fingerslip.uncertainty import Convergence, Series
from unit.sampled import study_of
from unit.study.block import FRICTIONS

Write = Callable[..., Path]


NAMES = [f"friction_coefficient-{friction}" for friction in FRICTIONS]


def run(path: Path) -> Any:
    return run_study(path, results_dir=path.parent / "results", workers=1)


@pytest.mark.usefixtures("reports", "simulated")
def test_summary_has_exactly_the_promised_columns(write_study: Write) -> None:
    result = run(write_study())
    with (result.folder / "summary.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    events = ["incipient_s", "noticed_s", "three_quarter_s", "overall_s", "latency_s"]
    expected = [f"{event}{suffix}" for suffix in ("", "_displacement", "_acceleration") for event in events]
    expected.remove("noticed_s_acceleration")  # no peak belongs to it
    numbers = [measure.key for measure in MEASURES]
    assert list(rows[0]) == ["run", "contact.friction_coefficient", *expected, "readings_recorded", *numbers]
    assert [float(row["friction_force_ratio_end_of_slide"]) for row in rows] == pytest.approx(FRICTIONS)
    assert [row["contact.friction_coefficient"] for row in rows] == ["0.2", "0.4", "0.6"]
    overall = [float(row["overall_s"]) for row in rows]
    # Slip reaches the centre at 1.4 s + 0.5 s per unit of friction.
    assert np.diff(overall) == pytest.approx([0.1, 0.1], abs=0.01)


@pytest.mark.usefixtures("reports", "simulated")
def test_event_that_did_not_happen_is_an_empty_field(write_study: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    none = Found(Events(acceleration=SlipEvents(recorded=False)))
    monkeypatch.setattr(results, "find_slip", lambda _: none)
    result = run(write_study())
    lines = (result.folder / "summary.csv").read_text().splitlines()
    assert lines[1].startswith("friction_coefficient-0.2,0.2" + "," * 15 + "slip displacement,")


@pytest.mark.usefixtures("simulated", "reports")
def test_manifest_says_what_made_the_results(write_study: Write) -> None:
    result = run(write_study())
    manifest = json.loads((result.folder / "manifest.json").read_text())
    assert (manifest["study"], manifest["title"], manifest["compare"]) == ("block.yaml", "Block on a plate", [])
    assert list(manifest["runs"]) == NAMES
    assert manifest["versions"]["numpy"] == np.__version__
    assert len({entry["mesh_hash"] for entry in manifest["runs"].values()}) == 1
    assert len({entry["identity"] for entry in manifest["runs"].values()}) == 3
    assert manifest["wall_time_s"] >= 0.0
    assert manifest["given"][0] == "title"
    assert manifest["given"][-1] == "contact.friction_coefficient", "what is swept is given too"


def stored(name: str, seconds: float) -> RunResult:
    return RunResult(
        name, {}, Events(), identity=f"id {seconds}", mesh_hash="m", seconds=seconds, versions={"numpy": "1"}
    )


def test_manifest_adds_up_the_seconds_and_keeps_what_tells_runs_apart(write_study: Write, tmp_path: Path) -> None:
    plan = plan_study(write_study())
    runs = (stored("a", 1.25), stored("b", 2.5))
    write_manifest(plan.source, StudyResult(tmp_path, (), runs), "key")
    manifest = json.loads((tmp_path / "manifest.json").read_text())
    assert manifest["wall_time_s"] == 3.75
    assert manifest["report"] == "key"
    assert manifest["runs"]["b"] == {
        "identity": "id 2.5", "mesh_hash": "m", "wall_time_s": 2.5, "versions": {"numpy": "1"},
    }  # fmt: skip


def test_a_summary_that_cannot_be_written_says_so(tmp_path: Path) -> None:
    with pytest.raises(ResultError, match=r"summary\.csv: cannot be written"):
        write_summary(StudyResult(tmp_path / "missing", (), ()))


@pytest.mark.parametrize("text", [None, "", "{broken", "{}"])
def test_a_folder_without_a_manifest_has_an_empty_one(tmp_path: Path, text: str | None) -> None:
    if text is not None:
        (tmp_path / "manifest.json").write_text(text)
    assert read_manifest(tmp_path) == {}


def test_identities_are_those_of_the_manifest(write_study: Write, tmp_path: Path) -> None:
    plan = plan_study(write_study())
    write_manifest(plan.source, StudyResult(tmp_path, (), (stored("a", 1.0), stored("b", 2.0))), "")
    assert identities(read_manifest(tmp_path)) == {"a": "id 1.0", "b": "id 2.0"}


def test_a_manifest_keeps_what_was_sampled_and_refused(tmp_path: Path) -> None:
    refused = (RefusedRun("sample-3", {"sample": 3}, {"a": "1 mm"}, "a: too large"),)
    study = StudyResult(tmp_path, (), (stored("sample-1", 1.0),), ranges={"a": ("0 mm", "1 mm")}, refused=refused)
    write_manifest(tmp_path / "x.yaml", study, "")
    manifest = read_manifest(tmp_path)
    assert manifest["ranges"] == {"a": ["0 mm", "1 mm"]}
    assert refused_in(manifest) == refused
    assert refused_in({}) == ()


def test_sensitivities_are_written_with_a_row_for_each_time_and_value(tmp_path: Path) -> None:
    write_sensitivity(dataclasses.replace(study_of(), folder=tmp_path))
    rows = list(csv.DictReader((tmp_path / "sensitivity.csv").read_text().splitlines()))
    assert {row["time"] for row in rows} == {"incipient", "overall"}, "latency is the same in all samples"
    (clearance,) = (row for row in rows if row["time"] == "overall" and row["value"] == "contact.clearance")
    assert (clearance["unit"], clearance["low"], clearance["high"]) == ("mm", "0", "0.4")
    assert float(clearance["slope_s_per_unit"]) == pytest.approx(-0.5)
    assert clearance["fingertip.phalanx.variant"] == "original"


SIZES = (1.0, 0.5, 0.25)


KNOWN = Convergence("overall slip", "s", 1.7, {"step": Series("step", SIZES, (1.7, 1.65, 1.625))})


LACKING = Convergence("incipient slip", "s", 1.2, {"step": Series("step", SIZES, (1.2, None, 1.1))})


FOUND = RunConvergence("run", "key", {"slip.overall": KNOWN, "slip.incipient": LACKING})


def test_series_come_back_as_they_were(tmp_path: Path) -> None:
    write_convergences(tmp_path, {"run": FOUND})
    assert read_convergences(tmp_path, {"run": "key"}) == {"run": FOUND}
    assert (tmp_path / CONVERGENCE / "convergence.json").is_file()


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
        (tmp_path / CONVERGENCE).mkdir()
        (tmp_path / CONVERGENCE / "convergence.json").write_text(text)
    assert read_uncertainties(tmp_path, {"run": "key"}) == {}


def test_a_damaged_file_is_named_in_a_warning(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / CONVERGENCE).mkdir()
    (tmp_path / CONVERGENCE / "convergence.json").write_bytes(b"\xff")
    for _ in range(2):
        assert read_uncertainties(tmp_path, {"run": "key"}) == {}
    (message,) = caplog.messages
    assert "convergence.json: is damaged: it is no JSON; run fingerslip converge again; without it" in message
