"""Trials filmed of simulated and of analytic slides."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.detect import simulated
from fingerslip.detect.recordings import read_conditions, read_recording
from fingerslip.detect.simulated import film_results, simulated_trial
from fingerslip.detect.synthetic import SyntheticSensor, SyntheticSlide, film_trials, synthetic_slides, synthetic_trial
from fingerslip.errors import InputError
from fingerslip.marker_layouts import ring_layout
from fingerslip.results import RESULT
from fingerslip.vision.cameras import PUBLISHED_FRAME_RATE

TIME = np.linspace(0.0, 9.0, 181)


# Since the hold began: markers outside stick for 2 + 1 s (outer) and 2 + 2 s (centre), then stay where they are.
OUTER, CENTRE = 3.0, 4.0


# 2 px and 1 px of 94 um at 1 mm/s.
TWO, ONE = 0.1875, 0.09375


def history(*, free=False, gravity_side=1.0):
    """Return a history of five markers outside, of which the last two do not touch, and one inside."""
    gone = 1e-3 * np.clip(TIME - 3.0, 0.0, None) * gravity_side
    lift = np.clip(TIME, 0.0, 1.0) * 3e-3
    rest = np.array([[0.0, 6e-3], [0.0, 0.0], [3e-3, 0.2e-3], [-3e-3, 0.2e-3], [9e-3, 4e-3], [-9e-3, 4e-3]])
    moved = np.zeros((TIME.size, 6, 2))
    for site, stuck in ((0, CENTRE - 2.0), (1, CENTRE - 2.0), (2, OUTER - 2.0), (3, OUTER - 2.0)):
        moved[:, site, 0] = np.clip(gone, -1e-3 * stuck, 1e-3 * stuck)
    moved[:, 1:4, 1] = lift[:, None]
    moved[:, 2:4, 1] -= np.where(TIME >= 1.0, 0.2e-3, 0.0)[:, None]
    state = np.full((TIME.size, 2), STICK)
    state[TIME < 0.5] = OPEN
    state[TIME - 1.0 > OUTER, 0] = SLIP
    state[TIME - 1.0 > CENTRE] = SLIP
    plate = np.stack([gone, lift], axis=-1)[:, None]
    values = {
        "displacement": (("time", "site", "component"), moved),
        "counterface_displacement": (("time", "counterface", "component"), plate),
        "contact_state": (("time", "contact_node"), state),
        "contact_area": (("contact_node",), np.ones(2)),
    }
    if free:
        values["rigid_body_displacement"] = (("time", "rigid_body", "component"), plate)
    kinds = ["internal marker", *["external marker"] * 5]
    outside = [f"external-marker-{number}" for number in ("0-01", "1-01", "1-02", "3-01", "3-02")]
    names = ["internal-marker-0-01", *outside]
    return xr.Dataset(
        values,
        coords={
            "time": TIME,
            "site": names,
            "site_kind": ("site", kinds),
            "site_position": (("site", "component"), rest),
            "phase_kind": ("phase", ["press", "hold"]),
            "phase_start": ("phase", [0.0, 1.0]),
            "phase_end": ("phase", [1.0, 9.0]),
        },
        attrs={"kinematics": "small"},
    )


def test_a_slide_is_labelled_by_all_markers_by_those_that_touch_and_by_its_contact_and_seen_in_pixels():
    trial = simulated_trial("a", history(), seed=3, conditions={"repeat": 2})
    frame = 1.0 / PUBLISHED_FRAME_RATE
    every, touching = trial.labels["all_external_markers"], trial.labels["external_markers"]
    # What does not touch is left behind as soon as the plate moves.
    assert every.incipient == pytest.approx(2.0 + TWO, abs=2 * frame)
    assert touching.incipient == pytest.approx(OUTER + TWO, abs=2 * frame)
    assert every.gross == touching.gross == pytest.approx(CENTRE + ONE, abs=2 * frame)
    assert trial.labels["contact"].incipient == pytest.approx(OUTER, abs=0.06)
    assert trial.labels["contact"].gross == pytest.approx(CENTRE, abs=0.06)
    assert trial.conditions == {"task": "slide", "direction": 0.0, "indentation": 3e-3, "repeat": 2, "seed": 3}
    assert trial.tracks.sizes["time"] == 534
    assert trial.provenance["kinematics"] == "small"
    assert simulated_trial("a", history(gravity_side=-1.0)).conditions["direction"] == pytest.approx(np.pi)
    tracks = simulated_trial("a", history()).tracks
    assert simulated_trial("a", history(), seed=3).tracks.equals(trial.tracks)
    assert not tracks.equals(trial.tracks), "the seed is that of the noise"
    assert tracks["kind"].values.tolist() == ["internal"] + ["external"] * 5
    inside = tracks["position"].values[:, 0]
    # 50 mm are 640 px inside; the marker goes 2 mm with the plate.
    assert inside[-1] - inside[0] == pytest.approx([25.6, 0.0], abs=0.05)
    centre = tracks["position"].values[:, 1, 0]
    assert centre[: int(66 * CENTRE)].std() < 0.01
    assert centre[-1] - centre[0] == pytest.approx(-4e-3 / 94e-6, rel=0.02)


def test_a_plate_that_falls_is_labelled_by_its_marker(monkeypatch):
    monkeypatch.setattr(simulated, "_TRAVEL", 4e-3)
    trial = simulated_trial("a", history(free=True))
    found = trial.labels["plate"]
    assert found.incipient == pytest.approx(2.0 + TWO, abs=0.04)
    assert found.gross == pytest.approx(CENTRE + ONE, abs=0.04)
    assert trial.conditions["task"] == "pour"
    # The hold is 2 s and the plate falls 4 mm.
    assert trial.tracks["time"].values[-1] == pytest.approx(6.0, abs=0.1)
    assert trial.labels["contact"].gross == pytest.approx(CENTRE, abs=0.06)


def test_what_cannot_be_filmed_is_refused(tmp_path):
    with pytest.raises(InputError, match="history: has no hold"):
        simulated_trial("a", history().assign_coords(phase_kind=("phase", ["press", "slide"])))
    with pytest.raises(InputError, match="history: has no internal markers, needs both kinds"):
        simulated_trial("a", history().isel(site=slice(1, None)))
    with pytest.raises(InputError, match="has no finished runs"):
        list(film_results(tmp_path))


def test_moduli_and_shape_of_a_sweep_are_conditions(tmp_path, monkeypatch):
    (tmp_path / "soft").mkdir()
    (tmp_path / "soft" / RESULT).write_text("")
    swept = {
        f"tactip.materials.{name}.youngs_modulus": text for name, text in (("skin", "0.65 MPa"), ("gel", "10 kPa"))
    }
    swept |= {"tactip.rods.length": "1 mm", "tactip.rods.radius": "0.6 mm", "tactip.skin.ridges.height": "2 mm"}
    swept |= {"tactip.dome": {"radius": "15 mm", "height": "15 mm"}}
    swept |= {"tactip.materials.gel.poisson_ratio": 0.49, "tactip.skin.ridges.number": 6}
    result = SimpleNamespace(swept=swept, sampled={"contact.friction.static_kinetic.static": 0.7})
    monkeypatch.setattr(simulated, "stored_result", lambda _: result)
    monkeypatch.setattr(simulated, "read_history", lambda _: history())
    (trial,) = film_results(tmp_path)
    wanted = {"skin_youngs_modulus": 0.65e6, "gel_youngs_modulus": 1e4, "friction_coefficient": 0.7}
    wanted |= {"dome_height": 15e-3, "ridges_number": 6}
    wanted |= {"dome_radius": 15e-3, "rods_length": 1e-3, "rods_radius": 0.6e-3, "ridges_height": 2e-3}
    assert {name: trial.conditions[name] for name in wanted} == pytest.approx(wanted)
    assert trial.conditions["poisson_ratio"] == 0.49


def test_slip_begins_at_the_rim_and_gross_slip_comes_again_and_again():
    trial = synthetic_trial("a", SyntheticSlide(seed=3))
    label = trial.labels["external_markers"]
    assert label.incipient < label.gross
    external = trial.tracks.isel(marker=trial.tracks["kind"].values == "external")
    moved = np.linalg.norm(external["position"].values - external["position"].values[:20].mean(axis=0), axis=2)
    first = np.array([np.argmax(moved[:, marker] > 2.0) for marker in range(19)])
    ring = external["ring"].values
    assert first[ring == 2].mean() < first[ring == 1].mean() < first[ring == 0].mean()
    trial = synthetic_trial("a", SyntheticSlide(seed=3, indentation=2e-3, travel=14e-3))
    jumps = np.diff(trial.tracks["position"].values[:, 0, 0]) > 3.0
    assert jumps.sum() > 3
    held = synthetic_trial("a", SyntheticSlide(travel=0.4e-3))
    assert held.labels["external_markers"].first is None
    one, same, other = (synthetic_trial("a", SyntheticSlide(seed=seed, travel=2e-3)) for seed in (1, 1, 2))
    assert one.tracks.equals(same.tracks)
    assert not one.tracks.equals(other.tracks)


def test_later_slip_with_more_friction_and_depth_in_320_trials_of_the_protocol(monkeypatch):
    quiet = SyntheticSensor(noise=0.0)

    def gross(**slide):
        found = synthetic_trial("a", SyntheticSlide(**slide), quiet).labels["external_markers"].gross
        assert found is not None
        return found

    assert gross(friction_coefficient=0.6) < gross(friction_coefficient=0.9)
    assert gross(indentation=2e-3) < gross(indentation=4e-3)
    monkeypatch.setattr("fingerslip.detect.synthetic.synthetic_trial", lambda name, *_: name)
    assert len(set(synthetic_slides())) == 320


SENSOR = SyntheticSensor(
    internal=ring_layout(4e-3, (1, 6)), external=ring_layout(4e-3, (1, 6)), rest_frames=5, metres_per_pixel=120e-6
)


SEARCH = {"n_markers": 7, "rest_frames": 5, "layout": "free"}


def test_a_trial_is_filmed_by_both_cameras(tmp_path):
    trial = synthetic_trial("slide-0000", SyntheticSlide(direction=np.pi / 2, travel=1e-3), SENSOR)
    table = read_conditions(film_trials([trial], tmp_path / "films", size=(160, 120)))
    assert list(table) == ["slide-0000.mkv"]
    assert table["slide-0000.mkv"].pop("external") == "slide-0000-outside.mkv"
    assert table["slide-0000.mkv"] == pytest.approx({"indentation": 3e-3, "direction": np.pi / 2})
    inside = trial.tracks.isel(marker=trial.tracks["kind"].values == "internal")
    found = read_recording(tmp_path / "films" / "slide-0000.mkv", SEARCH)
    moved, known = (one["position"].values[-1] - one["position"].values[0] for one in (found, inside))
    # Numbers differ, and 0.05 px of noise are in what was filmed.
    assert np.sort(moved[:, 1]) == pytest.approx(np.sort(known[:, 1]), abs=0.1)
    outside = read_recording(tmp_path / "films" / "slide-0000-outside.mkv", SEARCH)
    assert outside.sizes["time"] == trial.tracks.sizes["time"]
