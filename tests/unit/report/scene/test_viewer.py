"""Pictures and films, drawn without a display."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import pyvista
import xarray as xr
from PIL import Image

from fingerslip.errors import InputError, ResultError
from fingerslip.report.scene import viewer
from fingerslip.report.scene.options import SceneOptions
from fingerslip.report.scene.viewer import SceneControl, open_window, save_movie, save_still, still
from fingerslip.slip import Events, SlipEvents
from unit.report.scenes import block_history


@pytest.fixture(scope="module")
def history() -> xr.Dataset:
    return block_history()


def test_a_picture_shows_something_and_changes_with_what_is_shown(history: xr.Dataset) -> None:
    size = (160, 120)
    whole = still(history, options=SceneOptions(scalar="region"), size=size)
    assert whole.shape == (120, 160, 3)
    assert whole.std() > 5.0
    assert (whole[0, -1] == 255).all()  # a white ground
    field = still(history, options=SceneOptions(), size=size)
    early = still(history, 0.0, SceneOptions(), size)
    assert np.abs(whole.astype(int) - field).max() > 50
    assert np.abs(early.astype(int) - field).max() > 50


def test_a_picture_is_a_file(history: xr.Dataset, tmp_path: Path) -> None:
    save_still(history, tmp_path / "block.png", 0.05)
    with Image.open(tmp_path / "block.png") as picture:
        assert picture.size == (1200, 900)
    assert [path.name for path in tmp_path.iterdir()] == ["block.png"]


def test_a_film_has_a_frame_for_every_snapshot(history: xr.Dataset, tmp_path: Path) -> None:
    save_movie(history, tmp_path / "block.gif", SceneOptions(cut="y"))
    with Image.open(tmp_path / "block.gif") as film:
        assert film.n_frames == history.sizes["snapshot_time"]


@pytest.mark.parametrize("save", [save_still, save_movie])
def test_an_ending_that_cannot_be_written_is_refused(history: xr.Dataset, tmp_path: Path, save: object) -> None:
    with pytest.raises(InputError, match=r"ends in '\.bmp', needs one of"):
        save(history, tmp_path / "block.bmp")  # type: ignore[operator]
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_is_not_there_is_an_error(history: xr.Dataset, tmp_path: Path) -> None:
    with pytest.raises(ResultError, match="cannot be written"):
        save_still(history, tmp_path / "nowhere" / "block.png")


def test_without_a_display_no_window_opens(history: xr.Dataset, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(viewer, "has_display", lambda: False)
    with pytest.raises(InputError, match="--screenshot"):
        open_window(history)


@pytest.fixture
def control(history: xr.Dataset) -> Iterator[SceneControl]:
    plotter = pyvista.Plotter(off_screen=True)
    yield SceneControl(plotter, history, SceneOptions())
    plotter.close()


def press(control: SceneControl, box: int, state: int) -> None:
    boxes = control.plotter.widgets.button_widgets
    boxes[box].GetRepresentation().SetState(state)
    boxes[box].InvokeEvent("StateChangedEvent")


def test_boxes_hide_layers_and_the_slider_keeps_them_hidden(control: SceneControl) -> None:
    viewer._add_controls(control)
    plotter = control.plotter
    (slider,) = plotter.widgets.slider_widgets
    assert len(plotter.widgets.button_widgets) == 5
    press(control, 0, 0)
    assert "layer skin" not in plotter.actors
    slider.GetRepresentation().SetValue(0.0)
    slider.InvokeEvent("EndInteractionEvent")
    assert "layer skin" not in plotter.actors
    assert plotter.actors["layer tissue"].bounds[5] == pytest.approx(10.0)
    press(control, 0, 1)
    assert "layer skin" in plotter.actors


def test_boxes_show_the_contact_and_hide_the_plate(control: SceneControl) -> None:
    viewer._add_controls(control)
    press(control, 2, 0)
    press(control, 4, 1)
    names = set(control.plotter.actors)
    assert "plate 0" not in names
    assert names & {"contact 1", "contact 2"}


def test_events_are_listed_and_a_picked_node_has_a_chart(control: SceneControl) -> None:
    viewer._add_controls(control, Events(slip=SlipEvents(incipient=0.06)))
    assert "event incipient" in control.plotter.actors
    for _ in range(2):
        viewer._draw_picked_node(control, (5.0, 5.0, 0.0))
    assert len(control.plotter.renderer._charts) == 1


def test_keys_go_round() -> None:
    assert [viewer._next(("a", "b"), name) for name in ("a", "b")] == ["b", "a"]
