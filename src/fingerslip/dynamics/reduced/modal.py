"""The algebra of a step in the coordinates of a reduced body, in which all matrices are diagonal.

A field is kept as the coordinates z (m,) with the displacement o = E z (p,) of the interface behind them, so that
contact candidates are read off as on a mesh. Matrices act on z alone. Forces may act on both: those on o do the
work of E^T times them on z. With [1; E] in front and behind, a diagonal matrix D of z has the solution ::

    x = [1; E] D^-1 [1, E^T] b
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from fingerslip.dynamics.step.condensation import Halfway
from fingerslip.linear.symmetric import add_rows

__all__ = ["ByModes", "ModalFactor", "condense_modes"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ModalFactor:
    """A diagonal matrix D of the coordinates; see :class:`fingerslip.linear.solver.Factor`."""

    diagonal: Array  # (m,), D
    interface: Array  # (p, m), E, displacement of the interface per coordinate

    def forward(self, right_hand_side: Array) -> Array:
        """Return b (m + p,) or (m + p, k) unchanged."""
        return right_hand_side

    def backward(self, halfway: Array) -> Array:
        """Return the solution for b (m + p,) or (m + p, k), same shape."""
        return self.spread(self.gather(halfway))

    def transposed_backward(self, right_hand_side: Array) -> Array:
        """Return the solution for b (m + p,) or (m + p, k): the matrix is symmetric."""
        return self.backward(right_hand_side)

    def gather(self, forces: Array) -> Array:
        """Return the coordinates D^-1 [1, E^T] b, (m,) or (m, k)."""
        total, outside = forces[: self.diagonal.size], forces[self.diagonal.size :]
        if forces.ndim == 1:
            return self.divide(add_rows(total, self.interface, outside))
        # Forces of nodes that have left act on the interface: on few of its unknowns, if any.
        rows = np.flatnonzero(outside.any(axis=1))
        return self.divide(total + self.interface[rows].T @ outside[rows] if rows.size else total)

    def divide(self, forces: Array) -> Array:
        """Return D^-1 b for forces on the coordinates, (m,) or (m, k)."""
        return (forces.T / self.diagonal).T

    def spread(self, coordinates: Array) -> Array:
        """Return the field [1; E] z, (m + p,) or (m + p, k), of coordinates z."""
        return np.concatenate([coordinates, self.interface @ coordinates])


@dataclass(frozen=True)
class ByModes:
    """A diagonal matrix, condensed: see :class:`fingerslip.dynamics.step.condensation.Condensed`.

    Halfway there are the coordinates alone: of the interface, contact needs the local displacements only.
    """

    factor: ModalFactor  # the matrix
    local: Array  # (c, m), local displacements of the candidates per coordinate, B [1
    description: ClassVar[str] = "reduced basis, two products a step"

    def forward(self, right_hand_side: Array) -> Halfway:
        """Solve for b, shape (m + p,) or (m + p, k) [N], without contact forces."""
        coordinates = self.factor.gather(right_hand_side)
        return Halfway(coordinates, self.local @ coordinates)

    def backward(self, halfway: Halfway, forces: Array, moved: Array | None = None) -> Array:  # noqa: ARG002
        """Return x for contact forces r, shape (c,) or (c, k) [N]."""
        if forces.ndim == 1:
            added = add_rows(np.zeros_like(halfway.vector), self.local, forces)
        else:
            added = self.local.T @ forces
        return self.factor.spread(halfway.vector + self.factor.divide(added))


def condense_modes(diagonal: Array, interface: Array, local: sparse.csr_matrix) -> tuple[ByModes, Array]:
    """Condense a diagonal matrix of the coordinates.

    Arrays: diagonal (m,); interface (p, m); returns compliance (c, c).
    """
    moved = np.asarray(local[:, diagonal.size :] @ interface)
    scaled = moved / np.sqrt(diagonal)
    return ByModes(ModalFactor(diagonal, interface), moved), scaled @ scaled.T
