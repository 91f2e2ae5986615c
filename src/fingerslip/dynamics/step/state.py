"""The state of a motion, with the energy balance of the discrete motion term by term in closed form.

Over a step, with d the change and bar the mean of start and end values, the scheme's equations give exactly ::

    external work = d(kinetic) + d(strain) + d(contact penalties)
                    + friction + damping + viscous + numerical dissipation

so whatever is left over is rounding, or an error. The numerical dissipation is that of the time integration
(:meth:`fingerslip.dynamics.system.scheme.Scheme.dissipation`) and that of the contact law's implicit step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.interface import InterfaceState
from fingerslip.contact.solve.partition import Partition
from fingerslip.contact.solve.working_set import WorkingSet
from fingerslip.dynamics.finite.body import BodyState
from fingerslip.dynamics.step.release import Release
from fingerslip.dynamics.step.viscoelastic import HistoryVariables

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Energies:
    """Energies at one time [J]; dissipations and work are accumulated from the start."""

    kinetic: float = 0.0  # kinetic energy
    strain: float = 0.0  # strain energy
    contact: float = 0.0  # energy of the contact penalties
    friction: float = 0.0  # energy dissipated by friction
    damping: float = 0.0  # energy dissipated by material damping
    numerical: float = 0.0  # energy dissipated by the time integration and the contact law's step
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

    def after(self, stored: Mapping[str, Any], spent: Mapping[str, Any]) -> Energies:
        """Return the energies after a step, by their names: those stored at its end, and those spent in it [J]."""
        return replace(self, **stored, **{name: getattr(self, name) + energy for name, energy in spent.items()})


@dataclass(frozen=True)
class State:
    """The motion at one time, on the system's unknowns."""

    time: float  # [s]
    displacement: Array  # (n,) [m]
    velocity: Array  # (n,) [m/s]
    acceleration: Array  # (n,) [m/s^2]
    inertia: Array  # (n,), mass times acceleration [N]
    load: Array  # (n,), forces of loads, those on rigid bodies included [N]
    unbalance: Array  # (n,), unbalanced force C v + K u - f [N]
    unbalance_before: Array  # (n,), that one step earlier [N]
    counterfaces: Array  # (n_counterfaces, dim), prescribed displacement of the counterfaces [m]
    moved: Array  # (n_c, dim), displacement of the candidates relative to their counterfaces [m]
    contact_forces: Array  # (n_c, dim) [N]
    contact_forces_before: Array  # (n_c, dim) [N]
    interface: InterfaceState  # the contact candidates in their frames
    energies: Energies  # the balance so far
    moments: Array  # (r,) [N m]
    step: float = 0.0  # length of the last step [s]
    iterations: int = 0  # iterations of the contact solver in the last step
    residual: float = 0.0  # its relative residual [-]
    working_set: WorkingSet | Partition | None = None  # what the contact solver keeps for the next step
    release: Release | None = None  # what nodes that have left a counterface still feel
    history_variables: tuple[HistoryVariables, ...] = ()  # what viscoelastic layers remember
    body: BodyState | None = None  # the body at large strain
    carried: tuple[NDArray[Any], ...] = ()  # what compiled steps go on from

    @property
    def large_body(self) -> BodyState:
        """The body at large strain, where there is one."""
        if self.body is None:
            raise ValueError("a state at small strain")
        return self.body
