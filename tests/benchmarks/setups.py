"""What benchmarks share: models, seconds of a block, rows of Markdown tables, and the numbers of the version before."""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import json
import os
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import skfem

sys.path.insert(0, str(Path(__file__).parents[1]))

import fingerslip as fs
from fingerslip.study.definition.runs import read_runs
from fingerslip.study.running.build import build_mesh, build_model

ROOT = Path(__file__).parents[2]
_SET_CHILD_SUBREAPER = 36
# CPU seconds, but where the name says something else.
Figures = dict[str, float]


@contextlib.contextmanager
def seconds(figures: Figures, name: str) -> Iterator[None]:
    """Write the CPU seconds of a block, those of its children and of theirs too, and those of the clock."""
    # What a child leaves behind, such as the process that workers are forked from, becomes a child of this process.
    if hasattr(ctypes.CDLL(None), "prctl"):
        ctypes.CDLL(None).prctl(_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    cpu, clock = sum(os.times()[:4]), time.perf_counter()
    yield
    figures[f"{name}, clock"] = time.perf_counter() - clock
    with contextlib.suppress(ChildProcessError):
        while True:
            os.waitpid(-1, 0)
    figures[name] = sum(os.times()[:4]) - cpu


def line(*cells: object, digits: int = 4) -> None:
    """Print a row at once, numbers with so many digits."""
    texts = (f"{cell:.{digits}g}" if isinstance(cell, float) else str(cell) for cell in cells)
    sys.stdout.write("| " + " | ".join(texts) + " |\n")
    sys.stdout.flush()


def table(*heads: object) -> None:
    """Print the head of a table."""
    line(*heads)
    line(*["---"] * len(heads))


def options_of(doc: str | None, *, writes: bool = False) -> argparse.ArgumentParser:
    """Return the parser of a benchmark, whose help is what its file says of itself."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    if writes:
        parser.add_argument("--write", type=Path, metavar="FILE", help="write the numbers, to compare with later")
    return parser


def reference(name: str) -> dict[str, Any]:
    """Return the cases of results/reference/NAME.json, and print what they were measured with."""
    file = ROOT / "results" / "reference" / f"{name}.json"
    known = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {"cases": {}}
    if known["cases"] and "state" in known:
        sys.stdout.write(f"before: {known['state']}; {known['machine']}\n")
    cases: dict[str, Any] = known["cases"]
    return cases


def write(file: Path | None, cases: dict[str, Any]) -> None:
    """Write cases, beside those that a file has, where one is given."""
    if file is not None:
        known = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {"cases": {}}
        content = {"state": "which version", "machine": "which machine"} | known | {"cases": known["cases"] | cases}
        file.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


PRESS_DEPTH, PRESS_SPEED, SLIDE_SPEED = 2e-3, 4e-3, 5e-3
_HALF_WIDTH, _HALF_LENGTH, _HEIGHT = 8e-3, 10e-3, 8e-3
# Of meshes of the fingertip: along the skin that can touch, in the bulk, and the height up to which it is fine [m].
SIZES = {"shipped": (0.45e-3, 0.55e-3, 1.5e-3), "fine": (0.27e-3, 1.3e-3, 3e-3), "coarse": (0.6e-3, 1.3e-3, 1.5e-3)}


def pad_mesh(nodes):
    """Return linear tetrahedra with about `nodes` nodes, finer below; boundaries `skin` and `top`.

    The block of 16 by 20 by 8 mm is bulged below to an ellipsoid, held at its flat upper side.
    """
    per_length = (nodes / (8 * _HALF_WIDTH * _HALF_LENGTH * _HEIGHT / 2)) ** (1 / 3)
    counts = [round(length * per_length) + 1 for length in (2 * _HALF_WIDTH, 2 * _HALF_LENGTH, _HEIGHT)]
    x, y = np.linspace(-_HALF_WIDTH, _HALF_WIDTH, counts[0]), np.linspace(-_HALF_LENGTH, _HALF_LENGTH, counts[1])
    height = np.linspace(0.0, 1.0, counts[2])
    block = skfem.MeshTet.init_tensor(x, y, 0.6 * height + 0.4 * height**2)
    outside = np.minimum((block.p[0] / 8.6e-3) ** 2 + (block.p[1] / 11.5e-3) ** 2, 0.96)
    points = np.vstack([block.p[:2], -_HEIGHT * np.sqrt(1.0 - outside) * (1.0 - block.p[2])])
    top = block.facets_satisfying(lambda p: p[2] > 1.0 - 1e-9, boundaries_only=True)
    skin = np.setdiff1d(block.boundary_facets(), block.facets_satisfying(lambda p: p[2] > 1e-9))
    mesh = skfem.MeshTet(points, block.t).with_boundaries({"top": top, "skin": skin})
    return mesh.with_subdomains({"pulp": np.arange(mesh.nelements)})


def finger_mesh(size):
    """Return the fingertip of the preset `wang2014-3d` in linear tetrahedra, in one of the sizes."""
    return fs.SolidSizes("T4", *SIZES[size]).build(fs.preset("wang2014-3d"))


def model(mesh, *, steps, direction=0.0, friction=0.6, integration="selective"):
    """Return the model: press by 2 mm in 100 steps of 5 ms, then slide at 5 mm/s in a direction [rad]."""
    is_pad = "pulp" in mesh.subdomains
    along, across = np.cos(direction), np.sin(direction)
    duration = max(5e-3 * steps - PRESS_DEPTH / PRESS_SPEED, 5e-3)
    towards = (along, across, 0.0) if is_pad else (along, 0.0, across)
    slide = fs.Slide(duration * SLIDE_SPEED, SLIDE_SPEED, towards)
    return fs.Model(
        mesh=mesh,
        materials={"pulp": fs.Elastic(34e3, 0.48, 1000.0)} if is_pad else fs.preset("wang2014-3d").materials,
        formulation="solid",
        integration=integration,
        supports={"top" if is_pad else "phalanx_dorsal": ("x", "y", "z")},
        contacts=(fs.Contact("skin", fs.Plane((0.0, 0.0, 1.0) if is_pad else (0.0, 1.0, 0.0)), fs.Coulomb(friction)),),
        programme=(fs.Press(PRESS_DEPTH, PRESS_SPEED), slide),
        time=fs.TimeStepping(5e-3, -0.05 if is_pad else -0.41421, end=5e-3 * steps),
    )


class Memory:
    """A store of bases in memory, which costs nothing."""

    def __init__(self):
        self.stored = {}

    def load(self, key):
        return self.stored.get(key)

    def save(self, key, arrays):
        self.stored[key] = dict(arrays)

    def alone(self, _key):
        return contextlib.nullcontext()


def run_of(study, name=None):
    """Return a run of a shipped study by its name; the first without."""
    return next(run for run in read_runs(ROOT / "studies" / f"{study}.yaml").runs if name in {None, run.name})


def model_of(study, name=None):
    """Return the model of a run, on the mesh."""
    run = run_of(study, name)
    return replace(build_model(run, build_mesh(run)), basis=None)
