"""Materials that ship: every value has a source that can be looked up, or is marked assumed."""

from __future__ import annotations

from importlib import resources

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.materials.choice import material, material_header, material_names, material_table
from fingerslip.materials.large_strain import FiniteMaterial
from fingerslip.materials.material import Material
from fingerslip.specimens.fingertip.fingertip import preset


@pytest.mark.parametrize("name", material_names())
def test_every_material_is_a_law_and_says_what_it_claims(name):
    assert isinstance(material(name), Material | FiniteMaterial)
    assert all(material_header(name)[key] for key in ("citation", "published", "claims_not"))


@pytest.mark.parametrize("name", material_names())
def test_sources_are_in_the_references_or_assumed(name):
    references = resources.files("fingerslip").joinpath("references.bib").read_text()
    table = material_table(name)
    assert all(row.source == "assumed" or f"{{{row.source}," in references for row in table)
    assert [row.source == "assumed" for row in table] == sorted(
        (row.source == "assumed" for row in table), reverse=True
    )


@pytest.mark.parametrize(
    ("name", "stresses"),
    [("ecoflex-00-30", (8.56e3, 16.89e3, 22.88e3, 29.72e3)), ("dragon-skin-30", (110.9e3, 213.9e3, 322.1e3, 437.1e3))],
)
def test_silicones_follow_the_test_they_were_fitted_to(name, stresses):
    """Nominal stress of the uniaxial test at strains 0.25 to 1; the notes state 4.7 and 0.4 % as largest errors."""
    law, stretch = material(name), 1.0 + np.array([0.25, 0.5, 0.75, 1.0])
    log_strain = np.log(stretch)[:, None] * np.array([1.0, -0.5, -0.5])
    stress = law.kirchhoff_stress(log_strain)
    nominal = (stress[:, 0] - stress[:, 1]) / stretch
    np.testing.assert_allclose(nominal, stresses, rtol=0.048 if name == "ecoflex-00-30" else 0.005)


def test_tissue_is_that_of_the_fingertip_preset():
    finger = preset("wang2014-2d").materials
    assert material("pulp").at_rest() == finger["tissue"]
    assert material("skin").at_rest() == finger["epidermis"]


def test_pulp_that_relaxes_ends_near_pulp():
    law, left = material("pulp-relaxing"), 1.0 - 0.6
    assert [term.time for term in law.prony] == [4e-3, 70e-3, 1.4]
    assert left * law.shear_modulus == pytest.approx(material("pulp").shear_modulus)


def test_ranges_are_shown_with_the_notes():
    rows = {row.path: row for row in material_table("sylgard-184")}
    assert rows["youngs_modulus"].note.endswith("range 1.32 to 2.97 MPa, cured at 25 to 200 degrees Celsius")


def test_unknown_names_are_refused_with_the_known_ones():
    with pytest.raises(InputError, match=r"'ecoflex' is not known, needs one of agilus30, .*mean 'ecoflex-00-30'"):
        material("ecoflex")
