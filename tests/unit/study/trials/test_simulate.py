"""Half of the small data set, made, interrupted and made again."""

import re
import shutil
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from pyarrow import parquet

from fingerslip.detect.trials import write_parquet
from fingerslip.errors import InputError
from fingerslip.study.trials.simulate import TrialsFailedError, simulate_trials
from places import ROOT

STUDY = ROOT / "studies" / "bulens2023_dataset_small.yaml"
# Half of its trials, four directions at each of two depths, and fewer markers.
HALF = "base: bulens2023_dataset_small.yaml\nsample: {count: 4}\ntactip: {markers: {rings: [1, 4]}}\n"


@pytest.fixture(scope="module")
def half(tmp_path_factory):
    path = tmp_path_factory.mktemp("study") / "half.yaml"
    for base in (STUDY, ROOT / "studies" / "bulens2023_dataset.yaml"):
        shutil.copy(base, path.parent)
    path.write_text(HALF, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def made(half, tmp_path_factory):
    folder = tmp_path_factory.mktemp("trials")
    return simulate_trials(half, folder / "small", workers=1), folder


def test_every_trial_slips_and_its_card_and_table_say_how_it_was_made(made):
    trials, folder = made
    assert len(trials.names) == 8
    assert {round(np.degrees(one["direction"])) for one in trials.conditions.values()} == {0, 90, 180, 270}
    for name, onsets in trials.onsets("external_markers").items():
        assert 1.5 < onsets.incipient < onsets.gross
        rest, contact = trials.conditions[name]["rest"], trials.labels(name)["contact"]
        assert rest < contact.incipient < contact.gross
    rests = [conditions["rest"] for conditions in trials.conditions.values()]
    assert 1.5 <= min(rests) < max(rests) - 5.0, "films begin at any moment of the 20 s of rest"
    trial = trials.trial(trials.names[0])
    assert trial.provenance["strains"] == "small"
    assert trial.conditions["normal_force"] > 0.0
    card = (made[0].folder / "README.md").read_text(encoding="utf-8")
    assert "**Strains are small.**" in card
    assert re.search(r"`contact.friction.static_kinetic.static` \| 0.7 to 1.1", card)
    for name in trials.names[:4]:
        tracks = trials.tracks(name)
        inside = tracks["position"].values[:, tracks["kind"].values == "internal"]
        way = np.nanmean(inside[-1] - inside[0], axis=0)
        turn = np.arctan2(way[1], way[0]) - trials.conditions[name]["direction"]
        assert np.cos(turn) > 0.99, "markers move in the direction of the slide"
    write_parquet(trials, folder / "small.parquet")
    table = parquet.read_table(folder / "small.parquet", columns=["trial", "class", "condition_tilt"])
    assert table.num_rows == sum(trials.tracks(name).sizes["time"] for name in trials.names)
    assert set(table["class"].to_pylist()) == {"no_slip", "incipient", "gross"}


@pytest.mark.slow
def test_trials_at_large_strain_slip_too_and_their_card_says_so(half, tmp_path):
    path, depth = half.with_name("large.yaml"), "sweep: {programme.0.press.depth: [1.5 mm]}\n"
    path.write_text(HALF + "kinematics: finite\n" + depth, encoding="utf-8")
    trials = simulate_trials(path, tmp_path / "large", workers=1)
    for onsets in trials.onsets("external_markers").values():
        assert 1.5 < onsets.incipient < onsets.gross
    assert trials.trial(trials.names[0]).provenance["strains"] == "large"
    assert "**Strains are large.**" in (trials.folder / "README.md").read_text(encoding="utf-8")


def test_finished_trials_are_kept_when_others_fail(half, made, tmp_path, monkeypatch):
    trials, _ = made
    work = tmp_path / "again.unfinished"
    work.mkdir()
    for name in trials.names[1:]:
        shutil.copytree(trials.folder / name, work / name)
    shutil.copytree(trials.folder.parent / ".bodies", tmp_path / ".bodies")
    computed = []

    def failing(plan, *_):
        computed.append(plan.name)
        raise InputError("here", "is wrong", "needs no such thing")

    monkeypatch.setattr("fingerslip.study.trials.trials.simulated_trial", failing)
    with pytest.raises(TrialsFailedError, match="1 of 8 trials failed, the others are kept"):
        simulate_trials(half, tmp_path / "again", workers=1)
    assert computed == ["trial-0000"]
    assert not Path(tmp_path / "again").exists()


@pytest.mark.slow
def test_who_makes_the_same_data_set_meanwhile_waits_for_it(half, made, tmp_path, monkeypatch):
    trials, _ = made
    work = tmp_path / "twice.unfinished"
    for name in trials.names[1:]:
        shutil.copytree(trials.folder / name, work / name)
    trial = trials.trial(trials.names[0])
    shutil.copytree(trials.folder.parent / ".bodies", tmp_path / ".bodies")
    monkeypatch.setattr("fingerslip.study.trials.trials.card_notes", lambda *_: ())
    computed, begun, go_on = [], threading.Event(), threading.Event()

    def slow(plan, *_):
        computed.append(plan.name)
        begun.set()
        assert go_on.wait(60.0)
        return trial

    monkeypatch.setattr("fingerslip.study.trials.trials.simulated_trial", slow)
    with ThreadPoolExecutor(2) as pool:
        both = [pool.submit(simulate_trials, half, tmp_path / "twice", workers=1) for _ in range(2)]
        assert begun.wait(60.0)
        go_on.set()
        assert {one.result().digest for one in both} == {both[0].result().digest}
    assert computed == ["trial-0000"]
    assert {path.name for path in tmp_path.iterdir()} == {"twice", ".bodies"}


def test_a_whole_data_set_is_read_back_unless_it_is_damaged(half, made, tmp_path, monkeypatch):
    shutil.copytree(made[0].folder, tmp_path / "small")

    def body(*_):
        raise InputError("body", "is made", "needs no such thing")

    monkeypatch.setattr("fingerslip.study.trials.bodies.make_bodies", body)
    assert simulate_trials(half, tmp_path / "small").digest == made[0].digest
    (tmp_path / "small" / "trial-0003" / "labels.csv").unlink()
    with pytest.raises(TrialsFailedError, match="trial-0000 and 7 more: body: is made"):
        simulate_trials(half, tmp_path / "small")


def test_studies_without_trials_and_folders_of_something_else_are_refused(tmp_path):
    with pytest.raises(InputError, match="trials: is missing"):
        simulate_trials(ROOT / "studies" / "tactip_slide.yaml", tmp_path / "none")
    (tmp_path / "thesis.txt").write_text("ours", encoding="utf-8")
    with pytest.raises(InputError, match=r"holds files, but no manifest\.json"):
        simulate_trials(STUDY, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


POURING = """
title: a plate that falls off a small dome
tactip:
  preset: tactip-smooth-3d
  dome: {radius: 10 mm, height: 8 mm}
  rods: {radius: 0.6 mm, length: 1.5 mm}
  markers: {rings: [1, 8], spacing: 3 mm}
mesh: {contact_size: 1.5 mm, bulk_size: 3 mm, contact_reach: 2 mm}
integration: nodal
contact:
  boundary: contact
  friction: {static_kinetic: {static: 0.85, kinetic: 0.6, decay_speed: 1 mm/s}}
  normal_penalty: 5 GPa/m
  tangential_penalty: 5 GPa/m
  rigid_body: plate
bodies:
  plate:
    mass: 100 g
    free: [x]
    dampers: {x: 2 N s/m}
    loads: [{x: 2 N, ramp: {times: [1.9 s, 11.9 s], factors: [0, 1]}}]
    programme: [{press: {depth: 1.5 mm, speed: 5 mm/s}}, {hold: {duration: 1.6 s}}, {hold: {duration: 10 s}}]
time: {step: 200 ms, scheme: quasi_static}
record: {groups: [internal_markers, external_markers]}
sample: {count: 2, ranges: {bodies.plate.loads.0.x: [1 N, 2 N]}}
trials: {directions: 2, view_width: 25 mm}
"""


@pytest.mark.slow
def test_a_plate_that_is_loaded_falls(tmp_path):
    study = tmp_path / "pouring.yaml"
    study.write_text(POURING, encoding="utf-8")
    trials = simulate_trials(study, tmp_path / "poured", workers=1)
    assert {one["task"] for one in trials.conditions.values()} == {"pour"}
    assert {round(one["load_rate"], 1) for one in trials.conditions.values()} <= {0.2, 0.3, 0.4}
    for name, onsets in trials.onsets("plate").items():
        assert 1.5 < onsets.incipient < onsets.gross
        # The mark is a pixel of 39 um ahead of the skin once all of the contact slips, if not before.
        assert trials.labels(name)["contact"].incipient < onsets.gross
        tracks, direction = trials.tracks(name), trials.conditions[name]["direction"]
        inside = tracks["position"].values[:, tracks["kind"].values == "internal"]
        way = np.nanmean(inside[-1] - inside[0], axis=0)
        assert np.cos(np.arctan2(way[1], way[0]) - direction) > 0.99
    assert "carries half a plate" in (trials.folder / "README.md").read_text(encoding="utf-8")
