"""Which runs of a study are computed in a reduced basis, where the study leaves it open."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from fingerslip.contact.friction import weakens
from fingerslip.dynamics.recording.steps import step_count
from fingerslip.dynamics.step.sharing import first_alike, material_key, same_body, same_matrix
from fingerslip.dynamics.system.checks import inspect_model
from fingerslip.model.model import Model
from fingerslip.model.timing import Adaptive
from fingerslip.study.running.cost import basis_saves
from fingerslip.study.running.jobs import Job

__all__ = ["choose_bases"]


def choose_bases(jobs: Sequence[Job]) -> tuple[Job, ...]:
    """Decide where a study says ``basis: automatic``: for a reduced basis where the runs that share it save time."""
    first = first_alike([job.model for job in jobs], same_body, material_key)
    members = {
        kind: [job.model for job, leader in zip(jobs, first, strict=True) if leader == kind] for kind in set(first)
    }
    saves = {
        kind: _saves(models)
        for kind, models in members.items()
        if any(_is_open(job) for job, leader in zip(jobs, first, strict=True) if leader == kind)
    }
    return tuple(
        _decide(job, reduced=saves[leader]) if _is_open(job) else job for job, leader in zip(jobs, first, strict=True)
    )


def _is_open(job: Job) -> bool:
    return job.run.study.dynamics.basis == "automatic"


def _saves(models: Sequence[Model]) -> bool:
    """Tell whether a basis saves time in all motions of a body together."""
    if any(_needs_mesh(model) for model in models):
        return False
    checked_model = inspect_model(models[0])
    nodes = {node for candidate in checked_model.candidates for node in candidate.nodes.tolist()}
    # The first of several motions with a matrix may try out how many vibrations they need, and is then computed again.
    first = first_alike(models, same_matrix)
    steps = sum(
        step_count(model) for number, model in enumerate(models) if first[number] != number or first.count(number) == 1
    )
    return basis_saves(checked_model.free.size, checked_model.space.dim * len(nodes), steps, checked_model.space.dim)


def _needs_mesh(model: Model) -> bool:
    """Tell whether a model has to be computed on the mesh.

    That is so for all that :func:`~fingerslip.dynamics.reduced.march.march_reduced` refuses, and where friction weakens
    as nodes slip: such slip multiplies differences, however small, so that no tolerance holds.
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
