"""A sensor with 127 markers in a hexagonal lattice: its half in 3D, pressed in a few quasi-static steps."""

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.mesh.quality import quality_limits, quality_table
from fingerslip.specimens.tactip.numbers import modelled_places
from fingerslip.specimens.tactip.tactip import PRESETS, SensorSolidSizes
from problems.sensors import slid_sensor

DEPTH = 1e-3
# Layers, their distance and the radius and length of rods that leave room between them; the size at rods [m].
# For 331 markers cutting the rods out of skin and gel alone takes longer than a test may.
CASES = {127: (6, "2.2 mm", "0.4 mm", "2 mm", 0.5e-3)}


@pytest.mark.slow
@pytest.mark.parametrize("count", CASES)
def test_half_of_a_hexagonal_sensor_can_be_pressed(count: int) -> None:
    layers, spacing, radius, length, size = CASES[count]
    changes = {
        "preset": "tactip-smooth-3d",
        "dome": {"height": "10 mm"},
        "rods": {"radius": radius, "length": length},
        "markers": {"layout": "hexagonal", "layers": layers, "spacing": spacing},
    }
    sensor = PRESETS.changed(changes)
    places = modelled_places(sensor)
    assert 2 * len(places.ring) - places.on_x.sum() == count
    mesh = SensorSolidSizes(1.2e-3, 4e-3, 5e-3, size).build(sensor)
    limits = quality_limits(mesh)
    assert all(row.scaled_jacobian > limits.scaled_jacobian for row in quality_table(mesh))
    assert all(row.aspect_ratio < limits.aspect_ratio for row in quality_table(mesh))
    press, reach = (fs.Press(DEPTH, 5e-3),), 1.5 * DEPTH
    _, pressed = slid_sensor(sensor, mesh, fs.Coulomb(0.85), press, step=0.05, reach=reach, hidden=DEPTH, patch=1e-3)
    up = pressed.displacement[-1, :, 1]
    # The middle goes up with the plate, or a little ahead where the skin dimples; the rim hardly moves.
    assert up[0] == pytest.approx(DEPTH, rel=0.05)
    assert up[places.ring == layers].max() < 0.3 * up[0]
    along = np.where(places.on_x, places.position[:, 0], 0.0)
    ends = [np.flatnonzero(sign * along > 0.95 * along.max()) for sign in (1, -1)]
    assert up[ends[0]] == pytest.approx(up[ends[1]], abs=0.02 * DEPTH)
    assert (np.diff(pressed.force[:, 1]) > 0.0).all()
