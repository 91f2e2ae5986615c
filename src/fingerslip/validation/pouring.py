"""The pouring task of Cordova Bulens et al. (2023) beside a simulated one: a forest that learned from slides alone.

Its runs take long, so the rows are stored, and read back unless they are asked for.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from fingerslip.detect.evaluation.bootstrap import Estimate
from fingerslip.published import PublishedValue, published
from fingerslip.study.running.progress import StudyProgress
from fingerslip.validation.rows import Row, number_row, statement_row
from fingerslip.validation.stored import RowFile, Stored, stored_rows

# What simulates, films and trains is loaded where rows are computed: stored ones are read without it.
if TYPE_CHECKING:
    from fingerslip.detect.evaluation.events import EventScores
    from fingerslip.detect.trial_set import TrialSet
    from fingerslip.detect.unseen import Unseen

__all__ = [
    "POURING",
    "POURING_FILE",
    "POURING_IN_SPACE",
    "pouring_in_space",
    "pouring_of",
    "pouring_rows",
    "rows_of_pouring",
]

#: The study to learn from, and the one to be tested on: sections, and sensors in space.
POURING = ("bulens2023_section_slides", "bulens2023_pouring")
POURING_IN_SPACE = ("bulens2023_dataset", "bulens2023_pouring_3d")
#: Where the rows are stored.
POURING_FILE = RowFile(
    "pouring.json",
    "rows of the pouring task",
    "fingerslip validate --pouring",
    "half an hour",
    (*POURING, *POURING_IN_SPACE),
    Row,
)

_NUMBERS, _STATEMENTS = "bulens2023_pouring-numbers", "bulens2023_pouring-statements"
#: Name of each published number in the scores, and one unit of its last printed digit; None where it is not judged.
_SCORES: Mapping[str, tuple[str, float | None]] = MappingProxyType(
    {
        "pouring-onset-error": ("error", 1e-3),
        "pouring-onset-error-spread": ("error_spread", None),
        "pouring-lead": ("lead", 10e-3),
        "pouring-lead-spread": ("lead_spread", None),
        "pouring-before-gross": ("before_gross", 0.0),
    }
)


def pouring_rows(
    studies: str | Path = "studies",
    results: str | Path = "results",
    workers: int = 2,
    progress: StudyProgress | None = None,
    *,
    compute: bool = False,
) -> Stored[Row]:
    """Return the rows of the pouring task: computed and stored, or those that were stored last."""

    def computed() -> tuple[Row, ...]:
        from fingerslip.study.running.runner import run_studies

        paths = [Path(studies) / f"{name}.yaml" for name in POURING]
        run_studies(paths, results_dir=results, workers=workers, progress=progress)
        section = pouring_of(Path(results), workers)
        space = pouring_in_space(Path(studies), Path(results), workers, progress)
        return (*rows_of_pouring(section, "section"), *rows_of_pouring(space, "in space"))

    return stored_rows(POURING_FILE, studies, results, computed if compute else None)


def pouring_of(results: Path, workers: int = 2) -> Unseen:
    """Film the runs of both studies, train the forest on the slides and return what it finds while rice is poured.

    The trials that the benchmark keeps for tests are not learned from. Both data sets are written beside the results.
    """
    from fingerslip.detect.simulated import film_results
    from fingerslip.detect.trial_set import write_trials

    slides, pours = (
        write_trials(film_results(results / name), results / f"{name}_trials", name.replace("_", " "))
        for name in POURING
    )
    return _tested(slides, pours, workers)


def pouring_in_space(studies: Path, results: Path, workers: int = 2, progress: StudyProgress | None = None) -> Unseen:
    """Make both data sets in space, train the forest on the slides and return what it finds while rice is poured.

    Data sets that are whole are read back; trials are learned from as in :func:`pouring_of`.
    """
    from fingerslip.study.trials.simulate import simulate_trials

    slides, pours = (
        simulate_trials(studies / f"{name}.yaml", results / f"{name}_trials", workers=workers, progress=progress)
        for name in POURING_IN_SPACE
    )
    return _tested(slides, pours, workers)


def _tested(slides: TrialSet, pours: TrialSet, workers: int) -> Unseen:
    from fingerslip.detect.samples import Sampling
    from fingerslip.detect.splits import benchmark_test_trials
    from fingerslip.detect.training import train
    from fingerslip.detect.unseen import on_unseen

    tests = benchmark_test_trials(slides.names)
    learned = [name for name in slides.names if name not in tests]
    # Some slides have only a few frames between incipient and gross slip.
    detector = train(slides, slides.onsets(), "forest", sampling=Sampling(least=0.0), names=learned, workers=workers)
    return on_unseen(detector, pours, pours.onsets("plate"))


def rows_of_pouring(found: Unseen, where: str) -> tuple[Row, ...]:
    """Return a row for each published number and statement, in both readings of the onset.

    `where` says of which sensor: 'section' or 'in space'.
    """
    from fingerslip.detect.unseen import READINGS

    return tuple(
        row
        for reading in reversed(READINGS)
        for scores in (found.scores[reading],)
        for row in (*_number_rows(scores, where, reading), *_statement_rows(scores, where, reading))
    )


def _number_rows(scores: EventScores, where: str, reading: str) -> Iterator[Row]:
    for value in published(_NUMBERS).values:
        name, resolution = _SCORES[value.id]
        ours = getattr(scores, name)
        number = ours.value if isinstance(ours, Estimate) else ours
        words = _quantity(value, scores, where, reading)
        yield number_row(words, value, number, _half_width(ours), resolution=resolution)


def _quantity(value: PublishedValue, scores: EventScores, where: str, reading: str) -> str:
    missed = f", {scores.missed} of {scores.trials} trials missed" if scores.missed else ""
    return f"{value.quantity.replace('_', ' ')} while pouring, {where}, forest ({reading}{missed})"


def _statement_rows(scores: EventScores, where: str, reading: str) -> Iterator[Row]:
    for value in published(_STATEMENTS).values:
        share = scores.gross_found.value
        named = PublishedValue(**{**vars(value), "check": f"{value.check} ({where}, {reading})"})
        yield statement_row(named, share, _half_width(scores.gross_found), None if share is None else share == 0.0)


def _half_width(estimate: object) -> float | None:
    """Return half of the interval of an estimate over trials that are drawn anew; None without one."""
    if not isinstance(estimate, Estimate) or estimate.low is None or estimate.high is None:
        return None
    return (estimate.high - estimate.low) / 2.0
