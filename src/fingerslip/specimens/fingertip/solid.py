"""What a fingertip in space has beyond its two sections: widths along the finger, the nail, the angle to the plate."""

from __future__ import annotations

from fingerslip.errors import InputError
from fingerslip.parameters import Angle, Length, PositiveLength, parameters
from fingerslip.units import millimetres

__all__ = ["Nail", "SolidPhalanx", "SolidShape"]


@parameters
class SolidPhalanx:
    """Widths of the distal phalanx along the finger.

    They are joined by a smooth monotone curve: the base at the proximal cut, the waist, the tuft at the lowest point
    of the skin, where the half width is that of the transverse section, and the flat distal end. A `scaled` phalanx
    has none of these widths.

    Parameters
    ----------
    base_half_width : float
        Half width at the proximal cut [m].
    waist_half_width : float
        Half width at the narrowest place [m].
    waist_position : float
        Position x of the waist [m].
    end_half_width : float
        Half width of the distal end [m].
    """

    base_half_width: PositiveLength
    waist_half_width: PositiveLength
    waist_position: Length
    end_half_width: PositiveLength


@parameters
class Nail:
    """The nail: the outermost part of the dorsal skin.

    Parameters
    ----------
    start, end : float
        Positions x of its proximal and its distal edge [m].
    half_width : float
        Half its width across the finger [m].
    thickness : float
        Thickness [m].
    """

    start: Length
    end: Length
    half_width: PositiveLength
    thickness: PositiveLength

    def __post_init__(self) -> None:
        if self.end <= self.start:
            allowed = f"needs a value > {millimetres(self.start)} (start)"
            raise InputError("end", f"got {millimetres(self.end)}", allowed)


@parameters
class SolidShape:
    """What the fingertip in space has beyond its sections.

    Parameters
    ----------
    base_half_width : float
        Half width of the finger at the proximal cut [m]; at the lowest point it is that of the transverse outline.
    angle : float
        Angle by which the finger is turned about z [rad], positive where the tip rises from the plate.
    phalanx : SolidPhalanx
        Widths of the phalanx along the finger.
    nail : Nail, optional
        The nail; none without it.
    """

    base_half_width: PositiveLength
    angle: Angle
    phalanx: SolidPhalanx
    nail: Nail | None = None

    def __post_init__(self) -> None:
        # Beyond this the proximal cut, not the pad, would come down on the plate.
        if not -0.6 <= self.angle <= 0.6:
            raise InputError("angle", f"got {self.angle:.4g} rad", "needs a value within +-0.6 rad")
