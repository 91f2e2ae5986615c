"""What bodies at large strain remember of their stress, and what of it a step finds at its start.

Dashpots follow, at every quadrature point, the stress of the shape of the law there
(:mod:`fingerslip.materials.relaxing`), and the logarithms of volumes that elements average, which relax as at small
strain: with the mean or the local ln J = x, what is integrated from mean volumes is ::

    K x - 2/3 G R[x]    and in plane stress, with the ratio of areas,    2 G R[w],    w = c x + d sum s_i (z_i + 2 q_i)

with R of a field that field less sum s_i times its dashpots (:class:`~fingerslip.materials.viscoelastic.Across`). A
step finds what dashpots leave at its start, and is elastic from there on: it has an energy of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fingerslip.fe.cell_materials import CellMaterials
from fingerslip.fe.finite.history_kernels import follow, leave
from fingerslip.fe.finite.volumes import Volumes
from fingerslip.materials.finite import FiniteMaterial
from fingerslip.materials.material import Formulation
from fingerslip.materials.prony import recurrence
from fingerslip.materials.relaxing import Constants, constants_of
from fingerslip.materials.viscoelastic import across_of

__all__ = ["PACKED", "History", "Left", "Relaxation", "Terms", "relaxation_of", "selective_excess"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

#: Components of a packed tensor, by the dimension of space.
PACKED = {2: 4, 3: 6}


@dataclass(frozen=True)
class Terms:
    """Prony terms of all materials for a step, a row for each material; missing ones have a share of 0."""

    shares: Array  # (n_materials, t), shares of the shear modulus [-]
    decay: Array  # (n_materials, t), as of :class:`~fingerslip.materials.prony.Recurrence` [-]
    end: Array  # (n_materials, t), as of :class:`~fingerslip.materials.prony.Recurrence` [-]
    start: Array  # (n_materials, t), as of :class:`~fingerslip.materials.prony.Recurrence` [-]

    @property
    def taken(self) -> Array:
        """Share of a strain at the end of a step that dashpots have taken by then, shape (n_materials,) [-]."""
        found: Array = (self.shares * self.end).sum(axis=1)
        return found


@dataclass(frozen=True)
class History:
    """What a body remembers at one time."""

    points: Array  # (n_p, k + 3) [Pa]
    point_dashpots: Array  # (t, n_p, k + 3), the same of the dashpots
    groups: Array  # (n_groups, 2), the last two of groups with a mean volume [-]
    group_dashpots: Array  # (t, n_groups, 2), the same of the dashpots


@dataclass(frozen=True)
class Left:
    """What the start of a step leaves for its end."""

    terms: Terms  # the terms for the step
    points: Array  # (n_p, k + 3), sums of s_i times the part of the dashpots at the end that the start gives
    groups: Array  # (n_groups, 2), the same of groups with a mean volume
    moduli: Array  # (n_materials,) [Pa]
    offsets: Array  # (n_p,), what it adds to its derivative by ln J [Pa]
    group_offsets: Array  # (n_p,), what it adds to its derivative by ln J [Pa]


@dataclass(frozen=True)
class Relaxation:
    """Which quadrature points and groups of a body relax, and how."""

    constants: tuple[Constants, ...]  # constants of the materials
    formulation: Formulation  # the two-dimensional assumption, or `solid`
    points: Indices  # (n_p,), index of the material
    groups: Indices  # (n_p,), index of the material

    @property
    def tensor(self) -> int:
        """Number of components of a packed tensor."""
        return PACKED[3 if self.formulation == "solid" else 2]

    @cached_property
    def shear_moduli(self) -> Array:
        """Shear moduli at once, shape (n_materials,) [Pa]."""
        return np.array([own.shear_modulus for own in self.constants])

    def at_rest(self) -> History:
        """Return what a body remembers that has never moved."""
        count, columns = max(len(own.prony) for own in self.constants), self.tensor + 3
        points, groups = np.zeros((self.points.size, columns)), np.zeros((self.groups.size, 2))
        return History(points, np.zeros((count, *points.shape)), groups, np.zeros((count, *groups.shape)))

    def terms(self, step: float) -> Terms:
        """Return the terms for a step [s] that the model was checked for."""
        count = max(len(own.prony) for own in self.constants)
        tables = np.zeros((4, len(self.constants), count))
        for number, own in enumerate(self.constants):
            follows, size = recurrence(own.prony, step, controlled=True), len(own.prony)
            tables[:, number, :size] = follows.shares, follows.decay, follows.end, follows.start
        return Terms(*tables)

    def left(self, history: History, step: float) -> Left:
        """Return what a step [s] finds at its start."""
        terms = self.terms(step)
        points, groups = np.empty_like(history.points), np.empty_like(history.groups)
        tables = terms.shares, terms.decay, terms.start
        leave(self.points, *tables, history.points, history.point_dashpots, points)
        leave(self.groups, *tables, history.groups, history.group_dashpots, groups)
        moduli, pairs = self._selective(terms)
        offsets = _product(pairs[self.points], points[:, self.tensor + 1 :])
        return Left(terms, points, groups, moduli, offsets, _product(pairs[self.groups], groups))

    def _selective(self, terms: Terms) -> tuple[Array, Array]:
        """Return what the step adds to the selective modulus, (n_materials,), and its derivatives by what is left."""
        twice = 2.0 * self.shear_moduli
        if self.formulation != "plane_stress":
            return twice / 3.0 * terms.taken, twice[:, None] * [1.0 / 3.0, 0.0]
        now, earlier = self.thinning(terms).T
        along = [across_of(own.poisson_ratio).along for own in self.constants]
        rest = 1.0 - terms.taken
        return twice * (rest * now - along), (twice * [rest * earlier, 2.0 * rest * earlier - 1.0]).T

    def thinning(self, terms: Terms) -> Array:
        """Return the parts in w at the end of a step of x there and of what is left, shape (n_materials, 2) [-]."""
        pairs = zip(self.constants, terms.taken, strict=True)
        return np.array([across_of(own.poisson_ratio).of_step(float(taken)) for own, taken in pairs])

    def after(self, history: History, left: Left, tensors: Array, log_volume: Array, groups: Array) -> History:
        """Return what is remembered at the end of a step.

        Parameters
        ----------
        history : History
            At its start.
        left : Left
            What the step found there.
        tensors : (n_p, k + 1) array
            Stress of the shape and its pressure at the end [Pa].
        log_volume, groups : (n_p,) and (n_groups,) array
            ln J at the end, local and of mean volumes; of areas in the plane [-].
        """
        own = np.column_stack(
            [tensors, self._thinned(left, self.points, log_volume, left.points[:, self.tensor + 1 :])]
        )
        mean = self._thinned(left, self.groups, groups, left.groups)
        dashpots, of_groups = np.empty_like(history.point_dashpots), np.empty_like(history.group_dashpots)
        tables = left.terms.decay, left.terms.end, left.terms.start
        follow(self.points, *tables, history.points, own, history.point_dashpots, dashpots)
        follow(self.groups, *tables, history.groups, mean, history.group_dashpots, of_groups)
        return History(own, dashpots, mean, of_groups)

    def _thinned(self, left: Left, number: Indices, log_volume: Array, rest: Array) -> Array:
        """Return ln J (n,) beside the strain across that follows from it at small strain, shape (n, 2) [-]."""
        if self.formulation != "plane_stress":
            return np.column_stack([log_volume, np.zeros_like(log_volume)])
        now, earlier = self.thinning(left.terms)[number].T
        return np.column_stack([log_volume, now * log_volume + earlier * (rest[:, 0] + 2.0 * rest[:, 1])])


def _product(one: Array, other: Array) -> Array:
    found: Array = (one * other).sum(axis=1)
    return found


def relaxation_of(materials: CellMaterials[FiniteMaterial], points: int, volumes: Volumes | None) -> Relaxation | None:
    """Return how a body relaxes; None where all its materials are elastic."""
    constants = tuple(constants_of(material) for material in materials.materials)
    if not any(own.prony for own in constants):
        return None
    groups = np.zeros(0, dtype=np.int64) if volumes is None else volumes.material
    return Relaxation(constants, materials.formulation, np.repeat(materials.number, points), groups)


def selective_excess(constants: Constants, modulus: float, values: Array, dashpots: Sequence[Array]) -> Array:
    """Return by how much the stored energy of what is integrated from mean volumes is above the elastic, (n,) [J/m^3].

    Arrays: modulus [Pa]; values (n, 2) [-]; dashpots (n, 2).
    """
    weights = [1.0 - sum(term.share for term in constants.prony), *(term.share for term in constants.prony)]
    along, across = values.T
    found: Array = 0.5 * constants.bulk_modulus * (along - across) ** 2 - 0.5 * modulus * along**2
    for weight, dashpot in zip(weights, [np.zeros_like(values), *dashpots], strict=False):
        own, thin = (values - dashpot).T
        found += weight * constants.shear_modulus * (thin**2 - (own - thin) ** 2 / 3.0)
    return found
