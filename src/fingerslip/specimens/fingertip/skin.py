"""The outer surface of the fingertip in 3D: its points, its normals, what lies below it, and how the plate finds it.

Every section across the finger is an ellipse between the lowest and the highest line of the sagittal outline; the tip
is an ellipsoid. Axes as in the sagittal section: x along the finger towards the tip, y up, z across.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.errors import InputError
from fingerslip.specimens.fingertip.numbers import FingertipNumbers, SolidShape
from fingerslip.specimens.fingertip.outline import fade, nearest, outline_curve, surface_depth


def relief_depth(fingertip: FingertipNumbers, points: Floats) -> Floats:
    """Return the depths [m] of the skin at (n, 3) points of its mean surface [m]: negative on fingerprint crests.

    Crests run across the finger; along it the ripples are those of the sagittal section. They fade at the ends of the
    ridge zones of both sections, and there are none on the back.
    """

    def palmar_arc_length(section: FingertipNumbers, along: Floats) -> Floats:
        """Return the arc lengths of the palmar half of a section at positions along its horizontal axis [m]."""
        curve = outline_curve(section)
        widest = curve.points[:, 0].argmax()
        palmar = slice(int(curve.points[:widest, 0].argmin()), int(widest) + 1)
        return np.interp(along, curve.points[palmar, 0], curve.arc_length[palmar])

    sagittal, transverse = (dataclasses.replace(fingertip, section=name) for name in ("sagittal", "transverse"))
    ripple = surface_depth(sagittal, palmar_arc_length(sagittal, points[:, 0]))
    share = fade(fingertip.transverse.zone, palmar_arc_length(transverse, points[:, 2]))
    return np.asarray(ripple * share * (points[:, 1] < 0.0))


_PROJECTIONS = 20
_ROW_SPACING = 2e-4
_QUARTER = 60


def solid_shape(fingertip: FingertipNumbers) -> SolidShape:
    """Return what the fingertip in 3D has beyond its sections."""
    if fingertip.solid is None:
        repair = "start from the preset wang2014-3d, or give its values"
        raise InputError("fingertip.solid", "is missing", "needs the widths of the finger in 3D", repair)
    return fingertip.solid


def skin_section(fingertip: FingertipNumbers, x: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the ellipses across the finger at the positions x [m]: centre height, half height and half width [m].

    Arrays: x (n,) [m].
    """
    sagittal, widest = fingertip.sagittal, fingertip.transverse.half_width
    back = (np.minimum(x, 0.0) / sagittal.pad_length) ** 2
    ahead = np.sqrt(np.maximum(1.0 - (np.maximum(x, 0.0) / sagittal.tip_length) ** 2, 0.0))
    rise = sagittal.pad_rise * back / 2
    width = widest + (solid_shape(fingertip).base_half_width - widest) * back
    return rise, (sagittal.half_height - rise) * ahead, width * ahead


def inward_skin_normal(fingertip: FingertipNumbers, points: Floats) -> Floats:
    """Return the (n, 3) unit normals into the finger at (n, 3) points on its outer surface [m]."""
    _, gradient = _level(fingertip, points)
    return np.asarray(-gradient / np.linalg.norm(gradient, axis=1, keepdims=True))


def onto_skin(fingertip: FingertipNumbers, points: Floats) -> Floats:
    """Return the (n, 3) points of the outer surface next to (n, 3) points near it [m], along its normals."""
    moved = points.copy()
    for _ in range(_PROJECTIONS):
        level, gradient = _level(fingertip, moved)
        step = level[:, None] * gradient / np.sum(gradient**2, axis=1, keepdims=True)
        moved -= step
        if np.abs(step).max(initial=0.0) < 1e-12:
            break
    return moved


def below_skin(fingertip: FingertipNumbers, points: Floats, depth: Floats | float) -> Floats:
    """Return the (n, 3) points at `depth` [m] below (n, 3) points of the outer surface, along its normals."""
    inward = np.broadcast_to(np.asarray(depth, dtype=float), len(points))
    return points + inward[:, None] * inward_skin_normal(fingertip, points)


def skin_ring(fingertip: FingertipNumbers, x: Floats, angle: Floats) -> Floats:
    """Return the (n, 3) points of the outer surface at positions x (n,) [m] and angles (n,) [rad].

    The angle of the ellipse across the finger is 0 at its lowest point and grows towards +z.
    """
    centre, height, width = skin_section(fingertip, x)
    return np.column_stack([x, centre - height * np.cos(angle), width * np.sin(angle)])


def skin_grid(fingertip: FingertipNumbers) -> Floats:
    """Return (rows, columns, 3) points of the outer surface [m] from the proximal cut to the tip, x = 0 among them.

    Columns run from the lowest line z = 0 towards +z and round, a quarter of them to either side and to the back.
    """
    outline = fingertip.sagittal
    behind = np.linspace(-outline.pad_length, 0.0, int(np.ceil(outline.pad_length / _ROW_SPACING)) + 1)
    count = int(np.ceil(outline.tip_length / _ROW_SPACING)) + 1
    ahead = outline.tip_length * np.sin(np.linspace(0.0, np.pi / 2, count))
    x, angle = np.concatenate([behind[:-1], ahead]), np.arange(4 * _QUARTER) * np.pi / (2 * _QUARTER)
    grid = skin_ring(fingertip, np.repeat(x, len(angle)), np.tile(angle, len(x))).reshape(len(x), -1, 3)
    grid[:, [0, 2 * _QUARTER], 2] = 0.0
    return grid


def depth_below_skin(fingertip: FingertipNumbers, points: Floats) -> Floats:
    """Return the depths [m] of (n, 3) points below the outer surface, negative outside; good to some micrometres."""
    surface = skin_grid(fingertip).reshape(-1, 3)
    surface = surface[nearest(surface, points)[1]]
    return np.asarray(np.sum((points - surface) * inward_skin_normal(fingertip, surface), axis=1))


def _level(fingertip: FingertipNumbers, points: Floats) -> tuple[Floats, Floats]:
    """Return of (n, 3) points a function that is zero on the surface and negative inside, and its (n, 3) gradient."""
    ahead, outline = points[:, 0] > 0.0, fingertip.sagittal
    level, gradient = np.empty(len(points)), np.empty((len(points), 3))
    axes = [outline.tip_length, outline.half_height, fingertip.transverse.half_width]
    share = points[ahead] / axes
    level[ahead], gradient[ahead] = np.sum(share**2, axis=1) - 1.0, 2 * share / axes
    x, y, z = points[~ahead].T
    centre, height, width = skin_section(fingertip, x)
    centre_slope = outline.pad_rise * x / outline.pad_length**2
    base, widest = solid_shape(fingertip).base_half_width, fingertip.transverse.half_width
    width_slope = 2 * (base - widest) * x / outline.pad_length**2
    up, across = (y - centre) / height, z / width
    # The half height falls as the centre rises.
    along = -2 * up * centre_slope / height + 2 * up**2 * centre_slope / height - 2 * across**2 * width_slope / width
    level[~ahead] = up**2 + across**2 - 1.0
    gradient[~ahead] = np.column_stack([along, 2 * up / height, 2 * across / width])
    return level, gradient


def pose_points(fingertip: FingertipNumbers, points: Floats) -> Floats:
    """Return (n, 3) points [m] of a level finger where they are when the finger stands at its angle.

    The finger is turned about z and shifted so that the lowest point of its skin is at x = 0, y = -`half_height`.
    """
    cosine, sine = np.cos(solid_shape(fingertip).angle), np.sin(solid_shape(fingertip).angle)
    turn = np.array([[cosine, -sine], [sine, cosine]])
    curve = outline_curve(dataclasses.replace(fingertip, section="sagittal"))
    skin = curve.points[curve.points[:, 0] >= -fingertip.sagittal.pad_length] @ turn.T
    lowest = skin[skin[:, 1].argmin()]
    turned = points.copy()
    turned[:, :2] = points[:, :2] @ turn.T - lowest - [0.0, fingertip.sagittal.half_height]
    return turned
