"""How much room a section leaves for the skin."""

from __future__ import annotations

from fingerslip.specimens.fingertip.parts import SagittalOutline, TransverseOutline
from fingerslip.specimens.fingertip.phalanx import Phalanx

__all__ = ["skin_room"]


def skin_room(outline: SagittalOutline | TransverseOutline, phalanx: Phalanx) -> tuple[float, str]:
    """Return an upper limit of the thickness of the skin, and the value that sets it.

    The limit is where the skin reaches a face of the phalanx or, of a `scaled` phalanx, the centre of the section. The
    corners of the phalanx may come nearer; that shows with its contour.

    Units: returns [m].
    """
    if isinstance(outline, SagittalOutline):
        centre, faces = "sagittal.half_height", _sagittal_limits(outline, phalanx)
    else:
        centre, faces = "transverse.half_height", _transverse_limits(outline, phalanx)
    limits = {centre: outline.half_height} | (faces if phalanx.variant != "scaled" else {})
    return min((room, path) for path, room in limits.items())


def _sagittal_limits(outline: SagittalOutline, phalanx: Phalanx) -> dict[str, float]:
    own = phalanx.sagittal
    return {
        "phalanx.sagittal.palmar_level": outline.half_height + own.palmar_level,
        "phalanx.sagittal.dorsal_level": outline.half_height - own.dorsal_level,
        "phalanx.sagittal.distal_end": outline.tip_length - own.distal_end,
    }


def _transverse_limits(outline: TransverseOutline, phalanx: Phalanx) -> dict[str, float]:
    own = phalanx.transverse
    return {
        "phalanx.transverse.half_height": outline.half_height - own.half_height,
        "phalanx.transverse.half_width": outline.half_width - own.half_width,
    }
