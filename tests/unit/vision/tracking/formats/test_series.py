"""Recordings in time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.laboratories import read_series, write_series_run
from fingerslip.vision.video import open_frames

FRAMES = np.random.default_rng(0).integers(0, 255, (5, 16, 24)).astype(np.uint8)


def test_runs_come_back_and_can_be_tracked(tmp_path: Path) -> None:
    control = pd.DataFrame({"start": [0.0], "shear_start": [0.1], "shear_end": [0.2], "end": [0.3]})
    for number in (2, 10):
        write_series_run(tmp_path, number, FRAMES, 25.0, {"control": control})
    runs = read_series(tmp_path)
    assert list(runs) == [2, 10]
    run = runs[10]
    assert run.tables["control"]["shear_end"].tolist() == [0.2]
    assert run.frame_rate == pytest.approx(25.0)
    assert np.array_equal(list(open_frames(run.images, run.frame_rate).read()), FRAMES)


def test_times_that_nobody_wrote_are_not_known(tmp_path: Path) -> None:
    write_series_run(tmp_path, 0, FRAMES, 25.0, {"image": pd.DataFrame({"file": list("abcde")})})
    run = read_series(tmp_path)[0]
    assert run.image_times is None
    assert run.frame_rate is None


def test_folders_that_are_no_recording(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="has no runs"):
        read_series(tmp_path)
    (tmp_path / "run_1").mkdir()
    with pytest.raises(InputError, match="has no time_series_images"):
        read_series(tmp_path)
    with pytest.raises(InputError, match="tables: got 'sound'"):
        write_series_run(tmp_path, 3, FRAMES, 25.0, {"sound": pd.DataFrame()})


def test_a_run_that_is_there_is_not_replaced(tmp_path):
    (tmp_path / "run_0").mkdir()
    (tmp_path / "run_0" / "image_data.csv").write_text("theirs")
    with pytest.raises(InputError, match="holds files, needs a new or an empty folder"):
        write_series_run(tmp_path, 0, FRAMES, 25.0)
    assert (tmp_path / "run_0" / "image_data.csv").read_text() == "theirs"
