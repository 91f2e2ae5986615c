"""``fingerslip detect``: data sets, training, evaluation and runs of slip detectors, and scores of a benchmark."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fingerslip.commands.shared import AsJson, Markdown, print_tables, screen_progress, stop_on_termination

__all__ = ["ACTIONS", "collect", "detect", "evaluate", "run", "score", "simulate", "train"]

DataSet = Annotated[Path, typer.Argument(metavar="DATASET", help="Folder of trials.", show_default=False)]
Labels = Annotated[
    str,
    typer.Option("--labels", metavar="SOURCE|CSV", help="Source of the labels, or a CSV file of onset times."),
]
RestFrames = Annotated[int, typer.Option("--rest-frames", min=1, help="Frames at rest at the start of a trial.")]
Window = Annotated[int, typer.Option("--window", min=2, help="Frames in a velocity.")]
Samples = Annotated[
    str, typer.Option("--samples", metavar="A,B,C,D", help="Frames a trial: no slip, first and more incipient, gross.")
]
Seed = Annotated[int, typer.Option("--seed", help="Seed of splits, samples and classifiers.")]
Cores = Annotated[int, typer.Option("--workers", metavar="N", min=1, help="Cores to use.")]


def detect() -> None:
    """Find slip in marker tracks: simulate | collect | train | evaluate | run | score."""


def simulate(
    study: Annotated[Path, typer.Argument(metavar="STUDY", help="Study file with 'trials'.", show_default=False)],
    *,
    output: Annotated[Path, typer.Option("--output", metavar="DIR", help="Folder of the data set.")] = Path("trials"),
    workers: Cores = 2,
) -> None:
    """Make a data set of simulated trials; an interrupted one goes on where it stopped."""
    from fingerslip.study.trials.simulate import simulate_trials

    stop_on_termination()
    made = simulate_trials(study, output, workers=workers, progress=screen_progress())
    typer.echo(f"{output}: {len(made.names)} trials")


def collect(
    recordings: Annotated[Path, typer.Argument(metavar="FOLDER", help="Folder of tracks: netCDF or CSV.")],
    conditions: Annotated[Path, typer.Argument(metavar="CSV", help="Table with a row for each file.")],
    *,
    output: Annotated[Path, typer.Option("--output", metavar="DIR", help="Folder of the data set.")] = Path("trials"),
    labels: Annotated[Path | None, typer.Option("--labels", metavar="CSV", help="Onset times of your own.")] = None,
    title: Annotated[str, typer.Option("--title", help="What the data card says first.")] = "Recorded trials",
    rest_frames: RestFrames = 100,
) -> None:
    """Make a data set of recorded tracks: columns file, and conditions such as 'indentation [mm]'."""
    from fingerslip.detect.session import collect_trials

    typer.echo(collect_trials(recordings, conditions, output, labels=labels, title=title, rest_frames=rest_frames))


def train(
    dataset: DataSet,
    *,
    output: Annotated[Path, typer.Option("--output", metavar="DIR", help="Folder of the detector.")] = Path("detector"),
    classifier: Annotated[str, typer.Option("--classifier", help="Its name.")] = "forest",
    labels: Labels = "external_markers",
    rest_frames: RestFrames = 100,
    window: Window = 11,
    samples: Samples = "50,50,50,50",
    seed: Seed = 0,
    workers: Cores = 2,
) -> None:
    """Train a detector on the trials of a data set that are no test trials of the benchmark, and write it."""
    from fingerslip.detect.session import Choices, train_detector

    choices = Choices(labels, rest_frames, window, samples, seed, workers)
    typer.echo(train_detector(dataset, output, classifier, choices))


def evaluate(
    dataset: DataSet,
    *,
    classifier: Annotated[
        list[str] | None, typer.Option("--classifier", help="Only this one; repeatable.", show_default="all")
    ] = None,
    output: Annotated[Path | None, typer.Option("--output", metavar="DIR", help="Folder for tables.")] = None,
    folds: Annotated[int, typer.Option("--folds", min=2, help="Folds, grouped by trial.")] = 5,
    leave_out: Annotated[
        list[str] | None, typer.Option("--leave-out", metavar="CONDITION", help="Leave out by this too; repeatable.")
    ] = None,
    labels: Labels = "external_markers",
    rest_frames: RestFrames = 100,
    window: Window = 11,
    samples: Samples = "50,50,50,50",
    seed: Seed = 0,
    workers: Cores = 2,
    markdown: Markdown = False,
    as_json: AsJson = False,
) -> None:
    """Compare classifiers on trials that they have not seen, beside the published split by sample."""
    from fingerslip.detect.session import Choices, evaluate_classifiers, output_tables

    choices = Choices(labels, rest_frames, window, samples, seed, workers)
    tables = evaluate_classifiers(dataset, classifier or (), choices, folds=folds, leave_out=leave_out or ())
    text = output_tables(tables, output)
    if markdown:
        typer.echo(text, nl=False)
    else:
        print_tables(tables, as_json)


def run(
    source: Annotated[
        Path, typer.Argument(metavar="TRACKS|VIDEO", help="Tracks (.nc, .csv) or a video.", show_default=False)
    ],
    detector: Annotated[Path, typer.Option("--detector", metavar="DIR", help="Folder of the detector.")] = Path(
        "detector"
    ),
    markers: Annotated[
        int | None, typer.Option("--markers", metavar="N", min=1, help="Markers in the video, else found.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Run a detector frame by frame on tracks or on a video, and print its events and its latency."""
    from fingerslip.detect.session import run_detector

    print_tables([run_detector(detector, source, markers)], as_json)


def score(
    dataset: DataSet,
    submission: Annotated[Path, typer.Argument(metavar="CSV", help="Onset times of the test trials.")],
    *,
    labels: Labels = "external_markers",
    rest_frames: RestFrames = 100,
    seed: Seed = 0,
    markdown: Markdown = False,
    as_json: AsJson = False,
) -> None:
    """Score onset times on the test trials of a data set: a file with trial, incipient_s and gross_s."""
    from fingerslip.detect.session import Choices, output_tables, score_onsets

    tables = [score_onsets(dataset, submission, Choices(labels, rest_frames, seed=seed))]
    if markdown:
        typer.echo(output_tables(tables), nl=False)
    else:
        print_tables(tables, as_json)


#: The verbs below this one.
ACTIONS = (simulate, collect, train, evaluate, run, score)
