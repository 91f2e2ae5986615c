"""What a fingertip is, in numbers: layers, phalanx, ridges, fingerprint, receptors, and the presets that ship."""

from fingerslip.anatomy.bone import phalanx_contour, reaches_cut
from fingerslip.anatomy.fingertip import (
    REGIONS,
    Fingerprint,
    Fingertip,
    Layers,
    Phalanx,
    Receptors,
    Ridges,
    RidgeZone,
    SagittalOutline,
    SagittalPhalanx,
    TransverseOutline,
    TransversePhalanx,
)
from fingerslip.anatomy.interfaces import interface_depth, surface_depth
from fingerslip.anatomy.outline import Curve, at_depth, outline_curve
from fingerslip.anatomy.presets import (
    PresetValue,
    fingertip_from,
    preset,
    preset_header,
    preset_names,
    preset_table,
)

__all__ = [
    "REGIONS",
    "Curve",
    "Fingerprint",
    "Fingertip",
    "Layers",
    "Phalanx",
    "PresetValue",
    "Receptors",
    "RidgeZone",
    "Ridges",
    "SagittalOutline",
    "SagittalPhalanx",
    "TransverseOutline",
    "TransversePhalanx",
    "at_depth",
    "fingertip_from",
    "interface_depth",
    "outline_curve",
    "phalanx_contour",
    "preset",
    "preset_header",
    "preset_names",
    "preset_table",
    "reaches_cut",
    "surface_depth",
]
