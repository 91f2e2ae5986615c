"""The energy balance of the discrete motion, term by term in closed form.

Over a step, with d the change and bar the mean of start and end values, the scheme's equations give exactly ::

    external work = d(kinetic) + d(strain) + d(contact penalties)
                    + friction + damping + numerical dissipation

so whatever is left over is rounding, or an error. The numerical dissipation is that of the time integration
(closed form below) and that of the contact law's implicit step.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fingerslip.dynamics.scheme import Scheme, Static

__all__ = ["Energies", "integration_dissipation"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Energies:
    """Energies at one time, all in J; dissipations and work are accumulated from the start."""

    kinetic: float = 0.0
    strain: float = 0.0
    contact: float = 0.0
    friction: float = 0.0
    damping: float = 0.0
    numerical: float = 0.0
    external_work: float = 0.0
    initial: float = 0.0

    @property
    def imbalance(self) -> float:
        """External work and initial energy less all that they went into."""
        return (
            self.external_work
            + self.initial
            - (self.kinetic + self.strain + self.contact + self.friction + self.damping + self.numerical)
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
    ) -> Energies:
        """Return the energies after a step: new states, and what the step adds to the accumulated ones."""
        return replace(
            self,
            kinetic=kinetic,
            strain=strain,
            contact=contact,
            friction=self.friction + friction,
            damping=self.damping + damping,
            numerical=self.numerical + numerical,
            external_work=self.external_work + work,
        )


def integration_dissipation(
    scheme: Scheme,
    *,
    displacement_change: Array,
    velocity_change: Array,
    inertia_change: Array,
    unbalance: tuple[Array, Array, Array],
) -> float:
    """Return the energy that the time integration itself takes out in one step [J].

    Parameters
    ----------
    scheme : HHT or Static
        The coefficients.
    displacement_change, velocity_change : (n,) array
        du [m] and dv [m/s] over the step.
    inertia_change : (n,) array
        Mass times the change of acceleration, M da [N].
    unbalance : tuple of three (n,) arrays
        Unbalanced force at the start of the step before, at the start and at the end of this one, F0, F1, F2 [N].

    Notes
    -----
    From the mean of the equations of motion at both ends and the two Newmark relations::

        h (beta - gamma/2) da.M dv - (gamma - 1/2) da.M du + alpha/2 du.(F2 - F0)

    Without inertia only the jump from an unbalanced start remains: -du.(F1 + F2)/2.
    """
    earliest, start, end = unbalance
    if isinstance(scheme, Static):
        return -0.5 * float(displacement_change @ (start + end))
    newmark = scheme.step * (scheme.beta - 0.5 * scheme.gamma) * (inertia_change @ velocity_change)
    newmark -= (scheme.gamma - 0.5) * (inertia_change @ displacement_change)
    return float(newmark + 0.5 * scheme.alpha * (displacement_change @ (end - earliest)))
