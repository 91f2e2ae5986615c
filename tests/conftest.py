"""One thread for the many tiny systems, and no deadlines: a busy machine is no failure."""

from __future__ import annotations

from hypothesis import settings
from threadpoolctl import threadpool_limits

from fingerslip.linear.solver import preferred_solver

# A limit reaches only libraries that are loaded.
preferred_solver()
threadpool_limits(limits=1)
settings.register_profile("tests", deadline=None)
settings.load_profile("tests")
