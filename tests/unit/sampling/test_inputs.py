"""What differs between runs, as numbers."""

from __future__ import annotations

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.results import REPEAT, SAMPLE, RunResult
from fingerslip.sampling.designs import encode, inputs_of
from fingerslip.slip.events import Events


def run(**swept: object) -> RunResult:
    return RunResult("run", {path.replace("_", "."): value for path, value in swept.items()}, Events())


def test_quantities_numbers_and_words_become_columns() -> None:
    runs = [
        run(a_depth="1 mm", b=1, word="x", same="3 mm", **{SAMPLE: 1}),
        run(a_depth="3 mm", b=2, word="y", same="3 mm", **{REPEAT: 2}),
    ]
    inputs = inputs_of(runs)
    assert [(one.path, one.unit, one.choices) for one in inputs] == [
        ("a.depth", "m", ()),
        ("b", "", ()),
        ("word", "", ("x", "y")),
    ]
    assert encode(inputs, {"a.depth": "2 mm", "b": 1.5, "word": "y"}) == pytest.approx(np.array([0.5, 0.5, 0.0, 1.0]))
    with pytest.raises(InputError, match=r"a\.depth: got '2 s', needs 0\.001 to 0\.003 m"):
        inputs[0].columns("2 s")
    assert [inputs[2].at(share) for share in (0.2, 0.7, 1.0)] == ["x", "y", "y"]
    assert inputs[0].columns(inputs[0].at(0.25)) == pytest.approx((0.25,))


def test_runs_that_do_not_differ_are_refused() -> None:
    with pytest.raises(InputError, match="has runs that do not differ"):
        inputs_of([run(a=1)])
