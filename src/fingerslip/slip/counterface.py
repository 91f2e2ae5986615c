"""What a counterface does in a history: its normal, the direction of its slide, and its force on the body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["ContactForces", "contact_forces", "counterface_normal", "slide_tangent", "split_along"]

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ContactForces:
    """The force of a counterface on the body over time, split along the counterface's normal."""

    normal: Floats  # (n_times,), normal force, positive in compression [N]
    tangential: Floats  # (n_times, dim), tangential force, a vector in the surface of the counterface [N]

    @property
    def friction(self) -> Floats:
        """Magnitude of the tangential force [N], shape (n_times,)."""
        return np.asarray(np.linalg.norm(self.tangential, axis=1), dtype=float)

    def ratio(self, least: float = 1e-9) -> Floats:
        """Return tangential over normal force [-], shape (n_times,).

        Parameters
        ----------
        least : float, optional
            The ratio is missing (NaN) where the normal force is at or below this share of its largest value [-].
        """
        ratio = np.full(self.normal.shape, np.nan)
        np.divide(self.friction, self.normal, out=ratio, where=self.normal > least * self.normal.max(initial=0.0))
        return ratio


def contact_forces(history: xr.Dataset, counterface: int = 0) -> ContactForces:
    """Return the force of a counterface on the body over time, split into its normal and tangential parts."""
    force = np.asarray(history.variables["counterface_force"].values[:, counterface], dtype=float)
    return ContactForces(*split_along(force, counterface_normal(history, counterface)))


def counterface_normal(history: xr.Dataset, counterface: int = 0) -> Floats:
    """Return the outward unit normal of a counterface, shape (dim,)."""
    return np.asarray(history.variables["counterface_normal"].values[counterface], dtype=float)


def slide_tangent(history: xr.Dataset, counterface: int = 0) -> Floats:
    """Return the unit tangent of a counterface along its slide, shape (dim,).

    In the plane it is the normal turned clockwise: (1, 0) for a plate below. In space it is the direction in which the
    counterface travels furthest along its surface, and x where it does not travel.
    """
    normal = counterface_normal(history, counterface)
    if normal.size == 2:
        return np.array([normal[1], -normal[0]])
    travel = np.asarray(history["counterface_displacement"].values[:, counterface], dtype=float)
    _, along = split_along(travel, normal)
    furthest = along[np.linalg.norm(along, axis=1).argmax()]
    direction = furthest if np.linalg.norm(furthest) > 0.0 else split_along(np.eye(3)[0], normal)[1]
    return np.asarray(direction / np.linalg.norm(direction))


def split_along(vectors: Floats, normals: Floats) -> tuple[Floats, Floats]:
    """Split vectors into their components along unit normals and what is left of them.

    Arrays: vectors (..., dim); normals (..., dim); returns (...,).

    Examples
    --------
    >>> import numpy as np
    >>> normal, tangential = split_along(np.array([[3.0, 4.0]]), np.array([0.0, 1.0]))
    >>> normal.tolist(), tangential.tolist()
    ([4.0], [[3.0, 0.0]])
    """
    along = np.asarray(np.einsum("...c,...c->...", vectors, normals), dtype=float)
    return along, vectors - along[..., None] * normals
