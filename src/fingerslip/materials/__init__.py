"""What layers are made of: a file for each law, with its parameters, and how layers damp."""

from fingerslip.materials.choice import LAWS, AnyMaterial, MaterialChoice
from fingerslip.materials.elastic import Elastic, RayleighDamping
from fingerslip.materials.large_strain import FiniteMaterial
from fingerslip.materials.material import Formulation, Material
from fingerslip.materials.mooney_rivlin import MooneyRivlin
from fingerslip.materials.neo_hookean import NeoHookean
from fingerslip.materials.ogden import Ogden, OgdenTerm
from fingerslip.materials.prony import PronyTerm

__all__ = [
    "LAWS",
    "AnyMaterial",
    "Elastic",
    "FiniteMaterial",
    "Formulation",
    "Material",
    "MaterialChoice",
    "MooneyRivlin",
    "NeoHookean",
    "Ogden",
    "OgdenTerm",
    "PronyTerm",
    "RayleighDamping",
]
