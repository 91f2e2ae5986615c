"""Receptor sites: where the mechanoreceptors are in the skin of a section."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fingerslip.sites import Site
from fingerslip.specimens.fingertip.interfaces import interface_depth
from fingerslip.specimens.fingertip.numbers import FingertipNumbers
from fingerslip.specimens.fingertip.outline import Curve, at_depth, outline_curve

__all__ = ["receptor_sites"]

Floats = NDArray[np.float64]


def receptor_sites(fingertip: FingertipNumbers) -> tuple[Site, ...]:
    """Return all candidate receptors of the palmar skin, numbered towards +x within each kind.

    FA-I sit at the tips of the limiting ridges, on the side of the dermis; SA-I at the tips of the intermediate
    ridges, on the side of the epidermis; SA-II just above the dermis-tissue border; FA-II at their depth below the
    skin surface. Where ridges are off, the first two are at the same arc lengths on the plain interface. SA-II and
    FA-II are below every intermediate ridge. Sites fill the zone in which ridges have their full height.

    Parameters
    ----------
    fingertip : FingertipNumbers
        Gives ridges, layers and depths.
    """
    intermediate = _ridges_in_zone(fingertip, shift=0.0)
    limiting = _ridges_in_zone(fingertip, shift=0.5)
    receptors, layers, curve = fingertip.receptors, fingertip.layers, outline_curve(fingertip)
    border = np.full_like(intermediate, layers.skin_thickness - receptors.sa_ii_height)
    deep = np.full_like(intermediate, receptors.fa_ii_depth)
    return (
        *_sites(curve, "FA-I", limiting, interface_depth(fingertip, limiting), "dermis"),
        *_sites(curve, "SA-I", intermediate, interface_depth(fingertip, intermediate), "epidermis"),
        *_sites(curve, "FA-II", intermediate, deep, "tissue"),
        *_sites(curve, "SA-II", intermediate, border, "dermis"),
    )


def _ridges_in_zone(fingertip: FingertipNumbers, shift: float) -> Floats:
    """Return the arc lengths (k + shift) pitch at which ridges have their full height."""
    zone, pitch = fingertip.zone, fingertip.ridges.pitch
    first = np.ceil((zone.start + zone.fade) / pitch - shift)
    last = np.floor((zone.end - zone.fade) / pitch - shift)
    arc_length: Floats = (np.arange(first, last + 1) + shift) * pitch
    return arc_length


def _sites(curve: Curve, kind: str, arc_length: Floats, depth: Floats, region: str) -> list[Site]:
    points = at_depth(curve, arc_length, depth)
    return [
        Site(name=f"{kind}-{number:02d}", kind=kind, position=(float(x), float(y)), region=region)
        for number, (x, y) in enumerate(points, start=1)
    ]
