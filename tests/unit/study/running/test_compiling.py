"""Compiling is a phase of its own, once on a machine."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from fingerslip.study.inspection.check import check_studies
from fingerslip.study.running import cost
from fingerslip.study.running.progress import StudyProgress
from fingerslip.study.running.runner import run_study
from places import ROOT
from problems.pushed import push_and_slide

COLD = """
import dataclasses
import logging
logging.disable()
from numba.core import event
import fingerslip as fs
from fingerslip.model.model import ReducedBasis
from fingerslip.study.running.cost import compile_ahead, kinds_to_compile
from fingerslip.study.running.progress import StudyProgress
from physics.pressed_and_slid import models
named = models()
named["in a basis"] = dataclasses.replace(named["fingertip"], basis=ReducedBasis())
for name in ("quasi-static", "solid", "in a basis", "large strain"):
    model = named[name]
    assert bool(kinds_to_compile([model])) == (name != "solid")
    compile_ahead([model], StudyProgress())
    assert not kinds_to_compile([model])
    with event.install_recorder("numba:compile") as recorder:
        fs.simulate(model)
    assert len(recorder.buffer) < 10, recorder.buffer
"""


class Heard(StudyProgress):
    """Keeps the names and the shares that are done."""

    def __init__(self) -> None:
        self.names: list[str] = []
        self.shares: list[float] = []
        self.words: list[str] = []

    def begin(self, names):
        self.names += names

    def advance(self, _name, fraction):
        self.shares.append(fraction)

    def say(self, message):
        self.words.append(message)


def test_where_all_is_compiled_nothing_is_said(monkeypatch):
    monkeypatch.setattr(cost, "_has_cache", lambda _: True)
    heard = Heard()
    cost.compile_ahead([push_and_slide()], heard)
    assert (heard.names, heard.shares, heard.words) == ([], [], [])
    assert cost.compiling_seconds([push_and_slide()]) == 0.0


def test_compiling_comes_before_the_runs_with_an_estimate(write_study, tmp_path: Path, monkeypatch):
    study = write_study()
    monkeypatch.setattr(cost, "_has_cache", lambda _: False)
    assert "Compiling comes first, once on this machine: about 24 s." in check_studies([study]).note
    heard = Heard()
    run_study(study, results_dir=tmp_path / "results", workers=1, progress=heard)
    assert heard.names[0] == "compiling, once on this machine"
    assert heard.words[0] == "compiling, once on this machine: takes about 24 s"
    assert heard.shares[0] == 0.0


@pytest.mark.parametrize("kind", cost._SAMPLES)
def test_functions_that_tell_of_caches_are_there(kind: str) -> None:
    file, name = cost._SAMPLES[kind]
    assert f"\ndef {name}(" in (ROOT / "src" / "fingerslip" / file).read_text()


@pytest.mark.slow
def test_a_small_block_compiles_nearly_all_that_a_model_of_its_kind_needs(tmp_path: Path):
    paths = os.pathsep.join([str(ROOT / "tests"), *sys.path])
    environment = {**os.environ, "PYTHONPATH": paths, "NUMBA_CACHE_DIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", COLD], env=environment, check=True)
