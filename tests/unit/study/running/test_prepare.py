"""Runs made ready: models share their mesh, and impossible samples are refused alone."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from fingerslip.errors import InputError
from fingerslip.study.running.plan import plan_study
from fingerslip.study.running.prepare import prepare, prepare_samples
from unit.study.block import block_values, changed

Write = Callable[..., Path]


def test_runs_with_the_same_mesh_inputs_share_one_mesh(write_study: Write) -> None:
    plan = plan_study(write_study())
    jobs = prepare(plan, plan.runs)
    assert len({id(job.model.mesh) for job in jobs}) == 1
    assert [job.identity for job in jobs] == list(plan.identities.values())


def test_a_sample_that_makes_no_model_is_refused_alone(write_study: Write) -> None:
    sample = {"count": 4, "ranges": {"programme.0.press.depth": ["0.05 mm", "12 mm"]}}
    plan = plan_study(write_study(block_values() | {"sweep": {}, "sample": sample}))
    prepared = prepare_samples(plan, plan.runs)
    assert prepared.jobs
    assert prepared.refused
    assert len(prepared.jobs) + len(prepared.refused) == 4


def test_what_is_wrong_names_the_run(write_study: Write) -> None:
    plan = plan_study(write_study(changed("contact.boundary", "pulp")))
    with pytest.raises(InputError, match=r"block\.yaml \(contact\.friction_coefficient = 0\.2\).*'pulp' not in mesh"):
        prepare(plan, plan.runs)
