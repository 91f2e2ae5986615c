"""The studies that are held against published values, run or read back, and what is measured in them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from fingerslip.errors import InputError
from fingerslip.history import read_history
from fingerslip.study.progress import StudyProgress
from fingerslip.study.runner import run_studies
from fingerslip.study.validation.measures import Measures, measure

__all__ = ["FINGERPRINT", "FRICTION", "STUDIES", "TABLE2", "VARIANT", "VARIANTS", "Evidence", "gather"]

TABLE2 = "wang2014_table2"
_SPREAD = "wang2014_spread"

#: Names of the shipped studies that `validate` runs.
STUDIES = (
    TABLE2,
    "wang2014_friction",
    "wang2014_fingerprint",
    "wang2014_formulation",
    "wang2014_section",
    _SPREAD,
)
VARIANT = "fingertip.phalanx.variant"
FINGERPRINT = "fingertip.fingerprint.enabled"
FRICTION = "contact.friction_coefficient"
VARIANTS = ("original", "flattened", "scaled")


@dataclass(frozen=True)
class Evidence:
    """What was measured in the runs of the studies.

    Parameters
    ----------
    measured : mapping of str to tuple of Measures
        The runs by name of the study.
    """

    measured: Mapping[str, tuple[Measures, ...]]

    def select(self, study: str, conditions: Mapping[str, object]) -> tuple[Measures, ...]:
        """Return the runs of a study whose values, by dotted path, are these."""
        return tuple(one for one in self.measured[study] if _meets(one, conditions))

    def one(self, study: str, conditions: Mapping[str, object]) -> Measures:
        """Return the run of a study whose values are these.

        Raises
        ------
        InputError
            Where the study has no such run, or several.
        """
        found = self.select(study, conditions)
        if len(found) != 1:
            wanted = ", ".join(f"{path} = {value}" for path, value in conditions.items())
            raise InputError(
                study, f"has {len(found)} runs with {wanted}", "needs one of them", "use the shipped study"
            )
        return found[0]

    def phalanges(self, study: str, conditions: Mapping[str, object] | None = None) -> tuple[Measures, ...]:
        """Return the runs with the original, the flattened and the scaled phalanx, in this order."""
        return tuple(self.one(study, {VARIANT: variant, **(conditions or {})}) for variant in VARIANTS)

    def spread(self, conditions: Mapping[str, object], read: Callable[[Measures], float | None]) -> float | None:
        """Return largest less smallest of a number over contact meshes and time steps.

        Parameters
        ----------
        conditions : mapping of str to object
            Which runs, such as one phalanx.
        read : callable
            Reads the number of a run.

        Returns
        -------
        float or None
            None where a run does not have that number.
        """
        return _range([read(one) for one in self.select(_SPREAD, conditions)])

    def spread_of(self, check: Callable[[Evidence], float | None]) -> float | None:
        """Return largest less smallest of what `check` gives for the three phalanges, over meshes and time steps."""
        settings: dict[tuple[object, ...], list[Measures]] = {}
        for one in self.measured[_SPREAD]:
            key = tuple(value for path, value in one.run.swept.items() if path != VARIANT)
            settings.setdefault(key, []).append(one)
        return _range([check(Evidence({TABLE2: tuple(phalanges)})) for phalanges in settings.values()])


def gather(
    studies: str | Path = "studies",
    results: str | Path = "results",
    *,
    workers: int = 2,
    progress: StudyProgress | None = None,
) -> Evidence:
    """Run the shipped studies, as far as they are not finished, and measure all runs.

    Parameters
    ----------
    studies : path, optional
        Folder of the study files.
    results : path, optional
        Folder of the results.
    workers : int, optional
        How many runs are computed at once.
    progress : StudyProgress, optional
        Is told how far the studies are.

    Raises
    ------
    InputError
        Where a study file is missing or wrong.
    StudyFailedError
        Where runs failed.
    ResultError
        Where results cannot be written or read back.
    """
    paths = [_study_file(Path(studies), name) for name in STUDIES]
    outcomes = run_studies(paths, results_dir=results, workers=workers, progress=progress)
    measured = {
        name: tuple(measure(run, read_history(outcome.folder / run.label / "history.nc")) for run in outcome.runs)
        for name, outcome in zip(STUDIES, outcomes, strict=True)
    }
    return Evidence(measured)


def _study_file(folder: Path, name: str) -> Path:
    path = folder / f"{name}.yaml"
    if not path.is_file():
        mend = "name the folder of the shipped studies, or run in the folder of the project"
        raise InputError(str(path), "is not there", f"validate needs the studies {', '.join(STUDIES)}", mend)
    return path


def _meets(measures: Measures, conditions: Mapping[str, object]) -> bool:
    values: Iterator[bool] = (measures.run.all_values.get(path) == value for path, value in conditions.items())
    return all(values)


def _range(values: Sequence[float | None]) -> float | None:
    numbers = [value for value in values if value is not None]
    return max(numbers) - min(numbers) if numbers and len(numbers) == len(values) else None
