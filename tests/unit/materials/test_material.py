"""What holds of every law of small strain: stress and tangent are derivatives, in every formulation."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from fingerslip.materials import LAWS
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.material import STRAIN_COMPONENTS, Formulation, Material

EXAMPLES = {Elastic: (Elastic(34e3, 0.48, 1000.0), Elastic(1.5e9, 0.3, 449.0), Elastic(1e5, 0.0, 1000.0))}
LAWS_AND_FORMULATIONS = [
    pytest.param(law, formulation, id=f"{law}-{formulation}")
    for laws in EXAMPLES.values()
    for law in laws
    for formulation in get_args(Formulation)
]
STEP = 1e-6


def strains(formulation, count=5):
    components = STRAIN_COMPONENTS[3 if formulation == "solid" else 2]
    return np.random.default_rng(2).uniform(-0.2, 0.2, (count, components))


def differences(of, at):
    """Return the central differences of a function of strains by each component, the component last."""
    steps = STEP * np.eye(at.shape[1])
    return np.stack([(of(at + step) - of(at - step)) / (2 * STEP) for step in steps], axis=-1)


def test_every_law_of_small_strain_is_looked_at():
    assert set(EXAMPLES) == {law for law in LAWS if hasattr(law, "energy")}


@pytest.mark.parametrize("law", [law for laws in EXAMPLES.values() for law in laws], ids=str)
def test_every_law_answers_the_protocol(law):
    assert isinstance(law, Material)
    assert law.density > 0
    assert law.stiffness > 0


@pytest.mark.parametrize(("law", "formulation"), LAWS_AND_FORMULATIONS)
def test_stress_is_the_derivative_of_the_energy(law, formulation):
    at = strains(formulation)
    stress = law.stress(at, formulation)
    assert stress.shape == at.shape
    np.testing.assert_allclose(
        stress, differences(lambda e: law.energy(e, formulation), at), atol=1e-6 * np.abs(stress).max()
    )


@pytest.mark.parametrize(("law", "formulation"), LAWS_AND_FORMULATIONS)
def test_tangent_is_the_derivative_of_the_stress(law, formulation):
    at = strains(formulation)
    tangent = law.tangent(at, formulation)
    assert tangent.shape == (*at.shape, at.shape[1])
    np.testing.assert_allclose(
        tangent, differences(lambda e: law.stress(e, formulation), at), atol=1e-6 * np.abs(tangent).max()
    )


@pytest.mark.parametrize(("law", "formulation"), LAWS_AND_FORMULATIONS)
def test_nothing_is_stored_at_rest_and_the_tangent_is_stable(law, formulation):
    rest = np.zeros((1, strains(formulation).shape[1]))
    assert law.energy(rest, formulation) == 0.0
    assert not law.stress(rest, formulation).any()
    tangent = law.tangent(rest, formulation)[0]
    np.testing.assert_allclose(tangent, tangent.T, rtol=1e-12)
    assert np.linalg.eigvalsh(tangent).min() > 0.0


@pytest.mark.parametrize(("law", "formulation"), LAWS_AND_FORMULATIONS)
def test_what_the_dilatational_part_leaves_of_the_tangent_is_stable(law, formulation):
    at = strains(formulation, 1)
    tangent, dim = np.array(law.tangent(at, formulation)[0]), 3 if formulation == "solid" else 2
    tangent[:dim, :dim] -= law.dilatational_modulus(formulation)
    assert np.linalg.eigvalsh(tangent).min() > 0.0


@pytest.mark.parametrize(("law", "formulation"), LAWS_AND_FORMULATIONS)
def test_no_points_have_no_values(law, formulation):
    none = strains(formulation, 0)
    shapes = [law.energy(none, formulation).shape, law.stress(none, formulation).shape]
    shapes.append(law.tangent(none, formulation).shape)
    components = none.shape[1]
    assert shapes == [(0,), (0, components), (0, components, components)]


@pytest.mark.parametrize("law", [law for laws in EXAMPLES.values() for law in laws], ids=str)
@pytest.mark.parametrize("formulation", ["plane_strain", "plane_stress"])
def test_stress_across_has_a_value_for_every_point(law, formulation):
    across = law.stress_across(strains(formulation), formulation)
    assert across.shape == (5,)
    assert across.any() == (formulation == "plane_strain" and getattr(law, "poisson_ratio", 1.0) > 0)
