"""The programme: how counterfaces move, one phase after the other."""

from __future__ import annotations

from fingerslip.parameters import PositiveDuration, PositiveLength, SignedLength, Speed, parameters

__all__ = ["Hold", "Lift", "Phase", "Press", "Slide", "phase_duration", "phase_travel"]


@parameters
class Press:
    """Move the counterfaces along their outward normals, towards the deformable body.

    Parameters
    ----------
    depth : float
        Travel [m].
    speed : float
        Speed [m/s].
    """

    depth: PositiveLength
    speed: Speed


@parameters
class Lift:
    """Move the counterfaces along their normals, away from the deformable body.

    Parameters
    ----------
    distance : float
        Travel [m].
    speed : float
        Speed [m/s].
    """

    distance: PositiveLength
    speed: Speed


@parameters
class Hold:
    """Keep the counterfaces where they are.

    Parameters
    ----------
    duration : float
        Duration [s].
    """

    duration: PositiveDuration


@parameters
class Slide:
    """Move the counterfaces along their surfaces.

    Parameters
    ----------
    distance : float
        Travel [m].
    speed : float
        Speed [m/s].
    direction : tuple of float, optional
        Direction of the counterface's motion, of any length [-]; its part along the normal is left out.
        Without it the counterface moves along its tangent, +x for a plate below the body.
    press : float
        Travel along the normals, towards the body, at the same time [m]; negative away from it.
    """

    distance: PositiveLength
    speed: Speed
    direction: tuple[float, ...] | None = None
    press: SignedLength = 0.0


Phase = Press | Hold | Slide | Lift


def phase_travel(phase: Phase) -> float:
    """Return how far counterfaces move in a phase [m]."""
    match phase:
        case Press():
            return phase.depth
        case Slide() | Lift():
            return phase.distance
        case Hold():
            return 0.0


def phase_duration(phase: Phase) -> float:
    """Return how long a phase lasts [s]."""
    return phase.duration if isinstance(phase, Hold) else phase_travel(phase) / phase.speed
