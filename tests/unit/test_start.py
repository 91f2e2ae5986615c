"""What commands and imports load before their own work begins: no time is measured, only what is loaded."""

import json
import shutil
import subprocess
import sys
from functools import cache

import pytest

from places import STUDIES

HEAVY = {
    *("xarray", "pandas", "scipy", "skfem", "numba", "matplotlib", "pyvista", "vtkmodules", "gmsh", "meshio", "h5py"),
    *("pint", "dask", "sklearn", "cv2", "trame"),
}
# Lines of Python and command lines, one after the other in one process.
START = (
    "import sys, contextlib, json, shlex\n"
    "for line in json.loads(sys.argv[1]):\n"
    "    with contextlib.suppress(SystemExit):\n"
    "        if line.startswith('import '):\n"
    "            print(exec(line))\n"
    "        else:\n"
    "            from fingerslip.commands.app import app\n"
    "            app(shlex.split(line), prog_name='fingerslip')\n"
    "    print(end='\\0', flush=True)\n"
    "    sys.stderr.write(chr(1) + ' '.join(sys.modules) + chr(0))\n"
)


@cache
def loaded(lines):
    """Return for each line the modules that are loaded after it."""
    done = subprocess.run(
        [sys.executable, "-c", START, json.dumps(lines)], capture_output=True, text=True, check=True, encoding="utf-8"
    )
    modules = {}
    for line, printed, answer in zip(lines, done.stdout.split("\0"), done.stderr.split("\0"), strict=False):
        mistake, _, names = answer.partition("\1")
        assert printed or "error: " in mistake, f"{line}: something is printed, or a mistake is told: {mistake}"
        modules[line] = set(names.split())
    assert len(modules) == len(lines)
    return modules


HELP = ("import fingerslip", "import fingerslip.commands.app", "--help")
HELP_OF_VERBS = ("figure --help", "run --help", "new --help")
MODELS = ("import fingerslip.sites", "import fingerslip.model.model")
READ = (
    *("examples", "schema", "verify --list", "show", "show wang2014-2d"),
    f"show '{STUDIES / 'wang2014_table2.yaml'}'",
)
FILES = (
    *("check none.yaml", "run none.yaml", "figure none", "view none", "validate --only none", "track none.mp4"),
    *("detect run none.csv", "converge none.yaml", "report none", "diff none none", "figure none --kind latency"),
    *(
        "figure none --kind film",
        "export none",
        "cite none",
        "predict none --at a=1",
        "sensitivity none",
        "fit none.yaml none.csv",
        "verify --only none",
    ),
    *("detect train none", "detect evaluate none", "detect transfer none none", "detect score none none.csv"),
    *("detect simulate none.yaml", "detect collect none none.csv"),
)
SECTIONS = ("import fingerslip as fs; fs.Model, fs.read_mesh, fs.simulate, fs.build_section",)
# What one line has loaded is loaded for those after it, too: those that may load least come first.
NOT_LOADED = (
    dict.fromkeys(HELP, HEAVY | {"numpy", "pydantic"})
    | dict.fromkeys(HELP_OF_VERBS, HEAVY | {"numpy"})
    | dict.fromkeys(MODELS, HEAVY | {"fingerslip.mesh"})
    | dict.fromkeys((*READ, *FILES), HEAVY)
    | dict.fromkeys(SECTIONS, frozenset(("gmsh", "pygmsh")))
)


@pytest.mark.parametrize("line", NOT_LOADED)
def test_a_line_loads_only_what_it_needs(line):
    """Help needs next to nothing, a table that is read nothing that computes, a mistake nothing that is slow."""
    assert loaded(tuple(NOT_LOADED))[line] & NOT_LOADED[line] == set()


@pytest.mark.slow
def test_a_check_loads_what_meshes_but_nothing_that_computes_or_labels(tmp_path):
    shutil.copy(STUDIES / "wang2014_table2.yaml", tmp_path)
    study = tmp_path / "one_run.yaml"
    study.write_text("base: wang2014_table2.yaml\nsweep: {time.alpha: [-0.41421]}\n", encoding="utf-8")
    check = f"check '{study}'"
    modules = loaded((check,))[check]
    assert "gmsh" in modules
    assert modules & {"xarray", "pandas", "numba", "matplotlib", "pyvista", "pint", "h5py"} == set()
    assert "fingerslip.dynamics.step.stepper" not in modules
