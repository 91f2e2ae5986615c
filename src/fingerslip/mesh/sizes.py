"""Element sizes, and how they grow from the contact into the bulk."""

from __future__ import annotations

import itertools
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.units import millimetres

__all__ = ["GROWTH", "ElementSizes", "check_sizes", "grade", "size_at", "subdivide"]

Floats = NDArray[np.float64]

GROWTH = 0.2
"""Growth of the element size per length of distance from the finer elements [-]."""


class ElementSizes(Protocol):
    """Element sizes and kind of a mesh that is finer where it can touch."""

    @property
    def contact_size(self) -> float:
        """Size along the skin that can touch [m]."""
        ...

    @property
    def bulk_size(self) -> float:
        """Largest size, far from the contact [m]."""
        ...

    @property
    def contact_reach(self) -> float:
        """Height above the lowest point up to which the skin is meshed at `contact_size` [m]."""
        ...

    @property
    def element(self) -> str:
        """Kind of cell, such as ``Q4``."""
        ...


def check_sizes(contact_size: float, bulk_size: float) -> None:
    """Refuse a bulk that is finer than the contact.

    Units: contact_size, bulk_size [m].
    """
    if bulk_size < contact_size:
        fault = f"got {millimetres(bulk_size)}"
        raise InputError("bulk_size", fault, f"needs >= {millimetres(contact_size)} (contact_size)")


def grade(positions: Floats, sizes: Floats) -> Floats:
    """Divide a length into an even number of parts of the wanted sizes.

    Arrays: positions (n,) [m]; sizes (n,) [m]; returns (m,).
    """
    density = 1.0 / _graded_along(np.diff(positions), sizes)
    count = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(positions))])
    count_even = max(2, 2 * round(count[-1] / 2))
    return np.interp(np.linspace(0.0, count[-1], count_even + 1), count, positions)


def size_at(points: Floats, sources: Floats, source_sizes: Floats, bulk_size: float) -> Floats:
    """Return the element sizes wanted at points: sizes at sources that grow with distance, up to `bulk_size`.

    Arrays: points (n, 2) [m]; sources (m, 2) [m]; source_sizes (m,) [m]; bulk_size [m]; returns (n,) [m].
    """
    distance = np.linalg.norm(points[:, None, :] - sources[None, :, :], axis=2)
    size: Floats = np.minimum(bulk_size, (source_sizes + GROWTH * distance).min(axis=1))
    return size


def subdivide(curve: Floats, sizes: Floats, turn: float) -> Floats:
    """Divide a finely sampled curve into parts of the wanted sizes, with nodes on its corners.

    Arrays: curve (n, 2) [m]; sizes (n,) [m]; turn [rad]; returns (m, 2).
    """
    step = np.linalg.norm(np.diff(curve, axis=0), axis=1)
    angle = _turns(curve)
    corner = angle > turn / 2
    wanted = _graded_along(step, _limited_by_bends(step, np.where(corner, 0.0, angle), sizes, turn))
    limits = np.concatenate([[0], np.flatnonzero(corner) + 1, [len(curve) - 1]])
    pieces = [_divide(curve[a : b + 1], wanted[a : b + 1]) for a, b in itertools.pairwise(limits)]
    return np.vstack([piece[:-1] for piece in pieces] + [curve[-1:]])


def _turns(curve: Floats) -> Floats:
    """Return the angle by which the curve turns at each inner point."""
    direction = np.diff(curve, axis=0)
    angle = np.unwrap(np.arctan2(direction[:, 1], direction[:, 0]))
    return np.abs(np.diff(angle))


def _limited_by_bends(step: Floats, angle: Floats, sizes: Floats, turn: float) -> Floats:
    limited = sizes.copy()
    # Points may lie unevenly close on a curve, so the radius comes from the steps on both sides.
    around = (step[1:] + step[:-1]) / 2
    limited[1:-1] = np.minimum(sizes[1:-1], turn * around / np.maximum(angle, 1e-12))
    return limited


def _graded_along(step: Floats, sizes: Floats) -> Floats:
    """Limit the growth of sizes along a curve, in either direction."""
    along = GROWTH * np.concatenate([[0.0], np.cumsum(step)])
    forward = np.minimum.accumulate(sizes - along) + along
    backward = np.minimum.accumulate((sizes + along)[::-1])[::-1] - along
    return np.minimum(forward, backward)


def _divide(curve: Floats, sizes: Floats) -> Floats:
    step = np.linalg.norm(np.diff(curve, axis=0), axis=1)
    count = np.concatenate([[0.0], np.cumsum(step * (1 / sizes[1:] + 1 / sizes[:-1]) / 2)])
    wanted = np.linspace(0.0, count[-1], int(np.ceil(count[-1])) + 1)
    return np.column_stack([np.interp(wanted, count, curve[:, k]) for k in (0, 1)])
