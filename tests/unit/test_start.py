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
    assert done.stdout
    return set(done.stderr.split())


@pytest.mark.parametrize("arguments", [("--help",), ("figure", "--help"), ("run", "--help"), ("new", "--help")])
def test_help_loads_next_to_nothing(arguments: tuple[str, ...]) -> None:
    assert loaded(*arguments) & {*HEAVY, "numpy"} == set()


@pytest.mark.parametrize(
    "arguments",
    [("examples",), ("schema",), ("show",), ("show", "wang2014-2d"), ("show", str(STUDIES / "wang2014_table2.yaml"))],
)
def test_what_is_only_read_loads_no_libraries_that_compute_or_draw(arguments: tuple[str, ...]) -> None:
    assert loaded(*arguments) & set(HEAVY) == set()
