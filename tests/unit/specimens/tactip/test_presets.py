"""The presets that ship: what the paper prints, and that all else says assumed with a range where it matters."""

from __future__ import annotations

import pytest

from fingerslip.specimens.tactip.tactip import PRESETS


@pytest.mark.parametrize("name", PRESETS.names)
def test_what_the_paper_prints(name):
    sensor = PRESETS.read(name)
    ridges = sensor.skin.ridges
    assert (ridges.pitch, ridges.height, sensor.skin.thickness) == (3.3e-3, 3e-3, 1e-3)
    assert sum(sensor.markers.rings) == 81
    assert ridges.enabled == ("ridged" in name)
    assert (sensor.part == "section") == name.endswith("2d")


def test_what_the_paper_does_not_print_comes_first_and_has_a_range():
    rows = PRESETS.table("tactip-ridged-2d")
    sources = [row.source for row in rows]
    assert sources == sorted(sources, key=lambda source: source != "assumed")
    notes = {row.path: row.note for row in rows if row.source == "assumed"}
    for path in ("dome.radius", "materials.gel.youngs_modulus", "materials.skin.youngs_modulus", "rods.radius"):
        assert "range" in notes[path]
