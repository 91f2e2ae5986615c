"""Sobol indices and elementary effects beside functions whose values are known."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest

from fingerslip.errors import InputError
from fingerslip.results import StudyResult
from fingerslip.sampling.indices import morris_effects, sobol_indices, surrogate_indices
from unit.sampling.designed import study_of

pytest.importorskip("SALib")
pytest.importorskip("sklearn")


def ishigami(shares: Sequence[float]) -> float:
    x, y, z = (math.pi * (2.0 * float(share) - 1.0) for share in shares)
    return math.sin(x) + 7.0 * math.sin(y) ** 2 + 0.1 * z**4 * math.sin(x)


def by_path(study: StudyResult, method: str) -> dict[str, tuple[float, float, float]]:
    (found,) = (sobol_indices if method == "sobol" else morris_effects)(study, "y")
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


def test_blocks_with_a_missing_output_are_left_out() -> None:
    study = study_of(lambda x: None if x[0] > 0.9 else x[0], 2, "saltelli", 32)
    (found,) = sobol_indices(study, "y")
    assert found.left_out > 0
    assert found.blocks + found.left_out == 32
    assert found.runs == 4 * found.blocks
    values = [run.derived["y"].value for run in study.runs]
    whole = [block for block in (values[at : at + 4] for at in range(0, len(values), 4)) if None not in block]
    assert found.mean == pytest.approx(sum(map(sum, whole)) / found.runs)
    with pytest.raises(InputError, match="whole blocks with y, needs 4 or more"):
        sobol_indices(study_of(lambda _: None, 2, "saltelli", 32), "y")


def test_choices_are_values_like_others() -> None:
    shift = {"small": 0.0, "large": 1.0}
    study = study_of(lambda x: float(x[0]) * 0.1 + shift[x[1]], 1, "saltelli", 64, ("small", "large"))
    found = by_path(study, "sobol")
    assert found["word"][0] == pytest.approx(1.0, abs=0.05)
    assert found["a.0"][0] == pytest.approx(0.0033, abs=0.01)


def test_other_samples_go_through_a_surrogate() -> None:
    study = study_of(lambda x: 3.0 * x[0] + x[1] * x[1], 2, "latin_hypercube", 30)
    (found,) = surrogate_indices(study, "y")
    assert found.surrogate is not None
    assert found.surrogate.explained > 0.999
    # Variances 9/12 and 4/45.
    assert found.indices[0].other == pytest.approx(0.894, abs=0.02)


def test_what_does_not_fit_is_refused() -> None:
    study = study_of(lambda x: x[0], 2, "saltelli", 8)
    with pytest.raises(InputError, match=r"method: has samples of saltelli, needs samples of morris"):
        morris_effects(study, "y")
    with pytest.raises(InputError, match="of: 'z' is not known, needs one of incipient_slip"):
        sobol_indices(study, "z")
    with pytest.raises(InputError, match="study: has no samples"):
        sobol_indices(StudyResult(study.folder, (), study.runs), "y")


def test_an_output_that_nothing_moves_is_refused() -> None:
    with pytest.raises(InputError, match="of: 'y' is 2 in all runs, needs an output that differs"):
        sobol_indices(study_of(lambda _: 2.0, 2, "saltelli", 8), "y")
    with pytest.raises(InputError, match="of: 'y' is 2 m in all runs, needs an output that differs"):
        surrogate_indices(study_of(lambda _: 2.0, 2, "latin_hypercube", 20), "y")
