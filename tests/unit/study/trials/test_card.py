"""The notes of a data card."""

from __future__ import annotations

import numpy as np

from fingerslip.dynamics.statics.body import StaticBody
from fingerslip.study.definition.spec import read_study
from fingerslip.study.trials.trials import card_notes
from places import ROOT

NONE = np.zeros((0, 3))


def test_the_card_names_every_range_and_the_strains():
    study = read_study(ROOT / "studies" / "bulens2023_dataset.yaml")
    body = StaticBody(np.arange(7), np.zeros((7, 3)), np.ones(7), NONE, NONE, NONE, NONE)
    notes = card_notes(study, study.trials, body)
    assert "Strains are small" in notes
    assert "Contact: 7 patches of 0.8 mm" in notes
    for path, (low, high) in study.sample.ranges.items():
        assert f"| `{path}` | {low} to {high} |" in notes
