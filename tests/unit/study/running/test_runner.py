"""Studies planned and run: nothing computed twice or left half done, nothing written for a wrong input."""

import csv
import dataclasses
import re
import shutil
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

import fingerslip as fs
from fingerslip.dynamics import simulation
from fingerslip.errors import InputError
from fingerslip.history import read_history
from fingerslip.results import stored_result
from fingerslip.study.definition import runs
from fingerslip.study.definition.file import read_mapping
from fingerslip.study.definition.runs import plan_studies, plan_study
from fingerslip.study.running import build as preparing
from fingerslip.study.running.build import prepare, prepare_samples, refuse_unused
from fingerslip.study.running.compute import BASES
from fingerslip.study.running.runner import StudyFailedError, run_study
from fingerslip.study.storage.reporting import original_mesh, read_results, read_run_values
from fingerslip.study.storage.store import read_manifest
from fingerslip.units import parse_quantity
from unit.study.block import FRICTIONS, NAMES, Told, block_mesh, block_values, changed, run_block
from unit.synthetic import Process, make


def test_plan_names_folder_and_runs_of_which_none_is_finished_and_one_mesh_is_shared(write_study, tmp_path):
    plan = plan_study(write_study(), tmp_path / "results")
    assert plan.folder == tmp_path / "results" / "block"
    assert [run.name for run in plan.runs] == NAMES
    assert len(set(plan.identities.values())) == 3
    assert plan.finished_runs() == {}
    jobs = prepare(plan, plan.runs)
    assert len({id(job.model.mesh) for job in jobs}) == 1
    assert [job.identity for job in jobs] == list(plan.identities.values())


def test_mistakes_of_several_files_come_together_and_studies_of_one_name_are_refused(write_study, tmp_path):
    path = write_study()
    with pytest.raises(InputError, match="needs a name of its own"):
        plan_studies([path, path], results_dir=path.parent / "results")
    values = block_values() | {"depth": 1, "sweep": {"time.end": [3], "time.stp": ["1 s"]}}
    bad, good = write_study(values, name="bad"), write_study()
    swept = write_study(changed("contact.boundary", 7), name="other")
    with pytest.raises(InputError) as caught:
        plan_studies([bad, good, swept, tmp_path / "gone.yaml"])
    assert [error.where.removeprefix(f"{tmp_path}/") for error in caught.value.all] == [
        *("bad.yaml: depth", "bad.yaml: sweep.time.end.0", "bad.yaml: sweep.time.stp"),
        "other.yaml: contact.boundary",
        "gone.yaml",
    ]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("overall_slip * nothing", "'nothing' is not known"),
        ("overall_slip + depth", "needs units that fit together"),
        # The first run has a plane, which has no radius.
        ("counterface.cylinder.radius / '1 mm'", "'counterface.cylinder.radius' is not known"),
        ("depth ** contacts.0.friction_coefficient", "needs one unit in all runs"),
    ],
)
def test_derived_quantities_of_all_runs_are_checked_before_anything_runs(write_study, text, said):
    counterfaces = [{"plane": {"normal": [0, 1]}}, {"cylinder": {"radius": "8 mm"}}]
    contact = {"boundary": "contact", "counterface": counterfaces[0], "friction_coefficient": 0.5}
    values = {key: own for key, own in block_values().items() if key != "contact"} | {"contacts": [contact]}
    swept = {"contacts.0.counterface": counterfaces, "contacts.0.friction_coefficient": [0.5, 0.6]}
    values |= {"sweep": swept, "derived": {"x": text}}
    with pytest.raises(InputError, match=r"block\.yaml: derived\.x") as caught:
        plan_study(write_study(values))
    assert said in str(caught.value)


def test_a_run_that_makes_no_model_is_named(write_study):
    plan = plan_study(write_study(changed("sweep", {"contact.boundary": ["bottom", "pulp"]})))
    with pytest.raises(InputError, match=r"block\.yaml \(contact\.boundary = pulp\).*'pulp' not in mesh"):
        prepare(plan, plan.runs)


TOLERANCES = {"tolerance": 0.01, "acceleration_tolerance": 0.9}


def values(basis, **changes):
    return block_values() | {"dynamics": {"basis": basis, **TOLERANCES}} | changes


@pytest.fixture
def asked(monkeypatch):
    """Return what is asked of the estimate, which says that a basis saves from more than 50 steps on."""
    asked = []

    def saves(*sizes):
        asked.append(sizes)
        return sizes[2] > 50

    monkeypatch.setattr(preparing, "basis_saves", saves)
    return asked


def chosen(path, tmp_path):
    plan = plan_study(path, tmp_path)
    jobs = prepare(plan, plan.runs)
    assert all((job.model.basis is not None) == (job.run.study.dynamics.basis == "reduced") for job in jobs)
    return [job.run.study.dynamics.basis for job in jobs]


@pytest.mark.parametrize("says", [True, False])
def test_runs_that_share_a_body_are_counted_together_also_where_a_study_says_nothing(
    write_study, tmp_path, asked, says
):
    whole = values("automatic")
    silent = {key: item for key, item in whole.items() if key != "dynamics"}
    assert chosen(write_study(whole if says else silent), tmp_path) == ["reduced"] * 3
    ((unknowns, interface, steps, dim),) = asked
    assert (unknowns, steps, dim) == (72, 2 * 30, 2)
    assert 0 < interface < unknowns


def test_a_run_alone_is_the_one_that_tries_its_basis_out(write_study, tmp_path, asked):
    """Runs with matrices of their own: two of one body share a basis, two bodies have one each."""
    shared = values("automatic", sweep={"time.alpha": [-0.05, -0.1]})
    assert chosen(write_study(shared), tmp_path) == ["reduced"] * 2
    assert {steps for _, _, steps, _ in asked} == {2 * 30}
    asked.clear()
    alone = values("automatic", sweep={"materials.block.poisson_ratio": [0.2, 0.3]})
    assert chosen(write_study(alone), tmp_path) == ["full"] * 2
    assert [steps for _, _, steps, _ in asked] == [30] * 2


def test_what_a_study_says_is_done_and_decisions_leave_everything_else_as_it_was(write_study, tmp_path, asked):
    for basis in ("full", "reduced"):
        assert chosen(write_study(values(basis)), tmp_path) == [basis] * 3
    assert asked == []
    plan = plan_study(write_study(values("automatic")), tmp_path)
    jobs = prepare(plan, plan.runs)
    assert asked
    for job, run in zip(jobs, plan.runs, strict=True):
        assert job.identity == plan.identities[run.name]
        assert dataclasses.replace(job.run.study, dynamics=run.study.dynamics) == run.study


@pytest.mark.slow
@pytest.mark.usefixtures("asked")
def test_run_yaml_says_what_was_decided_and_the_basis_is_kept(write_study):
    path = write_study(values("automatic"))
    result = run_block(path)
    for run in result.runs:
        assert read_mapping(result.folder / run.name / "run.yaml")["dynamics"] == TOLERANCES | {"basis": "reduced"}
        assert fs.read_history(result.folder / run.name / "history.nc").attrs["basis"] == "reduced"
    assert len(list((result.folder / BASES).glob("*.basis"))) == 1
    assert len(run_block(path).unchanged) == 3


@pytest.mark.slow
def test_a_basis_of_another_study_file_serves_no_other_body(write_study):
    result = run_block(write_study(values("reduced", sweep={"materials.block.density": ["900 kg/m^3", "1000 kg/m^3"]})))
    assert len(list((result.folder / BASES).glob("*.basis"))) == 2


UNKNOWN = yaml.safe_load("""
large strain: {kinematics: finite, law: neo_hookean}
relaxing: {prony: [{share: 0.3, time: 0.1 s}]}
steps that control their error: {time: {step: auto, output: 2 ms}}
weakening friction:
  contact: {boundary: bottom, friction: {slip_weakening: {static: 0.6, kinetic: 0.5, distance: 0.1 mm}}}
  sweep: {contact.friction.slip_weakening.static: [0.6, 0.7, 0.8]}
""")


@pytest.mark.parametrize("changes", UNKNOWN.values(), ids=UNKNOWN)
def test_what_a_basis_does_not_know_takes_the_mesh(write_study, tmp_path, asked, changes):
    own = {key: changes[key] for key in changes.keys() & {"law", "prony"}}
    others = {key: changes[key] for key in changes.keys() - own.keys()}
    block = block_values()["materials"]["block"] | own
    path = write_study(values("automatic", materials={"block": block}, **others))
    assert chosen(path, tmp_path) == ["full"] * 3
    assert asked == []


def leftovers(folder):
    return sorted(path.name for path in folder.rglob(".*"))


def test_results_of_every_run_are_written_once(write_study, simulated, reports):
    path = write_study()
    result = run_block(path)
    assert simulated == FRICTIONS
    assert result.computed == tuple(NAMES)
    written = {path.name for path in result.folder.iterdir()}
    copy = plan_study(path).runs[0].mesh_copy
    assert written == {*NAMES, copy, "manifest.json", "report.html", "summary.csv"}
    for name in NAMES:
        files = sorted(path.name for path in (result.folder / name).iterdir())
        assert files == ["events.json", "history.nc", "log.txt", "run.yaml"]
    assert read_history(result.folder / NAMES[0] / "history.nc").sizes["time"] == 401
    again = run_block(path)
    assert simulated == FRICTIONS
    assert (again.computed, again.unchanged) == ((), tuple(NAMES))
    assert reports == [tuple(NAMES)]


@pytest.mark.usefixtures("finished")
@pytest.mark.parametrize(
    "changes",
    [
        {"title": "Another title"},
        {"description": "A question."},
        {"compare": []},
        {"integration": "selective"},  # the default, but now given
    ],
)
def test_a_report_is_made_again_where_what_it_shows_has_changed(write_study, simulated, reports, changes):
    run_block(write_study(block_values() | {"compare": ["wang2014-table2"]} | changes))
    assert (simulated, len(reports)) == ([], 1)


@pytest.mark.usefixtures("finished", "simulated")
def test_a_report_is_made_again_where_runs_that_are_computed_again_come_to_something_else(
    write_study, reports, monkeypatch
):
    path, whole = write_study(), simulation.simulate
    for _ in range(2):
        run_block(path)
        assert len(reports) == 1
    other = SimpleNamespace(contacts=[SimpleNamespace(friction=SimpleNamespace(coefficient=0.77))])
    monkeypatch.setattr("fingerslip.dynamics.simulation.simulate", lambda _, **options: whole(other, **options))
    run_block(path, force=True)
    assert len(reports) == 2


@pytest.mark.usefixtures("finished", "reports")
def test_what_changes_a_result_is_computed_again(write_study, simulated):
    """The title does not; a new value in the sweep, a value, the mesh file and the wish do."""
    run_block(write_study(changed("title", "Another title")))
    assert simulated == []
    result = run_block(write_study(changed("sweep", {"contact.friction_coefficient": [*FRICTIONS, 0.8]})))
    assert simulated == [0.8]
    assert len((result.folder / "summary.csv").read_text().splitlines()) == 5
    for values, curvature, force in ((changed("time.step", "1 ms"), 0.0, False), (None, 1.0, False), (None, 1.0, True)):
        simulated.clear()
        run_block(write_study(values, curvature=curvature), force=force)
        assert simulated == FRICTIONS


@pytest.mark.usefixtures("reports", "simulated")
def test_a_run_is_repeated_from_its_results_alone_and_with_the_mesh_that_it_had(write_study, tmp_path):
    path = write_study()
    plan = plan_study(path, tmp_path / "results")
    name, content = plan.runs[0].mesh_copy, path.with_name("block.msh").read_bytes()
    assert re.fullmatch(r"block-[0-9a-f]{8}\.msh", name)
    result = run_block(path)
    assert {run.values["mesh.file"] for run in result.runs} == {f"../{name}"}
    path.with_name("block.msh").unlink()
    moved = shutil.move(result.folder, tmp_path / "elsewhere")
    again = plan_study(moved / NAMES[0] / "run.yaml", moved.parent / "again")
    assert again.runs[0].mesh_key == plan.runs[0].mesh_key
    assert again.runs[0].mesh_copy == name
    assert (moved / name).read_bytes() == content
    assert len(read_results(moved).runs) == 3


@pytest.mark.usefixtures("reports", "simulated")
@pytest.mark.parametrize("included", ["parts/nodes.inp", "../nodes.inp", "absolute"])
def test_files_that_a_deck_includes_are_copied_with_it_where_they_are_beside_it(write_study, tmp_path, included):
    mesh, folder = block_mesh(), tmp_path / "decks"
    nodes = folder / included.replace("absolute", "parts/nodes.inp")
    included = str(nodes) if included == "absolute" else included
    (folder / "parts").mkdir(parents=True)
    nodes.write_text("".join(f"{n}, {x}, {y}\n" for n, (x, y) in enumerate(mesh.p.T, start=1)))
    lines = ["*Node", f"*Include, input={included}", "*Element, type=CPE4, elset=block"]
    lines += [", ".join(map(str, (n, *nodes_of_cell))) for n, nodes_of_cell in enumerate(mesh.t.T + 1, start=1)]
    for name in ("bottom", "top"):
        numbers = np.unique(mesh.facets[:, mesh.boundaries[name]]) + 1
        lines += [f"*Nset, nset={name}", ", ".join(map(str, numbers))]
    (folder / "deck.inp").write_text("\n".join(lines))
    path = write_study(changed("mesh", {"file": "decks/deck.inp", "length_unit": "m"}))
    first = plan_study(path, tmp_path / "results").runs[0]
    expected = first.mesh_key, first.mesh_copy
    run_block(path)
    moved = shutil.move(tmp_path / "results" / "block", tmp_path / "elsewhere")
    again = moved / NAMES[0] / "run.yaml"
    if included.startswith(".."):
        assert yaml.safe_load(again.read_text())["mesh"]["file"] == str(folder / "deck.inp")
        return
    nodes.write_text("1, 0., 0.\n")
    for _ in ("changed", "gone"):
        (run,) = plan_study(again, tmp_path / "again").runs
        assert (run.mesh_key, run.mesh_copy) == expected
        shutil.rmtree(folder, ignore_errors=True)
    assert original_mesh(read_run_values(again)) == ("deck.inp", run.mesh_copy[5:13])
    assert run.study.mesh.build().p == pytest.approx(mesh.p)


def test_large_mesh_files_are_not_copied(write_study, tmp_path, monkeypatch):
    monkeypatch.setattr(runs, "_LARGEST_COPY", 4)
    run = plan_study(write_study(), tmp_path).runs[0]
    assert (run.mesh_copy, run.written_values["mesh"]["file"]) == ("", str(tmp_path / "block.msh"))


@pytest.mark.usefixtures("reports", "simulated")
def test_runs_are_computed_where_their_mesh_file_is_not(write_study, monkeypatch):
    path, whole = write_study(), simulation.simulate

    def without_file(model, **options):
        path.with_name("block.msh").unlink(missing_ok=True)
        return whole(model, **options)

    monkeypatch.setattr(simulation, "simulate", without_file)
    result = run_block(path)
    assert result.computed == tuple(NAMES)
    copy = result.runs[0].values["mesh.file"].removeprefix("../")
    log = (result.folder / NAMES[0] / "log.txt").read_text()
    assert f"mesh {copy}, a copy of {path.with_name('block.msh')}\n" in log


@pytest.mark.usefixtures("reports")
def test_interrupted_study_leaves_nothing_half_done_and_goes_on(write_study, simulated, fails, monkeypatch):
    path = write_study()
    whole = simulation.simulate
    fails(KeyboardInterrupt())
    with pytest.raises(KeyboardInterrupt):
        run_block(path)
    assert not (path.parent / "results").exists(), "before the first result there is no folder"
    monkeypatch.setattr("fingerslip.dynamics.simulation.simulate", whole)
    fails(KeyboardInterrupt(), friction=0.4)
    told = Told()
    with pytest.raises(KeyboardInterrupt):
        run_block(path, progress=told)
    assert told.messages == ["block: 1 of 3 runs are finished and kept; those that share a matrix finish together"]
    monkeypatch.setattr("fingerslip.dynamics.simulation.simulate", whole)
    folder = path.parent / "results" / "block"
    assert sorted(item.name for item in folder.iterdir() if item.is_dir()) == [NAMES[0]]
    assert leftovers(folder) == []
    assert len((folder / "summary.csv").read_text().splitlines()) == 2
    assert run_block(path).unchanged == (NAMES[0],)
    assert simulated == FRICTIONS


def test_what_was_computed_of_a_run_that_fails_is_no_result_and_goes_when_the_run_is_computed(
    write_study, simulated, reports, fails, monkeypatch
):
    path, whole, told, error = write_study(), simulation.simulate, Told(), fs.ConvergenceError(1.0, 7, 1.0, 1e-9, "try")
    error.history = make(Process()).isel(time=slice(10)).assign_attrs(failure=str(error))
    fails(error, friction=0.4)
    with pytest.raises(StudyFailedError, match="1 of 3 runs failed"):
        run_block(path, progress=told)
    failed = path.parent / "results" / "block" / f"{NAMES[1]}.unfinished"
    assert told.messages == [f"{NAMES[1]}: what was computed until it failed is in {failed}"]
    assert sorted(file.name for file in failed.iterdir()) == ["history.nc", "log.txt"]
    assert str(error) in (failed / "log.txt").read_text()
    with pytest.warns(UserWarning, match=r"is no result: it ends where its run failed: contact at t = 1 s, node 7"):
        assert read_history(failed / "history.nc").sizes["time"] == 10
    with pytest.raises(fs.ResultError, match="holds no finished run"):
        stored_result(failed)
    assert [run.name for run in read_results(failed.parent).runs] == [NAMES[0], NAMES[2]]
    monkeypatch.setattr(simulation, "simulate", whole)
    assert run_block(path).computed == (NAMES[1],)
    assert (failed.exists(), simulated, len(reports)) == (False, [0.2, 0.6, 0.4], 2)


def test_failed_run_does_not_stop_the_others(write_study, simulated, reports, fails):
    fails(friction=0.4)
    path = write_study()
    with pytest.raises(StudyFailedError) as caught:
        run_block(path)
    assert list(caught.value.errors) == [f"block/{NAMES[1]}"]
    assert str(caught.value).splitlines()[-1] == "1 of 3 runs failed, the others are finished"
    assert simulated == [0.2, 0.6]
    assert reports == [(NAMES[0], NAMES[2])]
    assert leftovers(path.parent / "results") == []


def test_all_runs_of_all_studies_are_checked_before_anything_is_written(write_study, simulated):
    path = write_study(changed("sweep", {"contact.boundary": ["bottom", "pulp"]}))
    with pytest.raises(InputError, match="boundary 'pulp' not in mesh"):
        run_block(path)
    bad = write_study(changed("contact.friction_coefficient", -0.2), name="bad")
    with pytest.raises(InputError, match=r"bad\.yaml: contact\.friction_coefficient: got -0\.2"):
        plan_studies([write_study(), bad], path.parent / "results")
    assert simulated == []
    assert not (path.parent / "results").exists()


@pytest.mark.parametrize("name", ["results", "results/study"])
def test_a_file_where_results_would_go_is_refused_first(write_study, simulated, name):
    path = write_study()
    file = path.parent / name.replace("study", path.stem)
    file.parent.mkdir(exist_ok=True)
    file.write_text("mine")
    with pytest.raises(InputError, match=rf"{re.escape(str(file))}: is a file, needs a folder; give another name"):
        run_block(path)
    assert simulated == []
    assert file.read_text() == "mine"


def test_progress_is_told_in_order_and_workers_are_at_least_one(write_study, simulated, reports):
    told = Told()
    path = write_study(block_values() | {"sweep": {}})
    run_block(path, progress=told)
    run_block(path, progress=told)
    assert told.told == [("begin", "run"), ("run", 0.5), ("run", "done"), ("block/run: unchanged",)]
    for workers in (0, -1):
        with pytest.raises(InputError, match="needs a number >= 1"):
            run_study(path, workers=workers)


@pytest.mark.usefixtures("reports")
@pytest.mark.parametrize("name", ["history.nc", "events.json", "run.yaml"])
def test_a_damaged_run_is_computed_again_and_said_so(finished, simulated, name):
    file = finished / NAMES[1] / name
    file.write_bytes(file.read_bytes()[:-9])
    said = Told()
    result = run_block(finished.parents[1] / "block.yaml", progress=said)
    assert (result.computed, result.unchanged) == ((NAMES[1],), (NAMES[0], NAMES[2]))
    assert simulated == FRICTIONS[1:2]
    (message,) = [text for text in said.messages if "unchanged" not in text]
    assert re.fullmatch(rf"block/{NAMES[1]}: .*/{name} is damaged: .*; the run is computed again", message)
    assert leftovers(finished) == []


@pytest.mark.usefixtures("simulated", "reports")
def test_runs_that_are_computed_in_any_case_are_not_read_through_before(finished):
    (finished / NAMES[1] / "history.nc").write_bytes(b"damaged")
    said = Told()
    assert run_block(finished.parents[1] / "block.yaml", progress=said, force=True).computed == tuple(NAMES)
    assert said.messages == []


def test_runs_that_are_known_to_be_whole_are_not_read_through_again(finished):
    plan = plan_study(finished.parents[1] / "block.yaml", finished.parent)
    (finished / NAMES[1] / "history.nc").write_bytes(b"damaged")
    assert list(plan.finished_runs()) == [NAMES[0], NAMES[2]]
    assert list(plan.finished_runs(whole=NAMES)) == NAMES
    shutil.rmtree(finished / NAMES[0])
    assert list(plan.finished_runs(whole=NAMES)) == NAMES[1:]


@pytest.mark.usefixtures("simulated", "reports")
def test_a_damaged_manifest_is_written_again_and_a_written_run_is_a_study_that_gives_the_same_run(
    finished, write_study
):
    for content in (b"", b"{}", b"\xff", b'{"runs": 3}'):
        (finished / "manifest.json").write_bytes(content)
        assert run_block(finished.parents[1] / "block.yaml").unchanged == tuple(NAMES)
        assert list(read_manifest(finished)["runs"]) == NAMES
    (repeated,) = plan_study(finished / NAMES[1] / "run.yaml").runs
    # The study leaves the basis open; the run says that it was computed on the mesh.
    original = plan_study(write_study(block_values() | {"dynamics": {"basis": "full"}})).runs[1]
    assert repeated.study.dynamics.basis == "full"
    assert repeated.identity == original.identity


def sampled(ranges, count=5):
    """Return the study of the block with samples."""
    return block_values() | {"sweep": {}, "sample": {"count": count, "ranges": ranges}}


@pytest.mark.slow
@pytest.mark.usefixtures("simulated", "reports")
def test_samples_are_run_like_a_sweep_and_said_to_move_the_events(write_study, simulated):
    """The history that stands for the simulation slips as a whole at 1.4 s + 0.5 s times the friction."""
    path = write_study(sampled({"contact.friction_coefficient": [0.2, 0.8]}))
    result = run_block(path)
    assert result.computed == tuple(f"sample-{number}" for number in range(1, 6))
    assert [one.swept for one in result.runs] == [{"sample": number} for number in range(1, 6)]
    lines = (result.folder / "summary.csv").read_text().splitlines()
    assert lines[0].startswith("run,sample,contact.friction_coefficient,incipient_s")
    assert lines[0].endswith(",refused")
    rows = list(csv.DictReader((result.folder / "sensitivity.csv").read_text().splitlines()))
    (overall,) = (row for row in rows if (row["reading"], row["time"]) == ("slip", "overall"))
    assert float(overall["slope_s_per_unit"]) == pytest.approx(0.5, abs=0.02)
    again = run_block(path)
    assert (again.computed, len(again.unchanged), len(simulated)) == ((), 5, 5)


@pytest.mark.usefixtures("simulated", "reports")
def test_samples_that_make_no_model_are_refused_and_the_study_goes_on(write_study):
    """The block is 5 mm high, so samples in the last part of the range are pressed through it."""
    said = Told()
    path = write_study(sampled({"programme.0.press.depth": ["0.1 mm", "6 mm"]}))
    result = run_block(path, progress=said)
    assert (len(result.runs), len(result.refused)) == (4, 1)
    (refused,) = result.refused
    assert "programme: presses " in refused.reason
    assert said.messages == [f"block/{refused.name}: refused: {refused.reason}"]
    last = (result.folder / "summary.csv").read_text().splitlines()[-1]
    depth = parse_quantity(refused.sampled["programme.0.press.depth"], "m")
    assert last.startswith(f"{refused.name},{refused.swept['sample']},{depth},")
    assert "presses" in last
    assert read_results(result.folder).refused == result.refused
    assert run_block(path).refused == result.refused, "they are refused again where nothing is left to compute"


HEIGHTS = {"fingertip.transverse.half_height": ["6 mm", "7 mm"]}
PITCHES = {"fingertip.ridges.pitch": ["0.4 mm", "0.5 mm"]}


@pytest.mark.parametrize(
    ("sample", "unused"),
    [
        ({"ranges": PITCHES | HEIGHTS}, {"pitch": "switched off", "half_height": "of the transverse section only"}),
        ({"ranges": PITCHES | {"contact.friction_coefficient": [0.2, 0.4]}}, {"pitch": "switched off"}),
        ({"ranges": PITCHES, "choices": {"fingertip.ridges.enabled": [False, True]}}, {}),
        ({"ranges": {"contact.friction_coefficient": [0.2, 0.4]}}, {}),
        ({"ranges": HEIGHTS, "equal": {"fingertip.sagittal.half_height": "fingertip.transverse.half_height"}}, {}),
    ],
)
def test_sampled_values_that_no_run_uses_are_refused_before_anything_is_meshed(write_study, sample, unused):
    fingertip = {"preset": "wang2014-2d", "ridges": {"enabled": False}}
    programme = [{"press": {"depth": "1 mm", "speed": "1 mm/s"}}]
    values = {"title": "Finger", "fingertip": fingertip, "programme": programme, "time": {"step": "5 ms"}}
    values |= {"contact": {"friction_coefficient": 0.4}}
    plan = plan_study(write_study(values | {"sample": {"count": 4} | sample}))
    if not unused:
        refuse_unused(plan)
        return
    with pytest.raises(InputError) as caught:
        prepare_samples(plan, plan.runs)
    lines = [str(mistake) for mistake in caught.value.all]
    for line, (name, reason) in zip(lines, unused.items(), strict=True):
        said = rf"block\.yaml: sample\.ranges\.fingertip\.\w+\.{name}: changes nothing \({reason}\), needs a value that"
        assert re.search(said, line)


@pytest.mark.parametrize(
    "values",
    [
        sampled({"programme.0.press.depth": ["5.5 mm", "6 mm"]}),  # all samples are refused
        block_values() | {"sweep": {"programme.0.press.depth": ["0.1 mm", "6 mm"]}},  # no sample
    ],
)
def test_a_study_with_no_right_sample_is_wrong(write_study, simulated, values):
    with pytest.raises(InputError, match="presses"):
        run_block(write_study(values))
    assert simulated == []
