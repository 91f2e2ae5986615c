"""From a run to the model that is simulated, checked and ready to be computed."""

from __future__ import annotations

import contextlib
import dataclasses
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from fingerslip.contact.counterfaces import BuiltInCounterface
from fingerslip.contact.friction import weakens
from fingerslip.dynamics.recording.schedule import step_count
from fingerslip.dynamics.step.sharing import first_alike, groups_to_share, material_key, same_body, same_matrix
from fingerslip.dynamics.system.checks import inspect_model
from fingerslip.dynamics.system.doubts import Doubt, doubts
from fingerslip.errors import InputError, Mistakes
from fingerslip.fe.space import Space, build_space
from fingerslip.mesh.source import InspectedMesh
from fingerslip.model.model import Model, Recording
from fingerslip.model.programme import phase_travel
from fingerslip.model.timing import Adaptive, TimeStepping
from fingerslip.parameters import kinds_of
from fingerslip.parameters.dotted import join_path
from fingerslip.react.moment import require_sites
from fingerslip.react.scenario import held_model
from fingerslip.report.tables.parameters import NOT_USED
from fingerslip.results import RefusedRun
from fingerslip.specimens.choice import SPECIMENS
from fingerslip.study.definition.file import line_numbers
from fingerslip.study.definition.runs import Plan, Run, without_swept
from fingerslip.study.definition.spec import Study
from fingerslip.study.running.cost import basis_saves, most_together, require_mesh_memory
from fingerslip.study.storage.reporting import value_rows
from fingerslip.units import millimetres

# A file in millimetres that is read as metres is a thousand times too large.
_LARGE_BODY = 1.0
_LARGEST_RATIO = 1000.0

# Fields that a model has as its study has them.
_AS_IN_THE_STUDY = (
    *("support_motions", "tractions", "bodies", "programme", "damping", "integration", "kinematics"),
    *("gravity", "initial_velocity"),
)
_CONTACT_PLACE = re.compile(r"contacts\.(\d+)(?:\.(.*))?")


def build_mesh(run: Run) -> Any:
    """Build or read the mesh [m] of a run."""
    with name_errors(run):
        require_mesh_memory(run.study.mesh, run.specimen)
        mesh = run.study.mesh.build(run.specimen)
        _check_extent(mesh, run)
    return mesh


def inspect_mesh(run: Run) -> InspectedMesh:
    """Build or read the mesh of a run, with tables of what is worth knowing of it; errors as of :func:`build_mesh`."""
    with name_errors(run):
        require_mesh_memory(run.study.mesh, run.specimen)
        inspected = run.study.mesh.inspect(run.specimen)
        _check_extent(inspected.mesh, run)
    return inspected


def build_model(run: Run, mesh: Any = None) -> Model:
    """Make the model of a run."""
    study, specimen, held = run.study, run.specimen, run.study.held_object
    with name_errors(run):
        mesh = build_mesh(run) if mesh is None else mesh
        formulation = study.formulation or ("solid" if mesh.dim() == 3 or specimen is None else specimen.formulation)
        dim = 3 if formulation == "solid" else int(mesh.dim())
        supports: Mapping[str, Any] = study.supports or (specimen.supports(dim) if specimen else {})
        groups_of_sites = (*study.record.all_groups, *(study.reaction.groups if study.reaction else ()))
        sites = specimen.sites(tuple(dict.fromkeys(groups_of_sites)), dim) if specimen else ()
        if study.reaction and study.depth is None and formulation != "solid":
            allowed = "needs the width of the contact that bears the object"
            raise InputError("reaction", "is given without depth", allowed, "write depth: 12 mm beside it")
        model = Model(
            mesh=mesh,
            materials={**(specimen.materials if specimen else {}), **study.all_materials},
            formulation=formulation,
            depth=study.depth or (1.0 if formulation == "solid" or specimen is None else specimen.depth),
            supports=supports,
            contacts=tuple(contact.contact(dim) for contact in study.all_contacts),
            time=TimeStepping(held.step, study.time.alpha, held.end) if held else study.time.stepping,
            record=Recording((*sites, *study.record.sites), study.record.snapshots_every),
            basis=study.dynamics.reduced,
            **{name: getattr(study, name) for name in _AS_IN_THE_STUDY},
        )
        if study.reaction is None or held is None:
            return model
        require_sites(study.reaction.detectors, model, "reaction.detectors")
        return held_model(held, model)


@contextlib.contextmanager
def name_errors(run: Run) -> Iterator[None]:
    """Name the run in errors that do not name its file yet, with places and lines of the study file."""
    source = run.where.partition(" (")[0]

    def place(where: str) -> str:
        if where.startswith(source):
            return where
        inside = _study_place(re.sub(r"^Model\.?", "", where), run.study)
        return f"{run.where}: {inside}" if inside else run.where

    with line_numbers(Path(source), run.where):
        try:
            yield
        except InputError as error:
            raise error.moved(place) from None


def _study_place(where: str, study: Study) -> str:
    """Return how a study file calls a place of its model or of its specimen."""
    match = _CONTACT_PLACE.match(where)
    for number, site in enumerate(study.record.sites):
        if where == f"site {site.name}":
            return f"record.sites.{number}"
    if match is None:
        return f"{study.specimen_kind}.{where}" if _is_of_specimen(where, study) else where
    settings, inside = study.all_contacts[int(match[1])], match[2] or ""
    if inside == "friction.coefficient" and settings.friction is None:
        inside = "friction_coefficient"
    elif inside in ("offset", "centre") or inside.startswith("counterface."):
        inside = inside.removeprefix("counterface.")
        if settings.counterface is not None:
            shapes = {kind: key for key, kind in kinds_of(BuiltInCounterface).items()}
            inside = f"counterface.{shapes[type(settings.counterface)]}.{inside}"
    return join_path(f"contacts.{match[1]}" if study.contact is None else "contact", inside)


def _is_of_specimen(where: str, study: Study) -> bool:
    """Tell whether the value at a place is the specimen's: the study itself does not give it."""
    (key, _, rest), kind = where.partition("."), study.specimen_kind
    if kind is None or key not in SPECIMENS[kind].kind.__dataclass_fields__:
        return False
    return rest.partition(".")[0] not in study.materials if key == "materials" else getattr(study, key, None) is None


def _check_extent(mesh: Any, run: Run) -> None:
    """Refuse a mesh whose file is most likely not in metres."""
    study, extent = run.study, float(np.ptp(mesh.p, axis=1).max())
    of_contacts = (contact.programme or () for contact in study.all_contacts)
    programmes = (study.programme, *of_contacts, *(body.programme for body in study.bodies.values()))
    travel = max((phase_travel(phase) for programme in programmes for phase in programme), default=0.0)
    body = max(_LARGE_BODY, _LARGEST_RATIO * travel) if travel > 0.0 else np.inf
    largest = body if run.specimen is None else run.specimen.largest_extent
    if extent > largest and study.mesh.assumes_metres:
        beside = f"a {study.specimen_kind}" if run.specimen else f"a body that is touched over {millimetres(travel)}"
        fault = f"the body is {extent:.4g} m large, too large for {beside}"
        repair = "write 'length_unit: mm' beside 'file' for a file in millimetres, 'length_unit: m' if it is that large"
        raise InputError("mesh.file", fault, "needs coordinates in metres", repair)


@dataclass(frozen=True)
class Job:
    """A run with its model, ready to be computed."""

    run: Run  # the run
    model: Model  # its model
    identity: str  # hash of its inputs
    folder: Path  # where its results go
    doubts: tuple[Doubt, ...] = ()  # what is doubtful in the model
    n_dofs: int = 0  # degrees of freedom of its mesh
    contact_nodes: int = 0  # contact candidates
    basis_sizes: tuple[int, int] = (0, 0)  # degrees of freedom that no support holds, and those of nodes that may touch


#: Meshes and their spaces by what decides them.
_Meshes = dict[str, tuple[Any, Space]]


def prepare_samples(plan: Plan, runs: Sequence[Run]) -> tuple[tuple[Job, ...], tuple[RefusedRun, ...]]:
    """Build and check the models of runs as :func:`prepare`, and return the samples whose values make no model, too."""
    refuse_unused(plan)
    meshes: _Meshes = {}
    jobs: list[Job] = []
    refused = list(plan.refused)
    for run in runs:
        try:
            jobs.append(without_swept(plan, run, lambda other: _job(plan, other, meshes)))
        except InputError as error:
            refused.append(RefusedRun(run.name, run.swept, run.sampled, str(error)))
            if not run.sampled or len(refused) == len(plan.runs) + len(plan.refused):
                raise
    return choose_bases(jobs), tuple(refused)


def refuse_unused(plan: Plan) -> None:
    """Refuse sampled values that no run of a study uses, nor a value that is equal to them."""
    sample = plan.study.sample
    groups = {path: name for name in ("ranges", "choices") for path in (getattr(sample, name) if sample else ())}
    twins = sample.equal if sample else {}
    unused = dict.fromkeys(groups, "")
    for run in plan.runs:
        if not unused:
            return
        reasons = {row.path: row.note for row in value_rows([run]) if row.source == NOT_USED}
        useful = {twins.get(path, path) for path in (*groups, *twins) if path not in reasons}
        unused = {path: reasons[path] for path in unused if path not in useful}
    needs = "needs a value that runs use", "leave it out"
    Mistakes(
        InputError(f"{plan.source}: sample.{groups[path]}.{path}", f"changes nothing ({reason})", *needs)
        for path, reason in unused.items()
    ).raise_all()


def prepare(plan: Plan, runs: Sequence[Run]) -> tuple[Job, ...]:
    """Build and check the models of runs; runs with the same mesh inputs share one mesh."""
    meshes: _Meshes = {}
    return choose_bases([without_swept(plan, run, lambda other: _job(plan, other, meshes)) for run in runs])


def _job(plan: Plan, run: Run, meshes: _Meshes) -> Job:
    # A plate on the other side of a held object is a part of the mesh.
    key = f"{run.mesh_key} {run.study.reaction.opposite if run.study.reaction else ''}"
    mesh, space = meshes.get(key, (None, None))
    model = build_model(run, mesh)
    with name_errors(run):
        space = space or build_space(model.mesh)
        checked_model = inspect_model(model, space)
    meshes[key] = model.mesh, space
    candidates = [touched.nodes for touched in checked_model.candidates]
    sizes = checked_model.free.size, space.dim * len(np.unique(np.concatenate([[], *candidates])))
    counts = space.n_dofs, sum(map(len, candidates)), sizes
    return Job(run, model, plan.identities[run.name], plan.folder / run.name, doubts(model, checked_model), *counts)


def choose_bases(jobs: Sequence[Job]) -> tuple[Job, ...]:
    """Decide where a study says ``basis: automatic``: for a reduced basis where the runs that share it save time."""
    first = first_alike([job.model for job in jobs], same_body, material_key)
    decided = list(jobs)
    for leader in dict.fromkeys(first):
        alike = [number for number, other in enumerate(first) if other == leader]
        undecided = [number for number in alike if jobs[number].run.study.dynamics.basis == "automatic"]
        basis: Literal["reduced", "full"] = (
            "reduced" if undecided and _saves([jobs[number] for number in alike]) else "full"
        )
        for number in undecided:
            job, study = jobs[number], jobs[number].run.study
            dynamics = dataclasses.replace(study.dynamics, basis=basis)
            run = dataclasses.replace(job.run, study=dataclasses.replace(study, dynamics=dynamics))
            model = dataclasses.replace(job.model, basis=dynamics.reduced)
            decided[number] = dataclasses.replace(job, run=run, model=model)
    return tuple(decided)


def _saves(jobs: Sequence[Job]) -> bool:
    """Tell whether a basis saves time in all motions of a body together.

    All that :func:`~fingerslip.dynamics.reduced.basis.compute_in_basis` refuses needs the mesh, as does friction that
    weakens as nodes slip: such slip multiplies differences, however small, so that no tolerance holds.
    """
    models = [job.model for job in jobs]
    for model in models:
        weak = any(weakens(contact.friction) for contact in model.contacts)
        relaxes = any(getattr(material, "prony", ()) for material in model.materials.values())
        if weak or relaxes or model.is_finite or isinstance(model.time, Adaptive):
            return False
    # The first of several motions with a matrix may try out how many normal modes suffice, and is computed again.
    first = first_alike(models, same_matrix)
    steps = sum(
        step_count(model) for number, model in enumerate(models) if first[number] != number or first.count(number) == 1
    )
    return basis_saves(*jobs[0].basis_sizes, steps, models[0].mesh.dim())


def groups(jobs: Sequence[Job], at_once: int = 1) -> list[list[Job]]:
    """Put jobs into groups that are computed together, where `at_once` groups can be computed at once."""
    if any(job.run.study.reaction for job in jobs):
        return [[job] for job in jobs]
    shared = groups_to_share([job.model for job in jobs], at_once, most_together)
    return [[jobs[number] for number in group] for group in shared]
