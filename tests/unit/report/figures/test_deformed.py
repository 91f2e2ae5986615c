"""The deformed body: sections, views, cuts."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from matplotlib.collections import PolyCollection

from fingerslip.errors import ResultError
from fingerslip.report.figures.deformed import (
    crop,
    cut_frames_figure,
    deformed_frames_figure,
    frame_times,
    has_frames,
    solid_views_figure,
)
from fingerslip.report.scene.options import SceneOptions
from fingerslip.slip import Events, SlipEvents
from unit.report.figures.made import panels
from unit.report.scenes import block_history
from unit.synthetic import Process, make

HISTORY = block_history("Q4")


def test_panels_are_the_start_of_the_slide_and_the_events() -> None:
    events = Events(slip=SlipEvents(incipient=0.06, noticed=0.07, overall=0.1))
    drawn = [axes for axes in panels(deformed_frames_figure(HISTORY, events)) if axes.get_title(loc="left")]
    titles = [" ".join(axes.get_title(loc="left").split()) for axes in drawn]
    assert titles == ["0.050 s, start of slide, 10 ms before incipient", "0.100 s, overall"]
    cells = next(item for item in drawn[-1].collections if isinstance(item, PolyCollection))
    assert len(cells.get_paths()) == HISTORY.sizes["cell"]


@pytest.mark.parametrize("scalar", ["region", "displacement", "strain_energy_density"])
def test_other_fields_and_times_can_be_chosen(scalar: str) -> None:
    figure = deformed_frames_figure(HISTORY, scalar=scalar, times=[0.0, 0.1])
    titled = [axes for axes in panels(figure) if axes.get_title(loc="left")]
    assert len(titled) == 2
    corners = np.array([titled[0].get_xlim(), titled[0].get_ylim()])
    assert (corners[:, 1] - corners[:, 0] > 10.0).all(), "the whole body is framed, in millimetres"


def test_a_history_without_a_section_is_refused() -> None:
    assert not has_frames(make(Process()))
    with pytest.raises(ResultError, match="needs two dimensions and record"):
        deformed_frames_figure(block_history("T4"))


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
    found = frame_times(history, Events(slip=SlipEvents(overall=0.09)), ("overall",))
    assert list(found.values()) == ["start of slide", "overall"]


@pytest.mark.slow
def test_every_snapshot_is_drawn_once_and_none_after_overall_slip(history: xr.Dataset) -> None:
    assert history["snapshot_time"].values == pytest.approx([0.0, 0.05, 0.1])
    panels = [axes for axes in cut_frames_figure(history).axes if axes.get_visible()]
    assert [axes.get_title("left") for axes in panels if axes.images] == ["0.050 s", "0.100 s"]
    early = cut_frames_figure(history, Events(SlipEvents(overall=0.06)))
    assert [axes.get_title("left") for axes in early.axes if axes.images] == ["0.050 s"]


def test_pictures_differ_as_the_stress_does(history: xr.Dataset) -> None:
    first, second = (axes.images[0].get_array() for axes in cut_frames_figure(history).axes if axes.images)
    assert first.shape == second.shape
    assert np.abs(first.astype(int) - second.astype(int)).max() > 50


def test_pictures_share_one_bar_with_its_unit(history: xr.Dataset) -> None:
    labels = [axes.get_ylabel() for axes in cut_frames_figure(history).axes if axes.get_ylabel()]
    assert labels == ["von Mises stress [kPa]"]


def test_white_margins_go_at_the_same_place_of_all_pictures() -> None:
    first, second = np.full((2, 6, 8, 3), 255, dtype=np.uint8)
    first[1, 2], second[3, 5] = 0, 0
    for picture, black in zip(crop([first, second]), [(0, 0), (2, 3)], strict=True):
        assert picture.shape == (3, 4, 3)
        assert np.argwhere(picture[..., 0] == 0).tolist() == [list(black)]
    blank = np.full((3, 3, 3), 255, dtype=np.uint8)
    assert crop([blank])[0].shape == blank.shape
