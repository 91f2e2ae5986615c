"""The colour language: told apart by people who see no green, and described in the docs."""

import itertools

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from fingerslip.report import colours
from places import ROOT

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


def test_red_and_green_are_taken_for_each_other_without_green():
    pair = ("#b06000", "#708000")
    far, near = (np.linalg.norm(lab(pair[0], s) - lab(pair[1], s)) for s in ("trichromacy", "deuteranopia"))
    assert near < 0.5 * far


def test_events_darken_in_time_with_a_dash_each_and_other_regions_have_colours_of_their_own():
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
