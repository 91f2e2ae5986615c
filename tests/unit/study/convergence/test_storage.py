"""What a refinement leaves beside the runs of a study, and what is read back of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from fingerslip.study.convergence.storage import (
    FOLDER,
    RunConvergence,
    read_convergences,
    read_uncertainties,
    write_convergences,
)
from fingerslip.uncertainty import Convergence, Series

SIZES = (1.0, 0.5, 0.25)
KNOWN = Convergence("overall slip", "s", 1.7, {"step": Series("step", SIZES, (1.7, 1.65, 1.625))})
LACKING = Convergence("incipient slip", "s", 1.2, {"step": Series("step", SIZES, (1.2, None, 1.1))})
FOUND = RunConvergence("run", "key", {"slip.overall": KNOWN, "slip.incipient": LACKING})


def test_series_come_back_as_they_were(tmp_path: Path) -> None:
    write_convergences(tmp_path, {"run": FOUND})
    assert read_convergences(tmp_path, {"run": "key"}) == {"run": FOUND}
    assert (tmp_path / FOLDER / "convergence.json").is_file()


def test_only_known_uncertainties_are_given(tmp_path: Path) -> None:
    write_convergences(tmp_path, {"run": FOUND})
    assert read_uncertainties(tmp_path, {"run": "key"}) == {"run": {"slip.overall": pytest.approx(1.25 * 0.1)}}


def test_runs_with_other_inputs_have_no_uncertainty(tmp_path: Path) -> None:
    write_convergences(tmp_path, {"run": FOUND})
    assert read_uncertainties(tmp_path, {"run": "changed"}) == {}
    assert read_uncertainties(tmp_path, {"other": "key"}) == {}


@pytest.mark.parametrize("text", [None, "", "{"])
def test_without_a_readable_file_nothing_is_known(tmp_path: Path, text: str | None) -> None:
    if text is not None:
        (tmp_path / FOLDER).mkdir()
        (tmp_path / FOLDER / "convergence.json").write_text(text)
    assert read_uncertainties(tmp_path, {"run": "key"}) == {}


def test_a_damaged_file_is_named_in_a_warning(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / FOLDER).mkdir()
    (tmp_path / FOLDER / "convergence.json").write_bytes(b"\xff")
    for _ in range(2):
        assert read_uncertainties(tmp_path, {"run": "key"}) == {}
    (message,) = caplog.messages
    assert "convergence.json: is damaged: it is no JSON; run fingerslip converge again; without it" in message
