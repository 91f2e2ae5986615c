"""What running a study would do: its runs, their folders and which of them are finished."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from fingerslip.errors import InputError, Mistakes
from fingerslip.results import RefusedRun, RunResult, read_result
from fingerslip.study.definition.spec import Study, given_paths, read_study
from fingerslip.study.definition.sweep import Run, expand_samples
from fingerslip.study.definition.yaml import line_numbers
from fingerslip.study.storage.store import identity

__all__ = ["Plan", "plan_studies", "plan_study"]


@dataclass(frozen=True)
class Plan:
    """What running a study would do.

    Parameters
    ----------
    source : Path
        The study file.
    study : Study
        What it holds.
    folder : Path
        Where the results go.
    runs : tuple of Run
        All runs.
    identities : mapping of str to str
        Hash of the inputs of every run, by its name.
    given : tuple of str
        Dotted paths of the values that the file gives; the others are the preset's or defaults.
    refused : tuple of RefusedRun
        Samples whose values do not fit together, which make no run.
    """

    source: Path
    study: Study
    folder: Path
    runs: tuple[Run, ...]
    identities: Mapping[str, str]
    given: tuple[str, ...] = ()
    refused: tuple[RefusedRun, ...] = ()

    def finished(self) -> dict[str, RunResult]:
        """Return the results of the runs that are finished with these inputs, by their names."""
        stored = {run.name: read_result(self.folder / run.name) for run in self.runs}
        return {name: found for name, found in stored.items() if found and found.identity == self.identities[name]}


def plan_study(path: str | Path, results_dir: str | Path = "results") -> Plan:
    """Read a study and list its runs.

    Raises
    ------
    InputError
        For all mistakes in the file and in the swept values, in the order of the file.
    """
    source = Path(path)
    study = read_study(source)
    with line_numbers(source):
        expansion = expand_samples(study, source)
    runs = expansion.runs
    identities = {run.name: identity(run) for run in runs}
    folder = Path(results_dir) / source.stem
    return Plan(source, study, folder, runs, identities, given_paths(source), expansion.refused)


def plan_studies(paths: Sequence[str | Path], results_dir: str | Path = "results") -> tuple[Plan, ...]:
    """Read several studies and plan their runs.

    Parameters
    ----------
    paths : sequence of path
        The study files.
    results_dir : path, optional
        Folder of the results of all studies.

    Returns
    -------
    tuple of Plan
        A plan for each study.

    Raises
    ------
    InputError
        For all mistakes in all files, and where the results of two studies would go to one folder.
    """
    mistakes, plans = Mistakes(), dict[Path, Plan]()
    for path in paths:
        with mistakes.collected():
            plan = plan_study(path, results_dir)
            twin = plans.setdefault(plan.folder, plan)
            if twin is not plan:
                raise InputError(str(plan.source), f"has the file name of {twin.source}", "needs a name of its own")
    mistakes.raise_all()
    return tuple(plans.values())
