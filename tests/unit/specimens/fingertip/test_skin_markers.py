"""Dots on the skin: on its surface, a lattice from below, found on the skin of the mesh."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.mesh.site_nodes import site_nodes
from fingerslip.specimens.fingertip import depth_below_skin
from fingerslip.specimens.fingertip.sites import skin_markers
from unit.fingers import change, change_solid, coarse_solid

FINGER = change_solid()


def test_dots_lie_on_the_skin_and_form_a_lattice_from_below():
    sites = skin_markers(FINGER)
    at = np.array([site.position for site in sites])
    assert len(sites) == 61
    assert sites[0].name == "external-marker-0-01"
    assert at[0] == pytest.approx([0.0, -FINGER.sagittal.half_height, 0.0], abs=1e-12)
    assert depth_below_skin(FINGER, at) == pytest.approx(np.zeros(61), abs=1e-5)
    apart = np.linalg.norm(at[:, None, [0, 2]] - at[None][:, :, [0, 2]], axis=2) + np.eye(61)
    assert apart.min(axis=1) == pytest.approx(np.full(61, 1.5e-3))


def test_dots_are_nodes_of_the_skin():
    mesh = coarse_solid()
    nodes = site_nodes(mesh, skin_markers(FINGER, 3e-3, 1))
    assert set(nodes) <= set(mesh.facets[:, mesh.boundaries["skin"]].ravel())


def test_sections_have_no_dots():
    with pytest.raises(InputError, match=r"fingertip.solid: is missing"):
        skin_markers(change())
