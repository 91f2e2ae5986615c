"""Maps: what may stand in their files, what they come to, and how that is written down."""

from __future__ import annotations

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
from fingerslip.react import mapping
from fingerslip.react.answer import answer, cell_table, source_table, trial_table
from fingerslip.react.figures import map_figure, margin_figure
from fingerslip.react.loads import StepLoad
from fingerslip.react.mapping import MapResult, ReactionMap, reaction_map, read_reaction_map
from fingerslip.react.scenario import HeldObject
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
    assert f"± {1e3 * result.uncertainty:.0f} ms" in answer(result)


def test_travel_grows_with_latency_up_to_the_loss(result: MapResult) -> None:
    travels = result.travels["original"]
    assert travels[0] < travels[1] < result.settings.held.travel_limit < travels[2]


def test_answer_names_who_saves_the_object_and_who_loses_it(result: MapResult) -> None:
    text = answer(result)
    assert text.startswith("At friction 0.4 and 4 N/s a grip that rises ")
    assert text.endswith("). It is saved by human-slip (74 ms); lost by gripper (400 ms).")
    (cell,) = (cell for cell in result.cells if cell.at == result.settings.centre)
    for critical, expected in ((None, "no reflex saves the object"), (np.inf, "no reflex is needed")):
        other = replace(result, cells=(replace(cell, critical={"force": critical}),))
        assert expected in answer(other)


def test_tables_have_a_row_for_each_cell_and_trial(result: MapResult) -> None:
    assert len(cell_table(result).rows) == 4
    assert len(trial_table(result).rows) == 4
    assumed = [row for row in source_table().rows if row[3] == "assumed"]
    assert len(assumed) > 9


def test_figures_say_every_latency(result: MapResult) -> None:
    (axes, *_) = map_figure(result).axes
    latencies = result.latency("original", "force")
    expected = ["–" if np.isnan(value) else f"{1e3 * value:.0f}" for value in latencies.ravel()]
    assert [text.get_text() for text in axes.texts] == expected
    rates, travels = margin_figure(result).axes
    assert rates.get_xlabel() == "rate of the load [N/s]"
    assert travels.get_ylabel() == "largest travel [mm]"


def test_verb_writes_answer_tables_and_figures(file: Path, tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["react", str(file), "--results", str(tmp_path), "--workers", "1", "--quiet"])
    assert done.exit_code == 0, done.output
    names = {path.name for path in (tmp_path / "small").iterdir()}
    assert names == {
        *("answer.txt", "cells.csv", "trials.csv", "sources.csv"),
        *("reaction-map.png", "reaction-margin.png"),
    }
    assert (tmp_path / "small" / "answer.txt").read_text() in done.output


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"reaction": "human"}, "reaction: 'human' is not known, needs one of "),
        ({"reactions": ["grippers"]}, "reactions: 'grippers' is not known, needs one of "),
        ({"centre": {"friction": 0.5}}, "centre.friction: got 0.5, needs one of the map's: 0.3, 0.45, 0.6, 0.75, 0.9"),
        ({"detectors": {}}, "detectors: has none, needs one or more; leave it out for 48 % slipped"),
        ({"load_rates": ["4 N"]}, "load_rates.0: got '4 N', needs a unit of [N/s]"),
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
