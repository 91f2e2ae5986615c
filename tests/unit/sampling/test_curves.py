"""Measured curves: read with their units, found in histories, refused with four parts."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from fingerslip.errors import InputError
from fingerslip.sampling.curves import FitSettings, Measurement, curves_of, read_measurement
from unit import synthetic

DEPTHS = "depth [mm]"


def settings(columns: dict[str, Any] | None = None, over: str = "depth") -> FitSettings:
    return FitSettings(over=over, columns=columns or {"normal_force": "2 mN"})  # type: ignore[arg-type]


def table(path: Path, heading: str, rows: int = 6) -> Path:
    width = heading.count(",") + 1
    path.write_text(
        f"# of a pad\n{heading}\n" + "".join(",".join([f"{0.1 * n:.1f}"] * width) + "\n" for n in range(rows))
    )
    return path


def test_columns_are_read_in_si_and_patterns_name_several(tmp_path: Path) -> None:
    path = table(tmp_path / "a.csv", "time [ms], m1.displacement_x [um], m2.displacement_x [mm], m1.strain_xx, other")
    read = read_measurement(
        path, settings({"m2.displacement_x": "1 um", "*.displacement_x": "5 um", "*.strain_xx": 0.1}, "time")
    )
    assert read.columns == ("m2.displacement_x", "m1.displacement_x", "m1.strain_xx")
    assert read.positions == pytest.approx(1e-4 * np.arange(6))
    assert read.values[:, 2] == pytest.approx(np.array([2e-4, 2e-7, 0.2]))
    assert read.deviations[:, 0] == pytest.approx(np.array([1e-6, 5e-6, 0.1]))
    assert read.in_deviations(read.values)[[2, 8, 14]] == pytest.approx(np.array([200.0, 0.04, 2.0]))


@pytest.mark.parametrize(
    ("heading", "rows", "columns", "said"),
    [
        ("x [mm],normal_force [N]", 6, None, "has no column 'depth', needs it, as the block fit says; .*; it has x"),
        ("Displacement (mm),Force (N)", 6, None, r"as depth \[mm\],normal_force \[N\]; it has Displ"),
        (f"{DEPTHS},force [N]", 6, None, "has no column 'normal_force', needs it"),
        (f"{DEPTHS},normal_force", 6, None, r"column 'normal_force': has no unit, needs a unit of \[N\]; write it"),
        ("depth [kg],normal_force [N]", 6, None, r"column 'depth': has the unit \[kg\], needs a unit of \[m\]"),
        (f"{DEPTHS},normal_force [N]", 4, None, "has 4 rows, needs 5 to 2000; average"),
        (f"{DEPTHS},normal_force [N],normal_force [N]", 6, None, "has the column 'normal_force' twice, needs each"),
        (f"{DEPTHS},normal_force [N],normal_force [mN]", 6, None, "has the column 'normal_force' twice, needs each"),
        (f"{DEPTHS},a.strain_xx [N]", 6, {"*.strain_xx": 0.1}, r"has the unit \[N\], needs a unit of \[\]"),
    ],
)  # fmt: skip
def test_tables_that_do_not_fit_are_refused(
    tmp_path: Path, heading: str, rows: int, columns: dict[str, Any] | None, said: str
) -> None:
    with pytest.raises(InputError, match=rf"a\.csv.*{said}"):
        read_measurement(table(tmp_path / "a.csv", heading, rows), settings(columns))


def test_holes_and_files_that_are_no_tables_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(f"{DEPTHS},normal_force [N]\n" + "1,1\n" * 5 + "2,\n")
    with pytest.raises(
        InputError, match="column 'normal_force': has no number in row 6, needs one in every row; leave"
    ):
        read_measurement(path, settings())
    for numbers, commas in (("0,1;0,2", " and decimal commas"), ("0.1;0.2", "")):
        path.write_text(f"# of a pad\n{DEPTHS};normal_force [N]\n" + f"{numbers}\n" * 6)
        said = f"has semicolons between its columns{commas}, needs commas between columns and .*; save it as CSV in Eng"
        with pytest.raises(InputError, match=said):
            read_measurement(path, settings())
    path.write_text(f"{DEPTHS},normal_force [N]\n" + "0,06,0,2\n" * 6)
    with pytest.raises(InputError, match="has decimal commas, needs commas between columns and points in numbers"):
        read_measurement(path, settings())
    path.write_text(f"{DEPTHS},normal_force [N]\n" + "1,1,\n" * 6)
    with pytest.raises(InputError, match=r"cannot be read .*Expected 2 fields in line 2, saw 3"):
        read_measurement(path, settings())
    path.write_text(f"{DEPTHS},normal_force [N]\n" + "1,1\n" * 6)
    with pytest.raises(InputError, match="column 'depth': is the same in every row, needs positions that differ"):
        read_measurement(path, settings())
    path.write_text("")
    with pytest.raises(InputError, match=r"cannot be read \(Is a directory\), needs a CSV file"):
        read_measurement(tmp_path, settings())
    for name in (path, tmp_path / "gone.csv"):
        with pytest.raises(InputError, match=r"csv: cannot be read \(.*\), needs a CSV file"):
            read_measurement(name, settings())


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({}, "fit.columns: is empty|columns: is empty"),
        ({"force": "1 N"}, "force: is no curve of a run, needs normal_force, tangential_force or SITE"),
        ({"normal_force": 0.02}, "normal_force: '0.02' has no unit, needs a unit of \\[N\\]; write '0.02 N'"),
        ({"normal_force": "-1 N"}, "normal_force: got '-1 N', needs a standard deviation > 0"),
        ({"a.strain_xx": "1 N"}, "a.strain_xx: got '1 N', needs a standard deviation > 0"),
        ({"a.velocity_x": "1 mm"}, "a.velocity_x: got '1 mm', needs a unit of \\[m/s\\]"),
    ],
)
def test_columns_without_a_deviation_are_refused(columns: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        FitSettings(over="depth", columns=columns)


HISTORY = synthetic.make(synthetic.Process())


def measured(over: str, positions: list[float], *columns: str) -> Measurement:
    shape = len(columns), len(positions)
    return Measurement(over, np.array(positions), columns, np.zeros(shape), np.ones((len(columns), 1)))


def test_curves_of_a_history_are_taken_where_they_were_measured() -> None:
    depths = [0.3e-3, 1.5e-3, 0.75e-3]
    (force,) = curves_of(HISTORY, measured("depth", depths, "normal_force"), "run")
    assert force == pytest.approx(0.4 * (np.array(depths) / 1.5e-3) ** 1.5, rel=1e-3)
    # The slide begins at 1 s; friction grows until 1.71 s, at 3 mm/s.
    ways = np.array([0.0, 1.065e-3, 2.7e-3])
    curves = curves_of(HISTORY, measured("displacement", list(ways), "tangential_force", "normal_force"), "run")
    assert curves == pytest.approx(np.array([[0.0, 0.12, 0.24], [0.4] * 3]), abs=1e-9)
    # What was slid before does not count, nor what comes after the deepest point.
    moved = HISTORY.copy(deep=True)
    moved["counterface_displacement"][..., 0] += 5e-3
    curves = curves_of(moved, measured("displacement", list(ways), "tangential_force"), "run")
    assert curves == pytest.approx(np.array([[0.0, 0.12, 0.24]]), abs=1e-9)
    moved["counterface_displacement"][..., 1] *= xr.where(moved["time"] > 1.0, 2.0 - moved["time"], 1.0)
    assert curves_of(moved, measured("depth", depths, "normal_force"), "run")[0] == pytest.approx(force)
    site = str(HISTORY["site"].values[7])
    times = HISTORY["time"].values[[3, 250]].tolist()
    curves = curves_of(
        HISTORY, measured("time", times, f"{site}.displacement_x", f"{site}.strain_energy_density"), "run"
    )
    expected = [HISTORY["displacement"].values[[3, 250], 7, 0], HISTORY["strain_energy_density"].values[[3, 250], 7]]
    assert curves == pytest.approx(np.array(expected))


@pytest.mark.parametrize(
    ("measurement", "said"),
    [
        (measured("depth", [0.0, 2e-3], "normal_force"), "depth: goes from 0 to 0.002 m, needs 0 to 0.0015 m, as run"),
        (measured("time", [-1.0, 1.0], "normal_force"), "time: goes from -1 to 1 s, needs 0 to 2 s"),
        (measured("time", [0.0, 1.0], "m1.displacement_x"), "displacement_x: 'm1' is not known, needs one of FA-I-0"),
        (measured("time", [0.0, 1.0], "FA-I-3.stress_xx"), "needs one of sites that the study records"),
    ],
)  # fmt: skip
def test_curves_that_a_run_does_not_have_are_refused(measurement: Measurement, said: str) -> None:
    with pytest.raises(InputError, match=said):
        curves_of(HISTORY, measurement, "run")


def test_a_displacement_needs_a_slide_and_a_vector_its_component() -> None:
    site = str(HISTORY["site"].values[0])
    with pytest.raises(InputError, match=r"velocity_z: 'z' is not known, needs one of x, y"):
        curves_of(HISTORY, measured("time", [0.0, 1.0], f"{site}.velocity_z"), "run")
    pressed = synthetic.make(synthetic.Process(phases=(("press", 0.0, 1.0),)))
    with pytest.raises(InputError, match=r"fit\.over: is displacement, and run a does not slide, needs a slide"):
        curves_of(pressed, measured("displacement", [0.0, 1e-3], "normal_force"), "a")
