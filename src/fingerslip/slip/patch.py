"""The contact patch in 3D: its triangles, its stick zone and annulus of slip, and the strains of the skin on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Floats, Integers
from fingerslip.contact.states import OPEN, SLIP
from fingerslip.errors import InputError
from fingerslip.history import is_solid
from fingerslip.libraries import xr
from fingerslip.slip import windows

# Triangles that bridge a hole or a hollow of the contact have longer sides than its own, which are alike.
_LONGEST_SIDE = 3.0
_FLAT = 1e-9  # twice the area over the square of the longest side
_STRAINS = ("along", "across", "shear")


@dataclass(frozen=True)
class Patch:
    """The contact candidates of a plate, joined by triangles."""

    nodes: Integers  # (n,), rows of the contact candidates in the history
    points: Floats  # (n, 2), reference coordinates along and across the slide [m]
    triangles: Integers  # (m, 3), corners as rows of `points`
    axes: Floats  # (2, 3), unit vectors along and across the slide, in the plate


def contact_patch(history: xr.Dataset, counterface: int = 0) -> Patch:
    """Join the contact candidates of a plate by Delaunay triangles in its plane; refuse what is no patch in 3D."""
    from scipy.spatial import Delaunay, QhullError

    if not is_solid(history):
        raise InputError("history", "is two-dimensional", "needs a history in 3D")
    nodes = np.flatnonzero(history["contact_counterface"].values == counterface)
    if nodes.size < 3:
        fault = f"has {nodes.size} contact candidates on counterface {counterface}"
        raise InputError("history", fault, "needs three and more")
    tangent = windows.slide_tangent(history, counterface)
    axes = np.array([tangent, np.cross(tangent, windows.counterface_normal(history, counterface))])
    points = history["contact_position"].values[nodes] @ axes.T
    try:
        triangles = Delaunay(points).simplices
    except QhullError:
        fault = f"has all contact candidates of counterface {counterface} on a line"
        raise InputError("history", fault, "needs a contact that is more than an edge") from None
    edges = points[triangles] - points[np.roll(triangles, 1, axis=1)]
    sides = np.linalg.norm(edges, axis=2)
    (x, y), (along, across) = edges[:, 0].T, edges[:, 1].T
    # Nodes in a row at the rim of a regular mesh make triangles without area.
    usable = np.abs(x * across - y * along) > _FLAT * sides.max(axis=1) ** 2
    usable &= sides.max(axis=1) <= _LONGEST_SIDE * np.median(sides)
    return Patch(nodes, points, np.asarray(triangles[usable], dtype=np.int64), axes)


def patch_series(history: xr.Dataset, counterface: int = 0) -> xr.Dataset:
    """Return the series that optical studies of fingertips report of the contact patch, over time.

    ``contact_area`` and ``stick_area`` of all counterfaces [m^2], ``stick_ratio`` [-], ``annulus_width`` of the
    slipping annulus of a round patch with these areas [m], ``normal_force`` and ``tangential_force`` of one [N] and
    their ``force_ratio`` [-]. Values that do not exist without contact are missing (NaN).
    """
    area, ratio = windows.contact_area(history), windows.stick_ratio(history)
    stuck = (area * ratio.fillna(0.0)).rename("stick_area")
    forces = windows.contact_forces(history, counterface)
    width = np.sqrt(area.values / np.pi) - np.sqrt(stuck.values / np.pi)
    series = {
        "contact_area": (area.values, "m^2", "area in contact"),
        "stick_area": (stuck.values, "m^2", "area that sticks"),
        "stick_ratio": (ratio.values, "1", "stick ratio"),
        "annulus_width": (width, "m", "width of the slipping annulus of a round patch"),
        "normal_force": (forces.normal, "N", "normal force on the plate"),
        "tangential_force": (forces.friction, "N", "tangential force on the plate"),
        "force_ratio": (forces.ratio(), "1", "tangential over normal force"),
    }
    return xr.Dataset(
        {name: ("time", values, {"units": unit, "long_name": said}) for name, (values, unit, said) in series.items()},
        {"time": history["time"]},
    )


def surface_strains(history: xr.Dataset, patch: Patch | None = None) -> xr.DataArray:
    """Return the Green-Lagrange strains of the skin surface on a contact patch, (time, triangle, strain_component) [-].

    E = (F^T F - I)/2, where F maps the reference plane of a triangle onto its present plane. The components are along
    the slide, across it, and the shear E_12 (not doubled), in the reference plane of each triangle. Coordinates are
    `along` and `across` of the triangles' centres [m] and `touching` (time, triangle), whether all corners touch.
    """
    patch = patch or contact_patch(history)
    reference = history["contact_position"].values[patch.nodes][patch.triangles]
    at_rest = reference[:, 1:] - reference[:, :1]
    # The edges (m, 2, 2) in the planes of their triangles, the first axis along the slide.
    normal = np.cross(at_rest[:, 0], at_rest[:, 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    first = patch.axes[0] - (normal @ patch.axes[0])[:, None] * normal
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    local = np.stack([np.einsum("mek,mk->me", at_rest, axis) for axis in (first, np.cross(normal, first))], axis=-1)
    displacement = history["contact_displacement"].values[:, patch.nodes][:, patch.triangles]
    edges = at_rest + (displacement[:, :, 1:] - displacement[:, :, :1])
    # Rows of `edges` are the images of the rows of `local`.
    gradient = np.linalg.solve(local, edges)
    metric = gradient @ np.swapaxes(gradient, -1, -2)
    strains = 0.5 * (metric - np.eye(2))
    values = np.stack([strains[..., 0, 0], strains[..., 1, 1], strains[..., 0, 1]], axis=-1)
    state = history["contact_state"].values[:, patch.nodes][:, patch.triangles]
    centres = patch.points[patch.triangles].mean(axis=1)
    coordinates = {
        "time": history["time"].values,
        "strain_component": list(_STRAINS),
        "along": ("triangle", centres[:, 0]),
        "across": ("triangle", centres[:, 1]),
        "touching": (("time", "triangle"), (state != OPEN).all(axis=-1)),
    }
    attributes = {"units": "1", "long_name": "Green-Lagrange strain of the skin surface"}
    return xr.DataArray(values, coordinates, ("time", "triangle", "strain_component"), "surface_strain", attributes)


def surface_strain_rates(strains: xr.DataArray) -> xr.DataArray:
    """Return the rates of surface strains by central differences between records, in their shape [1/s]."""
    rates = strains.copy(data=np.gradient(strains.values, strains["time"].values, axis=0))
    return rates.rename("surface_strain_rate").assign_attrs(units="1/s", long_name="rate of the surface strain")


def triangle_states(history: xr.Dataset, patch: Patch, step: int) -> NDArray[np.int8]:
    """Return the state of each triangle (m,) at a record: open where a corner is, slip where one slips, else stick."""
    corners = history["contact_state"].values[step, patch.nodes][patch.triangles]
    states = np.where((corners == SLIP).any(axis=1), SLIP, corners.max(axis=1))
    return np.where((corners == OPEN).any(axis=1), OPEN, states).astype(np.int8)
