"""Titles of runs, labels of paths and the colour language, told apart by people who see no green."""

import itertools

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from fingerslip.report import colours
from fingerslip.report.labels import path_label, path_labels, run_title, swept_text
from fingerslip.results import RunResult
from fingerslip.slip import Events
from places import ROOT


@pytest.mark.parametrize(
    ("swept", "title"),
    [
        ({"fingertip.solid.angle": "-30 deg"}, "angle -30 deg"),
        ({"fingertip.solid.angle": "30 deg"}, "angle 30 deg"),
        ({"time.alpha": -0.05, "fingertip.phalanx.variant": "scaled"}, "alpha -0.05, phalanx scaled"),
        ({"fingertip.fingerprint.enabled": False}, "fingerprint no"),
        ({"programme.1.slide.direction": [-1, 0, 1]}, "slide direction (-1, 0, 1)"),
        ({"contacts.0.counterface": {"sphere": {"radius": "8 mm"}}}, "counterface sphere radius 8 mm"),
        ({"contact.friction_coefficient": 0.1 * 6}, "friction coefficient 0.6"),
        ({"mesh.contact_size": f"{0.1 * 3} mm"}, "contact size 0.3 mm"),
        ({"a.speed": 1, "b.speed": 2}, "a speed 1, b speed 2"),
        ({}, "A study"),
    ],
)
def test_a_run_is_called_by_its_swept_values_or_else_like_its_study(swept, title):
    assert run_title(RunResult("folder", swept, Events()), "A study") == title
    assert run_title(RunResult("run", {}, Events()), "") == "run"


def test_paths_become_words_that_tell_them_apart_and_values_those_of_the_study_file():
    paths = {"a.fingerprint.enabled": "fingerprint", "fingertip.phalanx.variant": "phalanx", "time.step": "step"}
    assert path_labels(list(paths)) == paths
    assert list(path_labels(["a.speed", "b.speed"]).values()) == ["a speed", "b speed"]
    moduli = [f"fingertip.materials.{layer}.youngs_modulus" for layer in ("epidermis", "dermis")]
    assert path_label(moduli[0]) == "epidermis Young's modulus", "a layer without others, too"
    assert list(path_labels(moduli).values()) == ["epidermis Young's modulus", "dermis Young's modulus"]
    assert path_label("materials.SkinPart.poisson_ratio") == "SkinPart Poisson's ratio"
    assert [swept_text(value) for value in (0.6, "8 mm", True, None, [1, 0])] == [0.6, "8 mm", True, None, "1, 0"]


# Simulated deuteranopia and protanopia, acting on linear RGB: Vienot, Brettel and Mollon's projection.
_LMS = np.array([[17.8824, 43.5161, 4.11935], [3.45565, 27.1554, 3.86714], [0.0299566, 0.184309, 1.46709]])
_SEEN = {
    "trichromacy": np.eye(3),
    "deuteranopia": np.array([[1.0, 0.0, 0.0], [0.494207, 0.0, 1.24827], [0.0, 0.0, 1.0]]),
    "protanopia": np.array([[0.0, 2.02344, -2.52581], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
}
_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


# Differences of 10 in CIELAB are seen at a glance.
_AT_A_GLANCE = 10.0
GROUPS = {
    "states": dict(colours.STATE_COLOURS),
    "events": dict(colours.EVENT_COLOURS),
    "receptors": dict(colours.RECEPTOR_COLOURS),
    "areas": dict(colours.AREA_COLOURS),
    "readings": dict(colours.READING_COLOURS),
}


def lab(colour, sight):
    """Return a colour in CIELAB as seen with a kind of sight."""
    rgb = np.array(to_rgb(colour))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    seen = np.clip(np.linalg.solve(_LMS, _SEEN[sight] @ (_LMS @ linear)), 0.0, 1.0)
    ratio = _XYZ @ seen / np.array([0.9505, 1.0, 1.089])
    f = np.where(ratio > 216 / 24389, np.cbrt(ratio), (24389 / 27 * ratio + 16) / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("sight", list(_SEEN))
@pytest.mark.parametrize("group", list(GROUPS))
def test_colours_of_a_group_are_told_apart(group, sight):
    for one, other in itertools.combinations(GROUPS[group], 2):
        pair = (GROUPS[group][one], GROUPS[group][other])
        distance = np.linalg.norm(lab(pair[0], sight) - lab(pair[1], sight))
        assert distance > _AT_A_GLANCE, f"{one} and {other} differ by {distance:.1f}"


def test_events_darken_in_time_and_regions_have_colours_of_their_own():
    lightness = [lab(colour, "trichromacy")[0] for colour in colours.EVENT_COLOURS.values()]
    assert lightness == sorted(lightness, reverse=True)
    assert len(set(colours.EVENT_DASHES.values())) == len(colours.EVENT_COLOURS)
    assert len(set(colours.RECEPTOR_MARKS.values())) == len(colours.RECEPTOR_COLOURS)
    found = colours.region_colours(["rods", "skin", "tissue"])
    assert list(found) == ["skin", "tissue", "rods"]
    assert len(set(found.values())) == 3
    page = (ROOT / "docs" / "figures.md").read_text(encoding="utf-8")
    for group in (*GROUPS.values(), colours.REGION_COLOURS):
        for colour in group.values():
            assert f"`{colour}`" in page
