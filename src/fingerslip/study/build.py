"""From a run to the model that is simulated."""

from __future__ import annotations

import contextlib
import hashlib
import json
import re
import signal
import threading
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from fingerslip.anatomy import Fingertip
from fingerslip.contact.bodies import Plane
from fingerslip.contact.friction import Coulomb
from fingerslip.errors import InputError
from fingerslip.mesh.io import read_mesh
from fingerslip.mesh.scans import SurfaceMesh, mesh_scan
from fingerslip.mesh.section import build_section
from fingerslip.mesh.sites import Site, receptor_sites
from fingerslip.model import Contact, Model, Recording
from fingerslip.parameters import as_mapping
from fingerslip.study.scans import scan_key
from fingerslip.study.spec import ContactSettings, MeshFile, Study
from fingerslip.study.sweep import Run

__all__ = ["build_mesh", "build_model", "located", "mesh_key"]

# What a model calls otherwise than a study file, as patterns at the start of a place.
_STUDY_NAMES = {
    r"^Model\.?": "",
    r"^contacts\.0\.body\.": "contact.",
    r"^contacts\.0\.friction\.coefficient": "contact.friction_coefficient",
    r"^contacts\.0": "contact",
}


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
        if isinstance(settings, SurfaceMesh):
            return mesh_scan(settings).mesh
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
    if isinstance(settings, SurfaceMesh):
        return scan_key(settings, run.where)
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
    try:
        return Model(
            mesh=build_mesh(run) if mesh is None else mesh,
            materials=_materials(run),
            formulation=study.formulation or _fingertip(run).formulation,
            depth=study.depth or _fingertip(run).depth,
            supports=_supports(run),
            tractions=dict(study.tractions),
            contacts=() if study.contact is None else (_contact(study.contact),),
            programme=tuple(entry.phase for entry in study.programme),
            time=study.time,
            damping=study.damping,
            integration=study.integration,
            record=_recording(run),
        )
    except InputError as error:
        raise located(error, run.where) from None


def located(error: InputError, where: str) -> InputError:
    """Return the error with the name of the run in front of its place, unless it is there already."""
    source = where.partition(" (")[0]
    if error.where.startswith(source):
        return error
    place = error.where
    for model_name, study_name in _STUDY_NAMES.items():
        place = re.sub(model_name, study_name, place)
    return type(error)(f"{where}: {place}" if place else where, error.found, error.allowed, error.mend)


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


def _supports(run: Run) -> Mapping[str, Any]:
    if run.study.supports or run.fingertip is None:
        return dict(run.study.supports)
    return {"phalanx" if run.fingertip.phalanx.rigid else "phalanx_dorsal": ("x", "y")}


def _contact(settings: ContactSettings) -> Contact:
    return Contact(
        boundary=settings.boundary,
        body=Plane(normal=settings.normal, offset=settings.offset),
        friction=Coulomb(settings.friction_coefficient),
        normal_penalty=settings.normal_penalty,
        tangential_penalty=settings.tangential_penalty,
        reach=settings.reach,
    )


def _recording(run: Run) -> Recording:
    wanted = run.study.record
    sites = (*_receptors(run.study, run.fingertip), *wanted.sites)
    return Recording(sites=sites, snapshots_every=wanted.snapshots_every)


def _receptors(study: Study, fingertip: Fingertip | None) -> tuple[Site, ...]:
    if fingertip is None or not study.record.receptors:
        return ()
    return tuple(site for site in receptor_sites(fingertip) if site.kind in study.record.receptors)
