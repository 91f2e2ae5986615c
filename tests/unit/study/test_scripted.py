"""Studies in Python, and those that travel with the package."""

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import fingerslip as fs
from fingerslip.errors import InputError, ResultError
from fingerslip.results import Quantity
from fingerslip.storage.files import read_json, write_json
from fingerslip.study.definition.file import read_with_base
from fingerslip.study.definition.runs import plan_studies, read_runs
from fingerslip.study.inspection.check import check_plans
from fingerslip.study.running.build import build_mesh
from fingerslip.study.shipped import TEMPLATES, copy_example, examples, examples_table, new_study, studies_folder
from places import ROOT
from unit.study.block import FRICTIONS, NAMES, block_values, run_block

pytestmark = pytest.mark.usefixtures("reports", "simulated")


def test_a_study_is_checked_run_and_read_as_numbers(write_study, tmp_path, simulated):
    study = fs.Study(write_study(), sweep={"contact.friction_coefficient": np.linspace(0.3, 0.5, 2)}, name="mine")
    checked = study.check(tmp_path)
    assert checked["state"].tolist() == ["to do"] * 2
    assert checked.attrs["note"].startswith("2 runs, about 0.1 min")
    assert checked.attrs["units"] == {"estimated time": "s"}
    opened = study.run(tmp_path, workers=1)
    assert opened.folder == tmp_path / "mine"
    frame = opened.to_dataframe()
    assert frame["contact.friction_coefficient"].tolist() == [0.3, 0.5]
    assert frame["overall_s"].dtype == "float64"
    assert frame.attrs["units"]["overall_s"] == "s"
    assert study.check(tmp_path)["state"].tolist() == ["finished"] * 2
    assert len(simulated) == 2
    assert study.run(tmp_path, workers=1).names == opened.names
    assert len(simulated) == 2
    study.run(tmp_path, workers=1, force=True)
    assert len(simulated) == 4


def test_a_study_starts_from_a_mapping_a_file_or_another_study_and_is_saved_as_one(write_study):
    path = write_study()
    runs = [fs.Study(base).check()["run"].tolist() for base in (path, str(path), fs.read_study(path), fs.Study(path))]
    assert runs == [[f"friction_coefficient-{friction}" for friction in FRICTIONS]] * 4
    values = block_values() | {"mesh": {"file": str(path.with_name("block.msh"))}}
    changed = fs.Study(fs.Study(values), changes={"programme.0.press.depth": "0.2 mm", "sweep": {}}, name="deeper")
    assert changed.check()["run"].tolist() == ["run"]
    assert changed.mapping["programme"][0]["press"]["depth"] == "0.2 mm"
    assert values["programme"][0]["press"]["depth"] == "0.1 mm"
    path = write_study()
    saved = fs.Study(path, sweep={"contact.friction_coefficient": (0.1, 0.2)}).save(path.with_name("saved.yaml"))
    assert fs.read_study(saved).sweep == {"contact.friction_coefficient": (0.1, 0.2)}


def test_running_warns_of_what_is_too_coarse_or_doubtful(write_study, tmp_path, monkeypatch):
    monkeypatch.setattr("fingerslip.study.storage.reporting.resolution_warnings", lambda runs: [f"coarse: {len(runs)}"])
    path = write_study()
    for run in (lambda: fs.run_study(path, results_dir=tmp_path, workers=1), lambda: fs.Study(path).run(tmp_path)):
        with pytest.warns(UserWarning, match="^coarse: 3$") as caught:
            run()
        assert {warning.filename for warning in caught} == {__file__}
        assert any(": programme.0: the press takes 10 steps" in str(warning.message) for warning in caught)


def test_a_run_of_a_study_makes_a_model(write_study):
    path = write_study()
    model = fs.study_model(path, "friction_coefficient-0.4")
    assert model.contacts[0].friction.coefficient == 0.4
    assert fs.study_model(fs.Study(path, sweep={})).mesh.p.shape == model.mesh.p.shape
    runs = ", ".join(f"friction_coefficient-{friction}" for friction in FRICTIONS)
    for run, fault in ((None, "is missing"), ("fast", f"'fast' is not a run of {path}")):
        with pytest.raises(InputError) as caught:
            fs.study_model(path, run)
        assert str(caught.value) == f"study_model.run: {fault}, needs one of {runs}"


def test_studies_show_themselves_and_are_found_by_name(write_study):
    assert fs.Study("wang2014_table2").mapping["title"]
    assert repr(fs.Study("latency_sensitivity")).startswith("<Study 'What moves the latency of slip': contact.friction")
    study = fs.Study(block_values(), sample={"count": 4, "ranges": {"contact.friction_coefficient": [0.2, 0.4]}})
    words = "contact.friction_coefficient (3 values), contact.friction_coefficient (0.2 to 0.4)"
    assert repr(study) == f"<Study 'Block on a plate': {words}>"
    assert "<td>0.2 to 0.4</td>" in study._repr_html_()


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda _: fs.Study(3), r"Study\.base: got 3, needs a path, a name, a mapping or a Study"),
        (lambda _: fs.Study({}, name="a/b"), "needs the name of a folder"),
        (lambda _: fs.Study({}, name=".."), "needs the name of a folder"),
        (lambda write: fs.Study(write()).run(workers="2"), "workers: got '2', needs a number >= 1"),
        (
            lambda _: fs.Study(block_values(), changes={"title.x": 1}).check(),
            r"Study\.changes\.title\.x: leads nowhere",
        ),
        (
            lambda _: fs.Study(block_values(), sweep={"contact.x": [1]}, name="mine").check(),
            r"mine\.yaml: sweep\.contact\.x: is not known",
        ),
        (lambda _: fs.Study("nothing").check(), "nothing: is not there"),
        (lambda _: fs.open_study(3), "open_study: got 3, needs the path of a folder"),
        (lambda _: fs.open_study("nothing"), "nothing: is not there; run the study again"),
        (lambda _: fs.open_study(__file__), "py: is a file; needs a folder that fingerslip run wrote"),
    ],
)
def test_what_is_no_study_is_refused(write_study, ask, message):
    with pytest.raises(fs.FingerslipError, match=message):
        ask(write_study)


def test_results_are_a_data_frame_and_histories_and_values_are_read_when_they_are_asked_for(finished):
    study = fs.open_study(finished)
    assert study.names == tuple(NAMES)
    frame = study.to_dataframe()
    assert frame["contact.friction_coefficient"].tolist() == FRICTIONS
    assert (frame["overall_s"].diff().dropna() > 0.0).all()
    assert repr(study) == f"<OpenedStudy 'Block on a plate': 3 runs in {finished}>"
    assert NAMES[1] in study._repr_html_()
    assert fs.open_study(finished).run(NAMES[2]).values["contact.friction_coefficient"] == 0.6
    with pytest.raises(InputError, match=r"run: 'x' is not a finished run, needs one of friction_coefficient-0\.2"):
        fs.open_study(finished).run("x")
    (finished / NAMES[0] / "history.nc").write_bytes(b"damaged")
    study = fs.open_study(finished)
    assert study.history(NAMES[1]).sizes["time"] > 1
    with pytest.raises(ResultError, match="cannot be read as a history"):
        study.history(NAMES[0])
    shutil.copy(finished / NAMES[1] / "history.nc", finished / NAMES[0] / "history.nc")
    assert [name for name, _ in study.histories()] == list(NAMES)


def test_derived_quantities_are_stored_with_the_study_and_in_its_summary(write_study):
    derived = {"travel": "overall_slip * slide.speed", "never": "sqrt(-overall_slip)"}
    path = write_study(block_values() | {"derived": derived})
    folder = run_block(path).folder
    study = fs.open_study(folder)
    for run in study.result.runs:
        # The slide of the study goes at 5 mm/s.
        assert run.derived["travel"] == Quantity("travel", "m", pytest.approx(5e-3 * run.events.overall))
        assert run.derived["never"] == Quantity("never", "s^0.5", None)
    frame = pd.read_csv(folder / "summary.csv")
    assert frame["travel_m"].tolist() == pytest.approx([run.derived["travel"].value for run in study.result.runs])
    assert study.to_dataframe()["travel_m"].tolist() == pytest.approx(frame["travel_m"].tolist())
    assert frame.filter(like="never").isna().all().all()


@pytest.mark.parametrize("changed", [{"compare": None}, {"runs": 3}, {"runs": {"a": {}}}, {"title": None}])
def test_results_of_another_version_are_refused(finished, changed):
    write_json(finished / "manifest.json", read_json(finished / "manifest.json", "") | changed)
    said = r"manifest\.json: is of another version, or damaged at [\w.]+; run the study again"
    with pytest.raises(ResultError, match=said):
        fs.open_study(finished)


def test_every_study_ships_in_the_wheel_with_what_it_shows():
    names = sorted(path.stem for path in (ROOT / "studies").glob("*.yaml"))
    assert list(examples()) == names
    table = examples_table()
    assert [row[0] for row in table.rows] == names
    assert all(row[1] for row in table.rows)
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert '"studies" = "fingerslip/data/studies"' in project


@pytest.mark.parametrize("path", sorted((ROOT / "studies").glob("wang2014*.yaml")), ids=lambda path: path.stem)
def test_studies_of_the_paper_move_the_plate_towards_the_palm(path):
    runs = read_runs(path).runs
    slides = [phase for run in runs for phase in run.study.programme if isinstance(phase, fs.Slide)]
    directions = {slide.direction[0] for slide in slides}
    assert len(slides) == len(runs)
    # The direction that the studies had at first is kept beside the published one, in one study.
    assert directions == ({-1.0, 1.0} if path.stem == "wang2014_direction" else {-1.0})
    assert all(not any(slide.direction[1:]) for slide in slides)


@pytest.mark.slow
def test_the_ridged_sensor_in_space_is_meshed_in_the_sizes_of_its_studies():
    path = ROOT / "studies" / "tactip_directions_3d.yaml"
    (run,) = read_runs(path).runs
    assert build_mesh(run).nelements > 100_000


@pytest.mark.parametrize(
    "template", [pytest.param(name, marks=[pytest.mark.slow] * (name == "fit")) for name in TEMPLATES]
)
def test_templates_are_studies_that_editors_can_check_and_can_be_run_as_they_are(tmp_path, template):
    written = new_study(tmp_path / "mine", template)
    assert written == tmp_path / "mine.yaml"
    assert read_runs(written).runs
    assert "THIS_FILE" not in written.read_text(encoding="utf-8")
    assert json.loads((tmp_path / "study.schema.json").read_text(encoding="utf-8")) == fs.study_schema()
    rows = check_plans(plan_studies([written], tmp_path / "results")).rows
    assert {row[2] for row in rows} == {"to do"}


def test_studies_are_those_beside_or_those_that_ship_and_are_copied_with_their_bases(tmp_path, monkeypatch):
    written = copy_example("wang2014_table2.yaml", tmp_path)
    assert written.read_bytes() == (ROOT / "studies" / "wang2014_table2.yaml").read_bytes()
    with monkeypatch.context() as patch:
        patch.chdir(tmp_path)
        assert (studies_folder() / "wang2014_table2.yaml").is_file()
        (tmp_path / "studies").mkdir()
        assert studies_folder() == Path("studies")
    based = [name for name, file in examples().items() if "\nbase: " in file.read_text(encoding="utf-8")]
    assert len(based) == 10
    for name in based:
        (tmp_path / name).mkdir()
        assert read_with_base(copy_example(name, tmp_path / name))["title"]


def test_what_is_there_is_kept_and_what_is_not_known_is_refused(tmp_path):
    (tmp_path / "mine.yaml").write_text("title: mine", encoding="utf-8")
    with pytest.raises(InputError, match="is there already, is not overwritten; give another name"):
        new_study(tmp_path / "mine.yaml", "sweep")
    with pytest.raises(InputError, match=r"template: 'sweeps' is not known, needs one of .*; did you mean 'sweep'"):
        new_study(tmp_path / "other", "sweeps")
    with pytest.raises(InputError, match="study: 'wang2014_table' is not known"):
        copy_example("wang2014_table", tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.yaml"]
