"""Runs that are computed together give what they give apart."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fingerslip.dynamics.step import sharing
from fingerslip.history import read_history
from fingerslip.study.running.runner import run_study
from unit.study.block import FRICTIONS, block_values

Write = Callable[..., Path]


@pytest.mark.slow
@pytest.mark.usefixtures("reports")
def test_a_study_gives_the_same_together(write_study: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_study(block_values())
    apart = run_study(path, results_dir=path.parent / "apart", workers=1)
    monkeypatch.setattr(sharing, "_WORTH_SHARING", {2: 0, 3: 0})
    joint = run_study(path, results_dir=path.parent / "joint", workers=1)
    for friction in FRICTIONS:
        name = f"friction_coefficient-{friction}"
        one, other = (read_history(result.folder / name / "history.nc") for result in (apart, joint))
        assert (one.attrs["n_simulated_together"], other.attrs["n_simulated_together"]) == (1, len(FRICTIONS))
        np.testing.assert_allclose(other["counterface_force"], one["counterface_force"], rtol=1e-8, atol=1e-14)
        log = (joint.folder / name / "log.txt").read_text(encoding="utf-8")
        assert one.attrs["linear_solver"] in log
        assert "one substitution a step" in log
    assert joint.computed == apart.computed
