"""Maps: what may stand in their files, what they come to, and how that is written down."""

from __future__ import annotations

import html
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from fingerslip.commands.app import app
from fingerslip.errors import InputError
from fingerslip.parameters import from_mapping
from fingerslip.react import mapping, page
from fingerslip.react.answer import answer, cell_table, error_table, paper_table, source_table, trial_table
from fingerslip.react.figures import map_figure, margin_figure, outcome_figure
from fingerslip.react.loads import StepLoad
from fingerslip.react.mapping import MapResult, ReactionMap, reaction_map, read_reaction_map
from fingerslip.react.page import filmed_reactions, map_report
from fingerslip.react.scenario import HeldObject
from fingerslip.report.figures.motion import Film
from fingerslip.vision.video import open_frames
from places import ROOT
from unit.pads import pad

SMALL = """
phalanges: [original]
held: {margin: 0.3, settle: 0.15 s, rest: 0.02 s, after: 0.3 s, step: 4 ms}
friction: [0.4, 0.6]
load_rates: [4 N/s, 64 N/s]
detectors:
  force: {force_ratio: {friction: 0.4, share: 0.95}}
  never: {never: {}}
reaction: human-slip
reactions: [human-slip, gripper]
centre: {friction: 0.4, load_rate: 4 N/s}
latencies: [0 ms, 80 ms, 900 ms]
tolerance: 4 ms
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("map") / "small.yaml"
    path.write_text(SMALL)
    return path


@pytest.fixture(scope="module", autouse=True)
def pads() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mapping, "_holder", lambda *_: pad())
        yield


@pytest.fixture(scope="module")
def result(file: Path) -> MapResult:
    return reaction_map(read_reaction_map(file))


def test_map_that_ships_is_complete() -> None:
    settings = read_reaction_map(ROOT / "studies" / "reactions" / "reaction_map.yaml")
    assert len(settings.cells) == 5 * 6 * 3
    assert settings.held_at(settings.centre).friction == 0.6


def test_quick_loads_leave_less_time_than_slow_ones(result: MapResult) -> None:
    latencies = result.latency("original", "force")
    assert latencies.shape == (2, 2)
    assert np.all(np.nan_to_num(latencies[:, 1]) < latencies[:, 0])
    assert np.isnan(result.latency("original", "never")).all()


def test_reactions_at_the_centre_are_saved_within_the_critical_latency_and_no_longer(result: MapResult) -> None:
    for trial in result.trials:
        is_quick = trial.critical is not None and trial.delay <= trial.critical
        assert trial.outcome.saved == is_quick
    assert {trial.outcome.saved for trial in result.trials} == {True, False}


def test_uncertainty_is_that_of_search_step_and_mesh(result: MapResult) -> None:
    (cell,) = (cell for cell in result.cells if cell.at == result.settings.centre)
    critical, (step, mesh) = cell.critical["force"], result.refined.values()
    assert critical is not None
    assert step is not None
    # The pads of these tests have one mesh.
    assert mesh == critical
    assert result.uncertainty == pytest.approx(cell.error + abs(step - critical))
    assert f"± {1e3 * result.uncertainty:.0f} ms" in answer(result)[0]
    computed, halved, finer, together = error_table(result).rows
    assert (computed[1], halved[1], finer[1]) == pytest.approx((1e3 * critical, 1e3 * step, 1e3 * mesh))
    assert together[2] == pytest.approx(1e3 * result.uncertainty)


def test_travel_grows_with_latency_up_to_the_loss(result: MapResult) -> None:
    travels = result.travels["original"]
    assert travels[0] < travels[1] < result.settings.held.travel_limit < travels[2]


def test_answer_names_who_saves_the_object_and_who_loses_it(result: MapResult) -> None:
    first, second = answer(result)
    assert first.startswith("At friction 0.4 and 4 N/s a grip that rises as that of human-slip from ")
    limits = {trial.reaction: f"{1e3 * (trial.critical or 0.0):.0f} ms" for trial in result.trials[::2]}
    assert second == (
        "The grip of each reaction has its own rate, so each has its own longest latency, which stands second: "
        f"saved by human-slip (74 of {limits['human-slip']}); lost by gripper (400 of {limits['gripper']})."
    )
    assert limits["human-slip"] != limits["gripper"]
    (cell,) = (cell for cell in result.cells if cell.at == result.settings.centre)
    for critical, expected in ((None, "no reflex saves the object"), (np.inf, "no reflex is needed")):
        other = replace(result, cells=(replace(cell, critical={"force": critical}),))
        assert expected in answer(other)[0]


def test_tables_have_a_row_for_each_cell_and_trial(result: MapResult) -> None:
    assert len(cell_table(result).rows) == 4
    assert len(trial_table(result).rows) == 4
    assumed = [row for row in source_table().rows if row[3] == "assumed"]
    assert len(assumed) > 9
    assert {row[0] for row in paper_table().rows} == {row[0] for row in source_table().rows}


def test_figures_say_every_latency(result: MapResult) -> None:
    (axes, *_) = map_figure(result).axes
    latencies = result.latency("original", "force")
    expected = ["–" if np.isnan(value) else f"{1e3 * value:.0f}" for value in latencies.ravel()]
    assert [text.get_text() for text in axes.texts] == expected
    rates, travels = margin_figure(result).axes
    assert rates.get_xlabel() == "rate of the load [N/s]"
    assert travels.get_ylabel() == "largest travel [mm]"


def test_figure_of_outcomes_says_time_to_spare_and_travel(result: MapResult) -> None:
    (axes,) = outcome_figure(result).axes
    assert [label.get_text() for label in axes.get_yticklabels()] == [
        "gripper, 400 ms, 100 N/s",
        "human-slip, 74 ms, 20 N/s",
    ]
    saved = result.trials[0]
    assert saved.critical is not None
    spare = f"{1e3 * (saved.critical - saved.delay):+.0f} ms\n{1e3 * saved.outcome.travel:.1f} mm"
    texts = [text.get_text() for text in axes.texts]
    assert texts[0] == spare
    assert texts[1::2] == ["–\nlost", "–\nlost"]


@pytest.fixture(scope="module")
def folder(file: Path, result: MapResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return what the verb writes; the map is that of the other tests, the film short and small."""
    results = tmp_path_factory.mktemp("results")

    def computed(settings: ReactionMap, **_: Any) -> MapResult:
        assert settings == result.settings
        return result

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page, "reaction_map", computed)
        patch.setattr(page, "SHOWN_FILM", Film(size=(640, 480), frame_rate=5.0, seconds=1.0))
        done = CliRunner().invoke(app, ["react", str(file), "--results", str(results), "--quiet"])
    assert done.exit_code == 0, done.output
    assert "\n".join(answer(result)) in done.output
    return results / "small"


def test_verb_writes_page_tables_figures_and_film(folder: Path, result: MapResult) -> None:
    assert {path.name for path in folder.iterdir()} == {
        *(
            "answer.txt",
            "cells.csv",
            "trials.csv",
            "sources.csv",
            "report.html",
            "reaction-film.mp4",
            "reaction-film.png",
        ),
        *("reaction-map.png", "reaction-margin.png", "reaction-outcome.png"),
    }
    assert (folder / "answer.txt").read_text().splitlines() == list(answer(result))
    assert [frame.shape for frame in open_frames(folder / "reaction-film.mp4").read()] == [(480, 640)] * 5


def test_page_holds_answer_film_figures_and_the_study_file(folder: Path, result: MapResult) -> None:
    text = html.unescape((folder / "report.html").read_text())
    assert all(sentence in text for sentence in answer(result))
    assert text.count("<video") == 1
    assert text.count("<img") == 3
    assert SMALL in text
    assert "http" not in re.sub(r"<pre.*?</pre>", "", text, flags=re.DOTALL)


def test_page_without_film_and_trials_has_neither(result: MapResult) -> None:
    report = map_report(replace(result, trials=()))
    titles = [section.title for section in report.sections]
    assert "Saved and lost" not in titles
    assert [picture.name for picture in report.pictures] == ["reaction-map", "reaction-margin"]


def test_film_shows_the_slowest_that_saves_and_the_quickest_that_loses(result: MapResult) -> None:
    assert list(filmed_reactions(result)) == ["human-slip, 74 ms", "gripper, 400 ms"]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"reaction": "human"}, "reaction: 'human' is not known, needs one of "),
        ({"reactions": ["grippers"]}, "reactions: 'grippers' is not known, needs one of "),
        ({"fingertip": "wang"}, "fingertip: 'wang' is not known, needs one of "),
        ({"centre": {"friction": 0.5}}, "centre.friction: got 0.5, needs one of the map's: 0.3, 0.45, 0.6, 0.75, 0.9"),
        ({"detectors": {}}, "detectors: has none, needs one or more; leave it out for 48 % slipped"),
        ({"friction": []}, "centre.friction: got 0.6, needs one of the map's: none"),
        ({"friction": [0.6, 0.3]}, "friction: got 0.6, 0.3, needs ascending numbers"),
        ({"load_rates": ["4 N"]}, "load_rates.0: got '4 N', needs a unit of [N/s]"),
        ({"load_rates": ["4 N/s", "4 N/s"]}, "load_rates: got 4, 4, needs ascending numbers"),
        (
            {"latencies": ["0 ms", "1 ms"], "held": {"step": "2 ms"}},
            "latencies.1: got 0.001 s, needs 0 s or at least a step, 0.002 s; take a shorter step",
        ),
        (
            {"reactions": ["gripper"], "held": {"step": "20 ms"}},
            "reactions: gripper: reflex.latency: got 0.01 s, needs 0 s or at least a step, 0.02 s; take a shorter step",
        ),
        (
            {"reactions": ["servo"], "held": {"mass": "1 kg", "step": "2 ms"}},
            "reactions: servo: actuator.largest_force: got 20 N, needs at least the grip force, 23.71 N",
        ),
        ({"held": {"margin": 0}}, "held.grip: got 1.635 N, needs more than 1.635 N to hold 1.962 N; grip harder, or"),
        ({"held": {"mas": "2 kg"}}, "held.mas: "),
        ({"held": {"load": {"tide": {}}}}, "held.load.tide: "),
        ({"held": {"mass": "100 N"}}, "held.mass: got '100 N', needs a unit of [kg]"),
        ({"held": {"step": 2}}, "held.step: '2' has no unit, needs a unit of [s]; write '2 ms' or '2 s'"),
        ({"detectors": {"a": {"touch": {}}}}, "detectors.a.touch: "),
    ],
)
def test_map_with_a_mistake_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError) as caught:
        from_mapping(ReactionMap, changes, "x.yaml")
    assert str(caught.value).startswith(f"x.yaml: {message}")


def test_load_of_a_map_is_a_ramp() -> None:
    with pytest.raises(
        InputError, match=r"held.load: is no ramp, needs one: the map changes its rate; write ramp_load$"
    ):
        ReactionMap(held=HeldObject(load=StepLoad(force=1.0)))


@pytest.mark.parametrize(("text", "message"), [(None, "cannot be read"), ("- a", "holds no mapping")])
def test_file_that_is_no_map_is_refused(text: str | None, message: str, tmp_path: Path) -> None:
    path = tmp_path / "x.yaml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_reaction_map(path)
