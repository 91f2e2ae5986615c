"""Sites of a fingertip: receptors, reference nodes and markers on the skin."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.marker_layouts import hexagonal_layout
from fingerslip.sites import Site, ring_sites
from fingerslip.specimens.fingertip.numbers import FingertipNumbers, Section
from fingerslip.specimens.fingertip.outline import at_depth, interface_depth, outline_curve
from fingerslip.specimens.fingertip.skin import pose_points, skin_section, solid_shape


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

    Examples
    --------
    >>> import fingerslip as fs
    >>> sites = fs.receptor_sites(fs.preset("wang2014-2d"))
    >>> fast = fs.Recording(sites=tuple(site for site in sites if site.kind in ("FA-I", "FA-II")))
    >>> len(sites), len(fast.sites), fast.sites[0].name
    (144, 72, 'FA-I-01')
    """
    zone, pitch, curve = fingertip.zone, fingertip.ridges.pitch, outline_curve(fingertip)

    def ridges(shift: float) -> Floats:
        """Return the arc lengths (k + shift) pitch at which ridges have their full height."""
        first = np.ceil((zone.start + zone.fade) / pitch - shift)
        last = np.floor((zone.end - zone.fade) / pitch - shift)
        return np.asarray((np.arange(first, last + 1) + shift) * pitch)

    intermediate, limiting = ridges(0.0), ridges(0.5)
    border = fingertip.layers.skin_thickness - fingertip.receptors.sa_ii_height
    rows = (
        ("FA-I", limiting, interface_depth(fingertip, limiting), "dermis"),
        ("SA-I", intermediate, interface_depth(fingertip, intermediate), "epidermis"),
        ("FA-II", intermediate, fingertip.receptors.fa_ii_depth, "tissue"),
        ("SA-II", intermediate, border, "dermis"),
    )
    return tuple(
        Site(f"{kind}-{number:02d}", kind, _position(point), region)
        for kind, arc_length, depth, region in rows
        for number, point in enumerate(at_depth(curve, arc_length, depth), start=1)
    )


_LINES: Mapping[str, Section] = MappingProxyType({"h": "sagittal", "v": "transverse"})


def solid_receptor_sites(fingertip: FingertipNumbers) -> tuple[Site, ...]:
    """Return the candidate receptors in 3D: those of the sagittal section, in its plane z = 0.

    The mesh in 3D has a plain epidermis-dermis interface, so FA-I and SA-I sit on it, at the arc lengths at which
    the section has its ridges.

    Parameters
    ----------
    fingertip : FingertipNumbers
        A fingertip in 3D.

    Examples
    --------
    >>> import fingerslip as fs
    >>> sites = fs.solid_receptor_sites(fs.preset("wang2014-3d"))
    >>> len(sites), sites[0].name
    (144, 'FA-I-01')
    """
    solid_shape(fingertip)
    plain = dataclasses.replace(fingertip.ridges, enabled=False)
    section = dataclasses.replace(fingertip, section="sagittal", ridges=plain)
    sites = receptor_sites(section)
    flat = np.array([site.position for site in sites])
    places = pose_points(fingertip, np.column_stack([flat, np.zeros(len(sites))]))
    return tuple(
        dataclasses.replace(site, position=_position(point)) for site, point in zip(sites, places, strict=True)
    )


def reference_sites(fingertip: FingertipNumbers, spacing: float = 2.2e-3) -> tuple[Site, ...]:
    """Return the reference nodes h1 to h7 and v1 to v7 of Wang et al. (2014), on the skin and the tissue surface.

    They are ``skin-h1`` ... of the kind `skin surface`, then below them ``tissue-h1`` ... of the kind `tissue surface`.
    The horizontal line h runs along the finger (z = 0), towards the tip; the vertical line v across it (x = 0), towards
    +z. The paper says which of the nodes are in contact, h2 to h5 and v2 to v5, and shows the lines without
    dimensions. So the lowest point lies half way between nodes 3 and 4, and the spacing is assumed.

    Parameters
    ----------
    fingertip : FingertipNumbers
        A fingertip in 3D.
    spacing : float, optional
        Distance of the nodes along the skin [m].

    Examples
    --------
    >>> import fingerslip as fs
    >>> sites = fs.reference_sites(fs.preset("wang2014-3d"))
    >>> sites[0].name, sites[-1].name
    ('skin-h1', 'tissue-v7')
    """
    solid_shape(fingertip)
    layers = {"skin": ("epidermis", 0.0), "tissue": ("tissue", fingertip.layers.skin_thickness)}
    arc_length, still, sites = spacing * np.linspace(-2.5, 3.5, 7), np.zeros(7), []
    for layer, (region, depth) in layers.items():
        for line, name in _LINES.items():
            along, up = at_depth(outline_curve(dataclasses.replace(fingertip, section=name)), arc_length, depth).T
            level = np.column_stack([along, up, still] if line == "h" else [still, up, along])
            sites += [
                Site(f"{layer}-{line}{number}", f"{layer} surface", _position(point), region)
                for number, point in enumerate(pose_points(fingertip, level), start=1)
            ]
    return tuple(sites)


def _position(point: Floats) -> tuple[float, ...]:
    return tuple(map(float, point))


def skin_markers(fingertip: FingertipNumbers, spacing: float = 1.5e-3, layers: int = 4) -> tuple[Site, ...]:
    """Return dots on the skin around its lowest point: a hexagonal lattice where it is seen from straight below.

    No paper prints such dots with dimensions; spacing [m] and number are assumed.
    """
    solid_shape(fingertip)
    layout = hexagonal_layout(spacing, layers)
    x, z = layout.position.T
    centre, height, width = skin_section(fingertip, x)
    palmar = np.column_stack([x, centre - height * np.sqrt(1.0 - (z / width) ** 2), z])
    return ring_sites("external marker", layout.ring, pose_points(fingertip, palmar), "epidermis")
