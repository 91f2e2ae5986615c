"""Loads: forces over time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.react.loads import GRAVITY, DroppedBall, FilledVessel, LoadSeries, RampLoad, StepLoad


def test_ramp_reaches_its_force_at_its_rate() -> None:
    assert RampLoad(rate=4.0, force=2.0).series() == ((0.0, 0.5), (0.0, 2.0))
    assert StepLoad(force=1.0).series() == ((0.0, 1e-3), (0.0, 1.0))


def test_pulse_of_a_ball_has_its_momentum_then_its_weight() -> None:
    times, forces = map(np.array, DroppedBall(mass=0.06, height=0.1).series())
    pulse = forces - 0.06 * GRAVITY * times / times[-1]
    assert np.trapezoid(pulse, times) == pytest.approx(0.06 * np.sqrt(2 * GRAVITY * 0.1))
    assert forces[-1] == pytest.approx(0.06 * GRAVITY)


def test_vessel_bears_what_is_in_it_and_the_blow_of_the_jet() -> None:
    times, forces = FilledVessel(mass=0.2, flow=0.1, height=0.2, rise=10e-3).series()
    blow = 0.1 * np.sqrt(2 * GRAVITY * 0.2)
    assert times == pytest.approx((0.0, 0.01, 2.0, 2.01))
    assert forces == pytest.approx((0.0, 0.1 * GRAVITY * 0.01 + blow, 0.2 * GRAVITY + blow, 0.2 * GRAVITY))
    with pytest.raises(InputError, match=r"mass: got 0.0001 kg, needs more than flows in while the blow comes, 0.0005"):
        FilledVessel(mass=1e-4, flow=0.1)


def test_series_of_a_file_is_what_stands_there(tmp_path: Path) -> None:
    path = tmp_path / "load.csv"
    path.write_text("force [N],time [s],note\n0,0,start\n1.5,0.2,end\n")
    assert LoadSeries.read(path) == LoadSeries((0.0, 0.2), (0.0, 1.5))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time [s],force\n0,0\n", "has no numbers in 'force [N]', needs the columns time [s] and force [N]; write a"),
        ("time [s],force [N]\n0,a\n", "has no numbers in 'force [N]', needs the columns time [s] and force [N]; write"),
        ("time [s],force [N]\n0,\n", "has no numbers in 'force [N]', needs the columns time [s] and force [N]; write"),
        ("time [s],force [N]\n0,0\n0,1\n", "times: got 2 times and 2 forces, needs ascending times from 0 s on, a"),
        ("", "is no table (No columns to parse from file), needs CSV with a line of names"),
    ],
)
def test_file_that_is_no_load_is_refused(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "load.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        LoadSeries.read(path)
    assert str(caught.value).startswith(f"{path}: {message}")


@pytest.mark.parametrize(
    ("times", "forces"), [((), ()), ((0.0, 1.0), (1.0,)), ((0.1, 1.0), (0.0, 1.0)), ((0.0, 0.0), (0.0, 1.0))]
)
def test_series_needs_ascending_times_from_zero(times: tuple[float, ...], forces: tuple[float, ...]) -> None:
    with pytest.raises(InputError, match=r"needs ascending times from 0 s on, a force for each$"):
        LoadSeries(times, forces)


def test_series_has_a_file_or_numbers() -> None:
    with pytest.raises(InputError, match=r"file: is given with times or forces, needs one of the two$"):
        LoadSeries((0.0,), (1.0,), "force.csv")
