"""Tetrahedra with positive volume, whatever order their corners came in."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

__all__ = ["positive_tetrahedra"]

Nodes = TypeVar("Nodes", bound=NDArray[np.integer])

# With the first two corners exchanged. The middles of ten nodes are those of the edges 01, 12, 02, 03, 13, 23.
_MIRRORED = {4: [1, 0, 2, 3], 10: [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]}


def positive_tetrahedra(points: NDArray[np.float64], cells: Nodes) -> Nodes:
    """Return tetrahedra whose corners are in the order of positive volume.

    Arrays: points (n, 3); cells (m, 4); returns (m, 4).
    """
    corners = points[cells[:, :4]]
    mirrored = np.linalg.det(corners[:, 1:] - corners[:, :1]) < 0.0
    turned = cells.copy()
    turned[mirrored] = turned[mirrored][:, _MIRRORED[cells.shape[1]]]
    return turned
