"""The parts of a fingertip as numbers: outlines, layers, ridges, fingerprint, receptors."""

from __future__ import annotations

from fingerslip.errors import InputError
from fingerslip.parameters import Angle, Length, NonNegativeLength, PositiveLength, parameters
from fingerslip.units import millimetres

__all__ = ["Fingerprint", "Layers", "Receptors", "RidgeZone", "Ridges", "SagittalOutline", "TransverseOutline"]

_LONGEST = 1.0  # m


@parameters
class RidgeZone:
    """The part of the palmar skin that carries ridges, fingerprint and receptors.

    Parameters
    ----------
    start, end : float
        Arc length along the skin from its lowest point [m], `end` towards +x.
    fade : float
        Length over which ridges and ripples fade to nothing inside either end [m].
    """

    start: Length
    end: Length
    fade: PositiveLength

    def __post_init__(self) -> None:
        if self.end - self.start <= 2 * self.fade:
            found = f"zone from {millimetres(self.start)} to {millimetres(self.end)} with fade {millimetres(self.fade)}"
            raise InputError("", found, "needs end - start > 2 fade")


@parameters
class SagittalOutline:
    """Outline of the section along the finger: parabolic pad, elliptic tip, straight back.

    The lowest point is at x = 0, y = -`half_height`; the proximal cut at x = -`pad_length`.

    Parameters
    ----------
    half_height : float
        Half the height of the fingertip at x = 0 [m].
    pad_length : float
        Distance from the lowest point to the proximal cut [m].
    pad_rise : float
        Rise of the palmar skin from the lowest point to the cut [m].
    tip_length : float
        Length of the elliptic tip [m].
    zone : RidgeZone
        Where ridges, fingerprint and receptors are.
    """

    half_height: PositiveLength
    pad_length: PositiveLength
    pad_rise: NonNegativeLength
    tip_length: PositiveLength
    zone: RidgeZone

    def __post_init__(self) -> None:
        _check_lengths(self, "half_height", "pad_length", "tip_length")
        if self.pad_rise >= 2 * self.half_height:
            allowed = f"needs a value < {millimetres(2 * self.half_height)} (twice half_height)"
            raise InputError("pad_rise", f"got {millimetres(self.pad_rise)}", allowed)


@parameters
class TransverseOutline:
    """Outline of the section across the finger: an ellipse.

    Parameters
    ----------
    half_width, half_height : float
        Semi-axes along x and y [m].
    zone : RidgeZone
        Where ridges, fingerprint and receptors are.
    """

    half_width: PositiveLength
    half_height: PositiveLength
    zone: RidgeZone

    def __post_init__(self) -> None:
        _check_lengths(self, "half_width", "half_height")


def _check_lengths(outline: SagittalOutline | TransverseOutline, *names: str) -> None:
    """Refuse what no finger has, before its outline is sampled every hundredth of a millimetre."""
    for name in names:
        if getattr(outline, name) > _LONGEST:
            found, allowed = f"got {millimetres(getattr(outline, name))}", f"needs at most {millimetres(_LONGEST)}"
            raise InputError(name, found, allowed, "write the unit with the number, as in 7 mm")


@parameters
class Layers:
    """Thickness of the skin and of its outer layer.

    Parameters
    ----------
    skin_thickness : float
        Epidermis and dermis together [m].
    epidermis_thickness : float
        Mean thickness of the epidermis [m].
    """

    skin_thickness: PositiveLength
    epidermis_thickness: PositiveLength

    def __post_init__(self) -> None:
        if self.epidermis_thickness >= self.skin_thickness:
            allowed = f"needs a value < {millimetres(self.skin_thickness)} (skin_thickness)"
            raise InputError("epidermis_thickness", f"got {millimetres(self.epidermis_thickness)}", allowed)

    @property
    def dermis_thickness(self) -> float:
        """Mean thickness of the dermis [m]."""
        return self.skin_thickness - self.epidermis_thickness


@parameters
class Ridges:
    """Ridges of the epidermis into the dermis, intermediate and limiting ones in turn.

    Intermediate ridges are at arc lengths k `pitch`, limiting ridges at (k + 1/2) `pitch`, each shaped as a squared
    cosine half a pitch wide.

    Parameters
    ----------
    enabled : bool
        Whether the epidermis-dermis interface has ridges.
    pitch : float
        Distance between two intermediate ridges [m].
    intermediate_height, limiting_height : float
        Heights from foot to tip [m].
    """

    enabled: bool
    pitch: PositiveLength
    intermediate_height: NonNegativeLength
    limiting_height: NonNegativeLength

    @property
    def mean_height(self) -> float:
        """Mean of the ridge profile over one pitch [m]."""
        return (self.intermediate_height + self.limiting_height) / 4.0


@parameters
class Fingerprint:
    """Ripples of the outer skin surface: height/2 cos(2 pi s/pitch + phase) outward.

    Parameters
    ----------
    enabled : bool
        Whether the skin surface has ripples.
    pitch : float
        Distance between two crests [m].
    height : float
        Height from groove to crest [m].
    phase : float
        Phase [rad]; at 0 the crests are above the intermediate ridges.
    """

    enabled: bool
    pitch: PositiveLength
    height: NonNegativeLength
    phase: Angle


@parameters
class Receptors:
    """Where the mechanoreceptors are that do not sit on ridge tips.

    Parameters
    ----------
    sa_ii_height : float
        Height of SA-II above the dermis-tissue border [m].
    fa_ii_depth : float
        Depth of FA-II below the skin surface [m].
    """

    sa_ii_height: NonNegativeLength
    fa_ii_depth: PositiveLength
