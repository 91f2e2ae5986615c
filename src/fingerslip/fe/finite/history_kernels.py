"""Compiled loops over quadrature points of bodies that relax: what the start of a step leaves in forces and stiffness.

The start of a step leaves a tensor Y in the reference state (:mod:`fingerslip.fe.finite.history`). At its end it
is y = J^(-2/3) F Y F^T, with its trace q, and takes y - q/3 I from the Kirchhoff stress: the derivative of J^(-2/3)
Y:C/2. With the gradients g of the shape functions in the current state and eps the change of strain there, this
stress changes by ::

    2/3 [tr(eps) y + (y:eps) I - q/3 tr(eps) I - q eps]

Tensors are packed: xx, yy, xy, zz in 2D, and xx, yy, zz, xy, yz, xz in 3D.
"""

from __future__ import annotations

import numba
import numpy as np

from fingerslip.fe.finite.kernels import LANES, ROWS, diagonalise, multiply


@numba.njit(cache=True, nogil=True)
def _unpack(packed, dim, tensor):  # type: ignore[no-untyped-def]
    """Fill in a tensor (dim, dim), and return its component zz in 2D."""
    if dim == 2:
        tensor[0, 0], tensor[1, 1] = packed[0], packed[1]
        tensor[0, 1] = tensor[1, 0] = packed[2]
        return packed[3]
    tensor[0, 0], tensor[1, 1], tensor[2, 2] = packed[0], packed[1], packed[2]
    tensor[0, 1] = tensor[1, 0] = packed[3]
    tensor[1, 2] = tensor[2, 1] = packed[4]
    tensor[0, 2] = tensor[2, 0] = packed[5]
    return 0.0


@numba.njit(cache=True, nogil=True)
def _pack(tensor, across, dim, packed):  # type: ignore[no-untyped-def]
    if dim == 2:
        packed[0], packed[1], packed[2], packed[3] = tensor[0, 0], tensor[1, 1], tensor[0, 1], across
        return
    packed[0], packed[1], packed[2] = tensor[0, 0], tensor[1, 1], tensor[2, 2]
    packed[3], packed[4], packed[5] = tensor[0, 1], tensor[1, 2], tensor[0, 2]


@numba.njit(cache=True, nogil=True)
def push_forward(deformation, log_strain, reference, current):  # type: ignore[no-untyped-def]
    """Fill in y = J^(-2/3) F Y F^T (n, k) from Y (n, >= k); `log_strain` (n, 3) has the strain across last."""
    count, dim = deformation.shape[0], deformation.shape[1]
    tensor, half, rotated = np.empty((dim, dim)), np.empty((dim, dim)), np.empty((dim, dim))
    for p in range(count):
        across = _unpack(reference[p], dim, tensor)
        scale = np.exp(-2.0 / 3.0 * (log_strain[p, 0] + log_strain[p, 1] + log_strain[p, 2]))
        multiply(deformation[p], tensor, half)
        for i in range(dim):
            for j in range(i + 1):
                total = 0.0
                for k in range(dim):
                    total += half[i, k] * deformation[p, j, k]
                rotated[i, j] = rotated[j, i] = scale * total
        _pack(rotated, scale * across * np.exp(2.0 * log_strain[p, 2]), dim, current[p])


@numba.njit(cache=True, nogil=True)
def shape_tensors(squared, directions, log_strain, stress, reference):  # type: ignore[no-untyped-def]
    """Fill in J^(2/3) F^-1 dev(tau) F^-T (n, k), packed, from principal Kirchhoff stresses (n, 3)."""
    count, dim = squared.shape
    tensor = np.empty((dim, dim))
    for p in range(count):
        mean = (stress[p, 0] + stress[p, 1] + stress[p, 2]) / 3.0
        scale = np.exp(2.0 / 3.0 * (log_strain[p, 0] + log_strain[p, 1] + log_strain[p, 2]))
        tensor[:] = 0.0
        for k in range(dim):
            deviatoric = scale * (stress[p, k] - mean) / squared[p, k]
            for i in range(dim):
                for j in range(dim):
                    tensor[i, j] += deviatoric * directions[p, i, k] * directions[p, j, k]
        _pack(tensor, scale * (stress[p, 2] - mean) * np.exp(-2.0 * log_strain[p, 2]), dim, reference[p])


@numba.njit(cache=True, nogil=True)
def principal_values(current, dim, values):  # type: ignore[no-untyped-def]
    """Fill in the principal values (n, 3) of the deviators of tensors (n, k), the one across the plane last."""
    lanes = np.zeros((ROWS, LANES))
    for start in range(0, len(current), LANES):
        count = min(LANES, len(current) - start)
        for lane in range(count):
            value = current[start + lane]
            if dim == 2:
                middle, half = 0.5 * (value[0] + value[1]), 0.5 * (value[0] - value[1])
                radius = np.sqrt(half * half + value[2] * value[2])
                lanes[0, lane], lanes[1, lane], lanes[2, lane] = middle + radius, middle - radius, value[3]
            else:
                lanes[0, lane], lanes[1, lane], lanes[2, lane] = value[0], value[1], value[2]
                lanes[3, lane], lanes[4, lane], lanes[5, lane] = value[3], value[5], value[4]
        if dim == 3:
            diagonalise(lanes)
        for lane in range(count):
            mean = (lanes[0, lane] + lanes[1, lane] + lanes[2, lane]) / 3.0
            for k in range(3):
                values[start + lane, k] = lanes[k, lane] - mean


@numba.njit(cache=True, nogil=True)
def _invert(matrix, inverse):  # type: ignore[no-untyped-def]
    """Fill in the inverse of a deformation gradient."""
    if len(matrix) == 2:
        volume = matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]
        inverse[0, 0], inverse[1, 1] = matrix[1, 1] / volume, matrix[0, 0] / volume
        inverse[0, 1], inverse[1, 0] = -matrix[0, 1] / volume, -matrix[1, 0] / volume
        return
    for i in range(3):
        for j in range(3):
            a, b, c, d = (j + 1) % 3, (j + 2) % 3, (i + 1) % 3, (i + 2) % 3
            inverse[i, j] = matrix[a, c] * matrix[b, d] - matrix[a, d] * matrix[b, c]
    volume = matrix[0, 0] * inverse[0, 0] + matrix[0, 1] * inverse[1, 0] + matrix[0, 2] * inverse[2, 0]
    inverse /= volume


@numba.njit(cache=True, nogil=True)
def _pull(gradients, deformation, tensor, inverse, shapes, pulled):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Fill in the gradients of the shape functions in the current state, and these times a tensor."""
    _invert(deformation, inverse)
    multiply(gradients, inverse, shapes)
    multiply(shapes, tensor, pulled)


@numba.njit(cache=True, nogil=True)
def add_forces(gradients, nodes, weights, deformation, current, forces):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Add the nodal forces (n_nodes_of_mesh, dim) [N] of what the start of a step leaves, y (n_p, k) [Pa]."""
    cells, points, corners, dim = gradients.shape
    tensor, inverse = np.empty((dim, dim)), np.empty((dim, dim))
    shapes, pulled = np.empty((corners, dim)), np.empty((corners, dim))
    for c in range(cells):
        for q in range(points):
            p = c * points + q
            trace = _unpack(current[p], dim, tensor)
            for i in range(dim):
                trace += tensor[i, i]
            for i in range(dim):
                tensor[i, i] -= trace / 3.0
            _pull(gradients[c, q], deformation[p], tensor, inverse, shapes, pulled)
            for a in range(corners):
                for i in range(dim):
                    forces[nodes[c, a], i] -= weights[p] * pulled[a, i]


@numba.njit(cache=True, nogil=True)
def add_stiffness(gradients, weights, deformation, current, matrices):  # type: ignore[no-untyped-def]
    """Add the stiffness of cells (n_cells, n_local, n_local) [N/m] from what the start of a step leaves."""
    cells, points, corners, dim = gradients.shape
    tensor, inverse = np.empty((dim, dim)), np.empty((dim, dim))
    shapes, pulled = np.empty((corners, dim)), np.empty((corners, dim))
    for c in range(cells):
        for q in range(points):
            p = c * points + q
            trace = _unpack(current[p], dim, tensor)
            for i in range(dim):
                trace += tensor[i, i]
            _pull(gradients[c, q], deformation[p], tensor, inverse, shapes, pulled)
            third, size = trace / 3.0, 2.0 / 3.0 * weights[p]
            for a in range(corners):
                for b in range(corners):
                    along = stretched = 0.0
                    for i in range(dim):
                        along += shapes[a, i] * shapes[b, i]
                        stretched += shapes[a, i] * pulled[b, i]
                    same = -weights[p] * (stretched - third * along) - size * 0.5 * trace * along
                    for i in range(dim):
                        matrices[c, a * dim + i, b * dim + i] += same
                        for j in range(dim):
                            symmetric = pulled[a, i] * shapes[b, j] + shapes[a, i] * pulled[b, j]
                            symmetric -= third * shapes[a, i] * shapes[b, j] + 0.5 * trace * shapes[a, j] * shapes[b, i]
                            matrices[c, a * dim + i, b * dim + j] += size * symmetric


@numba.njit(cache=True, nogil=True)
def _couple(deformation, squared, directions, coupling, current, tensor):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Fill in the derivative of the stress in 2D by the logarithmic strain across, shape (2, 2)."""
    across = _unpack(current, 2, tensor)
    third = (across + tensor[0, 0] + tensor[1, 1]) / 3.0
    for i in range(2):
        tensor[i, i] += across - third
    tensor *= 2.0 / 3.0
    for k in range(2):
        first_pull = (deformation[0, 0] * directions[0, k] + deformation[0, 1] * directions[1, k]) / np.sqrt(squared[k])
        other = (deformation[1, 0] * directions[0, k] + deformation[1, 1] * directions[1, k]) / np.sqrt(squared[k])
        tensor[0, 0] += coupling[k] * first_pull * first_pull
        tensor[1, 1] += coupling[k] * other * other
        tensor[0, 1] += coupling[k] * first_pull * other
        tensor[1, 0] += coupling[k] * first_pull * other


@numba.njit(cache=True, nogil=True)
def add_thickness(  # type: ignore[no-untyped-def]  # noqa: PLR0917
    gradients, weights, deformation, squared, directions, coupling, current, stiffness, matrices
):
    """Take from the stiffness of cells what the thickness in plane stress gives way.

    `coupling` (n_p, 2) [Pa] are the derivatives of the principal Kirchhoff stresses by the logarithmic strain across,
    to which those of the tensor y are added, and `stiffness` (n_p,) [Pa] is that of the stress across.
    """
    cells, points, corners, dim = gradients.shape
    tensor, inverse = np.empty((dim, dim)), np.empty((dim, dim))
    shapes, pulled = np.empty((corners, dim)), np.empty((corners, dim))
    for c in range(cells):
        for q in range(points):
            p = c * points + q
            _couple(deformation[p], squared[p], directions[p], coupling[p], current[p], tensor)
            _pull(gradients[c, q], deformation[p], tensor, inverse, shapes, pulled)
            size = weights[p] / stiffness[p]
            for a in range(corners):
                for i in range(dim):
                    for b in range(corners):
                        for j in range(dim):
                            matrices[c, a * dim + i, b * dim + j] -= size * pulled[a, i] * pulled[b, j]
