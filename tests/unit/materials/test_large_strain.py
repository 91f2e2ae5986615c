"""Laws of large strain: known tests, stability, limits of small strain."""

import itertools
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fingerslip as fs
from fingerslip.errors import InputError
from fingerslip.materials.choice import LAWS
from fingerslip.materials.elastic import Elastic
from fingerslip.materials.large_strain import (
    FiniteMaterial,
    check_stability,
    chosen_bulk_modulus,
    deviator,
    isochoric_tangent,
    linearise,
    log_volume_of,
)
from fingerslip.materials.mooney_rivlin import MooneyRivlin
from fingerslip.materials.neo_hookean import NeoHookean
from fingerslip.materials.ogden import Ogden, OgdenTerm

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
def test_no_axis_is_another_than_the_others_and_points_are_independent(law):
    at = log_strains(6)
    for order in map(list, itertools.permutations(range(3))):
        np.testing.assert_allclose(law.stored_energy(at[:, order]), law.stored_energy(at), rtol=1e-12)
        np.testing.assert_allclose(law.kirchhoff_stress(at[:, order]), law.kirchhoff_stress(at)[:, order], rtol=1e-12)
    np.testing.assert_array_equal(law.kirchhoff_stress(at)[1:2], law.kirchhoff_stress(at[1:2]))
    none = np.zeros((0, 3))
    shapes = [of(none).shape for of in (law.stored_energy, law.kirchhoff_stress, law.kirchhoff_tangent)]
    assert shapes == [(0,), (0, 3), (0, 3, 3)]


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


@EVERY
def test_part_of_the_volume_has_its_derivatives(law):
    at = np.linspace(-0.4, 0.5, 7)
    energy, first, second = law.volumetric(at)
    ahead, back = law.volumetric(at + STEP), law.volumetric(at - STEP)
    scale = np.abs(second).max()
    np.testing.assert_allclose((ahead[0] - back[0]) / (2 * STEP), first, atol=1e-8 * scale)
    np.testing.assert_allclose((ahead[1] - back[1]) / (2 * STEP), second, atol=1e-8 * scale)
    assert [float(part[0]) for part in law.volumetric(np.zeros(1))[:2]] == [0.0, 0.0]
    assert (energy >= 0.0).all()


@pytest.mark.parametrize("make", [lambda nu: NeoHookean(34e3, nu, 1.0), lambda nu: Ogden(TERMS, 1.0, poisson_ratio=nu)])
def test_what_the_part_of_the_volume_leaves_stays_bounded(make):
    at = log_strains()
    left = [
        law.kirchhoff_stress(at) - law.volumetric(at.sum(axis=1))[1][:, None] for law in (make(0.49), make(0.499999))
    ]
    np.testing.assert_allclose(left[0], left[1], rtol=0.02, atol=100.0)


def test_deviator_and_tangent_of_shape_are_projections():
    values = np.array([[1.0, 2.0, 6.0], [0.0, 0.0, 0.0]])
    np.testing.assert_allclose(log_volume_of(deviator(values)), 0.0, atol=1e-15)
    np.testing.assert_allclose(np.diff(deviator(values), axis=1), np.diff(values, axis=1))
    rates, projection = np.array([[1.0, 2.0, 5.0]]), np.eye(3) - 1 / 3
    np.testing.assert_allclose(isochoric_tangent(rates)[0], projection @ np.diag(rates[0]) @ projection, atol=1e-14)


def test_bulk_modulus_follows_from_poissons_ratio_and_back():
    bulk_modulus = chosen_bulk_modulus(10e3, None, 0.45)
    assert bulk_modulus == pytest.approx(2 * 10e3 * 1.45 / (3 * 0.1))
    rest = linearise(10e3, bulk_modulus, None, 1000.0)
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


def test_uniaxial_strain_has_its_closed_form_and_the_energy_is_that_of_the_invariants():
    """Sides held: sigma = G/J (lambda^2 - 1) + lambda_1 ln J / J along the axis, lambda_1 ln J / J across."""
    law, stretch = NeoHookean(34e3, 0.4, 1000.0), np.array([0.6, 1.7])
    log_strain = np.stack([np.log(stretch), 0 * stretch, 0 * stretch], axis=1)
    cauchy = law.kirchhoff_stress(log_strain) / stretch[:, None]
    pressure = law.first_lame * np.log(stretch) / stretch
    np.testing.assert_allclose(cauchy[:, 0], law.shear_modulus * (stretch**2 - 1) / stretch + pressure, rtol=1e-13)
    np.testing.assert_allclose(cauchy[:, 1], pressure, rtol=1e-13)
    law = fs.MooneyRivlin(c10=10e3, c01=3e3, density=1000.0, bulk_modulus=1e6)
    squares = np.exp(2.0 * (STRAINS - STRAINS.mean(axis=1, keepdims=True)))
    first, second = squares.sum(axis=1), (1.0 / squares).sum(axis=1)
    expected = 10e3 * (first - 3.0) + 3e3 * (second - 3.0) + 0.5e6 * STRAINS.sum(axis=1) ** 2
    np.testing.assert_allclose(law.stored_energy(STRAINS), expected, rtol=1e-12)


def test_mooney_rivlin_has_the_closed_forms_of_rubber():
    """sigma = 2 (l^2 - 1/l) (c10 + c01/l) uniaxially, 2 (l^2 - l^-4) (c10 + c01 l^2) equibiaxially, for a stretch l."""
    law, stretch = MooneyRivlin(8e3, 1000.0, 3e3, poisson_ratio=0.49), np.array([0.6, 1.3, 2.0])
    for along, aside, through, expected in (
        (stretch, stretch**-0.5, stretch**-0.5, 2 * (stretch**2 - 1 / stretch) * (8e3 + 3e3 / stretch)),
        (stretch, stretch, stretch**-2, 2 * (stretch**2 - stretch**-4) * (8e3 + 3e3 * stretch**2)),
    ):
        stress = law.kirchhoff_stress(np.log(np.stack([along, aside, through], axis=1)))
        # No pressure changes differences.
        np.testing.assert_allclose(stress[:, 0] - stress[:, 2], expected, rtol=1e-12)
        same = 0.0 if np.array_equal(aside, through) else expected
        np.testing.assert_allclose(stress[:, 1] - stress[:, 2], same, rtol=1e-12, atol=1e-8)


def test_growing_bulk_modulus_is_the_incompressible_limit():
    """Stretched along one axis with free sides, ln J is a third of the stress along the axis over the bulk modulus."""
    stretch = 1.5
    for bulk_modulus in (1e6, 1e7):
        law, log_volume = Ogden((OgdenTerm(10e3, 2.0),), 1000.0, bulk_modulus=bulk_modulus), 0.0
        for _ in range(50):
            aside = (log_volume - np.log(stretch)) / 2
            shape = law.kirchhoff_stress(np.array([[np.log(stretch), aside, aside]]))[0] - bulk_modulus * log_volume
            log_volume = -shape[1] / bulk_modulus
        expected = 10e3 * (stretch**2 - 1 / stretch) / (3 * bulk_modulus)
        assert log_volume == pytest.approx(expected, rel=3e4 / bulk_modulus)


@pytest.mark.parametrize("law", [NeoHookean(34e3, 0.45, 1000.0), MooneyRivlin(8e3, 1000.0, 3e3, poisson_ratio=0.49)])
def test_simple_shear_needs_the_modulus_at_rest_and_normal_stresses(law):
    """Of the shear k: tau_xy = G k for every shear, and tau_xx - tau_yy = G k^2."""
    shear = 0.8
    deformation = np.array([[1.0, shear, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    squares, axes = np.linalg.eigh(deformation @ deformation.T)
    stress = axes @ np.diag(law.kirchhoff_stress(0.5 * np.log(squares)[None])[0]) @ axes.T
    assert stress[0, 1] == pytest.approx(law.shear_modulus * shear, rel=1e-12)
    assert stress[0, 0] - stress[1, 1] == pytest.approx(law.shear_modulus * shear**2, rel=1e-12)
    assert stress[[0, 1], [2, 2]] == pytest.approx(0.0, abs=1e-9 * law.shear_modulus)


def test_uniaxial_and_equibiaxial_tests_have_their_closed_forms():
    """sigma = sum mu (lambda^alpha - lambda^(-alpha/2)), and with lambda^(-2 alpha) in the equibiaxial test."""
    terms, stretch = ((2e3, 1.3), (50.0, 5.0), (-100.0, -2.0)), np.array([0.7, 1.8])
    law = Ogden(tuple(OgdenTerm(*term) for term in terms), 1000.0, poisson_ratio=0.49)
    for others, power in (((-0.5, -0.5), -0.5), ((1.0, -2.0), -2.0)):
        log_strain = np.log(stretch)[:, None] * np.array([1.0, *others])
        stress = law.kirchhoff_stress(log_strain)
        expected = sum(mu * (stretch**alpha - stretch ** (power * alpha)) for mu, alpha in terms)
        np.testing.assert_allclose(stress[:, 0] - stress[:, 2], expected, rtol=1e-12)


def test_neo_hookean_is_the_case_of_one_term_where_the_volume_stays():
    """Of changes of shape alone; compressible neo-Hookean has another energy of shape where the volume changes."""
    shape = STRAINS - STRAINS.mean(axis=1, keepdims=True)
    law = NeoHookean(34e3, 0.48, 1000.0)
    ogden = Ogden((OgdenTerm(law.shear_modulus, 2.0),), 1000.0, poisson_ratio=0.48)
    np.testing.assert_allclose(*(deviator(own.kirchhoff_stress(shape)) for own in (law, ogden)), rtol=1e-12)
    np.testing.assert_allclose(law.stored_energy(shape), ogden.stored_energy(shape), rtol=1e-12)
    assert ogden.at_rest().youngs_modulus == pytest.approx(34e3)


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
