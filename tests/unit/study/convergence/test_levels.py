"""The runs that a refinement adds to a study."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import pytest

from fingerslip.specimens.fingertip.meshing.section.source import MeshSizes
from fingerslip.study.convergence.converge import Level, levels_of, run_at
from fingerslip.study.definition.runs import Run, expand
from fingerslip.study.definition.spec import parse_study
from fingerslip.study.running.build import build_model
from fingerslip.study.running.plan import plan_study
from fingerslip.study.storage.store import identity
from unit.study.block import changed

Write = Callable[..., Path]
FINGER = {
    "fingertip": {"preset": "wang2014-2d"},
    "contact": {"friction_coefficient": 0.6},
    "programme": [{"press": {"depth": "1 mm", "speed": "5 mm/s"}}],
    "time": {"step": "2 ms", "alpha": -0.05},
}


@pytest.fixture
def block(write_study: Write) -> Run:
    return plan_study(write_study()).runs[0]


def test_a_fingertip_is_refined_in_all_settings_that_differ_from_its_own() -> None:
    study = parse_study({**FINGER, "converge": {"alpha": [-0.05, -0.3]}}, Path("finger.yaml"))
    labels = [level.label for level in levels_of(study)]
    assert labels == ["mesh-0.6667", "mesh-0.5", "step-0.5", "step-0.25", "penalty-4", "penalty-16", "alpha--0.3"]


def test_a_mesh_that_is_read_is_not_refined(block: Run) -> None:
    assert {level.setting for level in levels_of(block.study)} == {"step", "penalty"}  # alpha is -0.05 already


def test_a_body_without_contact_has_no_stiffness_to_change(write_study: Write) -> None:
    values = changed("contact", None)
    del values["sweep"], values["programme"]
    values["time"] = {**values["time"], "end": "0.1 s"}
    study = plan_study(write_study(values)).runs[0].study
    assert {level.setting for level in levels_of(study)} == {"step"}


def test_element_sizes_are_multiplied() -> None:
    (run,) = expand(parse_study(FINGER, Path("finger.yaml")), Path("finger.yaml"))
    sizes = run_at(run, Level("mesh", 0.5), None).study.mesh  # type: ignore[arg-type]  the model is not asked
    assert isinstance(sizes, MeshSizes)
    assert (sizes.contact_size, sizes.bulk_size) == pytest.approx((0.06e-3, 0.14e-3))
    assert sizes.contact_reach == MeshSizes().contact_reach


def test_steps_that_control_their_error_are_refined_by_their_tolerance(block: Run) -> None:
    time = dataclasses.replace(block.study.time, step="auto", output=8e-3, tolerance=0.01, smallest=1e-3)
    run = dataclasses.replace(block, study=dataclasses.replace(block.study, time=time))
    finer = run_at(run, Level("step", 0.5), build_model(run)).study.time
    assert (finer.step, finer.output, finer.tolerance, finer.smallest) == ("auto", 4e-3, 0.01 / 8, 0.5e-3)


def test_step_and_damping_change_alone(block: Run) -> None:
    model = build_model(block)
    finer = run_at(block, Level("step", 0.25), model)
    assert (finer.study.time.step, finer.study.time.alpha) == (0.5e-3, -0.05)
    damped = run_at(block, Level("alpha", -0.3), model)
    assert (damped.study.time.step, damped.study.time.alpha) == (2e-3, -0.3)


def test_automatic_stiffness_is_multiplied_too(block: Run) -> None:
    from fingerslip.dynamics.system.penalties import contact_penalties

    model = build_model(block)
    assert model.contacts[0].normal_penalty is None
    stiffer = build_model(run_at(block, Level("penalty", 4.0), model))
    expected = contact_penalties(model, model.contacts[0])
    assert contact_penalties(stiffer, stiffer.contacts[0]) == pytest.approx(tuple(4.0 * one for one in expected))


def test_every_level_is_a_run_of_its_own(block: Run) -> None:
    model = build_model(block)
    runs = [block, *(run_at(block, level, model) for level in levels_of(block.study))]
    assert len({identity(run) for run in runs}) == len({run.name for run in runs}) == len(runs)
    assert all(run.study.record.snapshots_every == 0.0 for run in runs)
    assert all(run.swept == block.swept for run in runs)
