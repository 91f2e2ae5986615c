"""What a fingertip is, in numbers: layers, phalanx, ridges, fingerprint, receptors, and the presets that ship."""

from fingerslip.anatomy.bone import phalanx_contour, reaches_cut
from fingerslip.anatomy.bone_surface import BoneSurface, bone_surface
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
from fingerslip.anatomy.pose import posed
from fingerslip.anatomy.presets import (
    PresetValue,
    fingertip_from,
    preset,
    preset_header,
    preset_names,
    preset_table,
)
from fingerslip.anatomy.relief import relief_depth
from fingerslip.anatomy.skin_surface import (
    below_skin,
    depth_below_skin,
    inward_skin_normal,
    onto_skin,
    skin_grid,
    skin_ring,
    skin_section,
    solid_shape,
)
from fingerslip.anatomy.solid import Nail, SolidPhalanx, SolidShape

__all__ = [
    "REGIONS",
    "BoneSurface",
    "Curve",
    "Fingerprint",
    "Fingertip",
    "Layers",
    "Nail",
    "Phalanx",
    "PresetValue",
    "Receptors",
    "RidgeZone",
    "Ridges",
    "SagittalOutline",
    "SagittalPhalanx",
    "SolidPhalanx",
    "SolidShape",
    "TransverseOutline",
    "TransversePhalanx",
    "at_depth",
    "below_skin",
    "bone_surface",
    "depth_below_skin",
    "fingertip_from",
    "interface_depth",
    "inward_skin_normal",
    "onto_skin",
    "outline_curve",
    "phalanx_contour",
    "posed",
    "preset",
    "preset_header",
    "preset_names",
    "preset_table",
    "reaches_cut",
    "relief_depth",
    "skin_grid",
    "skin_ring",
    "skin_section",
    "solid_shape",
    "surface_depth",
]
