"""Rows of the pouring task from scores, and stored ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fingerslip.detect.evaluation.scores import event_scores_of
from fingerslip.detect.labels import Onsets
from fingerslip.detect.unseen import READINGS, Unseen
from fingerslip.validation import sensor as pouring
from fingerslip.validation.sensor import pouring_rows, rows_of_pouring
from places import ROOT

LABELS = {name: Onsets(2.0, 6.0) for name in ("a", "b", "c")}


def unseen(*, gross: float | None) -> Unseen:
    """Return findings that are 0.4 s early on average."""
    found = {"a": Onsets(1.5, gross), "b": Onsets(1.6, gross), "c": Onsets(1.7, gross)}
    scores = event_scores_of(found, LABELS, dict.fromkeys(LABELS, 1.0))
    return Unseen(dict.fromkeys(READINGS, found), dict.fromkeys(READINGS, scores), np.zeros((3, 3, 3), dtype=np.intp))


def test_every_published_number_and_statement_has_a_row_in_both_readings() -> None:
    rows = rows_of_pouring(unseen(gross=None), "section")
    assert len(rows) == 12
    error, spread, lead, _, before, statement = rows[:6]
    assert error.quantity == "onset error while pouring, section, forest (single frames)"
    assert (error.ours, error.published, error.unit) == (pytest.approx(-0.4), -0.418, "s")
    assert error.uncertainty is not None
    assert error.verdict == "agrees"
    assert (spread.ours, spread.verdict) == (pytest.approx(0.1), "not judged")
    assert (lead.ours, lead.verdict) == (pytest.approx(4.4), "misses")
    assert (before.ours, before.verdict) == (1.0, "agrees")
    assert (statement.ours, statement.verdict) == (0.0, "holds")
    assert rows[6].quantity.endswith("(detector)")


def test_gross_slip_that_is_found_contradicts_the_paper() -> None:
    statement = rows_of_pouring(unseen(gross=3.0), "in 3D")[5]
    assert (statement.ours, statement.verdict) == (1.0, "fails")


def test_shipped_rows_are_those_of_the_studies() -> None:
    stored = pouring_rows(ROOT / "studies", ROOT / "results")
    assert "the studies are the same" in stored.origin
    assert len(stored.rows) == 24


def test_rows_are_computed_stored_and_read_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert pouring_rows(tmp_path, tmp_path).rows == ()
    monkeypatch.setattr(pouring, "run_studies", lambda *_, **__: ())
    monkeypatch.setattr(pouring, "pouring_of", lambda *_: unseen(gross=None))
    monkeypatch.setattr(pouring, "pouring_in_space", lambda *_: unseen(gross=3.0))
    made = pouring_rows(tmp_path, tmp_path, compute=True)
    assert pouring_rows(tmp_path, tmp_path).rows == made.rows
    section, space = rows_of_pouring(unseen(gross=None), "section"), rows_of_pouring(unseen(gross=3.0), "in 3D")
    assert made.rows == section + space
