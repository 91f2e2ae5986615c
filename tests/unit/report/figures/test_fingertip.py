"""The picture of a fingertip: both sections, and the finger in 3D where it has one."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.report.figures.specimens import fingertip_figure
from unit.fingers import change, change_solid
from unit.report.figures.made import words


def test_sections_and_the_finger_in_space_are_drawn():
    figure = fingertip_figure(change_solid(), "mine")
    sagittal, transverse, solid = figure.axes[:3]
    assert {"x [mm]", "z [mm]", "epidermis", "phalanx"} <= words(figure)
    tip = max(path.vertices[:, 0].max() for path in sagittal.collections[0].get_paths())
    side = max(path.vertices[:, 0].max() for path in transverse.collections[0].get_paths())
    assert (tip, side) == (pytest.approx(8.0, abs=1e-3), pytest.approx(8.0, abs=1e-3))
    assert solid.name == "3d"
    assert len(solid.collections) == 2


def test_section_alone_has_no_third_panel():
    figure = fingertip_figure(change(fingerprint={"enabled": True}))
    assert all(axes.name != "3d" for axes in figure.axes)
    ring = figure.axes[0].collections[0].get_paths()[0].vertices
    assert ring[:, 1].min() == pytest.approx(-7.05, abs=0.01)
    assert np.isfinite(ring).all()
