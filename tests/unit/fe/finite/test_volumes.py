"""Groups of mean volumes: the cells of quadrilaterals and hexahedra, the nodes of linear triangles and tetrahedra."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.fe.finite.volumes import selective_energy
from fingerslip.materials.neo_hookean import NeoHookean
from unit.fe.finite.bodies import EVERY, LAWS, SOFT, STIFF, body, moved


@EVERY
def test_groups_share_out_the_body_and_average(element, integration, formulation):
    bulk = body(element, integration, formulation, law=STIFF, beside=SOFT, depth=0.5)
    if integration == "full":
        assert bulk.volumes is None
        return
    volumes = bulk.volumes
    np.testing.assert_allclose(volumes.mean @ np.ones(bulk.weights.size), 1.0)
    np.testing.assert_allclose(volumes.mean.T @ volumes.size, bulk.weights.ravel())
    assert volumes.size.sum() == pytest.approx(bulk.weights.sum())


def test_nothing_is_integrated_from_mean_volumes_without_lateral_contraction():
    found = selective_energy(NeoHookean(50e3, 0.0, 1000.0), "plane_strain", np.array([-0.1, 0.0, 0.1]))
    np.testing.assert_array_equal(found, np.zeros((3, 3)))
    bulk = body("Q4", law=NeoHookean(50e3, 0.0, 1000.0))
    assert np.isfinite(bulk.deformed(moved(bulk, 0.05)).mean_volume).all()


def test_the_groups_of_quadrilaterals_are_their_cells():
    """The mean of the ratios of areas is the ratio of the areas of the cell."""
    bulk = body("Q4")
    at = moved(bulk, 0.05)
    corners = (bulk.space.positions + at.reshape(-1, 2))[bulk.nodes]
    before = bulk.space.positions[bulk.nodes]
    np.testing.assert_allclose(bulk.deformed(at).mean_volume, area(corners) / area(before))


def area(corners):
    x, y = np.moveaxis(corners, -1, 0)
    return 0.5 * np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1)


def test_nodes_between_materials_have_a_group_for_each():
    one, two = body("T3", "nodal"), body("T3", "nodal", law=STIFF, beside=SOFT)
    nodes = len(one.space.positions)
    between = np.intersect1d(*(two.nodes[two.materials.number == number] for number in (0, 1))).size
    assert one.volumes.size.size == nodes + between  # two regions of one law are still two materials
    assert np.bincount(two.volumes.material).sum() == nodes + between


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
@pytest.mark.parametrize("formulation", ["plane_strain", "plane_stress", "solid"])
def test_selective_energy_has_its_derivatives_and_at_rest_the_modulus_of_small_strain(law, formulation):
    at, step = np.linspace(-0.3, 0.4, 8), 1e-6
    first, second = (selective_energy(law, formulation, at)[number] for number in (1, 2))
    ahead, back = (selective_energy(law, formulation, at + sign * step) for sign in (1, -1))
    np.testing.assert_allclose((ahead[0] - back[0]) / (2 * step), first, atol=1e-7)
    np.testing.assert_allclose((ahead[1] - back[1]) / (2 * step), second, rtol=1e-7)
    rest = selective_energy(law, formulation, np.zeros(1))
    assert [float(part[0]) for part in rest] == [
        0.0,
        0.0,
        pytest.approx(law.at_rest().dilatational_modulus(formulation)),
    ]


def test_selective_integration_does_not_lock():
    """The force that bends a nearly incompressible block does not grow with the bulk modulus."""
    forces = []
    for ratio in (0.49, 0.49999):
        bulk = body("Q4", law=NeoHookean(3.0, ratio, 1.0))
        x, y = bulk.space.positions.T
        bent = 0.05 * np.column_stack([(x - 0.5) * (y - 0.5), -0.5 * (x - 0.5) ** 2 - 0.5 * (y - 0.5) ** 2])
        forces.append(bulk.energy(bulk.deformed(bent.ravel())))
    assert forces[1] < 3.0 * forces[0]
