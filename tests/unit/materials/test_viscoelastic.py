"""Prony terms: their recurrence, small and large strain."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fingerslip as fs
from fingerslip.materials.large_strain import log_volume_of
from fingerslip.materials.prony import check_prony, recurrence, relaxation
from fingerslip.materials.relaxing import StepLaw, shape_energy, shape_stress, spring_strain, volume_part
from fingerslip.materials.viscoelastic import Relaxed, across_of, stored_energy, stress, with_across
from unit.fe.finite.bodies import LAWS, SOFT

TERMS = (fs.PronyTerm(0.3, 0.1), fs.PronyTerm(0.2, 2.0))


def history_of(follows, fields):
    """Return the histories (1 + t, n_times, ...) of fields (n_times, ...) at equal steps from rest."""
    steps = [np.zeros((1 + len(follows.shares), *fields.shape[1:]))]
    for field in fields[1:]:
        steps.append(follows.follow(steps[-1], field))
    return np.stack(steps, axis=1)


def follow_strains(material, strains, formulation, step):
    """Return strains (n_times, ..., m) at equal steps from rest, with their dashpots, in 3D."""
    follows = recurrence(material.prony, step)
    histories = history_of(follows, strains)
    across = np.zeros_like(histories[..., 0])
    if formulation == "plane_stress":
        now, earlier = across_of(material.poisson_ratio).of_step(follows.taken_share)
        along = histories[..., :2].sum(axis=-1)
        for end in range(1, len(strains)):
            left, left_across = (follows.left(field[:, end - 1]) for field in (along, across))
            thin = now * along[0, end] + earlier * (left + 2.0 * left_across)
            across[:, end] = follows.follow(across[:, end - 1], thin)
    whole = with_across(histories, -across)
    return Relaxed(whole[0], whole[1:])


def test_modulus_falls_from_all_to_what_never_relaxes_and_the_recurrence_takes_fields():
    times = np.array([0.0, 0.1, 1e6])
    expected = [1.0, 0.5 + 0.3 * np.exp(-1.0) + 0.2 * np.exp(-0.05), 0.5]
    np.testing.assert_allclose(relaxation(TERMS, times), expected, rtol=1e-12)
    follow = recurrence(TERMS, 0.1)
    strains = np.random.default_rng(0).normal(size=(6, 4, 3))
    strains[0] = 0.0
    found = history_of(follow, strains)[1:]
    assert found.shape == (2, 6, 4, 3)
    expected = follow.end[0] * strains[1] + follow.start[0] * strains[0]
    np.testing.assert_allclose(found[0, 1], expected)
    left = follow.left(np.stack([strains[1], *found[:, 1]]))
    np.testing.assert_allclose(left, np.tensordot(follow.shares, found[:, 2], 1) - follow.taken_share * strains[2])


@pytest.mark.parametrize("step", [0.01, 0.1, 0.2])
def test_recurrence_is_exact_where_strain_is_linear_in_a_step(step):
    """Of a strain that grows at rate 1 the dashpot is t - tau (1 - exp(-t/tau))."""
    times = step * np.arange(50)
    found = history_of(recurrence(TERMS, step), times)[1:]
    for term, dashpot in zip(TERMS, found, strict=True):
        np.testing.assert_allclose(dashpot, times + term.time * np.expm1(-times / term.time), rtol=1e-10, atol=1e-15)


@pytest.mark.parametrize(
    ("share", "time", "message"),
    [(0.0, 1.0, "share: got 0"), (1.0, 1.0, "share: got 1"), (0.3, 0.0, "time"), (0.3, -1.0, "time")],
)
def test_impossible_terms_are_refused(share, time, message):
    with pytest.raises(fs.InputError, match=message):
        fs.PronyTerm(share, time)


@pytest.mark.parametrize(
    "make",
    [
        lambda terms: fs.Elastic(1e3, 0.4, 1.0, prony=terms),
        lambda terms: fs.NeoHookean(1e3, 0.4, 1.0, prony=terms),
        lambda terms: fs.MooneyRivlin(1e3, 1.0, poisson_ratio=0.4, prony=terms),
        lambda terms: fs.Ogden((fs.OgdenTerm(1e3, 2.0),), 1.0, poisson_ratio=0.4, prony=terms),
    ],
)
def test_every_law_takes_terms_and_hands_them_to_small_strain(make):
    law = make(TERMS)
    assert (law if isinstance(law, fs.Elastic) else law.at_rest()).prony == TERMS
    with pytest.raises(fs.InputError, match=r"prony: has shares with a sum of 1\.2, needs a sum < 1"):
        make((fs.PronyTerm(0.6, 1.0), fs.PronyTerm(0.6, 2.0)))


def test_steps_may_be_short_and_relaxation_is_not_faster_than_half_of_one_unless_it_is_controlled():
    short = recurrence((fs.PronyTerm(0.3, 1e6),), 1e-6)
    assert (short.end[0], short.start[0]) == pytest.approx((0.5e-12, 0.5e-12), rel=1e-3), "no digits are left out"
    check_prony((fs.PronyTerm(0.5, 1.0), fs.PronyTerm(0.49, 1.0)))
    recurrence((fs.PronyTerm(0.3, 0.05),), 0.1)
    message = "materials.skin.prony.2.time: got 0.04 s for a step of 0.1 s, needs at least 0.05 s, half"
    with pytest.raises(fs.InputError, match=message):
        recurrence((*TERMS, fs.PronyTerm(0.1, 0.04)), 0.1, "materials.skin.prony")
    long = recurrence((fs.PronyTerm(0.3, 1e-3),), 10.0, controlled=True)
    assert history_of(long, np.array([0.0, 1.0, 1.0]))[1] == pytest.approx([0.0, 1.0 - 1e-4, 1.0], abs=1e-12)


EVERY_LAW = pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)


def strains(count=20, size=0.3, seed=1):
    return np.random.default_rng(seed).uniform(-size, size, (count, 3))


@EVERY_LAW
def test_volume_and_shape_make_up_the_law(law):
    strain, step = strains(), 1e-6
    volume = log_volume_of(strain)
    energy, slope, curvature = volume_part(law, volume)
    np.testing.assert_allclose(energy + shape_energy(law, strain), law.stored_energy(strain))
    np.testing.assert_allclose(shape_stress(law, strain) + slope[:, None], law.kirchhoff_stress(strain))
    ahead, back = (volume_part(law, volume + sign * step) for sign in (1, -1))
    np.testing.assert_allclose((ahead[0] - back[0]) / 2 / step, slope, atol=1e-8)
    np.testing.assert_allclose((ahead[1] - back[1]) / 2 / step, curvature, atol=1e-7)
    assert volume_part(law, np.zeros(1))[2][0] == pytest.approx(law.at_rest().bulk_modulus)


@EVERY_LAW
def test_law_of_a_step_has_the_elastic_law_as_its_limits_and_its_tangent_is_the_derivative_of_its_stress(law):
    strain, step = strains(), 1e-6
    np.testing.assert_array_equal(
        StepLaw(law, 0.0, np.zeros(20)).kirchhoff_stress(strain), law.kirchhoff_stress(strain)
    )
    nothing = StepLaw(law, 1.0, np.full(20, 0.2)).kirchhoff_stress(strain)
    np.testing.assert_allclose(nothing, np.tile(volume_part(law, log_volume_of(strain))[1][:, None] - 0.2, 3))
    own = StepLaw(law, 0.4, np.linspace(0.0, 1.0, 20))
    tangent = own.kirchhoff_tangent(strain)
    for axis in range(3):
        change = step * np.eye(3)[axis]
        slope = (own.kirchhoff_stress(strain + change) - own.kirchhoff_stress(strain - change)) / 2 / step
        np.testing.assert_allclose(tangent[:, :, axis], slope, atol=1e-6 * np.abs(tangent).max())


@settings(max_examples=60)
@given(
    law=st.sampled_from(LAWS), parts=st.lists(st.floats(-0.6, 0.6), min_size=3, max_size=3), share=st.floats(0.0, 1.0)
)
def test_a_spring_has_the_stress_that_was_given(law, parts, share):
    strain = np.array([parts])
    stress = share * (law.kirchhoff_stress(strain) - law.kirchhoff_stress(strain).mean())
    volume = log_volume_of(strain)
    found = spring_strain(law, stress, volume, np.zeros((1, 3)))
    again = law.kirchhoff_stress(found)
    np.testing.assert_allclose(again - again.mean(), stress, atol=1e-8 * max(1.0, np.abs(stress).max()))
    np.testing.assert_allclose(log_volume_of(found), volume, atol=1e-12)
    if share == 1.0:
        np.testing.assert_allclose(found, strain, atol=1e-6)


class _Yielding:
    """A law whose stress has a limit."""

    def at_rest(self):
        return SOFT.at_rest()

    def kirchhoff_stress(self, strain):
        return np.tanh(strain)

    def kirchhoff_tangent(self, strain):
        return np.einsum("ni,ij->nij", np.cosh(strain) ** -2, np.eye(3))


def test_a_stress_that_no_strain_has_is_an_error():
    with pytest.raises(fs.FingerslipError, match="_Yielding: the strain of a spring of a Prony term was not found"):
        spring_strain(_Yielding(), np.array([[3.0, -1.5, -1.5]]), np.zeros(1), np.zeros((1, 3)))


PRONY = (fs.PronyTerm(0.3, 0.1), fs.PronyTerm(0.4, 1.0))

LAW = fs.Elastic(34e3, 0.4, 1000.0, prony=PRONY)

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
    whole = with_across(strains, across)
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
    whole = with_across(strains)
    fine = (np.arange(2000) + 0.5) / 2000
    later = STEP * (len(strains) - 1 - np.arange(len(strains) - 1))
    kernel = np.array([relaxation(PRONY, end - STEP * fine).mean() for end in later])
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
    left = 1 - sum(term.share for term in PRONY)
    bulk, shear = 34e3 / (3 * (1 - 0.8)), left * LAW.shear_modulus
    young = 9 * bulk * shear / (3 * bulk + shear)
    slow = fs.Elastic(young, young / (2 * shear) - 1, 1000.0)
    assert energy[-1] == pytest.approx(slow.energy(strains[-1], formulation)[0], rel=1e-9)
    assert (np.diff(energy[1:]) <= 1e-12 * energy[1]).all()


def test_incompressible_plane_stress_is_computed():
    law = fs.Elastic(34e3, 0.5, 1000.0, prony=PRONY)
    strains = history("plane_stress")
    found = stress(law, follow_strains(law, strains, "plane_stress", STEP))
    nearly = fs.Elastic(34e3, 0.4999999, 1000.0, prony=PRONY)
    expected = stress(nearly, follow_strains(nearly, strains, "plane_stress", STEP))
    np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max())
