"""From a run to the model that is simulated."""

from __future__ import annotations

import contextlib
import hashlib
import json
import re
import signal
import threading
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from fingerslip.anatomy import Fingertip
from fingerslip.errors import InputError
from fingerslip.mesh.io import read_mesh
from fingerslip.mesh.section import build_section
from fingerslip.mesh.sites import Site, receptor_sites
from fingerslip.model import Contact, Model, Phase, Recording
from fingerslip.parameters import as_mapping
from fingerslip.study.settings import ContactSettings, MeshFile, ProgrammeEntry
from fingerslip.study.spec import Study
from fingerslip.study.sweep import Run

__all__ = ["build_mesh", "build_model", "located", "mesh_key"]

_CONTACT_PLACE = re.compile(r"contacts\.(\d+)(?:\.(.*))?")


def build_mesh(run: Run) -> Any:
    """Build or read the mesh of a run.

    Parameters
    ----------
    run : Run
        The run.

    Returns
    -------
    skfem.Mesh
        The mesh, with named regions and boundaries [m].

    Raises
    ------
    InputError
        Where the mesh cannot be built or read.
    """
    settings = run.study.mesh
    try:
        if isinstance(settings, MeshFile):
            return read_mesh(settings.file)
        with _broken_pipes_as_errors():
            return build_section(
                _fingertip(run),
                contact_size=settings.contact_size,
                bulk_size=settings.bulk_size,
                contact_reach=settings.contact_reach,
                element=settings.element,
            )
    except InputError as error:
        raise located(error, run.where) from None


def mesh_key(run: Run) -> str:
    """Return what decides the mesh of a run, hashed: runs with the same key share one mesh.

    Raises
    ------
    InputError
        Where the mesh file cannot be read.
    """
    settings = run.study.mesh
    if isinstance(settings, MeshFile):
        try:
            return hashlib.sha256(Path(settings.file).read_bytes()).hexdigest()
        except OSError as error:
            raise InputError(
                f"{run.where}: mesh.file", f"cannot read {settings.file} ({error.strerror})", "needs a mesh file"
            ) from None
    shape = {key: value for key, value in as_mapping(_fingertip(run)).items() if key not in ("materials", "receptors")}
    return hashlib.sha256(json.dumps([shape, as_mapping(settings)], sort_keys=True).encode()).hexdigest()


def build_model(run: Run, mesh: Any = None) -> Model:
    """Make the model of a run.

    Parameters
    ----------
    run : Run
        The run.
    mesh : skfem.Mesh, optional
        Its mesh; built where it is not given.

    Returns
    -------
    Model
        The model, ready to be simulated.

    Raises
    ------
    InputError
        Where the values of the run do not fit together.
    """
    study = run.study
    formulation = study.formulation or _fingertip(run).formulation
    try:
        return Model(
            mesh=build_mesh(run) if mesh is None else mesh,
            materials=_materials(run),
            formulation=formulation,
            depth=study.depth or (1.0 if formulation == "solid" else _fingertip(run).depth),
            supports=_supports(run, "xyz" if formulation == "solid" else "xy"),
            tractions=dict(study.tractions),
            contacts=tuple(_contact(settings) for settings in study.all_contacts),
            programme=_phases(study.programme),
            time=study.time.stepping,
            damping=study.damping,
            integration=study.integration,
            record=_recording(run),
            gravity=study.gravity,
            initial_velocity=study.initial_velocity,
        )
    except InputError as error:
        raise located(error, run.where, study) from None


def located(error: InputError, where: str, study: Study | None = None) -> InputError:
    """Return the error with the name of the run in front of its place, and the place as the study file calls it.

    Parameters
    ----------
    error : InputError
        An error of the model; one that names the run already is returned as it is.
    where : str
        Name of the run.
    study : Study, optional
        The study, which says how its contacts are written; without it there is one contact, in its short form.
    """
    source = where.partition(" (")[0]
    if error.where.startswith(source):
        return error
    place = _study_place(re.sub(r"^Model\.?", "", error.where), study)
    return type(error)(f"{where}: {place}" if place else where, error.found, error.allowed, error.mend)


def _study_place(place: str, study: Study | None) -> str:
    """Return how a study file calls a place in the contacts of a model; other places stay what they are."""
    match = _CONTACT_PLACE.match(place)
    if match is None:
        return place
    number, inside = int(match[1]), match[2] or ""
    several = study is not None and study.contact is None
    settings = study.all_contacts[number] if study is not None else None
    contact = f"contacts.{number}" if several else "contact"
    return f"{contact}.{_name_inside(inside, settings)}" if inside else contact


def _name_inside(inside: str, settings: ContactSettings | None) -> str:
    """Return how a study file calls a place inside a contact of a model."""
    if inside == "friction.coefficient" and (settings is None or settings.friction is None):
        return "friction_coefficient"
    of_body = inside in ("offset", "centre") or inside.startswith("body.")
    if not of_body:
        return inside
    field = inside.removeprefix("body.")
    return field if settings is None or settings.body is None else f"body.{settings.body.shape}.{field}"


@contextlib.contextmanager
def _broken_pipes_as_errors() -> Iterator[None]:
    """Keep Python's way with broken pipes: Gmsh has them end the process, also when only a worker is lost."""
    try:
        yield
    finally:
        if hasattr(signal, "SIGPIPE") and threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGPIPE, signal.SIG_IGN)


def _fingertip(run: Run) -> Fingertip:
    assert run.fingertip is not None  # a study without a fingertip says all this itself
    return run.fingertip


def _materials(run: Run) -> Mapping[str, Any]:
    return {**(run.fingertip.materials if run.fingertip else {}), **run.study.materials}


def _supports(run: Run, axes: str) -> Mapping[str, Any]:
    if run.study.supports or run.fingertip is None:
        return dict(run.study.supports)
    return {"phalanx" if run.fingertip.phalanx.rigid else "phalanx_dorsal": tuple(axes)}


def _contact(settings: ContactSettings) -> Contact:
    return Contact(
        boundary=settings.boundary,
        body=settings.rigid_body,
        friction=settings.law,
        normal_penalty=settings.normal_penalty,
        tangential_penalty=settings.tangential_penalty,
        reach=settings.reach,
        programme=None if settings.programme is None else _phases(settings.programme),
        drive=settings.drive,
    )


def _phases(entries: Sequence[ProgrammeEntry]) -> tuple[Phase, ...]:
    return tuple(entry.phase for entry in entries)


def _recording(run: Run) -> Recording:
    wanted = run.study.record
    sites = (*_receptors(run.study, run.fingertip), *wanted.sites)
    return Recording(sites=sites, snapshots_every=wanted.snapshots_every)


def _receptors(study: Study, fingertip: Fingertip | None) -> tuple[Site, ...]:
    if fingertip is None or not study.record.receptors:
        return ()
    return tuple(site for site in receptor_sites(fingertip) if site.kind in study.record.receptors)
