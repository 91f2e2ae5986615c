"""A finger in 3D pressed on a plate and slid: balance of forces, symmetry, and slip from the edge inwards."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from unit.fingers import change_solid, coarse_solid

MU = 0.6


@pytest.fixture(scope="module")
def history():
    finger = change_solid()
    model = fs.Model(
        mesh=coarse_solid(),
        materials=finger.materials,
        formulation="solid",
        supports={"phalanx_dorsal": ("x", "y", "z")},
        contacts=(fs.Contact("skin", fs.Plane(normal=(0, 1, 0)), fs.Coulomb(MU)),),
        programme=(fs.Press(depth=1.5e-3, speed=4e-3), fs.Slide(distance=5e-3, speed=5e-3)),
        time=fs.TimeStepping(step=12.5e-3, alpha=-0.41421),
        integration="nodal",
        record=fs.Recording(sites=fs.reference_sites(finger)),
    )
    return fs.simulate(model)


@pytest.mark.slow
def test_finger_in_space_slips_after_it_has_stuck(history):
    events = fs.find_events(history)
    assert events.slip.overall is not None
    assert 0.375 <= events.slip.incipient < events.slip.three_quarter < events.slip.overall < 1.375


@pytest.mark.slow
def test_plate_force_is_in_the_middle_plane_and_ends_at_coulomb(history):
    force = history["counterface_force"].values[:, 0]
    assert np.abs(force[:, 2]).max() < 0.05 * np.abs(force[:, 1]).max()
    assert np.abs(force[-1, 0] / force[-1, 1]) == pytest.approx(MU, rel=1e-3)


@pytest.mark.slow
def test_skin_moves_less_than_the_plate_and_the_tissue_less_than_the_skin(history):
    names = list(history["site"].values)
    end = history["displacement"].values[-1, :, 0]
    skin, tissue = (np.array([end[names.index(f"{layer}-h{k}")] for k in (3, 4)]) for layer in ("skin", "tissue"))
    assert np.all(tissue > 0.0)
    assert np.all(tissue < skin)
    assert np.all(skin < 5e-3)
