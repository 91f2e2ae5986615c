"""Cordova Bulens et al. (2023) beside our sensors: the mechanics of their ridged skin, the pouring task, and detectors.

A forest that learned from slides alone is tested while rice is poured, and classifiers are compared on simulated
slides. These runs take long, so their rows are stored, and read back unless they are asked for. The rules of statements
are in ``data/published/bulens2023.yaml``.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.detect.evaluation.scores import Estimate
from fingerslip.detect.labels import NO_SLIP, LabelSettings
from fingerslip.errors import InputError
from fingerslip.history import read_history
from fingerslip.libraries import xr
from fingerslip.marker_tracks import marker_tracks
from fingerslip.published import published_set
from fingerslip.results import HISTORY, RunResult
from fingerslip.slip import slide_window
from fingerslip.slip.front import share_before_centre, stick_slip_cycles
from fingerslip.validation.evidence import Work
from fingerslip.validation.rows import Basis, Row, RowFile, Stored, number_row, statement_row, stored_rows

# What simulates, films and trains is loaded where rows are computed: stored ones are read without it.
if TYPE_CHECKING:
    from fingerslip.detect.evaluation.crossval import Evaluation, Unseen
    from fingerslip.detect.evaluation.scores import FrameScores
    from fingerslip.detect.trials import TrialSet

#: The study whose runs are compared, and the value that tells its skins apart.
SENSOR = "ridged_vs_smooth"
_RIDGED = "tactip.skin.ridges.enabled"
_DEPTH = "programme.0.press.depth"


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

    slip = run.events.slip
    overall = None if slip.overall is None else at(slip.overall)
    outermost = 0.0 if overall is None else float(overall[rings == rings.max()].mean())
    spread = None
    if overall is not None and slip.incipient is not None:
        spread = float(np.ptp(overall) - np.ptp(at(slip.incipient)))
    return SensorMeasures(
        ridged=bool(run.swept[_RIDGED]),
        depth=str(run.swept[_DEPTH]),
        before_centre=share_before_centre(history),
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
    return (*statements, number_row(name, six, nearest, None, basis=basis))


def _least_of_ridges(name: str) -> Callable[[Sequence[SensorMeasures]], float | None]:
    """Return the least of a number over the runs with ridges; None where one of them lacks it."""

    def least(measured: Sequence[SensorMeasures]) -> float | None:
        values = [getattr(slide, name) for slide in measured if slide.ridged]
        return float(min(values)) if values and None not in values else None

    return least


def _ratio_of_smooth(measured: Sequence[SensorMeasures]) -> float | None:
    """Return the largest spread with a smooth skin over that with ridges; None where one is not known."""
    ridged = {slide.depth: slide.spread for slide in measured if slide.ridged}
    pairs = [(slide.spread, ridged.get(slide.depth)) for slide in measured if not slide.ridged]
    ratios = [abs(smooth / other) for smooth, other in pairs if smooth is not None and other]
    return max(ratios) if ratios and len(ratios) == len(pairs) else None


_CHECKS: Mapping[str, Callable[[Sequence[SensorMeasures]], float | None]] = {
    "centre-last": _least_of_ridges("before_centre"),
    "repeated-stick-slip": _least_of_ridges("cycles"),
    "central-marker-ahead": _least_of_ridges("ahead"),
    "smooth-skin-hides": _ratio_of_smooth,
}


#: The study to learn from, and the one to be tested on: sections, and sensors in 3D.
POURING = ("bulens2023_section_slides", "bulens2023_pouring")
POURING_3D = ("bulens2023_dataset", "bulens2023_pouring_3d")
#: Where the rows are stored.
POURING_FILE = RowFile(
    "pouring.json",
    "rows of the pouring task",
    "fingerslip validate --pouring",
    "hours",
    (*POURING, *POURING_3D),
    Row,
)

#: Name of each published number in the scores.
_SCORES: Mapping[str, str] = {
    "pouring-onset-error": "error",
    "pouring-onset-error-spread": "error_spread",
    "pouring-lead": "lead_of_all",
    "pouring-lead-spread": "lead_of_all_spread",
    "pouring-before-gross": "before_gross",
}


def pouring_rows(work: Work, *, compute: bool = False) -> Stored[Row]:
    """Return the rows of the pouring task: computed and stored, or those that were stored last."""

    def make_rows() -> tuple[Row, ...]:
        work.run(POURING)
        section = pouring_of(*(filmed_trials(name, work) for name in POURING), workers=work.workers)
        solid = pouring_of(*(trials_of(name, work) for name in POURING_3D), workers=work.workers)
        return (*rows_of_pouring(section, "section"), *rows_of_pouring(solid, "in 3D"))

    return stored_rows(POURING_FILE, work, make_rows if compute else None)


def filmed_trials(name: str, work: Work) -> TrialSet:
    """Film the runs of a study, and write the data set beside the results."""
    from fingerslip.detect.simulated import film_results
    from fingerslip.detect.trials import write_trials

    return write_trials(film_results(work.results / name), work.results / f"{name}_trials", name.replace("_", " "))


def trials_of(name: str, work: Work) -> TrialSet:
    """Simulate the data set of a study beside the results, or read it back where it is whole."""
    from fingerslip.study.trials.simulate import simulate_trials

    folder = work.results / f"{name}_trials"
    return simulate_trials(work.file(name), folder, workers=work.workers, progress=work.progress)


def pouring_of(slides: TrialSet, pours: TrialSet, *, workers: int) -> Unseen:
    """Train the forest on slides, without the trials kept for tests; return what it finds while rice is poured."""
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

    rows = []
    for reading in reversed(READINGS):
        scores = detection.scores[reading]
        missed = f", {scores.missed} of {scores.trials} trials missed" if scores.missed else ""
        for value in published_set("bulens2023_pouring-numbers").values:
            ours = getattr(scores, _SCORES[value.id])
            number = ours.value if isinstance(ours, Estimate) else ours
            words = f"{value.quantity.replace('_', ' ')} while pouring, {where}, forest ({reading}{missed})"
            rows.append(number_row(words, value, number, half_width(ours)))
        for value in published_set("bulens2023_pouring-statements").values:
            named = replace(value, check=f"{value.check} ({where}, {reading})")
            rows.append(statement_row(named, scores.gross_found.value, half_width(scores.gross_found)))
    return tuple(rows)


def half_width(estimate: object) -> float | None:
    """Return half of the interval of an estimate over trials that are drawn anew; None without one."""
    if not isinstance(estimate, Estimate) or estimate.low is None or estimate.high is None:
        return None
    return (estimate.high - estimate.low) / 2.0


#: The study of the data set.
DATA_SET = "bulens2023_dataset"
#: Where the rows are stored.
DETECTION_FILE = RowFile(
    "detection.json", "rows of detectors", "fingerslip validate --detection", "about an hour", (DATA_SET,), Row
)

_FOLDS = 5
#: Conditions that are left out, and how that is called.
_LEFT_OUT: Mapping[str, str] = {
    "direction": "a direction not seen",
    "indentation": "an indentation not seen",
    "friction_coefficient": "a quarter of the frictions not seen",
}
#: Classifiers that the paper has not: they stand beside its forest, and are not judged by it.
_OTHERS = ("boosting", "logistic")
_COMPARED = ("forest", "svm", *_OTHERS)
_CLASSES = ("no-slip", "incipient", "gross")


@dataclass(frozen=True)
class Detection:
    """Scores on single frames, by name of the classifier."""

    by_sample: Mapping[str, FrameScores]  # with frames split 90 to 10 whatever their trial
    by_trial: Mapping[str, FrameScores]  # on trials that were not seen, in five folds
    left_out: Mapping[str, Mapping[str, FrameScores]] = field(default_factory=dict)
    mechanics: Mapping[str, float] = field(default_factory=dict)  # of the slides in 3D, by the name of the statement


def detection_rows(work: Work, *, compute: bool = False) -> Stored[Row]:
    """Return the rows of the detectors: computed and stored, or those that were stored last."""
    output = work.results / "detection"

    def make_rows() -> tuple[Row, ...]:
        return rows_of_detection(detection_of(begun_detection(trials_of(DATA_SET, work), work.workers, output)))

    stored = stored_rows(DETECTION_FILE, work, make_rows if compute else None)
    if stored.computed:
        from fingerslip.detect.evaluation.crossval import parts_beside

        parts_beside(output).remove()
    return stored


def begun_detection(trials: TrialSet, workers: int = 2, output: Path | None = None) -> Evaluation:
    """Sample the frames of the data set as published."""
    from fingerslip.detect.classifiers import CLASSIFIERS
    from fingerslip.detect.evaluation.crossval import begin_evaluation
    from fingerslip.detect.features import MotionSettings
    from fingerslip.detect.samples import Sampling

    candidates = [CLASSIFIERS[name] for name in _COMPARED]
    return begin_evaluation(
        trials, trials.onsets(), candidates, MotionSettings(), Sampling(), workers=workers, output=output
    )


def detection_of(begun: Evaluation) -> Detection:
    """Fit the forest and a support vector machine as published, the other two beside them, and score them."""
    from fingerslip.detect.classifiers import CLASSIFIERS
    from fingerslip.detect.evaluation.scores import frame_scores_of
    from fingerslip.detect.samples import grouped_folds, left_out

    def scores_of(tests: Sequence[Sequence[str]]) -> dict[str, FrameScores]:
        return {name: begun.scores(begun.by_group(CLASSIFIERS[name], tests)) for name in _COMPARED}

    trials = begun.trials
    by_sample = {name: frame_scores_of(begun.by_sample(CLASSIFIERS[name])) for name in _COMPARED}
    by_trial = scores_of(grouped_folds(trials.names, _FOLDS, 0))
    groups = {words: left_out(trials.conditions, condition) for condition, words in _LEFT_OUT.items()}
    left = {words: scores_of(tuple(group.values())) for words, group in groups.items()}
    return Detection(by_sample, by_trial, left, measure_trials(trials))


def measure_trials(trials: TrialSet) -> dict[str, float]:
    """Return what statements on markers are compared with: the mean over the trials of an indentation, least of all."""
    onsets, measured = trials.onsets(), defaultdict(list)
    for name in trials.names:
        for statement, value in _marker_measures(trials.tracks(name), onsets[name].gross).items():
            measured[statement, trials.conditions[name]["indentation"]].append(value)
    means = {key: float(np.mean(values)) for key, values in measured.items()}
    return {word: min(mean for (of, _), mean in means.items() if of == word) for word in {of for of, _ in means}}


def _marker_measures(tracks: xr.Dataset, gross: float | None) -> dict[str, float]:
    """Return the share of the outer markers of the skin that slip before the central one, and how far this is ahead.

    A marker slips where the outer camera, which goes with the plate, sees it 1 px from rest, as is printed of the
    central one.
    """
    labels, ring, position = LabelSettings(), tracks["ring"].values, tracks["position"].values
    outside, central, outermost = tracks["kind"].values.astype(str) == "external", ring == 0, ring == ring.max()
    moved = np.linalg.norm(position - position[: labels.rest_frames].mean(axis=0), axis=2)
    slips = np.where((moved > labels.gross).any(axis=0), (moved > labels.gross).argmax(axis=0), len(moved))
    touching, centre = outside & np.isfinite(moved[0]), slips[outside & central].min()
    measures = {"centre-last": float(np.mean(slips[touching & ~central] < centre))}
    if gross is not None:
        then = moved[np.searchsorted(tracks["time"].values, gross)]
        measures["central-marker-ahead"] = float(then[~outside & central].mean() / then[~outside & outermost].mean())
    return measures


def rows_of_detection(detection: Detection) -> tuple[Row, ...]:
    """Return a row for each published value in both splits, and for accuracies with conditions left out."""
    splits = {"frames split 90 to 10": detection.by_sample, "trials not seen": detection.by_trial}
    rows: list[Row] = []
    for split, scores in splits.items():
        rows += _number_rows(split, scores)
        for value in published_set("bulens2023_detection-statements").values:
            slips = scores["forest"].matrix[NO_SLIP + 1 :]
            row = statement_row(value, float(slips[:, NO_SLIP].sum() / slips.sum()), None)
            rows.append(replace(row, quantity=f"{row.quantity}; simulated slides, {split}"))
    for split, scores in detection.left_out.items():
        rows += _number_rows(split, scores, accuracies=True)
    for value in published_set("bulens2023-mechanics").values:
        if value.id in detection.mechanics:
            row = statement_row(value, detection.mechanics[value.id], None)
            rows.append(replace(row, quantity=f"{row.quantity}; simulated slides in 3D"))
    return tuple(rows)


def _number_rows(split: str, scores: Mapping[str, FrameScores], *, accuracies: bool = False) -> Iterator[Row]:
    """Yield a row for each published number, or accuracy, and each of ours; half the interval is the uncertainty."""
    for value in published_set("bulens2023_detection-numbers").values:
        kind, _, rest = value.id.partition("-")
        compared = [(f"accuracy, {kind}", scores[kind].accuracy)]
        if rest != "accuracy":
            entry, _, score = rest.rpartition("-")
            compared = [(f"{score} of {entry}, forest", getattr(scores["forest"], score)[_CLASSES.index(entry)])]
        for name, estimate in compared if rest == "accuracy" or not accuracies else ():
            yield number_row(f"{name}, simulated slides, {split}", value, estimate.value, half_width(estimate))
        for name in _OTHERS if value.id == "forest-accuracy" else ():
            words = f"accuracy, {name} beside the published forest, simulated slides, {split}"
            accuracy = scores[name].accuracy
            yield number_row(words, value, accuracy.value, half_width(accuracy), comparable=False)
