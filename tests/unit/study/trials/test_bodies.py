"""The body that trials share."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fingerslip.dynamics.statics.body import StaticBody
from fingerslip.errors import InputError
from fingerslip.study.definition.runs import expand
from fingerslip.study.definition.spec import read_study
from fingerslip.study.trials import bodies
from fingerslip.study.trials.bodies import body_key, shared_body
from places import ROOT

STUDY = ROOT / "studies" / "bulens2023_dataset_small.yaml"


@pytest.fixture(scope="module")
def study():
    return read_study(STUDY)


@pytest.fixture(scope="module")
def runs(study):
    return expand(study, STUDY)


def test_friction_tilt_and_depth_need_no_other_body(study, runs):
    assert len({body_key(run, study.trials, 2e-3) for run in runs}) == 1


def test_patches_materials_and_reach_do(study, runs):
    finer = dataclasses.replace(study.trials, patch=0.5e-3)
    other = body_key(runs[0], finer, 2e-3), body_key(runs[0], study.trials, 3e-3)
    assert len({*other, body_key(runs[0], study.trials, 2e-3)}) == 3


def test_trials_of_different_sensors_are_refused(study, runs, tmp_path):
    dome = dataclasses.replace(runs[0].specimen.dome, radius=11e-3)
    other = dataclasses.replace(runs[1], specimen=dataclasses.replace(runs[1].specimen, dome=dome))
    with pytest.raises(InputError, match="have 2 different sensors or meshes"):
        shared_body((runs[0], other), study.trials, tmp_path)


def test_a_body_is_made_once(study, runs, tmp_path, monkeypatch):
    draw = np.random.default_rng(0)
    body = StaticBody(
        np.arange(2), *(draw.standard_normal(size) for size in ((2, 3), 2, (6, 6), (3, 6), (1, 3), (3, 6)))
    )
    made = []
    monkeypatch.setattr(bodies, "_make", lambda *given: made.append(given) or body)
    key, _ = shared_body(runs, study.trials, tmp_path)
    again, kept = shared_body(runs, study.trials, tmp_path)
    assert again == key
    assert [reach for _, _, reach in made] == [pytest.approx(1.5 * 2e-3)]
    for field in dataclasses.fields(StaticBody):
        assert (getattr(kept, field.name) == getattr(body, field.name)).all()
