"""Stress and energy at sites and in cells are means of what the elements feel."""

import numpy as np
import pytest

from fingerslip.errors import MeshError
from fingerslip.fe.finite.recovery import finite_cell_recovery, finite_site_recovery
from fingerslip.fe.recovery import cells_around
from fingerslip.materials.material import SHEARS
from fingerslip.materials.neo_hookean import NeoHookean
from fingerslip.verification.viscoelastic import ramp_response
from problems.verification.large_laws import CASES, stress_row, uniform
from unit.fe.finite.bodies import EVERY, RELAXING, SOFT, STEP, STIFF, TERMS, body, moved, relaxing_body, stretched


@EVERY
def test_uniform_strain_has_its_stress_its_energy_and_the_logarithm_of_its_left_stretch(
    element, integration, formulation
):
    case = CASES[0]
    bulk = body(element, integration, formulation, law=case.law)
    (gradient, at), dim = stretched(bulk), bulk.space.dim
    state, full = bulk.deformed(at), np.eye(3)
    full[:dim, :dim] += gradient
    expected = uniform(case, full, (2,) if formulation == "plane_stress" else ())
    sites, cells = finite_site_recovery(bulk, np.array([0, 4]), [None, None]), finite_cell_recovery(bulk)
    for recovery in (sites, cells):
        stresses, row = recovery.stresses(state), stress_row(expected.cauchy, dim)
        np.testing.assert_allclose(stresses, np.tile(row, (len(stresses), 1)), atol=3e-10 * np.abs(row).max())
        np.testing.assert_allclose(recovery.energy_densities(state), expected.density)
    deformation = full[:dim, :dim]
    squared, axes = np.linalg.eigh(deformation @ deformation.T)
    logarithm, tensors = (axes * (0.5 * np.log(squared))) @ axes.T, cells.tensors(state)
    for column, pair in enumerate([*((axis, axis) for axis in range(dim)), *SHEARS[dim]]):
        np.testing.assert_allclose(
            tensors[:, column if column < dim else column - dim + 3], logarithm[pair], atol=1e-12
        )
    if formulation == "plane_strain":
        np.testing.assert_allclose(tensors[:, 2], 0.0, atol=1e-15)


@EVERY
def test_energy_of_cells_adds_up_and_sites_have_the_mean_of_their_cells(element, integration, formulation):
    bulk = body(element, integration, formulation, law=STIFF, beside=SOFT)
    state = bulk.deformed(moved(bulk, 0.03))
    cells = finite_cell_recovery(bulk)
    assert cells.energy_densities(state) @ bulk.weights.sum(axis=1) == pytest.approx(bulk.energy(state))
    nodes, regions = np.array([1, 5]), [None, None]
    sites, around = finite_site_recovery(bulk, nodes, regions), cells_around(bulk.space, nodes, regions)
    np.testing.assert_allclose(sites.stresses(state), around @ cells.stresses(state))


@pytest.mark.parametrize("kind", [("Q4", "selective", "plane_strain"), ("H8", "selective", "solid")])
def test_stresses_do_not_grow_with_the_bulk_modulus_where_mean_volumes_do_not_change(kind):
    """A bent block keeps the areas of its cells nearly; the determinant of a mean gradient does not."""
    stresses = []
    for ratio in (0.49, 0.4999):
        bulk = body(*kind, law=NeoHookean(3.0, ratio, 1.0))
        ripple = moved(bulk, 0.01)
        state = bulk.deformed(ripple)
        # What mean volumes feel is the law's pressure at them, and nothing of the points' own volumes.
        own = finite_cell_recovery(bulk).stresses(state)
        pressure = bulk.materials.materials[0].first_lame * np.log(state.mean_volume) / state.mean_volume
        stresses.append(own[:, : bulk.space.dim].mean(axis=1) - pressure)
    assert np.abs(stresses[1]).max() < 2.0 * np.abs(stresses[0]).max()


def test_a_site_takes_the_side_of_its_region():
    bulk = body("Q4", law=STIFF, beside=SOFT)
    state = bulk.deformed(moved(bulk, 0.02))
    shared = np.intersect1d(*(bulk.nodes[bulk.materials.number == number] for number in (0, 1)))[:1]
    near, far = (finite_site_recovery(bulk, shared, [name]).stresses(state) for name in ("near", "far"))
    assert np.abs(near - far).max() > 0.1 * np.abs(near).max()
    with pytest.raises(MeshError, match="no cell of region"):
        finite_site_recovery(bulk, np.setdiff1d(bulk.nodes[bulk.materials.number == 0], shared)[:1], ["far"])
    assert finite_site_recovery(bulk, np.zeros(0, dtype=np.int64), []).stresses(state).shape == (0, 4)


@EVERY
def test_held_strain_has_the_pressure_of_the_volume_and_the_relaxed_stress_of_the_shape(
    element, integration, formulation
):
    """In Mooney-Rivlin's law these are mean and deviator; in plane stress there is none across at any time."""
    bulk = relaxing_body((element, integration, formulation), RELAXING[1], beside=RELAXING[1])
    (_, at), state, times = stretched(bulk), bulk.at_rest(STEP), STEP * np.arange(1, 5)
    sites, rows = finite_site_recovery(bulk, np.array([0, 4]), [None, None]), []
    for _ in times:
        state = bulk.ended(bulk.deformed(at, bulk.begun(state, STEP)))
        rows.append(sites.stresses(state))
        np.testing.assert_allclose(sites.energy_densities(state), bulk.energy(state) / bulk.weights.sum())
    stresses = np.array(rows)
    if formulation == "plane_stress":
        np.testing.assert_allclose(stresses[..., 2], 0.0, atol=1e-8)
        return
    elastic = sites.stresses(bulk.deformed(at))
    mean = elastic[..., :3].mean(axis=-1, keepdims=True) * ([1.0] * 3 + [0.0] * (elastic.shape[-1] - 3))
    response = ramp_response(TERMS, STEP, times)[:, None, None]
    np.testing.assert_allclose(stresses, mean + response * (elastic - mean), atol=1e-9 * np.abs(elastic).max())
