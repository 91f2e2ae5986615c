"""Numerical libraries read their number of threads from the environment; what the user set is kept."""

from __future__ import annotations

import os

import pytest

from fingerslip.study.running.threads import limited_threads, prefer_single_thread

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


@pytest.mark.parametrize("error", [None, ZeroDivisionError])
@pytest.mark.parametrize(("count", "mkl"), [(1, "1"), (2, "2"), (8, "3")])
def test_threads_are_limited_and_the_environment_comes_back(
    error: type[Exception] | None, count: int, mkl: str
) -> None:
    """What the user set lower stays."""

    def use() -> None:
        with limited_threads(count):
            assert {name: os.environ[name] for name in NAMES} == dict.fromkeys(NAMES, str(count)) | {
                "MKL_NUM_THREADS": mkl
            }
            if error:
                raise error

    if error:
        with pytest.raises(error):
            use()
    else:
        use()
    assert [name for name in NAMES if name in os.environ] == ["MKL_NUM_THREADS"]
    assert os.environ["MKL_NUM_THREADS"] == "3"
