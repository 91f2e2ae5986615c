"""Held objects as environments of Gymnasium, where it is installed."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.model.model import Recording
from fingerslip.sites import Site
from unit.pads import pad

gymnasium = pytest.importorskip("gymnasium")
environment = pytest.importorskip("fingerslip.environment")  # registers

STUDY = """
fingertip: {preset: wang2014-2d}
contact: {friction_coefficient: 0.6}
time: {step: 2 ms}
reaction:
  {mass: 100 g, margin: 0.3, settle: 0.1 s, rest: 0.02 s, after: 0.1 s,
   load: {ramp_load: {rate: 4 N/s, force: 1 N}}}
sweep: {contact.friction_coefficient: [0.4, 0.6], reaction.load.ramp_load.rate: [4 N/s, 16 N/s]}
"""


def held_by():
    sites = (Site("FA-I-1", "FA-I", (-1e-3, 1e-3)), Site("SA-I-1", "SA-I", (1e-3, 1e-3)))
    return replace(pad(), record=Recording(sites=sites))


@pytest.fixture(scope="module")
def make(tmp_path_factory):
    """Give what makes an environment with a pad."""
    usual = tmp_path_factory.mktemp("domain") / "domain.yaml"
    usual.write_text(STUDY)

    def made(study=usual, **options):
        return gymnasium.make("fingerslip/HoldFinger2D-v0", study=study, disable_env_checker=True, **options).unwrapped

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(environment, "build_model", lambda _: held_by())
        yield made


def episode(env, rate, **options):
    """Return the grip forces and how an episode with a constant action ends."""
    env.reset(seed=1, options={"friction": 0.6, "load_rate": 16.0, **options})
    grips = []
    while True:
        seen, _, lost, over, info = env.step(np.array([rate], np.float32))
        grips.append(float(seen["grip"][0]))
        if lost or over:
            return grips, info, lost, over


@pytest.mark.slow
def test_environment_is_one_of_gymnasium(make):
    from gymnasium.utils.env_checker import check_env

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(make(render_mode="rgb_array"))


@pytest.mark.slow
def test_object_is_lost_without_grip_and_saved_with_it(make):
    grips, info, lost, over = episode(make(), 0.0)
    assert (lost, over, set(grips), info["stick_ratio"]) == (True, False, {grips[0]}, 0.0)
    assert info["travel"] > 10e-3
    _, info, lost, over = episode(make(), 1.0)
    assert (lost, over) == (False, True)
    assert info["travel"] < 2e-3


@pytest.mark.slow
def test_a_controller_feels_nothing_of_a_plate(make, tmp_path):
    study = tmp_path / "plate.yaml"
    study.write_text(STUDY.replace("{mass", "{opposite: plate, mass"))
    alone, beside = make(), make(study=study)
    sensed, _ = beside.reset(seed=1, options={"friction": 0.6, "load_rate": 16.0})
    assert beside.observation_space == alone.observation_space
    assert beside.observation_space.contains(sensed)
    assert episode(beside, 0.0)[2:] == (True, False)
    assert episode(beside, 1.0)[2:] == (False, True)


@pytest.mark.slow
def test_action_takes_effect_after_the_latency_in_seconds(make):
    at_once, _, _, _ = episode(make(force_rate=20.0), 1.0)
    late, info, _, _ = episode(make(force_rate=20.0), 1.0, latency=0.0133)
    first = at_once[0] - 20.0 * 10e-3
    assert info["latency"] == 0.0133
    assert late[0] == pytest.approx(first)
    assert late[1:4] == pytest.approx([first + 20.0 * (time - 0.0133) for time in (0.02, 0.03, 0.04)], rel=1e-5)


def test_what_is_sensed_is_finite_and_the_truth_has_no_nan(make):
    env = make()
    seen, info = env.reset(seed=3)
    assert 0.4 <= info["friction"] <= 0.6
    assert 4.0 <= info["load_rate"] <= 16.0
    for _ in range(5):
        assert env.observation_space.contains(seen)
        assert all(np.isfinite(values).all() for values in seen.values())
        assert all(np.isfinite(value) for value in info.values())
        # Skin on the object bears the grip and the load.
        assert seen["taxels"][:, 4].sum() == pytest.approx(seen["grip"][0], rel=0.05)
        assert abs(seen["taxels"][:, 3].sum()) == pytest.approx(0.5 * info["load"], rel=0.2)
        seen, *_, info = env.step(np.array([0.5], np.float32))
    assert np.array_equal(seen["mask"] > 0, np.abs(seen["taxels"][:, 4]) > 0.0)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"control_period": 3e-3}, "control_period: got 0.003 s, needs whole steps of 0.002 s"),
        ({"latency": -1.0}, "Control.latency: got -1 s, needs "),
        ({"force_rate": float("nan")}, "Control.force_rate: got nan N/s, needs "),
        ({"body": "hand"}, "Control.body: got 'hand', needs "),
        ({"options": {"mass": 1.0}}, "Task.mass: is not known, may be one of friction, load_rate, latency"),
        ({"options": {"friction": "x"}}, "Task.friction: got 'x', needs "),
        ({"options": {"latency": float("nan")}}, "Task.latency: got nan s, needs "),
    ],
)
def test_wrong_settings_are_refused(make, wrong, message):
    options = wrong.pop("options", {})
    with pytest.raises(InputError) as caught:
        make(**wrong).reset(options=options)
    assert str(caught.value).startswith(message)


def test_study_of_another_body_and_a_step_before_reset_are_refused(make, tmp_path):
    (tmp_path / "other.yaml").write_text(STUDY)
    with pytest.raises(InputError, match="is of another kind, needs a tactip, and the block reaction with a ramp_load"):
        environment.HoldEnv("tactip", study=tmp_path / "other.yaml")
    with pytest.raises(InputError, match=r"^environment: has no object, needs one; call reset\(\) first$"):
        make().step(np.zeros(1, np.float32))


@pytest.mark.slow
def test_sensor_senses_its_pins():
    env = gymnasium.make("fingerslip/HoldTacTip2D-v0", control_period=20e-3, disable_env_checker=True).unwrapped
    seen, _ = env.reset(seed=1)
    assert "spikes" not in seen
    assert seen["mask"].all()
    for _ in range(4):
        seen, _, _, _, info = env.step(np.zeros(1, np.float32))
    assert np.abs(seen["markers"]).max() > 0.01
    assert info["slipped_fraction"] >= 0.0


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:kinematics")  # no controller is wise to squeeze so
@pytest.mark.parametrize(("body", "rate"), [("Finger", 1.0), ("Finger", 32.0), ("TacTip", 4.0)])
def test_controller_may_squeeze_as_hard_as_it_can(body, rate):
    env = gymnasium.make(f"fingerslip/Hold{body}2D-v0", disable_env_checker=True).unwrapped
    grips, info, lost, over = episode(env, 1.0, friction=0.3, load_rate=rate)
    assert (lost, over) == (False, True)
    assert grips[-1] == pytest.approx(10.0, rel=1e-6)
    assert abs(info["travel"]) < 2e-3
