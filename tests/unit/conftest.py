"""One thread for tiny systems, and no deadlines: a busy machine is no failure."""

from __future__ import annotations

from hypothesis import settings

from fingerslip.study.threads import prefer_single_thread

prefer_single_thread()
settings.register_profile("unit", deadline=None)
settings.load_profile("unit")
