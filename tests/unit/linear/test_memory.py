"""Memory that will not suffice is refused with the estimate, before it is taken."""

from __future__ import annotations

import os

import pytest

import fingerslip as fs
from fingerslip.dynamics.step import condensation
from fingerslip.linear import memory
from fingerslip.linear.memory import available_memory, require_memory
from problems.pushed import push_and_slide


def test_what_is_too_much_is_refused_with_parts_and_mends(monkeypatch):
    monkeypatch.setattr(memory, "available_memory", lambda: 3_000_000_000)
    require_memory({"factors": 2_000_000_000, "compliance": 1_000_000_000})
    with pytest.raises(fs.InputError) as caught:
        require_memory({"factors": 2_600_000_000, "compliance": 1_000_000_000})
    text = str(caught.value)
    assert "needs about 3.6 GB (factors 2.6 GB, compliance 1 GB), 3 GB are available" in text
    assert "larger elements" in text


def test_where_the_system_does_not_tell_nothing_is_refused(monkeypatch):
    monkeypatch.setattr(memory, "available_memory", lambda: None)
    require_memory({"factors": 10**18})


def test_available_memory_is_below_that_of_the_machine():
    found = available_memory()
    assert found is not None
    assert 0 < found <= os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def test_the_limit_of_a_container_counts(monkeypatch, tmp_path):
    for name, value in {"_GROUP_LIMIT": "5000", "_GROUP_USE": "3000"}.items():
        (tmp_path / name).write_text(value)
        monkeypatch.setattr(memory, name, tmp_path / name)
    assert available_memory() == 2000
    (tmp_path / "_GROUP_LIMIT").write_text("max\n")
    assert available_memory() != 2000


def test_a_machine_without_its_list_gives_all_its_memory(monkeypatch, tmp_path):
    monkeypatch.setattr(memory, "_SYSTEM", tmp_path / "none")
    assert memory._in_system() == os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def test_a_simulation_is_refused_before_it_is_factorised(monkeypatch):
    monkeypatch.setattr(condensation, "_COLUMNS_UP_TO", 0)
    monkeypatch.setattr(condensation, "factorise_around", lambda *_: pytest.fail("it must not be factorised"))
    monkeypatch.setattr(memory, "available_memory", lambda: 1000)
    with pytest.raises(fs.InputError, match=r"memory: the simulation needs about .*factors.*compliance.*history"):
        fs.simulate(push_and_slide())


def test_the_limit_of_the_process_counts():
    resource = pytest.importorskip("resource")
    limits = resource.getrlimit(resource.RLIMIT_AS)
    before = memory._in_process()
    used = int(memory._PROCESS.read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    resource.setrlimit(resource.RLIMIT_AS, (used + 1_000_000_000, limits[1]))
    try:
        assert available_memory() == pytest.approx(1_000_000_000, rel=0.1)
    finally:
        resource.setrlimit(resource.RLIMIT_AS, limits)
    assert (memory._in_process() is None) == (before is None)
