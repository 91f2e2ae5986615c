"""Tables of pins."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.vision.laboratories import read_pins, write_pins
from unit.vision.synthetic import moving_tracks


def test_pins_come_back(tmp_path: Path) -> None:
    tracks = moving_tracks()
    tracks["position"][2, 1] = np.nan
    tracks["quality"][2, 1] = 0.0
    write_pins(tracks, tmp_path / "pins.csv")
    again = read_pins(tmp_path / "pins.csv")
    assert again["position"].values == pytest.approx(tracks["position"].values, nan_ok=True)
    assert again["time"].values == pytest.approx(tracks["time"].values)
    assert again["marker"].values.tolist() == tracks["marker"].values.tolist()


def test_time_from_the_frame_rate(tmp_path: Path) -> None:
    (tmp_path / "pins.csv").write_text("pin_0_x,pin_0_y,force\n1,2,9\n3,4,9\n5,,9\n")
    tracks = read_pins(tmp_path / "pins.csv", frame_rate=20.0)
    assert tracks["time"].values.tolist() == [0.0, 0.05, 0.1]
    assert np.isnan(tracks["position"].values[2]).all()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a,b\n1,2\n", "has no pins"),
        ("pin_0_x,pin_0_y,pin_1_x\n1,2,3\n", "has no column pin_1_y"),
        ("pin_0_x,pin_0_y\n1,2\n", "has no column time"),
    ],
)
def test_other_tables_are_refused(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "pins.csv").write_text(text)
    with pytest.raises(InputError, match=words):
        read_pins(tmp_path / "pins.csv")
    with pytest.raises(InputError, match="there is no such file"):
        read_pins(tmp_path / "none.csv")
