"""The figure of a sensor."""

from __future__ import annotations

from fingerslip.report.figures.specimens import sensor_colours, tactip_figure
from fingerslip.specimens.tactip import PRESETS
from unit.report.figures.made import panels, words


def test_a_sensor_is_drawn_cut_open_and_with_all_its_markers():
    figure = tactip_figure(PRESETS.read("tactip-ridged-2d"), "ridged")
    section, inside, below = panels(figure)
    assert section.get_title(loc="left") == "cut open along the axis"
    assert len(section.collections[2].get_paths()) == 9, "rods in the plane of the axis"
    for axes in (inside, below):
        assert len(axes.collections[0].get_offsets()) == 81
    assert set(sensor_colours()) <= words(figure)
