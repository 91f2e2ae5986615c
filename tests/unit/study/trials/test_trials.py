"""What a trial of a study is."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.study.definition.runs import expand
from fingerslip.study.definition.spec import read_study
from fingerslip.study.trials.trials import simulated_trial, trial_plans
from places import ROOT

STUDY = ROOT / "studies" / "bulens2023_dataset.yaml"


@pytest.fixture(scope="module")
def study():
    return read_study(STUDY)


@pytest.fixture(scope="module")
def runs(study):
    return expand(study, STUDY)


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


def test_samples_fill_the_directions(study, runs):
    with pytest.raises(InputError, match=r"sample\.count: got 81, needs a multiple of 8"):
        trial_plans(runs, study.trials, 81)


def test_without_samples_every_run_goes_in_all_directions(study, runs):
    plans = trial_plans(runs[:2], study.trials, None)
    assert [plan.run for plan in plans] == [runs[0]] * 8 + [runs[1]] * 8
    assert [round(np.degrees(plan.direction)) for plan in plans] == 2 * list(range(0, 360, 45))
    assert {plan.repeat for plan in plans} == {0}


def test_static_friction_is_above_kinetic_friction(runs):
    laws = [run.study.contact.friction.static_kinetic for run in runs]
    assert all(law.static > law.kinetic for law in laws)
    assert len({law.static for law in laws}) == 80


def refused(study, runs, **changes):
    """Return the first trial of a changed study."""
    run = dataclasses.replace(runs[0], study=dataclasses.replace(runs[0].study, **changes))
    return trial_plans((run,), dataclasses.replace(study.trials, directions=1), 1)[0]


def test_other_programmes_are_refused(study, runs):
    with pytest.raises(InputError, match="programme: has Press, Hold, trials need a press, a hold and a slide"):
        simulated_trial(refused(study, runs, programme=study.programme[:2]), study.trials, None, {})
    with pytest.raises(InputError, match=r"trials\.rest: films 2 s of rest, needs at most the hold, 1\.6 s"):
        simulated_trial(refused(study, runs), dataclasses.replace(study.trials, rest=2.0), None, {})


def test_a_plate_falls_along_the_plane_of_symmetry_alone():
    path = ROOT / "studies" / "bulens2023_pouring_3d.yaml"
    pours = read_study(path)
    run = expand(pours, path)[0]
    plate = dataclasses.replace(run.study.bodies["plate"], free=("x", "z"))
    wrong = dataclasses.replace(run, study=dataclasses.replace(run.study, bodies={"plate": plate}))
    (plan,) = trial_plans((wrong,), pours.trials, 1)
    with pytest.raises(InputError, match=r"bodies\.plate\.free: is x, z, needs x"):
        simulated_trial(plan, pours.trials, None, {})


def test_both_kinds_of_markers_have_to_be_recorded(study, runs):
    record = dataclasses.replace(study.record, groups=())
    with pytest.raises(InputError, match=r"record\.groups: has none, needs internal_markers, external_markers"):
        simulated_trial(refused(study, runs, record=record), study.trials, None, {})
