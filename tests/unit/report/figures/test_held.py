"""Runs in which nothing slides: force, and motion of free bodies."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.report.figures.contact import held_figure
from fingerslip.report.figures.marks import is_held
from unit.report.figures.made import HISTORY, panels

HELD = HISTORY.assign(phase_kind=("phase", ["press", "hold"]))


def test_a_run_with_a_slide_is_not_held() -> None:
    assert not is_held(HISTORY)
    assert is_held(HELD)


def test_force_has_a_line_for_each_run() -> None:
    (forces,) = panels(held_figure({"one": HELD, "other": HELD}))
    assert [line.get_label() for line in forces.lines] == ["one", "other"]
    assert forces.get_ylabel() == "normal force [mN]"
    assert max(forces.lines[0].get_ydata()) == pytest.approx(400.0)


def test_bodies_that_are_free_have_a_panel_for_how_far_they_move() -> None:
    times = HELD.sizes["time"]
    moved = np.zeros((times, 1, 2))
    moved[:, 0, 1] = np.linspace(0.0, 3e-4, times)
    free = HELD.drop_dims("rigid_body", errors="ignore").assign_coords(rigid_body=["plate"])
    free = free.assign(rigid_body_displacement=(("time", "rigid_body", "component"), moved))
    _, motion = panels(held_figure({"run": free}))
    assert motion.get_ylabel() == "displacement of the body [mm]"
    assert max(motion.lines[0].get_ydata()) == pytest.approx(0.3)
