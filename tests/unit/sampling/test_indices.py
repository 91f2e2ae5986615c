"""Sobol indices and elementary effects beside functions whose values are known."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from fingerslip.errors import InputError
from fingerslip.results import SAMPLE, Quantity, RunResult, StudyResult
from fingerslip.sampling.indices import block_indices, fit_surrogate, surrogate_indices
from fingerslip.slip.events import Events
from fingerslip.study.definition.sweep import SampleSettings, drawn


def study_of(
    function: Callable[[Sequence[float]], float | None], dim: int, method: str, count: int, choices: Sequence[str] = ()
) -> StudyResult:
    """Return a study with the derived quantity ``y`` of the values ``a.0``, ``a.1`` ... and the choice ``word``."""
    ranges = {f"a.{number}": (0.0, 1.0) for number in range(dim)}
    words = {"word": tuple(choices)} if choices else {}
    settings = SampleSettings(ranges, count=count, method=method, choices=words)
    runs = tuple(
        RunResult(
            f"sample-{number}",
            {SAMPLE: number},
            Events(),
            sampled=sampled,
            derived={"y": Quantity("y", "m", function(list(sampled.values())))},
        )
        for number, sampled in enumerate(drawn(settings), start=1)
    )
    return StudyResult(Path("study"), (), runs, ranges=ranges, design=settings.design)


pytest.importorskip("SALib")
pytest.importorskip("sklearn")


def ishigami(shares: Sequence[float]) -> float:
    x, y, z = (math.pi * (2.0 * float(share) - 1.0) for share in shares)
    return math.sin(x) + 7.0 * math.sin(y) ** 2 + 0.1 * z**4 * math.sin(x)


def by_path(study: StudyResult, method: str) -> dict[str, tuple[float, float, float]]:
    (found,) = block_indices(study, "y", method)
    return {index.path: (index.size, index.other, index.size_error) for index in found.indices}


def test_sobol_indices_of_ishigami_are_those_of_the_closed_form() -> None:
    # Ishigami & Homma 1990 with a = 7, b = 0.1.
    found = by_path(study_of(ishigami, 3, "saltelli", 1024), "sobol")
    for path, total, first in (("a.0", 0.5576, 0.3139), ("a.1", 0.4424, 0.4424), ("a.2", 0.2437, 0.0)):
        assert found[path][0] == pytest.approx(total, abs=max(1.5 * found[path][2], 0.02))
        assert found[path][1] == pytest.approx(first, abs=0.05)
    assert list(found) == ["a.0", "a.1", "a.2"]


def test_elementary_effects_of_a_linear_function_are_its_slopes() -> None:
    found = by_path(study_of(lambda x: 2.0 * x[0] - 5.0 * x[1], 3, "morris", 10), "morris")
    assert found["a.1"] == pytest.approx((5.0, 0.0, 0.0), abs=1e-3)
    assert found["a.0"] == pytest.approx((2.0, 0.0, 0.0), abs=1e-3)
    assert found["a.2"] == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


def test_what_has_no_output_is_left_out_and_counted() -> None:
    study = study_of(lambda x: None if x[0] > 0.9 else x[0], 2, "saltelli", 32)
    (found,) = block_indices(study, "y", "sobol")
    assert found.left_out > 0
    assert found.blocks + found.left_out == 32
    assert found.runs == 4 * found.blocks
    values = [run.derived["y"].value for run in study.runs]
    whole = [block for block in (values[at : at + 4] for at in range(0, len(values), 4)) if None not in block]
    assert found.mean == pytest.approx(sum(map(sum, whole)) / found.runs)
    # Two samples of a design with choices may have the same inputs; the output of another may be missing.
    runs = study_of(lambda x: float(x[0]) if x[0] < 0.9 else None, 1, "latin_hypercube", 30).runs
    validation = fit_surrogate((*runs, runs[0], runs[1]), "y").validation
    assert (validation.runs, validation.repeated, validation.missing) == (27, 2, 3)


def shifted(x: Sequence[float]) -> float:
    return 0.1 * float(x[0]) + {"small": 0.0, "large": 1.0}[x[1]]


def test_choices_are_values_like_others() -> None:
    study = study_of(shifted, 1, "saltelli", 64, ("small", "large"))
    found = by_path(study, "sobol")
    assert found["word"][0] == pytest.approx(1.0, abs=0.05)
    assert found["a.0"][0] == pytest.approx(0.0033, abs=0.01)
    surrogate = fit_surrogate(study_of(shifted, 1, "latin_hypercube", 40, ("small", "large")).runs, "y")
    assert surrogate.predict({"a.0": 0.5, "word": "large"}).value == pytest.approx(1.05, abs=0.01)
    with pytest.raises(InputError, match="word: got 'middle', needs one of"):
        surrogate.predict({"a.0": 0.5, "word": "middle"})


@pytest.mark.slow
def test_other_samples_go_through_a_surrogate() -> None:
    study = study_of(lambda x: 3.0 * x[0] + x[1] * x[1], 2, "latin_hypercube", 30)
    (found,) = surrogate_indices(study, "y")
    assert found.surrogate is not None
    assert found.surrogate.explained > 0.999
    # Variances 9/12 and 4/45.
    assert found.indices[0].other == pytest.approx(0.894, abs=0.02)


STUDY = study_of(lambda x: x[0], 2, "saltelli", 8)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: block_indices(STUDY, "y", "morris"), "method: has samples of saltelli, needs samples of morris"),
        (lambda: block_indices(STUDY, "z", "sobol"), "of: 'z' is not known, needs one of incipient_slip"),
        (lambda: block_indices(StudyResult(STUDY.folder, (), STUDY.runs), "y", "sobol"), "study: has no samples"),
        (
            lambda: block_indices(study_of(lambda _: None, 2, "saltelli", 32), "y", "sobol"),
            "whole blocks with y, needs 4",
        ),
        (
            lambda: block_indices(study_of(lambda _: 2.0, 2, "saltelli", 8), "y", "sobol"),
            "of: 'y' is 2 in all runs, needs an",
        ),
        (lambda: surrogate_indices(study_of(lambda _: 2.0, 2, "random", 20), "y"), "of: 'y' is 2 m in all runs, needs"),
        (lambda: fit_surrogate(study_of(lambda x: x[0], 1, "random", 9).runs, "y"), "has 9 runs with y, needs 10"),
    ],
)
def test_what_does_not_fit_is_refused(call: Callable[[], object], said: str) -> None:
    with pytest.raises(InputError, match=said):
        call()


def test_smooth_functions_are_predicted_with_an_honest_error_and_nothing_outside_the_runs() -> None:
    study = study_of(lambda x: math.sin(3.0 * x[0]) + x[1], 2, "latin_hypercube", 40)
    surrogate = fit_surrogate(study.runs, "y")
    found = surrogate.predict({"a.0": 0.4, "a.1": 0.6})
    assert found.value == pytest.approx(math.sin(1.2) + 0.6, abs=0.01)
    assert found.low <= found.value <= found.high
    assert surrogate.validation.error < 0.02
    assert surrogate.validation.explained > 0.99
    for values, message in (({"a.0": 1.2, "a.1": 0.5}, r"a\.0: got 1\.2, needs 0\.0"), ({}, r"a\.0: has no value")):
        with pytest.raises(InputError, match=message):
            surrogate.predict(values)


def test_noise_widens_the_interval_and_runs_judge_a_process_that_has_not_seen_them() -> None:
    study = study_of(lambda x: float(x[0]) + 0.2 * math.sin(1e4 * x[0]), 1, "latin_hypercube", 60)
    surrogate = fit_surrogate(study.runs, "y")
    found = surrogate.predict({"a.0": 0.5})
    assert 0.2 < found.high - found.low < 0.9
    assert 0.85 <= surrogate.validation.covered <= 1.0
    # One run of thirty lies far off: nobody who has not seen it can know.
    study = study_of(lambda x: float(x[0]) + (5.0 if 0.5 < x[0] < 0.53 else 0.0), 1, "latin_hypercube", 30)
    found = fit_surrogate(study.runs, "y").validation
    assert found.largest > 4.5
    assert found.error > 0.8
    assert 0.8 < found.covered < 1.0
