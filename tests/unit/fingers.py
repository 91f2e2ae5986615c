"""Fingertips that tests of anatomy and meshes share."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from fingerslip.specimens.fingertip.fingertip import Fingertip, fingertip_from

SECTIONS = ("sagittal", "transverse")
VARIANTS = ("original", "flattened", "scaled")
NAIL = {"start": "-4 mm", "end": "5 mm", "half_width": "5 mm", "thickness": "0.5 mm"}
# Of the nail, in study files.
HARD = {"youngs_modulus": "170 MPa", "poisson_ratio": 0.3, "density": "1300 kg/m^3"}


def change(**groups: Any) -> Fingertip:
    """Return the preset with some values changed, written as in a study file."""
    return fingertip_from({"preset": "wang2014-2d", **groups}, "finger")


def change_solid(**groups: Any) -> Fingertip:
    """Return the preset in 3D with some values changed, written as in a study file."""
    return fingertip_from({"preset": "wang2014-3d", **groups}, "finger")


def coarse_solid(variant: str = "original") -> Any:
    """Return a coarse mesh of the preset in 3D, which is made once."""
    return _coarse_solid(variant)


@functools.cache
def _coarse_solid(variant: str) -> Any:
    from fingerslip.specimens.fingertip.fingertip import build_solid

    return build_solid(change_solid(phalanx={"variant": variant}), contact_size=0.8e-3, bulk_size=1.6e-3, element="T4")


def volumes(mesh: Any) -> np.ndarray:
    """Return the volume of every tetrahedron."""
    corners = mesh.p[:, mesh.t[:4]].transpose(2, 1, 0)
    return np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0


def shoelace(points: np.ndarray) -> float:
    """Return the area inside a ring of (n, 2) points, positive where it runs counter-clockwise."""
    x, y = points.T
    return float(0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
