"""The study of a block under a plate, its mesh and its run, and a progress that keeps what it is told."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import skfem

from fingerslip.results import StudyResult
from fingerslip.study.running.progress import StudyProgress
from fingerslip.study.running.runner import run_study

FRICTIONS = [0.2, 0.4, 0.6]
#: The runs of the study.
NAMES = [f"friction_coefficient-{friction}" for friction in FRICTIONS]
#: What the fixture `write_study` gives.
Write = Callable[..., Path]


def block_values() -> dict[str, Any]:
    """Return a study of a block under a plate, as a YAML file holds it."""
    return {
        "title": "Block on a plate",
        "mesh": {"file": "block.msh"},
        "formulation": "plane_strain",
        "depth": "1 mm",
        "materials": {"block": {"youngs_modulus": "100 kPa", "poisson_ratio": 0.3, "density": "1000 kg/m^3"}},
        "supports": {"top": ["x", "y"]},
        "contact": {"friction_coefficient": 0.6, "boundary": "bottom"},
        "programme": [
            {"press": {"depth": "0.1 mm", "speed": "5 mm/s"}},
            {"slide": {"distance": "0.2 mm", "speed": "5 mm/s"}},
        ],
        "time": {"step": "2 ms"},
        "sweep": {"contact.friction_coefficient": list(FRICTIONS)},
    }


def finger_values(**changes: Any) -> dict[str, Any]:
    """Return a study of a fingertip that is pressed on a plate, with other values at the top."""
    return {
        "fingertip": {"preset": "wang2014-2d"},
        "contact": {"friction_coefficient": 0.6},
        "programme": [{"press": {"depth": "1.5 mm", "speed": "1.5 mm/s"}}],
        "time": {"step": "5 ms"},
    } | changes


def changed(path: str, value: object, values: dict[str, Any] | None = None) -> dict[str, Any]:
    """Return the study, or another, with the value at a dotted path changed."""
    values = values or block_values()
    *groups, leaf = path.split(".")
    inner = values
    for group in groups:
        inner = inner[group]
    inner[leaf] = value
    return values


def block_mesh(curvature: float = 0.0) -> skfem.MeshQuad:
    """Return a block of 10 mm by 5 mm whose bottom rises by `curvature` x^2 to both sides."""
    mesh = skfem.MeshQuad.init_tensor(np.linspace(-5e-3, 5e-3, 9), np.linspace(0.0, 5e-3, 5))
    points = mesh.p.copy()
    points[1] += curvature * points[0] ** 2 * (1.0 - points[1] / 5e-3)
    bottom, top = (mesh.facets_satisfying(lambda x, y=y: np.isclose(x[1], y), True) for y in (0.0, 5e-3))
    mesh = skfem.MeshQuad(points, mesh.t)
    return mesh.with_boundaries({"bottom": bottom, "top": top}).with_subdomains({"block": np.arange(mesh.t.shape[1])})


def run_block(path: Path, **options: Any) -> StudyResult:
    """Run a study by one worker into the folder `results` beside it."""
    return run_study(path, results_dir=path.parent / "results", workers=1, **options)


class Told(StudyProgress):
    """Keeps what it is told, in order; a message is a tuple of one text."""

    def __init__(self) -> None:
        self.told: list[tuple[Any, ...]] = []

    def begin(self, names: Sequence[str]) -> None:
        self.told.append(("begin", *names))

    def advance(self, name: str, fraction: float) -> None:
        self.told.append((name, fraction))

    def finish(self, name: str, outcome: str) -> None:
        self.told.append((name, outcome))

    def say(self, message: str) -> None:
        self.told.append((message,))

    @property
    def messages(self) -> list[str]:
        return [entry[0] for entry in self.told if len(entry) == 1]
