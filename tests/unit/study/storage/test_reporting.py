"""The folder of a study: summary, manifest, convergence, tables and pages, of one study or of two side by side."""

import csv
import dataclasses
import json
import shutil
import time
from pathlib import Path

import numpy as np
import pytest

from fingerslip import results
from fingerslip.errors import ResultError
from fingerslip.report.figures import style as figures
from fingerslip.report.page import assemble
from fingerslip.results import RefusedRun, RunResult, StudyResult
from fingerslip.slip import MEASURES, Events, SlipEvents
from fingerslip.slip.events import Found
from fingerslip.storage.files import write_json
from fingerslip.study.definition.runs import plan_study
from fingerslip.study.definition.settings import CameraSettings
from fingerslip.study.running.films import film_history
from fingerslip.study.storage import reporting, store
from fingerslip.study.storage.reporting import compare_studies, read_results, read_stored_run, write_report
from fingerslip.study.storage.store import RunConvergence, read_convergences, read_manifest, write_results
from fingerslip.uncertainty import Convergence, Series
from fingerslip.vision.tracks import read_tracks
from unit.filmed import filmed_history
from unit.report.page.contents import checked
from unit.study.block import FRICTIONS, NAMES, run_block


def test_summary_has_exactly_the_promised_columns_and_the_manifest_says_what_made_the_results(finished):
    with (finished / "summary.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    events = ["incipient_s", "noticed_s", "three_quarter_s", "overall_s", "latency_s"]
    expected = [f"{event}{suffix}" for suffix in ("", "_displacement", "_acceleration") for event in events]
    expected.remove("noticed_s_acceleration")  # no peak belongs to it
    numbers = [measure.key for measure in MEASURES]
    assert list(rows[0]) == ["run", "contact.friction_coefficient", *expected, "readings_recorded", *numbers]
    assert [float(row["friction_force_ratio_end_of_slide"]) for row in rows] == pytest.approx(FRICTIONS)
    assert [row["contact.friction_coefficient"] for row in rows] == ["0.2", "0.4", "0.6"]
    # Slip reaches the centre at 1.4 s + 0.5 s per unit of friction.
    assert np.diff([float(row["overall_s"]) for row in rows]) == pytest.approx([0.1, 0.1], abs=0.01)
    manifest = json.loads((finished / "manifest.json").read_text())
    expected = ("block.yaml", "Block on a plate", ["wang2014-table2"])
    assert (manifest["study"], manifest["title"], manifest["compare"]) == expected
    assert list(manifest["runs"]) == NAMES
    assert manifest["versions"]["numpy"] == np.__version__
    assert len({entry["mesh_hash"] for entry in manifest["runs"].values()}) == 1
    assert len({entry["identity"] for entry in manifest["runs"].values()}) == 3
    assert manifest["wall_time_s"] >= 0.0
    assert manifest["given"][0] == "title"
    assert manifest["given"][-1] == "contact.friction_coefficient", "what is swept is given too"


@pytest.mark.usefixtures("reports", "simulated")
def test_event_that_did_not_happen_is_an_empty_field(write_study, monkeypatch):
    none = Found(Events(acceleration=SlipEvents(recorded=False)))
    monkeypatch.setattr(results, "find_slip", lambda _: none)
    lines = (run_block(write_study()).folder / "summary.csv").read_text().splitlines()
    assert lines[1].startswith("friction_coefficient-0.2,0.2" + "," * 15 + "slip displacement,")


def stored(name, seconds):
    return RunResult(
        name, {}, Events(), identity=f"id {seconds}", mesh_hash="m", seconds=seconds, versions={"numpy": "1"}
    )


def test_manifest_adds_up_the_seconds_and_keeps_what_tells_runs_apart_and_what_was_sampled_and_refused(
    write_study, tmp_path
):
    plan = plan_study(write_study())
    runs = (stored("a", 1.25), stored("b", 2.5))
    write_results(plan.source, StudyResult(tmp_path, (), runs), "key")
    manifest = read_manifest(tmp_path)
    assert store.identities(manifest) == {"a": "id 1.25", "b": "id 2.5"}
    assert (manifest["wall_time_s"], manifest["report"]) == (3.75, "key")
    second = {"identity": "id 2.5", "mesh_hash": "m", "wall_time_s": 2.5, "versions": {"numpy": "1"}}
    assert manifest["runs"]["b"] == second
    with pytest.raises(ResultError, match=r"summary\.csv: cannot be written"):
        write_results(Path("x.yaml"), StudyResult(tmp_path / "missing", (), ()), "")
    refused = (RefusedRun("sample-3", {"sample": 3}, {"a": "1 mm"}, "a: too large"),)
    study = StudyResult(tmp_path, (), (stored("sample-1", 1.0),), ranges={"a": ("0 mm", "1 mm")}, refused=refused)
    write_results(tmp_path / "x.yaml", study, "")
    manifest = read_manifest(tmp_path)
    assert manifest["ranges"] == {"a": ["0 mm", "1 mm"]}
    assert store.refused_in(manifest) == refused
    assert store.refused_in({}) == ()


SIZES = (1.0, 0.5, 0.25)
KNOWN = Convergence("overall slip", "s", 1.7, {"step": Series("step", SIZES, (1.7, 1.65, 1.625))}, resolution=0.001)
LACKING = Convergence("incipient slip", "s", 1.2, {"step": Series("step", SIZES, (1.2, None, 1.1))})
FOUND = RunConvergence("run", "key", {"slip.overall": KNOWN, "slip.incipient": LACKING})


def test_series_come_back_and_uncertainties_are_those_of_runs_with_the_same_inputs(tmp_path):
    store.write_convergences(tmp_path, {"run": FOUND})
    assert store.read_convergences(tmp_path, {"run": "key"}) == {"run": FOUND}
    assert (tmp_path / store.CONVERGENCE / "convergence.json").is_file()
    known = read_convergences(tmp_path, {"run": "key"})
    assert known["run"].uncertainties == {"slip.overall": pytest.approx(1.25 * 0.1)}
    assert read_convergences(tmp_path, {"run": "changed"}) == read_convergences(tmp_path, {"other": "key"}) == {}


@pytest.mark.parametrize("content", [None, b"", b"{", b"\xff"])
def test_without_a_readable_file_nothing_is_known_and_a_damaged_one_is_named_once(tmp_path, caplog, content):
    if content is not None:
        (tmp_path / store.CONVERGENCE).mkdir()
        (tmp_path / store.CONVERGENCE / "convergence.json").write_bytes(content)
    for _ in range(2):
        assert read_convergences(tmp_path, {"run": "key"}) == {}
    said = "convergence.json: is damaged: it is no JSON; run fingerslip converge again; without it"
    assert [said in message for message in caplog.messages] == [True] * (content is not None)


def test_stored_runs_come_back_as_they_were_alone_and_with_their_study(finished, monkeypatch):
    stored = read_results(finished)
    assert (stored.title, stored.compare, stored.folder) == ("Block on a plate", ("wang2014-table2",), finished)
    assert [run.name for run in stored.runs] == NAMES
    assert [run.swept["contact.friction_coefficient"] for run in stored.runs] == FRICTIONS
    assert stored.runs[0].values["materials.block.youngs_modulus"] == "100000.0 Pa"
    # Slip reaches the centre at 1.4 s + 0.5 s per unit of friction.
    assert [run.events.overall for run in stored.runs] == pytest.approx([1.5, 1.6, 1.7], abs=0.02)
    assert read_stored_run(finished / NAMES[1]) == stored.runs[1]
    known = {"slip.overall": KNOWN}
    monkeypatch.setattr(
        reporting.store, "read_convergences", lambda _, runs: {name: RunConvergence(name, "", known) for name in runs}
    )
    assert read_stored_run(finished / NAMES[1]).uncertainty == {"slip.overall": KNOWN.uncertainty}
    assert read_stored_run(finished / NAMES[1]).convergence == known


def test_a_folder_that_is_no_study_or_no_run_says_what_is_needed_and_a_run_that_has_gone_is_named(finished, tmp_path):
    for text in (None, "", "{broken", "{}"):
        if text is not None:
            (tmp_path / "manifest.json").write_text(text)
        assert read_manifest(tmp_path) == {}
        with pytest.raises(ResultError, match="holds no results of a study; needs a folder that fingerslip run wrote"):
            read_results(tmp_path)
    with pytest.raises(ResultError, match=rf"holds a study; needs the folder of one of its runs: {', '.join(NAMES)}"):
        read_stored_run(finished)
    with pytest.raises(ResultError, match=r"holds no finished run"):
        read_stored_run(tmp_path)
    shutil.rmtree(finished / NAMES[1])
    with pytest.raises(ResultError, match=rf"{NAMES[1]}: is not there; run the study again"):
        read_results(finished)


def test_tables_stand_beside_published_sets_that_have_events():
    events = Events(slip=SlipEvents(overall=1.75))
    swept = {"fingertip.phalanx.variant": "original", "contact.friction_coefficient": 0.6}
    fits = RunResult("r", swept, events, values={"fingertip.fingerprint.enabled": False})
    study = StudyResult(Path(), ("wang2014-table2", "wang2014-qualitative"), (fits,))
    tables = reporting.study_tables(study)
    ours, theirs = [table.title for table in tables]
    assert ours == "Slip events from accumulated slip, counted from the start of the run"
    assert theirs == "Slip events of the three phalanges (Table 2)"
    # What is too coarse, and which contact slips, stands below the first.
    doubtful = dataclasses.replace(fits, numbers={"slide_records": 4, "sticking_at_overall": 3})
    first, second = reporting.study_tables(StudyResult(Path(), study.compare, (doubtful,)))
    assert (first.rows, second) == (tables[0].rows, tables[1])
    said = first.note.removeprefix(tables[0].note).strip().splitlines()
    assert said[0].endswith("contact at the start of the slide: of the nodes that touch since then, 3 still stick.")
    assert said[1].startswith("Too coarse for the times of slip: ")
    assert len(said) == 2


@pytest.mark.slow
def test_report_has_a_picture_file_for_every_figure_and_one_section_for_the_one_mesh(finished, monkeypatch):
    monkeypatch.setattr(figures, "_DOTS_PER_INCH", 20)
    monkeypatch.setattr(assemble, "study_report", _without_details(assemble.study_report))
    write_report(read_results(finished))
    page = (finished / "report.html").read_text(encoding="utf-8")
    checker = checked(page)
    files = sorted(path.stem for path in (finished / "figures").iterdir())
    assert f"section-{NAMES[0]}" in files
    assert len([name for name in files if name.startswith("section-")]) == 1
    assert "events-contact-friction-coefficient" in files
    assert len(checker.loaded) == len(files)
    assert set(files) <= checker.anchors
    assert json.loads((finished / "manifest.json").read_text())["runs"][NAMES[0]]["identity"] not in page
    assert "<dt>study</dt><dd>block.yaml</dd>" in page
    assert "<dt>report</dt>" not in page, "the hash of the report itself is no provenance"


@pytest.mark.slow
def test_a_given_value_that_equals_the_default_is_the_study_files_in_the_report(finished):
    given = ["contact.friction_coefficient", "contact.boundary", "integration"]
    manifest = read_manifest(finished)
    assert "integration" not in manifest["given"]
    found = {}
    for paths in (manifest["given"], given):
        write_json(finished / "manifest.json", manifest | {"given": paths})
        values = reporting._content(read_results(finished), {}).values
        found[len(paths)] = {value.path: value.source for value in values}["integration"]
    assert found == {len(manifest["given"]): "default", len(given): "study file"}


def _without_details(assemble):
    """Leave the runs in detail out, whose figures take long."""

    def report(results):
        whole = assemble(results)
        sections = tuple(section for section in whole.sections if not section.folded)
        return dataclasses.replace(whole, sections=sections)

    return report


def test_dates_are_written_in_any_time_zone(tmp_path, monkeypatch):
    """`datetime` refuses offsets of a day and more."""
    (tmp_path / store.MANIFEST).write_text("")
    monkeypatch.setenv("TZ", "Foo+99:99")
    time.tzset()
    try:
        assert "Foo" in reporting.provenance_of(tmp_path, {"study": "x"})["page of"]
    finally:
        monkeypatch.undo()
        time.tzset()


def test_the_page_stands_in_the_folder_of_the_first(finished, tmp_path):
    written = compare_studies(finished, finished)
    assert written == finished / f"comparison-{finished.name}.html"
    page = written.read_text(encoding="utf-8")
    assert "Both studies have the same values." in page
    assert "<dt>B: commit</dt>" in page or "<dt>B: study</dt>" in page
    assert compare_studies(finished, finished, tmp_path / "x.html") == tmp_path / "x.html"
    with pytest.raises(ResultError, match="nowhere: is not there; run the study again"):
        compare_studies(finished, tmp_path / "nowhere")


CAMERA = CameraSettings(width=160, height=120, view_width=14e-3, distance=30e-3, rest=0.4, marker_radius=0.3e-3)


def test_frames_at_rest_at_the_start_in_the_slide_and_at_its_end(tmp_path):
    film_history(filmed_history(), "external", CAMERA, tmp_path / "run" / "cameras" / "external", "key")
    assert reporting.film_keys(tmp_path, ["run"]) == ["key"]
    (film,) = reporting.read_films(tmp_path, {"run": filmed_history()})
    assert list(film.frames) == pytest.approx([-0.4, 1.0, 1.33, 2.0], abs=0.02)
    assert {frame.shape for frame in film.frames.values()} == {(120, 160)}
    truth = read_tracks(tmp_path / "run" / "cameras" / "external" / "truth.nc")
    assert film.tracks["position"].shape == truth["position"].shape
