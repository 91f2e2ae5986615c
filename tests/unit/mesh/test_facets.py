"""Facets between regions, and where facets face."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.mesh.facets import facets_between, outward_normals
from fingerslip.verification.meshes import box

REGIONS = {"low": lambda c: c[-1] < 0.5, "high": lambda c: c[-1] > 0.5}
AXES = {"Q4": 2, "T3": 2, "T6": 2, "T4": 3}


def cube(element):
    mesh = box(element, *[np.linspace(0.0, 1.0, 5)] * AXES[element], regions=REGIONS)
    region = np.zeros(mesh.nelements, dtype=int)
    region[mesh.subdomains["high"]] = 1
    return mesh, region


@pytest.mark.parametrize("element", AXES)
def test_facets_between_two_regions_are_those_of_the_interface(element):
    mesh, region = cube(element)
    found = facets_between(mesh, region, 0, 1)
    np.testing.assert_array_equal(found, facets_between(mesh, region, 1, 0))
    on_interface = np.isclose(mesh.p[-1, mesh.facets], 0.5).all(axis=0)
    np.testing.assert_array_equal(found, np.flatnonzero(on_interface))
    assert facets_between(mesh, region, 1, 2).size == 0


@pytest.mark.parametrize("element", AXES)
def test_normals_face_away_from_the_cell_behind(element):
    mesh, region = cube(element)
    facets = facets_between(mesh, region, 0, 1)
    first, second = mesh.f2t[:, facets]
    below = np.where(region[first] == 0, first, second)
    upwards = outward_normals(mesh, facets, below)
    np.testing.assert_allclose(upwards[-1], 1.0)
    np.testing.assert_allclose(outward_normals(mesh, facets, first + second - below), -upwards)


def test_normals_of_the_outside_close():
    """The integral of the outward normal over a closed surface is zero."""
    mesh, _ = cube("T4")
    outside = mesh.boundary_facets()
    normals = outward_normals(mesh, outside, mesh.f2t[0, outside])
    np.testing.assert_allclose(np.linalg.norm(normals, axis=0), 1.0)
    np.testing.assert_allclose(normals.sum(axis=1), 0.0, atol=1e-12)
    assert np.sum(normals * mesh.p[:, mesh.facets[:, outside]].mean(axis=1)) > 0.0
