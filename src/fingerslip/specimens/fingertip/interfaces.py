"""Depths of the skin's surfaces below the mean outline: the fingerprint and the epidermis-dermis interface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fingerslip.specimens.fingertip.numbers import FingertipNumbers, RidgeZone

__all__ = ["fade", "interface_depth", "ridge_profile", "surface_depth"]

Floats = NDArray[np.float64]


def fade(zone: RidgeZone, arc_length: Floats) -> Floats:
    """Return the share [-] of ridges and ripples at arc lengths (n,) [m]: 1 in the zone, smoothly to 0 at its ends."""
    inside = np.minimum(arc_length - zone.start, zone.end - arc_length)
    share = np.clip(inside / zone.fade, 0.0, 1.0)
    weight: Floats = share**2 * (3.0 - 2.0 * share)
    return weight


def ridge_profile(fingertip: FingertipNumbers, arc_length: Floats) -> Floats:
    """Return the ridge heights [m] into the dermis at arc lengths (n,) [m]: squared cosines, both kinds in turn."""
    ridges = fingertip.ridges
    wave = np.cos(2 * np.pi * arc_length / ridges.pitch)
    height = np.where(wave > 0.0, ridges.intermediate_height, ridges.limiting_height)
    profile: Floats = height * wave**2
    return profile


def surface_depth(fingertip: FingertipNumbers, arc_length: Floats) -> Floats:
    """Return the depth [m] of the outer skin surface at arc lengths (n,) [m]: negative on fingerprint crests."""
    fingerprint = fingertip.fingerprint
    if not fingerprint.enabled:
        return np.zeros_like(arc_length)
    ripple = np.cos(2 * np.pi * arc_length / fingerprint.pitch + fingerprint.phase)
    depth: Floats = -0.5 * fingerprint.height * ripple * fade(fingertip.zone, arc_length)
    return depth


def interface_depth(fingertip: FingertipNumbers, arc_length: Floats) -> Floats:
    """Return the depth [m] of the epidermis-dermis interface at arc lengths (n,) [m]; mean: the epidermis thickness."""
    thickness = fingertip.layers.epidermis_thickness
    if not fingertip.ridges.enabled:
        return np.full_like(arc_length, thickness)
    profile = ridge_profile(fingertip, arc_length) - fingertip.ridges.mean_height
    depth: Floats = thickness + profile * fade(fingertip.zone, arc_length)
    return depth
