from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fingerslip.detect.labels import LabelSettings, Onsets
from fingerslip.detect.recordings import read_any_tracks, read_conditions, recorded_trials
from fingerslip.detect.synthetic import SyntheticSlide, synthetic_trial
from fingerslip.detect.trial_set import write_trials
from fingerslip.errors import InputError
from fingerslip.vision.tables import write_tracks_csv
from fingerslip.vision.tracks import write_tracks

TRIAL = synthetic_trial("a", SyntheticSlide(travel=2e-3))
REST = LabelSettings(rest_frames=20)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_tracks(TRIAL.tracks, tmp_path / "first.nc")
    write_tracks_csv(TRIAL.tracks, tmp_path / "second.csv")
    table = "file,indentation [mm],direction [deg],surface,repeat\nfirst.nc,3,90,acrylic,1\nsecond.csv,4,,acrylic,2\n"
    (tmp_path / "conditions.csv").write_text(table)
    return tmp_path


def test_recordings_become_a_data_set(folder: Path) -> None:
    own = {"second": Onsets(1.0, None)}
    made = recorded_trials(folder, folder / "conditions.csv", onsets=own, settings=REST)
    trials = write_trials(made, folder / "set", "Recordings")
    assert trials.names == ("first", "second")
    assert trials.conditions["first"] == {
        "indentation": pytest.approx(3e-3),
        "direction": pytest.approx(np.pi / 2),
        "surface": "acrylic",
        "repeat": 1.0,
    }
    assert "direction" not in trials.conditions["second"]
    assert trials.labels("first") == {"external_markers": TRIAL.labels["external_markers"]}
    assert trials.labels("second")["user"] == Onsets(1.0, None)
    assert trials.trial("second").provenance == {"recording": "second.csv"}


def test_another_reader_takes_other_files(folder: Path) -> None:
    (folder / "film.mkv").write_bytes(b"")
    (folder / "films.csv").write_text("file\nfilm.mkv\n")
    (found,) = recorded_trials(folder, folder / "films.csv", settings=REST, read=lambda path: TRIAL.tracks)  # noqa: ARG005
    assert found.name == "film"
    assert read_any_tracks(folder / "first.nc").equals(TRIAL.tracks)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name\na\n", "a row has no file, needs a column 'file'"),
        ("file\na\na\n", "'a' stands twice"),
        ("file\n", "has no rows"),
        ("file,indentation\na,3\n", r"line 2: indentation: .*unit"),
        ("file,indentation [s]\na,3\n", r"line 2: indentation"),
        ("file,surface [mm]\na,3\n", "has the unit mm, takes none; units are known of indentation"),
        ("file,x\na,1,2\n", "more cells than there are names"),
        ("file,[mm]\na,1\n", r"has the column '\[mm\]'"),
    ],
)
def test_bad_tables_give_one_clear_error(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "c.csv").write_text(text)
    with pytest.raises(InputError, match=message):
        read_conditions(tmp_path / "c.csv")


def test_missing_recordings_and_labels_are_named(folder: Path) -> None:
    with pytest.raises(InputError, match="cannot be read as a table"):
        read_conditions(folder / "none.csv")
    (folder / "more.csv").write_text("file\nthird.nc\n")
    with pytest.raises(InputError, match=r"names third\.nc, needs files that are in"):
        list(recorded_trials(folder, folder / "more.csv"))
    inside = TRIAL.tracks.isel(marker=TRIAL.tracks["kind"].values == "internal")
    with pytest.raises(InputError, match="trial first: has nothing to label it by"):
        list(recorded_trials(folder, folder / "conditions.csv", read=lambda path: inside))  # noqa: ARG005
