"""Stress and strain of all cells of a snapshot as full tensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
import xarray as xr
from numpy.typing import NDArray

__all__ = ["centre_gradients", "strain_tensors", "stress_tensors"]

Floats = NDArray[np.float64]

# Corners on [-1, 1]^dim, and the edges whose middle nodes follow the corners, in the order of VTK.
_SQUARE = ((-1, -1), (1, -1), (1, 1), (-1, 1))
_CUBE = tuple((*corner, height) for height in (-1, 1) for corner in _SQUARE)
_TRIANGLE_EDGES = ((0, 1), (1, 2), (0, 2))
_TETRAHEDRON_EDGES = (*_TRIANGLE_EDGES, (0, 3), (1, 3), (2, 3))


def stress_tensors(history: xr.Dataset, number: int) -> Floats:
    """Return the Cauchy stress at the centres of all cells.

    Parameters
    ----------
    history : xarray.Dataset
        A history whose snapshots hold the stress.
    number : int
        Number of the snapshot.

    Returns
    -------
    (n_cells, 3, 3) array
        Symmetric tensors [Pa].
    """
    values = history["snapshot_stress"].values[number].astype(np.float64)
    tensors = np.zeros((len(values), 3, 3))
    for column, name in enumerate(history["stress_component"].values):
        row, other = ("xyz".index(axis) for axis in str(name))
        tensors[:, row, other] = tensors[:, other, row] = values[:, column]
    return tensors


def strain_tensors(history: xr.Dataset, number: int) -> Floats:
    """Return the strain at the centres of all cells, from the displacement of their nodes.

    At small strain it is the symmetric part of the gradient of displacement H; at large strain Green and Lagrange's,
    E = (H + H^T + H^T H) / 2. In plane strain zz is zero; in plane stress it is not a number, since the displacement
    of the nodes does not say it.

    Parameters
    ----------
    history : xarray.Dataset
        A history with snapshots.
    number : int
        Number of the snapshot.

    Returns
    -------
    (n_cells, 3, 3) array
        Symmetric tensors [-]; shears are those of the tensor, half the engineering shears.
    """
    gradient = _displacement_gradients(history, number)
    strain = 0.5 * (gradient + gradient.transpose(0, 2, 1))
    if history.attrs.get("kinematics") == "finite":
        strain = strain + 0.5 * gradient.transpose(0, 2, 1) @ gradient
    if history.attrs.get("formulation") == "plane_stress":
        strain[:, 2, 2] = np.nan
    return strain


def _displacement_gradients(history: xr.Dataset, number: int) -> Floats:
    """Return the gradients of displacement at the centres of all cells (n_cells, 3, 3) [-], zero out of the plane."""
    cells, dim = history["cell_nodes"].values, history.sizes["component"]
    shape = centre_gradients(str(history.attrs["element"]))
    points = history["node_position"].values[cells]
    moved = history["snapshot_displacement"].values[number][cells]
    by_reference = np.einsum("cni,nj->cij", points, shape)
    inverse = np.linalg.inv(by_reference)
    gradient = np.zeros((len(cells), 3, 3))
    gradient[:, :dim, :dim] = np.einsum("cni,nk,ckj->cij", moved, shape, inverse)
    return gradient


def centre_gradients(element: str) -> Floats:
    """Return the gradients of the shape functions at the centre of the reference cell, shape (n_nodes, dim).

    Parameters
    ----------
    element : {'Q4', 'H8', 'T3', 'T4', 'T6', 'T10'}
        The element; its nodes are in the order of VTK.

    Examples
    --------
    >>> centre_gradients("T3").tolist()
    [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]]
    """
    return _GRADIENTS[element].copy()


def _of_corners(corners: Sequence[Sequence[int]]) -> Floats:
    return np.array(corners, dtype=np.float64) / len(corners)


def _of_simplex(dim: int, edges: Sequence[tuple[int, int]]) -> Floats:
    """Return the gradients of a simplex: linear, or quadratic with nodes in the middle of the edges."""
    linear = np.vstack([-np.ones(dim), np.eye(dim)])
    if not edges:
        return linear
    centre = 1.0 / (dim + 1)
    # N_i = L_i (2 L_i - 1) and N_ij = 4 L_i L_j at L = centre.
    middles = [4.0 * centre * (linear[i] + linear[j]) for i, j in edges]
    return np.vstack([(4.0 * centre - 1.0) * linear, *middles])


_GRADIENTS: Mapping[str, Floats] = MappingProxyType(
    {
        "Q4": _of_corners(_SQUARE),
        "H8": _of_corners(_CUBE),
        "T3": _of_simplex(2, ()),
        "T6": _of_simplex(2, _TRIANGLE_EDGES),
        "T4": _of_simplex(3, ()),
        "T10": _of_simplex(3, _TETRAHEDRON_EDGES),
    }
)
