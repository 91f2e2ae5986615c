"""System libraries that Gmsh and VTK load: what is missing, and what to install."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from fingerslip import installation
from fingerslip.installation import Library, install_line, main, missing_libraries, use_writable_cache
from places import ROOT

LIBRARIES = (Library("liba.so.1", "liba1", "a-libs"), Library("libb.so.2", "libb2", "b-libs"))


@pytest.fixture
def lacking(monkeypatch):
    """Return the set of files that cannot be loaded, empty at first; all others can."""
    gone = set()
    monkeypatch.setattr(installation, "_loads", lambda file: file not in gone)
    monkeypatch.setattr(installation.sys, "platform", "linux")
    return gone


def test_what_is_missing_is_named_with_its_packages_and_nothing_where_everything_loads(lacking, capsys, monkeypatch):
    assert (missing_libraries(), main(), capsys.readouterr()) == ((), 0, ("", ""))
    lacking |= {"libGLU.so.1", "libXft.so.2"}
    assert [library.file for library in missing_libraries()] == ["libGLU.so.1", "libXft.so.2"]
    assert main() == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "not here: libGLU.so.1, libXft.so.2\n" in err
    assert "sudo apt-get install libglu1-mesa libxft2\n" in err
    assert "sudo dnf install mesa-libGLU libXft\n" in err
    monkeypatch.setattr(installation.sys, "platform", "darwin")
    assert missing_libraries() == (), "other systems bring their own libraries"
    commands = [
        "  Debian, Ubuntu:  sudo apt-get install liba1 libb2",
        "  Fedora, RHEL:    sudo dnf install a-libs b-libs",
    ]
    assert install_line(LIBRARIES).splitlines() == commands, "one for each family"
    needed = installation._NEEDED
    assert len({library.file for library in needed}) == len(needed)
    for library in needed:
        assert ".so." in library.file
        assert library.debian == library.debian.lower()
        assert library.fedora


@pytest.mark.skipif(sys.platform != "linux", reason="looks for a library of Linux")
def test_loading_is_really_tried():
    assert installation._loads("libc.so.6")
    assert not installation._loads("libfingerslip-does-not-exist.so.9")


def test_check_runs_before_anything_is_installed():
    """The Makefile calls it with a bare Python, so it must not need the site's packages."""
    command = [sys.executable, "-I", "-S", str(installation.__file__)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode in {0, 2}, done.stderr
    assert "Traceback" not in done.stderr
    for caller in ("Makefile", ".ci/run"):
        # As a module of the package it would need what the package imports.
        text = (ROOT / caller).read_text(encoding="utf-8")
        assert "src/fingerslip/installation.py" in text
        assert "-m fingerslip" not in text


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="needs folders that nobody can write")
def test_compiled_functions_go_where_they_can_be_written(monkeypatch, tmp_path):
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    use_writable_cache((Path("/proc/a"), tmp_path))
    assert "NUMBA_CACHE_DIR" not in os.environ
    use_writable_cache((Path("/proc/a"), Path("/proc/b")))
    assert Path(os.environ["NUMBA_CACHE_DIR"]).parent == Path(tempfile.gettempdir())
    monkeypatch.setenv("NUMBA_CACHE_DIR", "mine")
    use_writable_cache((Path("/proc/a"),))
    assert os.environ["NUMBA_CACHE_DIR"] == "mine"


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="needs folders that nobody can write")
def test_without_any_folder_functions_are_compiled_each_time():
    code = """
import tempfile
from pathlib import Path
from fingerslip.installation import use_writable_cache

def nowhere():
    raise FileNotFoundError("no usable temporary directory")

tempfile.gettempdir = nowhere
use_writable_cache((Path("/proc/a"),))
import numba

assert numba.njit(cache=True)(eval("lambda x: x + 1"))(1) == 2
"""
    environment = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    subprocess.run([sys.executable, "-c", code], check=True, env=environment)
