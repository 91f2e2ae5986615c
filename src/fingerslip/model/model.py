"""The model: everything that a simulation needs, as data."""

from __future__ import annotations

import html
from collections.abc import Mapping
from typing import Annotated, Any, Literal

import numpy as np
import pydantic

from fingerslip.contact.counterfaces import BuiltInCounterface, Counterface, Plane
from fingerslip.contact.friction import BuiltInLaw, Coulomb, FrictionLaw
from fingerslip.errors import InputError
from fingerslip.fe.finite.thickness import check_thickness
from fingerslip.fe.integration import Integration
from fingerslip.materials.choice import AnyMaterial, conforming_law
from fingerslip.materials.elastic import RayleighDamping
from fingerslip.materials.large_strain import FiniteMaterial
from fingerslip.materials.material import Formulation
from fingerslip.model.programme import CONSTANT, Phase, ProgrammeEntry, Ramp, phase_duration
from fingerslip.model.rigid_bodies import RigidBody
from fingerslip.model.timing import Adaptive, Timing, Tolerance
from fingerslip.parameters import (
    Duration,
    Force,
    Length,
    Mass,
    NonNegativeLength,
    PositiveLength,
    SignedPressure,
    Stiffness,
    one_of,
    parameters,
)
from fingerslip.parameters.schema import conforms, describe
from fingerslip.sites import Site

Component = Literal["x", "y", "z"]
#: Strains and rotations as small, or as large as they are.
Kinematics = Literal["small", "finite"]

#: A counterface and a friction law as parameters; study files write ``cylinder: {...}``, ``static_kinetic: {...}``.
CounterfaceChoice = Annotated[
    Counterface,
    pydantic.PlainValidator(conforms(Counterface, "a counterface, such as Plane, Cylinder or Sphere")),
    one_of(
        BuiltInCounterface,
        "counterface",
        "CounterfaceChoice",
        "A counterface, under the key that names its shape; exactly one is given.",
    ),
]
FrictionChoice = Annotated[
    FrictionLaw,
    pydantic.PlainValidator(conforms(FrictionLaw, "a friction law, such as Coulomb(0.5)")),
    one_of(
        BuiltInLaw, "law", "FrictionChoice", "A friction law, under the key that names its kind; exactly one is given."
    ),
]


@parameters
class Traction:
    """A dead load per area that changes over time.

    See :class:`Model`.
    """

    value: Annotated[tuple[SignedPressure, ...], "Traction [Pa], one value per component."]
    ramp: Annotated[Ramp, "Its factor over time."]


#: A dead load per area, constant or over time.
AnyTraction = Annotated[
    Annotated[Traction, pydantic.Tag("Traction")] | Annotated[tuple[SignedPressure, ...], pydantic.Tag("Components")],
    pydantic.Discriminator(lambda value: "Traction" if isinstance(value, Mapping | Traction) else "Components"),
]


@parameters
class SupportMotion:
    """The prescribed motion of a support: a displacement that grows and falls with a factor over time.

    Examples
    --------
    A bone that moves up by 0.5 mm and comes back:

    >>> import fingerslip as fs
    >>> motion = fs.SupportMotion(displacement=(0.0, 0.5e-3), ramp=fs.Ramp((0.0, 0.1, 0.2), (0.0, 1.0, 0.0)))
    >>> motion.largest
    0.0005
    """

    displacement: Annotated[
        tuple[Length, ...],
        "Displacement at factor one [m], one value per component; 0 in those that the support leaves free.",
    ]
    ramp: Annotated[Ramp, "Its factor over time, 0 at the start."]

    def __post_init__(self) -> None:
        if self.ramp.at(0.0):
            fault = f"starts from a factor of {self.ramp.at(0.0):g}"
            raise InputError("ramp", fault, "needs 0 at the start", "write 0 s and a factor of 0 first")

    @property
    def largest(self) -> float:
        """The largest displacement [m]."""
        return float(np.linalg.norm(self.displacement) * np.abs(self.ramp.factors).max())


@parameters
class Drive:
    """A force on a counterface of its own mass, along the counterface's normal."""

    mass: Annotated[Mass, "Mass of the counterface [kg]."]
    force: Annotated[Force, "Force along its normal, towards the deformable body [N]."]
    ramp: Annotated[Ramp, "Factor of the force over time; 1 without it."] = CONSTANT


@parameters
class Contact:
    """Unilateral frictional contact of a boundary with a counterface.

    Parameters
    ----------
    boundary : str
        Named boundary of the mesh that may touch the counterface.
    counterface : Plane, Cylinder or Sphere
        The rigid counterface, or any object with the members of
        :class:`~fingerslip.contact.counterfaces.Counterface`.
    friction : FrictionLaw
        The friction law: one of :data:`~fingerslip.contact.friction.BuiltInLaw`, or any object with the members of
        :class:`~fingerslip.contact.friction.FrictionLaw`.
    normal_penalty, tangential_penalty : float, optional
        Contact stiffness per area [Pa/m]; without them they follow from the layer under the boundary
        and the size of its facets.
    search_distance : float, optional
        Nodes with a larger initial gap are no contact candidates [m]; without it one and a half times
        the approach of the counterface (in 3D 1.25 times, as long as this is enough), and unlimited
        where loads may bring the body to it.
    programme : tuple of Press, Hold, Slide or Lift, optional
        The counterface's own motion; without it the model's programme.
    drive : Drive, optional
        A force that moves the counterface along its normal, on top of the prescribed motion.
    rigid_body : str, optional
        Name of the rigid body that the counterface is a face of, among those of the model; it moves with that.
    clearance : float
        Gap that is left at the start, along the normal, by a counterface whose start is not given [m]; the first
        part of a press closes it.

    Examples
    --------
    A plate from below, and a disc from above that comes half a second later:

    >>> import fingerslip as fs
    >>> plate = fs.Contact("bottom", fs.Plane(), fs.Coulomb(0.6))
    >>> later = (fs.Hold(0.5), fs.Press(depth=1e-3, speed=2e-3))
    >>> disc = fs.Contact("top", fs.Cylinder(3e-3, normal=(0.0, -1.0)), fs.Coulomb(0.6), programme=later)
    """

    boundary: str
    counterface: CounterfaceChoice = Plane()
    friction: FrictionChoice = Coulomb(0.0)
    normal_penalty: Stiffness | None = None
    tangential_penalty: Stiffness | None = None
    search_distance: PositiveLength | None = None
    programme: tuple[ProgrammeEntry, ...] | None = None
    drive: Drive | None = None
    rigid_body: str | None = None
    clearance: NonNegativeLength = 0.0


_A_TIMING = pydantic.PlainValidator(conforms(Timing, "the time integration: TimeStepping, QuasiStatic or Adaptive"))


@parameters
class ReducedBasis:
    """A reduced basis in place of the mesh: constraint modes of the contact, exactly, and a few normal modes.

    Those that slow motions of the contact excite are taken, as many as the tolerance needs. Where they do not suffice,
    the motion is computed on the mesh. See docs/solver.md.
    """

    tolerance: Annotated[
        Tolerance,
        "Largest error that the normal modes left out may leave in the displacement, estimated during the motion, "
        "over the largest displacement.",
    ] = 1e-4
    acceleration_tolerance: Annotated[
        Tolerance, "The same of accelerations, in the root of the mean square over the body."
    ] = 5e-3


@parameters
class Recording:
    """What is recorded beside the contact nodes, forces and energies.

    See :class:`Model`.
    """

    sites: Annotated[
        tuple[Site, ...],
        "Points at which displacement, velocity, acceleration, stress and strain energy density are recorded.",
    ] = ()
    snapshots_every: Annotated[Duration, "Time between snapshots of the whole mesh [s]; 0 for none."] = 0.0


def _check_mesh(value: Any) -> Any:
    """Refuse what is not a mesh; its names are checked when the model is simulated."""
    if not all(hasattr(value, name) for name in ("p", "t", "boundaries", "subdomains")):
        allowed = "needs a mesh with named regions and boundaries"
        repair = "make one with build_section or build_solid, or read one with read_mesh"
        raise InputError("", f"got {describe(value)}", allowed, repair)
    return value


@parameters
class Model:
    """A deformable body with its supports, loads and contacts, and how its motion is computed.

    Parameters
    ----------
    mesh : skfem.Mesh
        Mesh with named subdomains (regions) and boundaries [m]: quadrilaterals (Q4), linear (T3) or quadratic
        triangles (T6), hexahedra (H8), linear (T4) or quadratic tetrahedra (T10). No cell folds over its neighbours.
    materials : mapping of str to Material or FiniteMaterial
        The material of every region: one of :data:`~fingerslip.materials.choice.LAWS`, or a law of one's own that
        answers :class:`~fingerslip.materials.material.Material` or
        :class:`~fingerslip.materials.large_strain.FiniteMaterial`.
    formulation : {'plane_strain', 'plane_stress', 'solid'}
        The two-dimensional assumption, or 'solid' in 3D.
    depth : float
        Out-of-plane depth [m], so that forces are newtons; not in 3D.
    supports : mapping of str to tuple of {'x', 'y', 'z'}
        Boundaries, or whole regions, that are fixed, and in which components.
    support_motions : mapping of str to SupportMotion
        Supports that move as prescribed, by name.
    tractions : mapping of str to tuple of float or Traction
        Dead loads on boundaries [Pa], constant from the start on or changing over time.
    contacts : tuple of Contact
        Boundaries of the body with the counterfaces that they may touch.
    bodies : mapping of str to RigidBody
        Rigid bodies by name: what carries the counterfaces of the contacts that name it in `rigid_body`.
    programme : tuple of Press, Hold, Slide or Lift
        The motion of all counterfaces without a programme of their own that are on no rigid body, phase after phase.
    time : TimeStepping, QuasiStatic or Adaptive
        Time integration and its step, or a :class:`~fingerslip.dynamics.system.scheme.Scheme`.
    damping : RayleighDamping
        Material damping.
    integration : {'selective', 'full', 'nodal'}
        How the dilatational part is integrated: 'selective' at the centre of quadrilaterals and hexahedra,
        which then do not lock near incompressibility; 'full' everywhere; 'nodal' from the mean around each
        node, for linear triangles and tetrahedra that do not lock.
    record : Recording
        What is recorded.
    kinematics : {'small', 'finite'}
        Whether strains and rotations are taken as small, or as large as they are; then all materials need laws of
        :class:`~fingerslip.materials.large_strain.FiniteMaterial`.
    basis : ReducedBasis, optional
        The reduced basis in which the motion is computed; without it on the mesh.
    gravity : tuple of float, optional
        Acceleration of gravity on the deformable body and the rigid bodies [m/s^2], one value per component.
    initial_velocity : tuple of float, optional
        Velocity of the whole body at the start [m/s], except where it is supported.

    Examples
    --------
    A block of gel of 10 mm is stretched by 1 kPa:

    >>> import skfem
    >>> import fingerslip as fs
    >>> block = skfem.MeshQuad().refined(2).scaled(10e-3).with_defaults()
    >>> model = fs.Model(
    ...     mesh=block.with_subdomains({"gel": lambda x: x[0] > 0.0}),
    ...     materials={"gel": fs.Elastic(youngs_modulus=20e3, poisson_ratio=0.0, density=1000.0)},
    ...     formulation="plane_stress",
    ...     supports={"bottom": ("x", "y")},
    ...     tractions={"top": fs.Traction((0.0, 1e3), ramp=fs.Ramp((0.0, 0.1), (0.0, 1.0)))},
    ...     time=fs.QuasiStatic(step=0.05, end=0.1),
    ...     record=fs.Recording(sites=(fs.Site("middle", "marker", position=(5e-3, 10e-3)),)),
    ... )
    >>> model
    <Model: MeshQuad1 of 25 nodes (gel), 0 contacts, no programme, 0.1 s>
    >>> fs.simulate(model)["displacement"].sel(site="middle", component="y").values.round(9).tolist()
    [0.0, 0.00025, 0.0005]
    """

    mesh: Annotated[Any, pydantic.AfterValidator(_check_mesh)]
    materials: Mapping[str, Annotated[AnyMaterial, pydantic.PlainValidator(conforming_law)]]
    formulation: Formulation
    time: Annotated[Timing, _A_TIMING]
    depth: PositiveLength = 1.0
    supports: Mapping[str, tuple[Component, ...]] = pydantic.Field(default_factory=dict)
    support_motions: Mapping[str, SupportMotion] = pydantic.Field(default_factory=dict)
    tractions: Mapping[str, AnyTraction] = pydantic.Field(default_factory=dict)
    contacts: tuple[Contact, ...] = ()
    bodies: Mapping[str, RigidBody] = pydantic.Field(default_factory=dict)
    programme: tuple[ProgrammeEntry, ...] = ()
    damping: RayleighDamping = RayleighDamping()
    integration: Integration = "selective"
    record: Recording = Recording()
    kinematics: Kinematics = "small"
    basis: ReducedBasis | None = None
    gravity: tuple[float, ...] | None = None
    initial_velocity: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if self.formulation == "solid" and self.depth != 1.0:
            raise InputError("depth", f"got {self.depth:g} m for a solid", "may be given in two dimensions only")
        if self.is_finite and self.formulation == "plane_stress":
            for name, material in self.materials.items():
                # Laws of small strain are refused by their regions, with all else that these lack.
                if isinstance(material, FiniteMaterial):
                    check_thickness(name, material)
        for number, contact in enumerate(self.contacts):
            _check_face(contact, self.bodies, f"contacts.{number}")
        if self.basis is not None and isinstance(self.time, Adaptive):
            fault, allowed = "is given with steps that control their own error", "needs steps of a fixed length"
            raise InputError("basis", fault, allowed, "leave it out, or take TimeStepping or QuasiStatic")
        if not any(self.programmes) and self.time.end is None:
            raise InputError("time.end", "is missing, and there is no programme", "needs one of the two")

    @property
    def is_finite(self) -> bool:
        """Whether strains and rotations are large."""
        return self.kinematics == "finite"

    @property
    def end(self) -> float:
        """End of the simulation [s]."""
        return self.time.end or max(sum(map(phase_duration, programme)) for programme in self.programmes)

    @property
    def programmes(self) -> tuple[tuple[Phase, ...], ...]:
        """The programme of every contact: its body's, its own or the model's; the model's where there is no contact."""
        programmes = []
        for contact in self.contacts:
            programme = self.programme if contact.programme is None else contact.programme
            programmes.append(programme if contact.rigid_body is None else self.bodies[contact.rigid_body].programme)
        return tuple(programmes) or (self.programme,)

    @property
    def is_loaded(self) -> bool:
        """Whether anything but prescribed motion of counterfaces may bring the body into contact."""
        driven = any(contact.drive for contact in self.contacts) or any(body.free for body in self.bodies.values())
        return bool(self.tractions or driven or self.gravity or self.initial_velocity or self.support_motions)

    def __repr__(self) -> str:
        kind, nodes = type(self.mesh).__name__, self.mesh.p.shape[1]
        regions, contacts = ", ".join(self.materials), len(self.contacts)
        motion = " + ".join(type(phase).__name__.lower() for phase in self.programmes[0]) or "no programme"
        return f"<Model: {kind} of {nodes} nodes ({regions}), {contacts} contacts, {motion}, {self.end:g} s>"

    def _repr_html_(self) -> str:
        """Return the model as notebooks show it."""
        rows = {
            "mesh": f"{type(self.mesh).__name__}, {self.mesh.p.shape[1]} nodes, {self.mesh.nelements} cells",
            "formulation": f"{self.formulation}, {self.kinematics} strain",
            "materials": ", ".join(f"{name}: {type(material).__name__}" for name, material in self.materials.items()),
            "supports": ", ".join(self.supports) or "none",
            "contacts": ", ".join(f"{contact.boundary}: {contact.friction!r}" for contact in self.contacts) or "none",
            "programme": "\n".join(map(repr, self.programmes[0])) or "none",
            "time": repr(self.time),
        }
        lines = {name: html.escape(text).replace("\n", "<br>") for name, text in rows.items()}
        cells = "".join(f"<tr><th>{name}</th><td>{text}</td></tr>" for name, text in lines.items())
        return f"<b>Model</b><table>{cells}</table>"


def _check_face(contact: Contact, bodies: Mapping[str, RigidBody], where: str) -> None:
    """Refuse a contact on a body that is not there, or one that says itself how its counterface moves."""
    if contact.rigid_body is None:
        return
    if contact.rigid_body not in bodies:
        raise InputError(
            f"{where}.rigid_body", f"got '{contact.rigid_body}'", f"the bodies are: {', '.join(bodies) or 'none'}"
        )
    for name in ("programme", "drive"):
        if getattr(contact, name) is not None:
            repair = f"give the motion of body '{contact.rigid_body}' in bodies.{contact.rigid_body}"
            raise InputError(f"{where}.{name}", "is given with rigid_body", "needs one of the two", repair)
