"""What solves roughly with the Newton matrix of the contact: a coarse space, and local inverses.

*Coarse space.* Groups of nodes that the body couples closely push and slide as one, along each axis of their frames.
What the Newton matrix J does to such forces follows from their products with the compliance, which are made once for a
working set. A coarse solution takes them out of a residual b: y = (Z^T J Z)^-1 Z^T b. The local inverse then serves for
b - J Z y.

*Local inverses.* A force moves the body most where it acts. Row by row, the inverse of I - G (I - rho W) is therefore
near that of a small matrix: the part of it among a node and those most strongly coupled to it. A row is made again only
where one of the nearest of these nodes has changed its state. So the cost follows the nodes that change, where that of
factors follows all that touch.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

__all__ = [
    "CoarseSpace",
    "Coupled",
    "LocalInverse",
    "coarse_inverse",
    "group_columns",
    "groups",
    "images_of",
    "renew_rows",
    "unit_forces",
    "write_local_product",
]

Array = NDArray[np.float64]
Single = NDArray[np.float32]
Indices = NDArray[np.int64]

# Nodes of a local matrix, and change of the projection's derivative or of frames from which it is made again [-].
_COUPLED, _CHANGE = 12, 0.3
# The first of these nodes, itself included, whose change counts: others cost more rows than they save iterations.
_COUNTING = 8
_ROWS_AT_ONCE = 256
# Condition from which on a matrix of the coarse space has no inverse.
_SINGULAR = 1e12
# Share of the diagonal below which a pivot counts as none.
_NO_PIVOT = 1e-5


@dataclass(frozen=True)
class Coupled:
    """For each of n_c nodes, those to which a compliance couples it most."""

    near: Indices  # (n_c, m), these nodes, itself first
    body: Single  # (n_c, m * dim, m * dim)

    @classmethod
    def of(cls, body: NDArray[np.floating[Any]], count: int) -> Coupled:
        """Find the nodes in the compliance (count * dim, count * dim) of `count` nodes."""
        near = _coupled_nodes(body, count)
        return cls(near, _local_parts(body, near, len(body) // max(count, 1)))

    def under(self, body: NDArray[np.floating[Any]]) -> Coupled:
        """Return the same nodes under another compliance, (n_c * dim, n_c * dim)."""
        return Coupled(self.near, _local_parts(body, self.near, len(body) // max(len(self.near), 1)))


@dataclass(frozen=True)
class LocalInverse:
    """Rows of local inverses, one for each of k nodes."""

    near: Indices  # (k, m), the nodes of each local matrix among the k, itself first
    rows: Single  # (k, dim, m * dim), rows of the inverses, in single precision [-]
    marks: Array  # (k, 2 * dim, dim), what the rows were made for, slopes and frames

    @classmethod
    def empty(cls, near: Indices, dim: int) -> LocalInverse:
        """Return an inverse of which no row is made, for nodes with `dim` components."""
        count, width = near.shape
        rows = np.zeros((count, dim, width * dim), dtype=np.float32)
        return cls(near, rows, np.full((count, 2 * dim, dim), np.nan))

    def copy(self) -> LocalInverse:
        """Return an inverse whose rows may be renewed without changing these."""
        return LocalInverse(self.near, self.rows.copy(), self.marks.copy())


def _coupled_nodes(body: NDArray[np.floating[Any]], count: int) -> Indices:
    """Return for each node those to which the compliance couples it most, itself first, shape (count, m)."""
    dim, most = len(body) // max(count, 1), min(_COUPLED, count)
    coupled = np.zeros((count, most), dtype=np.int64)
    for start in range(0, count, _ROWS_AT_ONCE):
        end = min(start + _ROWS_AT_ONCE, count)
        rows = body[start * dim : end * dim].reshape(end - start, dim, count, dim)
        coupling: Array = np.einsum("akbk->ab", rows)
        coupling[np.arange(end - start), np.arange(start, end)] = np.inf
        chosen = np.argpartition(-coupling, most - 1, axis=1)[:, :most]
        order = np.argsort(-np.take_along_axis(coupling, chosen, axis=1), axis=1, kind="stable")
        coupled[start:end] = np.take_along_axis(chosen, order, axis=1)
    return coupled


@numba.njit(cache=True, nogil=True)
def _local_parts(body, near, dim):  # type: ignore[no-untyped-def]
    """Return the parts of a compliance among the nodes `near` (n_c, m), shape (n_c, m * dim, m * dim)."""
    count, width = near.shape
    blocks = np.empty((count, width * dim, width * dim), dtype=np.float32)
    for i in range(count):
        for a in range(width * dim):
            row = body[near[i, a // dim] * dim + a % dim]
            for b in range(width):
                for m in range(dim):
                    blocks[i, a, b * dim + m] = row[near[i, b] * dim + m]
    return blocks


@numba.njit(cache=True, nogil=True, fastmath={"reassoc", "contract"})
def write_local_product(near, rows, vector, out):  # type: ignore[no-untyped-def]
    """Write the product of a local inverse with a vector (k * dim,) into `found`, same shape.

    `near` and `rows` may be those of the first k nodes of more.
    """
    count, dim, width = rows.shape
    gathered = np.empty(width, vector.dtype)
    for i in range(count):
        for a in range(near.shape[1]):
            j = near[i, a]
            for m in range(dim):
                gathered[a * dim + m] = vector[j * dim + m] if 0 <= j < count else 0.0
        for k in range(dim):
            total = np.float32(0.0)
            for c in range(width):
                total += rows[i, k, c] * gathered[c]
            out[i * dim + k] = total


@numba.njit(cache=True, nogil=True)
def renew_rows(near, rows, marks, slopes, frames, weights, local, nodes):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Make the rows of nodes that have changed again, and those of the nodes most coupled to them, in place.

    Arrays: slopes (k, dim, dim) [-]; frames (k, dim, dim) [-]; weights (k, dim); local (n_c, m * dim, m * dim); nodes
    (k,).
    """
    changed = _mark_changes(marks, slopes, frames)
    count, dim = slopes.shape[:2]
    renewed = 0
    system = np.empty((rows.shape[2], rows.shape[2] + dim), dtype=np.float32)
    for i in range(count):
        stale = False
        for a in range(min(_COUNTING, near.shape[1])):
            stale |= near[i, a] >= 0 and changed[near[i, a]]
        if stale:
            _write_system(system, near[i], slopes, frames, weights, local[nodes[i]])
            _write_first_rows(system, rows[i])
            renewed += 1
    return renewed


@numba.njit(cache=True, nogil=True)
def _mark_changes(marks, slopes, frames):  # type: ignore[no-untyped-def]
    """Return which nodes have changed since their rows were made, shape (k,), and mark them as they are now."""
    dim = slopes.shape[2]
    changed = np.zeros(len(slopes), np.bool_)
    for i in range(len(slopes)):
        same = True
        for a in range(dim):
            for b in range(dim):
                # Where there was nothing, the marks are no numbers, and nothing is the same.
                same &= abs(marks[i, a, b] - slopes[i, a, b]) <= _CHANGE
                same &= abs(marks[i, dim + a, b] - frames[i, a, b]) <= _CHANGE
        changed[i] = not same
        if changed[i]:
            for a in range(dim):
                for b in range(dim):
                    marks[i, a, b], marks[i, dim + a, b] = slopes[i, a, b], frames[i, a, b]
    return changed


@numba.njit(cache=True, nogil=True)
def _write_system(system, near, slopes, frames, weights, local):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Write the transpose of the Newton matrix among nodes near one, and behind it the unit vectors of that one.

    Its parts are J_ij = G_i rho_i f R_i C_ij R_j^T + delta_ij [I - G_i (I - rho_i P_i)]. Rows of nodes that are open,
    or not there, are those of the identity, and these nodes do not act on others.
    """
    dim, of_body, of_penalty = slopes.shape[1], weights[0], weights[1]
    left, turned = np.empty((dim, dim), dtype=np.float32), np.empty((dim, dim), dtype=np.float32)
    system.fill(0.0)
    for a in range(near.size):
        i = near[a]
        for k in range(dim):
            system[a * dim + k, a * dim + k] = 1.0
        if not _touches(i, slopes):
            continue
        for k in range(dim):
            for m in range(dim):
                system[a * dim + m, a * dim + k] += slopes[i, k, m] * (of_penalty[i, m] - 1.0)
                left[k, m] = 0.0
                for x in range(dim):
                    left[k, m] += slopes[i, k, x] * of_body[i, x] * frames[i, x, m]
        for b in range(near.size):
            if _touches(near[b], slopes):
                _add_response(system, a, b, left, local, frames[near[b]], turned)
    for k in range(dim):
        system[k, len(system) + k] = 1.0


@numba.njit(cache=True, nogil=True)
def _touches(node, slopes):  # type: ignore[no-untyped-def]
    return node >= 0 and slopes[node, 0, 0] != 0.0


@numba.njit(cache=True, nogil=True)
def _add_response(system, a, b, left, local, frame, turned):  # type: ignore[no-untyped-def]  # noqa: PLR0917
    """Add the transpose of left C_ab R_b^T to a system, with the compliance C among its nodes."""
    dim = len(left)
    for k in range(dim):
        for y in range(dim):
            turned[k, y] = 0.0
            for x in range(dim):
                turned[k, y] += left[k, x] * local[a * dim + x, b * dim + y]
    for m in range(dim):
        for k in range(dim):
            for y in range(dim):
                system[b * dim + m, a * dim + k] += turned[k, y] * frame[m, y]


@numba.njit(cache=True, nogil=True)
def _write_first_rows(system, rows):  # type: ignore[no-untyped-def]
    """Write the first rows of the inverse of a matrix (dim, n), from :func:`_write_system`, by elimination in place."""
    size, dim = len(system), len(rows)
    if not _eliminate(system):
        # A matrix without an inverse leaves the identity.
        for k in range(dim):
            for j in range(size):
                rows[k, j] = 1.0 if j == k else 0.0
        return
    for j in range(size - 1, -1, -1):
        for k in range(dim):
            rows[k, j] = system[j, size + k] / system[j, j]
            for r in range(j):
                system[r, size + k] -= system[r, j] * rows[k, j]


@numba.njit(cache=True, nogil=True)
def _eliminate(system):  # type: ignore[no-untyped-def]
    """Make a matrix upper triangular in place, with right-hand sides behind it; tell whether it is regular.

    Without swapping rows: the matrices are near those of springs, and an inverse that is rough does.
    """
    size, width = system.shape
    for start in range(0, size, 4):
        end = min(start + 4, size)
        for j in range(start, end):
            if abs(system[j, j]) < _NO_PIVOT:
                return False
            for r in range(j + 1, end):
                share = system[r, j] / system[j, j]
                for c in range(j, width):
                    system[r, c] -= share * system[j, c]
        if end == start + 4:
            _eliminate_below(system, start)
    return True


@numba.njit(cache=True, nogil=True, fastmath={"contract"})
def _eliminate_below(system, start):  # type: ignore[no-untyped-def]
    """Subtract four rows, triangular among themselves, from all below: each of these is read and written once."""
    size, width = system.shape
    first, second, third, fourth = system[start], system[start + 1], system[start + 2], system[start + 3]
    for r in range(start + 4, size):
        row = system[r]
        a = row[start] / first[start]
        b = (row[start + 1] - a * first[start + 1]) / second[start + 1]
        c = (row[start + 2] - a * first[start + 2] - b * second[start + 2]) / third[start + 2]
        d = row[start + 3] - a * first[start + 3] - b * second[start + 3] - c * third[start + 3]
        d /= fourth[start + 3]
        for k in range(start + 4, width):
            row[k] -= a * first[k] + b * second[k] + c * third[k] + d * fourth[k]


Reals = NDArray[np.floating[Any]]

# Nodes of a group on average, at least and at most, and groups from which on they grow to these.
_LEAST, _MOST, _GROUPS = 10, 50, 12


@dataclass(frozen=True)
class CoarseSpace:
    """Forces on groups of k nodes, and what the compliance does to them."""

    columns: Indices  # (k * dim,)
    moved: Single  # (k * dim, q), rho W Z, in single precision


def groups(body: Reals, nodes: Indices, dim: int) -> Indices:
    """Divide nodes (k,) into groups that a compliance couples closely; return the group of each, shape (k,).

    Each group grows around a node that is coupled little to those before.

    Arrays: body (n_c * dim, n_c * dim), compliance of all candidates, node by node, of any unit.
    """
    best, group = np.full(nodes.size, -np.inf), np.zeros(nodes.size, dtype=np.int64)
    count = min(max(nodes.size // _MOST, _GROUPS), max(nodes.size // _LEAST, 1), nodes.size)
    for number in range(count):
        centre = int(nodes[np.argmin(best)])
        coupling = np.sum([body[centre * dim + k, nodes * dim + k] for k in range(dim)], axis=0)
        closer = coupling > best
        group[closer], best[closer] = number, coupling[closer]
    return group


def group_columns(group: Indices, dim: int) -> Indices:
    """Return which unit force each component of the nodes of groups (k,) belongs to, shape (k * dim,)."""
    columns: Indices = (group[:, None] * dim + np.arange(dim)).ravel()
    return columns


def unit_forces(columns: Indices) -> Single:
    """Return the q unit forces to which components belong, (n,) array of int, as a matrix of shape (n, q)."""
    forces = np.zeros((columns.size, int(columns.max(initial=-1)) + 1), dtype=np.float32)
    forces[np.arange(columns.size), columns] = 1.0
    return forces


@numba.njit(cache=True, nogil=True)
def images_of(slopes, columns, moved):  # type: ignore[no-untyped-def]
    """Return J Z = (I - G (I - rho W)) Z of k nodes, shape (k * dim, q).

    Arrays: slopes (k, dim, dim) [-]; columns, moved (n,).
    """
    count, dim = slopes.shape[:2]
    out = np.zeros((count * dim, moved.shape[1]), moved.dtype)
    for i in range(count):
        for k in range(dim):
            row = out[i * dim + k]
            row[columns[i * dim + k]] = 1.0
            for m in range(dim):
                slope = slopes[i, k, m]
                if slope != 0.0:
                    other = moved[i * dim + m]
                    for c in range(row.size):
                        row[c] += slope * other[c]
                    row[columns[i * dim + m]] -= slope
    return out


def coarse_inverse(columns: Indices, images: Single) -> Single:
    """Return the inverse of Z^T J Z, (q, q), for images J Z (n, q); forces that nothing resists are left out."""
    owners = sparse.csr_matrix((np.ones(len(images)), (columns[: len(images)], np.arange(len(images)))))
    matrix = np.zeros((images.shape[1], images.shape[1]))
    matrix[: owners.shape[0]] = owners @ images
    inverse: Reals = matrix
    with contextlib.suppress(np.linalg.LinAlgError):
        inverse = np.linalg.inv(matrix)
    if not np.abs(inverse).max(initial=0.0) * np.abs(matrix).max(initial=0.0) < _SINGULAR:
        inverse = np.linalg.pinv(matrix, rcond=1.0 / _SINGULAR)
    return np.ascontiguousarray(inverse, dtype=images.dtype)
