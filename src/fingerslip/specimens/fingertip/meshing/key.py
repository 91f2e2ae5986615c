"""What decides the mesh of a fingertip."""

from __future__ import annotations

from fingerslip.digest import digest
from fingerslip.mesh.sizes import ElementSizes
from fingerslip.parameters import as_mapping
from fingerslip.specimens.fingertip.numbers import FingertipNumbers

__all__ = ["mesh_key"]

_OF_NO_EFFECT = frozenset({"materials", "receptors"})


def mesh_key(fingertip: FingertipNumbers, sizes: ElementSizes) -> str:
    """Return the hash of element sizes and of the fingertip without materials and receptors, which change no mesh."""
    shape = {key: value for key, value in as_mapping(fingertip).items() if key not in _OF_NO_EFFECT}
    return digest([shape, as_mapping(sizes)])
