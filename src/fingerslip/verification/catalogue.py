"""All verification problems."""

from __future__ import annotations

from collections.abc import Sequence

from fingerslip.errors import InputError
from fingerslip.verification import (
    blocks,
    bodies,
    condensed,
    controlled,
    creep,
    dynamics,
    elements,
    fingertip,
    friction,
    impact,
    independent,
    large_bodies,
    large_contact,
    large_laws,
    large_motion,
    large_relaxation,
    line,
    locking,
    reduced,
    resting,
    sphere,
    viscoelastic,
    viscous_contact,
)
from fingerslip.verification.problem import Problem

__all__ = ["PROBLEMS", "choose"]

PROBLEMS: tuple[Problem, ...] = (
    *elements.PROBLEMS,
    *locking.PROBLEMS,
    *condensed.PROBLEMS,
    *reduced.PROBLEMS,
    *dynamics.PROBLEMS,
    *impact.PROBLEMS,
    *blocks.PROBLEMS,
    *resting.PROBLEMS,
    *bodies.PROBLEMS,
    *friction.PROBLEMS,
    *creep.PROBLEMS,
    *viscoelastic.PROBLEMS,
    *controlled.PROBLEMS,
    *line.PROBLEMS,
    *sphere.PROBLEMS,
    *viscous_contact.PROBLEMS,
    *fingertip.PROBLEMS,
    *large_laws.PROBLEMS,
    *large_relaxation.PROBLEMS,
    *large_motion.PROBLEMS,
    *large_bodies.PROBLEMS,
    *large_contact.PROBLEMS,
    *independent.PROBLEMS,
)


def choose(names: Sequence[str]) -> tuple[Problem, ...]:
    """Return the problems of some names, or all where there are none.

    Raises
    ------
    InputError
        For a name that no problem has.
    """
    known = {problem.name: problem for problem in PROBLEMS}
    for name in names:
        if name not in known:
            raise InputError("--only", f"got '{name}'", f"may be one of {', '.join(known)}")
    return tuple(known[name] for name in names) or PROBLEMS
