"""Contact penalties: as given, or ten times the stiffness of the outermost row of cells."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.system.system import build_system
from fingerslip.verification.meshes import box
from problems.pushed import push_and_slide


def contact(**changes):
    return (fs.Contact(**({"boundary": "bottom", "friction": fs.Coulomb(0.4)} | changes)),)


@pytest.mark.parametrize("element", ["Q4", "T6"])
def test_automatic_penalties_follow_layer_and_facets(element):
    grid = np.linspace(0.0, 1e-3, 5)
    layers = {"skin": lambda c: c[1] < 0.5e-3, "core": lambda c: c[1] > 0.5e-3}
    mesh = box(element, grid, grid, regions=layers)
    materials = {"skin": fs.Elastic(2e5, 0.4, 1000.0), "core": fs.Elastic(1e6, 0.4, 1000.0)}
    candidates = build_system(push_and_slide(mesh=mesh, materials=materials)).candidates
    np.testing.assert_allclose(candidates.normal_stiffness / candidates.area, 10 * 2e5 / 0.25e-3)
    np.testing.assert_allclose(candidates.tangential_stiffness / candidates.area, 10 * 2e5 / 0.25e-3)


def test_groups_of_cells_without_a_material_change_nothing():
    plain = push_and_slide(record=fs.Recording(snapshots_every=0.1))
    probe = plain.mesh.elements_satisfying(lambda x: x[1] < 1.5e-3)
    assert len(probe), "they lie at the contact"
    grouped = plain.mesh.with_subdomains({**plain.mesh.subdomains, "probe": probe})
    histories = [fs.simulate(replace(plain, mesh=mesh)) for mesh in (plain.mesh, grouped)]
    for name in ("counterface_force", "cell_region", "snapshot_von_mises"):
        np.testing.assert_array_equal(histories[0][name].values, histories[1][name].values, err_msg=name)


def test_given_penalties_are_taken():
    made = build_system(push_and_slide(contacts=contact(normal_penalty=1e7, tangential_penalty=2e6))).candidates
    np.testing.assert_allclose(made.normal_stiffness / made.area, 1e7)
    np.testing.assert_allclose(made.tangential_stiffness / made.area, 2e6)


def test_automatic_penalties_are_those_of_the_stiffest_layer_and_of_a_middling_facet():
    """Two materials side by side under the boundary, and facets of three sizes."""
    xs, ys = [0.0, 1e-3, 1.5e-3, 2e-3, 2.5e-3, 4.5e-3], np.linspace(0.0, 1e-3, 3)
    halves = {"soft": lambda c: c[0] < 1.5e-3, "stiff": lambda c: c[0] > 1.5e-3}
    mesh = box("Q4", xs, ys, regions=halves)
    materials = {"soft": fs.Elastic(1e5, 0.4, 1000.0), "stiff": fs.Elastic(3e5, 0.4, 1000.0)}
    candidates = build_system(push_and_slide(mesh=mesh, materials=materials)).candidates
    np.testing.assert_allclose(candidates.normal_stiffness / candidates.area, 10 * 3e5 / 0.5e-3)
