"""Memory that will not suffice is refused before it is taken; small systems are computed with one thread."""

import os
import threading

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import fingerslip as fs
from fingerslip.dynamics import simulation
from fingerslip.dynamics.step import condensation
from fingerslip.linear import resources
from fingerslip.linear.resources import (
    allowed_threads,
    available_memory,
    limited_threads,
    require_memory,
    side_by_side,
    single_dense_thread,
    suitable_threads,
    usable_cores,
)
from problems.pushed import push_and_slide


def test_what_is_too_much_is_refused_with_parts_and_mends_where_the_system_tells(monkeypatch):
    monkeypatch.setattr(resources, "available_memory", lambda: None)
    require_memory({"factors": 10**18})
    monkeypatch.setattr(resources, "available_memory", lambda: 3_000_000_000)
    require_memory({"factors": 2_000_000_000, "compliance": 1_000_000_000})
    message = r"needs about 3.6 GB \(factors 2.6 GB, compliance 1 GB\), 3 GB are available.*larger elements"
    with pytest.raises(fs.InputError, match=message):
        require_memory({"factors": 2_600_000_000, "compliance": 1_000_000_000})


def test_the_limits_of_the_machine_and_of_a_container_count(monkeypatch, tmp_path):
    machine = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    assert 0 < available_memory() <= machine
    for name, value in {"_GROUP_LIMIT": "5000", "_GROUP_USE": "3000"}.items():
        (tmp_path / name).write_text(value)
        monkeypatch.setattr(resources, name, tmp_path / name)
    assert available_memory() == 2000
    (tmp_path / "_GROUP_LIMIT").write_text("max\n")
    assert available_memory() != 2000
    monkeypatch.setattr(resources, "_SYSTEM", tmp_path / "none")
    assert resources._in_system() == machine, "where it keeps no list"


def test_a_simulation_is_refused_before_it_is_factorised(monkeypatch):
    monkeypatch.setattr(condensation, "_SMALL", 0)
    monkeypatch.setattr(condensation, "factorise_around", lambda *_: pytest.fail("it must not be factorised"))
    monkeypatch.setattr(resources, "available_memory", lambda: 1000)
    with pytest.raises(fs.InputError, match=r"memory: the simulation needs about .*factors.*compliance.*history"):
        fs.simulate(push_and_slide())


def test_the_limit_of_the_process_counts():
    resource = pytest.importorskip("resource")
    limits = resource.getrlimit(resource.RLIMIT_AS)
    before = resources._in_process()
    used = int(resources._PROCESS.read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    resource.setrlimit(resource.RLIMIT_AS, (used + 1_000_000_000, limits[1]))
    try:
        assert available_memory() == pytest.approx(1_000_000_000, rel=0.1)
    finally:
        resource.setrlimit(resource.RLIMIT_AS, limits)
    assert (resources._in_process() is None) == (before is None)


def counts() -> set[int]:
    """Return the numbers of threads of the BLAS libraries that are loaded."""
    found = {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}
    assert found, "without a BLAS these tests show nothing"
    return found


@pytest.fixture
def two_threads():
    with threadpool_limits(limits=2, user_api="blas"):
        if counts() != {2}:
            pytest.skip("the libraries here cannot be given two threads")
        yield


def test_cores_are_those_that_this_process_may_use(monkeypatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {3, 5, 7}, raising=False)
    assert usable_cores() == 3
    monkeypatch.delattr(os, "sched_getaffinity")
    assert usable_cores() == os.cpu_count()


@pytest.mark.parametrize("name", ["MKL_NUM_THREADS", "OMP_NUM_THREADS"])
def test_the_environment_has_no_say(name, monkeypatch) -> None:
    monkeypatch.setenv(name, "7")
    monkeypatch.setattr(resources, "usable_cores", lambda: 3)
    assert allowed_threads() == 3


@pytest.mark.parametrize(
    ("n_dofs", "wanted", "dim", "expected"),
    [
        *((14_000, None, 3, 1), (14_000, 3, 3, 1), (15_000, None, 3, 4)),
        *((99_000, None, 2, 1), (99_000, 3, 2, 1), (100_000, None, 2, 4)),
        *((10**6, 1, 3, 1), (10**6, 3, 3, 3), (10**6, 9, 3, 4)),
    ],
)
def test_small_systems_take_one_thread_large_ones_as_many_as_asked_and_possible(
    n_dofs, wanted, dim, expected, monkeypatch
) -> None:
    monkeypatch.setattr(resources, "usable_cores", lambda: 4)
    assert suitable_threads(n_dofs, allowed_threads(wanted), dim) == expected


@pytest.mark.parametrize("wanted", [0, -1, 1.5, "two"])
def test_what_is_no_number_of_threads_is_refused(wanted) -> None:
    with pytest.raises(fs.InputError, match=f"threads: got {wanted!r}, needs a whole number >= 1"):
        fs.simulate(push_and_slide(), threads=wanted)


def test_a_simulation_uses_as_many_threads_as_it_is_given(monkeypatch, two_threads) -> None:
    seen = []
    monkeypatch.setattr(resources, "_WORTH_THREADS", {2: 0})
    monkeypatch.setattr(resources, "usable_cores", lambda: 2)
    build = simulation.build_system
    monkeypatch.setattr(simulation, "build_system", lambda *given: seen.append(counts()) or build(*given))
    short = push_and_slide(programme=(fs.Press(0.01e-3, 1e-3),))
    for threads in (1, 2, None):
        fs.simulate(short, threads=threads)
    assert seen == [{1}, {2}, {2}]


def test_a_limit_holds_in_its_block_whatever_was_set_before_and_gives_the_threads_back(two_threads) -> None:
    with limited_threads(1):
        assert counts() == {1}
    assert counts() == {2}
    with pytest.raises(ZeroDivisionError), limited_threads(1):
        raise ZeroDivisionError
    assert counts() == {2}
    # Gmsh sets the number of threads of others to its own.
    with threadpool_limits(limits=1), limited_threads(2):
        assert counts() == {2}


def test_dense_products_take_one_thread_while_mkl_keeps_its_own(two_threads) -> None:
    def of(kind: str) -> set[int]:
        return {library["num_threads"] for library in threadpool_info() if library["internal_api"] == kind}

    if not of("openblas"):
        pytest.skip("NumPy here does not use OpenBLAS")
    with single_dense_thread():
        assert of("openblas") == {1}
        assert of("mkl") <= {2}
    assert counts() == {2}


def test_functions_side_by_side_run_in_threads_that_end_with_the_block_and_one_thread_is_the_callers() -> None:
    meeting = threading.Barrier(2, timeout=10.0)

    def meet(number: int, other: int) -> tuple[int, str]:
        meeting.wait()
        return number + other, threading.current_thread().name

    with side_by_side(2) as mapper:
        found = list(mapper(meet, [1, 2], [10, 20]))
        assert [value for value, _ in found] == [11, 22]
        assert len({name for _, name in found}) == 2
    assert {name for _, name in found}.isdisjoint(thread.name for thread in threading.enumerate())
    with side_by_side(1) as mapper:
        assert mapper is map
        assert list(mapper(lambda _: threading.current_thread(), [0, 0])) == [threading.current_thread()] * 2
