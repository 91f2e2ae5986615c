"""What running a study would do: its runs, their folders, which are finished, and which are computed together.

Nothing here loads what builds, computes or draws runs: a study that is finished needs none of it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fingerslip.dynamics.step.sharing import groups_to_share
from fingerslip.errors import FingerslipError, InputError, Mistakes
from fingerslip.model.model import Model
from fingerslip.parameters.dotted import flatten
from fingerslip.results import RefusedRun, RunResult, read_result
from fingerslip.slip.events import Events
from fingerslip.study.definition.expressions import derive
from fingerslip.study.definition.file import line_numbers, read_with_base
from fingerslip.study.definition.runs import Run, expand_mapping
from fingerslip.study.definition.spec import Study
from fingerslip.study.running.cost import most_together
from fingerslip.study.storage.store import identity

if TYPE_CHECKING:
    from fingerslip.report.content import RunPictures


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
            units = {derive(name, text, example).unit: example.name for example in examples}
            if len(units) > 1:
                in_runs = ", ".join(f"'{unit}' in {run}" for unit, run in units.items())
                raise InputError(f"derived.{name}", f"has the units {in_runs}", "needs one unit in all runs")
    if mistakes.found:
        raise mistakes.error().moved(lambda where: f"{source}: {where}")


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


@dataclass(frozen=True)
class Job:
    """A run with its model, ready to be computed."""

    run: Run  # the run
    model: Model  # its model
    identity: str  # hash of its inputs
    folder: Path  # where its results go
    doubts: tuple[str, ...] = ()  # what is doubtful in the model


@dataclass(frozen=True)
class Prepared:
    """Runs that are ready to be computed, and samples that are not."""

    jobs: tuple[Job, ...]  # the runs with their models
    refused: tuple[RefusedRun, ...] = ()  # all samples that make no model


@dataclass(frozen=True)
class Outcome:
    """What became of jobs that were computed together."""

    jobs: Sequence[Job]  # the jobs
    errors: Mapping[str, Exception]  # what went wrong, by the name of the run
    pictures: Mapping[str, RunPictures] = field(default_factory=dict)  # what was drawn already


@dataclass(frozen=True)
class Computed:
    """What became of all jobs of a study."""

    failures: dict[str, FingerslipError] = field(default_factory=dict)
    pictures: dict[str, RunPictures] = field(default_factory=dict)


def groups(jobs: Sequence[Job], at_once: int = 1) -> list[list[Job]]:
    """Put jobs into groups that are computed together, where `at_once` groups can be computed at once."""
    shared = groups_to_share([job.model for job in jobs], at_once, most_together)
    return [[jobs[number] for number in group] for group in shared]
