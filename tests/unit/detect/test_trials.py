from __future__ import annotations

from pathlib import Path

import pytest

from fingerslip.detect.labels import Onsets
from fingerslip.detect.synthetic import SyntheticSlide, synthetic_trial
from fingerslip.detect.trials import Trial, check_conditions, layout_digest, layout_text, read_trial, write_trial
from fingerslip.errors import InputError, ResultError

TRIAL = synthetic_trial("one", SyntheticSlide(travel=2e-3))


def test_a_trial_is_read_back_as_it_was_written(tmp_path: Path) -> None:
    folder = tmp_path / "one"
    folder.mkdir()
    write_trial(TRIAL, folder)
    found = read_trial(folder)
    assert found.tracks.equals(TRIAL.tracks)
    assert (found.name, found.labels, found.conditions) == ("one", TRIAL.labels, TRIAL.conditions)
    assert found.provenance["source"] == "analytic example, no sensor"
    (folder / "labels.csv").unlink()
    with pytest.raises(ResultError, match="labels"):
        read_trial(folder)


@pytest.mark.parametrize("name", ["", "../up", "a/b", ".hidden", "a" * 101])
def test_a_name_has_to_be_that_of_a_folder(name: str) -> None:
    with pytest.raises(InputError, match="trial: is named"):
        Trial(name, TRIAL.tracks, {})


@pytest.mark.parametrize("wrong", [{"speed": "fast"}, {"speed": True}, {"mine": [1]}, {"mine": float("nan")}])
def test_conditions_are_plain_values(wrong: dict[str, object]) -> None:
    with pytest.raises(InputError, match=r"trial x: .*: got"):
        check_conditions(wrong, "trial x")


def test_conditions_of_a_users_own_are_kept() -> None:
    check_conditions({"surface": "acrylic", "wet": False, "task": "pour", "note": None, "speed": 3e-4}, "trial x")


def test_layouts_are_told_apart() -> None:
    tracks = TRIAL.tracks
    assert layout_text(tracks) == "81 internal and 19 external markers in px"
    assert layout_digest(tracks) == layout_digest(tracks.isel(time=slice(0, 3)))
    fewer = tracks.isel(marker=slice(1, None))
    others = tracks.assign_coords(ring=tracks["ring"] + 1)
    assert len({layout_digest(one) for one in (tracks, fewer, others)}) == 3


def test_onsets_are_those_of_its_sources() -> None:
    assert set(TRIAL.labels) == {"external_markers", "contact"}
    assert all(isinstance(one, Onsets) for one in TRIAL.labels.values())
