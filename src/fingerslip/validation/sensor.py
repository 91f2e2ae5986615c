"""Cordova Bulens et al. (2023) beside our sensors: the mechanics of their ridged skin, and the pouring task.

A forest that learned from slides alone is tested while rice is poured. Its runs take long, so those rows are stored,
and read back unless they are asked for. The rules of statements are in ``data/published/bulens2023.yaml``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fingerslip.detect.evaluation.scores import Estimate
from fingerslip.errors import InputError
from fingerslip.history import read_history
from fingerslip.marker_tracks import marker_tracks
from fingerslip.published import published_set
from fingerslip.results import HISTORY, RunResult
from fingerslip.slip import slide_window
from fingerslip.slip.skin_markers import share_before_centre, skin_marker_slips, stick_slip_cycles
from fingerslip.validation.evidence import Work
from fingerslip.validation.rows import Basis, Row, RowFile, Stored, number_row, statement_row, stored_rows

# What simulates, films and trains is loaded where rows are computed: stored ones are read without it.
if TYPE_CHECKING:
    import xarray as xr

    from fingerslip.detect.evaluation.crossval import Unseen
    from fingerslip.detect.evaluation.scores import EventScores
    from fingerslip.detect.trial_set import TrialSet

#: The study whose runs are compared, and the value that tells its skins apart.
SENSOR = "ridged_vs_smooth"
_RIDGED = "tactip.skin.ridges.enabled"
_DEPTH = "programme.0.press.depth"

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SensorMeasures:
    """What the statements are compared with, of one run."""

    ridged: bool
    depth: str  # indentation, as the study writes it
    before_centre: float | None  # share of the touching outer markers of the skin that slip before the central one [-]
    cycles: int | None  # stick-slip cycles in the slide
    ahead: float | None  # displacement of the central internal marker over that of the outermost ring [-]
    spread: float | None  # how far internal markers spread from incipient to overall slip [m]


def measure_sensor(run: RunResult, history: xr.Dataset) -> SensorMeasures:
    """Measure a run of a sensor with recorded markers."""
    window = slide_window(history)
    if window is None:
        raise InputError("history", "has no slide", "needs one", "use the shipped study")
    plate = history["counterface_displacement"].values[[window.first, window.last], 0]
    direction = (plate[1] - plate[0]) / np.linalg.norm(plate[1] - plate[0])
    tracks = marker_tracks(history, ("internal",))
    position, rings = tracks["position"].values, tracks["ring"].values
    # How far internal markers are along the slide since it began, (n_times, n_markers) [m].
    along = (position - position[window.first]) @ direction

    def at(time: float) -> Floats:
        return np.array([np.interp(time, history["time"].values, column) for column in along.T])

    slips, slip = skin_marker_slips(history), run.events.slip
    overall = None if slip.overall is None else at(slip.overall)
    outermost = 0.0 if overall is None else float(overall[rings == rings.max()].mean())
    spread = None
    if overall is not None and slip.incipient is not None:
        spread = float(np.ptp(overall) - np.ptp(at(slip.incipient)))
    return SensorMeasures(
        ridged=bool(run.swept[_RIDGED]),
        depth=str(run.swept[_DEPTH]),
        before_centre=None if slips is None else share_before_centre(slips),
        cycles=stick_slip_cycles(history),
        ahead=float(overall[rings == 0].mean()) / outermost if overall is not None and outermost > 0.0 else None,
        spread=spread,
    )


def sensor_rows(work: Work) -> tuple[Row, ...]:
    """Run the study of the sensor, as far as it is not finished, and return its rows; see :func:`rows_of_sensor`."""
    (study,) = work.run([SENSOR])
    return rows_of_sensor([measure_sensor(run, read_history(study.folder / run.name / HISTORY)) for run in study.runs])


def rows_of_sensor(measured: Sequence[SensorMeasures], basis: Basis = "predicted") -> tuple[Row, ...]:
    """Return a row for each statement on the mechanics of the sensor, and one for the number of cycles."""
    statements = (
        statement_row(value, _CHECKS[value.id](measured), None, basis=basis)
        for value in published_set("bulens2023-mechanics").values
    )
    (six,) = published_set("bulens2023-cycles").values
    counts = [float(slide.cycles) for slide in measured if slide.ridged and slide.cycles is not None]
    nearest = min(counts, key=lambda count: abs(count - float(six.value or 0.0)), default=None)
    name = "stick-slip cycles in 14 mm, ridged skin, nearest to the published number of four indentations"
    return (*statements, number_row(name, six, nearest, None, resolution=1.0, basis=basis))


def _least_of_ridges(name: str) -> Callable[[Sequence[SensorMeasures]], float | None]:
    """Return the least of a number over the runs with ridges; None where one of them lacks it."""

    def least(measured: Sequence[SensorMeasures]) -> float | None:
        values = [getattr(slide, name) for slide in measured if slide.ridged]
        return float(min(values)) if values and None not in values else None

    return least


def _smooth_over_ridged(measured: Sequence[SensorMeasures]) -> float | None:
    """Return the largest spread with a smooth skin over that with ridges; None where one is not known."""
    ridged = {slide.depth: slide.spread for slide in measured if slide.ridged}
    pairs = [(slide.spread, ridged.get(slide.depth)) for slide in measured if not slide.ridged]
    ratios = [abs(smooth / other) for smooth, other in pairs if smooth is not None and other]
    return max(ratios) if ratios and len(ratios) == len(pairs) else None


_CHECKS: Mapping[str, Callable[[Sequence[SensorMeasures]], float | None]] = MappingProxyType(
    {
        "centre-last": _least_of_ridges("before_centre"),
        "repeated-stick-slip": _least_of_ridges("cycles"),
        "central-marker-ahead": _least_of_ridges("ahead"),
        "smooth-skin-hides": _smooth_over_ridged,
    }
)


#: The study to learn from, and the one to be tested on: sections, and sensors in 3D.
POURING = ("bulens2023_section_slides", "bulens2023_pouring")
POURING_3D = ("bulens2023_dataset", "bulens2023_pouring_3d")
#: Where the rows are stored.
POURING_FILE = RowFile(
    "pouring.json",
    "rows of the pouring task",
    "fingerslip validate --pouring",
    "half an hour",
    (*POURING, *POURING_3D),
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


def pouring_rows(work: Work, *, compute: bool = False) -> Stored[Row]:
    """Return the rows of the pouring task: computed and stored, or those that were stored last."""

    def make_rows() -> tuple[Row, ...]:
        work.run(POURING)
        section = pouring_of(work.results, work.workers)
        return (*rows_of_pouring(section, "section"), *rows_of_pouring(pouring_3d(work), "in 3D"))

    return stored_rows(POURING_FILE, work, make_rows if compute else None)


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


def pouring_3d(work: Work) -> Unseen:
    """Make both data sets in 3D, train the forest on the slides and return what it finds while rice is poured.

    Data sets that are whole are read back; trials are learned from as in :func:`pouring_of`.
    """
    slides, pours = (trials_of(name, work) for name in POURING_3D)
    return _test(slides, pours, work.workers)


def trials_of(name: str, work: Work) -> TrialSet:
    """Simulate the data set of a study beside the results, or read it back where it is whole."""
    from fingerslip.study.trials.simulate import simulate_trials

    folder = work.results / f"{name}_trials"
    return simulate_trials(work.file(name), folder, workers=work.workers, progress=work.progress)


def _test(slides: TrialSet, pours: TrialSet, workers: int) -> Unseen:
    from fingerslip.detect.evaluation.crossval import on_unseen
    from fingerslip.detect.samples import Sampling, benchmark_test_trials
    from fingerslip.detect.training import train

    tests = benchmark_test_trials(slides.names)
    learned = [name for name in slides.names if name not in tests]
    # Some slides have only a few frames between incipient and gross slip.
    detector = train(slides, slides.onsets(), "forest", sampling=Sampling(least=0.0), names=learned, workers=workers)
    return on_unseen(detector, pours, pours.onsets("plate"))


def rows_of_pouring(detection: Unseen, where: str) -> tuple[Row, ...]:
    """Return a row for each published number and statement, in both readings of the onset.

    `where` says of which sensor: 'section' or 'in 3D'.
    """
    from fingerslip.detect.evaluation.crossval import READINGS

    return tuple(row for name in reversed(READINGS) for row in _rows_of_reading(detection.scores[name], where, name))


def _rows_of_reading(scores: EventScores, where: str, reading: str) -> Iterator[Row]:
    missed = f", {scores.missed} of {scores.trials} trials missed" if scores.missed else ""
    for value in published_set(_NUMBERS).values:
        name, resolution = _SCORES[value.id]
        ours = getattr(scores, name)
        number = ours.value if isinstance(ours, Estimate) else ours
        words = f"{value.quantity.replace('_', ' ')} while pouring, {where}, forest ({reading}{missed})"
        yield number_row(words, value, number, half_width(ours), resolution=resolution)
    for value in published_set(_STATEMENTS).values:
        named = replace(value, check=f"{value.check} ({where}, {reading})")
        yield statement_row(named, scores.gross_found.value, half_width(scores.gross_found))


def half_width(estimate: object) -> float | None:
    """Return half of the interval of an estimate over trials that are drawn anew; None without one."""
    if not isinstance(estimate, Estimate) or estimate.low is None or estimate.high is None:
        return None
    return (estimate.high - estimate.low) / 2.0
