"""Element sizes, and how they grow from the contact into the bulk."""

from __future__ import annotations

import itertools
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from fingerslip.errors import InputError
from fingerslip.mesh.source import MeshSource
from fingerslip.units import millimetres

Floats = NDArray[np.float64]

GROWTH = 0.2
"""Growth of the element size per length of distance from the finer elements [-]."""


class GradedMesh(MeshSource):
    """A source whose mesh of a specimen is finer where it can touch; classes that derive from it have these values."""

    needs_specimen: ClassVar[bool] = True
    element_sizes: ClassVar[tuple[str, ...]] = ("contact_size", "bulk_size")

    element: str  # kind of cell, such as ``Q4``
    contact_size: float  # size along the skin that can touch [m]
    bulk_size: float  # largest size, far from the contact [m]
    contact_reach: float  # height above the lowest point up to which the skin is meshed at `contact_size` [m]

    def __post_init__(self) -> None:
        check_sizes(self.contact_size, self.bulk_size)


def check_sizes(contact_size: float, bulk_size: float) -> None:
    """Refuse a bulk that is finer than the contact [m]."""
    if bulk_size < contact_size:
        fault = f"got {millimetres(bulk_size)}"
        raise InputError("bulk_size", fault, f"needs >= {millimetres(contact_size)} (contact_size)")


def grade(positions: Floats, sizes: Floats) -> Floats:
    """Divide a length into an even number of parts (m,) of the wanted sizes (n,) [m] at positions (n,) [m]."""
    density = 1.0 / _graded_along(np.diff(positions), sizes)
    count = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(positions))])
    count_even = max(2, 2 * round(count[-1] / 2))
    return np.interp(np.linspace(0.0, count[-1], count_even + 1), count, positions)


def size_at(points: Floats, sources: Floats, source_sizes: Floats, bulk_size: float) -> Floats:
    """Return the sizes (n,) [m] wanted at points (n, 2) [m]: those (m,) of sources (m, 2) that grow with distance."""
    distance = np.linalg.norm(points[:, None, :] - sources[None, :, :], axis=2)
    return np.asarray(np.minimum(bulk_size, (source_sizes + GROWTH * distance).min(axis=1)))


def subdivide(curve: Floats, sizes: Floats, turn: float) -> Floats:
    """Divide a finely sampled curve (n, 2) [m] into parts of the wanted sizes (n,) [m], with nodes on its corners.

    Where it bends, parts turn by no more than `turn` [rad].
    """
    step = np.linalg.norm(np.diff(curve, axis=0), axis=1)
    direction = np.diff(curve, axis=0)
    angle = np.abs(np.diff(np.unwrap(np.arctan2(direction[:, 1], direction[:, 0]))))
    corner = angle > turn / 2
    limited = sizes.copy()
    # Points may lie unevenly close on a curve, so the radius comes from the steps on both sides.
    around = (step[1:] + step[:-1]) / 2
    limited[1:-1] = np.minimum(sizes[1:-1], turn * around / np.maximum(np.where(corner, 0.0, angle), 1e-12))
    wanted = _graded_along(step, limited)
    limits = np.concatenate([[0], np.flatnonzero(corner) + 1, [len(curve) - 1]])
    pieces = [_divide(curve[a : b + 1], wanted[a : b + 1]) for a, b in itertools.pairwise(limits)]
    return np.vstack([piece[:-1] for piece in pieces] + [curve[-1:]])


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
