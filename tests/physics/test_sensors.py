"""Sensors in 3D: slides of whole ones in another direction beside those of halves, and one of 127 markers, pressed."""

import dataclasses

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.contact.friction import StaticKinetic
from fingerslip.mesh.quality import quality_limits, quality_table
from fingerslip.specimens.tactip.numbers import modelled_places
from fingerslip.specimens.tactip.tactip import PRESETS, SensorSolidSizes
from fingerslip.study.definition.runs import read_runs
from fingerslip.study.running.build import build_mesh, build_model
from fingerslip.study.trials.bodies import turned_whole
from places import STUDIES
from problems.sensors import slid_beside_half, slid_sensor

TURN = np.pi / 4
CHANGES = {
    "dome": {"radius": "10 mm", "height": "8 mm"},
    "rods": {"radius": "0.6 mm", "length": "1.5 mm"},
    "markers": {"rings": [1, 8], "spacing": "3 mm"},
}
SENSOR = PRESETS.changed({"preset": "tactip-smooth-3d", **CHANGES})


def slid(part: str, direction: tuple[float, ...]):
    """Return where the internal markers of a part are over time, shape (n_times, n_markers, 3) [m], and the forces."""
    sensor = dataclasses.replace(SENSOR, part=part)
    mesh = dataclasses.replace(sensor.default_mesh, contact_size=0.9e-3, contact_reach=2e-3).build(sensor)
    friction = StaticKinetic(static=0.85, kinetic=0.6, decay_speed=1e-3)
    programme = (fs.Press(2e-3, 5e-3), fs.Slide(1.5e-3, 0.3e-3, direction=direction))
    sites, found = slid_sensor(sensor, mesh, friction, programme, step=0.2, reach=3e-3, hidden=1e-3, patch=0.7e-3)
    return np.array([site.position for site in sites]) + found.displacement, found.force


@pytest.mark.slow
def test_a_whole_dome_slid_at_45_degrees_moves_as_its_half_turned():
    half, whole = (dataclasses.replace(SENSOR, part=part) for part in ("half", "whole"))
    own, force = slid("whole", (1.0, 0.0, 1.0))
    straight, of_half = slid("half", (1.0, 0.0, 0.0))
    turned = turned_whole(straight, modelled_places(half), whole.markers.places, TURN)
    size = np.linalg.norm(turned - turned[0], axis=2).max()
    error = np.linalg.norm((own - own[0]) - (turned - turned[0]), axis=2).max()
    assert error < 0.02 * size
    assert force[:, 1] == pytest.approx(2.0 * of_half[:, 1], rel=0.02, abs=1e-9)


@pytest.mark.slow
def test_the_ridged_section_slides_whole_at_large_strain_at_the_largest_depth_and_no_cell_turns_inside_out():
    """The gel at the rods' inner ends gives way there, and tangents are not definite."""
    run = read_runs(STUDIES / "ridged_vs_smooth_large.yaml").runs[3]
    assert run.name == "ridges-true_depth-5mm"
    run = dataclasses.replace(
        run, study=dataclasses.replace(run.study, time=dataclasses.replace(run.study.time, step=0.2))
    )
    model = build_model(run, build_mesh(run))
    history = fs.simulate(dataclasses.replace(model, record=dataclasses.replace(model.record, snapshots_every=1.0)))
    assert history["time"].values[-1] == pytest.approx(49.83, abs=0.2)
    corners = (history["snapshot_displacement"] + history["node_position"]).values[:, history["cell_nodes"].values]
    sides = corners[:, :, 1:] - corners[:, :, :1]
    assert (np.linalg.det(sides) * np.sign(np.linalg.det(sides[:1])) > 0.0).all()


@pytest.mark.slow
def test_a_whole_ridged_sensor_moves_as_its_half_to_rounding_and_turned_as_the_mesh_allows():
    ridges, markers = {"number": 1, "height": "2 mm"}, {"rings": [1, 8], "spacing": "3.3 mm"}
    changes = {**CHANGES, "markers": markers, "skin": {"ridges": ridges}}
    sensor = dataclasses.replace(PRESETS.changed({"preset": "tactip-ridged-3d", **changes}), part="whole")
    sizes = {"contact_size": 1.2e-3, "contact_reach": 2.5e-3, "rod_size": 0.6e-3}
    mesh = dataclasses.replace(sensor.default_mesh, **sizes).build(sensor)
    straight, aside, _, _ = slid_beside_half(sensor, mesh, fs.Coulomb(0.85), depth=1.5e-3, travel=1e-3, part=0.25e-3)
    assert max(straight.markers, straight.forces) < 1e-8
    # The mesh does not look the same after the turn.
    assert aside.markers < 0.05
    assert aside.forces < 0.02


DEPTH = 1e-3


@pytest.mark.slow
def test_half_of_a_hexagonal_sensor_can_be_pressed():
    """For 331 markers cutting the rods out of skin and gel alone takes longer than a test may."""
    layers = 6
    changes = {
        "preset": "tactip-smooth-3d",
        "dome": {"height": "10 mm"},
        "rods": {"radius": "0.4 mm", "length": "2 mm"},
        "markers": {"layout": "hexagonal", "layers": layers, "spacing": "2.2 mm"},
    }
    sensor = PRESETS.changed(changes)
    places = modelled_places(sensor)
    assert 2 * len(places.ring) - places.on_x.sum() == 127
    mesh = SensorSolidSizes(1.2e-3, 4e-3, 5e-3, 0.5e-3).build(sensor)
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
