"""The energy balance of the discrete motion, term by term in closed form.

Over a step, with d the change and bar the mean of start and end values, the scheme's equations give exactly ::

    external work = d(kinetic) + d(strain) + d(contact penalties)
                    + friction + damping + viscous + numerical dissipation

so whatever is left over is rounding, or an error. The numerical dissipation is that of the time integration
(:meth:`fingerslip.dynamics.system.scheme.Scheme.dissipation`) and that of the contact law's implicit step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Energies", "made_energy"]


@dataclass(frozen=True)
class Energies:
    """Energies at one time [J]; dissipations and work are accumulated from the start."""

    kinetic: float = 0.0  # kinetic energy, strain energy and energy of the contact penalties
    strain: float = 0.0  # kinetic energy, strain energy and energy of the contact penalties
    contact: float = 0.0  # kinetic energy, strain energy and energy of the contact penalties
    # energy dissipated by friction, by material damping, and by the time integration with the contact law's step
    friction: float = 0.0
    # energy dissipated by friction, by material damping, and by the time integration with the contact law's step
    damping: float = 0.0
    # energy dissipated by friction, by material damping, and by the time integration with the contact law's step
    numerical: float = 0.0
    external_work: float = 0.0  # work of loads and counterfaces
    initial: float = 0.0  # energy at the start
    viscous: float = 0.0  # energy dissipated by the Prony terms of materials

    @property
    def imbalance(self) -> float:
        """External work and initial energy less all stored and dissipated energy [J]: rounding, or an error."""
        return (
            self.external_work
            + self.initial
            - (self.kinetic + self.strain + self.contact)
            - (self.friction + self.damping + self.viscous + self.numerical)
        )

    def after(
        self,
        *,
        kinetic: float,
        strain: float,
        contact: float,
        friction: float,
        damping: float,
        numerical: float,
        work: float,
        viscous: float = 0.0,
    ) -> Energies:
        """Return the energies after a step, from its new stored energies and its own dissipations and work [J]."""
        return Energies(
            kinetic=kinetic,
            strain=strain,
            contact=contact,
            friction=self.friction + friction,
            damping=self.damping + damping,
            numerical=self.numerical + numerical,
            external_work=self.external_work + work,
            initial=self.initial,
            viscous=self.viscous + viscous,
        )


def made_energy(history: xr.Dataset) -> tuple[float, float]:
    """Return how much energy the steps of a motion have made, in J and as a share of the largest energy.

    That is how far friction and numerical dissipation together, or damping, accumulated, fall below what they have
    been.
    """
    of_steps = history["friction_dissipation"].values + history["numerical_dissipation"].values
    dissipated = np.stack([of_steps, history["damping_dissipation"].values])
    gained = float((np.maximum.accumulate(dissipated, axis=1) - dissipated).max(initial=0.0))
    names = ("kinetic_energy", "strain_energy", "external_work")
    largest = max(float(np.abs(history[name].values).max(initial=0.0)) for name in names)
    return gained, gained / largest if largest > 0.0 else 0.0
