"""The mechanical statements of Cordova Bulens et al. (2023) on their ridged sensor, beside its section.

The thresholds are written beside the statements in ``data/published/bulens2023.yaml``.

The pouring task of Cordova Bulens et al. (2023) beside a simulated one: a forest that learned from slides alone.

Its runs take long, so the rows are stored, and read back unless they are asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.detect.evaluation.scores import Estimate
from fingerslip.errors import InputError
from fingerslip.history import read_history
from fingerslip.marker_tracks import marker_tracks
from fingerslip.published import PublishedValue, published_set
from fingerslip.results import HISTORY, RunResult, StudyResult
from fingerslip.slip import slide_window
from fingerslip.slip.skin_markers import share_before_centre, skin_marker_slips, stick_slip_cycles
from fingerslip.study.running.progress import StudyProgress
from fingerslip.study.running.runner import run_studies
from fingerslip.validation.checks import Finding
from fingerslip.validation.rows import Basis, Row, RowFile, Stored, number_row, statement_row, stored_rows

if TYPE_CHECKING:
    import xarray as xr

    from fingerslip.detect.evaluation.scores import EventScores
    from fingerslip.detect.trial_set import TrialSet
    from fingerslip.detect.unseen import Unseen

__all__ = [
    "POURING",
    "POURING_FILE",
    "POURING_IN_SPACE",
    "SENSOR",
    "SensorMeasures",
    "measure_sensor",
    "pouring_in_space",
    "pouring_of",
    "pouring_rows",
    "rows_of_pouring",
    "rows_of_sensor",
    "sensor_rows",
]


#: The study whose runs are compared, and the value that tells its skins apart.
SENSOR = "ridged_vs_smooth"
_RIDGED = "tactip.skin.ridges.enabled"
_DEPTH = "programme.0.press.depth"
_CYCLES = 2
_HIDDEN = 0.5

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SensorMeasures:
    """What the statements are compared with, of one run."""

    ridged: bool  # whether the skin has ridges
    depth: str  # indentation, as the study writes it
    before_centre: float | None  # share of the touching outer markers of the skin that slip before the central one [-]
    cycles: int | None  # stick-slip cycles in the slide
    ahead: float | None  # [-]
    spread: float | None  # [m]


def measure_sensor(run: RunResult, history: xr.Dataset) -> SensorMeasures:
    """Measure a run of a sensor with recorded markers."""
    slips, slip = skin_marker_slips(history), run.events.slip
    along, rings = _along_slide(history)
    times = history["time"].values
    at = {name: None if time is None else _at(times, along, time) for name, time in
          (("incipient", slip.incipient), ("overall", slip.overall))}  # fmt: skip
    incipient, overall = at["incipient"], at["overall"]
    return SensorMeasures(
        ridged=bool(run.swept[_RIDGED]),
        depth=str(run.swept[_DEPTH]),
        before_centre=None if slips is None else share_before_centre(slips),
        cycles=stick_slip_cycles(history),
        ahead=None if overall is None else _ahead(overall, rings),
        spread=None if incipient is None or overall is None else float(np.ptp(overall) - np.ptp(incipient)),
    )


def _along_slide(history: xr.Dataset) -> tuple[Floats, NDArray[np.int64]]:
    """Return how far internal markers are along the slide since it began (n_times, n_markers) [m], and their rings."""
    window = slide_window(history)
    if window is None:
        raise InputError("history", "has no slide", "needs one", "use the shipped study")
    plate = history["counterface_displacement"].values[[window.first, window.last], 0]
    direction = (plate[1] - plate[0]) / np.linalg.norm(plate[1] - plate[0])
    tracks = marker_tracks(history, ("internal",))
    position = tracks["position"].values
    along: Floats = (position - position[window.first]) @ direction
    return along, tracks["ring"].values


def _at(times: Floats, along: Floats, time: float) -> Floats:
    return np.array([np.interp(time, times, column) for column in along.T])


def _ahead(along: Floats, rings: NDArray[np.int64]) -> float | None:
    outermost = float(along[rings == rings.max()].mean())
    return float(along[rings == 0].mean()) / outermost if outermost > 0.0 else None


def sensor_rows(
    studies: str | Path = "studies",
    results: str | Path = "results",
    workers: int = 2,
    progress: StudyProgress | None = None,
) -> tuple[Row, ...]:
    """Run the study of the sensor, as far as it is not finished, and return its rows; see :func:`rows_of_sensor`."""
    path = Path(studies) / f"{SENSOR}.yaml"
    if not path.is_file():
        repair = "name the folder of the shipped studies, or run in the folder of the project"
        raise InputError(str(path), "is not there", f"validate needs the study {SENSOR}", repair)
    (outcome,) = run_studies([path], results_dir=results, workers=workers, progress=progress)
    return rows_of_sensor(_measure(outcome))


def _measure(study: StudyResult) -> tuple[SensorMeasures, ...]:
    return tuple(measure_sensor(run, read_history(study.folder / run.name / HISTORY)) for run in study.runs)


def rows_of_sensor(measured: Sequence[SensorMeasures], basis: Basis = "predicted") -> tuple[Row, ...]:
    """Return a row for each statement on the mechanics of the sensor, and one for the number of cycles."""
    statements = (
        statement_row(value, answer.number, None, answer.holds, basis=basis)
        for value in published_set("bulens2023-mechanics").values
        for answer in (_CHECKS[value.id](measured),)
    )
    (six,) = published_set("bulens2023-cycles").values
    nearest = _nearest([slide.cycles for slide in measured if slide.ridged], float(six.value or 0.0))
    name = "stick-slip cycles in 14 mm, ridged skin, nearest to the published number of four indentations"
    return (*statements, number_row(name, six, nearest, None, resolution=1.0, basis=basis))


def _nearest(counts: Sequence[int | None], wanted: float) -> float | None:
    numbers = [float(count) for count in counts if count is not None]
    return min(numbers, key=lambda count: abs(count - wanted)) if numbers else None


def _least_of_ridges(measured: Sequence[SensorMeasures], name: str) -> float | None:
    """Return the least of a number over the runs with ridges; None where one of them lacks it."""
    values = [getattr(slide, name) for slide in measured if slide.ridged]
    return float(min(values)) if values and None not in values else None


def _centre_last(measured: Sequence[SensorMeasures]) -> Finding:
    number = _least_of_ridges(measured, "before_centre")
    return Finding() if number is None else Finding(number, number >= 1.0)


def _repeats(measured: Sequence[SensorMeasures]) -> Finding:
    number = _least_of_ridges(measured, "cycles")
    return Finding() if number is None else Finding(number, number >= _CYCLES)


def _centre_ahead(measured: Sequence[SensorMeasures]) -> Finding:
    number = _least_of_ridges(measured, "ahead")
    return Finding() if number is None else Finding(number, number > 1.0)


def _smooth_hides(measured: Sequence[SensorMeasures]) -> Finding:
    ridged = {slide.depth: slide.spread for slide in measured if slide.ridged}
    ratios = [
        None
        if slide.spread is None or not ridged.get(slide.depth)
        else abs(slide.spread / (ridged[slide.depth] or np.nan))
        for slide in measured
        if not slide.ridged
    ]
    finite = [ratio for ratio in ratios if ratio is not None]
    return Finding(max(finite), max(finite) < _HIDDEN) if finite and len(finite) == len(ratios) else Finding()


_CHECKS: Mapping[str, Callable[[Sequence[SensorMeasures]], Finding]] = MappingProxyType(
    {
        "centre-last": _centre_last,
        "repeated-stick-slip": _repeats,
        "central-marker-ahead": _centre_ahead,
        "smooth-skin-hides": _smooth_hides,
    }
)


# What simulates, films and trains is loaded where rows are computed: stored ones are read without it.


#: The study to learn from, and the one to be tested on: sections, and sensors in 3D.
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
        return (*rows_of_pouring(section, "section"), *rows_of_pouring(space, "in 3D"))

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
    return _test(slides, pours, workers)


def pouring_in_space(studies: Path, results: Path, workers: int = 2, progress: StudyProgress | None = None) -> Unseen:
    """Make both data sets in 3D, train the forest on the slides and return what it finds while rice is poured.

    Data sets that are whole are read back; trials are learned from as in :func:`pouring_of`.
    """
    from fingerslip.study.trials.simulate import simulate_trials

    slides, pours = (
        simulate_trials(studies / f"{name}.yaml", results / f"{name}_trials", workers=workers, progress=progress)
        for name in POURING_IN_SPACE
    )
    return _test(slides, pours, workers)


def _test(slides: TrialSet, pours: TrialSet, workers: int) -> Unseen:
    from fingerslip.detect.samples import Sampling, benchmark_test_trials
    from fingerslip.detect.training import train
    from fingerslip.detect.unseen import on_unseen

    tests = benchmark_test_trials(slides.names)
    learned = [name for name in slides.names if name not in tests]
    # Some slides have only a few frames between incipient and gross slip.
    detector = train(slides, slides.onsets(), "forest", sampling=Sampling(least=0.0), names=learned, workers=workers)
    return on_unseen(detector, pours, pours.onsets("plate"))


def rows_of_pouring(detection: Unseen, where: str) -> tuple[Row, ...]:
    """Return a row for each published number and statement, in both readings of the onset.

    `where` says of which sensor: 'section' or 'in 3D'.
    """
    from fingerslip.detect.unseen import READINGS

    return tuple(
        row
        for reading in reversed(READINGS)
        for scores in (detection.scores[reading],)
        for row in (*_number_rows(scores, where, reading), *_statement_rows(scores, where, reading))
    )


def _number_rows(scores: EventScores, where: str, reading: str) -> Iterator[Row]:
    for value in published_set(_NUMBERS).values:
        name, resolution = _SCORES[value.id]
        ours = getattr(scores, name)
        number = ours.value if isinstance(ours, Estimate) else ours
        words = _quantity(value, scores, where, reading)
        yield number_row(words, value, number, _half_width(ours), resolution=resolution)


def _quantity(value: PublishedValue, scores: EventScores, where: str, reading: str) -> str:
    missed = f", {scores.missed} of {scores.trials} trials missed" if scores.missed else ""
    return f"{value.quantity.replace('_', ' ')} while pouring, {where}, forest ({reading}{missed})"


def _statement_rows(scores: EventScores, where: str, reading: str) -> Iterator[Row]:
    for value in published_set(_STATEMENTS).values:
        share = scores.gross_found.value
        named = PublishedValue(**{**vars(value), "check": f"{value.check} ({where}, {reading})"})
        yield statement_row(named, share, _half_width(scores.gross_found), None if share is None else share == 0.0)


def _half_width(estimate: object) -> float | None:
    """Return half of the interval of an estimate over trials that are drawn anew; None without one."""
    if not isinstance(estimate, Estimate) or estimate.low is None or estimate.high is None:
        return None
    return (estimate.high - estimate.low) / 2.0
