"""The parts of a study file: mesh, contacts, programme, loads and what is recorded.

Where one of several kinds is meant, the key says which: ``friction: {static_kinetic: {...}}``,
``counterface: {cylinder: {...}}``, ``- press: {...}``.
"""

from __future__ import annotations

import dataclasses
import functools
import operator
from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import pydantic

from fingerslip.contact.counterfaces import BuiltInCounterface, Counterface, Plane
from fingerslip.contact.friction import BuiltInLaw, Coulomb, FrictionLaw
from fingerslip.errors import InputError
from fingerslip.mesh.file import MeshFile
from fingerslip.mesh.scan.build import SurfaceMesh
from fingerslip.mesh.source import MeshSource, choose_source
from fingerslip.model import Drive, ReducedBasis, Traction
from fingerslip.parameters import (
    Duration,
    NonNegativeLength,
    NonNegativeNumber,
    Number,
    PositiveLength,
    SignedLength,
    SignedPressure,
    Stiffness,
    parameters,
)
from fingerslip.programme import Phase
from fingerslip.rigid_bodies import RigidBody, RigidBodyBase
from fingerslip.sites import ReceptorKind, Site
from fingerslip.specimens.choice import specimen_mesh_sources
from fingerslip.study.definition.choices import choice_of, chosen
from fingerslip.timing import NumericalDamping, Tolerance

__all__ = [
    "BodySettings",
    "ContactSettings",
    "CounterfaceChoice",
    "DynamicsSettings",
    "FrictionChoice",
    "MeshSettings",
    "ProgrammeEntry",
    "RecordSettings",
    "RefinementSettings",
    "TractionSettings",
]

PositiveNumber = Annotated[Number, pydantic.Field(gt=0)]

_UPWARDS = (0.0, 1.0)


@choice_of(Phase, "phase")
class ProgrammeEntry:
    """One phase of the programme, under the key that names its kind; exactly one is given."""

    @property
    def phase(self) -> Phase:
        """The phase itself."""
        phase: Phase = chosen(self)[1]
        return phase


@choice_of(BuiltInLaw, "law")
class FrictionChoice:
    """A friction law, under the key that names its kind; exactly one is given.

    `friction_coefficient` of the contact is short for ``coulomb``.
    """

    @property
    def law(self) -> FrictionLaw:
        """The law itself."""
        law: FrictionLaw = chosen(self)[1]
        return law


@choice_of(BuiltInCounterface, "counterface")
class CounterfaceChoice:
    """A counterface, under the key that names its shape; exactly one is given."""

    @property
    def shape(self) -> str:
        """The key of the counterface."""
        return chosen(self)[0]

    @property
    def counterface(self) -> Counterface:
        """The counterface itself."""
        counterface: Counterface = chosen(self)[1]
        return counterface


@parameters
class ContactSettings:
    """Contact of a boundary with one counterface.

    Parameters
    ----------
    friction_coefficient : float, optional
        Coulomb friction coefficient [-]; short for ``friction: {coulomb: {coefficient: ...}}``.
    friction : FrictionChoice, optional
        Any friction law; one of the two is needed.
    boundary : str
        Boundary of the mesh that may touch the counterface.
    normal : tuple of float
        Normal of the plate, towards the deformable body.
    offset : float, optional
        Start of the plate along its normal [m]; without it the plate starts where it just touches.
    counterface : CounterfaceChoice, optional
        Any counterface instead of the plate with `normal` and `offset`.
    normal_penalty, tangential_penalty : float, optional
        Contact stiffness per area [Pa/m].
    search_distance : float, optional
        Distance from the counterface within which the boundary may come to touch it [m].
    programme : tuple of ProgrammeEntry, optional
        The counterface's own motion; without it that of the study.
    drive : Drive, optional
        A force that moves the counterface along its normal, on top of the prescribed motion.
    rigid_body : str, optional
        The rigid body that the counterface is a face of, one of `bodies`; it moves with that.
    clearance : float
        Gap that is left at the start, along the normal, by a counterface without `offset` or `centre` [m]; the first
        part of a press closes it.
    """

    RENAMED: ClassVar[Mapping[str, str]] = MappingProxyType({"body": "counterface", "reach": "search_distance"})

    friction_coefficient: NonNegativeNumber | None = None
    friction: FrictionChoice | None = None
    boundary: str = "skin"
    normal: tuple[float, ...] = _UPWARDS
    offset: SignedLength | None = None
    counterface: CounterfaceChoice | None = None
    normal_penalty: Stiffness | None = None
    tangential_penalty: Stiffness | None = None
    search_distance: PositiveLength | None = None
    programme: tuple[ProgrammeEntry, ...] | None = None
    drive: Drive | None = None
    rigid_body: str | None = None
    clearance: NonNegativeLength = 0.0

    def __post_init__(self) -> None:
        if self.friction_coefficient is None and self.friction is None:
            raise InputError("friction_coefficient", "is missing", "needs a value", "or give another law in friction")
        if self.friction_coefficient is not None and self.friction is not None:
            raise InputError("friction", "is given with friction_coefficient", "needs one of the two")
        if self.counterface is not None and (self.offset is not None or self.normal != _UPWARDS):
            found = "is given with normal or offset"
            raise InputError("counterface", found, "needs them inside it", "move them into counterface")
        if self.counterface is None:
            _check_plane(self)
        if self.clearance > 0.0 and _start_is_given(self.rigid_counterface):
            found, repair = "is given with offset or centre", "leave out one of them"
            raise InputError("clearance", found, "needs a counterface without a given start", repair)

    @property
    def law(self) -> FrictionLaw:
        """The friction law, short form or not."""
        return self.friction.law if self.friction is not None else Coulomb(self.friction_coefficient or 0.0)

    @property
    def rigid_counterface(self) -> Counterface:
        """The counterface, short form or not."""
        return self.counterface.counterface if self.counterface is not None else Plane(self.normal, self.offset)


@parameters
class BodySettings(RigidBodyBase):
    """A rigid body; its values are those of :class:`~fingerslip.rigid_bodies.RigidBody`.

    Parameters
    ----------
    programme : tuple of ProgrammeEntry
        Motion in the directions that are not free.
    """

    programme: tuple[ProgrammeEntry, ...] = ()

    @property
    def body(self) -> RigidBody:
        """The body of the model."""
        own = {field.name: getattr(self, field.name) for field in dataclasses.fields(RigidBodyBase)}
        return RigidBody(**own, programme=tuple(entry.phase for entry in self.programme))


@parameters
class DynamicsSettings:
    """In which coordinates motions are computed.

    Parameters
    ----------
    basis : {'full', 'reduced', 'automatic'}
        The mesh; a reduced basis of it, kept on disk for other runs; or the basis where it saves time in the runs that
        share a body, and the mesh elsewhere.
    tolerance : float
        Of the reduced basis: largest error of the displacement, estimated during the motion, over the largest
        displacement.
    acceleration_tolerance : float
        The same of accelerations, in the root of the mean square over the body.
    """

    basis: Literal["full", "reduced", "automatic"] = "automatic"
    tolerance: Tolerance = ReducedBasis().tolerance
    acceleration_tolerance: Tolerance = ReducedBasis().acceleration_tolerance

    @property
    def reduced(self) -> ReducedBasis | None:
        """The basis of the model; None for the mesh, and as long as it is not decided."""
        return ReducedBasis(self.tolerance, self.acceleration_tolerance) if self.basis == "reduced" else None


@parameters
class RecordSettings:
    """What a run records beside the contact, the forces and the energies.

    Parameters
    ----------
    receptors : tuple of {'FA-I', 'SA-I', 'FA-II', 'SA-II'}
        Kinds of mechanoreceptors of the fingertip at which the motion is recorded.
    reference_nodes : bool
        Whether the reference nodes h1 to h7 and v1 to v7 on the skin and on the tissue are recorded; of the fingertip
        in space.
    groups : tuple of str
        Other groups of the specimen's own sites, such as the `internal_markers` of a sensor.
    sites : tuple of Site
        Further sites.
    snapshots_every : float
        Time between snapshots of the whole mesh [s]; 0 for none.
    """

    receptors: tuple[ReceptorKind, ...] = ()
    reference_nodes: bool = False
    groups: tuple[str, ...] = ()
    sites: tuple[Site, ...] = ()
    snapshots_every: Duration = 0.0

    @property
    def all_groups(self) -> tuple[str, ...]:
        """All groups of the specimen's own sites that are recorded."""
        return (*self.receptors, *(("reference_nodes",) if self.reference_nodes else ()), *self.groups)


_MESH_SOURCES: tuple[type[MeshSource], ...] = (MeshFile, SurfaceMesh, *specimen_mesh_sources())


def _mesh_kind(value: object) -> str:
    given = type(value) in _MESH_SOURCES
    source = type(value) if given else choose_source(_MESH_SOURCES, value if isinstance(value, Mapping) else {})
    return source.__name__


if TYPE_CHECKING:
    MeshSettings = MeshSource
else:
    #: Any mesh source; which one is meant follows from the keys that are given.
    MeshSettings = Annotated[
        functools.reduce(operator.or_, (Annotated[source, pydantic.Tag(source.__name__)] for source in _MESH_SOURCES)),
        pydantic.Discriminator(_mesh_kind),
    ]


def _traction_kind(value: object) -> str:
    return "Traction" if isinstance(value, Mapping | Traction) else "Components"


TractionSettings = Annotated[
    Annotated[Traction, pydantic.Tag("Traction")] | Annotated[tuple[SignedPressure, ...], pydantic.Tag("Components")],
    pydantic.Discriminator(_traction_kind),
]


def _start_is_given(counterface: Counterface) -> bool:
    return any(getattr(counterface, name, None) is not None for name in ("offset", "centre"))


def _check_plane(settings: ContactSettings) -> None:
    """Refuse a normal that makes no plane, under its name in the study file."""
    try:
        Plane(settings.normal, settings.offset)
    except InputError as error:
        raise error.moved(lambda where: where.removeprefix("Plane.")) from None


@parameters
class RefinementSettings:
    """What ``fingerslip converge`` computes again; empty leaves a setting as it is.

    Parameters
    ----------
    mesh : tuple of float
        Two factors on the element sizes.
    step : tuple of float
        Two factors on the time step.
    penalty : tuple of float
        Two factors on the contact stiffness, automatic ones included.
    alpha : tuple of float
        Other values of the numerical damping.
    """

    mesh: tuple[PositiveNumber, ...] = (0.6667, 0.5)
    step: tuple[PositiveNumber, ...] = (0.5, 0.25)
    penalty: tuple[PositiveNumber, ...] = (4.0, 16.0)
    alpha: tuple[NumericalDamping, ...] = (-0.05,)

    def __post_init__(self) -> None:
        for name in ("mesh", "step", "penalty"):
            factors = getattr(self, name)
            if factors and len({1.0, *factors}) != 3:
                found = f"has {', '.join(f'{factor:g}' for factor in factors)}"
                raise InputError(name, found, "needs two different factors beside 1, or none", "write [0.6667, 0.5]")
