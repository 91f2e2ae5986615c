"""The contour of the distal phalanx in either section."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.specimens.fingertip.numbers import FingertipNumbers
from fingerslip.specimens.fingertip.outline import Curve, at_depth, inward_normal, outline_curve
from fingerslip.specimens.fingertip.phalanx import SagittalPhalanx
from fingerslip.units import coordinates, millimetres

__all__ = ["heights_in_the_middle", "palmar_face", "phalanx_contour", "reaches_cut"]

Floats = NDArray[np.float64]

_SPACING = 2e-5


def phalanx_contour(fingertip: FingertipNumbers) -> Floats:
    """Return the (n, 2) contour of the phalanx [m], counter-clockwise.

    A contour that ends on the proximal cut is open there, from the palmar to the dorsal end; else its last point is
    the first one again.
    """
    if fingertip.phalanx.variant == "scaled":
        contour = _scaled(fingertip)
    elif fingertip.section == "sagittal":
        contour = _sagittal(fingertip)
    else:
        contour = _transverse(fingertip)
    _check_tissue(fingertip, contour)
    return contour


def reaches_cut(contour: Floats) -> bool:
    """Tell whether a contour (n, 2) [m] is open, that is, ends on the proximal cut."""
    return not np.array_equal(contour[0], contour[-1])


def palmar_face(fingertip: FingertipNumbers, x: Floats) -> Floats:
    """Return the heights y (n,) [m] of the palmar face in the sagittal section at positions x (n,) [m]."""
    phalanx = fingertip.phalanx.sagittal
    hollow = np.exp(-(((x - phalanx.concavity_position) / phalanx.concavity_width) ** 2))
    depth = phalanx.concavity_depth if fingertip.phalanx.variant == "original" else 0.0
    limit = _palmar_limit(fingertip, fingertip.layers.skin_thickness + phalanx.minimum_tissue, x)
    return _rounded_maximum(phalanx.palmar_level + depth * hollow, limit, fingertip.phalanx.corner_radius / 2)


def _rounded_maximum(first: Floats, second: Floats | float, width: float) -> Floats:
    """Return the larger of two heights [m], rounded where they differ by less than `width`."""
    near = np.maximum(width - np.abs(first - second), 0.0)
    larger: Floats = np.maximum(first, second) + near**2 / (4.0 * width)
    return larger


def _palmar_limit(fingertip: FingertipNumbers, depth: float, x: Floats) -> Floats:
    """Return the heights y of the palmar curve at `depth` below the skin, behind the lowest point."""
    curve = outline_curve(dataclasses.replace(fingertip, section="sagittal"))
    palmar = curve.arc_length <= 0.0
    points = at_depth(curve, curve.arc_length[palmar], depth)
    return np.interp(x, points[:, 0], points[:, 1])


def _sagittal(fingertip: FingertipNumbers) -> Floats:
    phalanx, radius = fingertip.phalanx.sagittal, fingertip.phalanx.corner_radius
    start, end = -fingertip.sagittal.pad_length, phalanx.distal_end
    _check_sagittal(fingertip, phalanx)
    x = np.linspace(start, end - radius, int((end - radius - start) / _SPACING) + 1)
    palmar = np.column_stack([x, palmar_face(fingertip, x)])
    angle = np.linspace(0.0, np.pi / 2, 100)
    centre = palmar[-1] + [0.0, radius]
    lower = (centre + radius * np.column_stack([np.sin(angle), -np.cos(angle)]))[1:]
    upper = [end - radius, phalanx.dorsal_level - radius] + radius * np.column_stack([np.cos(angle), np.sin(angle)])
    side = _straight(lower[-1], upper[0])
    back = _straight(upper[-1], np.array([start, phalanx.dorsal_level]))
    return np.vstack([palmar, lower, side, upper, back, [[start, phalanx.dorsal_level]]])


def _straight(start: Floats, end: Floats) -> Floats:
    """Return the inner points of a straight line."""
    count = int(np.linalg.norm(end - start) / _SPACING) + 2
    return start + np.linspace(0.0, 1.0, count)[1:-1, None] * (end - start)


def _check_sagittal(fingertip: FingertipNumbers, phalanx: SagittalPhalanx) -> None:
    start, radius = -fingertip.sagittal.pad_length, fingertip.phalanx.corner_radius
    if phalanx.distal_end - radius <= start:
        allowed = f"needs a value > {millimetres(start + radius)}, distal of the proximal cut"
        raise InputError("phalanx.sagittal.distal_end", f"got {millimetres(phalanx.distal_end)}", allowed)
    face = palmar_face(fingertip, np.linspace(start, phalanx.distal_end - radius, 500))
    if face.max() >= phalanx.dorsal_level - radius:
        found = f"got {millimetres(phalanx.dorsal_level)}"
        allowed = f"needs a value > {millimetres(face.max() + radius)}, above the palmar face"
        raise InputError("phalanx.sagittal.dorsal_level", found, allowed)


def _transverse(fingertip: FingertipNumbers) -> Floats:
    phalanx = fingertip.phalanx.transverse
    count = int(2 * np.pi * phalanx.half_width / _SPACING)
    angle = np.linspace(0.0, 2 * np.pi, count)
    x, y = phalanx.half_width * np.cos(angle), phalanx.half_height * np.sin(angle)
    palmar = y < 0.0
    y[palmar] = _transverse_face(fingertip, x[palmar], y[palmar])
    contour = np.column_stack([x, y])
    contour[-1] = contour[0]
    return contour if fingertip.solid is None else _stretched(fingertip, contour)


def _stretched(fingertip: FingertipNumbers, contour: Floats) -> Floats:
    """Stretch a transverse contour to the height of the sagittal one above the lowest point of the skin."""
    phalanx = fingertip.phalanx
    if phalanx.sagittal.distal_end <= phalanx.corner_radius:
        found, allowed = f"got {millimetres(phalanx.sagittal.distal_end)}", "needs to reach beyond x = 0 in space"
        raise InputError("phalanx.sagittal.distal_end", found, allowed)
    lowest, highest = float(palmar_face(fingertip, np.zeros(1))[0]), phalanx.sagittal.dorsal_level
    palmar, dorsal = heights_in_the_middle(contour)
    height = lowest + (contour[:, 1] - palmar) * (highest - lowest) / (dorsal - palmar)
    return np.column_stack([contour[:, 0], height])


def heights_in_the_middle(contour: Floats) -> tuple[float, float]:
    """Return the heights y [m] at which a closed contour (n, 2) [m] crosses x = 0, the lower one first."""
    x, y = contour.T
    crossing = np.flatnonzero((x[:-1] > 0.0) != (x[1:] > 0.0))
    share = x[crossing] / (x[crossing] - x[crossing + 1])
    heights = y[crossing] + share * (y[crossing + 1] - y[crossing])
    return float(heights.min()), float(heights.max())


def _transverse_face(fingertip: FingertipNumbers, x: Floats, y: Floats) -> Floats:
    phalanx = fingertip.phalanx.transverse
    if fingertip.phalanx.variant == "flattened":
        return _rounded_maximum(y, phalanx.palmar_level, fingertip.phalanx.corner_radius / 2)
    # The hollow ends on the widest line of the phalanx, so that the contour stays a function of x on either side.
    share = y / -phalanx.half_height
    face: Floats = y + phalanx.concavity_depth * share * np.exp(-((x / phalanx.concavity_width) ** 2))
    return face


def _scaled(fingertip: FingertipNumbers) -> Floats:
    """Return the outline moved inward by skin and tissue, its sharp ends rounded by the corner radius."""
    curve = outline_curve(fingertip)
    offset = fingertip.layers.skin_thickness + fingertip.phalanx.tissue_thickness
    ring = _rounded_offset(curve, offset, fingertip.phalanx.corner_radius)
    contour = ring if curve.closed else _clipped(fingertip, ring)
    if len(contour) == 0:
        found = f"got {millimetres(fingertip.phalanx.tissue_thickness)}"
        raise InputError("phalanx.tissue_thickness", found, "needs a smaller value: nothing is left of the phalanx")
    return contour


def _rounded_offset(curve: Curve, offset: float, radius: float) -> Floats:
    """Return the closed curve at `offset`, with an arc of `radius` where it bends more sharply.

    A circle of that radius inside the curve touches it wherever its centre, deeper by the radius, has no other part
    of the outline nearer to it; the parts it cannot touch become arcs about its last centre.
    """
    from scipy.spatial import cKDTree

    arc_length = curve.arc_length[:-1] if curve.closed else curve.arc_length
    centres = at_depth(curve, arc_length, offset + radius)
    distance, _ = cKDTree(curve.points).query(centres)
    kept = np.flatnonzero(distance > (offset + radius) * (1 - 1e-9))
    if len(kept) == 0:
        return np.empty((0, 2))
    points, after = at_depth(curve, arc_length[kept], offset), np.roll(kept, -1)
    pieces = []
    for number in range(len(kept)):
        pieces.append(points[number : number + 1])
        if (after[number] - kept[number]) % len(arc_length) > 1:
            centre = (centres[kept[number]] + centres[after[number]]) / 2
            pieces.append(_arc(centre, points[number], points[(number + 1) % len(kept)]))
    return np.vstack([*pieces, points[:1]])


def _arc(centre: Floats, start: Floats, end: Floats) -> Floats:
    """Return the inner points of a counter-clockwise arc."""
    first, last = (np.arctan2(*(point - centre)[::-1]) for point in (start, end))
    angle = first + np.linspace(0.0, (last - first) % (2 * np.pi), 200)[1:-1]
    radius = np.linspace(np.linalg.norm(start - centre), np.linalg.norm(end - centre), 200)[1:-1]
    circle: Floats = centre + radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    return circle


def _clipped(fingertip: FingertipNumbers, ring: Floats) -> Floats:
    """Cut a ring off at the proximal cut, or keep it clear of the cut where it does not reach it."""
    cut = -fingertip.sagittal.pad_length
    reaching = len(ring) > 0 and ring[:, 0].min() <= cut
    limit = cut if reaching else cut + fingertip.phalanx.corner_radius
    inside = ring[:-1, 0] > limit
    if inside.all() or not inside.any():
        return ring if inside.any() else ring[:0]
    first = int(np.flatnonzero(inside & ~np.roll(inside, 1))[0])
    body, before = np.roll(ring[:-1], -first, axis=0)[: np.count_nonzero(inside)], np.roll(ring[:-1], 1, axis=0)[first]
    after = np.roll(ring[:-1], -first, axis=0)[np.count_nonzero(inside)]
    ends = [_at_x(before, body[0], limit), _at_x(body[-1], after, limit)]
    return np.vstack([ends[0], body, ends[1]] if reaching else [ends[0], body, ends[1], ends[0]])


def _at_x(start: Floats, end: Floats, x: float) -> Floats:
    share = (x - start[0]) / (end[0] - start[0])
    return np.array([[x, start[1] + share * (end[1] - start[1])]])


def _check_tissue(fingertip: FingertipNumbers, contour: Floats) -> None:
    """Refuse a phalanx that comes nearer to the dermis than a tenth of the skin's thickness."""
    thickness = _depth_below_skin(fingertip, contour) - fingertip.layers.skin_thickness
    needed = 0.1 * fingertip.layers.skin_thickness
    thinnest = int(thickness.argmin())
    if thickness[thinnest] < needed:
        found = f"{millimetres(thickness[thinnest], 3)} of tissue at {coordinates(contour[thinnest], 3)}"
        allowed = f"needs >= {millimetres(needed, 3)} between phalanx and dermis"
        raise InputError("phalanx", found, allowed, "make the skin thinner or the phalanx smaller")


def _depth_below_skin(fingertip: FingertipNumbers, points: Floats) -> Floats:
    """Return the depths [m] of (n, 2) points below the outline, negative outside."""
    from scipy.spatial import cKDTree

    curve = outline_curve(fingertip)
    _, nearest = cKDTree(curve.points).query(points)
    inward = inward_normal(curve, curve.arc_length[nearest])
    depth: Floats = np.sum((points - curve.points[nearest]) * inward, axis=1)
    return depth
