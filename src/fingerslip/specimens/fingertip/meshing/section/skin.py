"""The skin's layers as rows of cells swept inward from the outer surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fingerslip.errors import InputError
from fingerslip.mesh.sizes import ElementSizes, graded
from fingerslip.specimens.fingertip.interfaces import interface_depth, surface_depth
from fingerslip.specimens.fingertip.numbers import FingertipNumbers
from fingerslip.specimens.fingertip.outline import Curve, arc_length_at_cut, at_depth, outline_curve
from fingerslip.units import millimetres

__all__ = ["SkinGrid", "column_limits", "row_counts", "sweep_skin"]

Floats = NDArray[np.float64]

# Rows go all round the finger, so columns may only widen as far as the cells keep a good shape.
_LARGEST_ASPECT = {"Q4": 6.0, "T3": 2.5, "T6": 2.5}
_TISSUE_SHARE = 0.7
_BLEND = 3.0


@dataclass(frozen=True)
class SkinGrid:
    """Nodes of the skin in rows from the outer surface to the dermis-tissue interface."""

    points: Floats  # (rows, columns, 2), node positions [m]
    arc_length: Floats  # (columns,), arc length of each column on the outer surface from the lowest point [m]
    epidermis_rows: int  # number of rows of cells in the epidermis
    closed: bool  # whether the last column is followed by the first one
    contact: tuple[float, float]  # first and last arc length of the part meshed at the contact size [m]


def sweep_skin(fingertip: FingertipNumbers, sizes: ElementSizes, contour: Floats) -> SkinGrid:
    """Divide the skin into rows and columns.

    Arrays: contour (n, 2) [m].
    """
    curve = outline_curve(fingertip)
    spacing = _contact_spacing(fingertip, sizes)
    rows = row_counts(fingertip, spacing)
    limits = arc_length_at_cut(fingertip, curve, 0.0)
    _check_zone(fingertip, limits)
    contact = _contact_range(curve, sizes.contact_reach, limits)

    narrowest, widest = column_limits(fingertip, sizes, rows)

    def wanted(arc_length: Floats) -> Floats:
        beneath = at_depth(curve, arc_length, fingertip.layers.skin_thickness)
        tissue, _ = cKDTree(contour).query(beneath)
        width: Floats = np.clip(_TISSUE_SHARE * tissue, min(narrowest, widest), widest)
        return width

    columns = _columns(limits, contact, spacing, wanted)
    points = np.stack([_row(fingertip, curve, columns, share) for share in _shares(rows)])
    closed = curve.closed
    return SkinGrid(points[:, :-1] if closed else points, columns[:-1] if closed else columns, rows[0], closed, contact)


def column_limits(fingertip: FingertipNumbers, sizes: ElementSizes, rows: tuple[int, int]) -> tuple[float, float]:
    """Return the least and the largest width of a column [m] that keep the skin's cells in good shape."""
    heights = fingertip.layers.epidermis_thickness / rows[0], fingertip.layers.dermis_thickness / rows[1]
    aspect = _LARGEST_ASPECT[sizes.element]
    return max(heights) / aspect, min(sizes.bulk_size, aspect * min(heights))


def _contact_spacing(fingertip: FingertipNumbers, sizes: ElementSizes) -> float:
    """Return the spacing of the columns: near the contact size, and so that every ridge tip has a column."""
    features = [(n, f) for n, f in (("ridges", fingertip.ridges), ("fingerprint", fingertip.fingerprint)) if f.enabled]
    for name, feature in features:
        _check_resolved(name, feature.pitch, sizes.contact_size)
    if not features:
        return sizes.contact_size
    half_pitch = features[0][1].pitch / 2
    return half_pitch / max(2, round(half_pitch / sizes.contact_size))


def _check_resolved(name: str, pitch: float, contact_size: float) -> None:
    # Refining silently would turn a mesh study into a series of equal meshes, so coarse sizes are refused.
    if contact_size > pitch / 3:
        found = f"got {millimetres(contact_size)}"
        allowed = f"needs <= {millimetres(pitch / 3)}, a third of {name}.pitch"
        repair = f"write '{millimetres(pitch / 4)}' or switch the {name} off"
        raise InputError("mesh.contact_size", found, allowed, repair)


def row_counts(fingertip: FingertipNumbers, spacing: float) -> tuple[int, int]:
    """Return how many rows of cells epidermis and dermis have where columns are `spacing` [m] apart."""
    layers = fingertip.layers
    # Dermis rows may be a little taller: nothing in the dermis changes as fast as under the surface.
    in_dermis = round(layers.dermis_thickness / (1.25 * spacing))
    return max(1, round(layers.epidermis_thickness / spacing)), max(1, in_dermis)


def _check_zone(fingertip: FingertipNumbers, limits: tuple[float, float]) -> None:
    zone, place = fingertip.zone, f"{fingertip.section}.zone"
    if not limits[0] <= zone.start < zone.end <= limits[1]:
        found = f"reaches from {millimetres(zone.start)} to {millimetres(zone.end)}"
        allowed = f"needs to lie within {millimetres(limits[0])} to {millimetres(limits[1])}, the skin of the section"
        raise InputError(place, found, allowed)


def _contact_range(curve: Curve, reach: float, limits: tuple[float, float]) -> tuple[float, float]:
    low = curve.points[:, 1] <= curve.points[:, 1].min() + reach
    inside = low & (curve.arc_length >= limits[0]) & (curve.arc_length <= limits[1])
    arc_length = curve.arc_length[inside]
    return float(arc_length[0]), float(arc_length[-1])


def _columns(
    limits: tuple[float, float], contact: tuple[float, float], spacing: float, wanted: Callable[[Floats], Floats]
) -> Floats:
    """Return the arc lengths of the columns: evenly spaced in the contact, growing on either side of it."""
    pair = 2 * spacing
    # At least one pair of columns is left on either side, so that a side never ends in a sliver.
    first = max(int(np.floor(contact[0] / pair)), int(np.ceil(limits[0] / pair)) + 1)
    last = min(int(np.ceil(contact[1] / pair)), int(np.floor(limits[1] / pair)) - 1)
    middle = np.arange(2 * first, 2 * last + 1) * spacing
    before, after = np.linspace(limits[0], middle[0], 2000), np.linspace(middle[-1], limits[1], 2000)
    sizes_before, sizes_after = (wanted(side) for side in (before, after))
    sizes_before[-1] = sizes_after[0] = spacing
    return np.concatenate([graded(before, sizes_before)[:-1], middle, graded(after, sizes_after)[1:]])


def _shares(rows: tuple[int, int]) -> list[tuple[float, float]]:
    """Return for each row of nodes its share of the epidermis and of the dermis."""
    epidermis = [(k / rows[0], 0.0) for k in range(rows[0])]
    return epidermis + [(1.0, k / rows[1]) for k in range(rows[1] + 1)]


def _row(fingertip: FingertipNumbers, curve: Curve, columns: Floats, share: tuple[float, float]) -> Floats:
    """Return the (columns, 2) nodes of one row; in an open section its ends lie on the proximal cut."""
    layers = fingertip.layers
    level = share[0] * layers.epidermis_thickness + share[1] * layers.dermis_thickness
    ends = arc_length_at_cut(fingertip, curve, level)
    foot = _shifted(columns, ends, _BLEND * layers.skin_thickness)
    surface, interface = surface_depth(fingertip, foot), interface_depth(fingertip, foot)
    depth = surface + share[0] * (interface - surface) + share[1] * (layers.skin_thickness - interface)
    row = at_depth(curve, foot, depth)
    if not curve.closed:
        row[[0, -1], 0] = -fingertip.sagittal.pad_length
    return row


def _shifted(columns: Floats, ends: tuple[float, float], blend: float) -> Floats:
    """Shift columns near the ends so that the row starts and ends at the arc lengths `ends`."""
    near_first = np.clip(1.0 - (columns - columns[0]) / blend, 0.0, 1.0)
    near_last = np.clip(1.0 - (columns[-1] - columns) / blend, 0.0, 1.0)
    shifted: Floats = columns + near_first * (ends[0] - columns[0]) + near_last * (ends[1] - columns[-1])
    return shifted
