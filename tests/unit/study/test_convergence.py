"""Error bars: levels of refinement, and what the numbers of runs approach."""

import csv
import dataclasses
import functools
import json
from pathlib import Path

import pytest
import yaml

import fingerslip as fs
from fingerslip.dynamics.system.checks import contact_penalties
from fingerslip.history import phase_times
from fingerslip.results import RunResult, stored_result
from fingerslip.slip import find_events, measures
from fingerslip.slip.measures import Measure
from fingerslip.study import convergence
from fingerslip.study.convergence import (
    Level,
    StudyConvergence,
    converge,
    level_folders,
    levels_of,
    refinement_warnings,
    run_at,
)
from fingerslip.study.definition.runs import expand_mapping, plan_study
from fingerslip.study.definition.spec import parse_study
from fingerslip.study.inspection.check import check_plans
from fingerslip.study.running.build import build_model
from fingerslip.study.running.progress import StudyProgress
from fingerslip.study.storage.store import RunConvergence
from fingerslip.units import Unit
from places import ROOT
from unit import synthetic
from unit.study.block import NAMES, block_mesh, block_values, changed, finger_values, run_block
from unit.study.conftest import all_is_compiled, draw_nothing

FINGER = finger_values(time={"step": "2 ms", "alpha": -0.05})


@pytest.fixture
def block(write_study):
    return plan_study(write_study()).runs[0]


def test_all_settings_that_a_study_has_and_that_differ_from_its_own_are_refined(block, write_study):
    study = parse_study({**FINGER, "converge": {"alpha": [-0.05, -0.3]}}, Path("finger.yaml"))
    labels = [level.label for level in levels_of(study)]
    assert labels == ["mesh-0.6667", "mesh-0.5", "step-0.5", "step-0.25", "penalty-4", "penalty-16", "alpha--0.3"]
    assert {level.setting for level in levels_of(block.study)} == {"step", "penalty"}  # alpha is -0.05 already
    values = changed("contact", None)
    del values["sweep"], values["programme"]
    values["time"] = {**values["time"], "end": "0.1 s"}
    study = plan_study(write_study(values)).runs[0].study
    assert {level.setting for level in levels_of(study)} == {"step"}


def test_what_is_asked_for_and_cannot_be_refined_is_said(write_study):
    asked = {"mesh": [0.6667, 0.5], "step": [0.5, 0.25], "alpha": [-0.05]}
    plan = plan_study(write_study(block_values() | {"converge": asked}))
    mesh, alpha = refinement_warnings(plan)
    assert mesh.startswith("converge.mesh is left out: the mesh is read")
    assert "fingerslip report" in mesh
    assert alpha.startswith("converge.alpha is left out")
    assert f"WARNING: block.yaml: {mesh}." in check_plans([plan]).note
    assert refinement_warnings(plan_study(write_study())) == (), "defaults ask for nothing"
    said = StudyConvergence(plan.folder, (RunConvergence("run", "", {}),), (mesh,)).tables[0].note
    assert said.endswith(f"WARNING: {mesh}.")


def test_element_sizes_that_ridges_refuse_are_said_by_a_check_and_refused_before_any_run(write_study, called):
    path = write_study(FINGER | {"converge": {"mesh": [0.5, 2]}})
    plan, fault = plan_study(path), "with 2, mesh.contact_size got 0.24 mm, needs <= 0.1567 mm, a third of ridges.pitch"
    assert refinement_warnings(plan) == (f"converge.mesh: {fault}; write other factors",)
    with pytest.raises(fs.InputError) as error:
        refined(path)
    assert str(error.value).endswith(f": converge.mesh: {fault}; write other factors")
    assert called == []
    assert refinement_warnings(plan_study(write_study(FINGER | {"converge": {"mesh": [0.5, 0.75]}}))) == ()


def test_factors_that_leave_the_edges_at_the_contact_as_they_are_are_said(write_study):
    coarse = FINGER | {"mesh": {"contact_size": "0.15 mm", "bulk_size": "0.5 mm"}}
    plan = plan_study(write_study(coarse | {"converge": {"mesh": [0.6667, 0.5]}}))
    (said,) = refinement_warnings(plan)
    assert said.startswith("converge.mesh: factor 0.6667 has edges of 0.12 mm at the contact, and 1 has 0.12 mm: ")
    assert said.endswith("; write other factors, such as [0.5, 0.3333]")
    assert refinement_warnings(plan_study(write_study(coarse | {"converge": {"mesh": [0.5, 0.3333]}}))) == ()
    assert refinement_warnings(plan_study(write_study(coarse))) == (), "defaults ask for nothing"
    assert convergence.contact_warning({1.0: 0.2, 0.5: 0.19, 0.25: 0.1}).startswith("converge.mesh: factor 0.5 has")
    assert convergence.contact_warning({1.0: 0.2, 0.5: 0.1, 0.25: 0.05}) == ""
    assert convergence.contact_warning({1.0: None, 0.5: None}) == convergence.contact_warning({}) == ""


def test_sizes_steps_and_stiffness_are_multiplied(block):
    (run,) = expand_mapping(FINGER, Path("finger.yaml")).runs
    sizes = run_at(run, Level("mesh", 0.5), None).study.mesh  # the model is not asked
    assert isinstance(sizes, fs.MeshSizes)
    assert (sizes.contact_size, sizes.bulk_size) == pytest.approx((0.06e-3, 0.14e-3))
    assert sizes.contact_reach == fs.MeshSizes().contact_reach
    time = dataclasses.replace(block.study.time, step="auto", output=8e-3, tolerance=0.01, smallest=1e-3)
    run = dataclasses.replace(block, study=dataclasses.replace(block.study, time=time))
    finer = run_at(run, Level("step", 0.5), build_model(run)).study.time
    assert (finer.step, finer.output, finer.tolerance, finer.smallest) == ("auto", 4e-3, 0.01 / 8, 0.5e-3)
    model = build_model(block)
    assert model.contacts[0].normal_penalty is None
    stiffer = build_model(run_at(block, Level("penalty", 4.0), model))
    expected = contact_penalties(model, model.contacts[0])
    assert contact_penalties(stiffer, stiffer.contacts[0]) == pytest.approx(tuple(4.0 * one for one in expected))


def test_every_level_is_a_run_of_its_own(block):
    model = build_model(block)
    runs = [block, *(run_at(block, level, model) for level in levels_of(block.study))]
    assert len({run.identity for run in runs}) == len({run.name for run in runs}) == len(runs)
    assert all(run.study.record.snapshots_every == 0.0 for run in runs)
    assert all(run.swept == block.swept for run in runs)
    times = [run.study.time for run in (runs[2], run_at(block, Level("alpha", -0.3), model))]
    assert [(time.step, time.alpha) for time in times] == [(0.5e-3, -0.05), (2e-3, -0.3)], "one setting changes alone"


STEP = 2e-3


@pytest.fixture
def called(monkeypatch):
    """Replace the simulation: slip is overall 8 ms later with the full step, and less so with finer ones."""
    calls = []

    def fake(model, **options):
        calls.append(model)
        return later_with_longer_steps(model, **options)

    monkeypatch.setattr("fingerslip.dynamics.simulation.simulate", fake)
    return calls


def later_with_longer_steps(model, *, progress, threads, bases):
    progress(1.0)
    return with_step(model.time.step).copy()


@functools.cache
def with_step(step):
    return synthetic.make(synthetic.Process(centre=1.7 + 0.1 * step / STEP))


def refined(path, **options):
    return converge(path, results_dir=path.parent / "results", workers=1, **options)


def plain(**values):
    return {**block_values(), "sweep": {}, **values}


@pytest.fixture(scope="module")
def known(tmp_path_factory):
    """Return a study of one run, refined, and its file; tests leave them as they are."""
    folder = tmp_path_factory.mktemp("refined")
    fs.write_mesh(block_mesh(), folder / "block.msh")
    path = folder / "block.yaml"
    path.write_text(yaml.safe_dump(plain(), sort_keys=False))
    with pytest.MonkeyPatch.context() as patch:
        all_is_compiled(patch)
        patch.setattr("fingerslip.dynamics.simulation.simulate", later_with_longer_steps)
        draw_nothing(patch)
        return refined(path), path


def test_a_travel_is_known_to_half_a_step_of_the_slide_also_where_all_slips_at_once(block):
    at_once, later = (fs.SlipEvents(incipient=incipient, overall=0.04) for incipient in (0.04, 0.03))
    numbers = {"slide_step_s": 2e-3, "latency_travel_m": 4e-5}
    for slip, expected in ((later, 4e-6), (at_once, 5e-6)):
        run = RunResult("run", {}, fs.Events(slip), numbers=numbers)
        assert convergence._resolution(run, block.study, "overall_travel_m", "m") == pytest.approx(expected)
    body = fs.RigidBody(0.1, programme=(fs.Slide(distance=1e-3, speed=7e-3),))
    contact = dataclasses.replace(block.study.contact, rigid_body="plate")
    study = dataclasses.replace(block.study, bodies={"plate": body}, contact=contact, programme=())
    assert convergence._resolution(run, study, "overall_travel_m", "m") == pytest.approx(7e-6), "of a rigid body"


@pytest.mark.slow
@pytest.mark.usefixtures("called", "reports")
def test_error_bars_of_meshes_with_the_same_edges_at_the_contact_are_those_of_the_bulk(write_study, monkeypatch):
    said: list[str] = []
    monkeypatch.setattr(StudyProgress, "say", lambda _, text: said.append(text))
    levels = {"mesh": [0.75, 0.5], "step": [], "penalty": [], "alpha": []}
    result = refined(write_study(FINGER | {"converge": levels}))  # the nodes of all histories are the same
    (warning,) = [text for text in said if text.startswith("WARNING")]
    assert warning.startswith("WARNING: converge.mesh: factor 0.5 has edges of ")
    quantities = result.runs[0].quantities
    assert {name for quantity in quantities.values() for name in quantity.sources} == {"bulk"}
    (table,) = result.tables
    assert table.note.endswith(warning)
    assert "over element sizes (not at every level those of the contact). It is" in table.note
    names = [column.name for column in table.columns]
    assert "± bulk" in names
    assert "± mesh" not in names
    assert "yes" not in {row[-1] for row in table.rows}
    stored = json.loads((result.folder / "convergence" / "convergence.json").read_text())
    assert set(stored["run"]["quantities"]["slip.overall"]["sources"]) == {"bulk"}


@pytest.mark.slow
def test_order_and_limit_of_a_known_dependence_are_found_and_written_with_tables_and_figures(known):
    found, path = known
    overall = found.runs[0].quantities["slip.overall"]
    step = overall.refinements["step"]
    assert overall.sources["step"].sizes == (1.0, 0.5, 0.25)
    assert step.order == pytest.approx(1.0, abs=0.05)  # records are a step apart
    assert step.limit == pytest.approx(overall.value - 0.1, abs=5e-3)
    assert overall.refinements["penalty"].behaviour == "unchanged"
    assert overall.uncertainty == pytest.approx(1.25 * 0.1, rel=0.1)
    assert overall.unsettled_settings == ()
    numbers = stored_result(found.folder / "run").numbers
    half = 0.5 * numbers["slide_step_s"]
    assert overall.resolution == pytest.approx(half)
    speed = numbers["overall_travel_m"] / (overall.value - phase_times(with_step(STEP), "slide")[0][0])
    resolutions = {key: quantity.resolution for key, quantity in found.runs[0].quantities.items()}
    assert resolutions["overall_travel_m"] == pytest.approx(speed * half)
    assert resolutions["normal_force_max_N"] == 0.0
    folder = found.folder / "convergence"
    assert [path.name for path in (folder / "figures").iterdir()] == ["run.png"]
    with (folder / "convergence.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if row["quantity"] == "slip.overall" and row["setting"] == "step"]
    assert [float(row["size"]) for row in rows] == [1.0, 0.5, 0.25]
    assert "overall slip" in str(found.tables[0].rows)
    folders = level_folders(path, path.parent / "results")
    assert len(folders) == 4
    assert all((folder / "history.nc").is_file() for level in folders.values() for folder in level)


@pytest.mark.slow
@pytest.mark.usefixtures("called", "reports")
def test_an_added_measure_gets_its_sizes_its_order_and_its_uncertainty(write_study, monkeypatch):
    added = Measure("last", "last slip", lambda history: find_events(history).overall, Unit("s"))
    monkeypatch.setattr(measures, "MEASURES", (*measures.MEASURES, added))
    values = plain(
        time={"step": "2 ms", "alpha": -0.3}, converge={"penalty": [], "alpha": [-0.05, 0.0], "mesh": [0.6667, 0.5]}
    )
    said: list[str] = []
    monkeypatch.setattr(StudyProgress, "say", lambda _, text: said.append(text))
    result = refined(write_study(values))
    (warning,) = [text for text in said if text.startswith("WARNING: converge.mesh is left out")]
    assert result.tables[0].note.endswith(warning), "nothing of the penalties, of which none are asked"
    found = result.runs[0].quantities["last_s"]
    assert found.sources["alpha"].sizes == (-0.3, -0.05, 0.0), "those of the damping are its values"
    assert found.refinements["step"].order == pytest.approx(1.0, abs=0.05)
    assert "last slip" in [row[0] for row in result.tables[0].rows]
    verdicts = {row[-1] for row in result.tables[0].rows}
    assert "yes" not in verdicts, "a mesh that is read is not refined"
    assert "as far as studied" in verdicts
    stored = json.loads((result.folder / "convergence" / "convergence.json").read_text())
    assert stored["run"]["quantities"]["last_s"]["uncertainty"] == pytest.approx(found.uncertainty)
    with (result.folder / "summary.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert float(row["last_uncertainty_s"]) == pytest.approx(found.uncertainty)


@pytest.mark.slow
def test_only_what_is_not_there_is_computed_and_the_report_made_again_with_the_uncertainties(
    write_study, called, reports
):
    path = write_study(plain())
    run_block(path)
    assert (len(called), len(reports)) == (1, 1)
    for _ in range(2):
        refined(path)
        assert (len(called), len(reports)) == (1 + 4, 2)
    assert {model.time.step for model in called} == {STEP, STEP / 2, STEP / 4}
    with pytest.raises(fs.InputError, match=r"no run 'nix', has run"):
        refined(path, only=["nix"])
    assert len(called) == 1 + 4


@pytest.mark.slow
@pytest.mark.usefixtures("called", "reports")
def test_chosen_runs_are_refined_and_earlier_ones_stay_known_to_the_tables_of_the_study(write_study):
    path = write_study()
    assert [found.run for found in refined(path, only=NAMES[:1]).runs] == NAMES[:1]
    runs = run_block(path).runs
    assert runs[0].uncertainty["slip.overall"] == pytest.approx(0.125, rel=0.1)
    assert runs[1].uncertainty == {}
    with (path.parent / "results" / "block" / "summary.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert float(rows[0]["overall_uncertainty_s"]) == pytest.approx(0.125, rel=0.1)
    assert rows[1]["overall_uncertainty_s"] == ""
    refined(path, only=NAMES[1:2])
    stored = json.loads((path.parent / "results" / "block" / "convergence" / "convergence.json").read_text())
    assert sorted(stored) == ["checksum", *NAMES[:2]]


@pytest.mark.usefixtures("reports")
def test_a_level_that_fails_fails_the_refinement(write_study, monkeypatch):
    def fake(model, *, progress, threads, bases):
        progress(1.0)
        if model.time.step < STEP:
            raise fs.ConvergenceError(0.1, 3, 1.0, 1e-10, "try")
        return synthetic.make(synthetic.Process())

    monkeypatch.setattr("fingerslip.dynamics.simulation.simulate", fake)
    path = write_study(plain())
    with pytest.raises(fs.StudyFailedError, match=r"run_step-0\.5"):
        refined(path)
    assert not (path.parent / "results" / "block" / "convergence" / "convergence.json").exists()


def test_documentation_quotes_the_reference_table():
    table = (ROOT / "results" / "reference" / "convergence.md").read_text(encoding="utf-8")
    original = table[table.index("| quantity") :].split("\n\n")[0]
    page = (ROOT / "docs" / "convergence.md").read_text(encoding="utf-8")
    quoted = page[page.index("| quantity") :].split("\n\n")[0].splitlines()
    assert len(quoted) > 10
    assert set(quoted) <= set(original.splitlines())
