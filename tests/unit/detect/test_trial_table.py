from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from fingerslip.detect.labels import CLASSES, classes_at
from fingerslip.detect.synthetic import SyntheticSlide, synthetic_trial
from fingerslip.detect.trial_set import TrialSet, write_parquet, write_trials
from fingerslip.errors import InputError


def test_the_table_has_a_row_for_each_frame(trials: TrialSet, tmp_path: Path) -> None:
    write_parquet(trials, tmp_path / "all.parquet")
    table = pd.read_parquet(tmp_path / "all.parquet")
    assert table["trial"].nunique() == 24
    one, tracks = table[table["trial"] == "slide-0004"], trials.tracks("slide-0004")
    assert np.array_equal(one["time_s"], tracks["time"].values)
    assert np.array_equal(one["external_0_x"], tracks["position"].values[:, 0, 0])
    found = [CLASSES[number] for number in classes_at(trials.onsets()["slide-0004"], tracks["time"].values)]
    assert one["class"].tolist() == found
    assert set(one["condition_task"]) == {"slide"}
    assert one["condition_friction_coefficient"].iloc[0] == trials.conditions["slide-0004"]["friction_coefficient"]


def test_what_was_not_seen_is_empty(tmp_path: Path) -> None:
    trial = synthetic_trial("a", SyntheticSlide(travel=1e-3))
    trial.tracks["position"].values[3, 2] = np.nan
    trial.tracks["quality"].values[3, 2] = 0.0
    made = write_trials([trial], tmp_path / "set", "One")
    write_parquet(made, tmp_path / "a.parquet")
    assert pd.read_parquet(tmp_path / "a.parquet")["external_2_x"].isna().to_numpy().nonzero()[0].tolist() == [3]


def test_conditions_of_two_kinds_leave_no_file(tmp_path: Path) -> None:
    trial = synthetic_trial("a", SyntheticSlide(travel=1e-3))
    made = [
        dataclasses.replace(trial, name=name, conditions={"wet": value}) for name, value in (("a", True), ("b", "very"))
    ]
    with pytest.raises(InputError, match="condition wet: mixes text and numbers"):
        write_parquet(write_trials(made, tmp_path / "set", "Two"), tmp_path / "a.parquet")
    assert [path.name for path in tmp_path.iterdir()] == ["set"]
