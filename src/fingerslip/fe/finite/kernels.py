"""Compiled loops over the quadrature points of cells: strains, forces and stiffness of a deformed body.

At a point with the displacement gradient H, the deformation gradient is F = I + H and the Green-Lagrange strain
E = (H + H^T + H^T H)/2 = sum_i eps_i N_i N_i^T. The stretches are lambda_i = sqrt(1 + 2 eps_i), the logarithmic strains
ln(lambda_i), and a law gives their principal Kirchhoff stresses tau_i. Then ::

    P = F sum_i tau_i / lambda_i^2 N_i N_i^T

is the first Piola-Kirchhoff stress, whose integral with the gradients of the shape functions is the nodal force. Its
derivative is diagonal in the principal directions but for the normal components: with s_i = tau_i / lambda_i, shears
symmetric in i and j cost (s_i - s_j)/(lambda_i - lambda_j), rotations (s_i + s_j)/(lambda_i + lambda_j).

Principal values and directions of symmetric tensors in 3D: Jacobi's rotations, for many points at once.

A rotation costs two roots and two quotients. In a loop over points, which are lanes of an array, the compiler takes
several at a time, as many as the processor's vectors hold.
"""

from __future__ import annotations

import numba
import numpy as np

# Points at once; rows of the array: the tensor's components, then the components of its three directions.
LANES, ROWS = 64, 15
_XX, _YY, _ZZ, _XY, _XZ, _YZ, _FIRST, _SECOND, _THIRD = 0, 1, 2, 3, 4, 5, 6, 9, 12
_SWEEPS = 30
# Far below the square root of the least number: keeps 0/0 away.
_NOTHING = 1e-150


# Compiled with NumPy's errors, because a check for a quotient by zero would part the lanes.
@numba.njit(cache=True, nogil=True, error_model="numpy")
def diagonalise(lanes):  # type: ignore[no-untyped-def]
    """Turn tensors into their principal values, and fill in their directions.

    In `lanes` (15, LANES) rows 0 to 2 are xx, yy, zz and become the principal values, rows 3 to 5 are xy, xz, yz and
    become zero; rows 6 to 8 take the components of the first direction, and so on. What is no number stays so.
    """
    for row in range(_FIRST, ROWS):
        lanes[row] = 1.0 if row in {_FIRST, _SECOND + 1, _THIRD + 2} else 0.0
    for _ in range(_SWEEPS):
        turning = False
        for lane in range(LANES):
            beside = lanes[_XY, lane] ** 2 + lanes[_XZ, lane] ** 2 + lanes[_YZ, lane] ** 2
            along = lanes[_XX, lane] ** 2 + lanes[_YY, lane] ** 2 + lanes[_ZZ, lane] ** 2
            # Smaller than rounding of the eigenvalues by far, as their squares.
            turning |= beside > 1e-40 * along
        if not turning:
            return
        _rotate(lanes, _XX, _YY, _XY, _XZ, _YZ, _FIRST, _SECOND)
        _rotate(lanes, _XX, _ZZ, _XZ, _XY, _YZ, _FIRST, _THIRD)
        _rotate(lanes, _YY, _ZZ, _YZ, _XY, _XZ, _SECOND, _THIRD)


@numba.njit(cache=True, nogil=True, error_model="numpy")
def _rotate(lanes, column, other, beside, left, right, first, second):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Take the component `beside` to zero by a rotation of the axes `one` and `other`.

    `left` and `right` are the components that both have with the third axis, `first` and `second` their directions.
    """
    for lane in range(LANES):
        shear = lanes[beside, lane]
        apart = lanes[other, lane] - lanes[column, lane]
        doubled = 2.0 * shear if apart >= 0.0 else -2.0 * shear
        tangent = doubled / (np.abs(apart) + np.sqrt(apart * apart + doubled * doubled) + _NOTHING)
        cosine = 1.0 / np.sqrt(tangent * tangent + 1.0)
        sine = tangent * cosine
        lanes[column, lane] -= tangent * shear
        lanes[other, lane] += tangent * shear
        lanes[beside, lane] = 0.0
        near, far = lanes[left, lane], lanes[right, lane]
        lanes[left, lane], lanes[right, lane] = cosine * near - sine * far, sine * near + cosine * far
        for i in range(3):
            near, far = lanes[first + i, lane], lanes[second + i, lane]
            lanes[first + i, lane], lanes[second + i, lane] = cosine * near - sine * far, sine * near + cosine * far


# Difference of stretches below which the quotient of differences is taken as a derivative; its error is the square.
_ALIKE = 1e-5


@numba.njit(cache=True, nogil=True)
def strains(gradients, nodes, displacement, deformation, squared, directions):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Fill in F (n_p, dim, dim), lambda^2 (n_p, dim) and N (n_p, dim, dim), a column for each direction, in 3D.

    `gradients` (n_cells, n_q, n_nodes, dim) [1/m] are those of the shape functions, `nodes` (n_cells, n_nodes) the
    cells' nodes, `displacement` (n_nodes_of_mesh, dim) [m].

    Returns the number of the cell that is turned inside out the most, -1 where none is.
    """
    cells, points = gradients.shape[:2]
    lanes, worst, least = np.zeros((ROWS, LANES)), -1, 0.0
    for start in range(0, cells * points, LANES):
        count = min(LANES, cells * points - start)
        for lane in range(count):
            p = start + lane
            c = p // points
            _deform(gradients[c, p % points], nodes[c], displacement, deformation[p], lanes[:, lane])
            volume = _determinant(deformation[p])
            # What is no number is worse than anything.
            if not volume > least:
                worst, least = c, volume
                if np.isnan(volume):
                    return c
        diagonalise(lanes)
        for lane in range(count):
            for k in range(3):
                squared[start + lane, k] = 1.0 + 2.0 * lanes[k, lane]
                for i in range(3):
                    directions[start + lane, i, k] = lanes[6 + 3 * k + i, lane]
    return worst


@numba.njit(cache=True, nogil=True)
def _deform(gradients, nodes, displacement, deformation, strain):  # type: ignore[no-untyped-def]
    """Fill in F (3, 3) and the Green-Lagrange strain, xx, yy, zz, xy, xz, yz, at a point in 3D.

    Numbers instead of small arrays make this twice as fast.
    """
    xx = xy = xz = yx = yy = yz = zx = zy = zz = 0.0
    for a in range(len(nodes)):
        node = nodes[a]
        x, y, z = displacement[node, 0], displacement[node, 1], displacement[node, 2]
        along, up, across = gradients[a, 0], gradients[a, 1], gradients[a, 2]
        xx += x * along
        xy += x * up
        xz += x * across
        yx += y * along
        yy += y * up
        yz += y * across
        zx += z * along
        zy += z * up
        zz += z * across
    deformation[0, 0], deformation[0, 1], deformation[0, 2] = 1.0 + xx, xy, xz
    deformation[1, 0], deformation[1, 1], deformation[1, 2] = yx, 1.0 + yy, yz
    deformation[2, 0], deformation[2, 1], deformation[2, 2] = zx, zy, 1.0 + zz
    strain[0] = xx + 0.5 * (xx * xx + yx * yx + zx * zx)
    strain[1] = yy + 0.5 * (xy * xy + yy * yy + zy * zy)
    strain[2] = zz + 0.5 * (xz * xz + yz * yz + zz * zz)
    strain[3] = 0.5 * (xy + yx + xx * xy + yx * yy + zx * zy)
    strain[4] = 0.5 * (xz + zx + xx * xz + yx * yz + zx * zz)
    strain[5] = 0.5 * (yz + zy + xy * xz + yy * yz + zy * zz)


@numba.njit(cache=True, nogil=True)
def strains_2d(gradients, nodes, displacement, deformation, squared, directions):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Do as :func:`strains` in 2D, where there is no need to iterate: three times as fast."""
    cells, points, corners, _ = gradients.shape
    worst, least = -1, 0.0
    for c in range(cells):
        for q in range(points):
            p = c * points + q
            xx = xy = yx = yy = 0.0
            for a in range(corners):
                node = nodes[c, a]
                x, y = displacement[node, 0], displacement[node, 1]
                along, up = gradients[c, q, a, 0], gradients[c, q, a, 1]
                xx += x * along
                xy += x * up
                yx += y * along
                yy += y * up
            deformation[p, 0, 0], deformation[p, 0, 1] = 1.0 + xx, xy
            deformation[p, 1, 0], deformation[p, 1, 1] = yx, 1.0 + yy
            along_x = xx + 0.5 * (xx * xx + yx * yx)
            other = yy + 0.5 * (xy * xy + yy * yy)
            beside = 0.5 * (xy + yx + xx * xy + yx * yy)
            cosine, sine = 1.0, 0.0
            if beside != 0.0:
                ratio = (other - along_x) / (2.0 * beside)
                tangent = np.copysign(1.0, ratio) / (np.abs(ratio) + np.sqrt(ratio * ratio + 1.0))
                cosine = 1.0 / np.sqrt(tangent * tangent + 1.0)
                sine = tangent * cosine
                along_x -= tangent * beside
                other += tangent * beside
            directions[p, 0, 0], directions[p, 0, 1] = cosine, sine
            directions[p, 1, 0], directions[p, 1, 1] = -sine, cosine
            squared[p, 0], squared[p, 1] = 1.0 + 2.0 * along_x, 1.0 + 2.0 * other
            volume = (1.0 + xx) * (1.0 + yy) - xy * yx
            if not volume > least:
                worst, least = c, volume
                if np.isnan(volume):
                    return c
    return worst


@numba.njit(cache=True, nogil=True)
def multiply(vectors, matrix, out):  # type: ignore[no-untyped-def]
    """Fill in vectors (n, dim) times a matrix (dim, dim), shape (n, dim)."""
    for a in range(vectors.shape[0]):
        for i in range(matrix.shape[1]):
            total = 0.0
            for k in range(matrix.shape[0]):
                total += vectors[a, k] * matrix[k, i]
            out[a, i] = total


@numba.njit(cache=True, nogil=True)
def _determinant(matrix):  # type: ignore[no-untyped-def]
    if len(matrix) == 2:
        return matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]
    return (
        matrix[0, 0] * (matrix[1, 1] * matrix[2, 2] - matrix[1, 2] * matrix[2, 1])
        - matrix[0, 1] * (matrix[1, 0] * matrix[2, 2] - matrix[1, 2] * matrix[2, 0])
        + matrix[0, 2] * (matrix[1, 0] * matrix[2, 1] - matrix[1, 1] * matrix[2, 0])
    )


@numba.njit(cache=True, nogil=True, error_model="numpy")
def nodal_forces(gradients, nodes, weights, deformation, squared, directions, stress, forces):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Add the nodal forces (n_nodes_of_mesh, dim) [N] of principal Kirchhoff stresses (n_p, >= dim) [Pa], in 3D.

    `weights` (n_p,) [m^3] are the volumes of the points; see :func:`strains` for the others.
    """
    cells, points, corners, _ = gradients.shape
    for c in range(cells):
        for q in range(points):
            p = c * points + q
            xx = yy = zz = xy = xz = yz = 0.0
            for k in range(3):
                scale = weights[p] * stress[p, k] / squared[p, k]
                x, y, z = directions[p, 0, k], directions[p, 1, k], directions[p, 2, k]
                xx += scale * x * x
                yy += scale * y * y
                zz += scale * z * z
                xy += scale * x * y
                xz += scale * x * z
                yz += scale * y * z
            for i in range(3):
                x, y, z = deformation[p, i, 0], deformation[p, i, 1], deformation[p, i, 2]
                along, up, across = x * xx + y * xy + z * xz, x * xy + y * yy + z * yz, x * xz + y * yz + z * zz
                for a in range(corners):
                    gradient = gradients[c, q, a]
                    forces[nodes[c, a], i] += along * gradient[0] + up * gradient[1] + across * gradient[2]


@numba.njit(cache=True, nogil=True, error_model="numpy")
def nodal_forces_2d(gradients, nodes, weights, deformation, squared, directions, stress, forces):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Do as :func:`nodal_forces` in 2D."""
    cells, points, corners, _ = gradients.shape
    for c in range(cells):
        for q in range(points):
            p = c * points + q
            xx = yy = xy = 0.0
            for k in range(2):
                scale = weights[p] * stress[p, k] / squared[p, k]
                x, y = directions[p, 0, k], directions[p, 1, k]
                xx += scale * x * x
                yy += scale * y * y
                xy += scale * x * y
            for i in range(2):
                x, y = deformation[p, i, 0], deformation[p, i, 1]
                along, up = x * xx + y * xy, x * xy + y * yy
                for a in range(corners):
                    forces[nodes[c, a], i] += along * gradients[c, q, a, 0] + up * gradients[c, q, a, 1]


@numba.njit(cache=True, nogil=True)
def stiffness_of_cells(  # type: ignore[no-untyped-def]  # noqa: PLR0917
    gradients, weights, deformation, squared, directions, stress, tangent, positive, matrices
):
    """Fill in the stiffness of cells (n_cells, n_local, n_local) [N/m].

    `tangent` (n_p, >= dim, >= dim) [Pa] is the derivative of the principal Kirchhoff stresses (n_p, >= dim) by the
    logarithmic strains; see :func:`nodal_forces` for the others. With `positive`, what would make the stiffness of a
    point indefinite is left out.
    """
    cells, points, corners, dim = gradients.shape
    turned, normal = np.empty((corners, dim)), np.empty((dim, dim))
    stretch, nominal = np.empty(dim), np.empty(dim)
    local, current = np.empty((dim * dim, corners * dim)), np.empty((dim, dim))
    product, moduli = np.empty_like(local), np.empty((dim * dim, dim * dim))
    matrices[:] = 0.0
    for c in range(cells):
        for q in range(points):
            p = c * points + q
            for i in range(dim):
                stretch[i] = np.sqrt(squared[p, i])
                nominal[i] = stress[p, i] / stretch[i]
            _moduli(stretch, nominal, stress[p], tangent[p], positive, normal, moduli)
            multiply(deformation[p], directions[p], current)
            for j in range(dim):
                current[:, j] /= stretch[j]
            multiply(gradients[c, q], directions[p], turned)
            # Row i * dim + j is the derivative of component ij of the gradient, in the principal directions.
            for a in range(corners):
                for k in range(dim):
                    for i in range(dim):
                        for j in range(dim):
                            local[i * dim + j, a * dim + k] = current[k, i] * turned[a, j]
            moduli *= weights[p]
            _add_product(local, moduli, product, matrices[c])


@numba.njit(cache=True, nogil=True)
def _add_product(local, moduli, product, matrix):  # type: ignore[no-untyped-def]
    """Add local^T moduli local in loops: each call of a library would cost more than so small a product."""
    product[:] = 0.0
    for row in range(len(moduli)):
        for k in range(len(moduli)):
            if moduli[row, k] != 0.0:
                for column in range(local.shape[1]):
                    product[row, column] += moduli[row, k] * local[k, column]
    for row in range(len(matrix)):
        for k in range(len(moduli)):
            for column in range(len(matrix)):
                matrix[row, column] += local[k, row] * product[k, column]


@numba.njit(cache=True, nogil=True)
def add_blocks(matrices, pairs, blocks):  # type: ignore[no-untyped-def]
    """Add the matrices of cells (n_cells, n_local, n_local) to the blocks (n_pairs, dim, dim) of pairs of nodes."""
    cells, corners = pairs.shape[:2]
    dim = blocks.shape[1]
    for c in range(cells):
        for a in range(corners):
            for b in range(corners):
                for i in range(dim):
                    for j in range(dim):
                        blocks[pairs[c, a, b], i, j] += matrices[c, a * dim + i, b * dim + j]


@numba.njit(cache=True, nogil=True)
def _moduli(stretch, nominal, stress, tangent, positive, normal, moduli):  # type: ignore[no-untyped-def]  # noqa: C901, PLR0912, PLR0917
    """Fill in the derivative of the first Piola-Kirchhoff stress in principal directions, row i * dim + j for ij."""
    dim = len(stretch)
    moduli[:] = 0.0
    for i in range(dim):
        for j in range(dim):
            normal[i, j] = (tangent[i, j] - (stress[i] if i == j else 0.0)) / (stretch[i] * stretch[j])
    for i in range(dim):
        for j in range(i + 1, dim):
            apart = stretch[i] - stretch[j]
            if np.abs(apart) > _ALIKE * stretch[i]:
                shear = (nominal[i] - nominal[j]) / apart
            else:
                shear = 0.5 * (normal[i, i] + normal[j, j]) - normal[i, j]
            turn = (nominal[i] + nominal[j]) / (stretch[i] + stretch[j])
            if positive:
                shear, turn = max(shear, 0.0), max(turn, 0.0)
            index, other = i * dim + j, j * dim + i
            moduli[index, index] = moduli[other, other] = 0.5 * (shear + turn)
            moduli[index, other] = moduli[other, index] = 0.5 * (shear - turn)
    if positive:
        values, vectors = np.linalg.eigh(normal)
        normal[:] = 0.0
        for k in range(dim):
            for i in range(dim):
                for j in range(dim):
                    normal[i, j] += max(values[k], 0.0) * vectors[i, k] * vectors[j, k]
    for i in range(dim):
        for j in range(dim):
            moduli[i * dim + i, j * dim + j] = normal[i, j]


@numba.njit(cache=True, nogil=True)
def along_axes(points, deformation, squared, directions, principal, pairs, tensors):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Fill in tensors (k, m) with principal values (k, 3) along the stretched directions of points (k,).

    `pairs` (m, 2) are the axes of the components; see :func:`strains` for the others.
    """
    dim = squared.shape[1]
    axis = np.empty(dim)
    tensors[:] = 0.0
    for row in range(points.size):
        p = points[row]
        for k in range(dim):
            for i in range(dim):
                axis[i] = 0.0
                for j in range(dim):
                    axis[i] += deformation[p, i, j] * directions[p, j, k]
            scale = principal[row, k] / squared[p, k]
            for m in range(len(pairs)):
                first, second = pairs[m]
                if first < dim:
                    tensors[row, m] += scale * axis[first] * axis[second]
        if dim == 2:
            tensors[row, 2] = principal[row, 2]


@numba.njit(cache=True, nogil=True)
def volume_slopes(gradients, deformation, squared, directions, slopes):  # type: ignore[no-untyped-def]
    """Fill in the derivative of J by the displacements of the cells' nodes (n_p, n_nodes, dim) [1/m]."""
    cells, points, _, dim = gradients.shape
    inverse, cofactor = np.empty((dim, dim)), np.empty((dim, dim))
    for c in range(cells):
        for q in range(points):
            p = c * points + q
            inverse[:] = 0.0
            for k in range(dim):
                for i in range(dim):
                    for j in range(dim):
                        inverse[i, j] += directions[p, i, k] * directions[p, j, k] / squared[p, k]
            volume = _determinant(deformation[p])
            multiply(deformation[p], inverse, cofactor)
            cofactor *= volume
            multiply(gradients[c, q], cofactor.T, slopes[p])
