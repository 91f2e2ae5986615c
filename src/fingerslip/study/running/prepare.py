"""Runs made ready to be computed: their models built and checked, and which of them take a reduced basis.

Nothing of what computes or reports them is loaded here.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

from fingerslip.contact.friction import weakens
from fingerslip.dynamics.recording.steps import step_count
from fingerslip.dynamics.step.sharing import first_alike, material_key, same_body, same_matrix
from fingerslip.dynamics.system.checks import inspect_model
from fingerslip.dynamics.system.doubts import doubts
from fingerslip.errors import InputError
from fingerslip.fe.space import Space, build_space
from fingerslip.model.model import Model
from fingerslip.model.timing import Adaptive
from fingerslip.results import RefusedRun
from fingerslip.study.definition.runs import Run
from fingerslip.study.running.build import build_mesh, build_model, locate_error, mesh_key
from fingerslip.study.running.cost import basis_saves
from fingerslip.study.running.plan import Job, Plan, Prepared

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


def choose_bases(jobs: Sequence[Job]) -> tuple[Job, ...]:
    """Decide where a study says ``basis: automatic``: for a reduced basis where the runs that share it save time."""
    first = first_alike([job.model for job in jobs], same_body, material_key)
    is_open = [job.run.study.dynamics.basis == "automatic" for job in jobs]
    saves = {
        kind: _saves([job.model for job, leader in zip(jobs, first, strict=True) if leader == kind])
        for kind in {leader for leader, undecided in zip(first, is_open, strict=True) if undecided}
    }
    return tuple(
        _decide(job, reduced=saves[leader]) if undecided else job
        for job, leader, undecided in zip(jobs, first, is_open, strict=True)
    )


def _saves(models: Sequence[Model]) -> bool:
    """Tell whether a basis saves time in all motions of a body together."""
    if any(_needs_mesh(model) for model in models):
        return False
    checked_model = inspect_model(models[0])
    nodes = {node for candidate in checked_model.candidates for node in candidate.nodes.tolist()}
    # The first of several motions with a matrix may try out how many normal modes suffice, and is computed again.
    first = first_alike(models, same_matrix)
    steps = sum(
        step_count(model) for number, model in enumerate(models) if first[number] != number or first.count(number) == 1
    )
    return basis_saves(checked_model.free.size, checked_model.space.dim * len(nodes), steps, checked_model.space.dim)


def _needs_mesh(model: Model) -> bool:
    """Tell whether a model has to be computed on the mesh.

    That is so for all that :func:`~fingerslip.dynamics.reduced.basis.compute_in_basis` refuses, and where friction
    weakens as nodes slip: such slip multiplies differences, however small, so that no tolerance holds.
    """
    weak = any(weakens(contact.friction) for contact in model.contacts)
    relaxes = any(getattr(material, "prony", ()) for material in model.materials.values())
    damped = any(body.dampers for body in model.bodies.values())
    moved = bool(model.support_motions)
    return weak or relaxes or damped or moved or model.is_finite or isinstance(model.time, Adaptive)


def _decide(job: Job, *, reduced: bool) -> Job:
    dynamics = dataclasses.replace(job.run.study.dynamics, basis="reduced" if reduced else "full")
    study = dataclasses.replace(job.run.study, dynamics=dynamics)
    model = dataclasses.replace(job.model, basis=dynamics.reduced)
    return dataclasses.replace(job, run=dataclasses.replace(job.run, study=study), model=model)
