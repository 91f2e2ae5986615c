"""From a run to the model that is simulated."""

from __future__ import annotations

import contextlib
import re
import signal
import threading
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fingerslip.contact.counterfaces import Plane
from fingerslip.digest import digest, file_digest
from fingerslip.errors import InputError
from fingerslip.linear.memory import require_memory
from fingerslip.mesh.io import read_mesh
from fingerslip.mesh.scan.build import SurfaceMesh, mesh_scan, scan_cells
from fingerslip.mesh.sizes import SolidSizes
from fingerslip.model import Contact, Hold, Model, Phase, Press, Recording
from fingerslip.parameters import as_mapping
from fingerslip.sites import Site
from fingerslip.specimens.fingertip import Fingertip
from fingerslip.specimens.fingertip.meshing.section.build import build_section
from fingerslip.specimens.fingertip.meshing.solid.build import mesh_solid, solid_cells
from fingerslip.specimens.fingertip.receptors import receptor_sites
from fingerslip.specimens.fingertip.solid_sites import reference_sites, solid_receptor_sites
from fingerslip.study.definition.scans import scan_key
from fingerslip.study.definition.settings import ContactSettings, MeshFile, ProgrammeEntry
from fingerslip.study.definition.spec import Study
from fingerslip.study.definition.sweep import Run

__all__ = ["build_mesh", "build_model", "located", "mesh_key"]

# A file in millimetres that is read as metres is a thousand times too large.
_LARGEST_FINGER = 0.2
_LARGE_BODY = 1.0
_LARGEST_RATIO = 1000.0

# What assembly takes for linear tetrahedra (measured); it grows like the nodes of a cell squared.
_BYTES_PER_CELL = 11_000

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
            return _plausible(read_mesh(settings.file).scaled(settings.scale), run.study)
        if isinstance(settings, SurfaceMesh):
            _require_memory(scan_cells(settings), "T4")
            return mesh_scan(settings).mesh
        with _broken_pipes_as_errors():
            if isinstance(settings, SolidSizes):
                _require_memory(solid_cells(_fingertip(run), settings), settings.element)
                return mesh_solid(_fingertip(run), settings)
            return build_section(
                _fingertip(run),
                contact_size=settings.contact_size,
                bulk_size=settings.bulk_size,
                contact_reach=settings.contact_reach,
                element=settings.element,
            )
    except InputError as error:
        raise located(error, run.where, run.study) from None


def _require_memory(cells: float, element: str) -> None:
    """Refuse elements in space that are too small for the memory, before they are made."""
    size = cells * _BYTES_PER_CELL * ({"T4": 4, "T10": 10}[element] / 4) ** 2
    require_memory({f"assembly of about {cells:.2g} tetrahedra": int(size)})


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
            return digest(file_digest(Path(settings.file)), settings.length_unit)
        except OSError as error:
            raise InputError(
                f"{run.where}: mesh.file", f"cannot read {settings.file} ({error.strerror})", "needs a mesh file"
            ) from None
    if isinstance(settings, SurfaceMesh):
        return scan_key(settings, run.where)
    shape = {key: value for key, value in as_mapping(_fingertip(run)).items() if key not in ("materials", "receptors")}
    return digest([shape, as_mapping(settings)])


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
    formulation = study.formulation or ("solid" if _in_space(run) else _fingertip(run).formulation)
    try:
        return Model(
            mesh=build_mesh(run) if mesh is None else mesh,
            materials=_materials(run),
            formulation=formulation,
            depth=study.depth or (1.0 if formulation == "solid" else _fingertip(run).depth),
            supports=_supports(run, "xyz" if formulation == "solid" else "xy"),
            tractions=dict(study.tractions),
            contacts=tuple(_contact(run, settings) for settings in study.all_contacts),
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
    return type(error)(f"{where}: {place}" if place else where, error.found, error.allowed, error.repair)


def _study_place(place: str, study: Study | None) -> str:
    """Return how a study file calls a place of its model or of its fingertip."""
    match = _CONTACT_PLACE.match(place)
    if match is None:
        return f"fingertip.{place}" if study is not None and _is_of_fingertip(place, study) else place
    number, inside = int(match[1]), match[2] or ""
    several = study is not None and study.contact is None
    settings = study.all_contacts[number] if study is not None else None
    contact = f"contacts.{number}" if several else "contact"
    return f"{contact}.{_name_inside(inside, settings)}" if inside else contact


def _is_of_fingertip(place: str, study: Study) -> bool:
    """Tell whether the value at a place is the fingertip's: the study itself does not give it."""
    key, _, rest = place.partition(".")
    if study.fingertip is None or key not in Fingertip.__dataclass_fields__:
        return False
    if key == "materials":
        return rest.partition(".")[0] not in study.materials
    return getattr(study, key, None) is None


def _name_inside(inside: str, settings: ContactSettings | None) -> str:
    """Return how a study file calls a place inside a contact of a model."""
    if inside == "friction.coefficient" and (settings is None or settings.friction is None):
        return "friction_coefficient"
    of_counterface = inside in ("offset", "centre") or inside.startswith("counterface.")
    if not of_counterface:
        return inside
    field = inside.removeprefix("counterface.")
    return (
        field
        if settings is None or settings.counterface is None
        else f"counterface.{settings.counterface.shape}.{field}"
    )


@contextlib.contextmanager
def _broken_pipes_as_errors() -> Iterator[None]:
    """Keep Python's way with broken pipes: Gmsh has them end the process, also when only a worker is lost."""
    try:
        yield
    finally:
        if hasattr(signal, "SIGPIPE") and threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGPIPE, signal.SIG_IGN)


def _plausible(mesh: Any, study: Study) -> Any:
    """Return the mesh, or refuse one whose file is most likely not in metres."""
    settings, extent, way = study.mesh, float(np.ptp(mesh.p, axis=1).max()), _longest_way(study)
    body = max(_LARGE_BODY, _LARGEST_RATIO * way) if way > 0.0 else np.inf
    largest = body if study.fingertip is None else _LARGEST_FINGER
    if isinstance(settings, MeshFile) and settings.length_unit is None and extent > largest:
        beside = "a fingertip" if study.fingertip else f"a body that is touched over {way * 1e3:.4g} mm"
        found = f"the body is {extent:.4g} m large, too large for {beside}"
        repair = "write 'length_unit: mm' beside 'file' for a file in millimetres, 'length_unit: m' if it is that large"
        raise InputError("mesh.file", found, "needs coordinates in metres", repair)
    return mesh


def _longest_way(study: Study) -> float:
    """Return the longest way of a phase [m]; 0 where no body moves."""
    own = [entry for contact in study.all_contacts for entry in contact.programme or ()]
    moving = [phase for phase in _phases((*study.programme, *own)) if not isinstance(phase, Hold)]
    return max((phase.depth if isinstance(phase, Press) else phase.distance for phase in moving), default=0.0)


def _fingertip(run: Run) -> Fingertip:
    assert run.fingertip is not None  # a study without a fingertip says all this itself
    return run.fingertip


def _materials(run: Run) -> Mapping[str, Any]:
    return {**(run.fingertip.materials if run.fingertip else {}), **run.study.materials}


def _supports(run: Run, axes: str) -> Mapping[str, Any]:
    if run.study.supports or run.fingertip is None:
        return dict(run.study.supports)
    return {"phalanx" if run.fingertip.phalanx.rigid else "phalanx_dorsal": tuple(axes)}


def _in_space(run: Run) -> bool:
    return isinstance(run.study.mesh, SolidSizes | SurfaceMesh)


def _contact(run: Run, settings: ContactSettings) -> Contact:
    counterface = settings.rigid_counterface
    if _in_space(run) and settings.counterface is None and len(settings.normal) == 2:
        counterface = Plane((*settings.normal, 0.0), settings.offset)
    return Contact(
        boundary=settings.boundary,
        counterface=counterface,
        friction=settings.law,
        normal_penalty=settings.normal_penalty,
        tangential_penalty=settings.tangential_penalty,
        search_distance=settings.search_distance,
        programme=None if settings.programme is None else _phases(settings.programme),
        drive=settings.drive,
    )


def _phases(entries: Sequence[ProgrammeEntry]) -> tuple[Phase, ...]:
    return tuple(entry.phase for entry in entries)


def _recording(run: Run) -> Recording:
    wanted = run.study.record
    sites = (*_receptors(run), *_reference_nodes(run), *wanted.sites)
    return Recording(sites=sites, snapshots_every=wanted.snapshots_every)


def _reference_nodes(run: Run) -> tuple[Site, ...]:
    if not run.study.record.reference_nodes:
        return ()
    if run.fingertip is None or not _in_space(run):
        raise InputError("record.reference_nodes", "without a fingertip in space", "needs mesh.element T4 or T10")
    return reference_sites(run.fingertip)


def _receptors(run: Run) -> tuple[Site, ...]:
    if run.fingertip is None or not run.study.record.receptors:
        return ()
    sites = solid_receptor_sites(run.fingertip) if _in_space(run) else receptor_sites(run.fingertip)
    return tuple(site for site in sites if site.kind in run.study.record.receptors)
