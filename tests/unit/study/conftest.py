"""A small study that reads a block as its mesh, and a simulation that needs no solving."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import skfem
import xarray as xr
import yaml

from fingerslip.mesh.io import write_mesh
from fingerslip.model import Model
from fingerslip.study import compute, runner

sys.path.insert(0, str(Path(__file__).parents[1]))
import synthetic

FRICTIONS = [0.2, 0.4, 0.6]


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


def block_mesh(curvature: float = 0.0) -> skfem.MeshQuad:
    """Return a block of 10 mm by 5 mm whose bottom rises by `curvature` x^2 to both sides."""
    mesh = skfem.MeshQuad.init_tensor(np.linspace(-5e-3, 5e-3, 9), np.linspace(0.0, 5e-3, 5))
    points = mesh.p.copy()
    points[1] += curvature * points[0] ** 2 * (1.0 - points[1] / 5e-3)
    bottom, top = (mesh.facets_satisfying(lambda x, y=y: np.isclose(x[1], y), True) for y in (0.0, 5e-3))
    mesh = skfem.MeshQuad(points, mesh.t)
    return mesh.with_boundaries({"bottom": bottom, "top": top}).with_subdomains({"block": np.arange(mesh.t.shape[1])})


@pytest.fixture
def write_study(tmp_path: Path) -> Callable[..., Path]:
    """Return a function that writes a study beside its mesh and returns the study's path."""

    def write(values: dict[str, Any] | None = None, *, curvature: float = 0.0, name: str = "block") -> Path:
        write_mesh(block_mesh(curvature), tmp_path / "block.msh")
        path = tmp_path / f"{name}.yaml"
        path.write_text(yaml.safe_dump(values or block_values(), sort_keys=False))
        return path

    return write


@pytest.fixture
def simulated(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Replace the simulation by a known history; the list holds the friction coefficients it was called with."""
    calls: list[float] = []

    def fake(model: Model, *, progress: Callable[[float], None]) -> xr.Dataset:
        friction = model.contacts[0].friction.coefficient
        calls.append(friction)
        progress(0.5)
        return synthetic.make(synthetic.Process(friction=friction, centre=1.4 + 0.5 * friction))

    monkeypatch.setattr(compute, "simulate", fake)
    return calls


@pytest.fixture
def reports(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, ...]]:
    """Replace the report by a stub; the list holds the runs that each report was made of."""
    made: list[tuple[str, ...]] = []

    def fake(stored: Any) -> None:
        made.append(tuple(run.label for run in stored.runs))
        (stored.folder / "report.html").write_text("report")

    monkeypatch.setattr(runner, "write_report", fake)
    return made
