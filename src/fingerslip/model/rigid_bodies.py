"""Rigid bodies: what counterfaces are fixed to, with a mass where they are free to move.

A rigid body is prescribed in all directions but those in which it is free. In these it has inertia, and weight, loads,
springs and dampers to the ground, and contact act on it. The body turns about its centre, wherever that has moved: by
any angle about one axis; about several axes rotations are taken as small.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

import pydantic

from fingerslip.errors import InputError
from fingerslip.model.programme import CONSTANT, ProgrammeEntry, Ramp
from fingerslip.parameters import Force, Length, Mass, SignedSpeed, parameters
from fingerslip.units import Unit

Direction = Literal["x", "y", "z", "rx", "ry", "rz"]
#: All directions: translations along the axes, then rotations about them.
DIRECTIONS: tuple[Direction, ...] = ("x", "y", "z", "rx", "ry", "rz")

_Force = Annotated[Force, "Force [N]."]
_Velocity = Annotated[SignedSpeed, "Velocity of its centre [m/s]."]
_Moment = Annotated[float, Unit("N m"), "Moment about the centre [N m]."]
_AngularSpeed = Annotated[float, Unit("rad/s"), "Angular velocity [rad/s]."]
_Inertia = Annotated[float, Unit("kg m^2"), pydantic.Field(gt=0)]
_SpringStiffness = Annotated[float, Unit("N/m"), pydantic.Field(ge=0), "Stiffness along each axis [N/m]."]
_TorsionStiffness = Annotated[float, Unit("N m"), pydantic.Field(ge=0), "Stiffness about each axis [N m, per radian]."]
_DamperCoefficient = Annotated[float, Unit("N s/m"), pydantic.Field(ge=0), "Coefficient along each axis [N s/m]."]
_TorsionDamping = Annotated[
    float, Unit("N m s"), pydantic.Field(ge=0), "Coefficient about each axis [N m s, per radian]."
]


@parameters
class Springs:
    """Springs between a rigid body and the ground, without force at the start.

    See :class:`RigidBody`.
    """

    x: _SpringStiffness = 0.0
    y: _SpringStiffness = 0.0
    z: _SpringStiffness = 0.0
    rx: _TorsionStiffness = 0.0
    ry: _TorsionStiffness = 0.0
    rz: _TorsionStiffness = 0.0


@parameters
class Dampers:
    """Viscous dampers between a rigid body and the ground.

    See :class:`RigidBody`.
    """

    x: _DamperCoefficient = 0.0
    y: _DamperCoefficient = 0.0
    z: _DamperCoefficient = 0.0
    rx: _TorsionDamping = 0.0
    ry: _TorsionDamping = 0.0
    rz: _TorsionDamping = 0.0


@parameters
class BodyVelocity:
    """The velocity of a rigid body at the start, in its free directions.

    See :class:`RigidBody`.
    """

    x: _Velocity = 0.0
    y: _Velocity = 0.0
    z: _Velocity = 0.0
    rx: _AngularSpeed = 0.0
    ry: _AngularSpeed = 0.0
    rz: _AngularSpeed = 0.0


@parameters
class BodyLoad:
    """A force at the centre of a rigid body, and a moment, with a factor over time.

    See :class:`RigidBody`.
    """

    x: _Force = 0.0
    y: _Force = 0.0
    z: _Force = 0.0
    rx: _Moment = 0.0
    ry: _Moment = 0.0
    rz: _Moment = 0.0
    ramp: Annotated[Ramp, "Their factor over time; 1 without it."] = CONSTANT


@parameters
class RigidBody:
    """A rigid body that carries counterfaces, such as an object between two fingers.

    Examples
    --------
    A cup of 200 g that a spring carries, critically damped, and that a growing force pulls down:

    >>> import fingerslip as fs
    >>> cup = fs.RigidBody(
    ...     mass=0.2,
    ...     free=("y",),
    ...     springs=fs.Springs(y=80.0),
    ...     dampers=fs.Dampers(y=8.0),
    ...     loads=(fs.BodyLoad(y=-1.0, ramp=fs.Ramp(times=(0.1, 0.6), factors=(0.0, 1.0))),),
    ...     initial_velocity=fs.BodyVelocity(y=-5e-3),
    ... )
    >>> cup.damping("y") / (2.0 * (cup.stiffness("y") * cup.mass) ** 0.5)
    1.0
    """

    mass: Annotated[Mass, "Mass [kg]."]
    free: Annotated[
        tuple[Direction, ...],
        "Directions in which it is free: along axes, and about axes through its centre; in 2D 'x', 'y' and 'rz'. In "
        "all others it moves as its programme prescribes, or rests.",
    ] = ()
    centre: Annotated[
        tuple[Length, ...] | None,
        "The point about which it turns, at the start [m]: its centre of mass, where it is free along an axis, too. "
        "The body's weight acts there. Needed where it is free about an axis; without it the origin, for the moments "
        "that histories hold.",
    ] = None
    inertia: Annotated[
        tuple[_Inertia, ...],
        "Moments of inertia about axes through the centre [kg m^2]: in 3D about x, y and z, which have to be its "
        "principal axes, in 2D one value about z. Needed where it is free about an axis.",
    ] = ()
    filling: Annotated[
        Ramp,
        "Share of the mass whose weight acts, over time, such as that of a jug that is filled; 1 without it. Inertia "
        "is that of the whole mass at all times, so while a body is being filled, its acceleration is too small.",
    ] = CONSTANT
    loads: Annotated[tuple[BodyLoad, ...], "Forces and moments."] = ()
    springs: Annotated[Springs | None, "Springs to the ground."] = None
    dampers: Annotated[Dampers | None, "Dampers to the ground."] = None
    initial_velocity: Annotated[BodyVelocity | None, "Velocity at the start."] = None
    programme: Annotated[
        tuple[ProgrammeEntry, ...],
        "Motion in the directions that are not free. A press moves the body along the normal of the first counterface "
        "on it.",
    ] = ()

    def __post_init__(self) -> None:
        if len(set(self.free)) < len(self.free):
            raise InputError("free", f"got {', '.join(self.free)}", "needs each direction once")
        turning = [direction for direction in self.free if direction in DIRECTIONS[3:]]
        for name in ("centre", "inertia") if turning else ():
            if not getattr(self, name):
                raise InputError(name, "is missing", f"a body that is free about an axis ({turning[0]}) needs it")
        if min(self.filling.factors) < 0.0:
            raise InputError("filling", f"got {min(self.filling.factors):g}", "needs shares of the mass, 0 or more")
        for number, load in enumerate(self.loads):
            _check_free(f"loads.{number}", load, self.free)
        for name in ("springs", "dampers", "initial_velocity"):
            _check_free(name, getattr(self, name), self.free)

    def stiffness(self, direction: Direction) -> float:
        """Return the stiffness of the spring in a direction [N/m] or [N m]."""
        return _value(self.springs, direction)

    def damping(self, direction: Direction) -> float:
        """Return the coefficient of the damper in a direction [N s/m] or [N m s]."""
        return _value(self.dampers, direction)

    def velocity(self, direction: Direction) -> float:
        """Return the velocity at the start in a direction [m/s] or [rad/s]."""
        return _value(self.initial_velocity, direction)


def directions_in(dim: int) -> tuple[Direction, ...]:
    """Return the directions that there are in 2 or 3 dimensions."""
    return DIRECTIONS if dim == 3 else ("x", "y", "rz")


def _value(part: object, direction: Direction) -> float:
    """Return what a part of a body, None where it has none, says of a direction."""
    return 0.0 if part is None else float(getattr(part, direction))


def _check_free(where: str, part: object, free: Sequence[Direction]) -> None:
    """Refuse what acts in a direction in which the body is not free."""
    for direction in DIRECTIONS:
        if _value(part, direction) and direction not in free:
            fault, allowed = "acts where the body is not free", f"free is: {', '.join(free) or 'none'}"
            raise InputError(f"{where}.{direction}", fault, allowed, f"add {direction} to free, or leave it out")
