"""The model: everything that a simulation needs, as data."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Literal, Protocol

import numpy as np
import pydantic

from fingerslip.contact.counterfaces import Counterface, Plane
from fingerslip.contact.friction import Coulomb, FrictionLaw
from fingerslip.errors import InputError
from fingerslip.fe.integration import Integration
from fingerslip.materials.damping import RayleighDamping
from fingerslip.materials.material import Formulation, Material
from fingerslip.parameters import (
    Duration,
    Force,
    Mass,
    NonNegativeLength,
    Number,
    PositiveDuration,
    PositiveLength,
    SignedLength,
    SignedPressure,
    Stiffness,
    parameters,
)
from fingerslip.parameters.protocols import conforms, describe
from fingerslip.programme import Phase, phase_duration
from fingerslip.sites import Site

__all__ = [
    "Contact",
    "Drive",
    "Model",
    "QuasiStatic",
    "Ramp",
    "Recording",
    "ReducedBasis",
    "SupportMotion",
    "TimeStepping",
    "Timing",
    "Traction",
]

Component = Literal["x", "y", "z"]
NumericalDamping = Annotated[Number, pydantic.Field(ge=-0.5, le=0.0)]
Tolerance = Annotated[Number, pydantic.Field(gt=0.0, lt=1.0)]

_A_COUNTERFACE = pydantic.PlainValidator(conforms(Counterface, "a counterface, such as Plane, Cylinder or Sphere"))
_A_LAW = pydantic.PlainValidator(conforms(FrictionLaw, "a friction law, such as Coulomb(0.5)"))


@parameters
class Ramp:
    """A factor over time: linear between given times, constant before the first and after the last.

    Parameters
    ----------
    times : tuple of float
        Ascending times [s].
    factors : tuple of float
        The factor at each [-].
    """

    times: tuple[Duration, ...]
    factors: tuple[float, ...]

    def __post_init__(self) -> None:
        ascending = all(early < late for early, late in pairwise(self.times))
        if not self.times or len(self.times) != len(self.factors) or not ascending:
            raise InputError(
                "times", f"got {self.times} and {self.factors}", "needs ascending times, a factor for each"
            )

    def at(self, time: float) -> float:
        """Return the factor at a time [s]."""
        return float(np.interp(time, self.times, self.factors))


@parameters
class Traction:
    """A dead load per area that changes over time.

    Parameters
    ----------
    value : tuple of float
        Traction [Pa], one value per component.
    ramp : Ramp
        Its factor over time.
    """

    value: tuple[SignedPressure, ...]
    ramp: Ramp


@parameters
class SupportMotion:
    """The prescribed motion of a support: a displacement that grows and falls with a factor over time.

    Parameters
    ----------
    displacement : tuple of float
        Displacement at factor one [m], one value per component; 0 in those that the support leaves free.
    ramp : Ramp
        Its factor over time, 0 at the start.
    """

    displacement: tuple[SignedLength, ...]
    ramp: Ramp

    def __post_init__(self) -> None:
        if self.ramp.at(0.0):
            found = f"starts from a factor of {self.ramp.at(0.0):g}"
            raise InputError("ramp", found, "needs 0 at the start", "write 0 s and a factor of 0 first")

    @property
    def largest(self) -> float:
        """The largest displacement [m]."""
        return float(np.linalg.norm(self.displacement) * np.abs(self.ramp.factors).max())


@parameters
class Drive:
    """A force on a counterface of its own mass, along the counterface's normal.

    Parameters
    ----------
    mass : float
        Mass of the counterface [kg].
    force : float
        Force along its normal, towards the deformable body [N].
    ramp : Ramp, optional
        Factor of the force over time; 1 without it.
    """

    mass: Mass
    force: Force
    ramp: Ramp = Ramp((0.0,), (1.0,))


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
        the approach of the counterface (in space 1.25 times, as long as this is enough), and unlimited
        where loads may bring the body to it.
    programme : tuple of Press, Hold, Slide or Lift, optional
        The counterface's own motion; without it the model's programme.
    drive : Drive, optional
        A force that moves the counterface along its normal, on top of the prescribed motion.
    clearance : float
        Gap that is left at the start, along the normal, by a counterface whose start is not given [m]; the first
        part of a press closes it.
    """

    RENAMED: ClassVar[Mapping[str, str]] = MappingProxyType({"body": "counterface", "reach": "search_distance"})

    boundary: str
    counterface: Annotated[Counterface, _A_COUNTERFACE] = Plane()
    friction: Annotated[FrictionLaw, _A_LAW] = Coulomb(0.0)
    normal_penalty: Stiffness | None = None
    tangential_penalty: Stiffness | None = None
    search_distance: PositiveLength | None = None
    programme: tuple[Phase, ...] | None = None
    drive: Drive | None = None
    clearance: NonNegativeLength = 0.0


class Timing(Protocol):
    """What a model needs to know of its time integration."""

    @property
    def step(self) -> float:
        """Time step [s]."""

    @property
    def end(self) -> float | None:
        """End of the simulation [s]; None for the end of the programme."""


_A_TIMING = pydantic.PlainValidator(conforms(Timing, "the time integration: TimeStepping or QuasiStatic"))


@parameters
class TimeStepping:
    """HHT-alpha time integration at a fixed step.

    Parameters
    ----------
    step : float
        Time step [s].
    alpha : float
        Numerical damping, from -1/2 to 0; 0 is the trapezoidal rule.
    end : float, optional
        End of the simulation [s], a multiple of the step; without it the end of the programme.
    """

    step: PositiveDuration
    alpha: NumericalDamping = -0.05
    end: PositiveDuration | None = None


@parameters
class QuasiStatic:
    """Steps without inertia: every step is in equilibrium.

    Supports or contact have to hold the body, and no counterface may be driven by a force.

    Parameters
    ----------
    step : float
        Time step [s].
    end : float, optional
        End of the simulation [s], a multiple of the step; without it the end of the programme.
    """

    step: PositiveDuration
    end: PositiveDuration | None = None


@parameters
class ReducedBasis:
    """A reduced basis in place of the mesh: static responses of contact and sites, exactly, and a few vibrations.

    The lowest vibrations are taken, as many as the tolerance needs. Where they do not suffice, the motion is computed
    on the mesh. See docs/theory.md.

    Parameters
    ----------
    tolerance : float
        Largest error that the vibrations left out may leave in the displacement, estimated during the motion, over the
        largest displacement.
    acceleration_tolerance : float
        The same of accelerations, in the root of the mean square over the body.
    """

    tolerance: Tolerance = 1e-4
    acceleration_tolerance: Tolerance = 5e-3


@parameters
class Recording:
    """What is recorded beside the contact nodes, forces and energies.

    Parameters
    ----------
    sites : tuple of Site
        Points at which displacement, velocity, acceleration, stress and strain energy density are recorded.
    snapshots_every : float
        Time between snapshots of the whole mesh [s]; 0 for none.
    """

    sites: tuple[Site, ...] = ()
    snapshots_every: Duration = 0.0


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
        triangles (T6), hexahedra (H8), linear (T4) or quadratic tetrahedra (T10).
    materials : mapping of str to Material
        The material of every region: :class:`~fingerslip.materials.elastic.Elastic`, or a law of one's own that
        answers :class:`~fingerslip.materials.material.Material`.
    formulation : {'plane_strain', 'plane_stress', 'solid'}
        The two-dimensional assumption, or 'solid' in space.
    depth : float
        Out-of-plane depth [m], so that forces are newtons; not in space.
    supports : mapping of str to tuple of {'x', 'y', 'z'}
        Boundaries, or whole regions, that are fixed, and in which components.
    support_motions : mapping of str to SupportMotion
        Supports that move as prescribed, by name.
    tractions : mapping of str to tuple of float or Traction
        Dead loads on boundaries [Pa], constant from the start on or changing over time.
    contacts : tuple of Contact
        Boundaries of the body with the counterfaces that they may touch.
    programme : tuple of Press, Hold, Slide or Lift
        The motion of all counterfaces without a programme of their own, phase after phase.
    time : TimeStepping or QuasiStatic
        Time integration and its step, or any object with a `step`, an `end` and the members of
        :class:`~fingerslip.dynamics.scheme.Scheme`.
    damping : RayleighDamping
        Material damping.
    integration : {'selective', 'full', 'nodal'}
        How the dilatational part is integrated: 'selective' at the centre of quadrilaterals and hexahedra,
        which then do not lock near incompressibility; 'full' everywhere; 'nodal' from the mean around each
        node, for linear triangles and tetrahedra that do not lock.
    record : Recording
        What is recorded.
    basis : ReducedBasis, optional
        The reduced basis in which the motion is computed; without it on the mesh.
    gravity : tuple of float, optional
        Acceleration of gravity on the deformable body [m/s^2], one value per component.
    initial_velocity : tuple of float, optional
        Velocity of the whole body at the start [m/s], except where it is supported.
    """

    mesh: Annotated[Any, pydantic.AfterValidator(_check_mesh)]
    materials: Mapping[str, Material]
    formulation: Formulation
    time: Annotated[Timing, _A_TIMING]
    depth: PositiveLength = 1.0
    supports: Mapping[str, tuple[Component, ...]] = pydantic.Field(default_factory=dict)
    support_motions: Mapping[str, SupportMotion] = pydantic.Field(default_factory=dict)
    tractions: Mapping[str, tuple[float, ...] | Traction] = pydantic.Field(default_factory=dict)
    contacts: tuple[Contact, ...] = ()
    programme: tuple[Phase, ...] = ()
    damping: RayleighDamping = RayleighDamping()
    integration: Integration = "selective"
    record: Recording = Recording()
    basis: ReducedBasis | None = None
    gravity: tuple[float, ...] | None = None
    initial_velocity: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if self.formulation == "solid" and self.depth != 1.0:
            raise InputError("depth", f"got {self.depth:g} m for a solid", "may be given in two dimensions only")
        if not any(self.programmes) and self.time.end is None:
            raise InputError("time.end", "is missing, and there is no programme", "needs one of the two")

    @property
    def end(self) -> float:
        """End of the simulation [s]."""
        return self.time.end or max(sum(map(phase_duration, programme)) for programme in self.programmes)

    @property
    def programmes(self) -> tuple[tuple[Phase, ...], ...]:
        """The programme of every contact, its own or the model's; the model's where there is no contact."""
        own = (contact.programme for contact in self.contacts)
        return tuple(self.programme if one is None else one for one in own) or (self.programme,)

    @property
    def is_loaded(self) -> bool:
        """Whether anything but prescribed motion of counterfaces may bring the body into contact."""
        driven = any(contact.drive for contact in self.contacts)
        return bool(self.tractions or driven or self.gravity or self.initial_velocity or self.support_motions)
