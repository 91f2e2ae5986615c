"""``fingerslip detect``: data sets, training, evaluation and runs of slip detectors, and scores of a benchmark."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, Option, echo

from fingerslip.commands.shared import (
    AsJson,
    Markdown,
    Quiet,
    print_tables,
    screen_progress,
    tracking_options,
    with_options,
)

if TYPE_CHECKING:
    from fingerslip.tables.table import Table

DataSet = Annotated[Path, Argument(metavar="DATASET", help="Folder of trials.")]
NewDataSet = Annotated[Path, Option("-o", "--output", metavar="DIR", help="Folder of the data set.")]
Classifier = Annotated[str, Option(metavar="NAME[:SET+...]", help="Its name, and other sets of features.")]
Classifiers = Annotated[list[str] | None, Option(metavar="NAME[:SET+...]", help="Only this one; repeatable.")]
Labels = Annotated[str, Option(metavar="SOURCE|CSV", help="Source of the labels, or a CSV file of onset times.")]
RestFrames = Annotated[int, Option("--rest", metavar="FRAMES", min=1, help="Frames at rest at the start of a trial.")]
Window = Annotated[int, Option(min=2, help="Frames in a velocity.")]
Samples = Annotated[str, Option(metavar="A,B,C,D", help="Frames a trial: no slip, first and more incipient, gross.")]
Least = Annotated[float, Option(metavar="SHARE", min=0.0, max=1.0, help="Share of these that a trial needs.")]
Seed = Annotated[int, Option(help="Seed of splits, samples and classifiers.")]
Pictures = Annotated[Path, Option("-o", "--output", metavar="DIR", help="Folder for tables and figures.")]
Cores = Annotated[int, Option(metavar="N", min=1, help="Cores to use.")]


def _choices(
    *,
    labels: Labels = "external_markers",
    rest_frames: RestFrames = 100,
    window: Window = 11,
    samples: Samples = "50,50,50,50",
    least: Least = 1.0,
    seed: Seed = 0,
    workers: Cores = 2,
) -> Any:
    """Return what is chosen for training and evaluation."""
    from fingerslip.detect.session import Choices

    return Choices(labels, rest_frames, window, samples, seed, workers, least)


def _print(tables: Sequence[Table], markdown: bool, as_json: bool, output: Path | None = None) -> None:
    """Print tables, and write them into a folder."""
    from fingerslip.detect.evaluation.scores import output_tables

    text = output_tables(tables, output)
    if markdown:
        echo(text, nl=False)
    else:
        print_tables(tables, as_json)


def detect() -> None:
    """Find slip in marker tracks: data sets, training, evaluation, detectors that run, and scores of a benchmark."""


def simulate(
    study: Annotated[Path, Argument(metavar="STUDY", help="Study file with 'trials'.")],
    *,
    output: NewDataSet = Path("trials"),
    parquet: Annotated[Path | None, Option(metavar="FILE", help="Write one table of all frames too.")] = None,
    workers: Cores = 2,
    quiet: Quiet = False,
) -> None:
    """Make a data set of simulated trials; an interrupted one goes on where it stopped."""
    from fingerslip.study.trials.simulate import simulate_trials

    trials = simulate_trials(study, output, workers=workers, progress=screen_progress(quiet))
    echo(f"{output}: {len(trials.names)} trials")
    if parquet is not None:
        from fingerslip.detect.trials import write_parquet

        write_parquet(trials, parquet)
        echo(f"{parquet}: a row for each frame")


@with_options("tracking", tracking_options)
def collect(
    recordings: Annotated[Path, Argument(metavar="FOLDER", help="Folder of videos or tracks.")],
    conditions: Annotated[Path, Argument(metavar="CSV", help="Table with a row for each file.")],
    *,
    output: NewDataSet = Path("trials"),
    labels: Annotated[Path | None, Option(metavar="CSV", help="Onset times of your own.")] = None,
    title: Annotated[str, Option(help="What the data card says first.")] = "Recorded trials",
    tracking: Any,
    external_markers: Annotated[int | None, Option(metavar="N", min=1, help="Markers of the outer camera.")] = None,
) -> None:
    """Make a data set of recordings that a table names, with their conditions: videos, which are tracked, or tracks.

    A column 'slip' with yes or no says whether there is slip in a recording; those without are negatives.
    """
    from fingerslip.detect.session import collect_trials

    more: dict[str, Any] = {"tracking": tracking, "external_markers": external_markers}
    echo(collect_trials(recordings, conditions, output, labels=labels, title=title, **more))


def film(
    results: Annotated[Path, Argument(metavar="RESULTS", help="Folder of a sensor's study.")],
    *,
    output: NewDataSet = Path("trials"),
    title: Annotated[str, Option(help="What the data card says first.")] = "Simulated trials",
    seed: Seed = 0,
) -> None:
    """Make a data set of simulated runs: what two cameras see of each slide or pouring, and its labels."""
    from fingerslip.detect.session import film_runs

    echo(film_runs(results, output, title, seed))


@with_options("choices", _choices)
def train(
    dataset: DataSet,
    *,
    output: Annotated[Path, Option("-o", "--output", metavar="DIR", help="Folder of the detector.")] = Path("detector"),
    classifier: Classifier = "forest",
    choices: Any,
) -> None:
    """Train a detector on the trials of a data set that are no test trials of the benchmark, and write it."""
    from fingerslip.detect.session import train_detector

    echo(train_detector(dataset, output, classifier, choices))


@with_options("choices", _choices)
def evaluate(
    dataset: DataSet,
    *,
    classifier: Classifiers = None,
    output: Pictures = Path("evaluation"),
    folds: Annotated[int, Option(min=2, help="Folds, grouped by trial.")] = 5,
    group: Annotated[str | None, Option(metavar="CONDITION", help="Keep trials of one value in one fold.")] = None,
    whole: Annotated[bool, Option("--whole", help="Ask of whole trials alone: slip, or none?")] = False,
    leave_out: Annotated[
        list[str] | None, Option(metavar="CONDITION", help="Leave out by this too; repeatable.")
    ] = None,
    choices: Any,
    markdown: Markdown = False,
    as_json: AsJson = False,
) -> None:
    """Compare classifiers, all without --classifier, on trials that they have not seen, and on a split by sample.

    Tables are printed, and drawn on DIR/evaluation.html.
    Finished parts are kept in DIR.unfinished until the tables are written, so that an interrupted evaluation goes on.
    Each value of a condition that is left out takes as long as a fold.
    """
    from fingerslip.detect.session import evaluate_classifiers

    if whole:
        from fingerslip.detect.evaluation.whole import evaluate_whole

        tables = evaluate_whole(dataset, choices, folds=folds, group=group, output=output)
    else:
        options: dict[str, Any] = {"folds": folds, "group": group, "leave_out": leave_out or (), "output": output}
        tables = evaluate_classifiers(dataset, classifier or (), choices, **options)
    _print(tables, markdown, as_json)
    echo(f"tables: {output}\npage: {output / 'evaluation.html'}", err=markdown or as_json)


@with_options("choices", _choices)
def inquire(
    dataset: DataSet,
    *,
    classifier: Classifier = "forest",
    output: Pictures = Path("inquiry"),
    lost: Annotated[str, Option(metavar="A,B,...", help="Shares of positions lost.")] = "0,0.1,0.2,0.3,0.4,0.5",
    noise: Annotated[
        str, Option(metavar="A,B,...", help="Noise added, in the unit of the tracks.")
    ] = "0,0.02,0.05,0.1,0.2,0.5",
    slower: Annotated[str, Option(metavar="A,B,...", help="Only every nth frame.")] = "1,2,4,8",
    choices: Any,
    as_json: AsJson = False,
) -> None:
    """Ask what a classifier needs, uses and bears: learning curve, importance of rings, robustness, with figures."""
    from fingerslip.detect.evaluation.inquiries import inquire as asked
    from fingerslip.detect.evaluation.inquiries import levels_of, write_inquiry
    from fingerslip.storage.files import check_folder

    check_folder(output)
    answers = asked(dataset, classifier, choices, levels_of(lost=lost, noise=noise, slower=slower))
    write_inquiry(answers, output)
    print_tables(answers.tables.values(), as_json)
    echo(f"tables and figures: {output}", err=as_json)


def vary(
    dataset: DataSet,
    *,
    classifier: Classifiers = None,
    output: Pictures = Path("assumptions"),
    folds: Annotated[int, Option(min=2, help="Folds, grouped by trial.")] = 5,
    by: Annotated[
        list[str] | None, Option(metavar="CONDITION", help="List accuracies by this too; repeatable.")
    ] = None,
    each: Annotated[
        list[str] | None, Option(metavar="CONDITION", help="Take the trials of each value alone too; repeatable.")
    ] = None,
    rest_frames: RestFrames = 100,
    window: Window = 11,
    samples: Samples = "50,50,50,50",
    seed: Seed = 0,
    workers: Cores = 2,
    as_json: AsJson = False,
) -> None:
    """Ask on which values that no paper prints accuracies depend: pixels, thresholds, labels, speeds, noise, moduli.

    Finished parts are kept in DIR.unfinished until tables and figure are written: what is interrupted goes on.
    """
    from fingerslip.detect.evaluation.inquiries import vary as varied
    from fingerslip.detect.session import Choices

    choices = Choices("external_markers", rest_frames, window, samples, seed, workers)
    names, by, each = classifier or ("forest",), by or [], each or []
    variation = varied(dataset, names, choices, folds=folds, conditions=by, each=each, output=output)
    print_tables(variation.tables.values(), as_json)
    echo(f"tables and figures: {output}", err=as_json)


def transfer(
    detector: Annotated[str, Argument(metavar="DETECTOR", help="Its folder, or 'residual' for the one that ships.")],
    dataset: DataSet,
    *,
    labels: Labels = "external_markers",
    output: Annotated[Path | None, Option("-o", "--output", metavar="DIR", help="Folder for tables.")] = None,
    markdown: Markdown = False,
    as_json: AsJson = False,
) -> None:
    """Test a detector on all trials of another data set than it learned from, such as pouring after slides."""
    from fingerslip.detect.session import judge_detector
    from fingerslip.storage.files import check_folder

    if output is not None:
        check_folder(output)
    tables = judge_detector(detector, dataset, labels)
    _print(tables, markdown, as_json, output)
    if output is not None:
        echo(f"tables: {output}", err=markdown or as_json)


@with_options("tracking", tracking_options)
def run(
    source: Annotated[
        str,
        Argument(
            metavar="VIDEO|TRACKS|CAMERA", help="A video, tracks (.nc, .csv), or the index or address of a camera."
        ),
    ],
    *,
    detector: Annotated[
        str, Option(metavar="DIR", help="Folder of a trained detector; else the one that ships.")
    ] = "residual",
    output: Annotated[
        Path | None,
        Option("-o", "--output", metavar="DIR", help="Folder of the page; else NAME_slip beside SOURCE."),
    ] = None,
    tracking: Any,
    as_json: AsJson = False,
) -> None:
    """Say when a video or tracks show slip, and how sure that is, and write a page that shows it.

    It needs no training: without --detector, slip is where markers leave the pattern in which they move while all
    sticks. The clip has to begin at rest. Of a camera events are told as they come, until Ctrl-C. How long frames take
    is printed, too.
    """
    from fingerslip.detect.session import run_detector, watch_camera

    if source.isdecimal() or "://" in source:
        camera = int(source) if source.isdecimal() else source
        print_tables([watch_camera(camera, detector, tracking, partial(echo, err=as_json))], as_json)
        return
    tables, lines = run_detector(Path(source), detector, tracking, output)
    print_tables(tables, as_json)
    echo("\n".join(lines), err=as_json)


def score(
    dataset: DataSet,
    submission: Annotated[Path, Argument(metavar="CSV", help="Onset times of the test trials.")],
    *,
    labels: Labels = "external_markers",
    rest_frames: RestFrames = 100,
    seed: Seed = 0,
    markdown: Markdown = False,
    as_json: AsJson = False,
) -> None:
    """Score onset times on the test trials of a data set: a file with trial, incipient_s and gross_s."""
    from fingerslip.detect.session import Choices, score_onsets

    tables = [score_onsets(dataset, submission, Choices(labels, rest_frames, seed=seed))]
    _print(tables, markdown, as_json)


#: The verbs below this one.
ACTIONS = (simulate, collect, film, train, evaluate, inquire, vary, transfer, run, score)
