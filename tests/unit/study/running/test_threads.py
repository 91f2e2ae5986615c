"""Numerical libraries read their number of threads from the environment; what the user set is kept."""

from __future__ import annotations

import os

import pytest

from fingerslip.study.running.threads import prefer_single_thread

NAMES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@pytest.fixture(autouse=True)
def environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """Start with one of the variables set by the user."""
    for name in NAMES:
        monkeypatch.setenv(name, "")
        monkeypatch.delenv(name)
    monkeypatch.setenv("MKL_NUM_THREADS", "3")


def test_one_thread_is_a_wish_that_the_user_may_overrule() -> None:
    prefer_single_thread()
    assert {name: os.environ[name] for name in NAMES} == dict.fromkeys(NAMES, "1") | {"MKL_NUM_THREADS": "3"}
