"""Stress and stored energy of Hooke's law whose shear relaxes, from strains with their dashpots in 3D.

With the strain e and dashpots z_i (:mod:`fingerslip.materials.prony`), both with all three normal components, the
stress is k tr(e) I + 2 G dev(e - sum s_i z_i), and the energy that springs store

    k/2 tr(e)^2 + G |dev e|^2 - sum s_i (2 G dev e : dev z_i - G |dev z_i|^2)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.materials.elastic import Elastic


@dataclass(frozen=True)
class OutOfPlane:
    """What the strain across a plane without stress across follows from.

    No stress across means, with strains u along the plane (their sum) and -w across, dashpots z_i and q_i, and R of a
    strain that strain less sum s_i times its dashpots ::

        k (u - w) = (2 G/3) R[u + 2 w]    or    w = c u + d sum s_i (z_i + 2 q_i)
    """

    along: float  # c [-]
    relaxed: float  # d [-]
    bulk: float  # bulk modulus over 2 G [-]

    def of_step(self, share: float) -> tuple[float, float]:
        """Return the parts in w at the end of a step of u there, and of the dashpots that its start gives [-]."""
        whole = 1.0 - 2.0 * self.relaxed * share
        return (self.along + self.relaxed * share) / whole, self.relaxed / whole


@dataclass(frozen=True)
class Relaxed:
    """Strains and dashpots with all normal components, in the order xx, yy, zz, xy and in 3D yz, xz."""

    strains: Floats  # (..., k), strains [-]
    dashpots: Floats  # (t, ..., k), dashpots of t terms [-]


def across_of(poisson_ratio: float) -> OutOfPlane:
    """Return what the strain across follows from, for Poisson's ratio at once [-]."""
    if poisson_ratio == 0.5:
        return OutOfPlane(1.0, 0.0, np.inf)
    bulk = (1.0 + poisson_ratio) / (3.0 * (1.0 - 2.0 * poisson_ratio))
    return OutOfPlane((bulk - 1.0 / 3.0) / (bulk + 2.0 / 3.0), 1.0 / (3.0 * bulk + 2.0), bulk)


def with_across(strains: Floats, across: Floats | float = 0.0) -> Floats:
    """Return strains (..., 3 or 6) with a strain (...) across the plane, shape (..., 4 or 6); in 3D as they are."""
    if strains.shape[-1] == 6:
        return strains
    whole = np.empty((4, *strains.shape[:-1]))
    whole[0], whole[1], whole[2], whole[3] = strains[..., 0], strains[..., 1], across, strains[..., 2]
    return np.moveaxis(whole, 0, -1)


def stress(material: Elastic, relaxed: Relaxed) -> Floats:
    """Return the stresses [Pa], shape (..., 4 or 6)."""
    shares = np.array([term.share for term in material.prony])
    springs = relaxed.strains - np.tensordot(shares, relaxed.dashpots, axes=1)
    stress_of_shape = 2.0 * material.shear_modulus * _deviator(springs)
    stress_of_shape[..., :3] += _pressure(material, relaxed.strains, stress_of_shape)[..., None]
    # Shears are twice those of the tensor.
    stress_of_shape[..., 3:] *= 0.5
    return stress_of_shape


def _pressure(material: Elastic, strains: Floats, deviator: Floats) -> Floats:
    """Return the mean stress (...) [Pa]; of an incompressible material that of plane stress, none across."""
    if material.poisson_ratio == 0.5:
        return -deviator[..., 2]
    return np.asarray(material.bulk_modulus * strains[..., :3].sum(axis=-1))


def stored_energy(material: Elastic, relaxed: Relaxed) -> Floats:
    """Return the energy densities that springs store [J/m^3], shape (...)."""
    deviator = _deviator(relaxed.strains)
    pressure = _pressure(material, relaxed.strains, np.zeros_like(deviator))
    stored: Floats = 0.5 * pressure * relaxed.strains[..., :3].sum(axis=-1)
    stored += material.shear_modulus * _product(deviator, deviator)
    for term, dashpot in zip(material.prony, map(_deviator, relaxed.dashpots), strict=True):
        stored -= term.share * material.shear_modulus * _product(2.0 * deviator - dashpot, dashpot)
    return stored


def _deviator(strains: Floats) -> Floats:
    deviator = strains.copy()
    deviator[..., :3] -= strains[..., :3].mean(axis=-1, keepdims=True)
    return deviator


def _product(first: Floats, other: Floats) -> Floats:
    """Return the products (...) of strain tensors, whose shears are twice those of the tensor."""
    products = first * other
    return np.asarray(products[..., :3].sum(axis=-1) + 0.5 * products[..., 3:].sum(axis=-1))
