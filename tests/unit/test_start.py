"""What commands load before their own work begins: no time is measured, only what is imported."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from places import ROOT

HEAVY = (
    *("xarray", "pandas", "scipy", "skfem", "numba", "matplotlib", "pyvista", "vtkmodules", "gmsh", "meshio", "h5py"),
    *("pint", "dask", "sklearn", "cv2", "trame"),
)
# One process for several commands, one after the other: what one has loaded is loaded for those after it, too.
START = (
    "import sys, contextlib, json\n"
    "from fingerslip.commands.app import app\n"
    "for arguments in json.loads(sys.argv[1]):\n"
    "    with contextlib.suppress(SystemExit):\n"
    "        app(arguments, prog_name='fingerslip')\n"
    "    print(end='\\0', flush=True)\n"
    "    sys.stderr.write(chr(1) + ' '.join(sys.modules) + chr(0))\n"
)
STUDIES = ROOT / "studies"
Commands = tuple[tuple[str, ...], ...]


@cache
def loaded(commands: Commands) -> dict[tuple[str, ...], set[str]]:
    """Return for each command the modules that are loaded after it."""
    done = subprocess.run(
        [sys.executable, "-c", START, json.dumps(commands)],
        capture_output=True,
        text=True,
        check=True,
        encoding="utf-8",
    )
    found = {}
    for arguments, printed, told in zip(commands, done.stdout.split("\0"), done.stderr.split("\0"), strict=False):
        mistake, _, modules = told.partition("\1")
        assert printed or "error: " in mistake, f"{arguments}: something is printed, or a mistake is told: {mistake}"
        found[arguments] = set(modules.split())
    assert len(found) == len(commands)
    return found


HELP = (("--help",), ("figure", "--help"), ("run", "--help"), ("new", "--help"))


@pytest.mark.parametrize("arguments", HELP)
def test_help_loads_next_to_nothing(arguments: tuple[str, ...]) -> None:
    assert loaded(HELP)[arguments] & {*HEAVY, "numpy"} == set()


READ = (
    ("examples",),
    ("schema",),
    ("verify", "--list"),
    ("show",),
    ("show", "wang2014-2d"),
    ("show", str(STUDIES / "wang2014_table2.yaml")),
)


@pytest.mark.parametrize("arguments", READ)
def test_what_is_only_read_loads_no_libraries_that_compute_or_draw(arguments: tuple[str, ...]) -> None:
    assert loaded(READ)[arguments] & set(HEAVY) == set()


FILES = (
    ("check", "none.yaml"),
    ("run", "none.yaml"),
    ("figure", "none"),
    ("view", "none"),
    ("validate", "--only", "none"),
    ("track", "none.mp4"),
    ("detect", "run", "none.csv"),
    ("converge", "none.yaml"),
    ("report", "none"),
    ("diff", "none", "none"),
    ("figure", "none", "--kind", "latency"),
    ("figure", "none", "--kind", "film"),
    ("export", "none"),
    ("predict", "none", "--at", "a=1"),
    ("sensitivity", "none"),
    ("verify", "--only", "none"),
    ("detect", "train", "none"),
    ("detect", "evaluate", "none"),
    ("detect", "transfer", "none", "none"),
    ("detect", "score", "none", "none.csv"),
    ("detect", "simulate", "none.yaml"),
    ("detect", "collect", "none", "none.csv"),
)


@pytest.mark.parametrize("arguments", FILES)
def test_what_is_wrong_with_a_file_is_said_before_anything_slow_is_loaded(arguments: tuple[str, ...]) -> None:
    assert loaded(FILES)[arguments] & set(HEAVY) == set()


def test_a_check_loads_what_meshes_but_nothing_that_computes_or_labels(tmp_path: Path) -> None:
    shutil.copy(STUDIES / "wang2014_table2.yaml", tmp_path)
    study = tmp_path / "one_run.yaml"
    study.write_text("base: wang2014_table2.yaml\nsweep: {time.alpha: [-0.41421]}\n", encoding="utf-8")
    check = ("check", str(study))
    found = loaded((check,))[check]
    assert "gmsh" in found
    assert found & {"xarray", "pandas", "numba", "matplotlib", "pyvista", "pint", "h5py"} == set()
    assert "fingerslip.dynamics.step.stepper" not in found
