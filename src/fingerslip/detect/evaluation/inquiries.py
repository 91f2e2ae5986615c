"""What classifiers need, use and bear: learning curve, importance of rings, disturbed tracks, and what is assumed."""

from __future__ import annotations

import itertools
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from fingerslip.arrays import Floats, Singles
from fingerslip.detect.classifiers import Candidate, describe, probabilities, union_of_sets
from fingerslip.detect.evaluation.crossval import Evaluation, begin_evaluation, parts_beside
from fingerslip.detect.evaluation.figures import (
    assumption_figure,
    importance_figure,
    learning_curve_figure,
    robustness_figure,
)
from fingerslip.detect.evaluation.scores import (
    INTERVALS,
    Estimate,
    frame_scores_of,
    ratio_estimate,
    table_of,
    write_tables,
)
from fingerslip.detect.features import FeatureSettings, MotionSettings, features_of, motion_of, ring_of_features
from fingerslip.detect.labels import LabelSettings, Onsets, classes_at, labels_from_external_markers, times_of
from fingerslip.detect.samples import (
    Samples,
    Sampling,
    benchmark_test_trials,
    columns_of,
    grouped_folds,
    held_out,
    joined_samples,
    left_out,
    trial_samples,
)
from fingerslip.detect.session import Choices
from fingerslip.detect.training import Detector, candidate_of_name
from fingerslip.detect.trials import TrialSet, check_labels, condition_text, open_trials
from fingerslip.errors import InputError, shorten
from fingerslip.libraries import xr
from fingerslip.report.figures.style import save_figure
from fingerslip.tables.table import Column, Table


def importance_by_ring(
    run: Evaluation, candidate: Candidate, tests: Sequence[str], *, draws: int = 5
) -> dict[int, Estimate]:
    """Return by how much accuracy falls when all features of a ring are shuffled among the test samples.

    Permutation importance (Breiman 2001), for a ring at a time: its markers say nearly the same, and one of them alone
    would not be missed. Intervals are over the test trials; shuffles are averaged. A classifier that sees no single
    markers has none.
    """
    samples = run.samples
    columns = columns_of(samples.names, candidate.sets)
    rings = ring_of_features([samples.names[column] for column in columns], samples.ring)
    if set(rings) == {None}:
        return {}
    rows, draw = samples.rows(tests), np.random.default_rng(run.seed)
    estimator, _ = run.fit_rows(candidate, samples.rows(samples.trials_without(tests)), rows)
    values, classes = samples.features(rows, candidate.sets), samples.classes[rows]
    _, trial = np.unique(samples.trial[rows], return_inverse=True)

    def right(values: Singles) -> Floats:
        """Return how many samples of each trial are right."""
        return np.bincount(trial, weights=probabilities(estimator, values).argmax(axis=1) == classes).astype(float)

    frames, whole = np.bincount(trial).astype(float), right(values)
    importance = {}
    for ring in sorted({ring for ring in rings if ring is not None}):
        inside, remaining = np.array([other == ring for other in rings]), np.zeros(len(frames))
        for _ in range(draws):
            mixed = values.copy()
            mixed[:, inside] = values[draw.permutation(len(values))][:, inside]
            remaining += right(mixed) / draws
        importance[ring] = ratio_estimate(whole - remaining, frames, run.seed)
    return importance


#: What may be done to tracks: the amounts that it takes, in words and as a rule.
DISTURBANCES: Mapping[str, tuple[str, Callable[[float], bool]]] = MappingProxyType(
    {
        "lost": ("a share from 0 up to, not including, 1", lambda amount: 0.0 <= amount < 1.0),
        "noise": ("a standard deviation >= 0", lambda amount: amount >= 0.0),
        "slower": ("a whole number >= 1", lambda amount: amount >= 1 and amount % 1 == 0),
    }
)


def disturb(tracks: xr.Dataset, disturbance: str, amount: float, seed: int = 0) -> xr.Dataset:
    """Return tracks with a disturbance of :data:`DISTURBANCES`; those of external markers too."""
    allowed, is_possible = DISTURBANCES[disturbance]
    if not is_possible(amount):
        raise InputError(disturbance, f"got {amount}", f"needs {allowed}")
    draw, position, quality = np.random.default_rng(seed), tracks["position"], tracks["quality"]
    if disturbance == "slower":
        return tracks.isel(time=slice(0, None, int(amount)))
    if disturbance == "noise":
        noise = amount * draw.standard_normal(position.shape)
        return tracks.assign(position=position.copy(data=position.values + noise))
    gone = draw.random(quality.shape) < amount
    return tracks.assign(
        position=position.copy(data=np.where(gone[:, :, None], np.nan, position.values)),
        quality=quality.copy(data=np.where(gone, 0.0, quality.values)),
    )


def robustness_of(
    detector: Detector,
    trials: TrialSet,
    onsets: Mapping[str, Onsets],
    names: Sequence[str],
    levels: Sequence[tuple[str, float]],
    *,
    seed: int = 0,
) -> list[tuple[str, float, Estimate, float]]:
    """Return how many frames of test trials a detector gets right at each level of disturbance.

    Rows are the disturbance, its amount, the share of the frames that could be classified and are right, and that of
    those with too few markers. With every so manieth frame, the frames at rest and those of a velocity are fewer too,
    so that they last as long.
    """
    results = []
    for disturbance, amount in levels:
        motion, counts = detector.features.motion, []
        if disturbance == "slower" and amount >= 1:
            rest_frames, window = max(1, int(motion.rest_frames / amount)), max(2, round(motion.window / amount))
            motion = replace(motion, rest_frames=rest_frames, window=window)
        for name in names:
            tracks = disturb(trials.tracks(name), disturbance, amount, seed=seed + zlib.crc32(name.encode()))
            moved = motion_of(tracks, motion)
            classes = probabilities(detector.estimator, features_of(moved, detector.features)).argmax(axis=1)
            right = (classes == classes_at(onsets[name], moved.time))[moved.usable].sum()
            counts.append((right, moved.usable.sum(), len(moved.time)))
        rights, usable, frames = np.array(counts, dtype=float).reshape(-1, 3).T
        unusable = float(1.0 - usable.sum() / max(frames.sum(), 1.0))
        results.append((disturbance, amount, ratio_estimate(rights, usable, seed), unusable))
    return results


@dataclass(frozen=True)
class Assumption:
    """Values that a paper does not print, as they may be."""

    quantity: str  # what is assumed, in words
    value: str
    labels: LabelSettings | str = field(default_factory=LabelSettings)
    motion: MotionSettings = field(default_factory=MotionSettings)
    noise: float = 0.0  # standard deviation of noise that is added to all positions, in the unit of the tracks
    trials: tuple[str, ...] = ()  # names of the trials that it is about, as others are not like them

    @property
    def inputs(self) -> dict[str, object]:
        """Its values without its words."""
        return {name: value for name, value in asdict(self).items() if name not in ("quantity", "value")}


#: Sizes of a pixel that are likely, too [m].
_PIXELS = (0.045e-3, 0.09e-3)


def likely_assumptions(
    metres_per_pixel: float, motion: MotionSettings, stored: Sequence[str] = ()
) -> tuple[Assumption, ...]:
    """Return what may be assumed of the trials of Cordova Bulens et al. 2023: first as they are, then one change each.

    A pixel of another size [m] makes the printed thresholds, 2 and 1 px, other lengths; that is all it does here. The
    noise stays as it is in metres.
    """
    default = LabelSettings(rest_frames=motion.rest_frames)
    base = Assumption("as in the data set", f"{1e3 * metres_per_pixel:.3g} mm a pixel", default, motion)

    def changed(quantity: str, value: str, **values: Any) -> Assumption:
        return replace(base, quantity=quantity, value=value, **values)

    def thresholds(share: float, *names: str) -> LabelSettings:
        return replace(default, **{name: share * getattr(default, name) for name in names})

    sizes = {f"{1e3 * size:.3g} mm": thresholds(size / metres_per_pixel, "incipient", "gross") for size in _PIXELS}
    windows = (max(2, motion.window // 3), 3 * motion.window)
    return (
        base,
        *(changed("size of a pixel", words, labels=labels) for words, labels in sizes.items()),
        *(
            changed(f"threshold of {name} slip", f"{share * value:g} px", labels=thresholds(share, name))
            for name, value in (("incipient", default.incipient), ("gross", default.gross))
            for share in (0.5, 2.0)
        ),
        *(changed("labels", name.replace("_", " "), labels=name) for name in stored),
        *(changed("frames in a speed", f"{frames}", motion=replace(motion, window=frames)) for frames in windows),
        changed("noise of positions", "0.1 px more", noise=0.1),
    )


def each_alone(trials: TrialSet, conditions: Sequence[str], base: Assumption) -> tuple[Assumption, ...]:
    """Return an assumption for each combination of the values of conditions: trials of these alone are there.

    Where a condition is a value of the sensor that a paper does not print, such as the stiffness of its skin, each is
    another sensor: to learn from all of them together would ask something else.
    """
    groups = [left_out(trials.conditions, condition) for condition in conditions]
    assumptions = []
    for values in itertools.product(*groups) if groups else ():
        inside = set(trials.names).intersection(*(group[value] for group, value in zip(groups, values, strict=True)))
        names = tuple(name for name in trials.names if name in inside)
        words = ", ".join(condition_text(key, value) for key, value in zip(conditions, values, strict=True))
        assumptions += [replace(base, quantity="trials alone of", value=words, trials=names)] if names else []
    return tuple(assumptions)


@dataclass(frozen=True)
class Sensitivity:
    """What accuracies come to with an assumption."""

    assumption: Assumption
    matrices: Mapping[str, NDArray[np.intp]]  # (n_trials, 3, 3), by classifier
    incipient: float  # median onset of the labels [s]
    gross: float  # median onset of the labels [s]

    @property
    def accuracies(self) -> dict[str, Estimate]:
        """Share of right frames of each classifier."""
        return {name: frame_scores_of(matrix).accuracy for name, matrix in self.matrices.items()}

    def of_condition(self, trials: TrialSet, condition: str) -> dict[str, dict[str, Estimate]]:
        """Return each classifier's accuracies on the trials of each value of a condition, or quarter of its range."""
        rows = {value: np.isin(trials.names, names) for value, names in left_out(trials.conditions, condition).items()}
        return {
            value: {name: frame_scores_of(matrix[inside]).accuracy for name, matrix in self.matrices.items()}
            for value, inside in rows.items()
        }


def sensitivity_of(
    trials: TrialSet,
    assumptions: Sequence[Assumption],
    candidates: Sequence[Candidate],
    sampling: Sampling,
    *,
    folds: int = 5,
    seed: int = 0,
    workers: int = 1,
    output: Path | None = None,
) -> Iterator[Sensitivity]:
    """Yield what classifiers come to with each assumption, on trials that they have not seen."""
    for (motion, _), same in itertools.groupby(assumptions, lambda entry: (entry.motion, entry.noise)):
        group, settings = list(same), FeatureSettings(union_of_sets(candidates), motion)
        labelled: list[tuple[Samples, dict[str, Onsets]]] = []
        for number, assumption in enumerate(group):
            parts = parts_beside(output, trials.digest, asdict(sampling), assumption.inputs)
            inputs = [[entry.name, *describe(entry, seed)] for entry in candidates], folds, seed
            stored = parts.read("sensitivity", inputs)
            if stored is None:
                labelled = labelled or _label(trials, group, settings, sampling, seed)
                samples, onsets = labelled[number]
                run = Evaluation(trials, onsets, samples, motion, seed, workers, parts=parts)
                tests = grouped_folds(samples.trials, folds, seed)
                matrices = np.array([run.matrices(run.by_group(entry, tests)) for entry in candidates])
                times = np.nanmedian(times_of(onsets.values()), axis=0)
                stored = parts.write("sensitivity", inputs, {"matrices": matrices, "times": times})
            by_name = {entry.name: matrix for entry, matrix in zip(candidates, stored["matrices"], strict=True)}
            yield Sensitivity(assumption, by_name, *stored["times"].tolist())


def _label(
    trials: TrialSet, assumptions: Sequence[Assumption], settings: FeatureSettings, sampling: Sampling, seed: int
) -> list[tuple[Samples, dict[str, Onsets]]]:
    """Return samples and labels with each of some assumptions, which read motion in one way; trials are read once."""
    samples: list[list[Samples]] = [[] for _ in assumptions]
    labels: list[dict[str, Onsets]] = [{} for _ in assumptions]
    for name in trials.names:
        tracks, noise = trials.tracks(name), assumptions[0].noise
        if noise:
            tracks = disturb(tracks, "noise", noise, seed + zlib.crc32(name.encode()))
        motion, stored = motion_of(tracks, settings.motion), trials.labels(name)
        for number, assumption in enumerate(assumptions):
            source = assumption.labels
            if assumption.trials and name not in assumption.trials:
                continue
            if isinstance(source, str) and source not in stored:
                raise InputError(f"{trials.folder}: {name}", f"has no labels {source!r}", f"has {', '.join(stored)}")
            onsets = stored[source] if isinstance(source, str) else labels_from_external_markers(tracks, source)
            check_labels({name: onsets}, [name])
            labels[number][name] = onsets
            samples[number].append(trial_samples(name, motion, onsets, settings, sampling))
    return [(joined_samples(entry), label) for entry, label in zip(samples, labels, strict=True)]


def levels_of(**texts: str) -> list[tuple[str, float]]:
    """Return disturbances and their amounts, which the command line writes with commas between them."""
    levels = []
    for name, text in texts.items():
        try:
            levels += [(name, float(part)) for part in text.split(",") if part.strip()]
        except ValueError:
            fault, repair = f"got {shorten(text)!r}", f"write --{name} 0,0.1,0.2"
            raise InputError(f"--{name}", fault, "needs numbers with commas", repair) from None
    return levels


@dataclass(frozen=True)
class Inquiry:
    """The answers."""

    tables: Mapping[str, Table]  # by the name of their file
    figures: Mapping[str, Figure] = field(repr=False)


def inquire(dataset: Path, classifier: str, choices: Choices, levels: Sequence[tuple[str, float]]) -> Inquiry:
    """Return the learning curve of a classifier, the importance of each ring to it, and its robustness.

    All are on the test trials of the benchmark in the folder `dataset`. A classifier that sees no single markers has no
    importance of rings.
    """
    candidate, trials, seed = candidate_of_name(classifier), open_trials(dataset), choices.seed
    onsets = choices.onsets(trials)
    tests, name, options = benchmark_test_trials(trials.names, seed), candidate.name, dict[str, Any](choices.options)
    run = begin_evaluation(trials, onsets, [candidate], choices.motion, choices.sampling, **options)
    with threadpool_limits(choices.workers):
        others, rows_of, rows = run.samples.trials_without(tests), run.samples.rows, []
        order, sizes = held_out(others, len(others), seed), [len(others)]
        # It learns from all other trials, and from halves of that down to three.
        while sizes[0] // 2 >= 3:
            sizes.insert(0, sizes[0] // 2)
        for size in sizes:
            _, frames = run.fit_rows(candidate, rows_of(order[:size]), rows_of(tests))
            scores = run.scores([frames])
            rows.append((size, scores.accuracy, scores.f1_mean))
        tables = {"learning-curve": table_of("Learning curve", ("trials", "accuracy", "mean F1"), rows)}
        figures = {"learning-curve": learning_curve_figure(rows, name)}
        if drops := importance_by_ring(run, candidate, tests):
            heading, note = ("ring", "drop in accuracy"), f"Ring 0 is the centre. {INTERVALS}"
            tables["importance"] = table_of("Importance of rings", heading, list(drops.items()), note)
            figures["importance"] = importance_figure(drops, name)
        results = robustness_of(choices.train(trials, classifier), trials, onsets, tests, levels, seed=seed)
        names = ("disturbance", "amount", "accuracy", "unusable")
        tables["robustness"] = table_of("Robustness, all frames of the test trials", names, results)
        figures["robustness"] = robustness_figure(results, name)
    return Inquiry(tables, figures)


def vary(
    dataset: Path,
    classifiers: Sequence[str],
    choices: Choices,
    *,
    folds: int = 5,
    conditions: Sequence[str] = (),
    each: Sequence[str] = (),
    output: Path | None = None,
) -> Inquiry:
    """Return on which values that no paper prints the accuracy of classifiers depends.

    The trials in the folder `dataset` stay as they are: they are labelled by their external markers, and their motion
    is read, with other values. Accuracies are listed by each of the `conditions`, too; the trials of each value, or
    combination of values, of the conditions `each` are learned from and tested on alone. Fits and accuracies are kept
    in ``OUTPUT.unfinished`` until tables and figure are in the folder `output`, and what was interrupted goes on with
    them; trials are read again for what is not there.
    """
    trials, candidates = open_trials(dataset), [candidate_of_name(name) for name in classifiers]
    # A condition that is not there is told before anything is computed.
    for condition in (*conditions, *each):
        left_out(trials.conditions, condition)
    scale = trials.tracks(trials.names[0]).attrs.get("metres_per_pixel_x")
    if scale is None:
        fault = "have no metres_per_pixel"
        raise InputError(str(dataset), fault, "needs tracks in pixels with a scale", "write it to the tracks")
    assumptions, lacking = _assume(trials, float(scale), choices, each)
    options: dict[str, Any] = {"folds": folds, "output": output, **choices.options}
    sampling = replace(choices.sampling, least=0.0)
    try:
        varied = list(sensitivity_of(trials, assumptions, candidates, sampling, **options))
    except InputError:
        # A label that never comes may be one of the last assumption: nothing is left of the others.
        parts_beside(output).remove()
        raise
    rows = [(f"{score.assumption.quantity}: {score.assumption.value}", score.accuracies) for score in varied]
    listed = {condition: varied[0].of_condition(trials, condition) for condition in conditions}
    rows += [(condition_text(key, value), score) for key, scores in listed.items() for value, score in scores.items()]
    table = assumption_table(varied)
    left = [f"Labels {name} lack an onset in {count} trials and are left out." for name, count in lacking.items()]
    tables = {"assumptions": replace(table, note=" ".join([table.note, *left]))}
    for key, scores in listed.items():
        rows_of_key = [(value, *estimates.values()) for value, estimates in scores.items()]
        tables[f"by-{key}"] = table_of(f"Accuracy by {key}", (key, *next(iter(scores.values()))), rows_of_key)
    inquiry = Inquiry(tables, {"assumptions": assumption_figure(rows)})
    if output is not None:
        write_inquiry(inquiry, output)
    parts_beside(output).remove()
    return inquiry


def _assume(
    trials: TrialSet, scale: float, choices: Choices, each: Sequence[str]
) -> tuple[tuple[Assumption, ...], dict[str, int]]:
    """Return what is assumed in turn, and in how many trials the sources of labels lack an onset that lack one."""
    labels = [trials.labels(name) for name in trials.names]
    lacking = {
        source: sum(source not in label or None in vars(label[source]).values() for label in labels)
        for source in sorted(set().union(*labels) - {"external_markers"})
    }
    stored = [source for source, count in lacking.items() if not count]
    assumptions = likely_assumptions(scale, motion=choices.motion, stored=stored)
    alone = each_alone(trials, each, assumptions[0])
    return (*assumptions, *alone), {source: count for source, count in lacking.items() if count}


def assumption_table(sensitivities: Sequence[Sensitivity]) -> Table:
    """Return what accuracies come to with each value that may be assumed, and when labels then begin."""
    rows = [
        (entry.assumption.quantity, entry.assumption.value, entry.incipient, entry.gross, *entry.accuracies.values())
        for entry in sensitivities
    ]
    times = (Column("median incipient slip", "s", 2), Column("median gross slip", "s", 2))
    note = f"Accuracy on frames of trials that were not seen; one value changed in each row. {INTERVALS}"
    names: list[str | Column] = ["quantity", "value", *times, *sensitivities[0].matrices]
    return table_of("Accuracy and what is assumed", names, rows, note)


def write_inquiry(inquiry: Inquiry, folder: Path) -> None:
    """Write the tables as CSV files and the figures beside them; other files of the folder stay."""
    write_tables(inquiry.tables, folder)
    for name, figure in inquiry.figures.items():
        save_figure(figure, folder / f"{name}.png")
