"""Held objects as trials, and what alarms are worth."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import fingerslip as fs
from fingerslip.commands.app import app
from fingerslip.detect.labels import Onsets, read_onsets, write_onsets
from fingerslip.detect.trials import open_trials
from fingerslip.study.trials.holding import held_trials, score_alarms
from unit.pads import pad
from unit.study.conftest import draw_nothing

STUDY = """
mesh: {file: pad.msh, length_unit: m}
materials: {bulk: {youngs_modulus: 200 kPa, poisson_ratio: 0.45, density: 1000 kg/m^3}}
supports: {top: [x, y]}
formulation: plane_strain
depth: 10 mm
damping: {stiffness: 2 ms}
contact: {boundary: bottom, friction_coefficient: 0.6, search_distance: 4 mm}
time: {step: 4 ms}
dynamics: {basis: reduced, acceleration_tolerance: 0.1}
record: {sites: [{name: internal-marker-0-00, kind: internal marker, position: [0 mm, 1 mm]}]}
reaction:
  margin: 0.3
  load: {ramp_load: {rate: 8 N/s, force: 2 N}}
  settle: 0.16 s
  rest: 0.02 s
  after: 0.1 s
  detectors: {force: {force_ratio: {friction: 0.6, share: 0.95}}}
  reflex: {latency: 20 ms}
  actuator: {force_rate: 50 N/s}
  tolerance: 50 ms
sweep: {reaction.load.ramp_load.force: [0.3 N, 2 N]}
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> fs.StudyResult:
    folder = tmp_path_factory.mktemp("holding")
    fs.write_mesh(pad().mesh, folder / "pad.msh")
    (folder / "hold.yaml").write_text(STUDY)
    with pytest.MonkeyPatch.context() as patch:
        draw_nothing(patch)
        return fs.run_study(folder / "hold.yaml", results_dir=folder, workers=1)


@pytest.fixture(scope="module")
def alarms(study: fs.StudyResult) -> dict[str, Onsets]:
    """Return the labels of the data set, whose times are those of the runs; nothing is alarming in the first run."""
    trials = held_trials(study.folder, study.folder.parent / "held", frame_rate=125.0)
    assert open_trials(study.folder.parent / "held").names == trials.names
    return dict(trials.onsets("force"))


def test_trials_are_the_runs_from_their_start_on(study: fs.StudyResult, alarms: dict[str, Onsets]) -> None:
    held, lost = (run.name for run in study.runs)
    assert alarms[held] == Onsets(None, None)
    onsets, run = alarms[lost], study.runs[1].reaction
    times = 0.18 + (run["force"] or 0), 0.18 + (run["gross slip"] or 0)
    assert (onsets.incipient, onsets.gross) == pytest.approx(times)
    tracks = open_trials(study.folder.parent / "held").tracks(lost)
    assert tracks["time"].values[:3] == pytest.approx([0.0, 8e-3, 16e-3])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("times", "expected"),  # of the alarms: saved [%], false grips, before the load
    [
        (("label", "label"), (100.0, 0, 0)),
        ((None, None), (0.0, 0, 0)),
        ((0.2, 0.5), (0.0, 1, 0)),
        ((0.05, 0.05), (100.0, 1, 2)),
    ],
)
def test_scores_are_what_alarms_are_worth(
    study: fs.StudyResult, alarms: dict[str, Onsets], times: tuple[Any, Any], expected: tuple[float, int, int]
) -> None:
    path = study.folder.parent / "onsets.csv"
    pairs = zip(alarms, times, strict=True)
    write_onsets({name: alarms[name] if time == "label" else Onsets(time, None) for name, time in pairs}, path)
    table = score_alarms(study.folder, path)
    rows = {row[0]: row for row in table.rows}
    assert list(rows) == ["none", "force", "at once", "onsets.csv"]
    assert rows["onsets.csv"][1:4] == expected
    assert (rows["none"][1], rows["at once"][1], rows["at once"][2]) == (0.0, 100.0, 1)
    spent = [float(rows[name][4]) for name in ("none", "force", "at once")]  # type: ignore[arg-type]
    assert spent[0] == 0.0 < spent[1] < spent[2]
    assert (rows["onsets.csv"][4] == rows["force"][4]) == (times[0] == "label")
    assert "2 objects, 1 of which are lost without a reaction" in table.note


@pytest.mark.slow
def test_verb_writes_trials_and_scores_onsets_but_not_of_other_runs(
    study: fs.StudyResult, alarms: dict[str, Onsets], tmp_path: Path
) -> None:
    write_onsets(alarms, tmp_path / "mine.csv")
    assert read_onsets(tmp_path / "mine.csv") == alarms
    results = str(study.folder)
    for arguments, code, said in (
        ([results, str(tmp_path / "mine.csv")], 0, "Does the alarm save the object?"),
        ([results, "--trials", str(tmp_path / "held")], 0, "held: 2 trials"),
        ([results, "a.csv", "--trials", "b"], 2, "react: has onset times and --trials, needs one of them; write"),
        ([results], 2, "react: has no onset times and no --trials, needs one of them; write"),
        ([f"{results}-no"], 2, "-no: is not there"),
    ):
        done = CliRunner().invoke(app, ["react", *arguments])
        assert done.exit_code == code
        assert said in done.output
    write_onsets({"other": Onsets(1.0, None)}, tmp_path / "mine.csv")
    with pytest.raises(fs.InputError, match="has a row for other, no test trial"):
        score_alarms(study.folder, tmp_path / "mine.csv")
