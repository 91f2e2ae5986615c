"""As many vibrations as the tolerance needs; the mesh, and a word in the log, where they do not suffice."""

from __future__ import annotations

import contextlib
import dataclasses
import logging

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.reduced import march
from fingerslip.dynamics.reduced.reduction import interface_unknowns
from fingerslip.dynamics.system.system import build_system
from fingerslip.errors import ConvergenceError
from fingerslip.history import VARIABLES
from problems.pushed import push_and_slide
from problems.reduced import REDUCED, deep_push_and_slide


class Memory:
    """A store that counts what it is asked."""

    def __init__(self):
        self.kept, self.loads, self.saves = {}, 0, 0

    def load(self, key):
        self.loads += 1
        return self.kept.get(key)

    def save(self, key, arrays):
        self.saves += 1
        self.kept[key] = dict(arrays)

    def alone(self, key):  # noqa: ARG002
        return contextlib.nullcontext()


def with_basis(tolerance=1e-3, **changes):
    return deep_push_and_slide(basis=fs.ReducedBasis(tolerance, 0.5), **changes)


def is_on_the_mesh(model, caplog, match):
    """Tell whether a motion is that on the mesh, bit by bit, with a reason in the log."""
    caplog.set_level(logging.WARNING, "fingerslip")
    found, plain = fs.simulate(model), fs.simulate(dataclasses.replace(model, basis=None))
    for name in set(VARIABLES) & set(plain.data_vars):
        np.testing.assert_array_equal(found[name].values, plain[name].values, err_msg=name)
    reasons = [record.message for record in caplog.records if record.message.startswith("no reduced basis: ")]
    return found.attrs["basis"] == "full" and any(match in reason for reason in reasons)


def test_a_history_says_which_basis_it_has():
    model = with_basis()
    attrs = fs.simulate(model).attrs
    assert attrs["basis"] == "reduced"
    assert attrs["basis_vibrations"] == 40
    assert attrs["basis_static_responses"] == interface_unknowns([build_system(model)]).size
    assert 0.0 < attrs["basis_error"] < 1e-3
    assert attrs["basis_highest_frequency"] > 100.0
    assert attrs["condensation"].startswith("reduced basis")
    assert fs.simulate(deep_push_and_slide()).attrs["basis"] == "full"


def test_vibrations_are_added_until_they_suffice(monkeypatch):
    monkeypatch.setattr(march, "_FEWEST", 4)
    loose = fs.simulate(with_basis(0.5)).attrs
    tight = fs.simulate(with_basis(0.3 * loose["basis_error"])).attrs
    assert loose["basis_vibrations"] in {4, 8}
    assert tight["basis_vibrations"] in {16, 32, 64}
    assert tight["basis_error"] <= 0.3 * loose["basis_error"]


def test_the_first_of_several_motions_tries_a_basis_out_for_all(monkeypatch):
    marched, attempt = [], march._attempt

    def counting(motions, maker, basis):
        marched.append((len(motions.models), basis.frequencies.size))
        return attempt(motions, maker, basis)

    monkeypatch.setattr(march, "_FEWEST", 4)
    loose = fs.simulate(with_basis(0.5)).attrs["basis_error"]
    monkeypatch.setattr(march, "_attempt", counting)
    model, store = with_basis(0.3 * loose), Memory()
    fs.simulate_together([model, model], bases=store)
    *tried, last = marched
    assert {count for count, _ in tried} == {1}
    assert len(tried) > 1
    assert last == (2, tried[-1][1])
    assert store.saves == 1
    marched.clear()
    fs.simulate_together([model, model], bases=store)
    assert marched == [last]


def test_a_tolerance_that_is_not_reached_leaves_the_mesh(caplog):
    assert is_on_the_mesh(with_basis(1e-14), caplog, "and the tolerances are 1e-14 and 0.5")


@pytest.mark.parametrize(
    ("tried", "promising"),
    [
        ([(20, 1e9)], True),
        ([(20, 32.0), (40, 7.9)], True),
        ([(20, 32.0), (40, 8.1)], True),
        ([(20, 16.1), (40, 8.1)], False),
        ([(20, 2.0), (40, 2.0)], False),
        ([(30, 2.0), (30, 2.0)], False),
        ([(320, 1.1)], False),
        ([(20, 1e3), (320, 1.1)], False),
    ],
)
def test_more_vibrations_are_tried_while_they_may_help(tried, promising):
    assert march._is_promising(tried) is promising


@pytest.mark.parametrize(
    ("count", "excess", "wanted"), [(20, 1.1, 40), (20, 3.0, 80), (20, 1e6, 160), (160, 5.0, 320), (320, 2.0, 320)]
)
def test_the_next_number_of_vibrations_follows_the_error(count, excess, wanted):
    assert march._next_count(count, excess) == wanted


def test_a_body_that_supports_do_not_hold_stays_on_the_mesh(caplog):
    model = with_basis(supports={"top": ("x",)}, programme=(fs.Press(0.1e-3, 4e-3),))
    assert is_on_the_mesh(model, caplog, "supports leave rigid motions free")


def test_a_plate_without_inertia_that_contact_alone_holds_stays_on_the_mesh(caplog):
    contact = fs.Contact("bottom", friction=fs.Coulomb(0.4), rigid_body="plate")
    plate = fs.RigidBody(1.0, free=("y",), loads=(fs.BodyLoad(y=1e-3),))
    time = fs.QuasiStatic(0.1, end=0.2)
    model = with_basis(contacts=(contact,), bodies={"plate": plate}, programme=(), time=time)
    assert is_on_the_mesh(model, caplog, "contact alone holds the rigid body 'plate' (y)")


def test_a_body_that_is_all_interface_stays_on_the_mesh(caplog):
    model = push_and_slide(basis=REDUCED, contacts=(), programme=(), time=fs.TimeStepping(5e-3, end=0.05))
    assert is_on_the_mesh(model, caplog, "0 of 72 unknowns are those of contact")


def test_a_basis_that_does_not_fit_into_the_memory_leaves_the_mesh(caplog, monkeypatch):
    monkeypatch.setattr(march, "available_memory", lambda: 1000)
    assert is_on_the_mesh(with_basis(), caplog, "and 1e-06 GB are available")


def test_contact_that_is_not_solved_in_the_basis_is_solved_on_the_mesh(caplog, monkeypatch):
    def fail(*_):
        raise ConvergenceError(0.1, 3, 1.0, 1e-10, "try again")

    monkeypatch.setattr(march, "_attempt", fail)
    assert is_on_the_mesh(with_basis(), caplog, "0.1 s")


def test_a_kept_basis_is_used_again():
    store, model = Memory(), with_basis()
    first = fs.simulate(model, bases=store)
    again = fs.simulate(dataclasses.replace(model, time=fs.TimeStepping(2.5e-3, -0.3)), bases=store)
    assert (store.loads, store.saves) == (2, 1)
    assert again.attrs["basis"] == "reduced"
    np.testing.assert_array_equal(
        fs.simulate(model, bases=store).contact_acceleration.values, first.contact_acceleration.values
    )


@pytest.mark.parametrize(
    "change",
    [
        {"materials": {"bulk": fs.Elastic(35e3, 0.4, 1000.0)}},
        {"materials": {"bulk": fs.Elastic(34e3, 0.4, 1001.0)}},
        {"supports": {"top": ("x", "y"), "left": ("x",)}},
        {"record": fs.Recording()},
        {"gravity": (0.0, -1.0)},
    ],
)
def test_another_body_needs_another_basis(change):
    store = Memory()
    fs.simulate(with_basis(), bases=store)
    fs.simulate(with_basis(**change), bases=store)
    assert store.saves == 2


def test_a_basis_that_does_not_suffice_is_not_kept():
    store = Memory()
    fs.simulate(with_basis(1e-14), bases=store)
    assert store.saves == 0


def test_models_of_other_bases_are_not_computed_together():
    model = with_basis()
    with pytest.raises(fs.InputError, match=r"models.1.basis: differs"):
        fs.simulate_together([model, dataclasses.replace(model, basis=None)])


def test_accelerations_have_a_tolerance_of_their_own(monkeypatch):
    monkeypatch.setattr(march, "_FEWEST", 4)
    loose = fs.simulate(deep_push_and_slide(alpha=-0.3, basis=fs.ReducedBasis(0.5, 0.99))).attrs
    wanted = 0.3 * loose["basis_acceleration_error"]
    tight = fs.simulate(deep_push_and_slide(alpha=-0.3, basis=fs.ReducedBasis(0.5, wanted))).attrs
    assert loose["basis_vibrations"] == 4 < tight["basis_vibrations"]
    assert tight["basis_acceleration_error"] <= wanted
