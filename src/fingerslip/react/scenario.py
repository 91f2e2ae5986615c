"""An object between a fingertip and its mirror image, or a plate.

By symmetry each fingertip holds half of it: a plate of half the mass that carries half the load along its surface, and
is pressed by the whole grip force. The plane between the halves rests; seen from it the fingertip moves. Here the
fingertip rests and the half object moves, so along the grip its inertia stands for that of the moving finger.

A plate has a whole object before it, and is pressed by the grip force: it bears what it can before the skin has to
shear. Two rigid faces that stick would not say which of them bears how much, so the plate's face is a slab of 1 GPa. It
lies on a rigid body that only moves along the grip, and sticks to that whatever the load is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
import pydantic

from fingerslip.contact.counterfaces import Plane
from fingerslip.contact.friction import Coulomb
from fingerslip.errors import InputError
from fingerslip.materials.elastic import Elastic, RayleighDamping
from fingerslip.mesh.source import MeshSource
from fingerslip.model.model import Contact, Model, Recording, ReducedBasis
from fingerslip.model.programme import Ramp
from fingerslip.model.rigid_bodies import BodyLoad, RigidBody
from fingerslip.model.timing import TimeStepping
from fingerslip.parameters import Duration, Force, Mass, NonNegativeNumber, PositiveDuration, PositiveLength, parameters
from fingerslip.react.loads import GRAVITY, LoadChoice, RampLoad
from fingerslip.react.reflex import PositiveForce
from fingerslip.specimens.protocol import Specimen

#: Name of the rigid body.
OBJECT = "object"
#: Name of the rigid body that presses.
PLATE = "plate"

_SLAB = Elastic(1e9, 0.3, 1000.0)
_HALF_WIDTH, _THICKNESS, _CELLS = 5e-3, 1e-3, 4  # [m] of the slab; cells along it
# Penetrations far below a micrometre under newtons [Pa/m], friction that no load exceeds, and a light body [kg].
_PENALTY, _STICKS, _MASS = 1e11, 100.0, 1e-3

_SETTLING_KNOTS = 41
# Nothing here reads accelerations.
_BASIS = ReducedBasis(acceleration_tolerance=0.1)
_LOAD = RampLoad(rate=4.0, force=2.0)
_DAMPING = RayleighDamping(stiffness=2e-3)
_SKIN = Contact("skin", search_distance=4e-3)
# Objects bring their own.
_TIME = TimeStepping(step=1e-3, end=1.0)


@parameters
class ObjectSettings:
    """An object that is held, apart from its friction and from steps."""

    load: Annotated[LoadChoice, "What comes on top of the weight."] = _LOAD
    mass: Annotated[Mass, "Mass of the object [kg]."] = 0.2
    margin: Annotated[NonNegativeNumber, "Grip force over the least that holds the weight, less one [-]."] = 0.45
    grip: Annotated[PositiveForce | None, "Grip force at first [N], in place of the margin."] = None
    weight: Annotated[
        Annotated[Force, pydantic.Field(ge=0)] | None,
        "Force along the faces at first [N]; without it the weight of the mass.",
    ] = None
    opposite: Annotated[
        Literal["mirror", "plate"],
        "What is on the other side: the mirror image of what holds it, or a flat plate with the same friction.",
    ] = "mirror"
    direction: Annotated[Literal[1, -1], "Whether weight and load act along +x or -x."] = 1
    travel_limit: Annotated[PositiveLength, "Travel from which the object is lost [m]."] = 10e-3
    settle: Annotated[PositiveDuration, "How long grip and weight take to rise [s]."] = 0.3
    rest: Annotated[Duration, "How long they rest before the load begins [s]."] = 0.05
    after: Annotated[PositiveDuration, "How long is looked at once the load no longer changes [s]."] = 0.5


@parameters
class HeldObject(ObjectSettings):
    """An object that is held by friction, and what happens to it.

    Grip and weight rise together, then rest, then the load begins: that is time zero of a reaction.

    Examples
    --------
    >>> import fingerslip as fs
    >>> held = fs.HeldObject(mass=0.2, friction=0.6, load=fs.RampLoad(rate=4.0, force=2.0))
    >>> f"{held.first_grip:.2f} N, slips {held.time_to_limit:.2f} s after the load begins"
    '2.37 N, slips 0.22 s after the load begins'
    """

    friction: Annotated[float, pydantic.Field(gt=0), "Friction coefficient of each of its two faces [-]."] = 0.6
    step: Annotated[PositiveDuration, "Time step [s]."] = 1e-3

    def __post_init__(self) -> None:
        least = self.first_load / (2.0 * self.friction)
        if self.first_grip <= least:
            allowed = f"needs more than {least:.4g} N to hold {self.first_load:.4g} N"
            raise InputError("grip", f"got {self.first_grip:.4g} N", allowed, "grip harder, or give a margin > 0")
        if self.settle + self.rest < 2.0 * self.step:
            raise InputError("step", f"got {self.step:g} s", "needs to be shorter than settle and rest")

    @property
    def first_load(self) -> float:
        """Force along the faces before the load begins [N]."""
        return self.mass * GRAVITY if self.weight is None else self.weight

    @property
    def first_grip(self) -> float:
        """Grip force at first [N]."""
        return (1.0 + self.margin) * self.first_load / (2.0 * self.friction) if self.grip is None else self.grip

    @property
    def gripped(self) -> str:
        """Name of the rigid body that the grip force acts on."""
        return OBJECT if self.opposite == "mirror" else PLATE

    @property
    def begins(self) -> float:
        """When the load begins, a whole number of steps from the start of the run [s]."""
        return round((self.settle + self.rest) / self.step) * self.step

    @property
    def duration(self) -> float:
        """From the start of the load to the end of the run, whole steps [s]."""
        return float(np.ceil((self.load.series()[0][-1] + self.after) / self.step - 1e-6)) * self.step

    @property
    def end(self) -> float:
        """End of the run [s]."""
        return self.begins + self.duration

    def total_load(self, time: float) -> float:
        """Return weight and load [N] at a time since the load began [s]."""
        return self.first_load + float(np.interp(time, *self.load.series()))

    @property
    def time_to_limit(self) -> float | None:
        """When the load exceeds what friction bears at the first grip [s]; None where it never does."""
        times, forces = map(np.asarray, self.load.series())
        excess = self.first_load + forces - 2.0 * self.friction * self.first_grip
        above = np.flatnonzero(excess > 0.0)
        if not above.size:
            return None
        last = int(above[0])
        # Before the first knot the weight alone acts, which the grip holds.
        return float(times[last - 1] - excess[last - 1] * np.diff(times)[last - 1] / np.diff(excess)[last - 1])


def holder_of(
    specimen: Specimen,
    mesh: MeshSource | None = None,
    *,
    contact: Contact = _SKIN,
    depth: float = 12e-3,
    groups: Sequence[str] = (),
) -> Model:
    """Return a specimen as what holds an object.

    Parameters
    ----------
    specimen : Fingertip or TacTip
        The specimen.
    mesh : MeshSource, optional
        Element sizes; without them those of the specimen.
    contact : Contact, optional
        What touches the object: `skin` of a fingertip, `contact` of a sensor, with its contact stiffness, and how far
        above the lowest point it may touch. The object brings its friction.
    depth : float, optional
        Width of the contact, out of the section [m]; assumed. Not of a specimen in 3D.
    groups : sequence of str, optional
        Groups of sites that are recorded, such as receptors of the kind FA-I.

    Returns
    -------
    Model
        The specimen, supported as it is itself. Any other model with one contact holds objects as well; its damping may
        have no part that is proportional to mass, which would brake the object.

    Examples
    --------
    >>> import fingerslip as fs
    >>> holder = fs.holder_of(fs.preset("wang2014-2d"), fs.MeshSizes(contact_size=0.15e-3, bulk_size=2e-3))
    >>> holder.supports, [contact.boundary for contact in holder.contacts]
    ({'phalanx': ('x', 'y')}, ['skin'])
    """
    body = (mesh or specimen.default_mesh).build(specimen)
    dim = int(body.dim())
    supports: Any = specimen.supports(dim)
    return Model(
        mesh=body,
        materials=specimen.materials,
        supports=supports,
        contacts=(contact,),
        formulation="solid" if dim == 3 else specimen.formulation,
        depth=1.0 if dim == 3 else depth,
        damping=_DAMPING,
        record=Recording(sites=specimen.sites(groups, dim)),
        basis=_BASIS,
        time=_TIME,
    )


def held_model(held: HeldObject, holder: Model) -> Model:
    """Return the model of one fingertip and its half of the object, or all of it and a plate.

    The object is a rigid body that is free along x and y.
    """
    if holder.damping.mass:
        fault = f"got {holder.damping.mass:g} 1/s"
        raise InputError("damping.mass", fault, "needs 0: it would brake the object", "damp by stiffness")
    # A model that holds an object already may hold another one.
    if len(holder.contacts) != 1 and PLATE not in holder.bodies:
        raise InputError("contacts", f"got {len(holder.contacts)}", "needs one, which touches the object")
    share, (times, forces) = 0.5 if held.opposite == "mirror" else 1.0, held.load.series()
    along = share * held.direction
    # Unit forces with newtons as factors: objects that differ in them alone share a reduced basis.
    grip = BodyLoad(y=1.0, ramp=_settling(held.settle, held.first_grip))
    loads = (
        BodyLoad(x=along, ramp=_settling(held.settle, held.first_load)),
        # What a series begins with is no part of the rest: it comes in the step before time zero.
        BodyLoad(x=along, ramp=Ramp(tuple(held.begins + time for time in (-held.step, *times)), (0.0, *forces))),
    )
    contact = replace(
        holder.contacts[0],
        counterface=Plane(normal=(0.0, 1.0, 0.0)[: holder.mesh.dim()]),
        friction=Coulomb(held.friction),
        rigid_body=OBJECT,
    )
    body = RigidBody(mass=share * held.mass, free=("x", "y"), loads=loads)
    time = replace(holder.time, step=held.step, end=held.end)  # type: ignore[type-var]
    model = replace(holder, contacts=(contact,), bodies={OBJECT: body}, time=time)
    if held.opposite == "plate":
        return _with_plate(model, grip)
    return replace(model, bodies={OBJECT: replace(body, loads=(grip, *loads))})


def _settling(duration: float, force: float) -> Ramp:
    """Return a rise from zero to a force [N] that hardly excites vibrations: half a cosine."""
    shares = np.linspace(0.0, 1.0, _SETTLING_KNOTS)
    return Ramp(tuple((duration * shares).tolist()), tuple((0.5 * force * (1.0 - np.cos(np.pi * shares))).tolist()))


def _with_plate(model: Model, grip: BodyLoad) -> Model:
    """Return a model with a plate behind the object, of the same friction, which a grip presses."""
    normal = (0.0, 1.0, 0.0)[: model.mesh.dim()]
    face = Contact(
        f"{PLATE}_face",
        Plane(tuple(-part for part in normal)),
        model.contacts[0].friction,
        normal_penalty=_PENALTY,
        tangential_penalty=_PENALTY,
        rigid_body=OBJECT,
    )
    back = replace(
        face, boundary=f"{PLATE}_back", counterface=Plane(normal), friction=Coulomb(_STICKS), rigid_body=PLATE
    )
    return replace(
        model,
        mesh=model.mesh if f"{PLATE}_slab" in model.mesh.subdomains else join_slab(model.mesh),
        materials={**model.materials, f"{PLATE}_slab": _SLAB},
        contacts=(*model.contacts, face, back),
        bodies={**model.bodies, PLATE: RigidBody(mass=_MASS, free=("y",), loads=(grip,))},
        # Supports do not hold the slab.
        basis=None,
    )


def join_slab(mesh: Any) -> Any:
    """Return a mesh with a slab under its lowest point: region `plate_slab`, boundaries `plate_face`, `plate_back`.

    The names of the mesh stay.
    """
    # Slow to load.
    from fingerslip.mesh.joining import STRAIGHT, join_meshes

    kind, lowest = type(mesh), mesh.p[:, np.argmin(mesh.p[1])]
    along = np.linspace(-_HALF_WIDTH, _HALF_WIDTH, _CELLS + 1)
    # A half that is cut at z = 0 has a half of the slab.
    across = along if mesh.dim() == 3 and mesh.p[2].min() < -1e-9 else along[_CELLS // 2 :]
    axes = (along, np.array([-_THICKNESS, 0.0]), across)[: mesh.dim()]
    slab = STRAIGHT.get(kind, kind).init_tensor(*axes)
    # Its mirror image has the same shape, and corners that turn the other way.
    middle, first = np.full((mesh.dim(), 1), 0.25), np.array([0])
    if slab.mapping().detDF(middle, tind=first)[0, 0] * mesh.mapping().detDF(middle, tind=first)[0, 0] < 0.0:
        slab = replace(slab, doflocs=slab.doflocs * np.array([-1.0, 1.0, 1.0])[: mesh.dim(), None])
    shift = np.array([lowest[0], lowest[1], 0.0][: mesh.dim()])
    slab = slab.translated(tuple(shift.tolist()))
    if kind is not type(slab):
        slab = kind.from_mesh(slab)
    top = float(slab.p[1].max())
    faces = {
        "face": slab.facets_satisfying(lambda at: at[1] > top - 0.1 * _THICKNESS, boundaries_only=True),
        "back": slab.facets_satisfying(lambda at: at[1] < top - 0.9 * _THICKNESS, boundaries_only=True),
    }
    slab = slab.with_subdomains({"slab": np.arange(slab.nelements)}).with_boundaries(faces)
    joined = join_meshes({"body": mesh, PLATE: slab})
    regions, boundaries = (
        {name.removeprefix("body_"): members for name, members in table.items()}
        for table in (joined.subdomains, joined.boundaries)
    )
    return replace(joined, _subdomains=regions, _boundaries=boundaries)


def travel_after(
    mass: float, latency: float, limit_rate: float, *, excess: float = 0.0, load_rate: float = 0.0
) -> float:
    """Return the travel [m] of an object whose load exceeds the slip limit, and that a growing grip stops.

    Two pads press an object of mass m; friction bears the limit 2 mu N. The load exceeds it by e at once, and grows on
    at the rate rho. After the latency tau the limit grows at R = 2 mu dN/dt; from then on, with q = R - rho, ::

        v0 = (e tau + rho tau^2 / 2) / m,    m dv/ds = e + rho tau - q s,    v(s) = 0

    Parameters
    ----------
    mass : float
        Mass of the object [kg].
    latency : float
        Time from when the load reaches the limit to the growth of the grip [s].
    limit_rate : float
        Rate at which the limit grows after the latency [N/s].
    excess : float, optional
        Load less the limit after a step of the load [N].
    load_rate : float, optional
        Rate at which the load grows on [N/s].

    Returns
    -------
    float
        The travel; infinite where the limit does not grow faster than the load.

    Examples
    --------
    >>> import fingerslip as fs
    >>> [f"{1e3 * fs.travel_after(0.2, latency, 20.0, excess=0.5):.2f} mm" for latency in (74e-3, 20e-3)]
    ['21.47 mm', '4.45 mm']
    >>> [f"{1e3 * fs.travel_after(0.2, latency, 20.0, load_rate=4.0):.3f} mm" for latency in (74e-3, 20e-3)]
    ['4.420 mm', '0.087 mm']
    """
    relief, force = limit_rate - load_rate, excess + load_rate * latency
    if relief <= 0.0:
        return math.inf
    speed = (excess * latency + load_rate * latency**2 / 2.0) / mass
    before = (excess * latency**2 / 2.0 + load_rate * latency**3 / 6.0) / mass
    duration = (force + math.sqrt(force**2 + 2.0 * relief * mass * speed)) / relief
    return before + speed * duration + (force * duration**2 / 2.0 - relief * duration**3 / 6.0) / mass
