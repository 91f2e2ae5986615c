"""What commands load before their own work begins: no time is measured, only what is imported."""

from __future__ import annotations

import subprocess
import sys

import pytest

from places import ROOT

HEAVY = (
    *("xarray", "pandas", "scipy", "skfem", "numba", "matplotlib", "pyvista", "vtkmodules", "gmsh", "meshio", "h5py"),
    *("pint", "dask", "sklearn", "cv2", "trame"),
)
START = (
    "import sys, contextlib\n"
    "from fingerslip.commands.app import app\n"
    "with contextlib.suppress(SystemExit):\n"
    "    app(sys.argv[1:], prog_name='fingerslip')\n"
    "sys.stderr.write(' '.join(sys.modules))\n"
)
STUDIES = ROOT / "studies"


def loaded(*arguments: str) -> set[str]:
    done = subprocess.run(
        [sys.executable, "-c", START, *arguments], capture_output=True, text=True, check=True, encoding="utf-8"
    )
    # Something was printed, or a mistake was told.
    assert done.stdout or "error: " in done.stderr, done.stderr
    return set(done.stderr.split())


@pytest.mark.parametrize("arguments", [("--help",), ("figure", "--help"), ("run", "--help"), ("new", "--help")])
def test_help_loads_next_to_nothing(arguments: tuple[str, ...]) -> None:
    assert loaded(*arguments) & {*HEAVY, "numpy"} == set()


@pytest.mark.parametrize(
    "arguments",
    [
        ("examples",),
        ("schema",),
        ("verify", "--list"),
        ("show",),
        ("show", "wang2014-2d"),
        ("show", str(STUDIES / "wang2014_table2.yaml")),
    ],
)
def test_what_is_only_read_loads_no_libraries_that_compute_or_draw(arguments: tuple[str, ...]) -> None:
    assert loaded(*arguments) & set(HEAVY) == set()


FILES = (
    ("check", "none.yaml"),
    ("run", "none.yaml"),
    ("figure", "none"),
    ("view", "none"),
    ("validate", "--only", "none"),
    ("track", "none.mp4"),
    ("detect", "run", "none.csv"),
)
# A process for each: these are in the slow tier.
MORE_FILES = (
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


@pytest.mark.parametrize("arguments", [*FILES, *(pytest.param(one, marks=pytest.mark.slow) for one in MORE_FILES)])
def test_what_is_wrong_with_a_file_is_said_before_anything_slow_is_loaded(arguments: tuple[str, ...]) -> None:
    assert loaded(*arguments) & set(HEAVY) == set()


def test_a_check_loads_what_meshes_but_nothing_that_computes_or_labels() -> None:
    found = loaded("check", str(STUDIES / "wang2014_table2.yaml"))
    assert found & {"xarray", "pandas", "numba", "matplotlib", "pyvista", "pint", "h5py"} == set()
    assert "fingerslip.dynamics.step.stepper" not in found
