"""Viscoelasticity by Prony terms: how shear relaxes, and the recurrence that follows it from step to step.

A generalised Maxwell body: a share s_i of the shear modulus relaxes with the time tau_i, the bulk modulus does not ::

    G(t) = G [1 - sum s_i (1 - exp(-t/tau_i))]

G is the modulus at once, that of the law. Each term is a spring in series with a dashpot; with the deviatoric strain e
the dashpot gives way by z, tau z' = e - z, and the deviatoric stress is 2 G (e - sum s_i z_i). Where e is linear in
time over a step h from 0 to 1, exactly, with r = h/tau ::

    z_1 = E z_0 + (1 - phi) e_1 + (phi - E) e_0,    E = exp(-r),    phi = (1 - E)/r

which is second order in the step (Taylor, Pister & Goudreau 1970; Simo & Hughes 1998, section 10.3). Being linear, it
holds for displacements as for strains.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pydantic

from fingerslip.arrays import Floats
from fingerslip.errors import InputError
from fingerslip.parameters import Number, PositiveDuration, parameters

_SHORTEST = 0.5  # relaxation time in steps, at least


@parameters
class PronyTerm:
    """A share of the shear modulus that relaxes.

    Examples
    --------
    The shear modulus of tissue at once, and in the end:

    >>> import fingerslip as fs
    >>> tissue = fs.Elastic(34e3, 0.48, 1000.0, prony=(fs.PronyTerm(0.3, 0.1), fs.PronyTerm(0.2, 2.0)))
    >>> left = 1.0 - sum(term.share for term in tissue.prony)
    >>> f"{tissue.shear_modulus:.0f} Pa, {left * tissue.shear_modulus:.0f} Pa"
    '11486 Pa, 5743 Pa'
    """

    share: Annotated[
        Number,
        pydantic.Field(gt=0, lt=1),
        "Share of the shear modulus at once, between 0 and 1 [-]; the shares of all terms have a sum below 1.",
    ]
    time: Annotated[PositiveDuration, "Relaxation time [s]."]


#: The terms of a material; none where it is elastic.
Prony = Annotated[
    tuple[PronyTerm, ...], "Terms by which the shear modulus relaxes; without them the material is elastic."
]


@dataclass(frozen=True)
class Recurrence:
    """How dashpots follow a field over a step: a number for each of t terms; a history is the field and t dashpots."""

    shares: Floats  # shares of the shear modulus [-]
    decay: Floats  # weights of the dashpot at the start [-]
    end: Floats  # weights of the field at the end [-]
    start: Floats  # weights of the field at the start [-]

    @property
    def taken_share(self) -> float:
        """Share a of a field at the end of a step that dashpots have taken by then [-]."""
        return float(self.shares @ self.end)

    def left(self, history: Floats) -> Floats:
        """Return what of sum s_i z_i at the end of a step follows from the history (1 + t, ...) at its start."""
        field, *dashpots = history
        total: Floats = np.zeros_like(field)
        for share, decay, start, dashpot in zip(self.shares, self.decay, self.start, dashpots, strict=True):
            of_term = decay * dashpot
            of_term += start * field
            of_term *= share
            total += of_term
        return total

    def follow(self, history: Floats, field: Floats) -> Floats:
        """Return the history (1 + t, ...) at the end of a step, where the field is (...): it, and its dashpots."""
        followed = np.empty_like(history)
        followed[0] = field
        for number, dashpot in enumerate(history[1:]):
            of_term = self.decay[number] * dashpot
            of_term += self.start[number] * history[0]
            followed[1 + number] = of_term + self.end[number] * field
        return followed


def check_prony(terms: Prony) -> None:
    """Refuse terms that would leave no stiffness."""
    total = sum(term.share for term in terms)
    if total >= 1.0:
        raise InputError("prony", f"has shares with a sum of {total:.6g}", "needs a sum < 1, the rest stays elastic")


def recurrence(
    terms: Sequence[PronyTerm], step: float, where: str = "prony", *, controlled: bool = False
) -> Recurrence:
    """Return how dashpots follow strain over a step [s]; refuse terms that are too fast for it, unless `controlled`."""
    times = np.array([term.time for term in terms])
    if not controlled and times.min(initial=np.inf) < _SHORTEST * step * (1.0 - 1e-9):
        number = int(times.argmin())
        fault = f"got {times[number]:.6g} s for a step of {step:.6g} s"
        allowed = f"needs at least {_SHORTEST * step:.6g} s, half the step, within which strain is taken as linear"
        repair = "take a smaller step, or leave the term out and its share of the modulus with it"
        raise InputError(f"{where}.{number}.time", fault, allowed, repair)
    ratio = step / times
    decay = np.exp(-ratio)
    mean = -np.expm1(-ratio) / ratio
    return Recurrence(np.array([term.share for term in terms]), decay, 1.0 - mean, mean - decay)


def relaxation(terms: Sequence[PronyTerm], time: Floats) -> Floats:
    """Return the share G(t)/G of the shear modulus that is left at times after a step of strain [s], of their shape.

    Examples
    --------
    >>> relaxation((PronyTerm(0.3, 0.1),), np.array([0.0, 1e9])).tolist()
    [1.0, 0.7]
    """
    left = np.ones_like(time)
    for term in terms:
        left += term.share * np.expm1(-time / term.time)
    return left
