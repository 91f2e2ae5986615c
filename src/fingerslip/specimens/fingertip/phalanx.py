"""The phalanx inside a fingertip: its contour in a section and its surface in 3D.

In 3D sections across the finger have the shape of the transverse contour. The one at x lies between the palmar and the
dorsal line of the sagittal contour, with the phalanx's width there: so the cut z = 0 is the sagittal contour, and the
cut x = 0 the transverse one.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.errors import InputError
from fingerslip.specimens.fingertip.numbers import FingertipNumbers
from fingerslip.specimens.fingertip.outline import Curve, at_depth, inward_normal, nearest, outline_curve
from fingerslip.specimens.fingertip.skin import depth_below_skin, skin_section, solid_shape
from fingerslip.units import coordinates, millimetres

_SPACING = 2e-5


def phalanx_contour(fingertip: FingertipNumbers) -> Floats:
    """Return the (n, 2) contour of the phalanx [m], counter-clockwise.

    A contour that ends on the proximal cut is open there, from the palmar to the dorsal end; else its last point is
    the first one again.
    """
    shape = _sagittal if fingertip.section == "sagittal" else _transverse
    contour = (_scale if fingertip.phalanx.variant == "scaled" else shape)(fingertip)
    curve = outline_curve(fingertip)
    _, rows = nearest(curve.points, contour)
    inward = inward_normal(curve, curve.arc_length[rows])
    _check_tissue(fingertip, contour, np.sum((contour - curve.points[rows]) * inward, axis=1))
    return contour


def _check_tissue(fingertip: FingertipNumbers, points: Floats, depth: Floats) -> None:
    """Refuse a phalanx whose points (n, dim) at depths (n,) [m] are nearer to the dermis than a tenth of the skin."""
    thickness = depth - fingertip.layers.skin_thickness
    needed, thinnest = 0.1 * fingertip.layers.skin_thickness, int(thickness.argmin())
    if thickness[thinnest] < needed:
        fault = f"{millimetres(thickness[thinnest], 3)} of tissue at {coordinates(points[thinnest], 3)}"
        allowed = f"needs >= {millimetres(needed, 3)} between phalanx and dermis"
        raise InputError("phalanx", fault, allowed, "make the skin thinner or the phalanx smaller")


def reaches_cut(contour: Floats) -> bool:
    """Tell whether a contour (n, 2) [m] is open, that is, ends on the proximal cut."""
    return not np.array_equal(contour[0], contour[-1])


def palmar_face(fingertip: FingertipNumbers, x: Floats) -> Floats:
    """Return the heights y (n,) [m] of the palmar face in the sagittal section at positions x (n,) [m]."""
    phalanx = fingertip.phalanx.sagittal
    hollow = np.exp(-(((x - phalanx.concavity_position) / phalanx.concavity_width) ** 2))
    depth = phalanx.concavity_depth if fingertip.phalanx.variant == "original" else 0.0
    # The palmar curve below the skin and the least tissue, behind the lowest point.
    curve = outline_curve(dataclasses.replace(fingertip, section="sagittal"))
    behind = curve.arc_length[curve.arc_length <= 0.0]
    limit = np.interp(x, *at_depth(curve, behind, fingertip.layers.skin_thickness + phalanx.minimum_tissue).T)
    return _rounded_maximum(phalanx.palmar_level + depth * hollow, limit, fingertip.phalanx.corner_radius / 2)


def _rounded_maximum(first: Floats, second: Floats | float, width: float) -> Floats:
    """Return the larger of two heights [m], rounded where they differ by less than `width`."""
    near = np.maximum(width - np.abs(first - second), 0.0)
    return np.asarray(np.maximum(first, second) + near**2 / (4.0 * width))


def _sagittal(fingertip: FingertipNumbers) -> Floats:
    phalanx, radius = fingertip.phalanx.sagittal, fingertip.phalanx.corner_radius
    start, end = -fingertip.sagittal.pad_length, phalanx.distal_end
    if end - radius <= start:
        allowed = f"needs a value > {millimetres(start + radius)}, distal of the proximal cut"
        raise InputError("phalanx.sagittal.distal_end", f"got {millimetres(end)}", allowed)
    face = palmar_face(fingertip, np.linspace(start, end - radius, 500))
    if face.max() >= phalanx.dorsal_level - radius:
        allowed = f"needs a value > {millimetres(face.max() + radius)}, above the palmar face"
        raise InputError("phalanx.sagittal.dorsal_level", f"got {millimetres(phalanx.dorsal_level)}", allowed)
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


def _transverse(fingertip: FingertipNumbers) -> Floats:
    phalanx = fingertip.phalanx.transverse
    count = int(2 * np.pi * phalanx.half_width / _SPACING)
    angle = np.linspace(0.0, 2 * np.pi, count)
    x, y = phalanx.half_width * np.cos(angle), phalanx.half_height * np.sin(angle)
    palmar = y < 0.0
    if fingertip.phalanx.variant == "flattened":
        y[palmar] = _rounded_maximum(y[palmar], phalanx.palmar_level, fingertip.phalanx.corner_radius / 2)
    else:
        # The hollow ends on the widest line of the phalanx, so that the contour stays a function of x on either side.
        share = y[palmar] / -phalanx.half_height
        y[palmar] += phalanx.concavity_depth * share * np.exp(-((x[palmar] / phalanx.concavity_width) ** 2))
    contour = np.column_stack([x, y])
    contour[-1] = contour[0]
    if fingertip.solid is None:
        return contour
    # In 3D it is stretched to the height of the sagittal one above the lowest point of the skin.
    along = fingertip.phalanx.sagittal
    if along.distal_end <= fingertip.phalanx.corner_radius:
        fault, allowed = f"got {millimetres(along.distal_end)}", "needs to reach beyond x = 0 in 3D"
        raise InputError("phalanx.sagittal.distal_end", fault, allowed)
    lowest, highest = float(palmar_face(fingertip, np.zeros(1))[0]), along.dorsal_level
    bottom, top = heights_in_the_middle(contour)
    return np.column_stack([contour[:, 0], lowest + (contour[:, 1] - bottom) * (highest - lowest) / (top - bottom)])


def heights_in_the_middle(contour: Floats) -> tuple[float, float]:
    """Return the heights y [m] at which a closed contour (n, 2) [m] crosses x = 0, the lower one first."""
    x, y = contour.T
    crossing = np.flatnonzero((x[:-1] > 0.0) != (x[1:] > 0.0))
    share = x[crossing] / (x[crossing] - x[crossing + 1])
    heights = y[crossing] + share * (y[crossing + 1] - y[crossing])
    return float(heights.min()), float(heights.max())


def _scale(fingertip: FingertipNumbers) -> Floats:
    """Return the outline moved inward by skin and tissue, its sharp ends rounded by the corner radius."""
    curve = outline_curve(fingertip)
    offset = fingertip.layers.skin_thickness + fingertip.phalanx.tissue_thickness
    ring = _rounded_offset(curve, offset, fingertip.phalanx.corner_radius)
    contour = ring if curve.closed else _clip(fingertip, ring)
    if len(contour) == 0:
        fault = f"got {millimetres(fingertip.phalanx.tissue_thickness)}"
        raise InputError("phalanx.tissue_thickness", fault, "needs a smaller value: nothing is left of the phalanx")
    return contour


def _rounded_offset(curve: Curve, offset: float, radius: float) -> Floats:
    """Return the closed curve at `offset`, with an arc of `radius` where it bends more sharply.

    A circle of that radius inside the curve touches it wherever its centre, deeper by the radius, has no other part
    of the outline nearer to it; the parts it cannot touch become arcs about its last centre.
    """
    arc_length = curve.arc_length[:-1] if curve.closed else curve.arc_length
    centres = at_depth(curve, arc_length, offset + radius)
    distance, _ = nearest(curve.points, centres)
    rows = np.flatnonzero(distance > (offset + radius) * (1 - 1e-9))
    if len(rows) == 0:
        return np.empty((0, 2))
    points, after = at_depth(curve, arc_length[rows], offset), np.roll(rows, -1)
    pieces, start = [], 0
    for number in np.flatnonzero((after - rows) % len(arc_length) > 1).tolist():
        # The inner points of a counter-clockwise arc.
        centre = (centres[rows[number]] + centres[after[number]]) / 2
        arms = points[number] - centre, points[(number + 1) % len(rows)] - centre
        first, last = (np.arctan2(*arm[::-1]) for arm in arms)
        angle = first + np.linspace(0.0, (last - first) % (2 * np.pi), 200)[1:-1]
        length = np.linspace(np.linalg.norm(arms[0]), np.linalg.norm(arms[1]), 200)[1:-1]
        arc = centre + length[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        pieces += [points[start : number + 1], arc]
        start = number + 1
    return np.vstack([*pieces, points[start:], points[:1]])


def _clip(fingertip: FingertipNumbers, ring: Floats) -> Floats:
    """Cut a ring off at the proximal cut, or keep it clear of the cut where it does not reach it."""
    cut = -fingertip.sagittal.pad_length
    reaching = len(ring) > 0 and ring[:, 0].min() <= cut
    limit = cut if reaching else cut + fingertip.phalanx.corner_radius
    inside = ring[:-1, 0] > limit
    if inside.all() or not inside.any():
        return ring if inside.any() else ring[:0]
    first, count = int(np.flatnonzero(inside & ~np.roll(inside, 1))[0]), np.count_nonzero(inside)
    turned = np.roll(ring[:-1], -first, axis=0)

    def end(start: Floats, stop: Floats) -> Floats:
        share = (limit - start[0]) / (stop[0] - start[0])
        return np.array([[limit, start[1] + share * (stop[1] - start[1])]])

    piece = [end(turned[-1], turned[0]), turned[:count], end(turned[count - 1], turned[count])]
    return np.vstack(piece if reaching else [*piece, piece[0]])


_ROW_SPACING = 1e-4
_QUARTER = 24
_CORNER_ROWS = 7
_FACE_ROWS = 16
# Thickness changes little from row to row, and distances to the skin are slow to compute.
_CHECKED = 3


@dataclass(frozen=True)
class PhalanxSurface:
    """Points of the phalanx's surface in rows across the finger."""

    points: Floats  # (rows, columns, 3), positions [m], rows from the proximal to the distal end
    open: bool  # whether the first row lies on the proximal cut


# Position x, lowest and highest point in the middle plane, and half width of each row [m]; whether the first is on the
# proximal cut.
_Rows = tuple[Floats, Floats, Floats, Floats, bool]


def phalanx_surface(fingertip: FingertipNumbers) -> PhalanxSurface:
    """Return the surface of the phalanx of a fingertip in 3D; refuse one that leaves no tissue."""
    solid_shape(fingertip)
    is_scaled = fingertip.phalanx.variant == "scaled"
    x, low, high, half_width, is_open = _scaled_rows(fingertip) if is_scaled else _rows(fingertip)
    across, up = _shape(fingertip)
    y = ((low + high) / 2)[:, None] + ((high - low) / 2)[:, None] * up
    surface = np.stack([np.broadcast_to(x[:, None], y.shape), y, half_width[:, None] * across], axis=-1)
    points = surface[::_CHECKED, ::2].reshape(-1, 3)
    _check_tissue(fingertip, points, depth_below_skin(fingertip, points))
    return PhalanxSurface(surface, is_open)


def _shape(fingertip: FingertipNumbers) -> tuple[Floats, Floats]:
    """Return the transverse contour, its half width and its half height in the middle plane scaled to one."""
    contour = phalanx_contour(dataclasses.replace(fingertip, section="transverse"))
    palmar, dorsal = heights_in_the_middle(contour)
    ring = contour[:-1]
    first = int(np.flatnonzero((ring[:, 0] > 0.0) & (np.roll(ring[:, 0], 1) <= 0.0))[0])
    right = np.roll(ring, -first, axis=0)
    half = np.vstack([[[0.0, palmar]], right[: int(np.argmin(right[:, 0] > 0.0))], [[0.0, dorsal]]])
    across = half[:, 0] / half[:, 0].max()
    up = 2 * (half[:, 1] - palmar) / (dorsal - palmar) - 1.0
    widest = int(across.argmax())
    # In equal parts between bottom, widest point and top, a quarter of the columns each.
    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(across), np.diff(up)))])
    lower, upper = (np.linspace(length[a], length[b], _QUARTER + 1) for a, b in ((0, widest), (widest, -1)))
    wanted = np.concatenate([lower, upper[1:]])
    across, up = np.interp(wanted, length, across), np.interp(wanted, length, up)
    return np.concatenate([across, -across[-2:0:-1]]), np.concatenate([up, up[-2:0:-1]])


def _rows(fingertip: FingertipNumbers) -> _Rows:
    """Return the rows of a phalanx with a flat distal end, whose edge is rounded."""
    phalanx, radius = fingertip.phalanx.sagittal, fingertip.phalanx.corner_radius
    start, stop = -fingertip.sagittal.pad_length, phalanx.distal_end - radius
    phalanx_contour(dataclasses.replace(fingertip, section="sagittal"))
    # Positions from start to stop, one of them at zero.
    before = np.linspace(start, 0.0, int(np.ceil(-start / _ROW_SPACING)) + 1)
    body = np.concatenate([before[:-1], np.linspace(0.0, stop, int(np.ceil(stop / _ROW_SPACING)) + 1)])
    turn = np.linspace(0.0, np.pi / 2, _CORNER_ROWS)[1:]
    shrinking = np.linspace(1.0, 0.0, _FACE_ROWS)[1:]
    x = np.concatenate([body, stop + radius * np.sin(turn), np.full(len(shrinking), phalanx.distal_end)])
    inset = np.concatenate([np.zeros(len(body)), radius * (1 - np.cos(turn)), np.full(len(shrinking), radius)])
    share = np.concatenate([np.ones(len(body) + len(turn)), shrinking])
    low, high = palmar_face(fingertip, np.minimum(x, stop)) + inset, phalanx.dorsal_level - inset
    middle, half = (low + high) / 2, (high - low) / 2
    width = _half_width(fingertip, np.minimum(x, stop)) - inset
    return x, middle - share * half, middle + share * half, share * width, True


def _half_width(fingertip: FingertipNumbers, x: Floats) -> Floats:
    """Return the half width [m] of the phalanx: base, waist, tuft and end joined by a monotone curve."""
    from scipy.interpolate import PchipInterpolator

    phalanx, widths = fingertip.phalanx, solid_shape(fingertip).phalanx
    if widths.end_half_width <= phalanx.corner_radius:
        fault, allowed = f"got {millimetres(widths.end_half_width)}", f"needs > {millimetres(phalanx.corner_radius)}"
        raise InputError("solid.phalanx.end_half_width", fault, f"{allowed} (phalanx.corner_radius)")
    points = {
        -fingertip.sagittal.pad_length: widths.base_half_width,
        widths.waist_position: widths.waist_half_width,
        0.0: phalanx.transverse.half_width,
        phalanx.sagittal.distal_end: widths.end_half_width,
    }
    return np.asarray(PchipInterpolator(list(points), list(points.values()))(x))


def _scaled_rows(fingertip: FingertipNumbers) -> _Rows:
    """Return the rows of the outline moved inward, in both planes."""
    contour = phalanx_contour(dataclasses.replace(fingertip, section="sagittal"))
    first, last = float(contour[:, 0].min()), float(contour[:, 0].max())
    if not first < -fingertip.phalanx.corner_radius < fingertip.phalanx.corner_radius < last:
        fault = f"reaches from x = {millimetres(first)} to {millimetres(last)}"
        raise InputError("phalanx", fault, "needs to reach to both sides of x = 0", "write a smaller tissue_thickness")
    # Positions from first to last, close to each other where the phalanx closes.
    count, is_open = int(np.ceil((last - first) / _ROW_SPACING)) + 1, reaches_cut(contour)
    sine = np.sin(np.linspace(0.0, np.pi / 2, count))
    behind = np.linspace(0.0, first, count) if is_open else first * sine
    x = np.concatenate([behind[:0:-1], last * sine])
    low, high = _heights(contour, x)
    across = phalanx_contour(dataclasses.replace(fingertip, section="transverse"))
    width = across[:, 0].max() * _planform(fingertip, x, (first, last), is_open)
    return x, low, high, width, is_open


def _heights(contour: Floats, x: Floats) -> tuple[Floats, Floats]:
    """Return the lowest and the highest point of a sagittal contour at positions x [m]."""
    if not reaches_cut(contour):
        contour = np.vstack([np.roll(contour[:-1], -int(contour[:-1, 0].argmin()), axis=0)] * 2)
        contour = contour[: len(contour) // 2 + 1]
    tip = int(contour[:, 0].argmax())
    palmar, dorsal = contour[: tip + 1], contour[tip:][::-1]
    low, high = (np.interp(x, part[:, 0], part[:, 1]) for part in (palmar, dorsal))
    low[-1] = high[-1] = contour[tip, 1]
    return low, high


def _planform(fingertip: FingertipNumbers, x: Floats, ends: tuple[float, float], is_open: bool) -> Floats:
    """Return the half width of a scaled phalanx relative to that at x = 0: the outline from above, moved inward."""
    offset = fingertip.layers.skin_thickness + fingertip.phalanx.tissue_thickness
    tip, widest = fingertip.sagittal.tip_length, fingertip.transverse.half_width
    angle = np.linspace(0.0, np.pi / 2, 500)
    ring = np.column_stack([tip * np.sin(angle), widest * np.cos(angle)])
    normal = np.column_stack([widest * np.sin(angle), tip * np.cos(angle)])
    moved = np.maximum(ring - offset * normal / np.linalg.norm(normal, axis=1, keepdims=True), 0.0)
    order = np.argsort(moved[:, 0], kind="stable")
    ahead = np.interp(np.maximum(x, 0.0) / ends[1], moved[order, 0] / moved[:, 0].max(), moved[order, 1])
    behind = np.maximum(skin_section(fingertip, np.minimum(x, 0.0))[2] - offset, 0.0) / (widest - offset)
    share: Floats = np.where(x > 0.0, ahead / (widest - offset), behind)
    if is_open:
        return share
    # An end that lies inside the finger closes as an ellipse.
    length = min(widest - offset, -ends[0])
    return share * np.sqrt(1.0 - np.clip((ends[0] + length - x) / length, 0.0, 1.0) ** 2)
