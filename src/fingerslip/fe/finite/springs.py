"""The end of a step in a body that relaxes: what it remembers from then on, and the energy that springs store.

The spring of a Prony term carries the stress of the shape less that of its dashpot. It stores what the law stores in
its shape at the strain where it has the deviator of this stress, at the volume of the body. So a body stores what the
law says where it had no time to relax, and what the relaxed law says where it had all of it, up to what a law that
mixes shape and volume stores in its shape where only the volume changes: this is of third order in ln J.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fingerslip.fe.finite.deformed import Deformed
from fingerslip.fe.finite.history import History, Relaxation, principal_values, push_forward, shape_tensors
from fingerslip.materials.large_strain import FiniteMaterial, log_volume_of
from fingerslip.materials.relaxing import shape_energy, shape_stress, spring_strain

__all__ = ["end_history", "spring_excess"]

Array = NDArray[np.float64]

# Strain up to which a spring is guessed to be linear.
_LINEAR = 0.5


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
    relaxation: Relaxation, number: int, material: FiniteMaterial, state: Deformed, points: NDArray[np.int64]
) -> Array:
    """Return by how much springs store more than the law does at once, shape (n,) [J/m^3], at points (n,).

    Arrays: points (n,).
    """
    excess, constants = np.zeros(len(points)), relaxation.constants[number]
    if state.history is None or not constants.prony:
        return excess
    strain, deformation = state.log_strain[points], state.deformation[points]
    whole, elastic = log_volume_of(strain), shape_energy(material, strain)
    source = state.history.points[points, : relaxation.tensor]
    for term, dashpots in zip(constants.prony, state.history.point_dashpots, strict=False):
        current, stress = np.empty_like(source), np.empty_like(strain)
        push_forward(deformation, strain, source - dashpots[points, : relaxation.tensor], current)
        principal_values(current, deformation.shape[1], stress)
        guess = np.clip(stress / (2.0 * constants.shear_modulus), -_LINEAR, _LINEAR)
        excess += term.share * (shape_energy(material, spring_strain(material, stress, whole, guess)) - elastic)
    return excess
