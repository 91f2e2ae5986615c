"""Sites in the fingertip in space: receptors under its middle line, and the reference nodes of the contact patch."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from fingerslip.sites import Site
from fingerslip.specimens.fingertip.numbers import FingertipNumbers, Section
from fingerslip.specimens.fingertip.outline import at_depth, outline_curve
from fingerslip.specimens.fingertip.pose import posed
from fingerslip.specimens.fingertip.receptors import receptor_sites
from fingerslip.specimens.fingertip.skin_surface import solid_shape

__all__ = ["reference_sites", "solid_receptor_sites"]

Floats = NDArray[np.float64]

_LINES: Mapping[str, Section] = MappingProxyType({"h": "sagittal", "v": "transverse"})
_NUMBER = 7
_MIDDLE = 3.5


def solid_receptor_sites(fingertip: FingertipNumbers) -> tuple[Site, ...]:
    """Return the candidate receptors in space: those of the sagittal section, in its plane z = 0.

    The mesh in space has a plain epidermis-dermis interface, so FA-I and SA-I sit on it, at the arc lengths at which
    the section has its ridges.

    Parameters
    ----------
    fingertip : FingertipNumbers
        A fingertip in space.

    Raises
    ------
    InputError
        Where the fingertip has only sections.
    """
    solid_shape(fingertip)
    plain = dataclasses.replace(fingertip.ridges, enabled=False)
    section = dataclasses.replace(fingertip, section="sagittal", ridges=plain)
    sites = receptor_sites(section)
    flat = np.array([site.position for site in sites])
    places = posed(fingertip, np.column_stack([flat, np.zeros(len(sites))]))
    return tuple(
        dataclasses.replace(site, position=_position(place)) for site, place in zip(sites, places, strict=True)
    )


def reference_sites(fingertip: FingertipNumbers, spacing: float = 2.2e-3) -> tuple[Site, ...]:
    """Return the reference nodes h1 to h7 and v1 to v7 of Wang et al. (2014), on the skin and the tissue surface.

    The horizontal line h runs along the finger (z = 0), towards the tip; the vertical line v across it (x = 0), towards
    +z. The paper says which of the nodes are in contact, h2 to h5 and v2 to v5, and shows the lines without
    dimensions. So the lowest point lies half way between nodes 3 and 4, and the spacing is assumed.

    Parameters
    ----------
    fingertip : FingertipNumbers
        A fingertip in space.
    spacing : float, optional
        Distance of the nodes along the skin [m].

    Returns
    -------
    tuple of Site
        ``skin-h1`` ... of the kind `skin surface`, then ``tissue-h1`` ... of the kind `tissue surface`, each below the
        one on the skin.

    Raises
    ------
    InputError
        Where the fingertip has only sections.
    """
    solid_shape(fingertip)
    layers = {"skin": ("epidermis", 0.0), "tissue": ("tissue", fingertip.layers.skin_thickness)}
    sites = []
    for layer, (region, depth) in layers.items():
        for line in _LINES:
            places = posed(fingertip, _line(fingertip, line, spacing, depth))
            sites += [
                Site(f"{layer}-{line}{number}", f"{layer} surface", _position(place), region)
                for number, place in enumerate(places, start=1)
            ]
    return tuple(sites)


def _line(fingertip: FingertipNumbers, line: str, spacing: float, depth: float) -> Floats:
    """Return the (7, 3) places of a line of reference nodes of the level finger [m]."""
    section = dataclasses.replace(fingertip, section=_LINES[line])
    arc_length = spacing * np.linspace(1 - _MIDDLE, _NUMBER - _MIDDLE, _NUMBER)
    along, up = at_depth(outline_curve(section), arc_length, depth).T
    still = np.zeros(_NUMBER)
    return np.column_stack([along, up, still] if line == "h" else [still, up, along])


def _position(place: Floats) -> tuple[float, ...]:
    return tuple(float(value) for value in place)
