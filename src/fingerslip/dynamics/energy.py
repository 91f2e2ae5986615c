"""The energy balance of the discrete motion, term by term in closed form.

Over a step, with d the change and bar the mean of start and end values, the scheme's equations give exactly ::

    external work = d(kinetic) + d(strain) + d(contact penalties)
                    + friction + damping + numerical dissipation

so whatever is left over is rounding, or an error. The numerical dissipation is that of the time integration
(:meth:`fingerslip.dynamics.scheme.Scheme.dissipation`) and that of the contact law's implicit step.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

__all__ = ["Energies"]


@dataclass(frozen=True)
class Energies:
    """Energies at one time [J]; dissipations and work are accumulated from the start.

    Parameters
    ----------
    kinetic, strain, contact : float
        Kinetic energy, strain energy and energy of the contact penalties.
    friction, damping, numerical : float
        Energy dissipated by friction, by material damping, and by the time integration with the contact law's step.
    external_work : float
        Work of loads and counterfaces.
    initial : float
        Energy at the start.
    """

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
        """External work and initial energy less all stored and dissipated energy [J]: rounding, or an error."""
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
        """Return the energies after a step, from its new stored energies and its own dissipations and work [J]."""
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
