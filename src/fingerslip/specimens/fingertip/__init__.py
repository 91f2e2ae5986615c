"""What a fingertip is, in numbers: layers, phalanx, ridges, fingerprint, receptors, and the presets that ship."""

from fingerslip.parameters.presets import PresetValue
from fingerslip.specimens.fingertip.fingertip import Fingertip
from fingerslip.specimens.fingertip.interfaces import interface_depth, surface_depth
from fingerslip.specimens.fingertip.numbers import REGIONS, FingertipNumbers
from fingerslip.specimens.fingertip.outline import Curve, at_depth, outline_curve
from fingerslip.specimens.fingertip.parts import (
    Fingerprint,
    Layers,
    Receptors,
    Ridges,
    RidgeZone,
    SagittalOutline,
    TransverseOutline,
)
from fingerslip.specimens.fingertip.phalanx import Phalanx, SagittalPhalanx, TransversePhalanx
from fingerslip.specimens.fingertip.phalanx_contour import phalanx_contour, reaches_cut
from fingerslip.specimens.fingertip.phalanx_surface import PhalanxSurface, phalanx_surface
from fingerslip.specimens.fingertip.pose import posed
from fingerslip.specimens.fingertip.presets import fingertip_from, preset, preset_header, preset_names, preset_table
from fingerslip.specimens.fingertip.relief import relief_depth
from fingerslip.specimens.fingertip.skin_surface import (
    below_skin,
    depth_below_skin,
    inward_skin_normal,
    onto_skin,
    skin_grid,
    skin_ring,
    skin_section,
    solid_shape,
)
from fingerslip.specimens.fingertip.solid import Nail, SolidPhalanx, SolidShape

__all__ = [
    "REGIONS",
    "Curve",
    "Fingerprint",
    "Fingertip",
    "FingertipNumbers",
    "Layers",
    "Nail",
    "Phalanx",
    "PhalanxSurface",
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
    "depth_below_skin",
    "fingertip_from",
    "interface_depth",
    "inward_skin_normal",
    "onto_skin",
    "outline_curve",
    "phalanx_contour",
    "phalanx_surface",
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
