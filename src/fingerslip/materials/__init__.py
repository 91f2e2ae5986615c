"""What layers are made of: a file for each law, with its parameters, and how layers damp."""

from fingerslip.materials.damping import RayleighDamping
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.material import Formulation, Material

__all__ = ["LAWS", "Elastic", "Formulation", "Material", "RayleighDamping"]

#: The laws that a study file may name, by their class in snake_case. A new law is its file and its entry here.
LAWS: tuple[type[Material], ...] = (Elastic,)
