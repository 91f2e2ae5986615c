"""Laws of large strain: known tests, stability, limits of small strain."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fingerslip as fs
from fingerslip.errors import InputError
from fingerslip.materials.choice import LAWS
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.large_strain import FiniteMaterial, check_stability, isochoric_tangent
from fingerslip.materials.mooney_rivlin import MooneyRivlin
from fingerslip.materials.neo_hookean import NeoHookean
from fingerslip.materials.ogden import Ogden, OgdenTerm
from problems.verification.large_laws import CASES

TERMS = (OgdenTerm(30e3, 1.3), OgdenTerm(0.2e3, 5.0), OgdenTerm(-0.5e3, -2.0))
EXAMPLES = {
    NeoHookean: (NeoHookean(34e3, 0.48, 1000.0), NeoHookean(34e3, 0.0, 1000.0)),
    MooneyRivlin: (MooneyRivlin(8e3, 1000.0, 3e3, poisson_ratio=0.48), MooneyRivlin(8e3, 1000.0, bulk_modulus=1e6)),
    Ogden: (Ogden(TERMS, 1000.0, poisson_ratio=0.3), Ogden(TERMS[:1], 1000.0, bulk_modulus=2e6)),
}
EVERY = pytest.mark.parametrize(
    "law",
    [
        pytest.param(law, id=f"{type(law).__name__}-{number}")
        for laws in EXAMPLES.values()
        for number, law in enumerate(laws)
    ],
)
STEP = 1e-6


def log_strains(count=40):
    return np.random.default_rng(5).uniform(-0.6, 0.6, (count, 3))


def differences(of, at):
    """Return the central differences of a function of logarithmic strains by each of them, the last axis."""
    return np.stack([(of(at + step) - of(at - step)) / (2 * STEP) for step in STEP * np.eye(3)], axis=-1)


@EVERY
def test_stress_and_tangent_are_derivatives_of_the_energy(law):
    at = log_strains()
    before = at.copy()
    stress, tangent = law.kirchhoff_stress(at), law.kirchhoff_tangent(at)
    np.testing.assert_allclose(stress, differences(law.stored_energy, at), atol=1e-8 * np.abs(stress).max())
    np.testing.assert_allclose(tangent, differences(law.kirchhoff_stress, at), atol=1e-8 * np.abs(tangent).max())
    np.testing.assert_allclose(tangent, tangent.transpose(0, 2, 1), rtol=1e-13)
    law.volumetric(at.sum(axis=1))
    np.testing.assert_array_equal(at, before)


@EVERY
def test_every_law_answers_the_protocol_and_its_law_at_rest_is_its_linearisation(law):
    """Of normal strains along the axes Hooke's law has the tangent lambda + 2 G on, lambda off the diagonal."""
    assert set(EXAMPLES) == {law for law in LAWS if hasattr(law, "stored_energy")}
    assert isinstance(law, FiniteMaterial)
    rest, none = law.at_rest(), np.zeros((1, 3))
    assert (law.density, law.stiffness) == (1000.0, pytest.approx(rest.youngs_modulus))
    np.testing.assert_array_equal(law.kirchhoff_stress(none), 0.0)
    np.testing.assert_array_equal(law.stored_energy(none), 0.0)
    hooke = rest.tangent(np.zeros((1, 6)), "solid")[0, :3, :3]
    np.testing.assert_allclose(law.kirchhoff_tangent(none)[0], hooke, rtol=1e-12)
    assert rest.shear_modulus == pytest.approx(law.shear_modulus)
    shapes = [of(none[:0]).shape for of in (law.stored_energy, law.kirchhoff_stress, law.kirchhoff_tangent)]
    assert shapes == [(0,), (0, 3), (0, 3, 3)]


def test_bulk_modulus_follows_from_poissons_ratio_and_back():
    bulk_modulus = MooneyRivlin(5e3, 1000.0, poisson_ratio=0.45).bulk
    assert bulk_modulus == pytest.approx(2 * 10e3 * 1.45 / (3 * 0.1))
    rest = MooneyRivlin(5e3, 1000.0, bulk_modulus=bulk_modulus).at_rest()
    assert (rest.poisson_ratio, rest.youngs_modulus) == (pytest.approx(0.45), pytest.approx(29e3))
    assert NeoHookean(34e3, 0.48, 1000.0).at_rest() == Elastic(34e3, 0.48, 1000.0)
    assert MooneyRivlin(8e3, 1000.0, 3e3, poisson_ratio=0.48).at_rest().poisson_ratio == 0.48
    law = MooneyRivlin(8e3, 1000.0, 3e3, bulk_modulus=1e6)
    assert law.at_rest().poisson_ratio == pytest.approx((3e6 - 2 * 22e3) / (2 * (3e6 + 22e3)))
    np.testing.assert_allclose(law.kirchhoff_stress(np.full((1, 3), 0.1)), 1e6 * 0.3, rtol=1e-13)


def stable_below(limit):
    """Return the tangent of a made-up law that is stable where no logarithmic strain is above a limit."""
    return lambda e: isochoric_tangent(np.where(e.max(axis=1, keepdims=True) < limit, 1.0, -1.0) * np.ones_like(e))


def test_check_names_tests_and_stretches():
    """The largest stretch is that of the test where it is above 1, and of the sides where it is below."""
    check_stability(stable_below(np.log(1.5)), (0.9, 1.2))
    with pytest.raises(InputError) as caught:
        check_stability(stable_below(np.log(1.5)), (0.4, 3.0))
    tests = re.findall(r"(\w+) below ([\d.]+) and above ([\d.]+)", str(caught.value))
    assert [test for test, *_ in tests] == ["uniaxial", "equibiaxial", "planar"]
    limits = [(float(below), float(above)) for _, below, above in tests]
    np.testing.assert_allclose(limits, [(1.5**-2, 1.5), (1.5**-0.5, 1.5), (1.5**-1, 1.5)], rtol=0.01)
    assert "stretches of 0.4 to 3" in str(caught.value)


STRAINS = np.random.default_rng(5).uniform(-0.5, 0.5, (50, 3))


@given(c10=st.floats(1e3, 1e6), share=st.floats(0.0, 2.0), ratio=st.floats(0.3, 0.499))
def test_mooney_rivlin_is_ogden_with_the_exponents_two_and_minus_two(c10: float, share: float, ratio: float) -> None:
    c01 = share * c10
    mooney = fs.MooneyRivlin(c10=c10, c01=c01, density=1000.0, poisson_ratio=ratio)
    terms = (fs.OgdenTerm(2.0 * c10, 2.0), fs.OgdenTerm(-2.0 * c01, -2.0))
    ogden = fs.Ogden(terms=terms, density=1000.0, poisson_ratio=ratio)
    assert mooney.at_rest() == ogden.at_rest()
    for answer in ("stored_energy", "kirchhoff_stress", "kirchhoff_tangent"):
        of_mooney, of_ogden = (getattr(law, answer)(STRAINS) for law in (mooney, ogden))
        np.testing.assert_allclose(of_mooney, of_ogden, rtol=1e-12, atol=1e-12 * np.abs(of_ogden).max())


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_energy_and_stress_are_those_that_the_source_prints(case):
    """And with them those of all tests: stretched, sheared, held aside. The stress is the stretch times dW/dstretch."""
    for strain, stretches in zip(STRAINS, np.exp(STRAINS), strict=True):
        energy, stress = case.energy(stretches.astype(complex)).real, stretches * case.stress(stretches)
        assert case.law.stored_energy(strain[None])[0] == pytest.approx(energy, rel=1e-11)
        np.testing.assert_allclose(
            case.law.kirchhoff_stress(strain[None])[0], stress, atol=1e-12 * np.abs(stress).max()
        )


def mooney(**values):
    return MooneyRivlin(8e3, 1000.0, **values)


def ogden(*terms):
    return Ogden(tuple(OgdenTerm(*term) for term in terms), 1000.0, poisson_ratio=0.48)


DRUCKER = "not stable (Drucker) at stretches: uniaxial "


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (mooney, "bulk_modulus: is missing, needs a value; or give poisson_ratio"),
        (lambda: mooney(bulk_modulus=1e6, poisson_ratio=0.4), "poisson_ratio: is given with bulk_modulus"),
        (
            lambda: mooney(bulk_modulus=1e3),
            "bulk_modulus: got 1000 Pa, too small against the shear modulus of 16000 Pa",
        ),
        (lambda: mooney(bulk_modulus=1e6, c01=-9e3), "c10: got c10 + c01 = -1000 Pa"),
        (lambda: mooney(bulk_modulus=1e6, c01=-2e3), f"{DRUCKER}above 2, equibiaxial below 0.706 and above "),
        (lambda: mooney(bulk_modulus=1e6, stable_between=(1.2, 2.0)), "stable_between: got 1.2 and 2"),
        (ogden, "terms: is empty"),
        (lambda: ogden((-2e3, 2.0)), "terms: has a sum of modulus times exponent of -4000 Pa, needs a sum > 0"),
        (lambda: ogden((1e3, 0.0)), "exponent: got 0"),
        (lambda: ogden((5e3, 2.0), (2e3, -2.0)), f"is {DRUCKER}below "),
        *((lambda ratio=ratio: NeoHookean(34e3, ratio, 1000.0), "NeoHookean.poisson_ratio") for ratio in (0.5, -0.1)),
        # The range has to hold the state of rest.
        *(
            (lambda stretches=stretches: check_stability(stable_below(10.0), stretches), "stable_between")
            for stretches in ((0.0, 2.0), (1.0, 2.0), (0.5, 1.0), (2.0, 0.5))
        ),
    ],
)
def test_impossible_constants_are_refused(make, message):
    with pytest.raises(InputError) as caught:
        make()
    assert message in str(caught.value)
