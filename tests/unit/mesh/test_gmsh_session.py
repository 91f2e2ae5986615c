"""Gmsh for one mesh: closed afterwards, and left alone where somebody else uses it."""

from __future__ import annotations

import signal
from pathlib import Path

import gmsh
import pytest

from fingerslip.errors import MeshError
from fingerslip.mesh.gmsh_session import gmsh_session, length_unit


def test_session_ends_with_an_error_too():
    def fail():
        with gmsh_session():
            assert gmsh.isInitialized()
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert not gmsh.isInitialized()


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="asks the kernel")
def test_broken_pipes_do_not_end_the_process_after_a_session():
    with gmsh_session():
        pass
    ignored = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("SigIgn"))
    assert int(ignored.split()[1], 16) >> (signal.SIGPIPE - 1) & 1


def test_largest_size_is_less_than_one_for_gmsh():
    assert 3e-3 / length_unit(3e-3) == 0.5


def test_gmsh_that_someone_else_uses_is_left_alone():
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    try:
        with pytest.raises(MeshError, match="already initialised"), gmsh_session():
            pass
        assert gmsh.isInitialized()
    finally:
        gmsh.finalize()
