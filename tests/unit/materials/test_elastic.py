"""Hooke's law, and that every law's stress and tangent are derivatives of its energy."""

from typing import get_args

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.materials.elastic import Elastic, RayleighDamping
from fingerslip.materials.material import STRAIN_COMPONENTS, Formulation


def test_moduli_units_and_frozen_fields_and_stress_in_3d_by_compliances():
    """The strain of each stress component by itself, written with E and nu."""
    material = Elastic("34 kPa", 0.48, "1 g/cm^3")
    assert (material.stiffness, material.shear_modulus) == (34e3, pytest.approx(34e3 / 2.96))
    assert (material.youngs_modulus, material.density) == (34e3, pytest.approx(1000.0))
    assert RayleighDamping() == RayleighDamping(0.0, 0.0)
    with pytest.raises(AttributeError):
        material.density = 1.0
    modulus, ratio = 2e5, 0.3
    compliance = np.diag([1.0] * 3 + [2 * (1 + ratio)] * 3)
    compliance[:3, :3] -= ratio * (1 - np.eye(3))
    stress = Elastic(modulus, ratio, 1000.0).stress(compliance / modulus, "solid")
    np.testing.assert_allclose(stress, np.eye(6), atol=1e-12)


def test_plane_stress_has_none_across_and_plane_strain_no_strain_across():
    material, strain = Elastic(2e5, 0.3, 1000.0), np.array([[1e-3, 2e-3, 5e-4]])
    solid = np.array([[1e-3, 2e-3, 0.0, 5e-4, 0.0, 0.0]])
    with_across = material.stress(solid, "solid")[0]
    assert material.stress_across(strain, "plane_strain") == pytest.approx([with_across[2]], rel=1e-13)
    np.testing.assert_allclose(material.stress(strain, "plane_strain")[0], with_across[[0, 1, 3]], rtol=1e-13)
    # Out of the plane the free strain is -nu / (1 - nu) (xx + yy).
    solid[0, 2] = -0.3 / 0.7 * 3e-3
    thinned = material.stress(solid, "solid")[0]
    assert thinned[2] == pytest.approx(0.0, abs=1e-10)
    assert material.stress_across(strain, "plane_stress") == [0.0]
    np.testing.assert_allclose(material.stress(strain, "plane_stress")[0], thinned[[0, 1, 3]], rtol=1e-13)


@pytest.mark.parametrize("formulation", ["plane_strain", "solid"])
def test_incompressible_elasticity_is_refused_but_in_plane_stress(formulation):
    material = Elastic(3.0, 0.5, 1000.0)
    with pytest.raises(InputError, match=r"^poisson_ratio: got 0.5, .* needs < 0.5; write 0.4999"):
        material.dilatational_modulus(formulation)
    assert material.dilatational_modulus("plane_stress") == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Elastic(-1.0, 0.3, 1000.0), "Elastic.youngs_modulus: got -0.001 kPa, needs a value > 0"),
        (lambda: Elastic(0.0, 0.3, 1000.0), "Elastic.youngs_modulus"),
        (lambda: Elastic(1e5, 0.51, 1000.0), "Elastic.poisson_ratio: got 0.51, needs a number <= 0.5"),
        (lambda: Elastic(1e5, -0.1, 1000.0), "Elastic.poisson_ratio: got -0.1, needs a number >= 0"),
        (lambda: Elastic(1e5, 0.3, 0.0), "Elastic.density"),
        (lambda: Elastic(float("inf"), 0.3, 1000.0), "Elastic.youngs_modulus"),
        (lambda: Elastic(float("nan"), 0.3, 1000.0), "Elastic.youngs_modulus"),
        (lambda: RayleighDamping(stiffness=-1e-3), "RayleighDamping.stiffness"),
        (lambda: RayleighDamping(mass=-1.0), "RayleighDamping.mass"),
    ],
)
def test_impossible_materials_are_refused(make, message):
    with pytest.raises(InputError) as caught:
        make()
    assert message in str(caught.value)


EXAMPLES = {Elastic: (Elastic(34e3, 0.48, 1000.0), Elastic(1.5e9, 0.3, 449.0), Elastic(1e5, 0.0, 1000.0))}
EVERY = pytest.mark.parametrize("law", [law for laws in EXAMPLES.values() for law in laws], ids=str)
STEP = 1e-6


def strains(formulation, count=5):
    components = STRAIN_COMPONENTS[3 if formulation == "solid" else 2]
    return np.random.default_rng(2).uniform(-0.2, 0.2, (count, components))


def differences(of, at):
    """Return the central differences of a function of strains by each component, the component last."""
    steps = STEP * np.eye(at.shape[1])
    return np.stack([(of(at + step) - of(at - step)) / (2 * STEP) for step in steps], axis=-1)


@EVERY
@pytest.mark.parametrize("formulation", get_args(Formulation))
def test_stress_and_tangent_are_derivatives_of_the_energy(law, formulation):
    at = strains(formulation)
    stress, tangent = law.stress(at, formulation), law.tangent(at, formulation)
    slopes = differences(lambda e: law.energy(e, formulation), at)
    np.testing.assert_allclose(stress, slopes, atol=1e-6 * np.abs(stress).max())
    slopes = differences(lambda e: law.stress(e, formulation), at)
    np.testing.assert_allclose(tangent, slopes, atol=1e-6 * np.abs(tangent).max())
    none, components = strains(formulation, 0), at.shape[1]
    shapes = [of(none, formulation).shape for of in (law.energy, law.stress, law.tangent)]
    assert shapes == [(0,), (0, components), (0, components, components)]
