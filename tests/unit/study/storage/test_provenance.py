"""Which programs made a result: versions, and the commit of the source."""

from __future__ import annotations

import platform
import shutil
import subprocess
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fingerslip.study.storage import provenance
from fingerslip.study.storage.provenance import commit, versions


def test_versions_are_those_that_run() -> None:
    found = versions()
    assert found["python"] == platform.python_version()
    assert found["numpy"] == np.__version__
    assert found["fingerslip"] == metadata.version("fingerslip")
    assert {"scikit-fem", "gmsh", "scipy", "xarray"} <= set(found)


def test_packages_that_are_not_installed_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = metadata.version

    def version(name: str) -> str:
        if name == "mkl":
            raise metadata.PackageNotFoundError(name)
        return whole(name)

    monkeypatch.setattr(metadata, "version", version)
    found = provenance._versions.__wrapped__()
    assert "mkl" not in found
    assert "scipy" in found


@pytest.fixture
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a git repository with one commit in which the package seems to be."""
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    module = tmp_path / "src" / "fingerslip" / "study" / "storage" / "provenance.py"
    module.parent.mkdir(parents=True)
    module.write_text("")
    who = ["-c", "user.name=nobody", "-c", "user.email=nobody@example.org", "-c", "commit.gpgsign=false"]
    for arguments in (["init", "-q"], ["add", "."], [*who, "commit", "-q", "-m", "first"], ["tag", "v1.0"]):
        subprocess.run(["git", "-C", str(tmp_path), *arguments], check=True)
    monkeypatch.setattr(provenance, "__file__", str(module))
    return tmp_path


def test_commit_is_the_whole_hash_and_says_when_files_were_changed(checkout: Path) -> None:
    """A tag on the commit must not stand in for its hash."""
    command = ["git", "-C", str(checkout), "rev-parse", "HEAD"]
    head = subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    assert commit() == head
    (checkout / "src" / "fingerslip" / "study" / "storage" / "provenance.py").write_text("changed")
    assert commit() == f"{head}-dirty"


def test_outside_a_checkout_there_is_no_commit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(provenance, "__file__", str(tmp_path / "a" / "b" / "c" / "provenance.py"))
    assert commit() is None


@pytest.mark.parametrize("error", [FileNotFoundError("git"), subprocess.TimeoutExpired("git", 10)])
def test_without_a_git_that_answers_there_is_no_commit(
    checkout: Path, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    def run(*_: object, **__: object) -> Any:
        raise error

    monkeypatch.setattr(subprocess, "run", run)
    assert commit() is None
