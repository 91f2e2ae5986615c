"""A reduced basis moves as the mesh does, with as many modes as the tolerance needs, or leaves it to the mesh."""

import dataclasses
import logging

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.reduced import basis as bases
from fingerslip.history import VARIABLES
from problems.pushed import push_and_slide
from problems.reduced import (
    REDUCED,
    SITES,
    deep_push_and_slide,
    difference,
    random_model,
    with_damper,
    with_moving_support,
)
from unit.dynamics.models import ROUNDING, Memory, Watched, assert_same_history, contact, error_of

# What shows the acceleration that few normal modes give.
COARSE = {"velocity", "acceleration", "contact_velocity", "contact_acceleration", "snapshot_velocity"}
COARSE |= {"kinetic_energy", "numerical_dissipation"}
LOOSE = fs.ReducedBasis(0.5, 0.99)


def both(model, basis=REDUCED):
    """Return the history on the mesh and that in a reduced basis."""
    reduced = fs.simulate(dataclasses.replace(model, basis=basis))
    assert reduced.attrs["basis"] == "reduced"
    return fs.simulate(model), reduced


def with_basis(tolerance=1e-3, **changes):
    return deep_push_and_slide(basis=fs.ReducedBasis(tolerance, 0.5), **changes)


def test_everything_recorded_is_that_of_the_mesh():
    full, reduced = both(deep_push_and_slide(damping=fs.RayleighDamping(mass=2.0, stiffness=1e-4)))
    compared = 0
    for name in sorted(set(VARIABLES) - ROUNDING - {"contact_state"}):
        if full[name].size and np.abs(full[name].values).max():
            assert difference(reduced, full, name) < (5e-2 if name in COARSE else 1e-3), name
            compared += 1
    assert compared > 25
    np.testing.assert_array_equal(reduced.contact_state, full.contact_state)
    assert set(np.unique(full.contact_state)) == {0, 1, 2}
    assert np.abs(reduced.energy_imbalance.values).max() < 1e-10 * np.abs(reduced.external_work.values).max()


def test_quasi_static_motions_are_exact():
    model = deep_push_and_slide(
        time=fs.QuasiStatic(5e-3),
        gravity=(0.5, -2.0),
        tractions={"left": fs.Traction((0.0, 30.0), fs.Ramp((0.0, 0.1), (0.0, 1.0)))},
    )
    full, reduced = both(model)
    for name in set(VARIABLES) - ROUNDING:
        if full[name].size and np.abs(full[name].values.astype(float)).max() > 1e-14:
            assert difference(reduced, full, name) < 1e-7, name
    assert reduced.attrs["basis_error"] < 1e-9
    assert reduced.attrs["basis_acceleration_error"] == 0.0


DRIVEN = contact(drive=fs.Drive(mass=1e-3, force=2e-4))


@pytest.mark.parametrize(
    ("changes", "names", "tolerance"),
    [
        ({"contacts": DRIVEN, "programme": (fs.Hold(0.05), fs.Slide(0.2e-3, 4e-3))},
         ("counterface_displacement", "counterface_velocity", "counterface_force"), 1e-2),
        ({"record": fs.Recording()}, ("contact_displacement",), 1e-3),
    ],
    ids=["drive", "no sites"],
)  # fmt: skip
def test_drives_act_as_on_the_mesh_and_sites_are_not_needed(changes, names, tolerance):
    full, reduced = both(deep_push_and_slide(**changes))
    for name in names:
        assert np.abs(full[name].values[-1]).max() > 1e-9
        assert difference(reduced, full, name) < tolerance, name


def test_the_start_is_that_of_the_mesh():
    """To the rounding of what damping leaves of accelerations at the start, which no basis has exactly."""
    damping = fs.RayleighDamping(mass=2.0, stiffness=1e-3)
    model = deep_push_and_slide(gravity=(3.0, -9.81), initial_velocity=(0.01, -0.02), damping=damping)
    full, reduced = (history.isel(time=0) for history in both(model, LOOSE))
    for name in ("contact_acceleration", "acceleration", "contact_velocity", "velocity"):
        assert error_of(reduced, full, name) < 1e-6, name


@pytest.mark.parametrize("alpha", [-0.41421, -0.05])
def test_a_weight_that_starts_at_once_leaves_the_contact_its_acceleration(alpha):
    full, reduced = both(deep_push_and_slide(gravity=(0.0, -9.81), alpha=alpha), fs.ReducedBasis())
    error = np.linalg.norm((reduced - full).contact_acceleration) / np.linalg.norm(full.contact_acceleration)
    assert error < 5e-3


def test_motions_together_are_those_alone_and_are_judged_by_the_worst():
    """Each with its own friction, programme, counterface and sites."""
    first = deep_push_and_slide(friction=0.3, basis=LOOSE)
    slow = dataclasses.replace(first, programme=(fs.Press(0.2e-3, 4e-3), fs.Hold(0.1)))
    rough = dataclasses.replace(first, contacts=contact(friction=fs.Coulomb(0.6)), record=fs.Recording(SITES[1:]))
    models = [rough, first, slow]
    alone, together = [fs.simulate(model) for model in models], fs.simulate_together(models)
    worst = max(single.attrs["basis_acceleration_error"] for single in alone)
    for single, beside in zip(alone, together, strict=True):
        for name in ("displacement", "contact_acceleration", "counterface_force"):
            assert difference(beside, single, name) < 1e-3, name
        assert beside.attrs["basis_acceleration_error"] == pytest.approx(worst, rel=1e-2)


def errors(reduced, full):
    """Return the largest error of displacements, and the error of accelerations, at contact or sites."""
    names = "contact_displacement", "displacement"
    largest = max(np.abs(full[name].values).max() for name in names)
    moved = max(np.abs((reduced[name] - full[name]).values).max() for name in names)
    accelerations = ("contact_acceleration", "acceleration")
    norms = (np.linalg.norm(reduced[name] - full[name]) / np.linalg.norm(full[name]) for name in accelerations)
    return moved / largest, max(norms)


def compared(model, caplog):
    """Return errors and estimates, of displacements and accelerations; None where the mesh had to do it."""
    caplog.set_level(logging.WARNING, "fingerslip")
    reduced, full = fs.simulate(dataclasses.replace(model, basis=fs.ReducedBasis())), fs.simulate(model)
    if reduced.attrs["basis"] == "full":
        assert any("the motion is computed on the mesh" in record.message for record in caplog.records)
        return None
    estimates = (reduced.attrs["basis_error"], reduced.attrs["basis_acceleration_error"])
    return np.array([errors(reduced, full), estimates])


def check_estimates(models, caplog):
    """No error beyond its tolerance or three times its estimate; and which estimates are over three times as large."""
    pairs = [pair for model in models if (pair := compared(model, caplog)) is not None]
    error, estimate = np.stack(pairs, axis=1)
    basis = fs.ReducedBasis()
    assert (error <= (basis.tolerance, basis.acceleration_tolerance)).all()
    assert (error <= 3.0 * estimate + 1e-9).all()
    return estimate > 3.0 * error + 1e-9


def test_errors_are_within_three_times_their_estimates(caplog, monkeypatch):
    """Of models that move in a basis that leaves an error: with more modes those of small meshes are nearly whole."""
    monkeypatch.setattr(bases, "_FEWEST", 10)
    assert len(check_estimates(map(random_model, (0, 8, 9, 13)), caplog)) == 4


@pytest.mark.slow
def test_estimates_are_within_a_factor_of_three_for_any_model(caplog, monkeypatch):
    monkeypatch.setattr(bases, "_FEWEST", 10)
    too_large = check_estimates(map(random_model, range(60)), caplog)
    assert len(too_large) > 20
    # Too large an estimate only costs time. Which ones are depends on how the vectors of a basis are rounded.
    assert too_large.mean() < 0.2


@pytest.mark.slow
def test_estimates_hold_for_moving_supports_and_dampers(caplog, monkeypatch):
    monkeypatch.setattr(bases, "_FEWEST", 10)
    models = [*map(with_moving_support, (5, 8, 9, 13)), *map(with_damper, (0, 5, 8, 9))]
    assert len(check_estimates(models, caplog)) == 8


def test_a_history_says_which_basis_it_has_and_a_kept_basis_is_used_again():
    store, model = Memory(), with_basis()
    first = fs.simulate(model, bases=store)
    attrs = first.attrs
    assert (attrs["basis"], attrs["basis_normal_modes"]) == ("reduced", 40)
    assert attrs["basis_constraint_modes"] == 2 * attrs["n_contact_candidates"]
    assert 0.0 < attrs["basis_error"] < 1e-3
    assert attrs["basis_highest_frequency"] > 100.0
    assert attrs["condensation"].startswith("reduced basis")
    assert fs.simulate(deep_push_and_slide()).attrs["basis"] == "full"
    again = fs.simulate(dataclasses.replace(model, time=fs.TimeStepping(2.5e-3, -0.3)), bases=store)
    assert (store.loads, store.saves) == (2, 1)
    assert again.attrs["basis"] == "reduced"
    assert_same_history(fs.simulate(model, bases=store), first, 0.0)


@pytest.mark.parametrize("kind", ["basis_error", "basis_acceleration_error"])
def test_normal_modes_are_added_until_they_suffice_for_displacements_and_accelerations(kind, monkeypatch):
    monkeypatch.setattr(bases, "_FEWEST", 4)
    loose = fs.simulate(deep_push_and_slide(alpha=-0.3, basis=LOOSE)).attrs
    limits = (0.3 * loose[kind], 0.99) if kind == "basis_error" else (0.5, 0.3 * loose[kind])
    tight = fs.simulate(deep_push_and_slide(alpha=-0.3, basis=fs.ReducedBasis(*limits))).attrs
    assert loose["basis_normal_modes"] == 4 < tight["basis_normal_modes"] <= 64
    assert tight[kind] <= 0.3 * loose[kind]


def test_the_more_normal_modes_the_nearer(monkeypatch):
    full, moved = fs.simulate(deep_push_and_slide()), []
    for count in (5, 40, 160):
        monkeypatch.setattr(bases, "_FEWEST", count)
        reduced = fs.simulate(deep_push_and_slide(basis=LOOSE))
        assert reduced.attrs["basis_normal_modes"] == count
        moved.append(difference(reduced, full, "displacement"))
    assert moved[0] > 2.0 * moved[1] > 2.0 * moved[2]
    assert moved[2] < 1e-5
    assert difference(reduced, full, "contact_acceleration") < 1e-3


def test_the_first_of_several_motions_tries_a_basis_out_for_all(monkeypatch):
    """Progress goes back to the start with every attempt; a basis that is kept suffices at once."""
    monkeypatch.setattr(bases, "_FEWEST", 4)
    loose = fs.simulate(with_basis(0.5)).attrs["basis_error"]
    model, store = with_basis(0.3 * loose), Memory()
    attempts = []
    for _ in range(2):
        told = []
        fs.simulate_together([model, model], bases=store, progress=told.append)
        attempts.append(told.count(1.0))
    assert attempts[0] > 2
    assert attempts[1] == 1
    assert store.saves == 1


def test_the_first_of_several_motions_leaves_room_for_the_errors_of_the_others(monkeypatch):
    monkeypatch.setattr(bases, "_FEWEST", 4)
    loose = fs.simulate(with_basis(0.5)).attrs
    model, modes = with_basis(1.3 * loose["basis_error"]), loose["basis_normal_modes"]
    assert fs.simulate(model).attrs["basis_normal_modes"] == modes
    assert fs.simulate_together([model, model])[0].attrs["basis_normal_modes"] == 2 * modes


def test_what_rings_begins_with_twice_as_many_normal_modes_and_several_motions_of_it_with_four_times(monkeypatch):
    monkeypatch.setattr(bases, "_FEWEST", 8)
    counts = {}
    for alpha in (-0.05, -0.4):
        model = deep_push_and_slide(alpha=alpha, basis=fs.ReducedBasis(0.5, 0.05), programme=SHORT["programme"])
        histories = fs.simulate(model), *fs.simulate_together([model, model])
        counts[alpha] = [history.attrs["basis_normal_modes"] for history in histories]
    assert counts == {-0.05: [16, 32, 32], -0.4: [8, 8, 8]}


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
    """All nodes are candidates, so that loads make no others of them."""
    store, still = Memory(), {"contacts": contact(search_distance=1.0), "time": fs.TimeStepping(5e-3, end=0.05)}
    for changes in ({}, change):
        assert fs.simulate(with_basis(**changes, **still), bases=store).attrs["basis"] == "reduced"
    assert store.saves == 2


# Where a basis is not the way, the motion is that on the mesh, bit by bit, with a reason in the log.

HANGING = {
    "contacts": contact(rigid_body="plate"),
    "bodies": {"plate": fs.RigidBody(1.0, free=("y",), loads=(fs.BodyLoad(y=1e-3),))},
    "programme": (),
    "time": fs.QuasiStatic(0.1, end=0.2),
}
SHORT = {"programme": (fs.Press(0.1e-3, 4e-3),)}
SOFTENING = fs.Elastic(34e3, 0.4, 1000.0, prony=(fs.PronyTerm(0.3, 0.05),))
DAMPED = {**HANGING, "bodies": {"plate": dataclasses.replace(HANGING["bodies"]["plate"], dampers=fs.Dampers(y=1.0))}}
# Without the responses at its sites it needs 0.0001 GB.
ALONG = tuple(fs.Site(f"site {x:.3g}", "", (x, 2e-3)) for x in np.linspace(-3e-3, 3e-3, 13))
MANY_SITES = deep_push_and_slide(record=fs.Recording(ALONG), basis=fs.ReducedBasis(0.5, 0.02), **SHORT)
ALONE = {"contacts": (), "programme": (), "time": fs.TimeStepping(5e-3, end=0.05)}


LEFT_TO_THE_MESH = {
    "tolerance": (with_basis(1e-14), {}, "and the tolerances are 1e-14 and 0.5"),
    "more and more": (with_basis(1e-14), {"_FEWEST": 4}, "and the tolerances are 1e-14 and 0.5"),
    "free": (with_basis(**SHORT, supports={"top": ("x",)}), {}, "supports leave rigid motions free"),
    "held by contact": (with_basis(**HANGING), {}, "contact alone holds the rigid body 'plate' (y)"),
    "relaxing": (with_basis(**SHORT, materials={"bulk": SOFTENING}), {}, "materials relax"),
    "damped": (with_basis(**DAMPED), {}, "dampers alone hold a rigid body"),
    "no interface": (push_and_slide(basis=REDUCED, **ALONE), {}, "0 of 72 unknowns are those of contact"),
    "memory": (with_basis(), {"available_memory": lambda: 1000}, "and 1e-06 GB are available"),
    "sites": (MANY_SITES, {"available_memory": lambda: 300_000}, "needs about 0.00045 GB, and 0.0003 GB are available"),
}


@pytest.mark.parametrize(("model", "patches", "reason"), LEFT_TO_THE_MESH.values(), ids=LEFT_TO_THE_MESH)
def test_where_a_basis_does_not_do_the_motion_is_that_on_the_mesh(model, patches, reason, caplog, monkeypatch):
    for name, value in patches.items():
        monkeypatch.setattr(bases, name, value)
    caplog.set_level(logging.WARNING, "fingerslip")
    store = Memory()
    found, plain = fs.simulate(model, bases=store), fs.simulate(dataclasses.replace(model, basis=None))
    assert found.attrs["basis"] == "full"
    assert_same_history(found, plain, 0.0)
    assert any(text.startswith("no reduced basis: ") and reason in text for text in caplog.messages), caplog.messages
    assert not store.saves, "a basis that does not suffice is not kept"


def test_contact_that_is_not_solved_in_the_basis_is_solved_on_the_mesh(caplog):
    law = Watched(fails=lambda _: len(law.seen) == 1)
    assert fs.simulate(with_basis(contacts=contact(friction=law))).attrs["basis"] == "full"
    assert "no reduced basis: contact at t = 0.005 s, node 7" in caplog.text
