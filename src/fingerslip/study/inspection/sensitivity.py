"""What moves the results of a study, and what its runs would come to in between: tables and a figure in its folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from fingerslip.errors import InputError
from fingerslip.parameters.yaml_text import parse_document
from fingerslip.report.tables.samples import indices_table, prediction_table, sensitivity_table
from fingerslip.results import StudyResult
from fingerslip.sampling.designs import required_output
from fingerslip.sampling.indices import Sensitivity, morris_effects, sobol_indices, surrogate_indices
from fingerslip.sampling.sensitivity import fits_of
from fingerslip.sampling.surrogate import fit_surrogate
from fingerslip.storage.files import write_bytes, write_text
from fingerslip.study.opened import open_study
from fingerslip.tables.table import Table, to_csv

Method = Literal["auto", "linear", "morris", "sobol", "surrogate"]


def write_sensitivities(folder: Path, output: str, method: Method) -> tuple[Table, ...]:
    """Return tables of what moves an output, and write them and their figure into the folder of the study."""
    study = open_study(folder).result
    if method == "linear":
        return _linear(study, output)
    from fingerslip.report.figures.samples import indices_figure
    from fingerslip.report.figures.style import figure_bytes

    results = sensitivities(study, output, method)
    kind = results[0].method if results[0].surrogate is None else "surrogate"
    tables, name = tuple(map(indices_table, results)), f"sensitivity-{output}-{kind}"
    for number, table in enumerate(tables, start=1):
        ending = f"-{number}" if len(tables) > 1 else ""
        write_text(folder / f"{name}{ending}.csv", to_csv(table))
    write_bytes(folder / f"{name}.png", figure_bytes(indices_figure(results)))
    return tables


def sensitivities(study: StudyResult, output: str, method: Method = "auto") -> tuple[Sensitivity, ...]:
    """Return what moves an output by elementary effects or Sobol indices; see :func:`write_sensitivities`."""
    drawn_for = {"morris": "morris", "saltelli": "sobol"}.get(study.design.get("method", ""), "surrogate")
    chosen = drawn_for if method == "auto" else method
    return {"morris": morris_effects, "sobol": sobol_indices, "surrogate": surrogate_indices}[chosen](study, output)


def _linear(study: StudyResult, output: str) -> tuple[Table, ...]:
    label = required_output(study.runs[0], output).label if study.runs else output
    tables = [sensitivity_table(fit) for fit in fits_of(study)]
    chosen = tuple(table for table in tables if table.title.startswith(f"What moves {label}"))
    if not chosen:
        raise InputError("of", f"no regression of '{output}'", "needs a slip time of a study with samples")
    return chosen


def predict_table(folder: Path, assignments: Sequence[str], outputs: Sequence[str]) -> Table:
    """Predict what a run between those of a study would come to."""
    study = open_study(folder).result
    values = dict(map(_pair, assignments))
    if not study.runs:
        raise InputError("study", "has no finished runs", "needs ten or more")
    fitted = [fit_surrogate(study.runs, output) for output in outputs]
    paths = {surrogate.path for surrogate in fitted[0].inputs}
    for path in values:
        if path not in paths:
            raise InputError(path, "does not differ between the runs", f"needs {', '.join(sorted(paths))}")
    return prediction_table([(surrogate, surrogate.predict(values)) for surrogate in fitted], values)


def _pair(text: str) -> tuple[str, object]:
    path, equal, value = text.partition("=")
    if not equal:
        raise InputError("at", f"got '{text}'", "needs path=value, such as contact.friction_coefficient=0.5")
    return path.strip(), parse_document(value, "at").content
