"""Motions with steps that control their own error: where they are recorded, how long they are, what they leave."""

import dataclasses

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.recording.schedule import step_times
from problems.pushed import push_and_slide
from unit.dynamics.models import FREQUENCY, STATIC, Watched, assert_same_history, oscillator

SITE = (fs.Site("inside", "", (0.0, 1e-3)),)
TERMS = (fs.PronyTerm(0.3, 4e-3), fs.PronyTerm(0.3, 0.07))
# A material that relaxes and a damper, so that steps matter.
RELAXING = {"materials": {"bulk": fs.Elastic(34e3, 0.4, 1000.0, prony=TERMS)}, "sites": SITE}
LARGE = {"materials": {"bulk": fs.NeoHookean(34e3, 0.4, 1000.0)}, "kinematics": "finite", "sites": SITE}
SOFTER = {**LARGE, "materials": {"bulk": fs.NeoHookean(34e3, 0.4, 1000.0, prony=TERMS)}}
# No step has so small an error: all are the shortest ones.
NEVER = 1e-15


def timed(scheme, step):
    return fs.QuasiStatic(step) if scheme == "quasi_static" else fs.TimeStepping(step)


# Records meet knots, are even where something moves and logarithmic where nothing does.

# Ends at 0.1, 10.1 and 10.235 s.
PROGRAMME = (fs.Press(0.4e-3, 4e-3), fs.Hold(10.0), fs.Slide(0.8e-3, 0.8e-3 / 0.135))


def records(start, end, *, time=None, **changes):
    """Return the times of the records in a span of time, both of its ends included [s]."""
    time = time or fs.Adaptive(**({"output": 0.02, "records_per_decade": 10} | changes.pop("settings", {})))
    times = step_times(push_and_slide(programme=PROGRAMME, time=time, **changes))
    assert {start, end} <= set(times.round(9)), "records meet the knots"
    return times[(times > start - 1e-9) & (times < end + 1e-9)]


def is_even(times):
    return np.ptp(np.diff(times)) < 1e-9


@pytest.mark.parametrize(("start", "end", "count"), [(0.0, 0.1, 5), (0.1, 10.1, 500), (10.1, 10.235, 7)])
def test_every_phase_is_divided_evenly_into_a_whole_number(start, end, count):
    times = records(start, end, settings={"records_per_decade": None})
    assert times.size == count + 1
    assert is_even(times)


def test_records_in_holds_are_logarithmic_where_that_is_asked_for_and_end_at_a_given_end():
    assert [records(*span).size for span in ((0.0, 0.1), (10.1, 10.235))] == [6, 8]
    times = records(0.1, 10.1) - 0.1
    lengths = np.diff(times)
    assert times.size < 41
    assert lengths[0] <= 0.02
    doublings = np.log2(lengths / lengths[0])
    np.testing.assert_allclose(doublings, doublings.round(), atol=1e-9, err_msg="few lengths of steps occur")
    assert (np.diff(lengths) >= -1e-9).all(), "the last one is no remainder"
    late = times[:-1] > 0.2
    assert (lengths[late] <= times[:-1][late] * (10**0.1 - 1) * (1 + 1e-9)).all()
    assert records(0.1, 0.31, settings={"end": 0.31})[-1] == 0.31
    assert step_times(push_and_slide(time=fs.Adaptive(5e-3, records_per_decade=10, end=100.0))).size < 150


GROWS = fs.Ramp((0.1, 5.1), (0.0, 1.0))


@pytest.mark.parametrize(
    "changes",
    [
        {"tractions": {"right": fs.Traction((1.0, 0.0), GROWS)}},
        {"contacts": (fs.Contact("bottom"), fs.Contact("left", drive=fs.Drive(1.0, 1.0, GROWS)))},
        {"bodies": {"block": fs.RigidBody(1.0, free=("x",), loads=(fs.BodyLoad(x=1.0, ramp=GROWS),))}},
        {"support_motions": {"top": fs.SupportMotion((0.0, 1e-6), GROWS)}},
    ],
)
def test_a_hold_in_which_a_load_changes_is_even_and_after_the_programme_nothing_moves(changes):
    changes = {**changes, "settings": {"end": 100.0}}
    evenly = [is_even(records(*span, **changes)) for span in ((0.0, 0.1), (0.1, 5.1), (5.1, 10.1), (10.1, 10.235))]
    assert evenly == [True, True, False, True]
    assert not is_even(records(10.235, 100.0, **changes))


@pytest.mark.parametrize("changes", [{"sites": SITE}, RELAXING], ids=["elastic", "relaxing"])
@pytest.mark.parametrize("scheme", ["quasi_static", "hht_alpha"])
def test_shortest_steps_are_those_of_a_fixed_step(scheme, changes):
    """Every second state is recorded; forces of supports and stresses know of the steps between."""
    step, damping = 5e-3 if scheme == "quasi_static" else 2.5e-3, fs.RayleighDamping(0.0, 1e-3)
    fixed = fs.simulate(push_and_slide(time=timed(scheme, step), damping=damping, **changes))
    time = fs.Adaptive(2 * step, NEVER, scheme, smallest=step)
    history = fs.simulate(push_and_slide(time=time, damping=damping, **changes))
    assert history.attrs["steps_taken"] == fixed.sizes["time"] - 1
    assert history.attrs["shortest_step"] == history.attrs["longest_step"] == pytest.approx(step)
    assert history.attrs["steps_above_tolerance"] > 0
    assert_same_history(history, fixed.isel(time=slice(0, None, 2)), 1e-7)


BODIES = {"elastic": {}, "relaxing": RELAXING, "large": LARGE, "both": SOFTER}
# Each scheme with each of the bodies at small strain that it can make a difference to.
FAST = (("quasi_static", "relaxing"), ("hht_alpha", "elastic"))


@pytest.mark.parametrize(
    ("scheme", "changes"),
    [
        pytest.param(scheme, body, id=f"{scheme}-{name}", marks=[pytest.mark.slow] * ((scheme, name) not in FAST))
        for scheme in ("quasi_static", "hht_alpha")
        for name, body in BODIES.items()
    ],
)
def test_a_press_and_slide_is_that_of_fine_steps(scheme, changes):
    fine = fs.simulate(push_and_slide(time=timed(scheme, 0.5e-3), **changes))
    history = fs.simulate(push_and_slide(time=fs.Adaptive(10e-3, 1e-3, scheme), **changes))
    at = np.rint(history["time"].values / 0.5e-3).astype(int)
    assert fine["time"].values[at] == pytest.approx(history["time"].values)
    for name in ("counterface_force", "contact_displacement"):
        expected = fine[name].values[at]
        assert np.abs(history[name].values - expected).max() <= 0.01 * np.abs(expected).max(), name
    assert np.abs(history["energy_imbalance"]).max() <= 1e-7 * history["external_work"].max()
    assert history.attrs["steps_taken"] < fine.sizes["time"]


def test_at_large_strain_the_way_does_not_matter_to_a_press_without_friction():
    """In two halves or whole; the factors of the last lengths serve on."""
    shared = {**LARGE, "friction": 0.0, "programme": (fs.Press(0.1e-3, 4e-3),)}
    history = fs.simulate(push_and_slide(time=fs.Adaptive(5e-3, 0.1, "quasi_static"), **shared))
    fixed = fs.simulate(push_and_slide(time=fs.QuasiStatic(5e-3), **shared))
    assert_same_history(history, fixed, 1e-6, ("contact_displacement", "counterface_force"))
    assert history.attrs["factorisations"] <= 5 < history.attrs["steps_taken"]


@pytest.mark.slow
def test_creep_keeps_the_factors_of_its_last_lengths_and_no_step_is_longer_than_the_largest():
    """How its error follows the tolerance is a problem of the verification."""
    model = dataclasses.replace(oscillator(1.0, 0.0, 1.0), damping=fs.RayleighDamping(0.0, 0.5))
    time = fs.Adaptive(0.02, 1e-2, "quasi_static", smallest=1e-5, end=20.0, records_per_decade=10)
    longer, shorter = (
        fs.simulate(dataclasses.replace(model, time=dataclasses.replace(time, largest=largest))).attrs
        for largest in (None, 0.5)
    )
    assert shorter["longest_step"] <= 0.5 < longer["longest_step"]
    assert longer["steps_above_tolerance"] == 0
    assert longer["factorisations"] < 0.2 * longer["steps_taken"]


def test_dynamic_steps_are_judged_by_their_change_of_acceleration():
    """The error (beta - 1/6) h^2 (a_1 - a_0) grows with h^3: a thousandth of it allows a tenth of the step.

    Where the oscillator is fastest to change, a_1 - a_0 = h STATIC, over the largest displacement, 2 STATIC. At rest
    steps are the longest ones.
    """
    model, longest, errors = oscillator(1.0, 0.0, 1.0), [], []
    for tolerance, most in ((1e-3, 75), (1e-6, 640)):
        time = fs.Adaptive(0.5, tolerance, alpha=0.0, smallest=1e-3, end=10.0)
        history = fs.simulate(dataclasses.replace(model, time=time))
        exact = STATIC * (1.0 - np.cos(FREQUENCY * history.time.values))
        longest.append(history.attrs["longest_step"])
        assert history.attrs["steps_taken"] < most, "they are not shorter where the displacement passes zero"
        errors.append(np.abs(history["displacement"].values[:, 0, 0] - exact).max() / (2.0 * STATIC))
        assert 0.5 < longest[-1] / (tolerance * 2.0 / (1 / 4 - 1 / 6)) ** (1 / 3) < 4.0
    assert errors[0] < 20e-3
    assert 30 < errors[0] / errors[1] < 300, "of second order in a tenth of the step"
    rest = fs.simulate(dataclasses.replace(model, tractions={}, time=fs.Adaptive(1.0, 1e-3, end=20.0))).attrs
    assert (rest["longest_step"], rest["steps_rejected"]) == (1.0, 0)


def watched_run(law, time):
    return fs.simulate(push_and_slide(contacts=(fs.Contact("bottom", friction=law),), time=time))


def test_friction_knows_the_rate_of_slip_whatever_the_steps_were():
    """In a slide the plate is twice and half as fast as it is, where a slip is over the length of another step."""
    law = Watched(0.05)
    history = watched_run(law, fs.Adaptive(20e-3, 1e-3, "quasi_static", smallest=0.3e-3))
    assert history.attrs["longest_step"] > 4 * history.attrs["shortest_step"]
    late = np.array([rate for time, rate in law.seen if time > 0.18])
    assert late == pytest.approx(np.full(late.size, 8e-3), rel=0.05)


def test_phases_begin_with_the_shortest_step():
    law = Watched(0.4)
    history = watched_run(law, fs.Adaptive(5e-3, 1e-2, smallest=0.625e-3))
    times = np.unique([time for time, _ in law.seen])
    for knot in (0.0, 0.1, 0.12):
        assert times[times > knot + 1e-9][0] == pytest.approx(knot + 0.625e-3)
    assert history.attrs["longest_step"] > 1e-3


def test_a_step_that_is_not_solved_is_halved_and_the_shortest_one_is_refused():
    refusals = []

    def fails_a_few_times(time):
        if time > 0.05 and len(refusals) < 3:
            refusals.append(time)
            return True
        return False

    history = watched_run(Watched(0.4, fails_a_few_times), fs.Adaptive(5e-3, 0.5))
    first, second = np.diff(refusals)
    assert first < second == pytest.approx(0.5 * first), "halved twice"
    assert history.attrs["steps_rejected"] >= 3
    assert np.isfinite(history["counterface_force"].values).all()
    with pytest.raises(fs.ConvergenceError, match="node 7"):
        watched_run(Watched(0.4, lambda _: True), fs.Adaptive(5e-3))


@pytest.mark.slow
def test_models_that_are_simulated_together_are_computed_one_by_one():
    time = fs.Adaptive(5e-3, 1e-2)
    models = [push_and_slide(friction=friction, time=time) for friction in (0.2, 0.6)]
    for model, history in zip(models, fs.simulate_together(models), strict=True):
        alone = fs.simulate(model)
        assert history.attrs["steps_taken"] == alone.attrs["steps_taken"]
        np.testing.assert_array_equal(history["counterface_force"], alone["counterface_force"])
    with pytest.raises(fs.InputError, match=r"models\.1\.time"):
        fs.simulate_together([models[0], push_and_slide(time=fs.TimeStepping(5e-3))])
