"""One run: its folder is there whole or not at all."""

from __future__ import annotations

import errno
import json
import logging
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from fingerslip.errors import InputError, ResultError, SlipOutsideContactError
from fingerslip.history import read_history
from fingerslip.slip import events_from_mapping, find_events
from fingerslip.study.running import compute
from fingerslip.study.running.plan import Job, plan_study
from fingerslip.study.running.prepare import prepare
from fingerslip.study.running.runner import StudyFailedError, run_study
from fingerslip.study.storage import store
from fingerslip.study.storage.store import mesh_hash

Write = Callable[..., Path]


def run(path: Path) -> Any:
    return run_study(path, results_dir=path.parent / "results", workers=1)


@pytest.mark.usefixtures("simulated", "reports")
def test_full_disk_leaves_no_partial_run(write_study: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*arguments: object, **options: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(store, "write_mapping", full)
    path = write_study()
    with pytest.raises(StudyFailedError) as caught:
        run(path)
    first = next(iter(caught.value.errors.values()))
    assert isinstance(first, ResultError)
    assert "No space left on device" in str(first)
    assert str(first).endswith("free some space or choose another folder")
    assert not (path.parent / "results").exists()


@pytest.mark.usefixtures("simulated", "reports")
def test_history_that_does_not_fit_leaves_nothing(write_study: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(self: Path, data: bytes) -> int:
        with self.open("wb") as file:
            file.write(b"half of it")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_bytes", full)
    path = write_study()
    with pytest.raises(StudyFailedError, match=r"No space left on device.*free some space"):
        run(path)
    assert not (path.parent / "results").exists()


@pytest.mark.usefixtures("simulated", "reports")
def test_full_disk_for_the_folder_itself(write_study: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(self: Path, *arguments: object, **options: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    path = write_study()
    monkeypatch.setattr(Path, "mkdir", full)
    with pytest.raises(StudyFailedError, match="No space left on device"):
        run(path)


@pytest.fixture
def job(write_study: Write, tmp_path: Path) -> Job:
    """Return the second of three runs, ready to be computed."""
    plan = plan_study(write_study(), tmp_path / "results")
    return prepare(plan, plan.runs[1:2])[0]


@pytest.mark.usefixtures("simulated")
def test_what_is_stored_beside_the_history_says_what_happened(job: Job) -> None:
    told: list[float] = []
    compute.compute([job], told.append)
    assert told == [0.5]
    stored = json.loads((job.folder / "events.json").read_text())
    assert (stored["run"], stored["swept"]) == ("friction_coefficient-0.4", {"contact.friction_coefficient": 0.4})
    assert stored["identity"] == job.identity
    assert stored["mesh_hash"] == mesh_hash(job.model.mesh)
    history = read_history(job.folder / "history.nc")
    assert events_from_mapping(stored["events_s"]) == find_events(history)
    assert [peak["time_s"] for peak in stored["acceleration_peaks"]] == pytest.approx([1.53, 1.63, 1.71], abs=5.1e-3)
    assert stored["numbers"]["records"] == history.sizes["time"]
    values = yaml.safe_load((job.folder / "run.yaml").read_text())
    assert values["contact"]["friction_coefficient"] == 0.4
    assert "sweep" not in values


@pytest.mark.usefixtures("simulated")
def test_the_log_is_written_to_the_run_and_the_logger_left_as_it_was(job: Job) -> None:
    logger = logging.getLogger("fingerslip")
    before = (logger.level, list(logger.handlers))
    compute.compute([job], lambda _: None)
    assert (logger.level, list(logger.handlers)) == before
    text = (job.folder / "log.txt").read_text()
    assert f"identity {job.identity}" in text
    assert "simulated 401 records" in text
    assert "friction over normal force at the end of the slide: 0.4" in text


def test_a_failing_run_leaves_neither_folder_nor_handler(job: Job, monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(*_: object, **__: object) -> None:
        raise SlipOutsideContactError("contacts.0", "a", "b", "c")

    monkeypatch.setattr(compute, "simulate", failing)
    with pytest.raises(SlipOutsideContactError) as caught:
        compute.compute([job], lambda _: None)
    assert str(caught.value).endswith("block.yaml (contact.friction_coefficient = 0.4): contact: a, b; c")
    assert not list(job.folder.parent.iterdir())
    assert not logging.getLogger("fingerslip").handlers


def test_progress_may_end_a_run(job: Job, simulated: list[float]) -> None:
    def stop(_: float) -> None:
        raise InputError("here", "stopped", "goes on")

    with pytest.raises(InputError, match="stopped"):
        compute.compute([job], stop)
    assert simulated == [0.4]
    assert not list(job.folder.parent.iterdir())
