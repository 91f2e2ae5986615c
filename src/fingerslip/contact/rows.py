"""How many nodes lie across a contact, which says how well slip is resolved."""

from __future__ import annotations

import numpy as np

from fingerslip.arrays import Floats

# Among how many of the nearest nodes the next one along a direction is looked for.
_NEAREST = 25


def nodes_along(positions: Floats, direction: Floats) -> int:
    """Return how many rows of nodes lie one behind the other along a unit direction: of a slab, those of its section.

    Arrays: positions (n, dim) [m]; direction (dim,) [-]. A row is as wide as nodes are apart in that direction.
    """
    # Slow to load, and this file is loaded with all that reads results.
    from scipy.spatial import cKDTree

    if len(positions) < 2:
        return len(positions)
    _, near = cKDTree(positions).query(positions, k=min(_NEAREST, len(positions)))
    offsets = positions[near] - positions[:, None]
    apart = offsets @ direction
    beside = np.linalg.norm(offsets - apart[..., None] * direction, axis=2)
    # The next node is the nearest in a cone around the direction, as meshes need no rows.
    spacings = np.where((apart > 0.0) & (beside <= (1.0 + 1e-9) * apart), apart, np.inf).min(axis=1)
    if not np.isfinite(spacings).any():
        return 1
    along = positions @ direction
    rows = np.round((along - along.min()) / np.median(spacings[np.isfinite(spacings)]))
    return len(np.unique(rows))
