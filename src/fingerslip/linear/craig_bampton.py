"""A reduced basis of a linear body: constraint modes of some unknowns, and the normal modes that these excite.

The unknowns are split into the interface b, where forces act and motion is read, and the inner ones i. The basis is ::

    u = T u_b + V q,    T = [1; -K_ii^-1 K_ib],    V = [0; fixed-interface normal modes and responses to loads]

after Craig & Bampton (1968). T moves the interface and lets the inside follow statically, so every static response to
forces on the interface is exact. The normal modes add what inertia does inside. Those that matter are in the span of
K_ii^-1 (M T y)_i, of K_ii^-1 M_ii times that, and so on, for the slowest motions y of the interface with the inside
following statically: each of these corrects the motion by one more power of its frequency over that of the normal modes
(load-dependent Ritz vectors; Wilson, Yuan & Dickens 1982). Stiffness and mass of the reduced body are ::

    K_r = [S, 0; 0, V^T K V],    M_r = [T^T M T, T^T M V; V^T M T, V^T M V]

with the Schur complement S of K on the interface. The eigenvectors Y of (K_r, M_r), all of them, make both diagonal:
in the coordinates z with [u_b; q] = Y z, the mass is the identity and the stiffness diag(eigenvalues). Displacements s
of the interface that are prescribed stay out of the eigenproblem: they are coordinates behind z, to which their rows of
K_r and M_r couple them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import linalg, sparse

from fingerslip.arrays import Floats, Integers
from fingerslip.linear.solver import LinearSolver, SchurFactor

_COLUMNS_AT_ONCE = 64
# What is left of a shape beside others, below which it adds nothing but rounding.
_NOTHING_NEW = 1e-6


@dataclass(frozen=True)
class ConstraintModes:
    """A body and what it does when its interface is moved, statically."""

    stiffness: sparse.csr_matrix  # K [N/m]
    mass: sparse.csr_matrix  # M [kg]
    interface: Integers  # (p,), the unknowns of the interface, ascending
    solver: LinearSolver  # what factorises
    prescribed: int = 0  # k, how many of the interface, its last, move as prescribed

    @cached_property
    def _factors(self) -> tuple[SchurFactor, Floats]:
        """The factors of K_ii, and S, shape (p, p) [N/m]."""
        # Unknowns that nothing resists, such as driven counterfaces, have to be of the interface. Springs hold these
        # and what moves as prescribed, which may be all that holds the body.
        diagonal = self.stiffness.diagonal()
        springs, prescribed = (diagonal == 0.0).astype(float), self.interface[len(self.interface) - self.prescribed :]
        springs[prescribed] = diagonal[prescribed]
        factor, schur = self.solver.factorise_around(
            sparse.csr_matrix(self.stiffness + sparse.diags(springs)), self.interface
        )
        schur = 0.5 * (schur + schur.T)
        schur.flat[:: len(schur) + 1] -= springs[self.interface]
        return factor, schur

    @property
    def schur(self) -> Floats:
        """S, the Schur complement of K on the interface, shape (p, p) [N/m]."""
        return self._factors[1]

    def follow(self, moved: Floats) -> Floats:
        """Return the displacement T u_b of all unknowns, (n,) or (n, k) [m], for u_b, (p,) or (p, k) [m]."""
        halfway = np.zeros((self.stiffness.shape[0], *moved.shape[1:]), order="F")
        halfway[self.interface] = moved
        return self._factors[0].backward(halfway)

    def gather(self, forces: Floats) -> Floats:
        """Return the forces T^T f on the interface, (p,) or (p, k) [N], with the work of f, (n,) or (n, k) [N]."""
        return np.asarray(self._factors[0].forward(np.asfortranarray(forces))[self.interface])

    def give_way(self, forces: Floats) -> Floats:
        """Return the displacement, (n,) or (n, k) [m], under forces of that shape [N] while the interface is held."""
        halfway = np.asfortranarray(self._factors[0].forward(np.asfortranarray(forces)))
        halfway[self.interface] = 0.0
        return self._factors[0].backward(halfway)


def constraint_modes(body: ConstraintModes, rows: Integers) -> tuple[Floats, Floats]:
    """Return the mass of the constraint modes, T^T M T (p, p) [kg], and T at the unknowns `rows`, (r, p) [-].

    All columns of T exist only some at a time, so that memory stays small: T^T M T is gathered from M T.
    """
    size = body.interface.size
    mass, at_rows = np.empty((size, size)), np.empty((rows.size, size))
    for start in range(0, size, _COLUMNS_AT_ONCE):
        some = slice(start, min(start + _COLUMNS_AT_ONCE, size))
        responses = body.follow(np.eye(size)[:, some])
        mass[:, some] = body.gather(body.mass @ responses)
        at_rows[:, some] = responses[rows]
    return 0.5 * (mass + mass.T), at_rows


@dataclass(frozen=True)
class NormalModes:
    """Normal modes of a body while its interface is held, the slow ones of them as they are, the fast ones about so."""

    frequencies: Floats  # (s,), angular frequencies, ascending [rad/s]
    shapes: Floats  # (n, s), their shapes, orthonormal in the mass, zero at the interface [kg^-1/2]
    following: Floats  # (n, k), what the motions excite next, likewise [kg^-1/2]


def slow_motions(body: ConstraintModes, mass: Floats, count: int) -> Floats:
    """Return the slowest motions (n, k) [kg^-1/2] of a body whose inside follows its interface of mass (p, p) [kg]."""
    last = min(count, body.interface.size) - 1
    _, vectors = linalg.eigh(body.schur, mass, subset_by_index=[0, last], check_finite=False)
    return body.follow(vectors)


def normal_modes(body: ConstraintModes, start: Floats, count: int, following: int = 0) -> NormalModes:
    """Return normal modes that motions `start` (n, k) excite while the interface is held: block Lanczos, Ritz vectors.

    Static displacement under the inertia of a motion is the first correction of one whose inside followed statically,
    and that under the inertia of the correction the next one.
    """
    shapes, excited = np.zeros((body.stiffness.shape[0], 0), order="F"), start
    while excited.shape[1] and shapes.shape[1] < count + following:
        excited = _additions(body, body.give_way(body.mass @ excited), shapes)
        shapes = np.hstack([shapes, excited])
    squares, slow = _ritz(body, shapes[:, :count])
    return NormalModes(np.sqrt(squares), slow, shapes[:, count : count + following])


def _ritz(body: ConstraintModes, shapes: Floats) -> tuple[Floats, Floats]:
    """Return squared frequencies (s,) [1/s^2], and shapes (n, s) that make the stiffness diagonal, too."""
    if not shapes.shape[1]:
        return np.zeros(0), shapes
    squares, vectors = linalg.eigh(shapes.T @ (body.stiffness @ shapes))
    return squares, np.asfortranarray(shapes @ vectors)


def _additions(body: ConstraintModes, fields: Floats, shapes: Floats) -> Floats:
    """Return what fields (n, k) add to shapes (n, s), orthonormal in the mass, what they add most of first."""
    lengths = np.sqrt(np.einsum("ij,ij->j", fields, body.mass @ fields))
    fields = fields[:, lengths > 0.0] / lengths[lengths > 0.0]
    # The second time removes what rounding left.
    for _ in range(2):
        if not fields.shape[1]:
            break
        fields = fields - shapes @ (shapes.T @ (body.mass @ fields))
        squares, vectors = linalg.eigh(fields.T @ (body.mass @ fields))
        selected = np.flatnonzero(squares > _NOTHING_NEW**2)[::-1]
        fields = fields @ (vectors[:, selected] / np.sqrt(squares[selected]))
    return fields


@dataclass(frozen=True)
class CraigBampton:
    """The reduced body in its own m coordinates: z and k prescribed displacements."""

    eigenvalues: Floats  # (m - k,), stiffness over mass, ascending [1/s^2]
    interface: Integers  # (p,), the unknowns of the interface
    at_interface: Floats  # (p, m), displacement of the interface per coordinate [kg^-1/2]
    rows: Integers  # (r,), further unknowns, ascending, whose displacement is known without that of all others
    at_rows: Floats  # (r, m), displacement of these per coordinate [kg^-1/2]
    shapes: Floats  # (n, s), V
    of_shapes: Floats  # (s, m), q per coordinate
    frequencies: Floats  # (s',), angular frequencies of the normal modes among the shapes [rad/s]
    following: Floats  # (n, k) [kg^-1/2]
    following_squares: Floats  # (k,), their stiffness W^T K W, which is diagonal [1/s^2]
    following_mass: Floats  # (k, m), their mass with each coordinate [-]
    following_stiffness: Floats  # (k, m), their stiffness with each coordinate [1/s^2]
    prescribed: Floats  # (2, k, m), stiffness and mass of the prescribed displacements with each coordinate

    def field(self, body: ConstraintModes, coordinates: Floats) -> Floats:
        """Return the displacement of all unknowns, (n,) or (n, k) [m], for coordinates z, (m,) or (m, k)."""
        field = body.follow(self.at_interface @ coordinates)
        # Of several fields, each is contiguous.
        field += ((self.of_shapes @ coordinates).T @ self.shapes.T).T
        return field

    def project(self, body: ConstraintModes, forces: Floats) -> Floats:
        """Return the forces on the coordinates, (m,) or (m, k), of forces on all unknowns, (n,) or (n, k) [N]."""
        return np.asarray(self.at_interface.T @ body.gather(forces) + self.of_shapes.T @ (self.shapes.T @ forces))


def craig_bampton(
    body: ConstraintModes,
    responses: tuple[Floats, Floats],
    modes: NormalModes,
    rows: Integers,
    further: Sequence[Floats] = (),
) -> CraigBampton:
    """Reduce a body by its constraint modes, with T at the unknowns `rows` (r,), and the normal modes that are kept.

    `further` are shapes (n,) that the basis has to hold, such as the responses to loads; only their inner part counts.
    """
    shapes = modes.shapes
    if further:
        inner = np.stack(further, axis=1)
        inner[body.interface] = 0.0
        shapes = np.hstack([shapes, _additions(body, inner, shapes)])
    stiff, heavy = body.stiffness @ shapes, body.mass @ shapes
    mass, at_rows = responses
    size = body.interface.size
    coupling = body.gather(heavy)
    stiffness = linalg.block_diag(body.schur, shapes.T @ stiff)
    whole = np.block([[mass, coupling], [coupling.T, shapes.T @ heavy]])
    first, count = size - body.prescribed, body.prescribed
    prescribed = np.stack([stiffness[first:size], whole[first:size]])
    for axis in (0, 1):
        stiffness, whole = (np.delete(matrix, np.s_[first:size], axis) for matrix in (stiffness, whole))
    squares, vectors = linalg.eigh(stiffness, whole, overwrite_a=True, overwrite_b=True, check_finite=False)
    at_interface = linalg.block_diag(vectors[:first], np.eye(count))
    of_shapes = np.ascontiguousarray(np.hstack([vectors[first:], np.zeros((shapes.shape[1], count))]))
    following_squares, following = _ritz(body, _additions(body, modes.following, shapes))
    return CraigBampton(
        eigenvalues=np.maximum(squares, 0.0),
        interface=body.interface,
        at_interface=at_interface,
        rows=rows,
        at_rows=at_rows @ at_interface + shapes[rows] @ of_shapes,
        shapes=shapes,
        of_shapes=of_shapes,
        frequencies=modes.frequencies,
        following=following,
        following_squares=following_squares,
        following_mass=body.gather(body.mass @ following).T @ at_interface,
        following_stiffness=following.T @ stiff @ of_shapes,
        prescribed=prescribed[..., :size] @ at_interface + prescribed[..., size:] @ of_shapes,
    )
