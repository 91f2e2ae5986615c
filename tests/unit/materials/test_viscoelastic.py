"""Stress and stored energy of strains whose dashpots have followed, against integrals over their history."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.materials.elastic import Elastic
from fingerslip.materials.prony import PronyTerm, relaxation
from fingerslip.materials.viscoelastic import Relaxed, across_of, follow_strains, in_space, stored_energy, stress

TERMS = (PronyTerm(0.3, 0.1), PronyTerm(0.4, 1.0))
LAW = Elastic(34e3, 0.4, 1000.0, prony=TERMS)
STEP = 0.05
FORMULATIONS = ("plane_strain", "plane_stress", "solid")


def history(formulation, count=40):
    components = 6 if formulation == "solid" else 3
    strains = np.random.default_rng(3).normal(size=(count, 2, components)).cumsum(axis=0) * 1e-3
    strains[0] = 0.0
    return strains


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_stress_at_once_is_hookes(formulation):
    strains = np.random.default_rng(1).normal(size=(5, 6 if formulation == "solid" else 3))
    across = 0.0
    if formulation == "plane_stress":
        across = -across_of(LAW.poisson_ratio).along * strains[:, :2].sum(axis=1)
    whole = in_space(strains, across)
    found = stress(LAW, Relaxed(whole, np.zeros((2, *whole.shape))))
    in_plane = found if formulation == "solid" else found[:, [0, 1, 3]]
    np.testing.assert_allclose(in_plane, LAW.stress(strains, formulation), rtol=1e-12, atol=1e-9)
    if formulation != "solid":
        np.testing.assert_allclose(found[:, 2], LAW.stress_across(strains, formulation), atol=1e-9)
    energy = stored_energy(LAW, Relaxed(whole, np.zeros((2, *whole.shape))))
    np.testing.assert_allclose(energy, LAW.energy(strains, formulation), rtol=1e-12)


@pytest.mark.parametrize("formulation", ["plane_strain", "solid"])
def test_deviator_relaxes_and_the_mean_stress_does_not(formulation):
    """The hereditary integral of piecewise linear strain, by parts of each step that a fine grid adds up."""
    strains = history(formulation)
    found = stress(LAW, follow_strains(LAW, strains, formulation, STEP))[-1]
    whole = in_space(strains)
    fine = (np.arange(2000) + 0.5) / 2000
    later = STEP * (len(strains) - 1 - np.arange(len(strains) - 1))
    kernel = np.array([relaxation(TERMS, end - STEP * fine).mean() for end in later])
    mean = whole[..., :3].mean(axis=-1, keepdims=True)
    deviator = whole - np.concatenate([np.repeat(mean, 3, -1), np.zeros_like(whole[..., 3:])], -1)
    expected = 2 * LAW.shear_modulus * np.tensordot(kernel, np.diff(deviator, axis=0), axes=1)
    expected[..., 3:] /= 2
    expected[..., :3] += 34e3 / (1 - 0.8) * mean[-1]
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())


def test_plane_stress_has_none_across_and_is_that_of_a_solid_with_that_strain():
    strains = history("plane_stress")
    relaxed = follow_strains(LAW, strains, "plane_stress", STEP)
    found = stress(LAW, relaxed)
    np.testing.assert_allclose(found[..., 2], 0.0, atol=1e-12 * np.abs(found).max())
    solid = np.zeros((*strains.shape[:-1], 6))
    solid[..., [0, 1, 2, 3]] = relaxed.strains
    in_solid = stress(LAW, follow_strains(LAW, solid, "solid", STEP))
    np.testing.assert_allclose(found, in_solid[..., :4], atol=1e-12 * np.abs(found).max())


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_stored_energy_is_never_above_the_work_and_that_of_the_springs_left_in_the_end(formulation):
    strains = np.zeros((4000, 1, 6 if formulation == "solid" else 3))
    strains[1:, :, 0] = 1e-2
    energy = stored_energy(LAW, follow_strains(LAW, strains, formulation, STEP))[:, 0]
    left = 1 - sum(term.share for term in TERMS)
    bulk, shear = 34e3 / (3 * (1 - 0.8)), left * LAW.shear_modulus
    young = 9 * bulk * shear / (3 * bulk + shear)
    slow = Elastic(young, young / (2 * shear) - 1, 1000.0)
    assert energy[-1] == pytest.approx(slow.energy(strains[-1], formulation)[0], rel=1e-9)
    assert (np.diff(energy[1:]) <= 1e-12 * energy[1]).all()


def test_incompressible_plane_stress_is_computed():
    law = Elastic(34e3, 0.5, 1000.0, prony=TERMS)
    strains = history("plane_stress")
    found = stress(law, follow_strains(law, strains, "plane_stress", STEP))
    nearly = Elastic(34e3, 0.4999999, 1000.0, prony=TERMS)
    expected = stress(nearly, follow_strains(nearly, strains, "plane_stress", STEP))
    np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max())
