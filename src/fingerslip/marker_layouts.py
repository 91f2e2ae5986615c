"""Marker layouts: where the markers of a sensor are at rest, flattened into a plane."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Flags, Floats
from fingerslip.errors import InputError

#: Markers on each ring, the centre first. They sum to the 81 of Cordova Bulens et al. 2023, who do not print the rings:
#: assumed.
RING_COUNTS = (1, 8, 16, 24, 32)
_ON_X = 1e-12  # m


@dataclass(frozen=True)
class MarkerLayout:
    """Markers at rest in a plane, ring by ring from the centre, each ring by rising angle.

    Parameters
    ----------
    position : (n, 2) array
        Coordinates x, y [m]; on a dome the distance from the centre is the length of the arc.
    ring : (n,) array of int
        Ring of each marker, 0 in the centre.
    angle : (n,) array
        Angle of each marker from the x axis towards the y axis [rad], from 0 to 2 pi; 0 in the centre.

    Examples
    --------
    >>> import fingerslip as fs
    >>> layout = fs.ring_layout(1.5e-3)
    >>> inner = layout.select(layout.ring <= 2)
    >>> layout.count, inner.count
    (81, 25)
    """

    position: Floats
    ring: NDArray[np.intp]
    angle: Floats

    @property
    def count(self) -> int:
        """Number of markers."""
        return int(self.ring.size)

    @property
    def on_x(self) -> Flags:
        """Which markers lie on the x axis."""
        return np.abs(self.position[:, 1]) < _ON_X

    def select(self, rows: Flags) -> MarkerLayout:
        """Return some of the markers."""
        return MarkerLayout(self.position[rows], self.ring[rows], self.angle[rows])


def ring_layout(pitch: float, counts: Sequence[int] = RING_COUNTS) -> MarkerLayout:
    """Return markers on concentric rings, evenly spaced on each, the first of each on the x axis.

    Parameters
    ----------
    pitch : float
        Distance between rings [m], > 0.
    counts : sequence of int, optional
        Markers on each ring, from the centre; the centre has 1 or 0. The default gives 81.

    Examples
    --------
    >>> import fingerslip as fs
    >>> fs.ring_layout(1.5e-3).count
    81
    """
    _check_pitch(pitch)
    if not counts or counts[0] not in (0, 1) or min(counts) < 0 or sum(counts) == 0:
        raise InputError("counts", f"got {tuple(counts)}", "needs counts >= 0, that of the centre 0 or 1, not all 0")
    ring = np.repeat(np.arange(len(counts)), counts)
    angle = np.concatenate([2.0 * np.pi * np.arange(count) / max(count, 1) for count in counts])
    radius = pitch * ring
    return MarkerLayout(np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]), ring, angle)


def hexagonal_layout(pitch: float, rings: int) -> MarkerLayout:
    """Return markers on a triangular lattice inside a hexagon: 1 + 3 n (n + 1) of them for n rings.

    Parameters
    ----------
    pitch : float
        Distance between neighbours [m], > 0.
    rings : int
        Number of hexagonal rings around the centre: 6 gives 127 markers, 10 gives 331.

    Examples
    --------
    >>> import fingerslip as fs
    >>> fs.hexagonal_layout(1e-3, 6).count, fs.hexagonal_layout(1e-3, 10).count
    (127, 331)
    """
    _check_pitch(pitch)
    if rings < 0:
        raise InputError("rings", f"got {rings}", "needs a number >= 0")
    along, across = (axis.ravel() for axis in np.mgrid[-rings : rings + 1, -rings : rings + 1])
    ring = np.maximum(np.maximum(np.abs(along), np.abs(across)), np.abs(along + across))
    inside = ring <= rings
    position = pitch * np.column_stack([along + 0.5 * across, np.sqrt(0.75) * across])[inside]
    # Rounding keeps the marker on the x axis first in its ring.
    angle = np.round(np.arctan2(position[:, 1], position[:, 0]) % (2.0 * np.pi), 12)
    order = np.lexsort((angle, ring[inside]))
    return MarkerLayout(position[order], ring[inside][order], angle[order])


def grid_layout(pitch: float, rows: int, columns: int) -> MarkerLayout:
    """Return markers on a square grid about its middle, ring by ring: a ring is a square of markers.

    Parameters
    ----------
    pitch : float
        Distance between neighbours [m], > 0.
    rows, columns : int
        Number of markers along y and along x.

    Examples
    --------
    >>> import fingerslip as fs
    >>> fs.grid_layout(1e-3, 7, 9).count, fs.grid_layout(1e-3, 7, 9).ring.max().item()
    (63, 4)
    """
    _check_pitch(pitch)
    if min(rows, columns) < 1:
        raise InputError("rows, columns", f"got {rows}, {columns}", "needs numbers >= 1")
    y, x = (axis.ravel() for axis in np.mgrid[0.5 * (1 - rows) : 0.5 * rows, 0.5 * (1 - columns) : 0.5 * columns])
    ring = np.maximum(np.abs(x), np.abs(y)).astype(np.intp)
    angle = np.arctan2(y, x) % (2.0 * np.pi)
    order = np.lexsort((angle, ring))
    return MarkerLayout(pitch * np.column_stack([x, y])[order], ring[order], angle[order])


def _check_pitch(pitch: float) -> None:
    if not (np.isfinite(pitch) and pitch > 0):
        raise InputError("pitch", f"got {pitch}", "needs a length > 0 in metres", "write 1.5e-3 for 1.5 mm")
