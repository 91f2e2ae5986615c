"""All verification problems, by name; the file of a problem is loaded when it is its turn."""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING

from fingerslip.errors import InputError

if TYPE_CHECKING:
    from fingerslip.verification.problem import Problem

__all__ = ["FILES", "choose", "known_names", "problem"]

#: The names of all problems, by the file of this folder that has them, in the order of the table.
FILES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "elements": (
            "patch",
            "rigid-modes",
            "convergence-2d",
            "convergence-3d",
            "locking-2d",
            "locking-3d",
        ),
        "locking": (
            "element-errors-2d",
            "element-errors-3d",
        ),
        "condensed": (
            "condensed-2d",
            "condensed-3d",
        ),
        "reduced": (
            "reduced-basis",
            "reduced-basis-static",
        ),
        "dynamics": (
            "hht-order",
            "hht-damping",
            "bar",
            "rod",
            "driven-plate",
        ),
        "impact": ("impact",),
        "blocks": (
            "dragged-block",
            "coulomb-oscillator",
            "sliding-block",
            "stick-slip",
        ),
        "resting": ("resting-block",),
        "bodies": (
            "free-block",
            "filled-jug",
            "held-block",
            "damped-fall",
            "turning-body",
        ),
        "rolling": (
            "rolling-cylinder",
            "cylinder-on-incline",
            "ball-between-plates",
            "travelling-plate",
        ),
        "friction": (
            "friction-laws",
            "friction-tangents",
            "slip-weakening",
        ),
        "creep": ("creep",),
        "viscoelastic": (
            "relaxation",
            "retardation",
            "complex-modulus",
            "viscous-vibration",
            "viscous-limits",
            "viscous-hertz",
        ),
        "controlled": (
            "controlled-creep",
            "controlled-relaxation",
            "controlled-oscillator",
        ),
        "line": (
            "hertz-line",
            "hertz-line-3d",
            "cattaneo",
            "ciavarella-jaeger",
        ),
        "sphere": (
            "hertz-sphere",
            "mindlin",
            "tangential-cycle",
        ),
        "viscous_contact": (
            "viscous-line",
            "viscous-sphere",
        ),
        "fingertip": ("fingertip-refinement",),
        "large_laws": (
            "large-tension",
            "large-biaxial",
            "large-shear",
            "objectivity",
        ),
        "large_relaxation": (
            "large-relaxation-shear",
            "large-relaxation-tension",
            "large-relaxation-order",
            "large-relaxation-limits",
            "large-relaxation-small",
            "large-relaxation-turned",
            "large-relaxation-energy",
        ),
        "large_motion": (
            "small-limit",
            "tumbling-block",
            "halved-step",
        ),
        "large_bodies": (
            "rivlin-cube",
            "large-tube",
            "cook",
            "elastica",
        ),
        "large_contact": ("dragged-cylinder",),
        "independent": ("calculix-block",),
    }
)


def known_names() -> tuple[str, ...]:
    """Return the names of all problems, in the order of the table."""
    return tuple(name for names in FILES.values() for name in names)


def choose(names: Sequence[str]) -> tuple[str, ...]:
    """Return names of problems as they are given, or those of all problems where there are none."""
    known = known_names()
    for name in names:
        if name not in known:
            raise InputError("--only", f"got '{name}'", f"may be one of {', '.join(known)}")
    return tuple(names) or known


def problem(name: str) -> Problem:
    """Return a problem; its file is loaded.

    Parameters
    ----------
    name : str
        Its name, one of :func:`known_names`.
    """
    file = next(file for file, names in FILES.items() if name in names)
    problems: Sequence[Problem] = importlib.import_module(f"fingerslip.verification.{file}").PROBLEMS
    return next(one for one in problems if one.name == name)
