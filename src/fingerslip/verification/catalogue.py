"""All verification problems."""

from __future__ import annotations

from collections.abc import Sequence

from fingerslip.errors import InputError
from fingerslip.verification import (
    blocks,
    condensed,
    creep,
    dynamics,
    elements,
    fingertip,
    friction,
    impact,
    line,
    locking,
    reduced,
    resting,
    sphere,
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
    *friction.PROBLEMS,
    *creep.PROBLEMS,
    *line.PROBLEMS,
    *sphere.PROBLEMS,
    *fingertip.PROBLEMS,
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
