"""A finger in 3D pressed on a plate and slid: balance of forces, symmetry, and slip from the edge inwards."""

import numpy as np
import pytest

import fingerslip as fs
from unit.fingers import change_solid, coarse_solid

MU = 0.6


@pytest.mark.slow
def test_finger_in_3d_slips_after_it_has_stuck_and_ends_at_coulomb():
    """The force is in the middle plane; skin moves less than the plate, and tissue less than the skin."""
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
    history = fs.simulate(model)
    slip, force = fs.find_events(history).slip, history["counterface_force"].values[:, 0]
    assert slip.overall is not None
    assert 0.375 <= slip.incipient < slip.three_quarter < slip.overall < 1.375
    assert np.abs(force[:, 2]).max() < 0.05 * np.abs(force[:, 1]).max()
    assert np.abs(force[-1, 0] / force[-1, 1]) == pytest.approx(MU, rel=1e-3)
    names, end = list(history["site"].values), history["displacement"].values[-1, :, 0]
    skin, tissue = (np.array([end[names.index(f"{layer}-h{k}")] for k in (3, 4)]) for layer in ("skin", "tissue"))
    assert np.all(tissue > 0.0)
    assert np.all(tissue < skin)
    assert np.all(skin < 5e-3)
