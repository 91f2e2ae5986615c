"""Runs made ready to be computed: their models built and checked, and nothing of what computes or reports them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from fingerslip.dynamics.system.checks import inspect_model
from fingerslip.dynamics.system.doubts import doubts
from fingerslip.errors import InputError
from fingerslip.fe.space import Space, build_space
from fingerslip.results import RefusedRun
from fingerslip.study.definition.runs import Run
from fingerslip.study.running.bases import choose_bases
from fingerslip.study.running.build import build_mesh, build_model, locate_error, mesh_key
from fingerslip.study.running.jobs import Job, Prepared
from fingerslip.study.running.plan import Plan

__all__ = ["prepare", "prepare_samples"]

#: Meshes and their spaces by what decides them.
_Meshes = dict[str, tuple[Any, Space]]


def prepare_samples(plan: Plan, runs: Sequence[Run]) -> Prepared:
    """Build and check the models of runs as :func:`prepare`, but go on where the values of a sample make no model."""
    meshes: _Meshes = {}
    jobs: list[Job] = []
    refused = list(plan.refused)
    for run in runs:
        try:
            jobs.append(_job(plan, run, meshes))
        except InputError as error:
            refused.append(RefusedRun(run.name, run.swept, run.sampled, str(error)))
            if not run.sampled or len(refused) == len(plan.runs) + len(plan.refused):
                raise
    return Prepared(choose_bases(jobs), tuple(refused))


def prepare(plan: Plan, runs: Sequence[Run]) -> tuple[Job, ...]:
    """Build and check the models of runs; runs with the same mesh inputs share one mesh."""
    meshes: _Meshes = {}
    return choose_bases([_job(plan, run, meshes) for run in runs])


def _job(plan: Plan, run: Run, meshes: _Meshes) -> Job:
    key = mesh_key(run)
    mesh, space = meshes.get(key, (None, None))
    mesh = build_mesh(run) if mesh is None else mesh
    model = build_model(run, mesh)
    try:
        space = space or build_space(mesh)
        checked_model = inspect_model(model, space)
    except InputError as error:
        raise locate_error(error, run.where, run.study) from None
    meshes[key] = mesh, space
    return Job(run, model, plan.identities[run.name], plan.folder / run.name, doubts(model, checked_model))
