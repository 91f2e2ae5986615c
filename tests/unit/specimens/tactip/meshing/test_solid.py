"""The mesh of a TacTip in 3D."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fingerslip.mesh.site_nodes import site_nodes
from fingerslip.specimens.tactip.meshing.solid import mesh_sensor_solid
from fingerslip.specimens.tactip.meshing.source import SensorSolidSizes
from fingerslip.specimens.tactip.tactip import PRESETS


@pytest.fixture(scope="module")
def small():
    changes = {"markers": {"rings": [1, 4]}, "dome": {"radius": "10 mm", "height": "8 mm"}}
    return PRESETS.changed({"preset": "tactip-smooth-3d", **changes})


@pytest.fixture(scope="module")
def mesh(small):
    return mesh_sensor_solid(small, SensorSolidSizes(1e-3, 2e-3), "T4")


def test_half_of_a_dome(small, mesh):
    assert set(mesh.boundaries) == {"contact", "window_face", "symmetry"}
    assert mesh.p[2].min() == 0.0
    corners = mesh.p[:, mesh.t].transpose(2, 1, 0)
    volume = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0
    below = volume[np.concatenate([mesh.subdomains[name] for name in ("skin", "gel", "rods")])].sum()
    cap = np.pi * 8e-3**2 * (10e-3 - 8e-3 / 3) / 2
    assert below == pytest.approx(cap, rel=0.02)
    rods = volume[mesh.subdomains["rods"]].sum()
    # One on the axis and two in 2D are halves, one is whole.
    assert rods == pytest.approx(2.5 * np.pi * 0.5e-3**2 * 2.5e-3, rel=0.01)


def test_markers_are_nodes(small, mesh):
    sites = small.sites(("internal_markers", "external_markers"), 3)
    places = mesh.p[:, site_nodes(mesh, sites)].T
    assert places == pytest.approx(np.array([site.position for site in sites]), abs=1e-9)


@pytest.mark.slow
def test_the_whole_is_its_half_and_the_mirror_image_of_it(small, mesh):
    sensor = dataclasses.replace(small, part="whole")
    whole = mesh_sensor_solid(sensor, SensorSolidSizes(1e-3, 2e-3), "T4")
    assert set(whole.boundaries) == {"contact", "window_face"}
    assert whole.nelements == 2 * mesh.nelements
    assert whole.p.shape[1] == 2 * mesh.p.shape[1] - np.count_nonzero(mesh.p[2] == 0.0)
    corners = whole.p[:, whole.t].transpose(2, 1, 0)
    volume = np.linalg.det(corners[:, 1:] - corners[:, :1])
    assert (volume > 0.0).all() or (volume < 0.0).all()
    sites = sensor.sites(("internal_markers", "external_markers"), 3)
    places = whole.p[:, site_nodes(whole, sites)].T
    assert places == pytest.approx(np.array([site.position for site in sites]), abs=1e-9)
