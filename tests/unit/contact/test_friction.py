"""Friction laws: coefficients in closed form, the frames in which they hold, and values that they refuse."""

import dataclasses

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.contact.friction import Conditions, TangentFrame, weakens
from fingerslip.parameters import from_mapping

LAWS = {
    "coulomb": fs.Coulomb(0.4),
    "static-kinetic": fs.StaticKinetic(0.8, 0.3, 2e-3),
    "pressure": fs.PressureDependent(0.5, 1e4, -1 / 3),
    "weakening": fs.SlipWeakening(0.8, 0.3, 2e-5),
    "time": fs.TimeDependent((1.0, 2.0), (0.6, 0.3)),
    "anisotropic": fs.Anisotropic(0.4, 0.8, (0.0, 1.0, 0.0)),
}


def conditions(count=1, time=1.0, **values):
    """Return conditions at nodes in which everything that is not given is one."""
    names = ("pressure", "slip_rate", "slip_since_contact")
    return Conditions(*(np.array(values.get(name, np.ones(count))) for name in names), time=time)


@pytest.mark.parametrize(
    ("law", "at", "expected"),
    [
        ("coulomb", {"count": 2}, [0.4, 0.4]),
        ("static-kinetic", {"slip_rate": [0.0, 2e-3, 1.0]}, [0.8, 0.3 + 0.5 / np.e, 0.3]),
        ("pressure", {"pressure": [8e4, 1e4, 0.0]}, [0.25, 0.5, 0.5 * 100 ** (1 / 3)]),
        ("weakening", {"slip_since_contact": [0.0, 0.5e-5, 2e-5, 1.0]}, [0.8, 0.675, 0.3, 0.3]),
        ("time", {"time": 0.0}, [0.6]),
        ("time", {"time": 1.5, "count": 2}, [0.45, 0.45]),
        ("time", {"time": 9.0}, [0.3]),
        ("anisotropic", {"count": 2}, [0.4, 0.4]),
    ],
)
def test_coefficients_are_those_of_the_formula(law, at, expected):
    np.testing.assert_allclose(LAWS[law].coefficients(conditions(**at)), expected, rtol=1e-12)


def test_isotropic_laws_hold_in_2d_and_3d_along_any_tangent_and_anisotropic_ones_in_3d_in_their_own_frame():
    for name, law in LAWS.items():
        own = name == "anisotropic"
        assert law.dims == ((3,) if own else (2, 3))
        assert law.frame == (TangentFrame((0.0, 1.0, 0.0), 2.0) if own else TangentFrame(direction=None, stretch=1.0))
    # The coefficient is that before anything changes it; contact without friction is allowed.
    assert [law.coefficient for law in LAWS.values()] == [0.4, 0.8, 0.5, 0.8, 0.6, 0.4]
    assert fs.Coulomb(0.0).coefficient == 0.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        LAWS["coulomb"].coefficient = 1.0


def test_friction_weakens_where_it_falls_with_slip_or_its_rate_under_conditions_that_may_be_of_some_nodes():
    never = fs.StaticKinetic(0.6, 0.6, 1e-3), fs.StaticKinetic(0.5, 0.6, 1e-3), fs.SlipWeakening(0.6, 0.6, 1e-5)
    others = (law for name, law in LAWS.items() if name not in {"static-kinetic", "weakening"})
    assert weakens(LAWS["static-kinetic"])
    assert weakens(LAWS["weakening"])
    assert not any(map(weakens, (*never, *others)))
    every = conditions(pressure=[1.0, 2.0, 3.0], slip_rate=[4.0, 5.0, 6.0], slip_since_contact=[7.0, 8.0, 9.0])
    some = every.at(np.array([True, False, True]))
    values = [array.tolist() for array in (some.pressure, some.slip_rate, some.slip_since_contact)]
    assert values == [[1, 3], [4, 6], [7, 9]]
    assert some.time == every.time


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fs.Coulomb(-0.2), r"Coulomb.coefficient: got -0.2, needs a number >= 0"),
        (lambda: fs.Coulomb(float("nan")), r"Coulomb.coefficient"),
        (lambda: fs.Coulomb(float("inf")), r"Coulomb.coefficient"),
        (lambda: fs.Coulomb("much"), r"Coulomb.coefficient"),
        (lambda: fs.SlipWeakening(0.8, 0.3, 0.0), r"SlipWeakening.distance: got 0"),
        (lambda: fs.Anisotropic(0.4, 0.8, (0.0, 0.0, 0.0)), "direction"),
        (lambda: fs.TimeDependent((), ()), r"TimeDependent.times: got \[\], needs ascending times"),
        (lambda: fs.TimeDependent((1.0, 1.0), (0.5, 0.5)), r"TimeDependent.times: got \[1.0, 1.0\], needs ascending"),
        (lambda: fs.TimeDependent((0.0, 1.0), (0.5,)), r"TimeDependent.values: got 1 for 2 times"),
        (lambda: fs.TimeDependent((0.0,), (-0.5,)), r"TimeDependent.values.*-0.5"),
    ],
)
def test_values_that_make_no_law_are_refused(make, message):
    with pytest.raises(fs.InputError, match=message):
        make()


@pytest.mark.parametrize(
    ("kind", "values", "law"),
    [
        (fs.Coulomb, {"coefficient": 0.6}, fs.Coulomb(0.6)),
        (fs.SlipWeakening, {"static": 0.8, "kinetic": 0.3, "distance": "20 um"}, fs.SlipWeakening(0.8, 0.3, 2e-5)),
        (fs.TimeDependent, {"times": ["0 s", "500 ms"], "values": [0.6, 0.3]},
         fs.TimeDependent((0.0, 0.5), (0.6, 0.3))),
    ],
)  # fmt: skip
def test_a_file_gives_lengths_and_times_with_units_and_coefficients_without(kind, values, law):
    assert from_mapping(kind, values, "f") == law
