"""The body that trials share, its plate, and a slide of the half turned into slides of the whole."""

import dataclasses

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.statics.body import StaticBody
from fingerslip.errors import InputError
from fingerslip.parameters import as_mapping
from fingerslip.specimens.tactip import PRESETS, marker_places
from fingerslip.specimens.tactip.sites import modelled_places, points_at
from fingerslip.study.definition.runs import expand_mapping
from fingerslip.study.definition.spec import read_study
from fingerslip.study.trials import bodies
from fingerslip.study.trials.bodies import body_key, load_rate, plate_of, programme_of, shared_body, turned_whole
from places import ROOT

STUDY = ROOT / "studies" / "bulens2023_dataset_small.yaml"


@pytest.fixture(scope="module")
def study():
    return read_study(STUDY)


@pytest.fixture(scope="module")
def runs(study):
    return expand_mapping(as_mapping(study), STUDY).runs


def test_patches_materials_and_reach_need_another_body_and_other_sensors_are_refused(study, runs, tmp_path):
    assert len({body_key(run, study.trials, 2e-3) for run in runs}) == 1
    finer = dataclasses.replace(study.trials, patch=0.5e-3)
    other = body_key(runs[0], finer, 2e-3), body_key(runs[0], study.trials, 3e-3)
    assert len({*other, body_key(runs[0], study.trials, 2e-3)}) == 3
    dome = dataclasses.replace(runs[0].specimen.dome, radius=11e-3)
    other = dataclasses.replace(runs[1], specimen=dataclasses.replace(runs[1].specimen, dome=dome))
    with pytest.raises(InputError, match="have 2 different sensors or meshes"):
        shared_body((runs[0], other), study.trials, tmp_path)


def test_a_body_is_made_once(study, runs, tmp_path, monkeypatch):
    sizes = (2, 3), 2, (6, 6), (3, 6), (1, 3), (3, 6)
    body = StaticBody(np.arange(2), *map(np.random.default_rng(0).standard_normal, sizes))
    made = []
    monkeypatch.setattr(bodies, "_make", lambda *given: made.append(given) or body)
    key, _ = shared_body(runs, study.trials, tmp_path)
    again, kept = shared_body(runs, study.trials, tmp_path)
    assert again == key
    assert [reach for _, _, reach in made] == [pytest.approx(1.5 * 2e-3)]
    for field in dataclasses.fields(StaticBody):
        assert (getattr(kept, field.name) == getattr(body, field.name)).all()


HALF = PRESETS.read("tactip-ridged-3d")
WHOLE = dataclasses.replace(HALF, part="whole")
PLACES = modelled_places(HALF), marker_places(HALF.markers)


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
    across[0, :, 2] = PLACES[0].across
    assert turned_whole(across, *PLACES, 0.0)[0, :, 2] == pytest.approx(PLACES[1].across, abs=1e-12)
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
