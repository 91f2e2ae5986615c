"""Verification problems that only the tests compute, beside those of ``fingerslip verify``."""

from importlib import import_module

_FILES = (
    *("locking", "condensed", "reduced", "impact", "resting", "bodies", "friction", "creep", "controlled"),
    *("viscous_contact", "fingertip"),
    *("large_laws", "large_relaxation", "large_motion", "large_contact", "independent"),
)
PROBLEMS = tuple(problem for name in _FILES for problem in import_module(f"problems.verification.{name}").PROBLEMS)
