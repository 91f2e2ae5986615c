"""An object between a fingertip and its mirror image.

By symmetry each fingertip holds half of it: a plate of half the mass that carries half the load along its surface, and
is pressed by the whole grip force. The plane between the halves rests; seen from it the fingertip moves. Here the
fingertip rests and the half object moves, so along the grip its inertia stands for that of the moving finger.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
import pydantic

from fingerslip.contact.counterfaces import Plane
from fingerslip.contact.friction import Coulomb
from fingerslip.errors import InputError
from fingerslip.materials.choice import AnyMaterial
from fingerslip.materials.elastic import RayleighDamping
from fingerslip.materials.material import Formulation
from fingerslip.mesh.source import MeshSource
from fingerslip.model.model import Component, Contact, Model, Recording, ReducedBasis
from fingerslip.model.programme import Ramp
from fingerslip.model.rigid_bodies import BodyLoad, RigidBody
from fingerslip.model.timing import TimeStepping
from fingerslip.parameters import Duration, Force, Mass, NonNegativeNumber, PositiveDuration, PositiveLength, parameters
from fingerslip.react.loads import GRAVITY, LoadChoice, RampLoad, load_ramp
from fingerslip.sites import Site
from fingerslip.specimens.protocol import Specimen

__all__ = ["OBJECT", "HeldObject", "Holder", "held_model", "holder_of"]

#: Name of the rigid body.
OBJECT = "object"

_SETTLING_KNOTS = 41
# Nothing here reads accelerations.
_BASIS = ReducedBasis(acceleration_tolerance=0.1)
_LOAD = RampLoad(rate=4.0, force=2.0)
_MESH_DAMPING = RayleighDamping(stiffness=2e-3)


@parameters
class HeldObject:
    """An object that is held by friction, and what happens to it.

    Grip and weight rise together, then rest, then the load begins: that is time zero of a reaction.

    Parameters
    ----------
    mass : float
        Mass of the object [kg].
    friction : float
        Friction coefficient of each of its two faces [-].
    load : StepLoad, RampLoad, DroppedBall or LoadSeries
        What comes on top of the weight.
    margin : float
        Grip force over the least that holds the weight, less one [-].
    grip : float, optional
        Grip force at first [N], in place of the margin.
    weight : float, optional
        Force along the faces at first [N]; without it the weight of the mass.
    direction : {1, -1}
        Whether weight and load act along +x or -x.
    travel_limit : float
        Travel from which the object is lost [m].
    settle : float
        How long grip and weight take to rise [s].
    rest : float
        How long they rest before the load begins [s].
    after : float
        How long is looked at once the load no longer changes [s].
    step : float
        Time step [s].

    Examples
    --------
    >>> held = HeldObject(mass=0.2, friction=0.6, load=RampLoad(rate=4.0, force=2.0))
    >>> f"{held.first_grip:.2f} N, slips {held.time_to_limit:.2f} s after the load begins"
    '2.37 N, slips 0.22 s after the load begins'
    """

    load: LoadChoice = _LOAD
    mass: Mass = 0.2
    friction: Annotated[float, pydantic.Field(gt=0)] = 0.6
    margin: NonNegativeNumber = 0.45
    grip: Annotated[Force, pydantic.Field(gt=0)] | None = None
    weight: Annotated[Force, pydantic.Field(ge=0)] | None = None
    direction: Literal[1, -1] = 1
    travel_limit: PositiveLength = 10e-3
    settle: PositiveDuration = 0.3
    rest: Duration = 0.05
    after: PositiveDuration = 0.5
    step: PositiveDuration = 1e-3

    def __post_init__(self) -> None:
        least = self.first_load / (2.0 * self.friction)
        if self.first_grip <= least:
            fault, allowed = (
                f"got {self.first_grip:.4g} N",
                f"needs more than {least:.4g} N to hold {self.first_load:.4g} N",
            )
            raise InputError("grip", fault, allowed, "grip harder, or give a margin > 0")
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
    def begins(self) -> float:
        """When the load begins, a whole number of steps from the start of the run [s]."""
        return round((self.settle + self.rest) / self.step) * self.step

    @property
    def duration(self) -> float:
        """From the start of the load to the end of the run, whole steps [s]."""
        return float(np.ceil((self.load.series()[0][-1] + self.after) / self.step - 1e-6)) * self.step

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


@dataclass(frozen=True)
class Holder:
    """One of the two fingertips, or any other body that holds an object from above.

    Parameters
    ----------
    mesh : skfem.Mesh
        Its mesh [m], in 2D; the object touches it from below.
    materials : mapping of str to Material
        The material of every region.
    supports : mapping of str to tuple of {'x', 'y'}
        What is fixed.
    boundary : str
        What touches the object.
    formulation : {'plane_strain', 'plane_stress'}
        The two-dimensional assumption.
    depth : float
        Out-of-plane depth [m].
    damping : RayleighDamping
        Material damping; a part that is proportional to mass would brake the object, too.
    search_distance : float
        How far above the lowest point it may touch the object [m].
    normal_penalty, tangential_penalty : float, optional
        Contact stiffness per area [Pa/m].
    sites : tuple of Site
        Points at which signals are recorded, for detectors.
    """

    mesh: Any
    materials: Mapping[str, AnyMaterial]
    supports: Mapping[str, tuple[Component, ...]]
    boundary: str
    formulation: Formulation = "plane_strain"
    depth: float = 12e-3
    damping: RayleighDamping = _MESH_DAMPING
    search_distance: float = 4e-3
    normal_penalty: float | None = None
    tangential_penalty: float | None = None
    sites: tuple[Site, ...] = ()

    def __post_init__(self) -> None:
        if self.damping.mass:
            fault = f"got {self.damping.mass:g} 1/s"
            raise InputError("damping.mass", fault, "needs 0: it would brake the object", "damp by stiffness")


def holder_of(
    specimen: Specimen,
    mesh: MeshSource | None = None,
    *,
    boundary: str = "skin",
    depth: float = 12e-3,
    groups: Sequence[str] = (),
) -> Holder:
    """Return the section of a specimen as what holds an object.

    Parameters
    ----------
    specimen : Fingertip or TacTip
        The specimen.
    mesh : MeshSizes or SensorSectionSizes, optional
        Element sizes of its section; without it those of the specimen.
    boundary : str, optional
        What touches the object: `skin` of a fingertip, `contact` of a sensor.
    depth : float, optional
        Width of the contact, out of the section [m]; assumed.
    groups : sequence of str, optional
        Groups of sites that are recorded, such as receptors of the kind FA-I.

    Returns
    -------
    Holder
        The section, held as the specimen is.
    """
    supports: Any = specimen.supports(2)
    return Holder(
        mesh=(mesh or specimen.default_mesh).build(specimen),
        materials=specimen.materials,
        supports=supports,
        boundary=boundary,
        formulation=specimen.formulation,
        depth=depth,
        sites=specimen.sites(groups, 2),
    )


def held_model(held: HeldObject, holder: Holder) -> Model:
    """Return the model of one fingertip and its half of the object, a rigid body that is free along x and y."""
    along = 0.5 * held.direction
    # Unit forces with newtons as factors: objects that differ in them alone share a reduced basis.
    loads = (
        BodyLoad(y=1.0, ramp=_settling(held.settle, held.first_grip)),
        BodyLoad(x=along, ramp=_settling(held.settle, held.first_load)),
        BodyLoad(x=along, ramp=load_ramp(held.load, held.begins)),
    )
    body = RigidBody(mass=0.5 * held.mass, free=("x", "y"), loads=loads)
    contact = Contact(
        holder.boundary,
        Plane(normal=(0.0, 1.0)),
        Coulomb(held.friction),
        rigid_body=OBJECT,
        search_distance=holder.search_distance,
        normal_penalty=holder.normal_penalty,
        tangential_penalty=holder.tangential_penalty,
    )
    return Model(
        mesh=holder.mesh,
        materials=holder.materials,
        formulation=holder.formulation,
        depth=holder.depth,
        supports=holder.supports,
        contacts=(contact,),
        bodies={OBJECT: body},
        damping=holder.damping,
        time=TimeStepping(step=held.step, end=held.begins + held.duration),
        record=Recording(sites=holder.sites),
        basis=_BASIS,
    )


def _settling(duration: float, force: float) -> Ramp:
    """Return a rise from zero to a force [N] that hardly excites vibrations: half a cosine."""
    shares = np.linspace(0.0, 1.0, _SETTLING_KNOTS)
    return Ramp(tuple((duration * shares).tolist()), tuple((0.5 * force * (1.0 - np.cos(np.pi * shares))).tolist()))
