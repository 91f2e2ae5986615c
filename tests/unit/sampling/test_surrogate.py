"""A surrogate predicts between runs, says its error, and refuses to guess outside."""

from __future__ import annotations

import math

import pytest

from fingerslip.errors import InputError
from fingerslip.sampling.surrogate import fit_surrogate
from unit.sampling.designed import study_of

pytest.importorskip("sklearn")


def test_smooth_functions_are_predicted_with_an_honest_error() -> None:
    study = study_of(lambda x: math.sin(3.0 * x[0]) + x[1], 2, "latin_hypercube", 40)
    surrogate = fit_surrogate(study.runs, "y")
    found = surrogate.predict({"a.0": 0.4, "a.1": 0.6})
    true = math.sin(1.2) + 0.6
    assert found.value == pytest.approx(true, abs=0.01)
    assert found.low <= found.value <= found.high
    assert surrogate.validation.error < 0.02
    assert surrogate.validation.explained > 0.99
    assert repr(surrogate).startswith("<Surrogate of y: 40 runs, Q2 1.000, error")


def test_noise_is_no_error_of_the_surrogate_but_widens_its_interval() -> None:
    study = study_of(lambda x: float(x[0]) + 0.2 * math.sin(1e4 * x[0]), 1, "latin_hypercube", 60)
    surrogate = fit_surrogate(study.runs, "y")
    found = surrogate.predict({"a.0": 0.5})
    assert 0.2 < found.high - found.low < 0.9
    assert 0.85 <= surrogate.validation.covered <= 1.0


def test_choices_are_told_apart() -> None:
    shift = {"small": 0.0, "large": 1.0}
    study = study_of(lambda x: 0.5 * float(x[0]) + shift[x[1]], 1, "latin_hypercube", 40, ("small", "large"))
    surrogate = fit_surrogate(study.runs, "y")
    assert surrogate.predict({"a.0": 0.5, "word": "large"}).value == pytest.approx(1.25, abs=0.01)
    with pytest.raises(InputError, match="word: got 'middle', needs one of"):
        surrogate.predict({"a.0": 0.5, "word": "middle"})


def test_nothing_is_predicted_outside_the_runs() -> None:
    surrogate = fit_surrogate(study_of(lambda x: x[0], 1, "latin_hypercube", 12).runs, "y")
    with pytest.raises(InputError, match=r"a\.0: got 1\.2, needs 0\.0"):
        surrogate.predict({"a.0": 1.2})
    with pytest.raises(InputError, match=r"a\.0: has no value"):
        surrogate.predict({})
    with pytest.raises(InputError, match="has 9 runs with y, needs 10 or more"):
        fit_surrogate(study_of(lambda x: x[0], 1, "latin_hypercube", 9).runs, "y")


def test_runs_judge_a_process_that_has_not_seen_them() -> None:
    # One run of thirty lies far off: nobody who has not seen it can know.
    study = study_of(lambda x: float(x[0]) + (5.0 if 0.5 < x[0] < 0.53 else 0.0), 1, "latin_hypercube", 30)
    found = fit_surrogate(study.runs, "y").validation
    assert found.largest > 4.5
    assert found.error > 0.8
    assert 0.8 < found.covered < 1.0


def test_runs_that_are_left_out_are_counted_by_reason() -> None:
    # Two samples of a design with choices may have the same inputs; the output of another may be missing.
    study = study_of(lambda x: float(x[0]) if x[0] < 0.9 else None, 1, "latin_hypercube", 30)
    found = fit_surrogate((*study.runs, study.runs[0], study.runs[1]), "y").validation
    assert (found.runs, found.repeated, found.missing) == (27, 2, 3)
