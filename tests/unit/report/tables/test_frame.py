"""Results of a study as a data frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fingerslip.report.tables.runs import runs_frame
from fingerslip.results import RefusedRun, RunResult, StudyResult
from unit.report.tables.runs import EVENTS, RUNS, UNRECORDED


def test_numbers_are_numbers_and_words_are_words() -> None:
    frame = runs_frame(StudyResult(Path("results/x"), (), RUNS, title="Friction"))
    assert frame["run"].tolist() == ["friction_coefficient-0.6", "friction_coefficient-0.8"]
    assert frame["contact.friction_coefficient"].tolist() == [0.6, 0.8]
    assert frame["fingertip.phalanx.variant"].tolist() == ["original", "original"]
    assert frame["overall_s"].dtype == np.float64
    assert frame["overall_s"].tolist() == pytest.approx([1.75, np.nan], nan_ok=True)
    assert frame.attrs["title"] == "Friction"
    assert frame["overall_s_displacement"].dtype == np.float64, "a number that no run has is missing, not a word"
    assert np.isnan(frame["overall_s_displacement"]).all()


def test_quantities_are_numbers_in_si_whose_unit_is_known() -> None:
    runs = tuple(
        RunResult(str(number), {"mesh.contact_size": size, "programme.1.slide.speed": speed}, EVENTS)
        for number, (size, speed) in enumerate((("0.12 mm", "3 mm/s"), ("100 um", "1 cm/s")))
    )
    frame = runs_frame(StudyResult(Path("results/x"), (), runs))
    assert frame["mesh.contact_size_m"].tolist() == [0.12e-3, 1e-4]
    assert frame["programme.1.slide.speed_m_per_s"].tolist() == [3e-3, 1e-2]
    units = frame.attrs["units"]
    assert units["programme.1.slide.speed_m_per_s"] == "m/s"
    assert units["latency_s_acceleration"] == "s"
    assert units["normal_force_max_N"] == "N"


def test_values_that_are_not_all_quantities_of_one_kind_stay_words() -> None:
    runs = tuple(RunResult(text, {"x": text}, EVENTS) for text in ("1 mm", "auto", "1 s"))
    frame = runs_frame(StudyResult(Path("results/x"), (), runs))
    assert frame["x"].tolist() == ["1 mm", "auto", "1 s"]


def test_refused_samples_have_a_row_and_a_reason() -> None:
    run = RunResult("sample-1", {"sample": 1}, UNRECORDED, sampled={"depth": "1 mm"}, uncertainty={"slip.overall": 0.1})
    refused = RefusedRun("sample-2", {"sample": 2}, {"depth": "9 mm"}, "too deep")
    frame = runs_frame(StudyResult(Path("results/x"), (), (run,), refused=(refused,)))
    assert frame["depth_m"].tolist() == [1e-3, 9e-3]
    assert frame["refused"].tolist() == ["", "too deep"]
    assert frame["slip_overall_uncertainty_s"].tolist() == pytest.approx([0.1, np.nan], nan_ok=True)


def test_a_study_without_runs_has_no_rows() -> None:
    assert len(runs_frame(StudyResult(Path("results/x"), (), ()))) == 0
