"""What running a study would do: its runs, their folders and which of them are finished."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fingerslip.errors import InputError, Mistakes
from fingerslip.parameters.dotted import flatten
from fingerslip.results import RefusedRun, RunResult, read_result
from fingerslip.slip.events import Events
from fingerslip.study.definition.expressions import derive
from fingerslip.study.definition.file import line_numbers, read_with_base
from fingerslip.study.definition.runs import Run, expand_mapping
from fingerslip.study.definition.spec import Study
from fingerslip.study.storage.store import identity

__all__ = ["Plan", "plan_mapping", "plan_studies", "plan_study"]


@dataclass(frozen=True)
class Plan:
    """What running a study would do."""

    source: Path  # the study file
    study: Study  # what it holds
    folder: Path  # where the results go
    runs: tuple[Run, ...]  # all runs
    identities: Mapping[str, str]  # hash of the inputs of every run, by its name
    given: tuple[str, ...] = ()  # dotted paths of the values that the file gives
    refused: tuple[RefusedRun, ...] = ()  # samples whose values do not fit together, which make no run

    def finished_runs(self, whole: Collection[str] = ()) -> dict[str, RunResult]:
        """Return the results of the runs that are finished with these inputs, by their names."""
        stored = {run.name: read_result(self.folder / run.name, is_whole=run.name in whole) for run in self.runs}
        return {name: result for name, result in stored.items() if result and result.identity == self.identities[name]}


def plan_study(path: str | Path, results_dir: str | Path = "results") -> Plan:
    """Read a study and list its runs."""
    source = Path(path)
    mapping = read_with_base(source)
    with line_numbers(source):
        return plan_mapping(mapping, source, Path(results_dir) / source.stem)


def plan_mapping(mapping: Mapping[str, Any], source: Path, folder: Path) -> Plan:
    """List the runs of a study that is given as plain data."""
    expansion = expand_mapping(mapping, source)
    _check_quantities(expansion.study, expansion.runs, source)
    identities = {run.name: identity(run) for run in expansion.runs}
    return Plan(source, expansion.study, folder, expansion.runs, identities, expansion.given, expansion.refused)


def _check_quantities(study: Study, runs: Sequence[Run], source: Path) -> None:
    """Refuse derived quantities whose names a run does not know, or whose units do not fit, before anything runs."""
    mistakes = Mistakes()
    # A swept group may give runs other values than the first one has.
    examples = [
        RunResult(run.name, run.swept, Events(), values=flatten(run.plain_values())) for run in runs if study.derived
    ]
    for name, text in study.derived.items():
        with mistakes.collect():
            _check_units(name, {derive(name, text, example).unit: example.name for example in examples})
    if mistakes.found:
        raise mistakes.error().moved(lambda where: f"{source}: {where}")


def _check_units(name: str, units: Mapping[str, str]) -> None:
    """Refuse a quantity whose unit, the key of `units`, is another one in another run."""
    if len(units) > 1:
        units_text = ", ".join(f"'{unit}' in {run}" for unit, run in units.items())
        raise InputError(f"derived.{name}", f"has the units {units_text}", "needs one unit in all runs")


def plan_studies(paths: Sequence[str | Path], results_dir: str | Path = "results") -> tuple[Plan, ...]:
    """Read several studies and plan their runs."""
    mistakes, plans = Mistakes(), dict[Path, Plan]()
    for path in paths:
        with mistakes.collect():
            plan = plan_study(path, results_dir)
            twin = plans.setdefault(plan.folder, plan)
            if twin is not plan:
                raise InputError(str(plan.source), f"has the file name of {twin.source}", "needs a name of its own")
    mistakes.raise_all()
    return tuple(plans.values())
