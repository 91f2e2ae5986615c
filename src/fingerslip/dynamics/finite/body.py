"""The deformable body of a motion at large strain: its forces on the unknowns, its stiff inclusions, and its state.

How far each inclusion, such as a rod of a sensor, has turned is a coordinate of its own. Where one is a hundred
thousand times stiffer than what it lies in, a linear step that turns it also stretches it, by half the square of the
angle: its forces then outweigh all others. And factors of a tangent hold an inclusion that has turned by a thousandth
since. So the position of a node of an inclusion is written ::

    x = c + t + R(phi) R_0 (a + d),    a = X - c

with the mean c of its nodes at rest, their mean displacement t, the rotation R_0 of the tangent that is factorised, the
rotation vector phi since then, and small displacements d that deform it. Iterates are extrapolated, mixed and corrected
in t, phi and d. The inverse of the tangent serves at another rotation as T A^-1 T^T, where T takes each motion of an
inclusion to that which is turned with it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

from fingerslip.arrays import Floats, Integers, Reals
from fingerslip.dynamics.system.operators import Unknowns
from fingerslip.fe.finite.bulk import LargeStrain
from fingerslip.fe.finite.history import Deformed


@dataclass(frozen=True)
class BodyState:
    """A body at one displacement."""

    deformed: Deformed  # strains and stresses at its quadrature points
    nodal: Floats  # (n_dofs,), elastic forces on all degrees of freedom of the mesh [N]
    force: Floats  # (n,), elastic forces on the unknowns [N]
    displacement: Floats  # (n,), displacement of the unknowns [m]
    energy: float = 0.0  # strain energy [J]
    change: Floats | None = None  # (n,), what the last step added to the displacement [m]


@dataclass(frozen=True)
class Body:
    """A body at large strain in the unknowns of a system."""

    bulk: LargeStrain  # mesh and laws
    unknowns: Unknowns  # what they are
    springs: Floats  # (n,), stiffness of the springs at rigid bodies [N/m], zero for all other unknowns

    @property
    def relaxes(self) -> bool:
        """Whether some of its materials relax."""
        return self.bulk.relaxation is not None

    def at_rest(self, step: float) -> BodyState:
        """Return the body that has never moved, for steps of a length [s]."""
        nothing = np.zeros(self.springs.size)
        deformed = self.bulk.at_rest(step)
        return BodyState(deformed, np.zeros(self.unknowns.n_dofs), nothing, nothing)

    def begun(self, state: BodyState, step: float) -> BodyState:
        """Return a body at the start of a step [s], near which its end is searched."""
        return replace(state, deformed=self.bulk.begun(state.deformed, step)) if self.relaxes else state

    def ended(self, state: BodyState) -> BodyState:
        """Return a body at the end of a step with what it remembers, and its energy."""
        ended = replace(state, deformed=self.bulk.ended(state.deformed)) if self.relaxes else state
        return replace(ended, energy=self.energy(ended))

    def at(self, displacement: Floats, near: BodyState | None = None) -> BodyState:
        """Return the body at a displacement (n,) [m], searched from a state near it; refuse cells turned inside out."""
        guess = None if near is None else near.deformed
        deformed = self.bulk.deformed(self.unknowns.on_mesh(displacement), guess)
        nodal = self.bulk.force(deformed)
        force = self.unknowns.restrict(nodal) + self.springs * displacement
        return BodyState(deformed, nodal, force, displacement)

    def energy(self, state: BodyState) -> float:
        """Return the strain energy of a state, that of springs included [J]."""
        return self.bulk.energy(state.deformed) + 0.5 * float(self.springs @ state.displacement**2)

    def tangent(self, state: BodyState, *, positive: bool = False) -> sparse.csr_matrix:
        """Return the derivative of the force by the displacement, shape (n, n) [N/m]; see :class:`LargeStrain`."""
        of_mesh = self.bulk.tangent(state.deformed, positive=positive)
        return self.unknowns.project(of_mesh, self.springs[self.unknowns.rigid])


# Stiffness over that of the softest material from which cells are stiff.
_STIFF = 1e3


@dataclass(frozen=True)
class Local:
    """Displacements of a body in coordinates in which turned inclusions are not stretched.

    The displacement counts from the predictor of the step, as that of a body that has travelled far has few digits left
    for what the step adds.
    """

    values: Floats  # (n,), the displacement since the predictor; of inclusions it does not count [m]
    strained: Floats  # (m, 3), the displacements d that deform inclusions [m]
    shift: Floats  # (k, 3), mean displacements t of inclusions [m]
    turn: Floats  # (k, 3), their rotation vectors phi since R_0 [rad]

    def flat(self) -> Floats:
        """Return all coordinates in one row, shape (n + 3 m + 6 k,)."""
        return np.concatenate([self.values, self.strained.ravel(), self.shift.ravel(), self.turn.ravel()])


@dataclass(frozen=True)
class Inclusions:
    """The stiff inclusions of a body, k with m nodes in all, among the n unknowns."""

    rows: Integers  # (m, dim), the unknowns of their nodes; n where a support holds them
    owner: Integers  # (m,), the inclusion of each node
    means: sparse.csr_matrix  # (k, m), means over the nodes of each
    arms: Floats  # (m, 3), a, their places at rest about the mean of their inclusion [m]

    @cached_property
    def _inertia(self) -> Floats:
        """Means of |a|^2 I - a a^T at rest, shape (k, 3, 3) [m^2]."""
        squares = self._outer(self.arms, self.arms)
        inertia: Floats = np.trace(squares, axis1=1, axis2=2)[:, None, None] * np.eye(3) - squares
        return inertia

    def rotations(self, displacement: Floats) -> Floats:
        """Return how inclusions have turned at a displacement (n,) [m], shape (k, 3, 3)."""
        positions = self.arms + self._read(displacement)
        # That of the nodes about their mean; arms have none.
        left, _, right = np.linalg.svd(self._outer(positions, self.arms))
        left[:, :, 2] *= np.linalg.det(left @ right)[:, None]
        return np.asarray(left @ right)

    def local(self, since: Floats, predictor: Floats, start: Floats) -> Local:
        """Return the coordinates of a displacement since a predictor, both (n,) [m], from rotations R_0 (k, 3, 3)."""
        if not self.owner.size:
            return Local(since, *np.zeros((3, 0, 3)))
        displacement = predictor + since
        positions, turn = self.arms + self._read(displacement), self.rotations(displacement)
        shift = self.means @ positions
        strained = _turned_back(turn[self.owner], positions - shift[self.owner]) - self.arms
        turned = Rotation.from_matrix(turn @ np.swapaxes(start, 1, 2))
        return Local(since, strained, shift, turned.as_rotvec())

    def since(self, flat: Floats, predictor: Floats, start: Floats) -> Floats:
        """Return the displacement since a predictor, both (n,) [m], of coordinates (n + 3 m + 6 k,)."""
        if not self.owner.size:
            return flat
        sizes = 3 * np.array([len(self.arms), len(self._inertia), len(self._inertia)])
        values, *parts = np.split(flat, flat.size - np.cumsum(sizes[::-1])[::-1])
        strained, shift, turn = (part.reshape(-1, 3) for part in parts)
        arms = _turned((Rotation.from_rotvec(turn).as_matrix() @ start)[self.owner], self.arms + strained)
        return self._written(values, arms + shift[self.owner] - self.arms - self._read(predictor))

    def moved(self, local: Local, change: Floats, start: Floats) -> Floats:
        """Return the coordinates (n + 3 m + 6 k,) after a linear change of displacements (n,) [m]."""
        if not self.owner.size:
            return local.values + change
        since: Floats = Rotation.from_rotvec(local.turn).as_matrix()
        matrices = since @ start
        shift, turn, rest = self._split(self._read(change), matrices)
        rest -= np.cross(turn[self.owner], _turned(matrices[self.owner], local.strained))
        strained = local.strained + _turned_back(matrices[self.owner], rest)
        turns = Rotation.from_matrix(Rotation.from_rotvec(turn).as_matrix() @ since)
        return Local(local.values + change, strained, local.shift + shift, turns.as_rotvec()).flat()

    def motion(self, values: Floats, local: Local, start: Floats) -> Floats:
        """Return T x of a motion x (n,), from rotations R_0 (k, 3, 3) to where inclusions are."""
        if not self.owner.size:
            return values
        since, owner = Rotation.from_rotvec(local.turn).as_matrix(), self.owner
        shift, turn, rest = self._split(self._read(values), start)
        across = np.cross(turn[owner], _turned((since @ start)[owner], self.arms))
        return self._written(values, shift[owner] + across + _turned(since[owner], rest))

    def forces(self, values: Floats, local: Local, start: Floats) -> Floats:
        """Return T^T f of forces f (n,); see :meth:`motion`."""
        if not self.owner.size:
            return values
        since, owner, forces = Rotation.from_rotvec(local.turn).as_matrix(), self.owner, self._read(values)
        mean, moment = self.means @ forces, self.means @ np.cross(_turned((since @ start)[owner], self.arms), forces)
        mean -= _turned_back(since, mean)
        turn = self._per_moment(moment - _turned_back(since, moment), start)
        across = np.cross(turn[owner], _turned(start[owner], self.arms))
        return self._written(values, _turned_back(since[owner], forces) + mean[owner] + across)

    def _split(self, change: Floats, turn: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the mean shifts (k, 3) and rotations (k, 3) of changes (m, 3), and what is left of these (m, 3)."""
        arms, shift = _turned(turn[self.owner], self.arms), self.means @ change
        rest = change - shift[self.owner]
        rotation = self._per_moment(self.means @ np.cross(arms, rest), turn)
        return shift, rotation, rest - np.cross(rotation[self.owner], arms)

    def _per_moment(self, moments: Floats, turn: Floats) -> Floats:
        """Return what moments (k, 3) turn inclusions by that have turned (k, 3, 3)."""
        back = _turned_back(turn, moments)
        return _turned(turn, np.linalg.solve(self._inertia, back[:, :, None])[:, :, 0])

    def _outer(self, left: Floats, right: Floats) -> Floats:
        """Return the means of products (m, 3) by (m, 3) of each inclusion, shape (k, 3, 3)."""
        return np.asarray(self.means @ (left[:, :, None] * right[:, None, :]).reshape(-1, 9)).reshape(-1, 3, 3)

    def _read(self, values: Floats) -> Floats:
        """Return the components of nodes of inclusions among values (n,) of the unknowns, shape (m, 3)."""
        padded = np.zeros((len(self.rows), 3))
        padded[:, : self.rows.shape[1]] = np.append(values, 0.0)[self.rows]
        return padded

    def _written(self, values: Floats, components: Floats) -> Floats:
        """Return values (n,) of the unknowns with the components (m, 3) of nodes of inclusions."""
        padded = np.append(values, 0.0)
        padded[self.rows] = components[:, : self.rows.shape[1]]
        return padded[:-1]


def _turned(matrices: Floats, vectors: Reals) -> Floats:
    """Return vectors (k, 3) turned by matrices (k, 3, 3)."""
    return np.asarray(np.einsum("kij,kj->ki", matrices, vectors))


def _turned_back(matrices: Floats, vectors: Floats) -> Floats:
    """Return vectors (k, 3) turned back by matrices (k, 3, 3)."""
    return np.asarray(np.einsum("kji,kj->ki", matrices, vectors))


def find_inclusions(
    positions: Floats, cells: Integers, stiffness: Floats, unknowns: Unknowns, touching: Integers
) -> Inclusions:
    """Return what is stiff [Pa] beside the softest cells, wholly inside, not supported and not `touching`."""
    stiff = cells[stiffness > _STIFF * stiffness.min()]
    size, dim = positions.shape
    first = np.repeat(stiff[:, 0], stiff.shape[1])
    joined = sparse.coo_matrix((np.ones(first.size), (first, stiff.ravel())), shape=(size, size))
    part = connected_components(joined, directed=False)[1]
    rows = unknowns.rows.reshape(size, dim)
    is_carried = (rows >= unknowns.free.size).any(axis=1) | (rows < 0).all(axis=1)
    refused = np.union1d(part[is_carried], part[touching])
    nodes = np.setdiff1d(stiff, np.flatnonzero(np.isin(part, refused)))
    owner = np.unique(part[nodes], return_inverse=True)[1].astype(np.int64)
    arms = np.zeros((nodes.size, 3))
    arms[:, :dim] = positions[nodes]
    counts = np.bincount(owner)
    means = sparse.csr_matrix((1.0 / counts[owner], (owner, np.arange(nodes.size))), shape=(counts.size, nodes.size))
    return Inclusions(np.where(rows < 0, unknowns.count, rows)[nodes], owner, means, arms - (means @ arms)[owner])
