"""What bodies at large strain remember of their stress, what of it a step finds at its start, and what springs store.

Dashpots follow, at every quadrature point, the stress of the shape of the law there
(:mod:`fingerslip.materials.relaxing`), and the logarithms of volumes that elements average, which relax as at small
strain: with the mean or the local ln J = x, what is integrated from mean volumes is ::

    K x - 2/3 G R[x]    and in plane stress, with the ratio of areas,    2 G R[w],    w = c x + d sum s_i (z_i + 2 q_i)

with R of a field that field less sum s_i times its dashpots (:class:`~fingerslip.materials.viscoelastic.OutOfPlane`). A
step finds what dashpots leave at its start, and is elastic from there on: it has an energy of its own.

The spring of a Prony term carries the stress of the shape less that of its dashpot. It stores what the law stores in
its shape at the strain where it has the deviator of this stress, at the volume of the body. So a body stores what the
law says where it had no time to relax, and what the relaxed law says where it had all of it, up to what a law that
mixes shape and volume stores in its shape where only the volume changes: this is of third order in ln J.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fingerslip.arrays import Floats, Integers
from fingerslip.fe.cell_materials import CellMaterials
from fingerslip.fe.finite.history_kernels import principal_values, push_forward, shape_tensors
from fingerslip.fe.finite.volumes import Volumes
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.large_strain import FiniteMaterial, log_volume_of
from fingerslip.materials.material import Formulation
from fingerslip.materials.prony import Recurrence, recurrence
from fingerslip.materials.relaxing import shape_energy, shape_stress, spring_strain
from fingerslip.materials.viscoelastic import across_of

# Strain up to which a spring is guessed to be linear.
_LINEAR = 0.5
#: Components of a packed tensor, by the dimension of space.
PACKED = {2: 4, 3: 6}


@dataclass(frozen=True)
class History:
    """What a body remembers at one time."""

    points: Floats  # (1 + t, n_p, k + 3), packed stress of the shape, its pressure [Pa], x and w [-]; their dashpots
    groups: Floats  # (1 + t, n_groups, 2), the last two of groups with a mean volume


@dataclass(frozen=True)
class Left:
    """What the start of a step leaves for its end."""

    terms: tuple[Recurrence, ...]  # those of every material for the step
    points: Floats  # (n_p, k + 3), sums of s_i times the part of the dashpots at the end that the start gives
    groups: Floats  # (n_groups, 2), the same of groups with a mean volume
    moduli: Floats  # (n_materials,), what the step adds to the selective modulus [Pa]
    offsets: Floats  # (n_p,), what it adds to the derivative of the selective energy by ln J [Pa]
    group_offsets: Floats  # (n_groups,), the same of groups [Pa]


@dataclass(frozen=True)
class Relaxation:
    """Which quadrature points and groups of a body relax, and how."""

    constants: tuple[Elastic, ...]  # the laws of the materials at rest
    formulation: Formulation  # the two-dimensional assumption, or `solid`
    points: Integers  # (n_p,), index of the material
    groups: Integers  # (n_groups,), index of the material

    @property
    def tensor(self) -> int:
        """Number of components of a packed tensor."""
        return PACKED[3 if self.formulation == "solid" else 2]

    def at_rest(self) -> History:
        """Return what a body remembers that has never moved."""
        count = 1 + max(len(constant.prony) for constant in self.constants)
        shapes = (self.points.size, self.tensor + 3), (self.groups.size, 2)
        return History(*(np.zeros((count, *shape)) for shape in shapes))

    def left(self, history: History, step: float) -> Left:
        """Return what a step [s] that the model was checked for finds at its start."""
        terms = tuple(recurrence(constants.prony, step, controlled=True) for constants in self.constants)
        points, groups = _left(terms, self.points, history.points), _left(terms, self.groups, history.groups)
        moduli, pairs = self._selective(terms)
        offsets = (pairs[self.points] * points[:, self.tensor + 1 :]).sum(axis=1)
        return Left(terms, points, groups, moduli, offsets, (pairs[self.groups] * groups).sum(axis=1))

    def _selective(self, terms: Sequence[Recurrence]) -> tuple[Floats, Floats]:
        """Return what the step adds to the selective modulus, (n_materials,), and its derivatives by what is left."""
        twice = 2.0 * np.array([constant.shear_modulus for constant in self.constants])
        taken = np.array([follows.taken_share for follows in terms])
        if self.formulation != "plane_stress":
            return twice / 3.0 * taken, twice[:, None] * [1.0 / 3.0, 0.0]
        now, earlier = self.thickness_shares(terms).T
        along = [across_of(constant.poisson_ratio).along for constant in self.constants]
        rest = 1.0 - taken
        return twice * (rest * now - along), (twice * [rest * earlier, 2.0 * rest * earlier - 1.0]).T

    def thickness_shares(self, terms: Sequence[Recurrence]) -> Floats:
        """Return the parts in w at the end of a step of x there and of what is left, shape (n_materials, 2) [-]."""
        pairs = zip(self.constants, terms, strict=True)
        return np.array([across_of(element.poisson_ratio).of_step(follows.taken_share) for element, follows in pairs])

    def after(self, history: History, left: Left, tensors: Floats, log_volume: Floats, groups: Floats) -> History:
        """Return what is remembered at the end of a step, from the history at its start and what the step found there.

        At the end the stress of the shape and its pressure are `tensors` (n_p, k + 1) [Pa], and ln J, of areas in 2D,
        `log_volume` (n_p,), and `groups` (n_groups,) of mean volumes [-].
        """
        of_points = self._thickness_strain(left, self.points, log_volume, left.points[:, self.tensor + 1 :])
        updated = np.column_stack([tensors, of_points])
        mean = self._thickness_strain(left, self.groups, groups, left.groups)
        points = _follow(left.terms, self.points, history.points, updated)
        return History(points, _follow(left.terms, self.groups, history.groups, mean))

    def _thickness_strain(self, left: Left, number: Integers, log_volume: Floats, rest: Floats) -> Floats:
        """Return ln J (n,) beside the strain across that follows from it at small strain, shape (n, 2) [-]."""
        if self.formulation != "plane_stress":
            return np.column_stack([log_volume, np.zeros_like(log_volume)])
        now, earlier = self.thickness_shares(left.terms)[number].T
        return np.column_stack([log_volume, now * log_volume + earlier * (rest[:, 0] + 2.0 * rest[:, 1])])


def _left(terms: Sequence[Recurrence], number: Integers, history: Floats) -> Floats:
    """Return what the start of a step leaves of a history (1 + t, n, m) of materials with numbers (n,), (n, m)."""
    left = np.zeros(history.shape[1:])
    for material, follows in enumerate(terms):
        rows = members_of(number, material)
        left[rows] = follows.left(history[: 1 + len(follows.shares), rows])
    return left


def _follow(terms: Sequence[Recurrence], number: Integers, history: Floats, values: Floats) -> Floats:
    """Return the history (1 + t, n, m) at the end of a step with values (n, m); see :func:`_left`."""
    followed = np.zeros_like(history)
    for material, follows in enumerate(terms):
        rows, some = members_of(number, material), slice(1 + len(follows.shares))
        followed[some, rows] = follows.follow(history[some, rows], values[rows])
    return followed


def members_of(number: Integers, material: int) -> Integers | slice:
    """Return where a material is; a slice where it is everywhere, which is faster."""
    return slice(None) if (number == material).all() else np.flatnonzero(number == material)


def relaxation_of(materials: CellMaterials[FiniteMaterial], points: int, volumes: Volumes | None) -> Relaxation | None:
    """Return how a body relaxes; None where all its materials are elastic."""
    constants = tuple(material.at_rest() for material in materials.materials)
    if not any(constant.prony for constant in constants):
        return None
    groups = np.zeros(0, dtype=np.int64) if volumes is None else volumes.material
    return Relaxation(constants, materials.formulation, np.repeat(materials.number, points), groups)


def selective_excess(constants: Elastic, formulation: Formulation, history: Floats) -> Floats:
    """Return by how much the stored energy of what is integrated from mean volumes is above the elastic, (n,) [J/m^3].

    The history is (1 + t, n, 2) [-].
    """
    weights = [1.0 - sum(term.share for term in constants.prony), *(term.share for term in constants.prony)]
    values, *dashpots = history
    along, across = values.T
    elastic = 0.5 * constants.dilatational_modulus(formulation) * along**2
    excess: Floats = 0.5 * constants.bulk_modulus * (along - across) ** 2 - elastic
    for weight, dashpot in zip(weights, [np.zeros_like(values), *dashpots], strict=False):
        strain, thin = (values - dashpot).T
        excess += weight * constants.shear_modulus * (thin**2 - (strain - thin) ** 2 / 3.0)
    return excess


@dataclass(frozen=True)
class Deformed:
    """A body at one displacement, at its n_p quadrature points."""

    deformation: Floats  # (n_p, dim, dim), deformation gradients F [-]
    squared: Floats  # (n_p, dim), squares of the principal stretches [-]
    directions: Floats  # (n_p, dim, dim), principal directions in the reference state, as columns [-]
    log_strain: Floats  # (n_p, 3), principal logarithmic strains, the one across the plane last [-]
    stress: Floats  # (n_p, 3), principal Kirchhoff stresses with the pressure of mean volumes [Pa]
    mean_volume: Floats | None  # (n_groups,), mean ratios of current to reference volume [-]
    pressure: Floats | None  # (n_p,), what mean volumes make the points feel [Pa]
    left: Left | None = None  # what the start of the step leaves
    pulled: Floats | None = None  # (n_p, k) [Pa]
    history: History | None = None  # what the body remembers

    @property
    def log_volume(self) -> Floats:
        """Logarithm of the ratio of volumes, of areas in 2D, shape (n_p,) [-]."""
        return log_volume_of(self.log_strain[:, : self.squared.shape[1]])

    @property
    def volume(self) -> Floats:
        """Ratio of current to reference volume, of areas in 2D, shape (n_p,) [-]."""
        return np.asarray(np.exp(self.log_volume))


def end_history(relaxation: Relaxation, materials: tuple[FiniteMaterial, ...], state: Deformed) -> History:
    """Return what a body remembers at the end of a step, from its state there with the history of the start."""
    if state.left is None or state.history is None:
        raise ValueError("the step was not begun")
    stress = np.zeros_like(state.log_strain)
    for number, material in enumerate(materials):
        if relaxation.constants[number].prony:
            rows = relaxation.points == number
            stress[rows] = shape_stress(material, state.log_strain[rows])
    tensors = np.empty((len(stress), relaxation.tensor))
    shape_tensors(state.squared, state.directions, state.log_strain, stress, tensors)
    groups = np.zeros(0) if state.mean_volume is None else np.log(state.mean_volume)
    stresses = np.column_stack([tensors, log_volume_of(stress) / 3.0])
    return relaxation.after(state.history, state.left, stresses, state.log_volume, groups)


def spring_excess(
    relaxation: Relaxation, number: int, material: FiniteMaterial, state: Deformed, points: Integers
) -> Floats:
    """Return by how much springs store more than the law does at once, shape (n,) [J/m^3], at points (n,)."""
    excess, constants = np.zeros(len(points)), relaxation.constants[number]
    if state.history is None or not constants.prony:
        return excess
    strain, deformation = state.log_strain[points], state.deformation[points]
    whole, elastic = log_volume_of(strain), shape_energy(material, strain)
    source, *dashpots = state.history.points[:, points, : relaxation.tensor]
    for term, dashpot in zip(constants.prony, dashpots, strict=False):
        current, stress = np.empty_like(source), np.empty_like(strain)
        push_forward(deformation, strain, source - dashpot, current)
        principal_values(current, deformation.shape[1], stress)
        guess = np.clip(stress / (2.0 * constants.shear_modulus), -_LINEAR, _LINEAR)
        excess += term.share * (shape_energy(material, spring_strain(material, stress, whole, guess)) - elastic)
    return excess
