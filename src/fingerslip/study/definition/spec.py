"""The study file: what it may hold, and how it is read."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import pydantic

from fingerslip.errors import InputError, Mistakes, errors_at
from fingerslip.fe.integration import Integration
from fingerslip.materials.choice import PRESET, AnyMaterial, MaterialEntry, material_of
from fingerslip.materials.elastic import RayleighDamping
from fingerslip.materials.material import Formulation
from fingerslip.mesh.source import MeshFile, marks
from fingerslip.model.model import AnyTraction, Component, Kinematics, SupportMotion
from fingerslip.model.programme import ProgrammeEntry
from fingerslip.model.rigid_bodies import RigidBody
from fingerslip.parameters import (
    PositiveLength,
    SignedAcceleration,
    SignedSpeed,
    as_mapping,
    from_mapping,
    parameters,
    plain_fields,
    valid_fields,
)
from fingerslip.parameters.dotted import is_below, walk
from fingerslip.parameters.fields import in_order
from fingerslip.published import published_set
from fingerslip.react.scenario import HeldObject
from fingerslip.react.settings import ReactionSettings
from fingerslip.sampling.curves import FitSettings
from fingerslip.specimens.choice import SPECIMENS, SpecimenChoice
from fingerslip.specimens.fingertip.fingertip import MeshSizes
from fingerslip.specimens.protocol import Specimen
from fingerslip.study.definition.expressions import check_expression, check_names
from fingerslip.study.definition.file import study_file
from fingerslip.study.definition.relations import mistakes_between
from fingerslip.study.definition.settings import (
    CameraKind,
    CameraSettings,
    ContactSettings,
    DynamicsSettings,
    MeshSettings,
    RecordSettings,
    RefinementSettings,
    TimeSettings,
    TrialSettings,
)
from fingerslip.study.definition.sweep import (
    RepeatSettings,
    SampleSettings,
    changed_paths,
    check_sweep,
    sample_mistakes,
    swept_mistakes,
    with_values,
)

#: The fields of a study that do not belong to a single run.
NOT_OF_A_RUN = (
    *("description", "sweep", "sample", "fit", "repeats", "derived", "compare", "converge", "trials", "cameras"),
)


def _check_references(name: str) -> str:
    try:
        published_set(name)
    except InputError as error:
        raise error.moved(lambda _: "") from None
    return name


PublishedName = Annotated[str, pydantic.AfterValidator(_check_references)]
Sweep = Annotated[Mapping[str, tuple[Any, ...]], pydantic.AfterValidator(check_sweep)]
Expression = Annotated[str, pydantic.AfterValidator(check_expression)]
Derived = Annotated[Mapping[str, Expression], pydantic.AfterValidator(check_names)]


@parameters
class Study(SpecimenChoice):
    """A study: one model, and the values that are swept."""

    time: Annotated[TimeSettings, "Step, scheme, numerical damping and end."]
    title: Annotated[str, "What the study shows."] = ""
    description: Annotated[str, "The question that it answers, in a sentence or two; its report begins with it."] = ""
    mesh: Annotated[
        MeshSettings,
        "Element sizes of the section, with `element` T4 or T10 those of the fingertip in 3D; without `element` "
        "it is the specimen's: a solid where its preset has a shape in 3D. Or `file` for a mesh that is read, or "
        "`skin` and more for one built from the surfaces of a scan.",
    ] = MeshSizes()
    contact: Annotated[ContactSettings | None, "Contact with one counterface, by default a plate."] = None
    contacts: Annotated[tuple[ContactSettings, ...], "Contacts with several counterfaces, instead of `contact`."] = ()
    bodies: Annotated[
        Mapping[str, RigidBody],
        "Rigid bodies by name, which carry the counterfaces of the contacts that name them in `rigid_body`.",
    ] = pydantic.Field(default_factory=dict)
    programme: Annotated[
        tuple[ProgrammeEntry, ...], "Motion of the counterfaces that have none of their own and are on no rigid body."
    ] = ()
    damping: Annotated[RayleighDamping, "Material damping."] = RayleighDamping()
    integration: Annotated[
        Integration, "How the dilatational part is integrated; see :class:`~fingerslip.model.model.Model`."
    ] = "selective"
    kinematics: Annotated[
        Kinematics, "Whether strains and rotations are taken as small; see :class:`~fingerslip.model.model.Model`."
    ] = "small"
    record: Annotated[RecordSettings, "What is recorded."] = RecordSettings()
    dynamics: Annotated[DynamicsSettings, "Whether motions are computed on the mesh or in a reduced basis of it."] = (
        DynamicsSettings()
    )
    materials: Annotated[
        Mapping[str, MaterialEntry],
        "Materials by region, `law` says which kind (elastic without it), or `preset` and the values that differ "
        "from it; they replace those of the specimen.",
    ] = pydantic.Field(default_factory=dict)
    supports: Annotated[
        Mapping[str, tuple[Component, ...]],
        "Fixed components by boundary or region; without them the specimen's, such as the phalanx of a fingertip.",
    ] = pydantic.Field(default_factory=dict)
    support_motions: Annotated[Mapping[str, SupportMotion], "Supports that move as prescribed, by name."] = (
        pydantic.Field(default_factory=dict)
    )
    tractions: Annotated[
        Mapping[str, AnyTraction], "Dead loads on boundaries [Pa], constant, or `value` with a `ramp` over time."
    ] = pydantic.Field(default_factory=dict)
    gravity: Annotated[tuple[SignedAcceleration, ...] | None, "Acceleration of gravity [m/s^2]."] = None
    initial_velocity: Annotated[
        tuple[SignedSpeed, ...] | None, "Velocity of the whole deformable body at the start [m/s]."
    ] = None
    formulation: Annotated[
        Formulation | None, "The two-dimensional assumption, or 'solid' in 3D; without it that of the specimen."
    ] = None
    depth: Annotated[PositiveLength | None, "Out-of-plane depth [m], not in 3D; without it that of the specimen."] = (
        None
    )
    sweep: Annotated[
        Sweep,
        "Values by dotted path; the runs are all combinations, the first path varies slowest. Values that change "
        "together are lists by several paths with commas between them.",
    ] = pydantic.Field(default_factory=dict)
    sample: Annotated[
        SampleSettings | None,
        "Samples of values that are known by their ranges only; every combination of the sweep is run with every "
        "sample.",
    ] = None
    fit: Annotated[
        FitSettings | None,
        "Measured curves to which ``fingerslip fit`` fits the sampled values; the ranges of `sample` are their prior.",
    ] = None
    repeats: Annotated[
        RepeatSettings | None, "Repeats of every run, in which some values scatter as from trial to trial."
    ] = None
    derived: Annotated[
        Derived,
        "Further quantities of every run by name: expressions of events, measures and parameters, such as "
        "``slip_travel: overall_slip * slide_speed``. They become columns of the summary, with their units.",
    ] = pydantic.Field(default_factory=dict)
    compare: Annotated[tuple[PublishedName, ...], "Published tables with which the results are compared."] = ()
    converge: Annotated[RefinementSettings, "How ``fingerslip converge`` refines the runs."] = RefinementSettings()
    trials: Annotated[
        TrialSettings | None, "How ``fingerslip detect simulate`` makes trials of a data set of the runs."
    ] = None
    reaction: Annotated[
        ReactionSettings | None, "An object that the body holds by its contact, whose load grows, and what may save it."
    ] = None
    cameras: Annotated[
        Mapping[CameraKind, CameraSettings],
        "Cameras that film the markers of every run; other cameras need no new simulation.",
    ] = pydantic.Field(default_factory=dict)

    def __post_init__(self) -> None:
        Mistakes(mistakes_between(vars(self))).raise_all()

    @property
    def held_object(self) -> HeldObject | None:
        """The object that is held, if there is one."""
        contact = self.contact and self.contact.contact(2)
        return self.reaction.held_object(contact, self.time.stepping) if self.reaction and contact else None

    def beside(self, folder: Path) -> Study:
        """Return the study with the files of its mesh and of its load, which are named from a folder."""
        reaction = self.reaction and self.reaction.beside(folder)
        return dataclasses.replace(self, mesh=self.mesh.beside(folder), reaction=reaction)

    @property
    def all_contacts(self) -> tuple[ContactSettings, ...]:
        """The contacts, whether one or several."""
        return self.contacts if self.contact is None else (self.contact,)

    @property
    def is_solid(self) -> bool:
        """Whether its body is modelled in 3D."""
        return self.formulation == "solid" or self.mesh.dim == 3

    @property
    def all_materials(self) -> Mapping[str, AnyMaterial]:
        """The materials by region, with all their values."""
        return {name: material_of(entry) for name, entry in self.materials.items()}


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
        For all mistakes in the file, in its order and with their lines: those of the study, of its specimen, of
        every run of its sweep, and of the ends of the ranges of its samples.

    Examples
    --------
    >>> import tempfile
    >>> import fingerslip as fs
    >>> with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
    ...     _ = file.write('''
    ... title: A fingertip is pressed and slid
    ... fingertip: {preset: wang2014-2d}
    ... contact: {friction_coefficient: 0.6}
    ... programme: [{press: {depth: 1.5 mm, speed: 1.5 mm/s}}, {slide: {distance: 6 mm, speed: 3 mm/s}}]
    ... time: {step: 5 ms}
    ... ''')
    ...     file.flush()
    ...     fs.read_study(file.name).programme[0].depth
    0.0015
    """
    with study_file(Path(path)) as mapping:
        return parse_study(mapping, Path(path))


def parse_study(mapping: Mapping[str, Any], source: Path) -> Study:
    """Build a study from plain data, quantities as text with units."""
    return PlainStudy(mapping, source).study


class PlainStudy:
    """A study as plain data that was checked with all its runs; every run of its sweep is read once."""

    def __init__(self, mapping: Mapping[str, Any], source: Path) -> None:
        self.source = source
        self._mapping = _with_marks(mapping)
        self._studies: dict[str, tuple[Study | None, list[InputError]]] = {}
        study, mistakes = _study_or_mistakes(self._mapping)
        if mapping.get("sweep"):
            mistakes += swept_mistakes(self._plain, mistakes, known_paths(mapping), self._mistakes_with)
        if isinstance(mapping.get("sample"), Mapping):
            mistakes += sample_mistakes(self._plain, mistakes, known_paths(mapping), self._mistakes_with)
        if study is None:
            mistakes += _unknown_groups(self._mapping, source.parent)
        self.study = self._require(study, mistakes, self._mapping)

    def with_values(self, changes: Mapping[str, Any]) -> Study:
        """Return the study with other values by dotted path, without a sweep, samples and repeats."""
        if not changes and not (self.study.sweep or self.study.sample or self.study.repeats):
            return self.study
        return self._require(*self._study_with(changes), self._plain)

    @functools.cached_property
    def _plain(self) -> dict[str, Any]:
        """The study as plain data, with all defaults where its fields are right."""
        fields = plain_fields(Study, valid_fields(Study, self._mapping))
        as_written = {key: self._mapping[key] for key in ("sweep", "sample") if key in self._mapping}
        return {**self._mapping, **fields, **as_written}

    def _mistakes_with(self, changes: Mapping[str, Any]) -> list[InputError]:
        return self._study_with(changes)[1]

    def _study_with(self, changes: Mapping[str, Any]) -> tuple[Study | None, list[InputError]]:
        key = repr(changes)
        if key not in self._studies:
            self._studies[key] = _study_or_mistakes(_with_marks(with_values(self._plain, changes)))
        return self._studies[key]

    def _require(self, study: Study | None, mistakes: Sequence[InputError], order: Mapping[str, Any]) -> Study:
        with errors_at(str(self.source)):
            if study is None or mistakes:
                raise Mistakes(in_order(mistakes, walk(order))).error()
            return study.beside(self.source.parent)


def _with_marks(mapping: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a study that says whose mesh it has and of which element, as its specimen does, where it gives only sizes.

    Without this a preset in 3D would be meshed as a section, because only the kind of element tells them apart.
    """
    mesh = mapping.get("mesh", {})
    specimen: Specimen | None = None
    for kind, presets in SPECIMENS.items():
        if specimen is None and isinstance(mapping.get(kind), Mapping):
            with contextlib.suppress(InputError):  # mistakes of a specimen are told elsewhere
                specimen = presets.changed(mapping[kind])
    if specimen is None or not isinstance(mesh, Mapping):
        return mapping
    for source in (specimen.default_mesh, *(kind() for kind in specimen.mesh_sources)):
        values, named = vars(source), marks(type(source))
        fits = all(mesh[name] in allowed for name, allowed in named.items() if name in mesh)
        if fits and mesh.keys() <= values.keys():
            return {**mapping, "mesh": {name: values[name] for name in named if values[name] is not None} | dict(mesh)}
    return mapping


def _study_or_mistakes(mapping: Mapping[str, Any]) -> tuple[Study | None, list[InputError]]:
    """Return a study from plain data, or its mistakes without those of its runs; their locations are dotted paths."""
    try:
        return from_mapping(Study, mapping), []
    except InputError as error:
        return None, [*error.all, *mistakes_between(valid_fields(Study, mapping))]


def _unknown_groups(mapping: Mapping[str, Any], folder: Path) -> list[InputError]:
    """Return the groups that a study with other mistakes names in all its runs and its mesh file lacks."""
    source, mistakes, changed = valid_fields(Study, mapping).get("mesh"), Mistakes(), changed_paths(mapping)
    if not isinstance(source, MeshFile) or any(is_below(path, "mesh") for path in changed):
        return []
    from fingerslip.fe.space import group_facets  # slow to load

    with contextlib.suppress(InputError):  # a file that cannot be read is told where nothing else is wrong
        mesh = source.beside(folder).build()
        groups = (mapping.get(key) for key in ("contact", "supports", "tractions"))
        contact, supports, tractions = (group if isinstance(group, Mapping) else {} for group in groups)
        names = {f"supports.{name}": name for name in supports if name not in (mesh.subdomains or {})}
        names |= {f"tractions.{name}": name for name in tractions}
        touched = contact.get("boundary", ContactSettings.boundary)
        names |= {"contact.boundary": touched} if contact and isinstance(touched, str) else {}
        for place in [place for place in names if not any(is_below(place, path) for path in changed)]:
            with mistakes.collect():
                group_facets(mesh.boundaries, names[place], "boundary", place)
    return mistakes.found


def known_paths(mapping: Mapping[str, Any]) -> Mapping[str, tuple[str, ...]]:
    """Return the dotted paths that a sweep may name, by the field of the study that they begin with."""
    sections = plain_fields(Study, valid_fields(Study, _with_marks(mapping)))
    for kind, presets in SPECIMENS.items():
        if sections.get(kind) is not None:
            specimen = {"preset": "", **as_mapping(presets.changed(sections[kind]))}
            materials = {name: {PRESET: "", **values} for name, values in specimen["materials"].items()}
            sections[kind] = specimen | {"materials": materials}
    for name, entry in sections.get("materials", {}).items():
        if PRESET in entry:
            sections["materials"] = sections["materials"] | {name: {PRESET: "", **as_mapping(material_of(entry))}}
    return {
        name: (name, *walk(section, name)) for name, section in sections.items() if name not in ("title", *NOT_OF_A_RUN)
    }
