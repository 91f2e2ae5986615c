"""How much room a section leaves for the skin."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fingerslip.specimens.fingertip.fingertip import Fingertip

__all__ = ["skin_room"]


def skin_room(fingertip: Fingertip) -> tuple[float, str]:
    """Return an upper limit of the thickness of the skin, and the value that sets it.

    The limit is where the skin reaches a face of the phalanx or, of a `scaled` phalanx, the centre of the section. The
    corners of the phalanx may come nearer; that shows with its contour.

    Parameters
    ----------
    fingertip : Fingertip
        Gives section, outline and phalanx.

    Returns
    -------
    float
        Limit of the skin's thickness [m].
    str
        Dotted path of the value that sets it.
    """
    limits = {f"{fingertip.section}.half_height": fingertip.outline.half_height}
    if fingertip.phalanx.variant != "scaled":
        limits |= _sagittal_limits(fingertip) if fingertip.section == "sagittal" else _transverse_limits(fingertip)
    return min((room, path) for path, room in limits.items())


def _sagittal_limits(fingertip: Fingertip) -> dict[str, float]:
    outline, bone = fingertip.sagittal, fingertip.phalanx.sagittal
    return {
        "phalanx.sagittal.palmar_level": outline.half_height + bone.palmar_level,
        "phalanx.sagittal.dorsal_level": outline.half_height - bone.dorsal_level,
        "phalanx.sagittal.distal_end": outline.tip_length - bone.distal_end,
    }


def _transverse_limits(fingertip: Fingertip) -> dict[str, float]:
    outline, bone = fingertip.transverse, fingertip.phalanx.transverse
    return {
        "phalanx.transverse.half_height": outline.half_height - bone.half_height,
        "phalanx.transverse.half_width": outline.half_width - bone.half_width,
    }
