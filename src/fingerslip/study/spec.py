"""The study file: what it may hold, and how it is read."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import pydantic

from fingerslip.anatomy import Fingertip, fingertip_from
from fingerslip.errors import InputError
from fingerslip.materials import Elastic, RayleighDamping
from fingerslip.mesh.scans import SurfaceMesh
from fingerslip.mesh.sites import Site
from fingerslip.mesh.sizes import MeshSizes
from fingerslip.model import Hold, Lift, Phase, Press, Slide, TimeStepping
from fingerslip.parameters import (
    Duration,
    NonNegativeNumber,
    PositiveLength,
    SignedLength,
    Stiffness,
    as_mapping,
    from_mapping,
    json_schema,
    parameters,
)
from fingerslip.study.scans import beside
from fingerslip.study.yaml import read_mapping
from fingerslip.units import Unit

__all__ = [
    "ContactSettings",
    "MeshFile",
    "ProgrammeEntry",
    "RecordSettings",
    "Study",
    "parse_study",
    "read_study",
    "study_fingertip",
    "study_mapping",
    "study_schema",
]

SignedPressure = Annotated[float, Unit("Pa", "kPa")]
Component = Literal["x", "y"]
ReceptorKind = Literal["FA-I", "SA-I", "FA-II", "SA-II"]
Formulation = Literal["plane_strain", "plane_stress"]


@parameters
class MeshFile:
    """A mesh that is read instead of built.

    Parameters
    ----------
    file : str
        Path of the mesh file, relative to the study file.
    """

    file: str


@parameters
class ContactSettings:
    """Contact with the rigid plate.

    Parameters
    ----------
    friction_coefficient : float
        Coulomb friction coefficient [-].
    boundary : str
        Boundary of the mesh that may touch the plate.
    normal : tuple of float
        Normal of the plate, towards the body.
    offset : float, optional
        Start of the plate along its normal [m]; without it the plate starts where it just touches.
    normal_penalty, tangential_penalty : float, optional
        Contact stiffness per area [Pa/m].
    reach : float, optional
        Distance from the plate within which the boundary may come to touch it [m].
    """

    friction_coefficient: NonNegativeNumber
    boundary: str = "skin"
    normal: tuple[float, ...] = (0.0, 1.0)
    offset: SignedLength | None = None
    normal_penalty: Stiffness | None = None
    tangential_penalty: Stiffness | None = None
    reach: PositiveLength | None = None


@parameters
class ProgrammeEntry:
    """One phase of the programme, under the key that says its kind.

    Parameters
    ----------
    press, hold, slide, lift : Press, Hold, Slide, Lift
        The phase; exactly one of them.
    """

    press: Press | None = None
    hold: Hold | None = None
    slide: Slide | None = None
    lift: Lift | None = None

    def __post_init__(self) -> None:
        kinds = [field.name for field in dataclasses.fields(self) if getattr(self, field.name) is not None]
        if len(kinds) != 1:
            raise InputError("", f"has {' and '.join(kinds) or 'no phase'}", "needs one of press, hold, slide, lift")

    @property
    def phase(self) -> Phase:
        """The phase itself."""
        phase = self.press or self.hold or self.slide or self.lift
        assert phase is not None  # held by __post_init__
        return phase


@parameters
class RecordSettings:
    """What a run records beside the contact, the forces and the energies.

    Parameters
    ----------
    receptors : tuple of {'FA-I', 'SA-I', 'FA-II', 'SA-II'}
        Kinds of mechanoreceptors of the fingertip at which the motion is recorded.
    sites : tuple of Site
        Further places.
    snapshots_every : float
        Time between snapshots of the whole mesh [s]; 0 for none.
    """

    receptors: tuple[ReceptorKind, ...] = ()
    sites: tuple[Site, ...] = ()
    snapshots_every: Duration = 0.0


def _mesh_kind(value: object) -> str:
    if isinstance(value, Mapping):
        return "MeshFile" if "file" in value else "SurfaceMesh" if "skin" in value else "MeshSizes"
    return type(value).__name__ if isinstance(value, MeshFile | SurfaceMesh) else "MeshSizes"


MeshSettings = Annotated[
    Annotated[MeshFile, pydantic.Tag("MeshFile")]
    | Annotated[SurfaceMesh, pydantic.Tag("SurfaceMesh")]
    | Annotated[MeshSizes, pydantic.Tag("MeshSizes")],
    pydantic.Discriminator(_mesh_kind),
]


@parameters
class Study:
    """A study: one model, and the values that are swept.

    Parameters
    ----------
    time : TimeStepping
        Step, numerical damping and end.
    title : str
        What the study shows.
    fingertip : mapping, optional
        `preset` and the values that differ from it.
    mesh : MeshSizes, MeshFile or SurfaceMesh
        Element sizes, or `file` for a mesh that is read, or `skin` and more for one built from the surfaces of a scan.
    contact : ContactSettings, optional
        Contact with the plate.
    programme : tuple of ProgrammeEntry
        Motion of the plate.
    damping : RayleighDamping
        Material damping.
    integration : {'selective', 'full'}
        Integration of quadrilaterals in plane strain.
    record : RecordSettings
        What is recorded.
    materials : mapping of str to Elastic
        Materials by region; they go before those of the fingertip.
    supports : mapping of str to tuple of {'x', 'y'}
        Fixed boundaries or regions; without them the phalanx of the fingertip is held.
    tractions : mapping of str to tuple of float
        Dead loads on boundaries [Pa].
    formulation : {'plane_strain', 'plane_stress'}, optional
        The two-dimensional assumption; without it that of the fingertip.
    depth : float, optional
        Out-of-plane depth [m]; without it that of the fingertip.
    sweep : mapping of str to tuple
        Values by dotted path; the runs are all combinations, the first path varies slowest.
    compare : tuple of str
        Published tables that the results are shown beside.
    """

    time: TimeStepping
    title: str = ""
    fingertip: Mapping[str, Any] | None = None
    mesh: MeshSettings = MeshSizes()
    contact: ContactSettings | None = None
    programme: tuple[ProgrammeEntry, ...] = ()
    damping: RayleighDamping = RayleighDamping()
    integration: Literal["selective", "full"] = "selective"
    record: RecordSettings = RecordSettings()
    materials: Mapping[str, Elastic] = pydantic.Field(default_factory=dict)
    supports: Mapping[str, tuple[Component, ...]] = pydantic.Field(default_factory=dict)
    tractions: Mapping[str, tuple[SignedPressure, ...]] = pydantic.Field(default_factory=dict)
    formulation: Formulation | None = None
    depth: PositiveLength | None = None
    sweep: Mapping[str, tuple[Any, ...]] = pydantic.Field(default_factory=dict)
    compare: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        _check_sweep(self.sweep)
        _check_body(self)


def _check_sweep(sweep: Mapping[str, tuple[Any, ...]]) -> None:
    for path, values in sweep.items():
        if not values:
            raise InputError(f"sweep.{path}", "has no values", "needs a list such as [0.2, 0.4]")
        repeated = next((value for place, value in enumerate(values) if value in values[:place]), None)
        if repeated is not None:
            raise InputError(f"sweep.{path}", f"has {repeated!r} twice", "needs every value once")
        inside = next((other for other in sweep if path.startswith(f"{other}.")), None)
        if inside is not None:
            raise InputError(f"sweep.{path}", f"is a part of the swept '{inside}'", "needs paths apart from each other")


def _check_body(study: Study) -> None:
    """Hold that a study without a fingertip says itself what a fingertip would say."""
    if study.fingertip is not None:
        return
    if not isinstance(study.mesh, MeshFile | SurfaceMesh):
        raise InputError("fingertip", "is missing", "needs a preset, or mesh.file for a body that is no fingertip")
    for name in ("materials", "formulation", "depth"):
        if not getattr(study, name):
            raise InputError(name, "is missing", "needs a value where there is no fingertip")
    if study.record.receptors:
        raise InputError("record.receptors", "without a fingertip", "needs a fingertip", "name places in record.sites")


def read_study(path: str | Path) -> Study:
    """Read a study file.

    Parameters
    ----------
    path : path
        A YAML file; quantities are text with units.

    Returns
    -------
    Study
        The study; the path of a mesh file in it is absolute.

    Raises
    ------
    InputError
        For the first mistake in the file.
    """
    path = Path(path)
    return parse_study(read_mapping(path), path)


def parse_study(mapping: Mapping[str, Any], source: Path) -> Study:
    """Build a study from plain data, quantities as text with units.

    Parameters
    ----------
    mapping : mapping
        What a study file holds.
    source : Path
        Its file, which errors name and to which the path of a mesh file is relative.

    Raises
    ------
    InputError
        For the first mistake.
    """
    study = from_mapping(Study, mapping, str(source))
    study_fingertip(study, str(source))
    if isinstance(study.mesh, MeshFile):
        return dataclasses.replace(study, mesh=MeshFile(str((source.parent / study.mesh.file).resolve())))
    if isinstance(study.mesh, SurfaceMesh):
        return dataclasses.replace(study, mesh=beside(study.mesh, source.parent))
    return study


def study_fingertip(study: Study, where: str) -> Fingertip | None:
    """Return the fingertip of a study with all its values, None where it has none."""
    return None if study.fingertip is None else fingertip_from(study.fingertip, f"{where}: fingertip")


def study_schema() -> dict[str, Any]:
    """Return the JSON Schema of study files, for editors."""
    schema = json_schema(Study)
    fingertip = json_schema(Fingertip)
    definitions = schema.setdefault("$defs", {})
    for name, part in (fingertip.pop("$defs", {}) | {"Fingertip": fingertip}).items():
        # A study file gives a preset and what differs from it, so nothing in it is required.
        definitions.setdefault(name, {key: value for key, value in part.items() if key != "required"})
    definitions["Fingertip"]["properties"] = {"preset": {"type": "string"}} | definitions["Fingertip"]["properties"]
    schema["properties"]["fingertip"] = {"anyOf": [{"$ref": "#/$defs/Fingertip"}, {"type": "null"}], "default": None}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def study_mapping(study: Study) -> dict[str, Any]:
    """Return a study as plain data that :func:`parse_study` reads back, with all defaults."""
    mapping: dict[str, Any] = as_mapping(study)
    return mapping
