"""Verification problems that only the tests compute, beside those of ``fingerslip verify``."""

from problems.verification import (
    bodies,
    condensed,
    controlled,
    creep,
    fingertip,
    friction,
    impact,
    independent,
    large_contact,
    large_laws,
    large_motion,
    large_relaxation,
    locking,
    reduced,
    resting,
    viscous_contact,
)

_FILES = (
    *(locking, condensed, reduced, impact, resting, bodies, friction, creep, controlled, viscous_contact, fingertip),
    *(large_laws, large_relaxation, large_motion, large_contact, independent),
)
PROBLEMS = tuple(problem for file in _FILES for problem in file.PROBLEMS)
