"""What layers are made of, and how they damp."""

from fingerslip.materials.elastic import Elastic, RayleighDamping

__all__ = ["Elastic", "RayleighDamping"]
