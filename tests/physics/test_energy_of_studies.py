"""Energy is conserved in every shipped study, term by term.

Work of the plate = kinetic, strain and penalty energy, friction, material damping, and the dissipation of the time
integration and of the contact law's implicit step, which are closed forms. What is left over must be rounding: 1e-6 of
the largest external work.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fingerslip.dynamics.simulate import simulate
from fingerslip.study.build import build_mesh, build_model, mesh_key
from fingerslip.study.spec import parse_study, read_study
from fingerslip.study.sweep import expand
from fingerslip.study.yaml import read_mapping

STUDIES = sorted((Path(__file__).parents[2] / "studies").glob("*.yaml"))
ALL_RUNS = [
    pytest.param(path, name, id=f"{path.stem}-{name}")
    for path in STUDIES
    for name in (run.name for run in expand(read_study(path), path))
]
ALLOWED = 1e-6
_meshes = {}


def mesh_of(run):
    key = mesh_key(run)
    if key not in _meshes:
        _meshes[key] = build_mesh(run)
    return _meshes[key]


def coarse(path):
    """Return the study's run as it is without its sweep, with large cells, long steps and no ripples."""
    mapping = read_mapping(path)
    mapping.pop("sweep", None)
    mesh = mapping.get("mesh", {})
    mesh |= {key: value for key, value in {"contact_size": "0.5 mm", "bulk_size": "1 mm"}.items() if key in mesh}
    if "fingertip" in mapping:
        mapping["fingertip"] |= {"ridges": {"enabled": False}, "fingerprint": {"enabled": False}}
        mapping["time"]["step"] = "20 ms"
    return expand(parse_study(mapping, path), path)[0]


def imbalance(run):
    """Return what is left over in the balance over the largest work that was done, and the history."""
    history = simulate(build_model(run, mesh_of(run)))
    work = np.abs(history["external_work"].values).max()
    return float(np.abs(history["energy_imbalance"].values).max() / work), history


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_energy_closes_on_a_coarse_version(path):
    left_over, history = imbalance(coarse(path))
    assert left_over <= ALLOWED, f"{left_over:.1e} of the external work is missing"
    work, friction = float(history["external_work"][-1]), float(history["friction_dissipation"][-1])
    assert 0.0 < friction < work, "the run slides, and friction takes no more than the plate gives"


@pytest.mark.slow
@pytest.mark.parametrize(("path", "name"), ALL_RUNS)
def test_energy_closes_on_every_run(path, name):
    run = next(run for run in expand(read_study(path), path) if run.name == name)
    left_over, _ = imbalance(run)
    assert left_over <= ALLOWED, f"{left_over:.1e} of the external work is missing"
