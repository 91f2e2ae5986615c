"""Tables of sensitivities and predictions: numbers with their intervals, and what they come from."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from fingerslip.report.tables.samples import indices_table, prediction_table
from fingerslip.sampling.indices import Index, Sensitivity
from fingerslip.sampling.surrogate import Prediction, Surrogate, Validation

INDICES = (
    Index("contact.friction_coefficient", 0.6, 0.1, 0.5, 0.2, 0.1),
    Index("programme.0.press.depth", 0.3, 0.1, 0.2),
)
GOOD = Validation(error=0.01, largest=0.03, explained=0.99, covered=0.96, runs=40)


def one(method: str, **more: object) -> Sensitivity:
    values = {"group": {}, "mean": 0.4, "deviation": 0.1, "runs": 56, "blocks": 8, "left_out": 1, **more}
    return Sensitivity(method, "latency", "latency (accumulated slip)", "s", indices=INDICES, **values)  # type: ignore[arg-type]


def test_sobol_indices_have_their_intervals() -> None:
    table = indices_table(one("sobol", group={"fingertip.phalanx.variant": "scaled"}))
    assert table.title == "What moves latency (accumulated slip), phalanx scaled"
    assert table.rows[0] == ("friction coefficient", 0.6, 0.1, 0.5, 0.2)
    assert table.note.startswith("56 runs, mean 0.4 s, standard deviation 0.1 s; 8 blocks, 1 left out because")
    of_surrogate = indices_table(one("sobol", surrogate=GOOD)).note
    assert "its error is 0.01 s (root mean square), at most 0.03 s, Q² 0.990, and 96 % lie in its 95 %" in of_surrogate


def test_elementary_effects_have_the_unit_of_the_output() -> None:
    table = indices_table(one("morris"))
    assert [column.unit for column in table.columns] == ["", *4 * ["s"]]
    assert table.rows[0] == ("friction coefficient", 0.6, 0.1, 0.1, 0.5)


def test_predictions_say_their_error() -> None:
    surrogate = Surrogate("overall_slip", "s", (), GOOD, Path())
    table = prediction_table([(surrogate, Prediction(1.5, 1.4, 1.6))], {"contact.friction_coefficient": 0.5})
    assert table.title == "Predicted for friction coefficient 0.5"
    assert table.rows == (("overall slip", "s", 1.5, 1.4, 1.6, 0.01, 0.03, 0.99),)
    assert table.note.startswith("A Gaussian process of 40 runs. From, to:")


def test_predictions_say_which_runs_they_do_without() -> None:
    fewer = replace(GOOD, runs=427, repeated=21)
    latency, slip = (Surrogate(name, "s", (), fewer, Path()) for name in ("latency", "overall_slip"))
    found = Prediction(1.5, 1.4, 1.6)
    of = "427 of 448 runs (left out: 21 with the inputs of another)"
    assert prediction_table([(latency, found), (slip, found)], {}).note.startswith(f"A Gaussian process of {of}. From")
    assert f"indices of a surrogate of {of}: for runs" in indices_table(one("sobol", surrogate=fewer)).note
    seldom = Surrogate("latency", "s", (), replace(fewer, runs=424, missing=3), Path())
    fewest = "424 of 448 runs (left out: 21 with the inputs of another, 3 without this output)"
    said = f"latency: {fewest}; overall slip: {of}."
    assert said in prediction_table([(seldom, found), (slip, found)], {}).note
