"""What is shipped: a wheel that runs alone in an empty environment, and code that needs nothing of one system only."""

from __future__ import annotations

import email
import os
import shutil
import subprocess
import sys
import tarfile
import textwrap
import venv
import zipfile
from pathlib import Path

import pytest

from places import ROOT
from robustness.block import write_block

pytestmark = pytest.mark.slow

# What comes with extras, and what a bare wheel must do without.
EXTRAS = ("cv2", "pyarrow", "sklearn", "SALib", "dask", "trame", "gymnasium", "pynwb", "neo", "pypardiso")
COMPILED = {".pyc", ".nbc", ".nbi"}
# Windows has none of these; nothing of a picture in 3D or of an extra is needed to solve and to write results.
BARE = f"""
import os, signal, sys
from importlib import metadata
files = metadata.files
metadata.files = lambda name: None if name == "mkl" else files(name)
for name in ("fcntl", "resource", "pyvista", "vtkmodules", {", ".join(map(repr, EXTRAS))}):
    sys.modules[name] = None
for name in ("SIGPIPE", "SIGHUP", "pthread_sigmask"):
    delattr(signal, name)
for name in ("sysconf", "getuid", "sched_getaffinity"):
    delattr(os, name)
"""


def run(*words, folder, environment=None, code=0):
    """Run a program and return what it prints; it must end with an exit code."""
    options = {"cwd": folder, "env": environment, "capture_output": True, "text": True, "encoding": "utf-8"}
    done = subprocess.run(list(map(str, words)), check=False, **options)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Return the folder of a wheel and a source distribution; the wheel is made from the latter."""
    folder = tmp_path_factory.mktemp("dist")
    run(sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", folder, folder=ROOT)
    with tarfile.open(next(folder.glob("*.tar.gz"))) as source:
        source.extractall(folder / "source", filter="data")
    (root,) = (folder / "source").iterdir()
    run(sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder, folder=root)
    return folder


def test_wheel_and_source_distribution_hold_what_they_should_and_no_more(built):
    with zipfile.ZipFile(next(built.glob("*.whl"))) as wheel:
        names = set(wheel.namelist())
        (path,) = (name for name in names if name.endswith("/METADATA"))
        metadata = email.message_from_bytes(wheel.read(path))
    sources = [file for file in (ROOT / "src" / "fingerslip").rglob("*") if file.is_file()]
    kept = {
        file.relative_to(ROOT / "src").as_posix() for file in sources if not file.suffix.startswith((".pyc", ".nb"))
    }
    studies = {f"fingerslip/data/studies/{file.name}" for file in (ROOT / "studies").iterdir()}
    assert {name for name in names if ".dist-info/" not in name} == kept | studies
    assert metadata["License-Expression"] == "BSD-3-Clause"
    assert metadata["Description-Content-Type"] == "text/markdown"
    assert metadata.get_payload().startswith("# fingerslip"), "the page of the package index is the README"
    assert {"pardiso", "vision", "neural", "detect"} <= set(metadata.get_all("Provides-Extra"))
    (source,) = (built / "source").iterdir()
    name = f"fingerslip-{metadata['Version']}"
    assert (source.name, next(built.glob("*.whl")).name) == (name, f"{name}-py3-none-any.whl")
    hidden = {".git", "__pycache__", "_build", "generated", "results"}
    folders = {path.name for path in source.iterdir()}
    assert {"src", "tests", "docs", "studies", "meshes", "LICENSE", "CITATION.cff", "pyproject.toml"} <= folders
    assert [path for path in source.rglob("*") if path.name in hidden] == []


def test_the_wheel_alone_solves_draws_and_writes_and_says_what_an_extra_needs(built, tmp_path):
    environment = {name: text for name, text in os.environ.items() if not name.startswith("PYTHON")}
    home = tmp_path / "env"
    venv.create(home, with_pip=shutil.which("uv") is None)
    binaries = home / ("Scripts" if sys.platform == "win32" else "bin")
    python, wheel = binaries / "python", next(built.glob("*.whl"))
    installer = ("uv", "pip", "install", "--python", python) if shutil.which("uv") else (python, "-m", "pip", "install")
    run(*installer, wheel, folder=tmp_path, environment=environment)
    missing = f"import importlib.util as u; print([n for n in {EXTRAS} if u.find_spec(n)])"
    assert run(python, "-c", missing, folder=tmp_path, environment=environment) == "[]\n"

    def call(*words, code=0):
        return run(binaries / "fingerslip", *words, folder=tmp_path, environment=environment, code=code)

    assert call("--version") == f"fingerslip {wheel.name.split('-')[1]}\n"
    call("new", "mine.yaml")
    assert "report: results" in call("run", "mine.yaml", "--quiet")
    assert (tmp_path / "results" / "mine" / "report.html").is_file()
    result = next(path for path in (tmp_path / "results" / "mine").iterdir() if (path / "history.nc").is_file())
    call("export", result, "--format", "csv")
    assert "@misc{fingerslip," in call("cite", result)
    for words, extra in ((("export", "--format", "parquet"), "export"), (("figure", "--kind", "film"), "vision")):
        assert f'pip install "fingerslip[{extra}]"' in call(words[0], result, *words[1:], code=2)
    # Compiled files, which pip makes at once and uv does not, do not count.
    files = [path for path in home.rglob("*") if path.is_file() and not path.is_symlink() and path.suffix != ".pyc"]
    size = sum(path.stat().st_size for path in files)
    assert size < 1.4e9, "what is installed without extras; MKL alone would be another gigabyte"


def test_a_study_runs_in_workers_and_is_reported_without_what_only_one_system_or_an_extra_has(tmp_path):
    (tmp_path / "bare").mkdir()
    (tmp_path / "bare" / "sitecustomize.py").write_text(BARE)
    write_block(tmp_path)
    script = """
        from fingerslip.study.running import compute

        compute._METHOD = "spawn"  # as on Windows and macOS

        from fingerslip.commands.app import app

        app(["run", "block.yaml", "--workers", "2", "--quiet"])
    """
    (tmp_path / "script.py").write_text(textwrap.dedent(script))
    paths = os.pathsep.join(map(str, (tmp_path / "bare", ROOT / "src")))
    printed = run(sys.executable, "script.py", folder=tmp_path, environment={**os.environ, "PYTHONPATH": paths})
    assert "Slip events from accumulated slip" in printed
    report = (tmp_path / "results" / "block" / "report.html").read_text(encoding="utf-8")
    assert report.count("<img") > 3
    logs = [path.read_text(encoding="utf-8") for path in Path(tmp_path).rglob("log.txt")]
    assert len(logs) > 1
    assert all("SuperLU" in log for log in logs)
