"""What a classifier needs, what it uses and what it bears, asked of a data set: tables and figures."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from threadpoolctl import threadpool_limits

from fingerslip.detect.evaluation.crossval import parts_beside
from fingerslip.detect.evaluation.inquiries import (
    Assumption,
    each_alone,
    importance_by_ring,
    learning_curve,
    likely_assumptions,
    robustness_of,
    sensitivity_of,
)
from fingerslip.detect.evaluation.tables import INTERVALS, assumption_table, table_of, write_tables
from fingerslip.detect.features import FeatureSettings, ring_of_features
from fingerslip.detect.samples import benchmark_test_trials, left_out, samples_of
from fingerslip.detect.session import Choices
from fingerslip.detect.training import candidate_of_name
from fingerslip.detect.trials import TrialSet, condition_text, open_trials
from fingerslip.errors import InputError, shorten
from fingerslip.report.figures.detectors import (
    assumption_figure,
    importance_figure,
    learning_curve_figure,
    robustness_figure,
)
from fingerslip.report.figures.style import save_figure
from fingerslip.tables.table import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Levels:
    """Disturbances that are tried, as the command line writes them: numbers with commas between them."""

    lost: str = "0,0.1,0.2,0.3,0.4,0.5"  # shares of positions that are not seen
    noise: str = "0,0.02,0.05,0.1,0.2,0.5"  # standard deviations of noise that is added, in the unit of the tracks
    slower: str = "1,2,4,8"  # every so manieth frame

    @property
    def pairs(self) -> list[tuple[str, float]]:
        """The disturbances and their amounts."""
        pairs = []
        for name, text in vars(self).items():
            try:
                pairs += [(name, float(part)) for part in text.split(",") if part.strip()]
            except ValueError:
                fault, repair = f"got {shorten(text)!r}", f"write --{name} 0,0.1,0.2"
                raise InputError(f"--{name}", fault, "needs numbers with commas", repair) from None
        return pairs


@dataclass(frozen=True)
class Inquiry:
    """The answers."""

    tables: Mapping[str, Table]  # by the name of their file
    figures: Mapping[str, Figure] = field(repr=False)


def curve_sizes(count: int) -> tuple[int, ...]:
    """Return the numbers of trials of a learning curve: all of them, and halves of that down to three."""
    sizes = [count]
    while sizes[-1] // 2 >= 3:
        sizes.append(sizes[-1] // 2)
    return tuple(reversed(sizes))


def inquire(dataset: Path, classifier: str, choices: Choices, levels: Levels | None = None) -> Inquiry:
    """Return the learning curve of a classifier, the importance of each ring to it, and its robustness.

    All are on the test trials of the benchmark in the folder `dataset`. A classifier that sees no single markers has no
    importance of rings.
    """
    pairs, candidate = (levels or Levels()).pairs, candidate_of_name(classifier)
    trials, seed = open_trials(dataset), choices.seed
    onsets = choices.onsets(trials)
    samples = samples_of(trials, onsets, FeatureSettings(candidate.sets, choices.motion), choices.sampling)
    tests, name = benchmark_test_trials(trials.names, seed), candidate.name
    options = {"seed": seed, "workers": choices.workers}
    with threadpool_limits(choices.workers):
        scores = learning_curve(samples, candidate, tests, curve_sizes(len(trials.names) - len(tests)), **options)
        rows = [(size, score.accuracy, score.f1_mean) for size, score in scores.items()]
        tables = {"learning-curve": table_of("Learning curve", ("trials", "accuracy", "mean F1"), rows)}
        figures = {"learning-curve": learning_curve_figure(rows, name)}
        if any(ring is not None for ring in ring_of_features(samples.names, samples.ring)):
            drops = importance_by_ring(samples, candidate, tests, **options)
            note = f"Ring 0 is the centre. {INTERVALS}"
            tables["importance"] = table_of(
                "Importance of rings", ("ring", "drop in accuracy"), list(drops.items()), note
            )
            figures["importance"] = importance_figure(drops, name)
        results = robustness_of(choices.train(trials, classifier), trials, onsets, tests, pairs, seed=seed)
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
    combination of values, of the conditions `each` are learned from and tested on alone. What is finished is kept in
    ``OUTPUT.unfinished`` until tables and figure are in the folder `output`, and what was interrupted goes on with it.
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
    store = parts_beside(output, trials.digest)
    options = {"folds": folds, "seed": choices.seed, "workers": choices.workers}
    sampling = dataclasses.replace(choices.sampling, least=0.0)
    try:
        varied = list(sensitivity_of(trials, assumptions, candidates, sampling=sampling, store=store, **options))
    except InputError:
        # A label that never comes may be one of the last assumption: nothing is left of the others.
        store.remove()
        raise
    rows = [(f"{score.assumption.quantity}: {score.assumption.value}", score.accuracies) for score in varied]
    listed = {condition: varied[0].of_condition(trials, condition) for condition in conditions}
    rows += [(condition_text(key, value), score) for key, scores in listed.items() for value, score in scores.items()]
    table = assumption_table(varied)
    left = [f"Labels {name} lack an onset in {count} trials and are left out." for name, count in lacking.items()]
    tables = {"assumptions": dataclasses.replace(table, note=" ".join([table.note, *left]))}
    for key, scores in listed.items():
        rows_of_key = [(value, *estimates.values()) for value, estimates in scores.items()]
        tables[f"by-{key}"] = table_of(f"Accuracy by {key}", (key, *next(iter(scores.values()))), rows_of_key)
    inquiry = Inquiry(tables, {"assumptions": assumption_figure(rows)})
    if output is not None:
        write_inquiry(inquiry, output)
    store.remove()
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


def write_inquiry(inquiry: Inquiry, folder: Path) -> None:
    """Write the tables as CSV files and the figures beside them; other files of the folder stay."""
    write_tables(inquiry.tables, folder)
    for name, figure in inquiry.figures.items():
        save_figure(figure, folder / f"{name}.png")
