"""Tables of sensitivities over whole ranges and of predictions, with their 95 % intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from fingerslip.report.labels import short_labels
from fingerslip.report.tables.samples import group_text
from fingerslip.report.tables.table import Column, Table
from fingerslip.sampling.indices import Sensitivity
from fingerslip.sampling.surrogate import Prediction, Surrogate, Validation

__all__ = ["indices_table", "prediction_table"]

_SOBOL = (
    "Total: the share of the variance that is left when all other values are known; first: the share that goes when "
    "this one is known; the difference is interaction. ± half of the 95 % interval."
)
_MORRIS = (
    "Elementary effects: change over a step of a value by two thirds of its range, over the step. ± half of the 95 % "
    "interval. A large standard deviation means that the effect depends on the other values."
)


def indices_table(one: Sensitivity) -> Table:
    """Show what moves an output, the value that matters most first."""
    labels = short_labels([index.path for index in one.indices])
    named = group_text(one.group)
    title = f"What moves {one.label}{f', {named}' if named else ''}"
    if one.method == "morris":
        columns = (
            Column("value"),
            *(Column(name, one.unit, significant=3) for name in ("mean size", "± size", "mean", "standard deviation")),
        )
        rows = tuple((labels[own.path], own.size, own.size_error, own.mean, own.other) for own in one.indices)
        return Table(title, columns, rows, f"{_of_runs(one)} {_MORRIS}")
    columns = (
        Column("value"),
        *(Column(name, digits=3) for name in ("total index", "± total", "first index", "± first")),
    )
    rows = tuple((labels[own.path], own.size, own.size_error, own.other, own.other_error) for own in one.indices)
    return Table(title, columns, rows, f"{_of_runs(one)} {_SOBOL}")


def _of_runs(one: Sensitivity) -> str:
    unit = f" {one.unit}" if one.unit else ""
    said = f"{one.runs} runs, mean {one.mean:.3g}{unit}, standard deviation {one.deviation:.3g}{unit}"
    if one.surrogate is not None:
        return f"{said}; indices of a surrogate of {_fitted_to(one.surrogate)}: {_goodness(one.surrogate, unit)}."
    left = f", {one.left_out} left out because the event did not happen in all of their runs" if one.left_out else ""
    return f"{said}; {one.blocks} blocks{left}."


def _goodness(found: Validation, unit: str) -> str:
    return (
        f"for runs that it has not seen, its error is {found.error:.3g}{unit} (root mean square), at most "
        f"{found.largest:.3g}{unit}, Q² {found.explained:.3f}, and {100 * found.covered:.0f} % lie in its 95 % interval"
    )


def _fitted_to(found: Validation) -> str:
    """Say how many runs a surrogate was fitted to, of how many, and why the others were left out."""
    why = [
        *([f"{found.repeated} with the inputs of another"] if found.repeated else []),
        *([f"{found.missing} without this output"] if found.missing else []),
    ]
    if not why:
        return f"{found.runs} runs"
    return f"{found.runs} of {found.runs + found.repeated + found.missing} runs (left out: {', '.join(why)})"


def prediction_table(predicted: Sequence[tuple[Surrogate, Prediction]], values: Mapping[str, Any]) -> Table:
    """Show predictions with their 95 % intervals, and how good the surrogates are."""
    columns = (
        *(Column(name) for name in ("output", "unit")),
        *(Column(name, significant=5) for name in ("predicted", "from", "to")),
        *(Column(name, significant=2) for name in ("error", "largest error")),
        Column("Q²", digits=3),
    )
    rows = tuple(
        (
            *(one.output.replace("_", " "), one.unit, found.value, found.low, found.high),
            *(one.validation.error, one.validation.largest, one.validation.explained),
        )
        for one, found in predicted
    )
    at = ", ".join(f"{label} {values[path]}" for path, label in short_labels(list(values)).items())
    fitted = {one.output.replace("_", " "): _fitted_to(one.validation) for one, _ in predicted}
    same = len(set(fitted.values())) == 1
    of = next(iter(fitted.values())) if same else "; ".join(f"{name}: {runs}" for name, runs in fitted.items())
    note = (
        f"A Gaussian process of {of}. From, to: its 95 % interval. Errors and Q²: of runs that it has not seen, "
        "in five-fold cross-validation."
    )
    return Table(f"Predicted for {at}", columns, rows, note)
