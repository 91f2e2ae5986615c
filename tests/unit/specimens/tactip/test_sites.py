"""Recorded points of a TacTip."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fingerslip.specimens.tactip.sites import GROUPS, marker_sites, modelled_places
from fingerslip.specimens.tactip.tactip import PRESETS

SENSOR = PRESETS.read("tactip-ridged-2d")


@pytest.mark.parametrize(("part", "count"), [("section", 9), ("half", 45), ("whole", 81)])
def test_a_part_has_its_own_markers(part, count):
    sensor = dataclasses.replace(SENSOR, part=part)
    assert len(modelled_places(sensor).ring) == count
    assert len({site.name for site in marker_sites(sensor, "internal_markers")}) == count


def test_rods_stand_upright_on_the_dome():
    feet, ends = (
        np.array([site.position for site in marker_sites(dataclasses.replace(SENSOR, part="whole"), group)])
        for group in ("rod_feet", "internal_markers")
    )
    assert np.linalg.norm(ends - feet, axis=1) == pytest.approx(5.5e-3)
    centre = np.array([0.0, SENSOR.dome.radius, 0.0])
    assert np.cross(ends - centre, feet - centre) == pytest.approx(0.0, abs=1e-12)


def test_external_markers_are_flush_with_the_skin():
    for site in marker_sites(SENSOR, "external_markers"):
        x, y = site.position
        assert np.hypot(x, y - SENSOR.dome.radius) == pytest.approx(SENSOR.dome.radius)
        assert site.kind == GROUPS["external_markers"]
