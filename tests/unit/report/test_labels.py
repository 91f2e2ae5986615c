"""Titles of runs and labels of paths: signs stay, whatever the names of folders are."""

import doctest

import pytest

from fingerslip.report import labels
from fingerslip.report.labels import path_label, path_labels, run_title, swept_text
from fingerslip.results import RunResult
from fingerslip.slip import Events


@pytest.mark.parametrize(
    ("swept", "title"),
    [
        ({"fingertip.solid.angle": "-30 deg"}, "angle -30 deg"),
        ({"fingertip.solid.angle": "30 deg"}, "angle 30 deg"),
        ({"time.alpha": -0.05, "fingertip.phalanx.variant": "scaled"}, "alpha -0.05, phalanx scaled"),
        ({"fingertip.fingerprint.enabled": False}, "fingerprint no"),
        ({"programme.1.slide.direction": [-1, 0, 1]}, "direction (-1, 0, 1)"),
        ({"contacts.0.counterface": {"sphere": {"radius": "8 mm"}}}, "counterface sphere radius 8 mm"),
        ({"contact.friction_coefficient": 0.1 * 6}, "friction coefficient 0.6"),
        ({"mesh.contact_size": f"{0.1 * 3} mm"}, "contact size 0.3 mm"),
        ({"a.speed": 1, "b.speed": 2}, "a.speed 1, b.speed 2"),
        ({}, "A study"),
    ],
)
def test_a_run_is_called_by_its_swept_values_or_else_like_its_study(swept, title):
    assert run_title(RunResult("folder", swept, Events()), "A study") == title
    assert run_title(RunResult("run", {}, Events()), "") == "run"


def test_paths_become_words_that_tell_them_apart_and_values_those_of_the_study_file():
    assert path_label("fingertip.fingerprint.enabled") == "fingerprint"
    assert path_labels(["fingertip.phalanx.variant", "time.step"]) == {
        "fingertip.phalanx.variant": "phalanx",
        "time.step": "step",
    }
    assert list(path_labels(["a.speed", "b.speed"]).values()) == ["a.speed", "b.speed"]
    assert [swept_text(value) for value in (0.6, "8 mm", True, None, [1, 0])] == [0.6, "8 mm", True, None, "1, 0"]
    assert doctest.testmod(labels).failed == 0
