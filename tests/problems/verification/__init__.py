"""Verification problems that only the tests compute, beside those of ``fingerslip verify``."""

from importlib import import_module

_FILES = (
    *("locking", "condensed", "fingertip", "time_steps", "plates", "bodies", "viscous_contact"),
    *("large_laws", "large_relaxation", "large_motion", "dragged_cylinder"),
)
PROBLEMS = tuple(problem for name in _FILES for problem in import_module(f"problems.verification.{name}").PROBLEMS)
