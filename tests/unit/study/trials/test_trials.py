"""What a trial of a study is: its body and plate, the cameras that film it, and the notes of a data card."""

import dataclasses

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.statics.body import StaticBody
from fingerslip.errors import InputError, ResultError
from fingerslip.parameters import as_mapping
from fingerslip.specimens.tactip.numbers import modelled_places, points_at
from fingerslip.specimens.tactip.tactip import PRESETS
from fingerslip.study.definition.runs import expand_mapping
from fingerslip.study.definition.settings import TrialSettings
from fingerslip.study.definition.spec import read_study
from fingerslip.study.trials import bodies
from fingerslip.study.trials.bodies import (
    largest_friction,
    load_rate,
    make_bodies,
    plate_of,
    programme_of,
    shared_bodies,
    stored_body,
    turned_whole,
)
from fingerslip.study.trials.trials import Eyes, card_notes, check_plan, drawn_cameras, drawn_eyes, trial_plans
from fingerslip.vision.cameras.point import pair_tracks
from fingerslip.vision.tracks import make_tracks
from places import ROOT

STUDY = ROOT / "studies" / "bulens2023_dataset.yaml"
PRESSED = [{"press": {"depth": "2 mm", "speed": "5 mm/s"}}, {"hold": {"duration": "1.6 s"}}]
SLIDE = {"distance": "14 mm", "speed": "0.3 mm/s"}


@pytest.fixture(scope="module")
def study():
    return read_study(STUDY)


@pytest.fixture(scope="module")
def runs(study):
    return expand_mapping(as_mapping(study), STUDY).runs


def few(study, **changes):
    """Return the runs of two samples of a changed study."""
    smaller = dataclasses.replace(study, sample=dataclasses.replace(study.sample, count=2))
    return expand_mapping({**as_mapping(smaller), **changes}, STUDY)


@pytest.mark.slow
def test_there_are_the_320_trials_of_the_paper(study, runs):
    plans = trial_plans(runs, study.trials, study.sample.count)
    cells = {}
    for plan in plans:
        depth = plan.run.study.programme[0].depth
        cells.setdefault((depth, round(np.degrees(plan.direction))), []).append(plan.repeat)
    assert len(plans) == 320
    assert sorted({depth for depth, _ in cells}) == pytest.approx([2e-3, 3e-3, 4e-3, 5e-3])
    assert sorted({direction for _, direction in cells}) == list(range(0, 360, 45))
    assert all(sorted(repeats) == list(range(10)) for repeats in cells.values())
    laws = [run.study.contact.friction for run in runs]
    assert all(law.static > law.kinetic for law in laws)
    assert len({law.static for law in laws}) == 80


@pytest.mark.slow
def test_samples_fill_the_directions_and_without_them_every_run_goes_in_all(study, runs):
    with pytest.raises(InputError, match=r"sample\.count: got 81, needs a multiple of 8"):
        trial_plans(runs, study.trials, 81)
    plans = trial_plans(runs[:2], study.trials, None)
    assert [plan.run for plan in plans] == [runs[0]] * 8 + [runs[1]] * 8
    assert [round(np.degrees(plan.direction)) for plan in plans] == 2 * list(range(0, 360, 45))
    assert {plan.repeat for plan in plans} == {0}


def refused(study, runs, **changes):
    """Return the first trial of a changed study."""
    run = dataclasses.replace(runs[0], study=dataclasses.replace(runs[0].study, **changes))
    return trial_plans((run,), dataclasses.replace(study.trials, directions=1), 1)[0]


def test_other_programmes_records_and_plates_are_refused(study, runs):
    with pytest.raises(InputError, match="programme: has Press, Hold, trials need a press, a hold and a slide"):
        check_plan(refused(study, runs, programme=study.programme[:2]), study.trials)
    with pytest.raises(InputError, match=r"trials\.rest: films 50 s of rest, needs at most the hold, 47 s"):
        check_plan(refused(study, runs), dataclasses.replace(study.trials, rest=50.0))
    record = dataclasses.replace(study.record, groups=())
    with pytest.raises(InputError, match=r"record\.groups: has none, needs internal_markers, external_markers"):
        check_plan(refused(study, runs, record=record), study.trials)
    path = ROOT / "studies" / "bulens2023_pouring_3d.yaml"
    pours = read_study(path)
    run = expand_mapping(as_mapping(pours), path).runs[0]
    plate = dataclasses.replace(run.study.bodies["plate"], free=("x", "z"))
    wrong = dataclasses.replace(run, study=dataclasses.replace(run.study, bodies={"plate": plate}))
    (plan,) = trial_plans((wrong,), pours.trials, 1)
    with pytest.raises(InputError, match=r"bodies\.plate\.free: is x, z, needs x"):
        check_plan(plan, pours.trials)


SETTINGS = TrialSettings(frame_rate=20.0)


def filmed(settings, eyes, markers):
    return pair_tracks(drawn_cameras(settings, eyes, markers), markers)


def markers():
    position = np.zeros((3, 4, 3))
    position[:, :2, 1], position[:, 1::2, 0] = 5e-3, 3e-3
    position[:, :2, 0] += np.array([0.0, 0.0, 1e-3])[:, None]
    position[:, 3] = np.nan
    kind = ["internal", "internal", "external", "external"]
    return make_tracks(position, [0.0, 1.0, 2.0], units="m", kind=kind, ring=[0, 1, 0, 1], angle=[0.0] * 4)


def test_both_cameras_see_their_markers_where_they_stand_and_what_is_hidden_is_missing():
    found = filmed(SETTINGS, Eyes(0.0, (0.0, 0.0), 0.0, 1, 0.0), markers())
    assert found.sizes == {"time": 41, "marker": 4, "axis": 2}
    assert found["position"].values[0, 0] == pytest.approx([319.5, 239.5], abs=1e-3)
    moved = found["position"].values[-1, 0, 0] - 319.5
    assert moved == pytest.approx(1e-3 / SETTINGS.metres_per_pixel, rel=0.01)
    assert np.isnan(found["position"].values[:, 3]).all()
    assert found["kind"].values.tolist() == ["internal", "internal", "external", "external"]
    # A camera that is turned and moved sees them elsewhere.
    straight, turned = (
        filmed(SETTINGS, Eyes(0.0, shift, turn, 1, 0.0), markers())["position"].values[0, :2]
        for shift, turn in (((0.0, 0.0), 0.0), ((1e-3, 0.0), 0.1))
    )
    sides = [two[1] - two[0] for two in (straight, turned)]
    assert np.linalg.norm(sides[0]) == pytest.approx(np.linalg.norm(sides[1]), rel=1e-2)
    angle = np.arccos(sides[0] @ sides[1] / np.prod([np.linalg.norm(one) for one in sides]))
    assert angle == pytest.approx(0.1, abs=1e-3)
    assert not np.allclose(straight[0], turned[0], atol=1.0)


def test_trials_draw_their_own_cameras_and_noise():
    found = filmed(TrialSettings(frame_rate=500.0, width=640), Eyes(0.05, (0.0, 0.0), 0.0, 3, 0.0), markers())
    assert found["position"].values[:500, 2].std(axis=0).mean() == pytest.approx(0.05, rel=0.1)
    first, again, other = drawn_eyes(SETTINGS, 4), drawn_eyes(SETTINGS, 4), drawn_eyes(SETTINGS, 5)
    assert first == again != other
    assert SETTINGS.noise[0] <= first.noise <= SETTINGS.noise[1]
    assert max(map(abs, first.shift)) <= SETTINGS.shift


def test_the_card_names_every_range_and_the_strains(study):
    notes = card_notes(study, study.trials)
    assert "Strains are large" in notes
    assert "Contact: patches of 0.8 mm" in notes
    assert "Strains are small" in card_notes(dataclasses.replace(study, kinematics="small"), study.trials)
    for path, (low, high) in study.sample.ranges.items():
        assert f"| `{path}` | {low} to {high} |" in notes


def test_all_trials_of_a_sensor_share_a_body_and_other_sensors_are_refused(study):
    runs = few(study, kinematics="small").runs
    plan, *others = shared_bodies(runs, study.trials).values()
    assert all(other is plan for other in others)
    assert (plan.depth, plan.friction, plan.name) == (5e-3, None, "sensor")
    finer = dataclasses.replace(study.trials, patch=0.5e-3)
    others = shared_bodies(runs[:1], study.trials), shared_bodies(runs, finer)
    assert len({plan.key, *(other[runs[0].name].key for other in others)}) == 3
    dome = dataclasses.replace(runs[0].specimen.dome, radius=20.5e-3)
    other = dataclasses.replace(runs[1], specimen=dataclasses.replace(runs[1].specimen, dome=dome))
    with pytest.raises(InputError, match="have 2 different sensors or meshes"):
        shared_bodies((runs[0], other), study.trials)


def test_at_large_strain_each_depth_has_a_body_sheared_by_the_largest_friction(study):
    runs = few(study).runs
    plans = shared_bodies(runs, study.trials).values()
    frictions = [run.study.all_contacts[0].contact(3).friction.coefficient for run in runs]
    assert [plan.friction for plan in plans] == pytest.approx([max(frictions)] * len(runs))
    assert {plan.name for plan in plans} == {f"sensor pressed by {d} mm" for d in (2, 3, 4, 5)}
    friction = {"time_dependent": {"times": ["0 s", "9 s"], "values": [0.3, 0.9]}}
    contact = {**as_mapping(study)["contact"], "friction": friction}
    plain = dataclasses.replace(study, sample=None)
    later = expand_mapping({**as_mapping(plain), "contact": contact}, STUDY).runs
    assert largest_friction(later[0]) == pytest.approx(0.9)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"time": {"step": "1 ms"}}, r"time: has inertia, needs scheme: quasi_static"),
        ({"programme": [*PRESSED, {"slide": {**SLIDE, "direction": [-1, 0, 0]}}]}, "direction: is .*needs \\+x"),
    ],
)
def test_what_a_body_at_large_strain_does_not_stand_for_is_refused(study, changes, message):
    with pytest.raises(InputError, match=message):
        shared_bodies(few(study, **changes).runs, study.trials)


def test_bodies_are_made_once_and_a_damaged_one_again(study, tmp_path, monkeypatch):
    draw, runs, calls = np.random.default_rng(0), few(study).runs, []
    shapes = (2, 3), 2, (1, 3), (1, 9, 6), (1, 9), (1, 2, 3), (3, 3), 3
    body = StaticBody(np.arange(2), *(draw.standard_normal(shape) for shape in shapes))
    plans = {plan.key: plan for plan in reversed(shared_bodies(runs, study.trials).values())}.values()

    def condensed(missing, _):
        calls.append([plan.depth for plan in missing])
        return (dataclasses.replace(body, shift=np.full(3, plan.depth)) for plan in missing)

    def make():
        assert {plan.key for plan in make_bodies(tuple(plans), tmp_path, print)} == {plan.key for plan in plans}

    monkeypatch.setattr(bodies, "condensed_bodies", condensed)
    make()
    make()
    assert calls == [pytest.approx([2e-3, 3e-3, 4e-3, 5e-3])]
    for plan in plans:
        stored = stored_body(plan.key, tmp_path)
        assert stored.shift == pytest.approx(np.full(3, plan.depth))
        assert (stored.answers == body.answers).all()
    (tmp_path / f"{plan.key}.basis").write_bytes(b"damaged")
    stored_body.cache_clear()
    with pytest.raises(ResultError, match="is missing or damaged; start again"):
        stored_body(plan.key, tmp_path)
    make()
    assert calls[1:] == [[plan.depth]]


HALF = PRESETS.read("tactip-ridged-3d")
WHOLE = dataclasses.replace(HALF, part="whole")
PLACES = modelled_places(HALF), HALF.markers.places


def test_the_layout_is_the_same_after_an_eighth_of_a_turn_and_displacements_turn_with_the_slide():
    at_rest = points_at(HALF, PLACES[0], HALF.marker_depth)
    whole = points_at(WHOLE, PLACES[1], HALF.marker_depth)
    assert len(whole) == 81
    for number in range(8):
        assert turned_whole(at_rest[None], *PLACES, number * np.pi / 4)[0] == pytest.approx(whole, abs=1e-12)
    moved = at_rest + np.array([1e-3, 2e-4, 0.0])
    turned = turned_whole(moved[None], *PLACES, np.pi / 2)[0] - whole
    assert turned == pytest.approx(np.tile([0.0, 2e-4, 1e-3], (81, 1)), abs=1e-12)
    across = np.zeros((1, len(PLACES[0].ring), 3))
    across[0, :, 2] = PLACES[0].position[:, 1]
    assert turned_whole(across, *PLACES, 0.0)[0, :, 2] == pytest.approx(PLACES[1].position[:, 1], abs=1e-12)
    with pytest.raises(InputError, match=r"trials\.directions: turns ring 1 by 36 degrees"):
        turned_whole(at_rest[None], *PLACES, np.pi / 5)


def test_a_plate_that_is_a_body_has_a_programme_of_its_own_and_another_moves_as_the_study_says():
    study = read_study(ROOT / "studies" / "bulens2023_dataset.yaml")
    assert plate_of(study) is None
    assert [type(phase) for phase in programme_of(study)] == [fs.Press, fs.Hold, fs.Slide]
    study = read_study(ROOT / "studies" / "bulens2023_pouring_3d.yaml")
    plate = plate_of(study)
    assert plate.free == ("x",)
    assert [type(phase) for phase in programme_of(study)] == [fs.Press, fs.Hold, fs.Hold]
    # Half of 10 g/s.
    assert load_rate(plate) == pytest.approx(0.5 * 0.010 * 9.81, rel=1e-3)
    # Loads grow as fast as the steepest part of their ramps.
    ramps = fs.Ramp((0.0, 1.0, 3.0), (0.0, 1.0, 0.0)), fs.Ramp((0.0,), (1.0,))
    plate = fs.RigidBody(mass=1.0, free=("x", "z"), loads=tuple(fs.BodyLoad(x=3.0, z=4.0, ramp=ramp) for ramp in ramps))
    assert load_rate(plate) == pytest.approx(5.0)
