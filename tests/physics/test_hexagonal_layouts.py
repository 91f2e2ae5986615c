"""A sensor with 127 markers in a hexagonal lattice: its half in space, pressed in a few quasi-static steps."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.statics.body import static_body
from fingerslip.dynamics.statics.march import march_static
from fingerslip.mesh.quality import quality_limits, quality_table
from fingerslip.specimens.tactip import PRESETS
from fingerslip.specimens.tactip.meshing.source import SensorSolidSizes
from fingerslip.specimens.tactip.sites import modelled_places

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
    assert 2 * len(places.ring) - places.on_plane(sensor.markers.spacing).sum() == count
    mesh = SensorSolidSizes(1.2e-3, 4e-3, 5e-3, size).build(sensor)
    limits = quality_limits(mesh)
    assert all(row.scaled_jacobian > limits.scaled_jacobian for row in quality_table(mesh))
    assert all(row.aspect_ratio < limits.aspect_ratio for row in quality_table(mesh))
    contact = fs.Contact(
        "contact",
        fs.Plane((0.0, 1.0, 0.0)),
        fs.Coulomb(0.85),
        normal_penalty=5e9,
        tangential_penalty=5e9,
        search_distance=1.5 * DEPTH,
    )
    model = fs.Model(
        mesh=mesh,
        materials=sensor.materials,
        formulation="solid",
        depth=1.0,
        supports=sensor.supports(3),
        integration="nodal",
        contacts=(contact,),
        time=fs.QuasiStatic(0.05),
        record=fs.Recording(sites=sensor.sites(("internal_markers",), 3)),
        programme=(fs.Press(DEPTH, 5e-3),),
    )
    body = static_body(model, reach=1.5 * DEPTH, hidden=DEPTH, patch=1e-3)
    pressed = march_static(body, contact, model.programme, 0.05)
    up = pressed.displacement[-1, :, 1]
    # The middle goes up with the plate, or a little ahead where the skin dimples; the rim hardly moves.
    assert up[0] == pytest.approx(DEPTH, rel=0.05)
    assert up[places.ring == layers].max() < 0.3 * up[0]
    along = np.where(places.on_plane(sensor.markers.spacing), places.along * np.cos(places.azimuth), 0.0)
    ends = [np.flatnonzero(sign * along > 0.95 * along.max()) for sign in (1, -1)]
    assert up[ends[0]] == pytest.approx(up[ends[1]], abs=0.02 * DEPTH)
    assert (np.diff(pressed.force[:, 1]) > 0.0).all()
