"""How time passes, in a study file."""

from __future__ import annotations

from pathlib import Path

from fingerslip.model.timing import Adaptive, QuasiStatic, TimeStepping
from fingerslip.study.definition.runs import expand
from fingerslip.study.definition.settings import TimeSettings
from fingerslip.study.definition.spec import parse_study
from unit.study.block import block_values

SOURCE = Path("studies/x.yaml")


def test_scheme_decides_the_time_stepping() -> None:
    assert TimeSettings(1e-3, alpha=-0.1, end=1.0).stepping == TimeStepping(1e-3, -0.1, 1.0)
    assert TimeSettings(1e-3, scheme="quasi_static", end=1.0).stepping == QuasiStatic(1e-3, 1.0)
    assert TimeSettings(1e-3).alpha == TimeStepping(1e-3).alpha


def test_steps_that_control_their_error_have_settings_of_their_own() -> None:
    given = {"output": 5e-3, "tolerance": 1e-2, "smallest": 1e-4, "largest": 1.0, "records_per_decade": 20}
    assert TimeSettings("auto", "quasi_static", end=9.0, **given).stepping == Adaptive(
        scheme="quasi_static", end=9.0, **given
    )
    assert TimeSettings("auto", alpha=-0.1, output=5e-3).stepping == Adaptive(5e-3, alpha=-0.1)
    runs = expand(parse_study(block_values() | {"sweep": {"time.step": ["2 ms", "1 ms"]}}, SOURCE), SOURCE)
    assert [run.study.time.step for run in runs] == [2e-3, 1e-3]


def test_refined_settings_have_shorter_steps() -> None:
    assert TimeSettings(2e-3, alpha=-0.1).refined(0.25) == TimeSettings(0.5e-3, alpha=-0.1)
    finer = TimeSettings("auto", output=8e-3, tolerance=8e-3, smallest=1e-3).refined(0.5)
    assert finer.stepping == Adaptive(4e-3, 1e-3, smallest=0.5e-3)
