"""Materials: derived constants, units, and values that cannot be."""

from __future__ import annotations

import pytest

from fingerslip.errors import InputError
from fingerslip.materials.elastic import Elastic, RayleighDamping


def test_shear_modulus():
    assert Elastic(34e3, 0.48, 1000.0).shear_modulus == pytest.approx(34e3 / 2.96)


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


def test_damping_is_none_unless_asked_for_and_never_negative():
    assert RayleighDamping() == RayleighDamping(0.0, 0.0)
    with pytest.raises(InputError, match=r"RayleighDamping.stiffness"):
        RayleighDamping(stiffness=-1e-3)
    with pytest.raises(InputError, match=r"RayleighDamping.mass"):
        RayleighDamping(mass=-1.0)


def test_materials_are_frozen():
    with pytest.raises(AttributeError):
        Elastic(34e3, 0.48, 1000.0).density = 1.0
