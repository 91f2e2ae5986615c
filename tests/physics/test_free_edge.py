"""A finger that touches with its cut end: the model lacks what would touch next, and every output says so.

At an angle of 30 degrees the lowest point of the finger is at its proximal cut, at 0 degrees it is in the pad.
"""

import csv
import json
from pathlib import Path

import pytest
import yaml

from fingerslip.report.tables.runs import run_caveats
from fingerslip.study.running.runner import run_study
from unit.study.conftest import draw_nothing

STUDY = {
    "title": "A level and an inclined finger",
    "fingertip": {"preset": "wang2014-3d"},
    "mesh": {"element": "T4", "contact_size": "1.2 mm", "bulk_size": "2.5 mm"},
    "integration": "nodal",
    "contact": {"friction_coefficient": 0.6},
    "programme": [
        {"press": {"depth": "1 mm", "speed": "10 mm/s"}},
        {"slide": {"distance": "0.2 mm", "speed": "10 mm/s"}},
    ],
    "time": {"step": "10 ms", "alpha": -0.41421},
    "sweep": {"fingertip.solid.angle": ["0 deg", "30 deg"]},
}


@pytest.mark.slow
def test_only_the_inclined_finger_touches_at_its_cut_end_and_every_output_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "angles.yaml"
    path.write_text(yaml.safe_dump(STUDY, sort_keys=False))
    draw_nothing(monkeypatch)
    study = run_study(path, results_dir=tmp_path / "results", workers=1)
    level, inclined = study.runs
    assert level.edge is None
    assert level.numbers["edge_distance_min_m"] > 4e-3
    assert inclined.edge is not None
    assert (inclined.edge.boundary, inclined.edge.distance) == ("skin", 0.0)
    assert inclined.edge.time <= 0.02, "it touches there first"
    folders = [study.folder / run.name for run in study.runs]
    level, inclined = (json.loads((folder / "events.json").read_text())["edge_contact"] for folder in folders)
    assert level is None
    assert inclined["boundary"] == "skin"
    logs = [(folder / "log.txt").read_text() for folder in folders]
    assert ["WARNING" in log and "free edge of its boundary" in log for log in logs] == [False, True]
    caveat = run_caveats(study.runs)[0]
    assert "angle 30 deg ('skin'" in caveat
    assert "angle 0 deg" not in caveat
    with (study.folder / "summary.csv").open() as file:
        distances = [float(row["edge_distance_min_m"]) for row in csv.DictReader(file)]
    assert distances[0] > 4e-3
    assert distances[1] == 0.0
