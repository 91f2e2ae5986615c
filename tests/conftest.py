"""One thread for the many tiny systems; no deadlines: a busy machine is no failure; fewer examples in the fast tier."""

from __future__ import annotations

import gc

import pytest
from hypothesis import settings
from threadpoolctl import threadpool_limits

settings.register_profile("fast", deadline=None, max_examples=40)
settings.register_profile("all", deadline=None)
# Modules that were loaded stay: garbage is not looked for among them again and again, a tenth of the time of all tests.
gc.disable()


def pytest_configure(config: pytest.Config) -> None:
    """Draw 40 examples of what tests leave open in the fast tier, and the usual 100 where the slow tests run, too."""
    settings.load_profile("fast" if config.getoption("markexpr") == "not slow" else "all")
    # The process that only hands tests out to others starts them the sooner, the less it loads.
    if hasattr(config, "workerinput") or not config.getoption("numprocesses", None):
        from fingerslip.linear.solver import preferred_solver

        # A limit reaches only libraries that are loaded.
        preferred_solver()
        threadpool_limits(limits=1)


def pytest_collection_finish() -> None:
    """Look for garbage from now on, among what tests leave, and more rarely than in a program of little memory."""
    gc.freeze()
    gc.set_threshold(10_000, 10, 10)
    gc.enable()
