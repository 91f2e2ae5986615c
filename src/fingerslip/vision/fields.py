"""Fields from moving markers: displacement, velocity, strain, and what rigid motions leave, as one labelled dataset."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Floats
from fingerslip.errors import InputError
from fingerslip.libraries import xr
from fingerslip.vision.tracks import check_tracks

Ints = NDArray[np.intp]

_DEGREE = 2  # of the polynomials that velocities come from
_FLAT = 0.1  # height over longest edge of a triangle that is left out
_MARKER = ("time", "marker")

#: Dimensions, unit and meaning of each field; ``length`` is the unit of the tracks.
FIELDS: Mapping[str, tuple[tuple[str, ...], str, str]] = {
    "rest": (("marker", "axis"), "length", "position at rest"),
    "position": ((*_MARKER, "axis"), "length", "position"),
    "displacement": ((*_MARKER, "axis"), "length", "displacement from rest"),
    "velocity": ((*_MARKER, "axis"), "length/s", "smooth velocity"),
    "divergence": (_MARKER, "1", "divergence of the displacement in the plane of x and y"),
    "curl": (_MARKER, "1", "curl of the displacement in the plane of x and y, from x towards y"),
    "rigid_translation": (("time", "axis"), "length", "translation of the rigid motion that fits best"),
    "rigid_rotation": (("time",), "rad", "rotation of the rigid motion that fits best"),
    "rigid_residual": ((*_MARKER, "axis"), "length", "position less that of the rigid motion that fits best"),
    "rigid_residual_rms": (("time",), "length", "root mean square of what the rigid motion leaves"),
    "strain": (("time", "triangle", "strain_component"), "1", "Green's strain in the plane of x and y"),
    "triangle_marker": (("triangle", "corner"), "", "row of the marker at the corner of a triangle"),
    "contact_centroid": (("time", "axis"), "length", "middle of the markers that are spread, NaN where none is"),
}


def marker_fields(
    tracks: xr.Dataset, *, rest: int = 1, smoothing: float = 0.2, spread_floor: float = 0.01
) -> xr.Dataset:
    """Return the :data:`FIELDS` of moving markers, each with `units` and `long_name`.

    In pixels y points down, so that a positive curl or rotation is clockwise to the eye.

    Parameters
    ----------
    tracks : xarray.Dataset
        Tracks in pixels or metres. What was not seen is NaN in the fields too, and has no weight in any mean.
    rest : int, optional
        Number of frames at the start over which positions at rest are averaged.
    smoothing : float, optional
        Time that the fits of the velocity span [s]; 0.2, assumed.
    spread_floor : float, optional
        Divergence [-] above which a marker counts for the contact centroid; 0.01, assumed.

    Raises
    ------
    InputError
        Where the dataset is no tracks, or shorter than `rest` or `smoothing`.

    Examples
    --------
    >>> import numpy as np
    >>> import fingerslip as fs
    >>> from fingerslip.marker_layouts import ring_layout
    >>> from fingerslip.vision.tracks import make_tracks
    >>> rest = fs.ring_layout(1e-3, (1, 8)).position
    >>> times = np.arange(20) / 30.0
    >>> growing = rest * (1.0 + 0.1 * times)[:, None, None]
    >>> fields = fs.marker_fields(fs.make_tracks(growing, times, units="m"))
    >>> round(float(fields["divergence"][15, 0]), 6)
    0.1
    """
    check_tracks(tracks)
    position, times = tracks["position"].values, tracks["time"].values
    before = rest_positions(position, rest)
    plane, moved = before[:, :2], position[:, :, :2]
    triangles = marker_triangles(plane)
    gradients = triangle_gradients(plane, moved, triangles)
    motions = fit_rigid_motions(before, position)
    squares = (motions.residual**2).sum(axis=2)
    counts = (~np.isnan(squares)).sum(axis=1)
    divergence = marker_means(gradients[..., 0, 0] + gradients[..., 1, 1], plane, triangles)
    values = {
        "rest": before,
        "position": position,
        "displacement": position - before,
        "velocity": smooth_velocity(position, times, window_frames(times, smoothing)),
        "divergence": divergence,
        "curl": marker_means(gradients[..., 1, 0] - gradients[..., 0, 1], plane, triangles),
        "rigid_translation": motions.translation,
        "rigid_rotation": motions.rotation,
        "rigid_residual": motions.residual,
        "rigid_residual_rms": np.where(counts > 0, np.sqrt(np.nansum(squares, axis=1) / np.maximum(counts, 1)), np.nan),
        "strain": green_strain(gradients),
        "triangle_marker": triangles,
        "contact_centroid": contact_centroid(position, divergence, spread_floor),
    }
    length = tracks["position"].attrs["units"]
    variables = {
        name: xr.Variable(dims, values[name], {"units": unit.replace("length", length), "long_name": meaning})
        for name, (dims, unit, meaning) in FIELDS.items()
    }
    coords = {name: tracks.variables[name] for name in tracks.coords} | {"strain_component": ["xx", "yy", "xy"]}
    settings = {"rest_frames": rest, "smoothing": smoothing, "spread_floor": spread_floor}
    return xr.Dataset(variables, coords=coords, attrs=tracks.attrs | settings)


def rest_positions(position: Floats, frames: int) -> Floats:
    """Return the mean of the first positions (n_times, n_markers, n_axes); NaN for markers that are not seen there."""
    if not 1 <= frames <= len(position):
        raise InputError("rest", f"got {frames} frames", f"needs 1 to {len(position)}, as many as there are")
    counts = (~np.isnan(position[:frames])).sum(axis=0)
    return np.where(counts > 0, np.nansum(position[:frames], axis=0) / np.maximum(counts, 1), np.nan)


def window_frames(times: Floats, smoothing: float) -> int:
    """Return the odd number of frames, at least five, that a smoothing time [s] spans."""
    if not (np.isfinite(smoothing) and smoothing > 0):
        raise InputError("smoothing", f"got {smoothing}", "needs a time > 0 in seconds")
    step = float(np.median(np.diff(times))) if times.size > 1 else np.inf
    frames = 2 * max(round(0.5 * smoothing / step), _DEGREE) + 1
    if frames > times.size:
        fault = f"{times.size} frames, and the smoothing time spans {frames}"
        raise InputError("tracks: time", f"has {fault}", "needs as many frames", "give a shorter smoothing time")
    return frames


def smooth_velocity(position: Floats, times: Floats, frames: int) -> Floats:
    """Return the velocity of markers (n_times, n_markers, n_axes) by parabolas fitted to a few frames.

    At even times with every frame this is the filter of Savitzky and Golay (1964); here times may be uneven, and frames
    in which a marker was not seen have no weight. At both ends the parabola of the first or last frames is used. White
    noise of a deviation s in the positions becomes s sqrt(3 / (h (h + 1) (2 h + 1))) / step in the velocity, with
    2 h + 1 frames.
    """
    half, count = frames // 2, times.size
    middles = np.clip(np.arange(count), half, count - 1 - half)
    visible = np.asarray(~np.isnan(position).any(axis=2))
    filled = np.nan_to_num(position)
    span = times[middles + half] - times[middles - half]
    moments = np.zeros((2 * _DEGREE + 1, count, visible.shape[1]))
    sums = np.zeros((_DEGREE + 1, *position.shape))
    for offset in range(-half, half + 1):
        rows = middles + offset
        # Times in units of the window keep the equations well conditioned.
        powers = ((times[rows] - times) / span)[None, :] ** np.arange(2 * _DEGREE + 1)[:, None]
        moments += powers[:, :, None] * visible[rows]
        sums += powers[: _DEGREE + 1, :, None, None] * filled[rows]
    # The slopes of the parabolas by Cramer's rule: no small systems to be solved.
    m0, m1, m2, m3, m4 = moments
    determinant = m0 * (m2 * m4 - m3 * m3) - m1 * (m1 * m4 - m2 * m3) + m2 * (m1 * m3 - m2 * m2)
    factors = (m2 * m3 - m1 * m4, m0 * m4 - m2 * m2, m1 * m2 - m0 * m3)
    with np.errstate(divide="ignore", invalid="ignore"):
        first, second, third = ((factor / determinant)[..., None] for factor in factors)
        velocity: Floats = (first * sums[0] + second * sums[1] + third * sums[2]) / span[:, None, None]
    velocity[~visible | (moments[0] < _DEGREE + 2)] = np.nan
    return velocity


@dataclass(frozen=True)
class RigidMotions:
    """Rigid motions from rest, one for each time; NaN where too few markers are seen."""

    translation: Floats  # (n_times, n_axes), mean displacement of the markers that are seen, in their unit
    rotation: Floats  # (n_times,), angle [rad]: in 2D from x towards y, in 3D without a sign
    residual: Floats  # (n_times, n_markers, n_axes)


def fit_rigid_motions(rest: Floats, position: Floats) -> RigidMotions:
    """Fit a rotation and a translation to markers at each time by least squares (Kabsch 1976)."""
    dim = rest.shape[1]
    visible = ~(np.isnan(position).any(axis=2) | np.isnan(rest).any(axis=1))
    weights = visible / np.maximum(visible.sum(axis=1), 1)[:, None]
    before, after = np.nan_to_num(rest), np.nan_to_num(position)
    middle_before, middle_after = weights @ before, np.einsum("tm,tma->ta", weights, after)
    spread = (before[None] - middle_before[:, None]) * weights[:, :, None]
    left, _, right = np.linalg.svd(np.einsum("tma,tmb->tab", spread, after - middle_after[:, None]))
    # Without a reflection: the direction that matters least gives way.
    signs = np.sign(np.linalg.det(left @ right))
    right[:, -1] *= np.where(signs == 0, 1.0, signs)[:, None]
    turns = np.swapaxes(left @ right, 1, 2)
    turned = np.einsum("tab,tmb->tma", turns, before[None] - middle_before[:, None])
    residual = after - middle_after[:, None] - turned
    residual[~visible] = np.nan
    enough = visible.sum(axis=1) >= dim
    residual[~enough] = np.nan
    translation = np.where(enough[:, None], middle_after - middle_before, np.nan)
    if dim == 2:
        angles = np.arctan2(turns[:, 1, 0], turns[:, 0, 0])
    else:
        axis = np.stack([turns[:, i, j] - turns[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))], axis=1)
        angles = np.arctan2(np.linalg.norm(axis, axis=1), np.trace(turns, axis1=1, axis2=2) - 1.0)
    return RigidMotions(translation, np.where(enough, angles, np.nan), residual)


def marker_triangles(rest: Floats) -> Ints:
    """Return the Delaunay triangles (n_triangles, 3) of markers at rest (n_markers, 2), counter-clockwise from x to y.

    Flat ones along the edge, whose strain would be noise, are left out: those whose height is below a tenth of their
    longest edge.
    """
    visible = np.flatnonzero(~np.isnan(rest).any(axis=1))
    if visible.size < 3:
        return np.empty((0, 3), dtype=np.intp)
    # Slow to load, and needed only here: commands that read a detector or a data set start without it.
    from scipy.spatial import Delaunay, QhullError

    try:
        corners = Delaunay(rest[visible]).simplices
    except QhullError:  # all on one line
        return np.empty((0, 3), dtype=np.intp)
    edges = rest[visible][np.roll(corners, -1, axis=1)] - rest[visible][corners]
    twice = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
    corners = np.where(twice[:, None] < 0, corners[:, ::-1], corners)
    longest = (edges**2).sum(axis=2).max(axis=1)
    return np.asarray(visible[corners[np.abs(twice) > _FLAT * longest]])


def triangle_gradients(rest: Floats, position: Floats, triangles: Ints) -> Floats:
    """Return the gradients of the displacement in triangles (n_times, n_triangles, 2, 2) [-], exact where it is affine.

    Arrays: rest (n_markers, 2); position (n_times, n_markers, 2); triangles (n_triangles, 3).
    """
    before = rest[triangles[:, 1:]] - rest[triangles[:, :1]]
    after = position[:, triangles[:, 1:]] - position[:, triangles[:, :1]]
    # Edges are rows: those after are those before times the transposed deformation gradient.
    inverse = np.linalg.inv(before) if triangles.size else np.empty((0, 2, 2))
    return np.swapaxes(inverse @ after, 2, 3) - np.eye(2)


def green_strain(gradients: Floats) -> Floats:
    """Return Green's strain xx, yy, xy [-], shape (..., 3), of displacement gradients (..., 2, 2); 0 for rotations."""
    transposed = np.swapaxes(gradients, -1, -2)
    strain = 0.5 * (gradients + transposed + transposed @ gradients)
    return np.stack([strain[..., 0, 0], strain[..., 1, 1], strain[..., 0, 1]], axis=-1)


def marker_means(values: Floats, rest: Floats, triangles: Ints) -> Floats:
    """Return the mean of values (n_times, n_triangles) over the triangles around each marker, weighted by area."""
    first, second = (rest[triangles[:, corner]] - rest[triangles[:, 0]] for corner in (1, 2))
    areas = 0.5 * np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    around = np.zeros((len(triangles), len(rest)))
    around[np.arange(len(triangles))[:, None], triangles] = areas[:, None]
    visible = ~np.isnan(values)
    weights = visible.astype(np.float64) @ around
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(weights > 0, np.nan_to_num(values) @ around / weights, np.nan)


def contact_centroid(position: Floats, divergence: Floats, floor: float) -> Floats:
    """Return the middle of the markers (n_times, n_axes), weighted by their divergence [-] above a floor.

    A contact that presses spreads the markers behind it; where and how far is the sensor's own, so this is a measure to
    compare, and no position of a contact edge. Arrays: position (n_times, n_markers, n_axes); divergence (n_times,
    n_markers).
    """
    weights = np.maximum(np.nan_to_num(divergence) - floor, 0.0) * ~np.isnan(position).any(axis=2)
    total = weights.sum(axis=1)
    total = np.where(total > 0, total, np.nan)
    return np.asarray(np.einsum("tm,tma->ta", weights, np.nan_to_num(position)) / total[:, None])


def larger_principal(strain: Floats) -> Floats:
    """Return the principal strain (...) of larger size, with its sign, of strains (..., 3) [-]."""
    middle, half = 0.5 * (strain[..., 0] + strain[..., 1]), 0.5 * (strain[..., 0] - strain[..., 1])
    radius = np.hypot(half, strain[..., 2])
    return np.where(middle >= 0, middle + radius, middle - radius)
