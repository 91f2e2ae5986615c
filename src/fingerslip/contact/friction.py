"""Friction laws: what the tangential traction may be."""

from __future__ import annotations

from fingerslip.parameters import NonNegativeNumber, parameters

__all__ = ["Coulomb"]


@parameters
class Coulomb:
    """Coulomb's law: the tangential traction is at most the coefficient times the normal one.

    Parameters
    ----------
    coefficient : float
        Friction coefficient [-]; 0 is frictionless.
    """

    coefficient: NonNegativeNumber
