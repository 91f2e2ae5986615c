"""What running a study would do: mistakes of all files first, shared meshes, refused samples, chosen bases."""

import dataclasses

import pytest
import yaml

import fingerslip as fs
from fingerslip.errors import InputError
from fingerslip.study.definition.file import read_mapping
from fingerslip.study.definition.runs import plan_studies, plan_study
from fingerslip.study.running import build as preparing
from fingerslip.study.running.build import prepare, prepare_samples
from fingerslip.study.running.compute import BASES
from fingerslip.study.running.runner import run_study
from unit.study.block import NAMES, block_values, changed


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


def test_a_sample_that_makes_no_model_is_refused_alone_and_another_run_named(write_study):
    sample = {"count": 4, "ranges": {"programme.0.press.depth": ["0.05 mm", "12 mm"]}}
    plan = plan_study(write_study(block_values() | {"sweep": {}, "sample": sample}))
    jobs, refused = prepare_samples(plan, plan.runs)
    assert jobs
    assert refused
    assert len(jobs) + len(refused) == 4
    plan = plan_study(write_study(changed("contact.boundary", "pulp")))
    with pytest.raises(InputError, match=r"block\.yaml \(contact\.friction_coefficient = 0\.2\).*'pulp' not in mesh"):
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


@pytest.mark.parametrize("basis", ["full", "reduced"])
def test_what_a_study_says_is_done(write_study, tmp_path, asked, basis):
    assert chosen(write_study(values(basis)), tmp_path) == [basis] * 3
    assert asked == []


@pytest.mark.slow
@pytest.mark.usefixtures("asked")
def test_run_yaml_says_what_was_decided_and_the_basis_is_kept(write_study, tmp_path):
    path = write_study(values("automatic"))
    result = run_study(path, results_dir=tmp_path / "results", workers=1)
    for run in result.runs:
        assert read_mapping(result.folder / run.name / "run.yaml")["dynamics"] == TOLERANCES | {"basis": "reduced"}
        assert fs.read_history(result.folder / run.name / "history.nc").attrs["basis"] == "reduced"
    assert len(list((result.folder / BASES).glob("*.basis"))) == 1
    assert len(run_study(path, results_dir=tmp_path / "results", workers=1).unchanged) == 3


@pytest.mark.slow
def test_a_basis_of_another_study_file_serves_no_other_body(write_study, tmp_path):
    path = write_study(values("reduced", sweep={"materials.block.density": ["900 kg/m^3", "1000 kg/m^3"]}))
    result = run_study(path, results_dir=tmp_path / "results", workers=1)
    assert len(list((result.folder / BASES).glob("*.basis"))) == 2


def test_decisions_leave_everything_else_as_it_was(write_study, tmp_path, asked):
    plan = plan_study(write_study(values("automatic")), tmp_path)
    jobs = prepare(plan, plan.runs)
    assert asked
    for job, run in zip(jobs, plan.runs, strict=True):
        assert job.identity == plan.identities[run.name]
        assert dataclasses.replace(job.run.study, dynamics=run.study.dynamics) == run.study


UNKNOWN = yaml.safe_load("""
large strain: {kinematics: finite, law: neo_hookean}
relaxing: {prony: [{share: 0.3, time: 0.1 s}]}
steps that control their error: {time: {step: auto, output: 2 ms}}
damped bodies:
  programme: []
  bodies: {plate: {mass: 1 g, free: [y], dampers: {y: 1 N s/m}, programme: []}}
  time: {step: 2 ms, end: 20 ms}
weakening friction:
  contact: {boundary: bottom, friction: {slip_weakening: {static: 0.6, kinetic: 0.5, distance: 0.1 mm}}}
  sweep: {contact.friction.slip_weakening.static: [0.6, 0.7, 0.8]}
moving supports:
  support_motions: {top: {displacement: [0 mm, 1 um], ramp: {times: [0 s, 0.1 s], factors: [0, 1]}}}
""")


@pytest.mark.parametrize("changes", UNKNOWN.values(), ids=UNKNOWN)
def test_what_a_basis_does_not_know_takes_the_mesh(write_study, tmp_path, asked, changes):
    own = {key: changes[key] for key in changes.keys() & {"law", "prony"}}
    others = {key: changes[key] for key in changes.keys() - own.keys()}
    block = block_values()["materials"]["block"] | own
    path = write_study(values("automatic", materials={"block": block}, **others))
    assert chosen(path, tmp_path) == ["full"] * 3
    assert asked == []
