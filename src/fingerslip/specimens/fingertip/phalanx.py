"""The distal phalanx as numbers: its variant, and its dimensions in either section."""

from __future__ import annotations

from typing import Literal

from fingerslip.errors import InputError
from fingerslip.parameters import Length, NonNegativeLength, PositiveLength, parameters
from fingerslip.units import millimetres

__all__ = ["Phalanx", "SagittalPhalanx", "TransversePhalanx"]


@parameters
class SagittalPhalanx:
    """Distal phalanx in the section along the finger.

    The palmar face of the `original` is y = `palmar_level` + `concavity_depth` exp(-((x - `concavity_position`)/
    `concavity_width`)^2), nowhere nearer to the dermis than `minimum_tissue`; that of the `flattened` has no concavity.

    Parameters
    ----------
    palmar_level, dorsal_level : float
        Height y of the palmar and the dorsal face [m].
    distal_end : float
        Position x of the distal end [m].
    concavity_depth, concavity_width, concavity_position : float
        Shape of the hollow of the palmar face [m].
    minimum_tissue : float
        Least thickness of the tissue under the palmar face [m].
    """

    palmar_level: Length
    dorsal_level: Length
    distal_end: Length
    concavity_depth: NonNegativeLength
    concavity_width: PositiveLength
    concavity_position: Length
    minimum_tissue: PositiveLength

    def __post_init__(self) -> None:
        height = self.dorsal_level - self.palmar_level
        if self.concavity_depth >= height:
            allowed = f"needs a value < {millimetres(height)} (dorsal_level - palmar_level)"
            raise InputError("concavity_depth", f"got {millimetres(self.concavity_depth)}", allowed)


@parameters
class TransversePhalanx:
    """Distal phalanx in the section across the finger: an ellipse about the centre of the finger.

    The palmar face of the `original` is the ellipse raised by `concavity_depth` exp(-(x/`concavity_width`)^2); that of
    the `flattened` is the ellipse cut off at `palmar_level`.

    Parameters
    ----------
    half_width, half_height : float
        Semi-axes along x and y [m].
    palmar_level : float
        Height y of the flat palmar face [m].
    concavity_depth, concavity_width : float
        Shape of the hollow of the palmar face [m].
    """

    half_width: PositiveLength
    half_height: PositiveLength
    palmar_level: Length
    concavity_depth: NonNegativeLength
    concavity_width: PositiveLength

    def __post_init__(self) -> None:
        if abs(self.palmar_level) >= self.half_height:
            allowed = f"needs a value within +-{millimetres(self.half_height)} (half_height)"
            raise InputError("palmar_level", f"got {millimetres(self.palmar_level)}", allowed)
        if self.concavity_depth >= self.half_height:
            allowed = f"needs a value < {millimetres(self.half_height)} (half_height)"
            raise InputError("concavity_depth", f"got {millimetres(self.concavity_depth)}", allowed)


@parameters
class Phalanx:
    """Distal phalanx: which variant, and its dimensions in either section.

    Parameters
    ----------
    variant : {'original', 'flattened', 'scaled'}
        Concave palmar face; palmar face flat and parallel to the plate; the skin outline scaled inward.
    rigid : bool
        Whether the phalanx is taken as undeformable.
    tissue_thickness : float
        Uniform thickness of the tissue around the `scaled` phalanx [m].
    corner_radius : float
        Radius of the distal corners in the sagittal section and of the sharp ends of a `scaled` phalanx [m]; half of
        it rounds the other edges of the palmar face.
    sagittal : SagittalPhalanx
        Dimensions along the finger.
    transverse : TransversePhalanx
        Dimensions across the finger.
    """

    variant: Literal["original", "flattened", "scaled"]
    rigid: bool
    tissue_thickness: PositiveLength
    corner_radius: PositiveLength
    sagittal: SagittalPhalanx
    transverse: TransversePhalanx

    def __post_init__(self) -> None:
        height = self.sagittal.dorsal_level - self.sagittal.palmar_level
        if 2 * self.corner_radius >= height:
            allowed = f"needs a value < {millimetres(height / 2)} (half of dorsal_level - palmar_level)"
            raise InputError("corner_radius", f"got {millimetres(self.corner_radius)}", allowed)
