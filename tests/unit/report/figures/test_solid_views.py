"""Lit views of a solid."""

from __future__ import annotations

import pytest
import xarray as xr

from fingerslip.report.figures.deformed import solid_views_figure, view_times
from fingerslip.report.scene.options import SceneOptions
from fingerslip.slip import Events, SlipEvents
from unit.report.scenes import block_history


@pytest.fixture(scope="module")
def history() -> xr.Dataset:
    return block_history("T4")


def test_each_time_is_a_picture_with_one_bar_for_all(history: xr.Dataset) -> None:
    figure = solid_views_figure(history, times=[0.0, 0.1])
    pictures = [axes for axes in figure.axes if axes.images]
    assert [axes.get_title(loc="left") for axes in pictures] == ["0.000 s", "0.100 s"]
    assert sum(axes.get_ylabel() == "von Mises stress [kPa]" for axes in figure.axes) == 1


def test_layers_and_contact_have_a_legend(history: xr.Dataset) -> None:
    options = SceneOptions(scalar="region", contact=True, camera="below", written=False)
    figure = solid_views_figure(history, options=options, times=[0.1])
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["skin", "tissue", "stick", "slip"]


def test_times_are_the_start_of_the_slide_and_what_happened(history: xr.Dataset) -> None:
    found = view_times(history, Events(slip=SlipEvents(overall=0.09)))
    assert list(found.values()) == ["start of slide", "overall"]
