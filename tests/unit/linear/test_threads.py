"""Small systems are computed with one thread, large ones with all that are allowed."""

from __future__ import annotations

import os

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from fingerslip.linear.threads import allowed_threads, single_dense_thread, suitable_threads


def counts() -> set[int]:
    """Return the numbers of threads of the BLAS libraries that are loaded."""
    found = {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}
    assert found, "without a BLAS these tests show nothing"
    return found


@pytest.fixture(autouse=True)
def two_threads():
    with threadpool_limits(limits=2, user_api="blas"):
        if counts() != {2}:
            pytest.skip("the libraries here cannot be given two threads")
        yield


def test_a_small_system_takes_one_thread_and_gives_the_others_back() -> None:
    with suitable_threads(14_000):
        assert counts() == {1}
    assert counts() == {2}


def test_the_threads_come_back_after_a_failure() -> None:
    with pytest.raises(ZeroDivisionError), suitable_threads(10):
        raise ZeroDivisionError
    assert counts() == {2}


@pytest.mark.parametrize("before", [1, 2])
def test_a_large_system_takes_what_is_allowed_whatever_was_set(before, monkeypatch) -> None:
    """Gmsh sets the number of threads of others to its own."""
    monkeypatch.setenv("MKL_NUM_THREADS", "2")
    with threadpool_limits(limits=before), suitable_threads(1_000_000):
        assert counts() == {2}


def test_what_the_user_sets_in_the_environment_is_allowed(monkeypatch) -> None:
    for name in ("MKL_NUM_THREADS", "OMP_NUM_THREADS"):
        monkeypatch.delenv(name, raising=False)
    assert 1 <= allowed_threads() <= (os.cpu_count() or 1)
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    assert allowed_threads() == 3
    monkeypatch.setenv("MKL_NUM_THREADS", "5")
    assert allowed_threads() == 5
    monkeypatch.setenv("MKL_NUM_THREADS", "many")
    assert allowed_threads() == 3


def test_dense_products_take_one_thread_while_mkl_keeps_its_own() -> None:
    def of(kind: str) -> set[int]:
        return {library["num_threads"] for library in threadpool_info() if library["internal_api"] == kind}

    if not of("openblas"):
        pytest.skip("NumPy here does not use OpenBLAS")
    with single_dense_thread():
        assert of("openblas") == {1}
        assert of("mkl") <= {2}
    assert counts() == {2}
