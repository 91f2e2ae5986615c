"""Studies from Python: from files, mappings and other studies; checked, run and opened."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.errors import InputError
from fingerslip.study.definition.spec import read_study
from places import ROOT
from unit.study.block import FRICTIONS, block_values

Write = Callable[..., Path]


@pytest.mark.usefixtures("reports")
def test_a_study_is_checked_run_and_read_as_numbers(write_study: Write, tmp_path: Path, simulated: list[float]) -> None:
    study = fs.Study(write_study(), sweep={"contact.friction_coefficient": np.linspace(0.3, 0.5, 2)}, name="mine")
    checked = study.check(tmp_path)
    assert checked["state"].tolist() == ["to do"] * 2
    assert checked.attrs["note"].startswith("2 runs, about 0.1 min")
    assert checked.attrs["units"] == {"estimated time": "s"}
    opened = study.run(tmp_path, workers=1)
    assert opened.folder == tmp_path / "mine"
    frame = opened.to_dataframe()
    assert frame["contact.friction_coefficient"].tolist() == [0.3, 0.5]
    assert frame["overall_s"].dtype == "float64"
    assert frame.attrs["units"]["overall_s"] == "s"
    assert study.check(tmp_path)["state"].tolist() == ["finished"] * 2
    assert len(simulated) == 2
    assert study.run(tmp_path, workers=1).names == opened.names
    assert len(simulated) == 2
    study.run(tmp_path, workers=1, force=True)
    assert len(simulated) == 4


def test_a_study_starts_from_a_mapping_a_file_a_read_study_or_another_study(write_study: Write) -> None:
    path = write_study()
    runs = [fs.Study(base).check()["run"].tolist() for base in (path, str(path), read_study(path), fs.Study(path))]
    assert runs == [[f"friction_coefficient-{friction}" for friction in FRICTIONS]] * 4
    values = block_values() | {"mesh": {"file": str(path.with_name("block.msh"))}}
    changed = fs.Study(fs.Study(values), changes={"programme.0.press.depth": "0.2 mm", "sweep": {}}, name="deeper")
    assert changed.check()["run"].tolist() == ["run"]
    assert changed.mapping["programme"][0]["press"]["depth"] == "0.2 mm"
    assert values["programme"][0]["press"]["depth"] == "0.1 mm"


def test_a_saved_study_is_a_study_file(write_study: Write) -> None:
    path = write_study()
    saved = fs.Study(path, sweep={"contact.friction_coefficient": (0.1, 0.2)}).save(path.with_name("saved.yaml"))
    assert read_study(saved).sweep == {"contact.friction_coefficient": (0.1, 0.2)}


def test_shipped_studies_are_found_by_name() -> None:
    assert fs.Study("wang2014_table2").mapping["title"]
    assert repr(fs.Study("latency_sensitivity")).startswith("<Study 'What moves the latency of slip': contact.friction")


def test_what_is_no_study_is_refused(write_study: Write) -> None:
    with pytest.raises(InputError, match=r"Study\.base: got 3, needs a path, a name, a mapping or a Study"):
        fs.Study(3)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="needs the name of a folder"):
        fs.Study({}, name="a/b")
    with pytest.raises(InputError, match=r"Study\.changes\.title\.x: leads nowhere"):
        fs.Study(block_values(), changes={"title.x": 1}).check()
    with pytest.raises(InputError, match=r"mine\.yaml: sweep\.contact\.x: is not known"):
        fs.Study(block_values(), sweep={"contact.x": [1]}, name="mine").check()
    with pytest.raises(InputError, match="nothing: is not there"):
        fs.Study("nothing").check()


def test_studies_show_themselves(write_study: Write) -> None:
    study = fs.Study(block_values(), sample={"count": 4, "ranges": {"contact.friction_coefficient": [0.2, 0.4]}})
    words = "contact.friction_coefficient (3 values), contact.friction_coefficient (0.2 to 0.4)"
    assert repr(study) == f"<Study 'Block on a plate': {words}>"
    assert "<td>0.2 to 0.4</td>" in study._repr_html_()


SCRIPT = """
import fingerslip as fs
study = fs.Study({path!r})
opened = study.run({results!r}, workers=2)
print(len(opened), opened.to_dataframe()["overall_s"].notna().sum())
"""


@pytest.mark.slow
def test_a_script_without_a_main_guard_uses_several_workers(write_study: Write, tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(SCRIPT.format(path=str(write_study()), results=str(tmp_path / "results")), encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    command = [sys.executable, str(script)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    assert done.stdout.split() == ["3", "2"]
