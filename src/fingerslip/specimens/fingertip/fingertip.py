"""The fingertip as numbers: outlines, layers, phalanx, ridges, fingerprint, receptors and materials."""

from __future__ import annotations

from typing import Literal

from fingerslip.errors import InputError
from fingerslip.materials.elastic import Elastic
from fingerslip.parameters import Angle, Length, NonNegativeLength, PositiveLength, parameters
from fingerslip.specimens.fingertip.phalanx import Phalanx, SagittalPhalanx, TransversePhalanx
from fingerslip.specimens.fingertip.room import skin_room
from fingerslip.specimens.fingertip.solid import Nail, SolidShape

__all__ = [
    "REGIONS",
    "Fingerprint",
    "Fingertip",
    "Layers",
    "Phalanx",
    "Receptors",
    "RidgeZone",
    "Ridges",
    "SagittalOutline",
    "SagittalPhalanx",
    "TransverseOutline",
    "TransversePhalanx",
]

REGIONS = ("epidermis", "dermis", "tissue", "phalanx")


def _mm(value: float) -> str:
    return f"{value * 1e3:.4g} mm"


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
            found = f"zone from {_mm(self.start)} to {_mm(self.end)} with fade {_mm(self.fade)}"
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
        if self.pad_rise >= 2 * self.half_height:
            allowed = f"needs a value < {_mm(2 * self.half_height)} (twice half_height)"
            raise InputError("pad_rise", f"got {_mm(self.pad_rise)}", allowed)


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
            allowed = f"needs a value < {_mm(self.skin_thickness)} (skin_thickness)"
            raise InputError("epidermis_thickness", f"got {_mm(self.epidermis_thickness)}", allowed)

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


@parameters
class Fingertip:
    """Everything that describes one fingertip.

    Parameters
    ----------
    section : {'sagittal', 'transverse'}
        The plane of the 2D model: along or across the finger.
    sagittal, transverse : SagittalOutline, TransverseOutline
        Outline of the skin in either section.
    layers : Layers
        Thickness of the skin and the epidermis.
    phalanx : Phalanx
        The distal phalanx.
    ridges : Ridges
        Intermediate and limiting ridges.
    fingerprint : Fingerprint
        Ripples of the outer surface.
    receptors : Receptors
        Depths of the receptors.
    materials : dict of str to Elastic
        Material of each of `epidermis`, `dermis`, `tissue` and `phalanx`, and of the `nail` where there is one.
    formulation : {'plane_strain', 'plane_stress'}
        Out-of-plane behaviour of the 2D model.
    depth : float
        Out-of-plane thickness of the 2D model [m].
    solid : SolidShape, optional
        What the fingertip in space has beyond its sections. With it the transverse section is the cut x = 0 of the
        fingertip in space, as the sagittal section is the cut z = 0; without it there are only the sections.
    """

    section: Literal["sagittal", "transverse"]
    sagittal: SagittalOutline
    transverse: TransverseOutline
    layers: Layers
    phalanx: Phalanx
    ridges: Ridges
    fingerprint: Fingerprint
    receptors: Receptors
    materials: dict[str, Elastic]
    formulation: Literal["plane_strain", "plane_stress"]
    depth: PositiveLength
    solid: SolidShape | None = None

    def __post_init__(self) -> None:
        _check_materials(self)
        _check_skin(self)
        _check_ridges(self)
        _check_fingerprint(self)
        _check_receptors(self)
        if self.solid is not None:
            _check_solid(self, self.solid)

    @property
    def outline(self) -> SagittalOutline | TransverseOutline:
        """The outline of the chosen section."""
        return self.sagittal if self.section == "sagittal" else self.transverse

    @property
    def zone(self) -> RidgeZone:
        """The ridge zone of the chosen section."""
        return self.outline.zone


def _check_materials(fingertip: Fingertip) -> None:
    has_nail = fingertip.solid is not None and fingertip.solid.nail is not None
    needed, given = (*REGIONS, "nail") if has_nail else REGIONS, fingertip.materials
    if set(given) != set(needed):
        raise InputError("materials", f"has {', '.join(given) or 'nothing'}", f"needs {', '.join(needed)}")


def _check_solid(fingertip: Fingertip, solid: SolidShape) -> None:
    sagittal, transverse = fingertip.sagittal, fingertip.transverse
    if abs(sagittal.half_height - transverse.half_height) > 1e-9 * sagittal.half_height:
        allowed = f"needs {_mm(sagittal.half_height)} (sagittal.half_height): both sections are cuts of one finger"
        raise InputError("transverse.half_height", f"got {_mm(transverse.half_height)}", allowed)
    if not -sagittal.pad_length < solid.phalanx.waist_position < 0.0:
        allowed = f"needs a value between {_mm(-sagittal.pad_length)} (proximal cut) and 0 mm"
        raise InputError("solid.phalanx.waist_position", f"got {_mm(solid.phalanx.waist_position)}", allowed)
    if solid.nail is not None:
        _check_nail(fingertip, solid.nail)


def _check_nail(fingertip: Fingertip, nail: Nail) -> None:
    limits = {
        "start": (-fingertip.sagittal.pad_length, nail.start, fingertip.sagittal.tip_length),
        "end": (-fingertip.sagittal.pad_length, nail.end, fingertip.sagittal.tip_length),
        "half_width": (0.0, nail.half_width, fingertip.transverse.half_width),
        "thickness": (0.0, nail.thickness, fingertip.layers.skin_thickness),
    }
    for name, (least, value, largest) in limits.items():
        if not least < value < largest:
            allowed = f"needs a value between {_mm(least)} and {_mm(largest)}"
            raise InputError(f"solid.nail.{name}", f"got {_mm(value)}", allowed)


def _check_ridges(fingertip: Fingertip) -> None:
    ridges, layers = fingertip.ridges, fingertip.layers
    if not ridges.enabled:
        return
    room = layers.dermis_thickness + ridges.mean_height
    for name in ("intermediate_height", "limiting_height"):
        if getattr(ridges, name) >= room:
            allowed = f"needs a value < {_mm(room)}, above which the ridge pierces the dermis"
            raise InputError(f"ridges.{name}", f"got {_mm(getattr(ridges, name))}", allowed)
    if ridges.mean_height >= layers.epidermis_thickness:
        found = f"mean height {_mm(ridges.mean_height)}, (intermediate_height + limiting_height) / 4"
        repair = "make them lower or the epidermis thicker, which between ridges is thinner by that height"
        raise InputError("ridges", found, f"needs < {_mm(layers.epidermis_thickness)} (epidermis_thickness)", repair)


def _check_fingerprint(fingertip: Fingertip) -> None:
    if not fingertip.fingerprint.enabled:
        return
    ridges = fingertip.ridges
    room = fingertip.layers.epidermis_thickness - (ridges.mean_height if ridges.enabled else 0.0)
    if fingertip.fingerprint.height / 2 >= room:
        allowed = f"needs a value < {_mm(2 * room)}, above which the grooves reach the dermis"
        raise InputError("fingerprint.height", f"got {_mm(fingertip.fingerprint.height)}", allowed)


def _check_receptors(fingertip: Fingertip) -> None:
    receptors, layers = fingertip.receptors, fingertip.layers
    if receptors.sa_ii_height >= layers.dermis_thickness:
        allowed = f"needs a value < {_mm(layers.dermis_thickness)} (thickness of the dermis)"
        raise InputError("receptors.sa_ii_height", f"got {_mm(receptors.sa_ii_height)}", allowed)
    if receptors.fa_ii_depth <= layers.skin_thickness:
        allowed = f"needs a value > {_mm(layers.skin_thickness)} (skin_thickness)"
        raise InputError("receptors.fa_ii_depth", f"got {_mm(receptors.fa_ii_depth)}", allowed)


def _check_skin(fingertip: Fingertip) -> None:
    """Refuse a skin without room; a phalanx that is too large for a skin above FA-II shows with its contour."""
    thickness, (room, limit) = fingertip.layers.skin_thickness, skin_room(fingertip)
    if thickness >= fingertip.outline.half_height or thickness >= max(room, fingertip.receptors.fa_ii_depth):
        repair = f"make the skin thinner or change {limit}"
        raise InputError("layers.skin_thickness", f"got {_mm(thickness)}", f"needs a value < {_mm(room)}", repair)
