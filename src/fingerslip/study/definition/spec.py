"""The study file: what it may hold, and how it is read."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pydantic

from fingerslip.errors import InputError
from fingerslip.fe.integration import Integration
from fingerslip.materials.damping import RayleighDamping
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.material import Formulation
from fingerslip.model import Component
from fingerslip.parameters import (
    PositiveLength,
    SignedAcceleration,
    SignedSpeed,
    as_mapping,
    from_mapping,
    json_schema,
    parameters,
)
from fingerslip.specimens.choice import SPECIMENS, SpecimenChoice
from fingerslip.specimens.fingertip.meshing.section.source import MeshSizes
from fingerslip.study.definition.settings import (
    ContactSettings,
    MeshSettings,
    ProgrammeEntry,
    RecordSettings,
    RefinementSettings,
    TimeSettings,
    TractionSettings,
)
from fingerslip.study.definition.yaml import read_mapping

__all__ = [
    "ContactSettings",
    "ProgrammeEntry",
    "RecordSettings",
    "RefinementSettings",
    "Study",
    "TimeSettings",
    "parse_study",
    "read_study",
    "study_mapping",
    "study_schema",
]


@parameters
class Study(SpecimenChoice):
    """A study: one model, and the values that are swept.

    Parameters
    ----------
    time : TimeSettings
        Step, scheme, numerical damping and end.
    title : str
        What the study shows.
    mesh : MeshSizes, SolidSizes, MeshFile or SurfaceMesh
        Element sizes of the section; with `element` T4 or T10 those of the fingertip in space; or `file` for a mesh
        that is read, or `skin` and more for one built from the surfaces of a scan.
    contact : ContactSettings, optional
        Contact with one rigid body, a plate where nothing else is said.
    contacts : tuple of ContactSettings
        Contacts with several bodies, instead of `contact`.
    programme : tuple of ProgrammeEntry
        Motion of the bodies that have none of their own.
    damping : RayleighDamping
        Material damping.
    integration : {'selective', 'full', 'nodal'}
        How the dilatational part is integrated; see :class:`~fingerslip.model.Model`.
    record : RecordSettings
        What is recorded.
    materials : mapping of str to Elastic
        Materials by region; they go before those of the specimen.
    supports : mapping of str to tuple of {'x', 'y', 'z'}
        Fixed boundaries or regions; without them the specimen says what is held, of a fingertip the phalanx.
    tractions : mapping of str to tuple of float or Traction
        Dead loads on boundaries [Pa], constant, or `value` with a `ramp` over time.
    gravity : tuple of float, optional
        Acceleration of gravity [m/s^2].
    initial_velocity : tuple of float, optional
        Velocity of the whole deformable body at the start [m/s].
    formulation : {'plane_strain', 'plane_stress', 'solid'}, optional
        The two-dimensional assumption, or 'solid' in space; without it that of the specimen.
    depth : float, optional
        Out-of-plane depth [m], not in space; without it that of the specimen.
    sweep : mapping of str to tuple
        Values by dotted path; the runs are all combinations, the first path varies slowest.
    compare : tuple of str
        Published tables that the results are shown beside.
    converge : RefinementSettings
        How ``fingerslip converge`` refines the runs.
    fingertip : mapping, optional
        The specimen: `preset` and the values that differ from it.
    """

    time: TimeSettings
    title: str = ""
    mesh: MeshSettings = MeshSizes()
    contact: ContactSettings | None = None
    contacts: tuple[ContactSettings, ...] = ()
    programme: tuple[ProgrammeEntry, ...] = ()
    damping: RayleighDamping = RayleighDamping()
    integration: Integration = "selective"
    record: RecordSettings = RecordSettings()
    materials: Mapping[str, Elastic] = pydantic.Field(default_factory=dict)
    supports: Mapping[str, tuple[Component, ...]] = pydantic.Field(default_factory=dict)
    tractions: Mapping[str, TractionSettings] = pydantic.Field(default_factory=dict)
    gravity: tuple[SignedAcceleration, ...] | None = None
    initial_velocity: tuple[SignedSpeed, ...] | None = None
    formulation: Formulation | None = None
    depth: PositiveLength | None = None
    sweep: Mapping[str, tuple[Any, ...]] = pydantic.Field(default_factory=dict)
    compare: tuple[str, ...] = ()
    converge: RefinementSettings = RefinementSettings()

    def __post_init__(self) -> None:
        self.check_specimen(self.mesh)
        _check_sweep(self.sweep)
        _check_body(self)
        if self.contact is not None and self.contacts:
            raise InputError("contacts", "stands beside contact", "needs one of the two", "move contact into contacts")

    @property
    def all_contacts(self) -> tuple[ContactSettings, ...]:
        """The contacts, whether one or several."""
        return self.contacts if self.contact is None else (self.contact,)


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
    """Hold that a study without a specimen says itself what a specimen would say."""
    if study.specimen_kind is not None:
        return
    kinds = " or ".join(SPECIMENS)
    needed = ("materials", "formulation") if study.formulation == "solid" else ("materials", "formulation", "depth")
    for name in needed:
        if not getattr(study, name):
            raise InputError(name, "is missing", f"needs a value where there is no {kinds}")
    for name in ("receptors", "reference_nodes"):
        if getattr(study.record, name):
            found, repair = f"without a {kinds}", "name points in record.sites"
            raise InputError(f"record.{name}", found, f"needs a {kinds}", repair)


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
    study.specimen(str(source))
    return dataclasses.replace(study, mesh=study.mesh.beside(source.parent))


def study_schema() -> dict[str, Any]:
    """Return the JSON Schema of study files, for editors."""
    schema = json_schema(Study)
    definitions = schema.setdefault("$defs", {})
    for key, presets in SPECIMENS.items():
        own, name = json_schema(presets.kind), presets.kind.__name__
        own["properties"] = {"preset": {"type": "string"}} | own["properties"]
        for part, definition in (own.pop("$defs", {}) | {name: own}).items():
            # A study file gives a preset and what differs from it, so nothing in it is required.
            definitions.setdefault(part, {key: value for key, value in definition.items() if key != "required"})
        schema["properties"][key] = {"anyOf": [{"$ref": f"#/$defs/{name}"}, {"type": "null"}], "default": None}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}


def study_mapping(study: Study) -> dict[str, Any]:
    """Return a study as plain data that :func:`parse_study` reads back, with all defaults."""
    mapping: dict[str, Any] = as_mapping(study)
    return mapping
