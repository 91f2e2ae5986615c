"""The settings of a study file: mesh, contacts, programme, loads, what is recorded, and what cameras see."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import operator
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal

import pydantic

from fingerslip.contact.counterfaces import Plane
from fingerslip.contact.friction import Coulomb
from fingerslip.errors import InputError
from fingerslip.mesh.scan.build import SurfaceMesh
from fingerslip.mesh.source import MeshFile, MeshSource, choose_source
from fingerslip.model import timing
from fingerslip.model.model import Contact, CounterfaceChoice, FrictionChoice, Recording, ReducedBasis
from fingerslip.parameters import (
    Angle,
    Duration,
    Length,
    NonNegativeLength,
    NonNegativeNumber,
    Number,
    PositiveDuration,
    PositiveLength,
    parameters,
)
from fingerslip.sites import ReceptorKind, Site
from fingerslip.specimens.choice import specimen_mesh_sources
from fingerslip.units import Unit
from fingerslip.vision.cameras import PUBLISHED_FRAME_RATE

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from fingerslip.vision.cameras.camera import Camera

PositiveNumber = Annotated[Number, pydantic.Field(gt=0)]

_UPWARDS = (0.0, 1.0)


@parameters
class ContactSettings(Contact):
    """A contact in a study file: a plate by its normal, and Coulomb friction by its coefficient, need no more."""

    boundary: Annotated[str, "Boundary of the mesh that may touch the counterface."] = "skin"
    friction_coefficient: Annotated[
        NonNegativeNumber | None,
        "Coulomb friction coefficient [-]; short for ``friction: {coulomb: {coefficient: ...}}``.",
    ] = None
    friction: Annotated[FrictionChoice | None, "Any friction law; one of the two is needed."] = None  # type: ignore[assignment]
    normal: Annotated[tuple[float, ...], "Normal of the plate, towards the deformable body."] = _UPWARDS
    offset: Annotated[
        Length | None, "Start of the plate along its normal [m]; without it the plate starts where it just touches."
    ] = None
    counterface: Annotated[
        CounterfaceChoice | None, "Any counterface instead of the plate with `normal` and `offset`."
    ] = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        if self.friction_coefficient is None and self.friction is None:
            raise InputError("friction_coefficient", "is missing", "needs a value", "or give another law in friction")
        if self.friction_coefficient is not None and self.friction is not None:
            raise InputError("friction", "is given with friction_coefficient", "needs one of the two")
        if self.counterface is not None and (self.offset is not None or self.normal != _UPWARDS):
            fault = "is given with normal or offset"
            raise InputError("counterface", fault, "needs them inside it", "move them into counterface")
        with _without_class("Plane"):
            contact = self.contact(2)
        start = (getattr(contact.counterface, name, None) for name in ("offset", "centre"))
        if self.clearance > 0.0 and any(value is not None for value in start):
            fault, repair = "is given with offset or centre", "leave out one of them"
            raise InputError("clearance", fault, "needs a counterface without a given start", repair)

    def contact(self, dim: int) -> Contact:
        """Return the contact of a model in 2 or 3 dimensions, short forms written out."""
        normal = (*self.normal, 0.0) if dim == 3 and len(self.normal) == 2 else self.normal
        values = {field.name: getattr(self, field.name) for field in dataclasses.fields(Contact)}
        long_forms = {
            "counterface": self.counterface or Plane(normal, self.offset),
            "friction": self.friction or Coulomb(self.friction_coefficient or 0.0),
        }
        return Contact(**(values | long_forms))


@contextlib.contextmanager
def _without_class(name: str) -> Iterator[None]:
    """Name the places of errors in the block as the study file does, without the class."""
    try:
        yield
    except InputError as error:
        raise error.moved(lambda where: where.removeprefix(f"{name}.")) from None


@parameters
class DynamicsSettings(ReducedBasis):
    """In which coordinates motions are computed."""

    basis: Annotated[
        Literal["full", "reduced", "automatic"],
        "The mesh; a reduced basis of it, kept on disk for other runs; or the basis where it saves time in the "
        "runs that share a body, and the mesh elsewhere.",
    ] = "automatic"
    tolerance: Annotated[
        timing.Tolerance,
        "Of the reduced basis: largest error of the displacement, estimated during the motion, over the largest "
        "displacement.",
    ] = 1e-4

    @property
    def reduced(self) -> ReducedBasis | None:
        """The basis of the model; None for the mesh, and as long as it is not decided."""
        return ReducedBasis(self.tolerance, self.acceleration_tolerance) if self.basis == "reduced" else None


@parameters
class RecordSettings(Recording):
    """What a run records beside the contact, the forces and the energies."""

    receptors: Annotated[
        tuple[ReceptorKind, ...], "Kinds of mechanoreceptors of the fingertip at which the motion is recorded."
    ] = ()
    reference_nodes: Annotated[
        bool,
        "Whether the reference nodes h1 to h7 and v1 to v7 on the skin and on the tissue are recorded; of the "
        "fingertip in 3D.",
    ] = False
    groups: Annotated[
        tuple[str, ...], "Other groups of the specimen's own sites, such as the `internal_markers` of a sensor."
    ] = ()
    sites: Annotated[tuple[Site, ...], "Further sites."] = ()

    @property
    def all_groups(self) -> tuple[str, ...]:
        """All groups of the specimen's own sites that are recorded."""
        return (*self.receptors, *(("reference_nodes",) if self.reference_nodes else ()), *self.groups)


_MESH_SOURCES: tuple[type[MeshSource], ...] = (MeshFile, SurfaceMesh, *specimen_mesh_sources())


def _mesh_kind(value: object) -> str:
    is_source = type(value) in _MESH_SOURCES
    source = type(value) if is_source else choose_source(_MESH_SOURCES, value if isinstance(value, Mapping) else {})
    return source.__name__


if TYPE_CHECKING:
    MeshSettings = MeshSource
else:
    #: Any mesh source; which one is meant follows from the keys that are given.
    MeshSettings = Annotated[
        functools.reduce(operator.or_, (Annotated[source, pydantic.Tag(source.__name__)] for source in _MESH_SOURCES)),
        pydantic.Discriminator(_mesh_kind),
    ]


@parameters
class RefinementSettings:
    """What ``fingerslip converge`` computes again; empty leaves a setting as it is."""

    mesh: Annotated[tuple[PositiveNumber, ...], "Two factors on the element sizes."] = (0.6667, 0.5)
    step: Annotated[tuple[PositiveNumber, ...], "Two factors on the time step."] = (0.5, 0.25)
    penalty: Annotated[tuple[PositiveNumber, ...], "Two factors on the contact stiffness, automatic ones included."] = (
        4.0,
        16.0,
    )
    alpha: Annotated[tuple[timing.NumericalDamping, ...], "Other values of the numerical damping."] = (-0.05,)

    def __post_init__(self) -> None:
        for name, example in (("mesh", "[0.6667, 0.5]"), ("step", "[0.5, 0.25]"), ("penalty", "[4, 16]")):
            factors = getattr(self, name)
            if factors and len({1.0, *factors}) != 3:
                fault = f"has {', '.join(f'{factor:g}' for factor in factors)}"
                raise InputError(name, fault, "needs two different factors beside 1, or none", f"write {example}")


_ALPHA = -0.05
# What only steps that control their own error have.
_OF_AUTO = ("output", "tolerance", "smallest", "largest", "records_per_decade")


#: The length of a step, or steps that control their own error.
StepSettings = Annotated[
    Annotated[PositiveDuration, pydantic.Tag("Duration")] | Annotated[Literal["auto"], pydantic.Tag("auto")],
    pydantic.Discriminator(lambda value: "auto" if value == "auto" else "Duration"),
]


@parameters
class TimeSettings:
    """How time passes."""

    step: Annotated[StepSettings, "Time step [s], or steps that control their own error."]
    scheme: timing.SchemeName = "hht_alpha"
    alpha: timing.SchemeDamping = _ALPHA
    end: Annotated[PositiveDuration | None, "End of the simulation [s]; without it the end of the programme."] = None
    output: Annotated[
        PositiveDuration | None,
        "Of steps that control their own error: longest time between records, in holds with `records_per_decade` the "
        "first one there [s].",
    ] = None
    tolerance: Annotated[
        timing.Tolerance | None,
        "Of these, largest error over the largest displacement; see :class:`~fingerslip.model.timing.Adaptive`.",
    ] = None
    smallest: Annotated[PositiveDuration | None, "Shortest and longest of these steps [s]."] = None
    largest: Annotated[PositiveDuration | None, "Shortest and longest of these steps [s]."] = None
    records_per_decade: Annotated[
        timing.RecordsPerDecade | None,
        "Logarithmic records in holds: how many there are at least while the time in the hold grows tenfold.",
    ] = None

    def __post_init__(self) -> None:
        if self.scheme == "quasi_static" and self.alpha != _ALPHA:
            raise InputError("alpha", f"got {self.alpha:g} for quasi-static steps", "may not be given", "leave it out")
        for name in _OF_AUTO:
            if self.step != "auto" and getattr(self, name) is not None:
                repair = "write step: auto, or leave it out"
                raise InputError(name, "is given with a fixed step", "belongs to step: auto", repair)
        if self.step == "auto" and self.output is None:
            raise InputError("output", "is missing", "step: auto needs the time between records", "write output: 5 ms")
        with _without_class("Adaptive"):
            _ = self.stepping

    @property
    def stepping(self) -> timing.TimeStepping | timing.QuasiStatic | timing.Adaptive:
        """The time stepping of the model."""
        if self.step == "auto":
            options = {name: getattr(self, name) for name in _OF_AUTO if getattr(self, name) is not None}
            return timing.Adaptive(**options, scheme=self.scheme, alpha=self.alpha, end=self.end)
        if self.scheme == "quasi_static":
            return timing.QuasiStatic(self.step, self.end)
        return timing.TimeStepping(self.step, self.alpha, self.end)

    def refined(self, factor: float) -> TimeSettings:
        """Return settings whose steps are those of these times a factor; see :meth:`Adaptive.refined`."""
        if self.step != "auto":
            return dataclasses.replace(self, step=factor * self.step)
        stepping = self.stepping
        assert isinstance(stepping, timing.Adaptive)
        finer = stepping.refined(factor)
        return dataclasses.replace(self, **{name: getattr(finer, name) for name in _OF_AUTO})


#: `internal` looks at the markers inside a sensor, `external` through the plate at those on its skin.
CameraKind = Literal["internal", "external"]

_FrameRate = Annotated[float, Unit("1/s"), pydantic.Field(gt=0, le=1e4)]
_Pixels = Annotated[int, pydantic.Field(ge=16, le=8192)]
_Seed = Annotated[int, pydantic.Field(ge=0, lt=2**63)]
_Quality = Annotated[int, pydantic.Field(ge=1, le=100)]


@parameters
class CameraView:
    """What a camera of a sensor sees; no published sensor prints these values, so every default is assumed."""

    distance: Annotated[
        PositiveLength, "From the lens to the markers, the lowest ones for the external camera [m]."
    ] = 50e-3
    view_width: Annotated[PositiveLength, "Length that the width of the image shows at the markers [m]."] = 45e-3
    width: Annotated[_Pixels, "Size of the image [px]."] = 640
    height: Annotated[_Pixels, "Size of the image [px]."] = 480

    @property
    def metres_per_pixel(self) -> float:
        """Length of a pixel at the markers [m]."""
        return self.view_width / self.width

    def camera(self, kind: str, heights: ArrayLike, **options: Any) -> Camera:
        """Return the camera, aimed at markers: see :func:`~fingerslip.vision.cameras.camera.aimed_camera`."""
        # Cameras are slow to load, and a study is also read where nothing is filmed.
        from fingerslip.vision.cameras.camera import aimed_camera

        size = (self.width, self.height)
        return aimed_camera(kind, heights, self.distance, self.view_width, size=size, **options)


@parameters
class CameraSettings(CameraView):
    """A camera of a study; no published sensor prints these values, so every default is assumed."""

    tier: Annotated[
        Literal["pixel", "point"],
        "Frames, a video and the tracker, or positions with the errors of the tracker at once.",
    ] = "pixel"
    lens: Annotated[Literal["pinhole", "fisheye"], "Kind of the lens."] = "pinhole"
    frame_rate: Annotated[_FrameRate, "Frames a second [1/s]."] = 30.0
    exposure: Annotated[Duration, "Exposure of a frame [s]."] = 10e-3
    marker_radius: Annotated[PositiveLength, "Radius of the markers [m]."] = 0.5e-3
    markers: Annotated[
        Literal["bright", "dark", "moulded"],
        "Whether markers are brighter than what is around them; moulded ones are bright, on a dome, some with glue.",
    ] = "bright"
    light: Annotated[
        Literal["even", "harsh", "lamps"],
        "The light: even; with vignette, gradient, texture, glare and a bright ring; or as in recordings of real "
        "sensors, with six lamps that saturate and a white mount.",
    ] = "even"
    noise: Annotated[NonNegativeNumber, "Standard deviation of the noise of a pixel [grey levels]."] = 2.0
    jpeg_quality: Annotated[_Quality | None, "Quality of the compression of each frame; none without it."] = None
    rest: Annotated[
        Duration, "Time that is filmed before the motion begins [s]: the tracker needs markers at rest."
    ] = 1.0
    seed: Annotated[_Seed, "Seed of everything random: the same seed gives the same frames."] = 0

    def __post_init__(self) -> None:
        if self.exposure > 1.0 / self.frame_rate:
            allowed = f"needs at most a frame, {1e3 / self.frame_rate:.4g} ms"
            raise InputError("exposure", f"got {1e3 * self.exposure:g} ms", allowed)


_Count = Annotated[int, pydantic.Field(ge=1, le=360)]


@parameters
class TrialSettings(CameraView):
    """How the runs of a study become trials; ``fingerslip detect simulate`` makes the data set.

    Every run of a study with samples is one trial: samples take turns through the directions, so that their number is
    that of directions times repeats. Without samples every run is done in all directions. No published sensor prints
    the values of its cameras: every default here is assumed.
    """

    directions: Annotated[
        _Count,
        "Directions of the slide or fall, evenly over a turn. The run goes along +x; the others are that run turned, "
        "which is exact for an upright sensor whose rings all have a multiple of so many markers.",
    ] = 8
    rest: Annotated[
        Duration,
        "Time at rest that every film has before the slide [s]. A film begins at any moment of the hold that leaves "
        "it, so that after a long hold the time since its start tells nothing of slip.",
    ] = 1.5
    frame_rate: Annotated[_FrameRate, "Frames a second of both cameras [1/s]."] = PUBLISHED_FRAME_RATE
    noise: Annotated[
        tuple[NonNegativeNumber, NonNegativeNumber],
        "Smallest and largest standard deviation of the positions in a trial [px].",
    ] = (0.0061, 0.05)
    shift: Annotated[
        NonNegativeLength, "Cameras are placed beside the axis by up to this along both axes, anew in each trial [m]."
    ] = 0.5e-3
    turn: Annotated[Angle, "Cameras are turned about their axis by up to this, anew in each trial [rad]."] = 0.0175
    hidden: Annotated[
        PositiveLength,
        "Skin deeper than this inside the convex hull of the outside is in a groove, and must not touch [m]; it is "
        "watched.",
    ] = 0.3e-3
    patch: Annotated[
        PositiveLength, "Distance of neighbouring contact patches [m]: within each the traction is constant."
    ] = 1e-3
    seed: Annotated[_Seed, "Seed of everything random but the samples."] = 0

    def __post_init__(self) -> None:
        if self.noise[0] > self.noise[1]:
            raise InputError("noise", f"goes from {self.noise[0]:g} to {self.noise[1]:g}", "needs the smallest first")
