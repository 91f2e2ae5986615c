"""Friction laws: how large the tangential traction may be.

A law gives the friction coefficient mu of every contact node for one step. With the pressure p, the tangential traction
t_0 at the start of the step, the stiffness k_t of the contact and the tangential motion d of the step, the traction t
follows from Coulomb's law with that coefficient by return mapping (Simo & Laursen 1992)::

    trial    t* = t_0 - k_t d
    stick    t = t*                  where |t*| <= mu p
    slip     t = mu p t* / |t*|      elsewhere

The coefficient is taken from the conditions at the start of the step, where contact is solved
(:func:`fingerslip.dynamics.step.contact_step.solve_law`). This is exact for constant coefficients and first order in
the step for the others; within a step, the problem is solved to its full tolerance.
"""

from __future__ import annotations

from fingerslip.contact.friction.anisotropic import Anisotropic
from fingerslip.contact.friction.coulomb import Coulomb
from fingerslip.contact.friction.law import ISOTROPIC, Conditions, FrictionLaw, TangentFrame, weakens
from fingerslip.contact.friction.pressure_dependent import PressureDependent
from fingerslip.contact.friction.slip_weakening import SlipWeakening
from fingerslip.contact.friction.static_kinetic import StaticKinetic
from fingerslip.contact.friction.time_dependent import TimeDependent

__all__ = [
    "ISOTROPIC",
    "Anisotropic",
    "BuiltInLaw",
    "Conditions",
    "Coulomb",
    "FrictionLaw",
    "PressureDependent",
    "SlipWeakening",
    "StaticKinetic",
    "TangentFrame",
    "TimeDependent",
    "weakens",
]

# What study files can name, each by its class in snake case.
BuiltInLaw = Coulomb | StaticKinetic | PressureDependent | Anisotropic | SlipWeakening | TimeDependent
