"""What a viewer can change in a scene, and the signals of a picked node."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import pyvista
import xarray as xr

from fingerslip.report.scene.options import SceneOptions
from fingerslip.report.scene.viewer import SceneControl, nearest_node, picked_figure, receptor_legend
from fingerslip.slip import Events, SlipEvents
from unit.report.figures.made import panels
from unit.report.scenes import block_history


@pytest.fixture(scope="module")
def history() -> xr.Dataset:
    return block_history()


@pytest.fixture
def control(history: xr.Dataset) -> Iterator[SceneControl]:
    plotter = pyvista.Plotter(off_screen=True)
    yield SceneControl(plotter, history, SceneOptions(), 0.0)
    plotter.close()


def test_fields_have_one_bar_of_colours_each_and_layers_none(control: SceneControl) -> None:
    control.choose(scalar="displacement")
    assert list(control.plotter.scalar_bars.keys()) == ["displacement [mm]"]
    control.choose(scalar="region")
    assert list(control.plotter.scalar_bars.keys()) == []


def test_what_is_shown_follows_the_choices(control: SceneControl) -> None:
    control.show(0.1)
    control.choose(plate=False, contact=True, receptors=False)
    names = set(control.plotter.actors)
    assert names & {"contact 1", "contact 2"}
    assert not names & {"plate 0", "arrow 0", "sites FA-II"}
    control.choose(contact=False, camera="side")
    assert not {"contact 1", "contact 2"} & set(control.plotter.actors)


def test_the_last_layer_stays(control: SceneControl) -> None:
    control.toggle("skin", False)
    control.toggle("tissue", False)
    assert control.options.hidden == ("skin",)


def test_the_nearest_node_is_that_of_the_deformed_body(history: xr.Dataset) -> None:
    last = history.sizes["snapshot_time"] - 1
    moved = history["node_position"].values + history["snapshot_displacement"].values[last]
    assert nearest_node(history, last, 1e3 * moved[7] + 1e-3) == 7
    flat = block_history("Q4")
    assert nearest_node(flat, 0, np.array([*1e3 * flat["node_position"].values[3], 0.0])) == 3


def test_a_picked_node_has_its_displacement_and_the_stress_around_it(history: xr.Dataset) -> None:
    figure = picked_figure(history, 7, Events(slip=SlipEvents(incipient=0.06)))
    above, below = panels(figure)
    drawn = [line for line in above.lines if line.get_label() in "xyz"]
    moved = 1e3 * history["snapshot_displacement"].values[:, 7]
    np.testing.assert_allclose(np.stack([line.get_ydata() for line in drawn], axis=1), moved)
    assert below.lines[0].get_ydata().max() > 0.0
    assert figure.get_suptitle().startswith("Node 7 at (")


def test_the_legend_has_the_recorded_receptors_only(history: xr.Dataset) -> None:
    assert [kind for kind, _ in receptor_legend(history)] == ["FA-II"]
