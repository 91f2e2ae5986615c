"""The verb detect: a data set to a detector, tables and scores."""

import re
from pathlib import Path

import pytest

from fingerslip.detect.labels import write_onsets
from fingerslip.detect.samples import benchmark_test_trials
from fingerslip.detect.synthetic import synthetic_slides
from fingerslip.detect.trials import open_trials, write_trials

SETTINGS = ("--rest", "20", "--window", "5", "--samples", "20,6,2,20")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("detect") / "slides"
    write_trials(synthetic_slides((3e-3, 4e-3), directions=4, repeats=1, seed=1, travel=8e-3), path, "Analytic slides")
    return path


def test_from_trials_to_events_and_scores(invoke, folder):
    trained = invoke("detect", "train", folder, "--classifier", "logistic", *SETTINGS)
    assert "detector: logistic" in trained.output
    tests = ", ".join(benchmark_test_trials(open_trials(folder).names))
    assert trained.output.endswith(f"test trials, not seen: {tests}\n")
    for detector in ((), ("--detector", "detector")):
        ran = invoke("detect", "run", folder / "slide-0000" / "tracks.nc", *detector, "--output", "slip")
        assert "processed a second" in ran.output
        assert "page: slip/slip.html" in ran.output
    Path("table.csv").write_text("file,indentation [mm]\ntracks.nc,3\n")
    found = invoke("detect", "collect", folder / "slide-0000", "table.csv", "--rest", "20", "--output", "mine")
    assert "mine: 1 trials" in found.output
    assert Path("mine/tracks/labels.csv").is_file()
    trials = open_trials(folder)
    tests = benchmark_test_trials(trials.names)
    write_onsets({name: trials.onsets()[name] for name in tests}, "mine.csv")
    found = invoke("detect", "score", folder, "mine.csv", "--rest", "20")
    assert re.search(r"onset error \[s\] +0\.000", found.output)


@pytest.mark.slow
def test_evaluation_prints_and_writes_tables(invoke, folder):
    asked = ("--classifier", "time_threshold", "--folds", "2", "--output", "tables")
    found = invoke("detect", "evaluate", folder, *asked, *SETTINGS, "--markdown")
    assert "Accuracy on frames" in found.output
    assert "| classifier |" in found.output
    assert len(list(Path("tables").glob("*.csv"))) == 5
    assert Path("tables/evaluation.html").is_file()
    assert found.stderr.splitlines()[-2:] == ["tables: tables", "page: tables/evaluation.html"]
    assert [path.name for path in Path.cwd().iterdir()] == ["tables"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("train", "none"), "needs the folder of a data set"),
        (("run", "none.nc", "--detector", "none"), "needs the folder of a detector"),
        (("run", "none.nc"), "is not there"),
        (("train", "{folder}", "--classifier", "magic"), "needs one of forest"),
        (("evaluate", "{folder}", "--labels", "mine"), "has no labels 'mine'"),
        (("inquire", "{folder}", "--lost", "much"), "needs numbers with commas"),
        (("score", "{folder}", "none.csv"), "cannot be read"),
    ],
)
def test_mistakes_are_one_line_and_nothing_is_written(arguments, message, invoke, folder):
    found = invoke("detect", *(part.format(folder=folder) for part in arguments), code=2)
    assert found.stderr.count("error:") == 1
    assert message in " ".join(found.stderr.split())
    assert list(Path.cwd().iterdir()) == []


def test_every_action_has_help_and_a_file_in_the_place_of_the_output_is_told_at_once(invoke, folder):
    Path("mine").write_text("mine")
    for arguments in (("evaluate", folder), ("vary", folder), ("inquire", folder), ("transfer", "none", folder)):
        found = invoke("detect", *arguments, "-o", "mine", code=2)
        assert "mine: is a file, needs a folder" in found.stderr
        assert [path.name for path in Path.cwd().iterdir()] == ["mine"]
    group = invoke("detect", "--help").output
    for action in ("collect", "train", "evaluate", "inquire", "vary", "run", "score"):
        assert action in group
        text = invoke("detect", action, "--help").output
        assert "Usage" in text
        # The same options as those of track and mesh.
        assert ("--output" in text, "--rest" in text) == (action != "score", action != "transfer")
        assert "--rest-frames" not in text


@pytest.mark.slow
def test_trials_of_a_study_are_simulated(invoke, folder, monkeypatch):
    asked = []

    def simulated(*given, **options):
        asked.append((*given, options["workers"]))
        return open_trials(folder)

    monkeypatch.setattr("fingerslip.study.trials.simulate.simulate_trials", simulated)
    found = invoke("detect", "simulate", "s.yaml", "--output", "made", "--workers", "1", "--parquet", "all.parquet")
    assert "made: 8 trials" in found.output
    assert asked == [(Path("s.yaml"), Path("made"), 1)]
    assert Path("all.parquet").is_file()
