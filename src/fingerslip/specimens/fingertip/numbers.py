"""The fingertip as numbers, and which of them do not fit together."""

from __future__ import annotations

from typing import Literal

from fingerslip.errors import InputError
from fingerslip.materials.choice import MaterialChoice
from fingerslip.parameters import PositiveLength, parameters
from fingerslip.specimens.fingertip.parts import (
    Fingerprint,
    Layers,
    Receptors,
    Ridges,
    RidgeZone,
    SagittalOutline,
    TransverseOutline,
)
from fingerslip.specimens.fingertip.phalanx import Phalanx
from fingerslip.specimens.fingertip.room import skin_room
from fingerslip.specimens.fingertip.solid import Nail, SolidShape
from fingerslip.units import millimetres

__all__ = ["REGIONS", "FingertipNumbers", "Section"]

#: The planes in which a fingertip is cut: along the finger and across it.
Section = Literal["sagittal", "transverse"]
REGIONS = ("epidermis", "dermis", "tissue", "phalanx")


@parameters
class FingertipNumbers:
    """The numbers of a fingertip, held to fit together.

    :class:`~fingerslip.specimens.fingertip.fingertip.Fingertip` explains them.
    """

    section: Section
    sagittal: SagittalOutline
    transverse: TransverseOutline
    layers: Layers
    phalanx: Phalanx
    ridges: Ridges
    fingerprint: Fingerprint
    receptors: Receptors
    materials: dict[str, MaterialChoice]
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


def _check_materials(fingertip: FingertipNumbers) -> None:
    has_nail = fingertip.solid is not None and fingertip.solid.nail is not None
    needed, given = (*REGIONS, "nail") if has_nail else REGIONS, fingertip.materials
    if set(given) != set(needed):
        raise InputError("materials", f"has {', '.join(given) or 'nothing'}", f"needs {', '.join(needed)}")


def _check_solid(fingertip: FingertipNumbers, solid: SolidShape) -> None:
    sagittal, transverse = fingertip.sagittal, fingertip.transverse
    if abs(sagittal.half_height - transverse.half_height) > 1e-9 * sagittal.half_height:
        allowed = (
            f"needs {millimetres(sagittal.half_height)} (sagittal.half_height): both sections are cuts of one finger"
        )
        raise InputError("transverse.half_height", f"got {millimetres(transverse.half_height)}", allowed)
    if not -sagittal.pad_length < solid.phalanx.waist_position < 0.0:
        allowed = f"needs a value between {millimetres(-sagittal.pad_length)} (proximal cut) and 0 mm"
        raise InputError("solid.phalanx.waist_position", f"got {millimetres(solid.phalanx.waist_position)}", allowed)
    if solid.nail is not None:
        _check_nail(fingertip, solid.nail)


def _check_nail(fingertip: FingertipNumbers, nail: Nail) -> None:
    limits = {
        "start": (-fingertip.sagittal.pad_length, nail.start, fingertip.sagittal.tip_length),
        "end": (-fingertip.sagittal.pad_length, nail.end, fingertip.sagittal.tip_length),
        "half_width": (0.0, nail.half_width, fingertip.transverse.half_width),
        "thickness": (0.0, nail.thickness, fingertip.layers.skin_thickness),
    }
    for name, (least, value, largest) in limits.items():
        if not least < value < largest:
            allowed = f"needs a value between {millimetres(least)} and {millimetres(largest)}"
            raise InputError(f"solid.nail.{name}", f"got {millimetres(value)}", allowed)


def _check_ridges(fingertip: FingertipNumbers) -> None:
    ridges, layers = fingertip.ridges, fingertip.layers
    if not ridges.enabled:
        return
    room = layers.dermis_thickness + ridges.mean_height
    for name in ("intermediate_height", "limiting_height"):
        if getattr(ridges, name) >= room:
            allowed = f"needs a value < {millimetres(room)}, above which the ridge pierces the dermis"
            raise InputError(f"ridges.{name}", f"got {millimetres(getattr(ridges, name))}", allowed)
    if ridges.mean_height >= layers.epidermis_thickness:
        found = f"mean height {millimetres(ridges.mean_height)}, (intermediate_height + limiting_height) / 4"
        repair = "make them lower or the epidermis thicker, which between ridges is thinner by that height"
        raise InputError(
            "ridges", found, f"needs < {millimetres(layers.epidermis_thickness)} (epidermis_thickness)", repair
        )


def _check_fingerprint(fingertip: FingertipNumbers) -> None:
    if not fingertip.fingerprint.enabled:
        return
    ridges = fingertip.ridges
    room = fingertip.layers.epidermis_thickness - (ridges.mean_height if ridges.enabled else 0.0)
    if fingertip.fingerprint.height / 2 >= room:
        allowed = f"needs a value < {millimetres(2 * room)}, above which the grooves reach the dermis"
        raise InputError("fingerprint.height", f"got {millimetres(fingertip.fingerprint.height)}", allowed)


def _check_receptors(fingertip: FingertipNumbers) -> None:
    receptors, layers = fingertip.receptors, fingertip.layers
    if receptors.sa_ii_height >= layers.dermis_thickness:
        allowed = f"needs a value < {millimetres(layers.dermis_thickness)} (thickness of the dermis)"
        raise InputError("receptors.sa_ii_height", f"got {millimetres(receptors.sa_ii_height)}", allowed)
    if receptors.fa_ii_depth <= layers.skin_thickness:
        allowed = f"needs a value > {millimetres(layers.skin_thickness)} (skin_thickness)"
        raise InputError("receptors.fa_ii_depth", f"got {millimetres(receptors.fa_ii_depth)}", allowed)


def _check_skin(fingertip: FingertipNumbers) -> None:
    """Refuse a skin without room; a phalanx that is too large for a skin above FA-II shows with its contour."""
    thickness, (room, limit) = fingertip.layers.skin_thickness, skin_room(fingertip.outline, fingertip.phalanx)
    if thickness >= fingertip.outline.half_height or thickness >= max(room, fingertip.receptors.fa_ii_depth):
        repair = f"make the skin thinner or change {limit}"
        raise InputError(
            "layers.skin_thickness", f"got {millimetres(thickness)}", f"needs a value < {millimetres(room)}", repair
        )
