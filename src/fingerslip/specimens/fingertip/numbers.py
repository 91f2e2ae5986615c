"""The fingertip as numbers, and which of them do not fit together."""

from __future__ import annotations

from typing import Annotated, Literal

from fingerslip.errors import InputError
from fingerslip.materials.choice import MaterialChoice
from fingerslip.parameters import Angle, Length, NonNegativeLength, PositiveLength, parameters
from fingerslip.specimens.protocol import check_regions
from fingerslip.units import millimetres

_LONGEST = 1.0  # m


def _check_below(name: str, value: float, limit: float, reason: str) -> None:
    """Refuse a length that is not below a limit [m], which the reason explains."""
    if value >= limit:
        raise InputError(name, f"got {millimetres(value)}", f"needs a value < {millimetres(limit)}{reason}")


@parameters
class RidgeZone:
    """The part of the palmar skin that carries ridges, fingerprint and receptors."""

    start: Annotated[Length, "Arc length along the skin from its lowest point [m], `end` towards +x."]
    end: Annotated[Length, "Arc length along the skin from its lowest point [m], `end` towards +x."]
    fade: Annotated[PositiveLength, "Length over which ridges and ripples fade to nothing inside either end [m]."]

    def __post_init__(self) -> None:
        if self.end - self.start <= 2 * self.fade:
            fault = f"zone from {millimetres(self.start)} to {millimetres(self.end)} with fade {millimetres(self.fade)}"
            raise InputError("", fault, "needs end - start > 2 fade")


@parameters
class SagittalOutline:
    """Outline of the section along the finger: parabolic pad, elliptic tip, straight back.

    The lowest point is at x = 0, y = -`half_height`; the proximal cut at x = -`pad_length`.
    """

    half_height: Annotated[PositiveLength, "Half the height of the fingertip at x = 0 [m]."]
    pad_length: Annotated[PositiveLength, "Distance from the lowest point to the proximal cut [m]."]
    pad_rise: Annotated[NonNegativeLength, "Rise of the palmar skin from the lowest point to the cut [m]."]
    tip_length: Annotated[PositiveLength, "Length of the elliptic tip [m]."]
    zone: Annotated[RidgeZone, "Where ridges, fingerprint and receptors are."]

    def __post_init__(self) -> None:
        _check_lengths(self, "half_height", "pad_length", "tip_length")
        _check_below("pad_rise", self.pad_rise, 2 * self.half_height, " (twice half_height)")


@parameters
class TransverseOutline:
    """Outline of the section across the finger: an ellipse."""

    half_width: Annotated[PositiveLength, "Semi-axis along x [m]."]
    half_height: Annotated[PositiveLength, "Semi-axis along y [m]."]
    zone: Annotated[RidgeZone, "Where ridges, fingerprint and receptors are."]

    def __post_init__(self) -> None:
        _check_lengths(self, "half_width", "half_height")


def _check_lengths(outline: SagittalOutline | TransverseOutline, *names: str) -> None:
    """Refuse what no finger has, before its outline is sampled every hundredth of a millimetre."""
    for name in names:
        if getattr(outline, name) > _LONGEST:
            fault, allowed = f"got {millimetres(getattr(outline, name))}", f"needs at most {millimetres(_LONGEST)}"
            raise InputError(name, fault, allowed, "write the unit with the number, as in 7 mm")


@parameters
class Layers:
    """Thickness of the skin and of its outer layer."""

    skin_thickness: Annotated[PositiveLength, "Epidermis and dermis together [m]."]
    epidermis_thickness: Annotated[PositiveLength, "Mean thickness of the epidermis [m]."]

    def __post_init__(self) -> None:
        _check_below("epidermis_thickness", self.epidermis_thickness, self.skin_thickness, " (skin_thickness)")

    @property
    def dermis_thickness(self) -> float:
        """Mean thickness of the dermis [m]."""
        return self.skin_thickness - self.epidermis_thickness


@parameters
class Ridges:
    """Ridges of the epidermis into the dermis, intermediate and limiting ones in turn.

    Intermediate ridges are at arc lengths k `pitch`, limiting ridges at (k + 1/2) `pitch`, each shaped as a squared
    cosine half a pitch wide.
    """

    enabled: Annotated[bool, "Whether the epidermis-dermis interface has ridges."]
    pitch: Annotated[PositiveLength, "Distance between two intermediate ridges [m]."]
    intermediate_height: Annotated[NonNegativeLength, "Heights from foot to tip [m]."]
    limiting_height: Annotated[NonNegativeLength, "Heights from foot to tip [m]."]

    @property
    def mean_height(self) -> float:
        """Mean of the ridge profile over one pitch [m]."""
        return (self.intermediate_height + self.limiting_height) / 4.0


@parameters
class Fingerprint:
    """Ripples of the outer skin surface: height/2 cos(2 pi s/pitch + phase) outward."""

    enabled: Annotated[bool, "Whether the skin surface has ripples."]
    pitch: Annotated[PositiveLength, "Distance between two crests [m]."]
    height: Annotated[NonNegativeLength, "Height from groove to crest [m]."]
    phase: Annotated[Angle, "Phase [rad]; at 0 the crests are above the intermediate ridges."]


@parameters
class Receptors:
    """Where the mechanoreceptors are that do not sit on ridge tips."""

    sa_ii_height: Annotated[NonNegativeLength, "Height of SA-II above the dermis-tissue border [m]."]
    fa_ii_depth: Annotated[PositiveLength, "Depth of FA-II below the skin surface [m]."]


@parameters
class SagittalPhalanx:
    """Distal phalanx in the section along the finger.

    The palmar face of the `original` is y = `palmar_level` + `concavity_depth` exp(-((x - `concavity_position`)/
    `concavity_width`)^2), nowhere nearer to the dermis than `minimum_tissue`; that of the `flattened` has no concavity.
    """

    palmar_level: Annotated[Length, "Height y of the palmar face [m]."]
    dorsal_level: Annotated[Length, "Height y of the dorsal face [m]."]
    distal_end: Annotated[Length, "Position x of the distal end [m]."]
    concavity_depth: Annotated[NonNegativeLength, "Shape of the hollow of the palmar face [m]."]
    concavity_width: Annotated[PositiveLength, "Shape of the hollow of the palmar face [m]."]
    concavity_position: Annotated[Length, "Shape of the hollow of the palmar face [m]."]
    minimum_tissue: Annotated[PositiveLength, "Least thickness of the tissue under the palmar face [m]."]

    def __post_init__(self) -> None:
        height = self.dorsal_level - self.palmar_level
        _check_below("concavity_depth", self.concavity_depth, height, " (dorsal_level - palmar_level)")


@parameters
class TransversePhalanx:
    """Distal phalanx in the section across the finger: an ellipse about the centre of the finger.

    The palmar face of the `original` is the ellipse raised by `concavity_depth` exp(-(x/`concavity_width`)^2); that of
    the `flattened` is the ellipse cut off at `palmar_level`.
    """

    half_width: Annotated[PositiveLength, "Semi-axis along x [m]."]
    half_height: Annotated[PositiveLength, "Semi-axis along y [m]."]
    palmar_level: Annotated[Length, "Height y of the flat palmar face [m]."]
    concavity_depth: Annotated[NonNegativeLength, "Shape of the hollow of the palmar face [m]."]
    concavity_width: Annotated[PositiveLength, "Shape of the hollow of the palmar face [m]."]

    def __post_init__(self) -> None:
        if abs(self.palmar_level) >= self.half_height:
            allowed = f"needs a value within +-{millimetres(self.half_height)} (half_height)"
            raise InputError("palmar_level", f"got {millimetres(self.palmar_level)}", allowed)
        _check_below("concavity_depth", self.concavity_depth, self.half_height, " (half_height)")


@parameters
class Phalanx:
    """Distal phalanx: which variant, and its dimensions in either section."""

    variant: Annotated[
        Literal["original", "flattened", "scaled"],
        "Concave palmar face; palmar face flat and parallel to the plate; the skin outline scaled inward.",
    ]
    rigid: Annotated[bool, "Whether the phalanx is taken as undeformable."]
    tissue_thickness: Annotated[PositiveLength, "Uniform thickness of the tissue around the `scaled` phalanx [m]."]
    corner_radius: Annotated[
        PositiveLength,
        "Radius of the distal corners in the sagittal section and of the sharp ends of a `scaled` phalanx [m]; half "
        "of it rounds the other edges of the palmar face.",
    ]
    sagittal: Annotated[SagittalPhalanx, "Dimensions along the finger."]
    transverse: Annotated[TransversePhalanx, "Dimensions across the finger."]

    def __post_init__(self) -> None:
        height = self.sagittal.dorsal_level - self.sagittal.palmar_level
        _check_below("corner_radius", self.corner_radius, height / 2, " (half of dorsal_level - palmar_level)")


def skin_room(outline: SagittalOutline | TransverseOutline, phalanx: Phalanx) -> tuple[float, str]:
    """Return an upper limit of the thickness of the skin, and the value that sets it.

    The limit [m] is where the skin reaches a face of the phalanx or, of a `scaled` phalanx, the centre of the section.
    The corners of the phalanx may come nearer; that shows with its contour.
    """
    if isinstance(outline, SagittalOutline):
        centre, along = "sagittal.half_height", phalanx.sagittal
        faces = {
            "phalanx.sagittal.palmar_level": outline.half_height + along.palmar_level,
            "phalanx.sagittal.dorsal_level": outline.half_height - along.dorsal_level,
            "phalanx.sagittal.distal_end": outline.tip_length - along.distal_end,
        }
    else:
        centre, across = "transverse.half_height", phalanx.transverse
        faces = {
            "phalanx.transverse.half_height": outline.half_height - across.half_height,
            "phalanx.transverse.half_width": outline.half_width - across.half_width,
        }
    limits = {centre: outline.half_height} | (faces if phalanx.variant != "scaled" else {})
    return min((room, path) for path, room in limits.items())


@parameters
class SolidPhalanx:
    """Widths of the distal phalanx along the finger.

    They are joined by a smooth monotone curve: the base at the proximal cut, the waist, the tuft at the lowest point
    of the skin, where the half width is that of the transverse section, and the flat distal end. A `scaled` phalanx
    has none of these widths.
    """

    base_half_width: Annotated[PositiveLength, "Half width at the proximal cut [m]."]
    waist_half_width: Annotated[PositiveLength, "Half width at the narrowest place [m]."]
    waist_position: Annotated[Length, "Position x of the waist [m]."]
    end_half_width: Annotated[PositiveLength, "Half width of the distal end [m]."]


@parameters
class Nail:
    """The nail: the outermost part of the dorsal skin."""

    start: Annotated[Length, "Position x of its proximal edge [m]."]
    end: Annotated[Length, "Position x of its distal edge [m]."]
    half_width: Annotated[PositiveLength, "Half its width across the finger [m]."]
    thickness: Annotated[PositiveLength, "Thickness [m]."]

    def __post_init__(self) -> None:
        if self.end <= self.start:
            allowed = f"needs a value > {millimetres(self.start)} (start)"
            raise InputError("end", f"got {millimetres(self.end)}", allowed)


@parameters
class SolidShape:
    """What the fingertip in 3D has beyond its sections."""

    base_half_width: Annotated[
        PositiveLength,
        "Half width of the finger at the proximal cut [m]; at the lowest point it is that of the transverse outline.",
    ]
    angle: Annotated[
        Angle, "Angle by which the finger is turned about z [rad], positive where the tip rises from the plate."
    ]
    phalanx: Annotated[SolidPhalanx, "Widths of the phalanx along the finger."]
    nail: Annotated[Nail | None, "The nail; none without it."] = None

    def __post_init__(self) -> None:
        # Beyond this the proximal cut, not the pad, would come down on the plate.
        if not -0.6 <= self.angle <= 0.6:
            raise InputError("angle", f"got {self.angle:.4g} rad", "needs a value within +-0.6 rad")


#: The planes in which a fingertip is cut: along the finger and across it.
Section = Literal["sagittal", "transverse"]
REGIONS = ("epidermis", "dermis", "tissue", "phalanx")


@parameters
class FingertipNumbers:
    """The numbers of a fingertip, held to fit together."""

    section: Annotated[Section, "The plane of the 2D model: along or across the finger."]
    sagittal: Annotated[SagittalOutline, "Outline of the skin in either section."]
    transverse: Annotated[TransverseOutline, "Outline of the skin in either section."]
    layers: Annotated[Layers, "Thickness of the skin and the epidermis."]
    phalanx: Annotated[Phalanx, "The distal phalanx."]
    ridges: Annotated[Ridges, "Intermediate and limiting ridges."]
    fingerprint: Annotated[Fingerprint, "Ripples of the outer surface."]
    receptors: Annotated[Receptors, "Depths of the receptors."]
    materials: Annotated[
        dict[str, MaterialChoice],
        "dict of str to Elastic, NeoHookean, MooneyRivlin or Ogden : Material of each of `epidermis`, `dermis`, "
        "`tissue` and `phalanx`, and of the `nail` where there is one.",
    ]
    formulation: Annotated[Literal["plane_strain", "plane_stress"], "Out-of-plane behaviour of the 2D model."]
    depth: Annotated[PositiveLength, "Out-of-plane thickness of the 2D model [m]."]
    solid: Annotated[
        SolidShape | None,
        "What the fingertip in 3D has beyond its sections. With it the transverse section is the cut x = 0 of the "
        "fingertip in 3D, as the sagittal section is the cut z = 0; without it there are only the sections.",
    ] = None

    def __post_init__(self) -> None:
        has_nail = self.solid is not None and self.solid.nail is not None
        check_regions(self.materials, (*REGIONS, "nail") if has_nail else REGIONS)
        _check_layers(self)
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


def _check_solid(fingertip: FingertipNumbers, solid: SolidShape) -> None:
    sagittal, transverse = fingertip.sagittal, fingertip.transverse
    if abs(sagittal.half_height - transverse.half_height) > 1e-9 * sagittal.half_height:
        fault, height = f"got {millimetres(transverse.half_height)}", millimetres(sagittal.half_height)
        allowed = f"needs {height} (sagittal.half_height): both sections are cuts of one finger"
        raise InputError("transverse.half_height", fault, allowed)
    if not -sagittal.pad_length < solid.phalanx.waist_position < 0.0:
        allowed = f"needs a value between {millimetres(-sagittal.pad_length)} (proximal cut) and 0 mm"
        raise InputError("solid.phalanx.waist_position", f"got {millimetres(solid.phalanx.waist_position)}", allowed)
    if (nail := solid.nail) is None:
        return
    limits = {
        "start": (-sagittal.pad_length, nail.start, sagittal.tip_length),
        "end": (-sagittal.pad_length, nail.end, sagittal.tip_length),
        "half_width": (0.0, nail.half_width, transverse.half_width),
        "thickness": (0.0, nail.thickness, fingertip.layers.skin_thickness),
    }
    for name, (least, value, largest) in limits.items():
        if not least < value < largest:
            allowed = f"needs a value between {millimetres(least)} and {millimetres(largest)}"
            raise InputError(f"solid.nail.{name}", f"got {millimetres(value)}", allowed)


def _check_layers(fingertip: FingertipNumbers) -> None:
    """Refuse layers, ridges, ripples and receptors that have no room.

    A phalanx that is too large for a skin above FA-II shows with its contour.
    """
    layers, ridges, receptors = fingertip.layers, fingertip.ridges, fingertip.receptors
    thickness, (room, limit) = layers.skin_thickness, skin_room(fingertip.outline, fingertip.phalanx)
    if thickness >= fingertip.outline.half_height or thickness >= max(room, receptors.fa_ii_depth):
        fault, allowed = f"got {millimetres(thickness)}", f"needs a value < {millimetres(room)}"
        raise InputError("layers.skin_thickness", fault, allowed, f"make the skin thinner or change {limit}")
    mean_height = ridges.mean_height if ridges.enabled else 0.0
    for name in ("intermediate_height", "limiting_height") if ridges.enabled else ():
        reason = ", above which the ridge pierces the dermis"
        _check_below(f"ridges.{name}", getattr(ridges, name), layers.dermis_thickness + mean_height, reason)
    if mean_height >= layers.epidermis_thickness:
        fault = f"mean height {millimetres(mean_height)}, (intermediate_height + limiting_height) / 4"
        allowed = f"needs < {millimetres(layers.epidermis_thickness)} (epidermis_thickness)"
        repair = "make them lower or the epidermis thicker, which between ridges is thinner by that height"
        raise InputError("ridges", fault, allowed, repair)
    if fingertip.fingerprint.enabled:
        limit_of_grooves = 2 * (layers.epidermis_thickness - mean_height)
        reason = ", above which the grooves reach the dermis"
        _check_below("fingerprint.height", fingertip.fingerprint.height, limit_of_grooves, reason)
    reason = " (thickness of the dermis)"
    _check_below("receptors.sa_ii_height", receptors.sa_ii_height, layers.dermis_thickness, reason)
    if receptors.fa_ii_depth <= thickness:
        allowed = f"needs a value > {millimetres(thickness)} (skin_thickness)"
        raise InputError("receptors.fa_ii_depth", f"got {millimetres(receptors.fa_ii_depth)}", allowed)
