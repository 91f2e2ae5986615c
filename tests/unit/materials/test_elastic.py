"""Materials: derived constants, units, and values that cannot be."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.materials.elastic import Elastic, hooke_stress


def test_shear_modulus():
    assert Elastic(34e3, 0.48, 1000.0).shear_modulus == pytest.approx(34e3 / 2.96)


def test_contact_stiffness_is_youngs_modulus():
    assert Elastic(34e3, 0.48, 1000.0).stiffness == 34e3


def test_stress_in_space_is_hookes_law_in_compliances():
    """The strain of each stress component by itself, written with E and nu."""
    modulus, ratio = 2e5, 0.3
    compliance = np.diag([1.0] * 3 + [2 * (1 + ratio)] * 3)
    compliance[:3, :3] -= ratio * (1 - np.eye(3))
    stress = Elastic(modulus, ratio, 1000.0).stress(compliance / modulus, "solid")
    np.testing.assert_allclose(stress, np.eye(6), atol=1e-12)


def test_plane_stress_has_none_across_and_plane_strain_no_strain_across():
    material, strain = Elastic(2e5, 0.3, 1000.0), np.array([[1e-3, 2e-3, 5e-4]])
    solid = np.array([[1e-3, 2e-3, 0.0, 5e-4, 0.0, 0.0]])
    in_space = material.stress(solid, "solid")[0]
    assert material.stress_across(strain, "plane_strain") == pytest.approx([in_space[2]], rel=1e-13)
    np.testing.assert_allclose(material.stress(strain, "plane_strain")[0], in_space[[0, 1, 3]], rtol=1e-13)
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


def test_strain_is_not_changed():
    strain = np.ones((2, 6))
    hooke_stress(strain, 1.0, 2.0)
    np.testing.assert_array_equal(strain, 1.0)


def test_text_with_units_is_read():
    material = Elastic("34 kPa", 0.48, "1 g/cm^3")
    assert (material.youngs_modulus, material.density) == (34e3, pytest.approx(1000.0))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ((-1.0, 0.3, 1000.0), "Elastic.youngs_modulus: got -0.001 kPa, needs a value > 0"),
        ((0.0, 0.3, 1000.0), "Elastic.youngs_modulus"),
        ((1e5, 0.51, 1000.0), "Elastic.poisson_ratio: got 0.51, needs a number <= 0.5"),
        ((1e5, -0.1, 1000.0), "Elastic.poisson_ratio: got -0.1, needs a number >= 0"),
        ((1e5, 0.3, 0.0), "Elastic.density"),
        ((float("inf"), 0.3, 1000.0), "Elastic.youngs_modulus"),
        ((float("nan"), 0.3, 1000.0), "Elastic.youngs_modulus"),
    ],
)
def test_impossible_materials_are_refused(values, message):
    with pytest.raises(InputError) as caught:
        Elastic(*values)
    assert message in str(caught.value)


def test_materials_are_frozen():
    with pytest.raises(AttributeError):
        Elastic(34e3, 0.48, 1000.0).density = 1.0
