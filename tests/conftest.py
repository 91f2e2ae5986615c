"""One thread for the many tiny systems, and no deadlines: a busy machine is no failure."""

from __future__ import annotations

from hypothesis import settings

from fingerslip.study.running.threads import prefer_single_thread

# Before anything loads numpy, whose libraries read it then.
prefer_single_thread()
settings.register_profile("tests", deadline=None)
settings.load_profile("tests")
