"""Studies and templates that travel with the package."""

import json
from pathlib import Path

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.mesh.io import write_mesh
from fingerslip.model.programme import Slide
from fingerslip.study.definition.runs import plan_studies, read_runs
from fingerslip.study.definition.schema import study_schema
from fingerslip.study.definition.spec import read_study
from fingerslip.study.inspection.check import check_plans
from fingerslip.study.running.build import build_mesh
from fingerslip.study.shipped import TEMPLATES, copy_example, examples, examples_table, new_study, studies_folder
from fingerslip.verification.meshes import box
from places import ROOT


def test_every_study_ships_with_what_it_shows():
    names = sorted(path.stem for path in (ROOT / "studies").glob("*.yaml"))
    assert list(examples()) == names
    table = examples_table()
    assert [row[0] for row in table.rows] == names
    assert all(row[1] for row in table.rows)


@pytest.mark.parametrize("path", sorted((ROOT / "studies").glob("wang2014*.yaml")), ids=lambda path: path.stem)
def test_studies_of_the_paper_move_the_plate_towards_the_palm(path):
    runs = read_runs(path).runs
    slides = [phase for run in runs for phase in run.study.programme if isinstance(phase, Slide)]
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


def test_the_wheel_holds_the_studies():
    project = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert '"studies" = "fingerslip/data/studies"' in project


@pytest.mark.parametrize("template", TEMPLATES)
def test_templates_are_studies_that_editors_can_check(tmp_path, template):
    written = new_study(tmp_path / "mine", template)
    assert written == tmp_path / "mine.yaml"
    assert read_runs(written).runs
    assert "THIS_FILE" not in written.read_text(encoding="utf-8")
    assert json.loads((tmp_path / "study.schema.json").read_text(encoding="utf-8")) == study_schema()


@pytest.mark.parametrize("template", TEMPLATES)
def test_templates_can_be_run_as_they_are(tmp_path, template):
    written = new_study(tmp_path / "mine", template)
    body = box(
        "Q4", np.linspace(0.0, 8e-3, 9), np.linspace(0.0, 4e-3, 5), regions={"body": lambda centre: centre[0] > -1}
    )
    write_mesh(body, tmp_path / "body.msh")
    rows = check_plans(plan_studies([written], tmp_path / "results")).rows
    assert {row[2] for row in rows} == {"to do"}


def test_studies_are_those_beside_or_those_that_ship(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert (studies_folder() / "wang2014_table2.yaml").is_file()
    (tmp_path / "studies").mkdir()
    assert studies_folder() == Path("studies")


def test_an_example_is_copied_as_it_is(tmp_path):
    written = copy_example("wang2014_table2.yaml", tmp_path)
    assert written.read_bytes() == (ROOT / "studies" / "wang2014_table2.yaml").read_bytes()


def test_an_example_brings_the_studies_that_it_is_based_on(tmp_path):
    based = [name for name, file in examples().items() if "\nbase: " in file.read_text(encoding="utf-8")]
    assert len(based) == 9
    for name in based:
        (tmp_path / name).mkdir()
        assert read_study(copy_example(name, tmp_path / name)).title


def test_what_is_there_is_kept_and_what_is_not_known_is_refused(tmp_path):
    (tmp_path / "mine.yaml").write_text("title: mine", encoding="utf-8")
    with pytest.raises(InputError, match="is there already, is not overwritten; give another name"):
        new_study(tmp_path / "mine.yaml", "sweep")
    with pytest.raises(InputError, match=r"template: 'sweeps' is not known, needs one of .*; did you mean 'sweep'"):
        new_study(tmp_path / "other", "sweeps")
    with pytest.raises(InputError, match="study: 'wang2014_table' is not known"):
        copy_example("wang2014_table", tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.yaml"]
