"""Spikes of a history by models of one's own and of the project."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

import fingerslip as fs
from fingerslip.afferents.model import AFFERENTS, IntegrateAndFire, human_afferents, resolved_afferents, spike_notes
from fingerslip.afferents.signals import STIMULI, BandwidthWarning, receptor_stimuli
from fingerslip.afferents.spikes import Spikes, available_spikes, spikes_of
from fingerslip.sites import RECEPTOR_KINDS
from problems.pushed import push_and_slide
from unit.report.scenes import block_history

SITES = (
    fs.Site("SA-I-01", "SA-I", (0.0, 2e-3)),
    fs.Site("FA-I-01", "FA-I", (1e-3, 0.0), "bulk"),
    fs.Site("SA-I-02", "SA-I", (1e-3, 2e-3)),
    fs.Site("other", "", (0.0, 0.0)),
)


class Once:
    """Fires once, when the stimulus is largest, and once after all that is recorded."""

    stimulus, highest_frequency = "equivalent_strain", 1.0

    def spikes(self, times, values):
        return [np.append(times[column.argmax()], times[-1] + 1e-3) for column in values.T]


@pytest.fixture(scope="module")
def history():
    return fs.simulate(push_and_slide(record=fs.Recording(SITES)))


def test_a_model_of_ones_own_gives_a_train_for_each_receptor(history):
    found = spikes_of(history, {"SA-I": Once(), "FA-I": Once()})
    assert found.names == ("SA-I-01", "FA-I-01", "SA-I-02")
    assert found.kinds == ("SA-I", "FA-I", "SA-I")
    assert [own.size for own in found.times] == [1, 1, 1]
    table = found.to_dataframe()
    assert list(table.columns) == ["site", "kind", "time"]
    assert len(table) == 3


def test_models_of_the_project_fire_and_say_what_the_step_does_not_resolve(history):
    models = {kind: model for kind, model in human_afferents().items() if kind in {"SA-I", "FA-I"}}
    with pytest.warns(BandwidthWarning) as said:
        found = spikes_of(history, models)
    assert {str(warning.message).split(" Hz")[0] for warning in said} == {
        "the model of SA-I reaches 101",
        "the model of FA-I reaches 117",
    }
    assert found.beyond == {"SA-I": 101.0, "FA-I": 117.0}, "figures and files say it too"
    assert all(np.all(np.diff(own) > 0.0) for own in found.times)


def test_a_model_may_respond_to_the_rate_of_a_stimulus(history):
    fast = Once()
    fast.stimulus = "equivalent_strain_rate"
    steady, changing = (spikes_of(history, {"SA-I": model}).times[0][0] for model in (Once(), fast))
    assert changing < steady


@pytest.mark.parametrize(
    ("step", "loss", "left_out"), [(0.3e-3, 1.0, set()), (0.4e-3, 1.0, {"FA-II"}), (0.3e-3, 0.0, {"FA-II"})]
)
def test_vibrations_are_asked_for_where_ten_records_a_period_and_a_damped_body_resolve_them(step, loss, left_out):
    times = step * np.arange(3)
    losses = {
        name: ("time", size * times) for name, size in (("damping_dissipation", loss), ("viscous_dissipation", 0))
    }
    history = xr.Dataset(losses, {"time": times})
    assert set(human_afferents()) - set(resolved_afferents(history)) == left_out
    assert list(resolved_afferents(history, {"SA-I": Once()})) == ["SA-I"], "strain is slow"


@pytest.mark.parametrize(
    ("kinds", "times", "message"),
    [
        (("SA-I", "FA-I"), [[0.1]], "kinds: have 2 entries, need one for each of 1 names"),
        (("SA-I",), [[0.1], [0.2]], "times: have 2 entries, need one for each of 1 names"),
        (("SA-I",), [[0.1, 150.0]], "times of a: have 150, outside, need seconds from 0 to 0.2 s, .*; divide ms"),
        (("SA-I",), [[0.15, 0.1]], "times of a: have 0.1, after a later time, .*; sort them"),
        (("SA-I",), [[-0.05]], "times of a: have -0.05, outside"),
        (("SA-I",), [[0.1, np.nan]], "times of a: have nan, which is no number"),
        (("SA-I",), [["early"]], r"times: are no numbers \(.*early.*\), need some for each name, in seconds"),
        (("SA-I",), None, "times: are no numbers"),
    ],
)
def test_spikes_of_ones_own_are_checked(kinds, times, message):
    with pytest.raises(fs.InputError, match=message):
        Spikes(("a",), kinds, times, 0.0, 0.2)
    with pytest.raises(fs.InputError, match=r"end: is 0.2 s, must not be before start, 0.3 s"):
        Spikes((), (), (), 0.3, 0.2)


def test_rates_count_spikes_per_second_and_afferent():
    spikes = Spikes(("a", "b"), ("SA-I", "SA-I"), (np.array([0.05, 0.15, 0.16]), np.array([0.17])), 0.0, 0.2)
    assert repr(spikes) == "Spikes(2 SA-I with 4 spikes, 0 to 0.2 s)", "and not thousands of times"
    rates = spikes.rates(0.1)
    np.testing.assert_allclose(rates.sel(kind="SA-I"), [5.0, 15.0])
    np.testing.assert_allclose(rates.time, [0.05, 0.15])
    # The last window holds what is left.
    spikes = Spikes(("a",), ("SA-I",), (np.array([0.05, 0.95]),), 0.0, 1.0)
    np.testing.assert_allclose(spikes.rates(0.3).sel(kind="SA-I"), [1.0 / 0.3, 0.0, 0.0, 1.0 / 0.3])
    with pytest.raises(fs.InputError, match="window: got 0 s, must be above 0 s"):
        spikes.rates(0.0)


def model_of(stimulus="equivalent_strain", highest_frequency=1.0, spikes=None):
    return {"SA-I": SimpleNamespace(stimulus=stimulus, highest_frequency=highest_frequency, spikes=spikes)}


@pytest.mark.parametrize(
    ("models", "message"),
    [
        ([Once()], "models: got a list, needs a model by the name of each receptor type, such as {'SA-I': model}"),
        (
            {"SA-I": SimpleNamespace(stimulus="speed", spikes=None)},
            "SA-I: got a SimpleNamespace, needs stimulus, .*; SimpleNamespace lacks highest_frequency",
        ),
        (model_of(highest_frequency=np.inf), "got inf Hz, needs a number above 0 Hz; write for example"),
        (model_of(highest_frequency=-1.0), "got -1.0 Hz, needs a number"),
        (model_of("tickle"), "'tickle' is not known, needs one of strain_energy_density"),
    ],
)
def test_what_is_no_model_is_refused_wherever_models_are_taken(history, models, message):
    for take in (spikes_of, available_spikes, lambda *args: fs.draw(args[0], "spikes", afferents=args[1])):
        with pytest.raises(fs.InputError, match=message):
            take(history, models)


@pytest.mark.parametrize(
    ("spikes", "message"),
    [
        (lambda times, _: [times[:1]], "gave 1 arrays, needs 2, one a receptor"),
        (lambda times, _: [times[:1] - 0.1] * 2, "needs seconds"),
        (lambda *_: [[10.0, 3000.0]] * 2, "to 3000 s, needs seconds of the history, 0 to .* s; give neither"),
        (lambda *_: [[np.nan]] * 2, "nan s, needs seconds"),
    ],
)
def test_spikes_of_too_few_receptors_or_at_impossible_times_are_refused(history, spikes, message):
    with pytest.raises(fs.InputError, match=rf"SA-I\.spikes: .*{message}"):
        spikes_of(history, model_of(spikes=spikes))


def test_a_stimulus_without_values_or_time_is_told_and_an_afferent_responds_to_something(history):
    with pytest.raises(fs.ResultError, match=r"history\.equivalent_strain: is not known"):
        spikes_of(history.assign(strain=history.strain * np.nan), {"SA-I": Once()})
    with pytest.raises(fs.ResultError, match="has 1 values, needs two or more"):
        spikes_of(history.isel(time=[0]), {"SA-I": Once()})
    with pytest.raises(fs.InputError, match="least_steady"):
        afferent(least_steady=None)


TIMES = np.linspace(0.0, 2.0, 401)


def afferent(**changes):
    values = {"stimulus": "equivalent_strain", "highest_frequency": 1e9, "membrane_time": 0.02, "least_steady": 0.1}
    return IntegrateAndFire(**(values | changes))


@given(drive=st.floats(1.05, 20.0), membrane=st.floats(1e-3, 0.1), rest=st.floats(1e-3, 5e-3))
@settings(max_examples=8, deadline=None)
def test_a_steady_stimulus_fires_with_the_period_of_the_closed_form(drive, membrane, rest):
    model = afferent(membrane_time=membrane, rest=rest)
    # Three periods at least.
    found, other = model.spikes(TIMES[:201], np.full((201, 2), 0.1 * drive) * [1.0, -1.0])
    np.testing.assert_array_equal(found, other, err_msg="its size counts, whatever its sign")
    period = membrane * np.log(drive / (drive - 1.0)) + rest
    step = min(0.02 * membrane, 0.2 * rest)
    np.testing.assert_allclose(np.diff(found), period, atol=2.0 * step)


def test_an_afferent_is_silent_below_its_least_stimulus_in_a_hold_and_for_what_is_too_fast():
    (silent,) = afferent().spikes(TIMES, np.full((TIMES.size, 1), 0.0999))
    assert silent.size == 0
    steady = np.full((TIMES.size, 2), 0.3)
    now, later = afferent().spikes(TIMES, steady), afferent(delay=5e-3).spikes(TIMES, steady)
    np.testing.assert_allclose(later[1], now[1] + 5e-3)
    model = afferent(least_steady=None, least_rate=0.1)
    ramp = np.clip(TIMES, 0.0, 1.0)[:, None]
    (found,) = model.spikes(TIMES, ramp)
    assert found.size > 5
    assert found.max() < 1.01
    fast = (0.2 * np.sign(np.sin(2.0 * np.pi * 100.0 * TIMES)))[:, None]
    (kept,), (lost,) = afferent().spikes(TIMES, fast), afferent(highest_frequency=2.0).spikes(TIMES, fast)
    assert kept.size > 0
    assert lost.size == 0


def test_every_type_ships_with_a_known_stimulus_and_a_source_for_every_value():
    for kind, model in human_afferents().items():
        assert kind in RECEPTOR_KINDS
        assert model.stimulus in STIMULI
        assert {row.source for row in AFFERENTS.table(kind.lower())} <= {
            "assumed",
            "knibestol1973",
            "saal2017",
            "weiss2009",
        }


@pytest.mark.parametrize(
    ("step", "damping", "needs"),
    [
        (1.0, 0.0, "steps of 0.3 ms and a body with damping"),
        (1.0, 1.0, "steps of 0.3 ms"),
        (1e-3, 0.0, "a body with damping"),
        (1e-3, 1.0, None),
    ],
)
def test_a_type_that_is_left_out_says_what_it_lacks_and_no_more(step, damping, needs):
    history = block_history("Q4")
    history = history.assign(damping_dissipation=history["damping_dissipation"] + damping)
    history = history.assign_coords(time=step * history["time"].values)
    assert spike_notes((), {}, history) == ([f"FA-II left out: vibrations need {needs}"] if needs else [])


def test_inhibition_has_the_shape_of_the_published_kernels():
    # Rows 0, 5, 10, 17, 40 and 100 of the two kernels in the code of Saal et al. (2017), 0.2 ms apart.
    since = 0.2e-3 * np.array([0, 5, 10, 17, 40, 100, np.inf])
    early, late = (afferent(**{name: 1.0}).inhibition(since) for name in ("early_inhibition", "late_inhibition"))
    np.testing.assert_allclose(early, [1.0, 0.542052, 0.146447, 0.0, 0.0, 0.0, 0.0], atol=1e-6)
    np.testing.assert_allclose(late, [0.0, 0.0, 0.146447, 0.517999, 1.0, 0.378041, 0.0], atol=1e-6)


@pytest.mark.parametrize(("kind", "most"), [("FA-I", 300.0), ("SA-I", 120.0), ("SA-II", 120.0)])
def test_inhibition_slows_afferents_under_ten_times_their_threshold(kind, most):
    model = human_afferents()[kind]
    ramp = 10.0 * (model.least_rate or 0.0) * TIMES if model.least_steady is None else 10.0 * model.least_steady
    (spikes,) = model.spikes(TIMES[:101], np.broadcast_to(ramp, TIMES.shape)[:101, None])
    assert 10.0 < 1.0 / np.diff(spikes).min() < most, "without inhibition FA-I fire 639 and SA 152 times a second"


def test_a_pacinian_afferent_answers_a_vibration_cycle_by_cycle():
    times = np.arange(0.0, 0.2, 0.25e-3)
    # What 2.3 um at 200 Hz below a pin make at the nearest corpuscle [m/s^2].
    (spikes,) = human_afferents()["FA-II"].spikes(times, 1.36 * np.abs(np.sin(2.0 * np.pi * 200.0 * times))[:, None])
    late = spikes[spikes > 0.1]
    assert late.size / (200.0 * 0.1) == pytest.approx(1.0, abs=0.1)
    np.testing.assert_allclose(afferent(saturation=4.0).drive(np.array([[0.4, 1e9]]), np.zeros((1, 2))), [[2.0, 4.0]])


@pytest.mark.slow
def test_thresholds_are_those_of_a_pin_on_the_fingertip():
    finger = fs.preset("wang2014-2d")
    model = fs.Model(
        mesh=fs.build_section(finger, contact_size=0.15e-3, bulk_size=0.8e-3),
        materials=finger.materials,
        formulation=finger.formulation,
        depth=finger.depth,
        supports={"phalanx": ("x", "y")},
        contacts=(fs.Contact("skin", fs.Cylinder(0.5e-3), fs.Coulomb(0.6)),),
        programme=(fs.Press(0.5e-3, 5e-3),),
        damping=fs.RayleighDamping(stiffness=2e-3),
        time=fs.TimeStepping(step=1e-3, alpha=-0.41421),
        record=fs.Recording(sites=fs.receptor_sites(finger)),
    )
    history = fs.simulate(model)
    stimuli, models = receptor_stimuli(history), human_afferents()
    depths = 5e-3 * history["time"].values

    def nearest(kind):
        """Return the stimulus of the afferent that is strained most, over depth."""
        values = stimuli[models[kind].stimulus].values[:, stimuli["site_kind"].values == kind]
        return values[:, values[-1].argmax()]

    times = np.arange(0.0, 1.0, 1e-3)
    held = models["SA-I"].spikes(times, np.interp(np.minimum(5e-3 * times, 0.5e-3), depths, nearest("SA-I"))[:, None])[
        0
    ]
    assert 12 <= (held > 0.5).sum() / 0.5 <= 32, "the four fitted afferents of Saal et al. (2017): 12 to 32, median 18"
    stretched = nearest("SA-II")
    assert np.interp(0.28e-3, depths, stretched) < models["SA-II"].least_steady < np.interp(0.32e-3, depths, stretched)
    sheared = nearest("FA-I")
    fires = [models["FA-I"].spikes(depths / speed, sheared[:, None])[0].size > 0 for speed in (0.35e-3, 0.45e-3)]
    assert fires == [False, True], "Knibestol (1973): from 0.4 mm/s on"
    step = 0.25e-3
    moves = np.diff(2.3e-6 * np.sin(2.0 * np.pi * 200.0 * np.arange(0.0, 0.0401, step)))
    shaking = (fs.Press(move, move / step) if move > 0.0 else fs.Lift(-move, -move / step) for move in moves)
    programme, timing = (*model.programme, fs.Hold(0.02), *shaking), dataclasses.replace(model.time, step=step)
    shaken = receptor_stimuli(fs.simulate(dataclasses.replace(model, programme=programme, time=timing)))
    accelerations = shaken["acceleration"].values[-80:, shaken["site_kind"].values == "FA-II"]
    assert accelerations.max() == pytest.approx(1.36, rel=0.01), "that of a Pacinian afferent above"
