"""Runs side by side give the same results as one after another."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from fingerslip.history import read_history
from fingerslip.study.running import runner
from fingerslip.study.running.runner import run_study
from unit.study.block import FRICTIONS, block_values

Write = Callable[..., Path]
NAMES = [f"friction_coefficient-{friction}" for friction in FRICTIONS]


@pytest.mark.slow
def test_runs_side_by_side_give_the_same_as_one_after_another(write_study: Write, reports: list[Any]) -> None:
    values = block_values() | {"record": {"snapshots_every": "20 ms"}}
    path = write_study(values)
    apart = run_study(path, results_dir=path.parent / "apart", workers=2)
    here = run_study(path, results_dir=path.parent / "here", workers=1)
    # The number of threads changes the order of sums, so the last digits differ.
    assert apart.runs[0].events.incipient == pytest.approx(here.runs[0].events.incipient, rel=1e-8)
    first, second = (read_history(result.folder / NAMES[2] / "history.nc") for result in (apart, here))
    np.testing.assert_allclose(first["counterface_force"], second["counterface_force"], rtol=1e-9, atol=1e-15)
    assert (apart.folder / NAMES[0] / "log.txt").stat().st_size > 0
    grid = meshio.read(apart.folder / NAMES[0] / "snapshot_0001.vtu")
    assert grid.points.shape == (45, 3)
    # The plate has pressed the bottom upwards by its whole way, less some per cent of penetration.
    assert grid.point_data["displacement"][:, 1].max() == pytest.approx(0.1e-3, rel=0.05)


@pytest.mark.slow
def test_workers_draw_what_they_have_computed(write_study: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[Any] = []
    monkeypatch.setattr(runner, "write_report", lambda _, pictures: given.append(pictures))
    path = write_study(block_values())
    run_study(path, results_dir=path.parent / "results", workers=2)
    (pictures,) = given
    assert sorted(pictures) == NAMES
    assert [drawn.name for drawn in pictures[NAMES[0]].model] == [f"section-{NAMES[0]}"]
    assert pictures[NAMES[1]].model is None
    assert all(drawn.png.startswith(b"\x89PNG") for own in pictures.values() for drawn in own.contact)
