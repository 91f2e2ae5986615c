"""Steps on the contact nodes alone give what the full system gives, and motions together are those alone."""

import dataclasses
import threading
from collections import Counter

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.step import sharing
from fingerslip.dynamics.step.sharing import groups_to_share
from fingerslip.linear import resources as threads
from fingerslip.linear.solvers.superlu import SuperLU
from problems.matrices import EXACT, needs_mkl
from problems.pushed import pad, push_and_slide
from problems.verification.condensed import compared
from unit.dynamics.models import Watched, assert_same_history, contact, error_of, pressed_pad

SOLVERS = [pytest.param(EXACT, marks=needs_mkl, id="pardiso"), pytest.param(SuperLU(), id="superlu")]


@pytest.mark.parametrize("element", ["Q4", *(pytest.param(other, marks=pytest.mark.slow) for other in ("T3", "T6"))])
@pytest.mark.parametrize("solver", SOLVERS)
def test_condensed_solution_is_the_full_solution(element, solver):
    """Which Newton's method finds on all degrees of freedom, to rounding: open, sticking and slipping nodes."""
    assert not [check for check in compared(element, "selective", solver) if not check.holds]


TABLE = fs.RigidBody(1e-3, free=("y", "rz"), centre=(0.0, -2e-3), inertia=(1e-8,), springs=fs.Springs(y=5.0, rz=1e-3))


def curved(**changes):
    return contact(counterface=fs.Cylinder(20e-3, centre=(0.0, -20e-3)), **changes)


@pytest.mark.parametrize(
    "changes",
    [
        {"mesh": pad("Q4", columns=16)},
        {"contacts": curved(drive=fs.Drive(1e-3, 2e-4)), "programme": (fs.Hold(0.05), fs.Slide(0.2e-3, 4e-3))},
        {
            "contacts": curved(rigid_body="table"),
            "bodies": {"table": dataclasses.replace(TABLE, loads=(fs.BodyLoad(y=0.01, rz=2e-5),))},
            "programme": (),
            "time": fs.TimeStepping(1e-3, end=0.05),
        },
    ],
    ids=["nodes that leave", "drive", "turning body"],
)
@needs_mkl
def test_halves_of_one_substitution_and_two_substitutions_move_in_the_same_way(changes):
    one, two = (fs.simulate(push_and_slide(**changes), solver=solver) for solver in (EXACT, SuperLU()))
    assert one.attrs["condensation"] != two.attrs["condensation"]
    assert one.contact_state.values.any()
    for name in ("contact_displacement", "contact_acceleration", "normal_traction", "tangential_traction"):
        assert error_of(two, one, name) <= 1e-8, name


@needs_mkl
@pytest.mark.usefixtures("as_large")
def test_the_next_step_corrects_what_factors_of_single_precision_miss_and_static_steps_have_exact_ones():
    rough, exact = (fs.simulate(push_and_slide(), solver=solver) for solver in (None, SuperLU()))
    assert rough.attrs["condensation"].endswith("single precision")
    static = fs.simulate(push_and_slide(time=fs.QuasiStatic(5e-3)))
    for other in (exact, static):
        assert not other.attrs["condensation"].endswith("single precision")
    for name, share in {"contact_displacement": 1e-6, "contact_acceleration": 1e-3, "counterface_force": 1e-5}.items():
        assert error_of(rough, exact, name) <= share, name
    assert rough.contact_residual.values.max() <= 1e-12, "the law of contact holds in double precision all the same"
    largest = float(exact["external_work"].max())
    assert float(np.abs(rough["energy_imbalance"]).max()) <= 1e-6 * largest


PRESS = fs.Press(2e-4, 4e-3)


def models():
    """Return models that slide to either side, with other friction, deeper, for longer, and under gravity."""
    first = push_and_slide(programme=(PRESS, fs.Slide(4e-4, 4e-3)))
    back = dataclasses.replace(first, programme=(PRESS, fs.Slide(4e-4, 4e-3, (-1.0, 0.0))))
    rough = dataclasses.replace(first, contacts=contact(friction=fs.Coulomb(0.9)))
    deep = dataclasses.replace(first, programme=(fs.Press(4e-4, 4e-3), fs.Slide(6e-4, 4e-3)))
    heavy = dataclasses.replace(first, gravity=(0.0, -5.0))
    return [first, back, rough, deep, heavy]


def test_histories_are_those_of_single_simulations_and_progress_counts_the_longest_motion():
    seen = []
    together = fs.simulate_together(models(), solver=EXACT, progress=seen.append)
    assert seen[-1] == 1.0
    assert seen == sorted(seen)
    for model, history in zip(models(), together, strict=True):
        assert history.attrs["n_simulated_together"] == 5
        assert history.attrs["seconds_recording"] == together[0].attrs["seconds_recording"], "what all took"
        assert_same_history(history, fs.simulate(model, solver=EXACT))


@pytest.mark.slow
@needs_mkl
@pytest.mark.usefixtures("as_large")
def test_factors_of_single_precision_of_other_candidates_round_otherwise():
    """Alone a motion has its own candidates, and so factors of its own."""
    for model, history in zip(models(), fs.simulate_together(models()), strict=True):
        assert history.attrs["condensation"].endswith("single precision")
        assert_same_history(history, fs.simulate(model), 1e-4)


@pytest.mark.slow
def test_several_threads_find_the_same_contact_forces(monkeypatch):
    """The contact problems of different motions are solved side by side, by factors that they share at first."""
    monkeypatch.setattr("fingerslip.contact.solve.forces._FEW", 0)
    one_thread = fs.simulate_together(models())
    monkeypatch.setattr(threads, "usable_cores", lambda: 8)
    for alone, beside in zip(one_thread, fs.simulate_together(models(), threads=4), strict=True):
        assert_same_history(beside, alone)


@pytest.mark.parametrize(("wanted", "at_once"), [(1, 0), (4, 4), (8, 5)])
def test_threads_serve_a_whole_simulation_and_end_with_it(wanted, at_once, monkeypatch):
    """As many as there are motions at most; there may be fewer cores."""
    monkeypatch.setattr(threads, "usable_cores", lambda: 8)
    before, counts = threading.active_count(), []
    fs.simulate_together(models(), threads=wanted, progress=lambda _: counts.append(threading.active_count()))
    assert max(counts) - before == at_once
    assert threading.active_count() == before


def test_motions_are_computed_once_until_they_part():
    """Three directions press alike for 0.05 s, ten steps; then there are three motions, two of them twins."""

    def run(*numbers):
        law = Watched()
        group = [dataclasses.replace(models()[number], contacts=contact(friction=law)) for number in numbers]
        return fs.simulate_together(group), Counter(round(time, 6) for time, _ in law.seen)

    histories, asked = run(0, 1, 0)
    _, alone = run(0)
    assert len(alone) > 12
    for time, count in alone.items():
        assert asked[time] == count if time < 0.0501 else asked[time] > count, time
    np.testing.assert_array_equal(histories[0].displacement, histories[2].displacement)
    forces = [history.counterface_force.values[-1, 0, 0] for history in histories]
    assert forces[0] * forces[1] < 0.0


@pytest.mark.parametrize(
    ("change", "part"),
    [
        ({"materials": {"bulk": fs.Elastic(1.0e4, 0.3, 1000.0)}}, "materials"),
        ({"depth": 2e-3}, "depth"),
        ({"supports": {"top": ("y",)}}, "supports"),
        ({"damping": fs.RayleighDamping(mass=1.0)}, "damping"),
        ({"integration": "full"}, "integration"),
        ({"basis": fs.ReducedBasis()}, "basis"),
        ({"time": fs.TimeStepping(1e-3)}, "time"),
        ({"time": fs.QuasiStatic(5e-3)}, "time"),
        ({"contacts": ()}, "contacts"),
        ({"contacts": contact(normal_penalty=1e7)}, "contacts.0"),
        ({"contacts": contact(counterface=fs.Cylinder(0.01))}, "contacts.0"),
        ({"bodies": {"jug": fs.RigidBody(1.0)}}, "bodies"),
        ({"mesh": push_and_slide().mesh.translated((1e-6, 0.0))}, "mesh"),
    ],
)
def test_what_changes_the_matrix_is_refused_before_anything_is_computed(change, part):
    model = push_and_slide(contacts=contact())
    other, steps = dataclasses.replace(model, **change), []
    with pytest.raises(fs.InputError, match=rf"models\.1\.{part}: differs .* simulate it by itself"):
        fs.simulate_together([model, other], progress=steps.append)
    assert not steps


def test_friction_programme_loads_records_and_the_object_of_the_mesh_may_differ():
    model = push_and_slide(contacts=contact(), programme=(PRESS,))
    changes = (
        {},
        {"contacts": contact(friction=fs.Coulomb(0.9))},
        {"contacts": contact(programme=(fs.Press(1e-4, 1e-3),))},
        {"contacts": contact(search_distance=1e-3)},
        {"programme": (PRESS, fs.Slide(1e-4, 4e-3, (-1.0, 0.0)))},
        {"gravity": (0.0, -9.81)},
        {"tractions": {"left": (1.0, 0.0)}},
        {"tractions": {"left": fs.Traction((1.0, 0.0), fs.Ramp((0.0, 0.05), (0.0, 1.0)))}},
        {"initial_velocity": (1e-3, 0.0)},
        {"record": fs.Recording(snapshots_every=0.01)},
        {"mesh": push_and_slide().mesh},
    )
    group = [dataclasses.replace(model, **change) for change in changes]
    names = ("contact_displacement", "normal_traction", "counterface_force", "strain_energy")
    for each, history in zip(group, fs.simulate_together(group, solver=EXACT), strict=True):
        assert_same_history(history, fs.simulate(each, solver=EXACT), 1e-7, names)


def test_friction_may_have_frames_of_its_own():
    """In 3D, where anisotropic laws turn the tangents; the matrix is shared and the compliance is not."""
    up, names = fs.Plane((0.0, 0.0, 1.0)), ("tangential_traction", "contact_displacement")
    laws = (fs.Anisotropic(0.2, 0.6, along) for along in ((1.0, 0.0, 0.0), (0.6, 0.8, 0.0)))
    group = [pressed_pad(contacts=contact(counterface=up, friction=law, search_distance=1e-3)) for law in laws]
    for model, history in zip(group, fs.simulate_together(group, solver=EXACT), strict=True):
        assert_same_history(history, fs.simulate(model, solver=EXACT), 1e-7, names)


@pytest.mark.parametrize(
    ("kinds", "at_once", "groups"),
    [
        ("aabab", None, [[0, 1, 3], [2, 4]]),
        ("a" * 10, None, [[0, 1, 2, 3, 4], [5, 6, 7, 8, 9]]),
        ("a" * 8, None, [list(range(8))]),
        ("aaaa", 2, [[0, 1], [2, 3]]),
        ("aabb", 2, [[0, 1], [2, 3]]),
        ("aaa", 8, [[0], [1], [2]]),
        ("a" * 18, 2, [[*range(5)], [*range(5, 10)], [*range(10, 15)], [15, 16, 17]]),
        ("cc", None, [[0], [1]]),
        ("3333", 2, [[0, 1, 2, 3]]),
    ],
)
def test_models_with_one_matrix_are_grouped_evenly_and_for_all_that_can_run_at_once(
    kinds, at_once, groups, monkeypatch
):
    """Those that control their own steps (c) stay apart, those in 3D (3) together; small ones share nothing."""
    kind = {"a": {}, "b": {"depth": 2e-3}, "c": {"time": fs.Adaptive(5e-3)}}
    models = [pressed_pad() if letter == "3" else push_and_slide(**kind[letter]) for letter in kinds]
    assert groups_to_share(models) == [[number] for number in range(len(kinds))]
    monkeypatch.setattr(sharing, "_WORTH_SHARING", {2: 0, 3: 0})
    assert groups_to_share(models, *([] if at_once is None else [at_once])) == groups
