"""All fields from markers as one labelled dataset."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.vision.fields.motion import rest_positions, smooth_velocity, window_frames
from fingerslip.vision.fields.rigid import fit_rigid_motions
from fingerslip.vision.fields.triangles import green_strain, marker_means, marker_triangles, triangle_gradients
from fingerslip.vision.tracks import check_tracks

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["FIELDS", "contact_centroid", "marker_fields"]

Floats = NDArray[np.float64]

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
    """Return the fields of moving markers.

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

    Returns
    -------
    xarray.Dataset
        :data:`FIELDS`; every variable carries `units` and `long_name`. In pixels y points down, so that a positive curl
        or rotation is clockwise to the eye.

    Raises
    ------
    InputError
        Where the dataset is no tracks, or shorter than `rest` or `smoothing`.

    Examples
    --------
    >>> import numpy as np
    >>> from fingerslip.marker_layouts import ring_layout
    >>> from fingerslip.vision.tracks import make_tracks
    >>> rest = ring_layout(1e-3, (1, 8)).position
    >>> times = np.arange(20) / 30.0
    >>> growing = rest * (1.0 + 0.1 * times)[:, None, None]
    >>> fields = marker_fields(make_tracks(growing, times, units="m"))
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
    return _labelled(values, tracks, {"rest_frames": rest, "smoothing": smoothing, "spread_floor": spread_floor})


def contact_centroid(position: Floats, divergence: Floats, floor: float) -> Floats:
    """Return the middle of the markers that are spread, weighted by their divergence above a floor.

    A contact that presses spreads the markers behind it; where and how far is the sensor's own, so this is a measure to
    compare, and no position of a contact edge.

    Arrays: position (n_times, n_markers, n_axes); divergence (n_times, n_markers) [-]; floor [-]; returns (n_times,
    n_axes).
    """
    weights = np.maximum(np.nan_to_num(divergence) - floor, 0.0) * ~np.isnan(position).any(axis=2)
    total = weights.sum(axis=1)
    total = np.where(total > 0, total, np.nan)
    found: Floats = np.einsum("tm,tma->ta", weights, np.nan_to_num(position)) / total[:, None]
    return found


def _labelled(values: Mapping[str, Any], tracks: xr.Dataset, settings: Mapping[str, Any]) -> xr.Dataset:
    import xarray as xr

    length = tracks["position"].attrs["units"]
    made = {
        name: xr.Variable(dims, values[name], {"units": unit.replace("length", length), "long_name": meaning})
        for name, (dims, unit, meaning) in FIELDS.items()
    }
    coords = {name: tracks.variables[name] for name in tracks.coords} | {"strain_component": ["xx", "yy", "xy"]}
    return xr.Dataset(made, coords=coords, attrs=dict(tracks.attrs) | dict(settings))
