"""From stored runs to tables, figures and pages, of one study or of two side by side."""

from __future__ import annotations

import dataclasses
import json
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fingerslip.errors import ResultError
from fingerslip.report.figures import style as figures
from fingerslip.report.page import assemble
from fingerslip.results import RunResult
from fingerslip.slip import Events, SlipEvents
from fingerslip.storage.files import write_json
from fingerslip.study.definition.cameras import CameraSettings
from fingerslip.study.running.pictures import film_history
from fingerslip.study.running.runner import run_study
from fingerslip.study.storage import reporting
from fingerslip.study.storage.reporting import (
    compare_studies,
    event_tables,
    film_keys,
    provenance_of,
    read_films,
    read_results,
    read_stored_run,
    report_key,
    write_report,
)
from fingerslip.study.storage.summary import MANIFEST, read_manifest
from unit.filmed import filmed_history
from unit.report.pages import checked
from unit.study.block import FRICTIONS

Write = Callable[..., Path]


NAMES = tuple(f"friction_coefficient-{friction}" for friction in FRICTIONS)


@pytest.fixture
def folder(finished: Path) -> Path:
    return finished


def test_stored_runs_come_back_as_they_were(folder: Path) -> None:
    stored = read_results(folder)
    assert (stored.title, stored.compare, stored.folder) == ("Block on a plate", ("wang2014-table2",), folder)
    assert tuple(run.name for run in stored.runs) == NAMES
    assert [run.swept["contact.friction_coefficient"] for run in stored.runs] == FRICTIONS
    assert stored.runs[0].values["materials.block.youngs_modulus"] == "100000.0 Pa"
    # Slip reaches the centre at 1.4 s + 0.5 s per unit of friction.
    overall = [run.events.overall for run in stored.runs]
    assert overall == pytest.approx([1.5, 1.6, 1.7], abs=0.02)


@pytest.mark.parametrize("text", [None, "", "{broken", "{}"])
def test_a_folder_without_a_manifest_holds_no_study(tmp_path: Path, text: str | None) -> None:
    if text is not None:
        (tmp_path / "manifest.json").write_text(text)
    assert read_manifest(tmp_path) == {}
    with pytest.raises(ResultError, match="holds no results of a study; needs a folder that fingerslip run wrote"):
        read_results(tmp_path)


def test_one_stored_run_comes_back_as_with_its_study(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert read_stored_run(folder / NAMES[1]) == read_results(folder).runs[1]
    known = {"slip.overall": 6e-3}
    monkeypatch.setattr(reporting, "read_uncertainties", lambda _, runs: dict.fromkeys(runs, known))
    assert read_stored_run(folder / NAMES[1]).uncertainty == known


def test_a_folder_that_is_no_run_says_what_is_needed(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(ResultError, match=rf"holds a study; needs the folder of one of its runs: {', '.join(NAMES)}"):
        read_stored_run(folder)
    with pytest.raises(ResultError, match=r"holds no finished run"):
        read_stored_run(tmp_path)


def test_a_run_that_has_gone_is_named(folder: Path) -> None:
    shutil.rmtree(folder / NAMES[1])
    with pytest.raises(ResultError, match=rf"{NAMES[1]}: is not there; run the study again"):
        read_results(folder)


def test_tables_stand_beside_published_sets_that_have_events() -> None:
    events = Events(slip=SlipEvents(overall=1.75))
    swept = {"fingertip.phalanx.variant": "original", "contact.friction_coefficient": 0.6}
    fits = RunResult("r", swept, events, values={"fingertip.fingerprint.enabled": False})
    titles = [table.title for table in event_tables([fits], ["wang2014-table2", "wang2014-qualitative"])]
    assert titles == ["Slip events from accumulated slip", "Slip events of the three phalanges (Table 2)"]


def test_key_of_a_report_changes_with_all_that_it_shows() -> None:
    base = ("title", ["a"], {"run": "1"}, {"run": {"slip.overall": 0.1}})
    keys = {
        report_key(*base),
        report_key("other", *base[1:]),
        report_key("title", [], *base[2:]),
        report_key("title", ["a"], {"run": "2"}, base[3]),
        report_key("title", ["a"], {"other": "1"}, base[3]),
        report_key(*base[:3], {}),
        report_key(*base, ("mesh.contact_size",)),
    }
    assert len(keys) == 7
    assert report_key("t", [], {"a": "1", "b": "2"}, {}) == report_key("t", [], {"b": "2", "a": "1"}, {})


def test_report_has_a_picture_file_for_every_figure_and_one_section_for_the_one_mesh(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(figures, "_DOTS_PER_INCH", 20)
    monkeypatch.setattr(assemble, "study_report", _without_details(assemble.study_report))
    write_report(read_results(folder))
    page = (folder / "report.html").read_text(encoding="utf-8")
    checker = checked(page)
    files = sorted(path.stem for path in (folder / "figures").iterdir())
    assert f"section-{NAMES[0]}" in files
    assert len([name for name in files if name.startswith("section-")]) == 1
    assert "events-contact-friction-coefficient" in files
    assert len(checker.loaded) == len(files)
    assert set(files) <= checker.anchors
    assert json.loads((folder / "manifest.json").read_text())["runs"][NAMES[0]]["identity"] not in page
    assert "<dt>study</dt><dd>block.yaml</dd>" in page
    assert "<dt>report</dt>" not in page, "the hash of the report itself is no provenance"


def test_a_given_value_that_equals_the_default_is_the_study_files_in_the_report(folder: Path) -> None:
    given = ["contact.friction_coefficient", "contact.boundary", "integration"]
    manifest = read_manifest(folder)
    assert "integration" not in manifest["given"]
    found = {}
    for paths in (manifest["given"], given):
        write_json(folder / "manifest.json", manifest | {"given": paths})
        values = reporting._content(read_results(folder), {}).values
        found[len(paths)] = {value.path: value.source for value in values}["integration"]
    assert found == {len(manifest["given"]): "default", len(given): "study file"}


def _without_details(assemble: Callable[..., Any]) -> Callable[..., Any]:
    """Leave the runs in detail out, whose figures take long."""

    def report(results: Any) -> Any:
        whole = assemble(results)
        sections = tuple(section for section in whole.sections if not section.folded)
        return dataclasses.replace(whole, sections=sections)

    return report


def test_dates_are_written_in_any_time_zone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`datetime` refuses offsets of a day and more."""
    (tmp_path / MANIFEST).write_text("")
    monkeypatch.setenv("TZ", "Foo+99:99")
    time.tzset()
    try:
        assert "Foo" in provenance_of(tmp_path, {"study": "x"})["page of"]
    finally:
        monkeypatch.undo()
        time.tzset()


@pytest.mark.usefixtures("reports", "simulated")
def test_the_page_stands_in_the_folder_of_the_first(write_study: Callable[..., Path], tmp_path: Path) -> None:
    path = write_study()
    folder = run_study(path, results_dir=path.parent / "results", workers=1).folder
    written = compare_studies(folder, folder)
    assert written == folder / f"comparison-{folder.name}.html"
    page = written.read_text(encoding="utf-8")
    assert "Both studies have the same values." in page
    assert "<dt>B: commit</dt>" in page or "<dt>B: study</dt>" in page
    assert compare_studies(folder, folder, tmp_path / "x.html") == tmp_path / "x.html"
    with pytest.raises(ResultError, match="holds no results of a study"):
        compare_studies(folder, tmp_path / "nowhere")


CAMERA = CameraSettings(width=160, height=120, view_width=14e-3, distance=30e-3, rest=0.4, marker_radius=0.3e-3)


def test_frames_at_rest_at_the_start_in_the_slide_and_at_its_end(tmp_path):
    film_history(filmed_history(), "external", CAMERA, tmp_path / "run" / "cameras" / "external", "key")
    assert film_keys(tmp_path, ["run"]) == ["key"]
    (film,) = read_films(tmp_path, {"run": filmed_history()})
    assert list(film.frames) == pytest.approx([-0.4, 1.0, 1.33, 2.0], abs=0.02)
    assert {frame.shape for frame in film.frames.values()} == {(120, 160)}
    assert film.truth["position"].shape == film.tracks["position"].shape
