"""The model: all that a simulation needs, as data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

import pydantic

from fingerslip.contact.bodies import Plane
from fingerslip.contact.friction import Coulomb
from fingerslip.errors import InputError
from fingerslip.materials import Elastic, RayleighDamping
from fingerslip.mesh.sites import Site
from fingerslip.parameters import (
    Duration,
    PositiveDuration,
    PositiveLength,
    Speed,
    Stiffness,
    parameters,
)

__all__ = ["Contact", "Hold", "Lift", "Model", "Phase", "Press", "Recording", "Slide", "TimeStepping", "phase_duration"]

Component = Literal["x", "y", "z"]
Formulation = Literal["plane_strain", "plane_stress", "solid"]


@parameters
class Contact:
    """Unilateral frictional contact of a boundary with a rigid body.

    Parameters
    ----------
    boundary : str
        Named boundary of the mesh that may touch the body.
    body : Plane
        The rigid counter-surface.
    friction : Coulomb
        The friction law.
    normal_penalty, tangential_penalty : float, optional
        Contact stiffness per area [Pa/m]; without them they follow from the layer under the boundary
        and the size of its facets.
    reach : float, optional
        Nodes with an initial gap beyond this are no contact candidates [m]; without it one and a half times
        the way that the body comes forward.
    """

    boundary: str
    body: Plane = Plane()
    friction: Coulomb = Coulomb(0.0)
    normal_penalty: Stiffness | None = None
    tangential_penalty: Stiffness | None = None
    reach: PositiveLength | None = None


@parameters
class Press:
    """Move the rigid bodies along their outward normals, towards the deformable body.

    Parameters
    ----------
    depth : float
        Way to go [m].
    speed : float
        Speed [m/s].
    """

    depth: PositiveLength
    speed: Speed


@parameters
class Lift:
    """Move the rigid bodies along their normals, away from the deformable body.

    Parameters
    ----------
    distance : float
        Way to go [m].
    speed : float
        Speed [m/s].
    """

    distance: PositiveLength
    speed: Speed


@parameters
class Hold:
    """Keep the rigid bodies where they are.

    Parameters
    ----------
    duration : float
        Time to wait [s].
    """

    duration: PositiveDuration


@parameters
class Slide:
    """Move the rigid bodies along their surfaces.

    Parameters
    ----------
    distance : float
        Way to go [m].
    speed : float
        Speed [m/s].
    direction : tuple of float, optional
        Direction of the body's motion, of any length; its part along the normal is left out.
        Without it the body moves along its tangent, +x for a plate below the finger.
    """

    distance: PositiveLength
    speed: Speed
    direction: tuple[float, ...] | None = None


Phase = Press | Hold | Slide | Lift


def phase_duration(phase: Phase) -> float:
    """Return how long a phase lasts [s]."""
    match phase:
        case Press():
            return phase.depth / phase.speed
        case Slide() | Lift():
            return phase.distance / phase.speed
        case Hold():
            return phase.duration


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
        End of the simulation [s]; without it the end of the programme.
    """

    step: PositiveDuration
    alpha: Annotated[float, pydantic.Field(ge=-0.5, le=0.0)] = -0.05
    end: PositiveDuration | None = None


@parameters
class Recording:
    """What is recorded beside the contact nodes, forces and energies.

    Parameters
    ----------
    sites : tuple of Site
        Places at which displacement, velocity, acceleration, stress and strain energy density are recorded.
    snapshots_every : float
        Time between snapshots of the whole mesh [s]; 0 for none.
    """

    sites: tuple[Site, ...] = ()
    snapshots_every: Duration = 0.0


@parameters
class Model:
    """A deformable body, what holds it, what touches it, and how the motion is computed.

    Parameters
    ----------
    mesh : skfem.Mesh
        Mesh with named subdomains (regions) and boundaries: quadrilaterals (Q4), linear (T3) or quadratic
        triangles (T6) [m].
    materials : mapping of str to Elastic
        The material of every region.
    formulation : {'plane_strain', 'plane_stress'}
        The two-dimensional assumption.
    depth : float
        Out-of-plane depth [m], so that forces are newtons.
    supports : mapping of str to tuple of {'x', 'y'}
        Boundaries, or whole regions, that are fixed, and in which components.
    tractions : mapping of str to tuple of float
        Dead loads on boundaries [Pa], from the start on.
    contacts : tuple of Contact
        What may touch.
    programme : tuple of Press, Hold, Slide or Lift
        The motion of the rigid bodies, phase after phase.
    time : TimeStepping
        Step and numerical damping.
    damping : RayleighDamping
        Material damping.
    integration : {'selective', 'full', 'nodal'}
        How the dilatational part is integrated: 'selective' at the centre of quadrilaterals and hexahedra,
        which then do not lock near incompressibility; 'full' everywhere; 'nodal' from the mean around each
        node, for linear triangles and tetrahedra that do not lock.
    record : Recording
        What the history holds.
    """

    mesh: Any
    materials: Mapping[str, Elastic]
    formulation: Formulation
    time: TimeStepping
    depth: PositiveLength = 1.0
    supports: Mapping[str, tuple[Component, ...]] = pydantic.Field(default_factory=dict)
    tractions: Mapping[str, tuple[float, ...]] = pydantic.Field(default_factory=dict)
    contacts: tuple[Contact, ...] = ()
    programme: tuple[Phase, ...] = ()
    damping: RayleighDamping = RayleighDamping()
    integration: Literal["selective", "full", "nodal"] = "selective"
    record: Recording = Recording()

    def __post_init__(self) -> None:
        if not self.programme and self.time.end is None:
            raise InputError("time.end", "is missing, and there is no programme", "needs one of the two")

    @property
    def end(self) -> float:
        """End of the simulation [s]."""
        return self.time.end or sum(phase_duration(phase) for phase in self.programme)
