"""What a scene is made of."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista
import xarray as xr

from fingerslip.errors import InputError, ResultError
from fingerslip.report.scene.options import SceneOptions
from fingerslip.report.scene.scene import aim, check_options, draw_scene, field_limits, region_names, snapshot_grid
from unit.report.scenes import block_history


@pytest.fixture(scope="module")
def history() -> xr.Dataset:
    return block_history()


def test_grid_is_the_deformed_mesh_in_millimetres(history: xr.Dataset) -> None:
    grid = snapshot_grid(history, 0)
    assert grid.volume == pytest.approx(1000.0)
    assert grid.bounds == pytest.approx((0.0, 10.0) * 3)
    pressed = snapshot_grid(history, history.sizes["snapshot_time"] - 1)
    assert pressed.bounds[4] == pytest.approx(0.5, abs=0.05)  # on soft penalties


def test_fields_are_in_their_units(history: xr.Dataset) -> None:
    grid = snapshot_grid(history, 1)
    moved = history["snapshot_displacement"].values[1]
    assert grid.point_data["displacement"] == pytest.approx(1e3 * np.linalg.norm(moved, axis=1))
    assert grid.cell_data["von_mises"] == pytest.approx(1e-3 * history["snapshot_von_mises"].values[1])


@pytest.mark.parametrize("element", ["T10", "H8", "Q4", "T3", "T6"])
def test_every_element_has_its_cells(element: str) -> None:
    history = block_history(element)
    grid = snapshot_grid(history, 0)
    sizes = grid.compute_cell_sizes()["Area" if history.sizes["component"] == 2 else "Volume"]
    assert sizes.sum() == pytest.approx(100.0 if history.sizes["component"] == 2 else 1000.0)


def drawn(history: xr.Dataset, options: SceneOptions) -> pyvista.Plotter:
    plotter = pyvista.Plotter(off_screen=True)
    draw_scene(plotter, history, 2, options)
    aim(plotter, history, options)
    return plotter


def test_layers_plate_and_receptors_are_there(history: xr.Dataset) -> None:
    names = set(drawn(history, SceneOptions()).actors)
    assert {"layer skin", "layer tissue", "plate 0", "sites FA-II", "time"} <= names


def test_what_is_hidden_is_not_there(history: xr.Dataset) -> None:
    names = set(drawn(history, SceneOptions(hidden=("skin",), plate=False, receptors=False)).actors)
    assert "layer tissue" in names
    assert not names & {"layer skin", "plate 0", "sites FA-II"}


def test_colours_are_scaled_to_what_is_shown_and_not_to_the_bone(history: xr.Dataset) -> None:
    values = np.where(history["cell_region"].values == 0, 1e3, 9e6) * np.ones_like(history["snapshot_von_mises"])
    names = region_names(history)
    stressed = history.assign(snapshot_von_mises=(history["snapshot_von_mises"].dims, values))
    assert field_limits(stressed, SceneOptions()) == pytest.approx((0.0, 9e3))
    assert field_limits(stressed, SceneOptions(hidden=names[1:])) == pytest.approx((0.0, 1.0))
    bone = stressed.assign_attrs(regions=f"{names[0]}, phalanx")
    assert field_limits(bone, SceneOptions()) == pytest.approx((0.0, 1.0))
    assert field_limits(bone, SceneOptions(hidden=names[:1])) == pytest.approx((0.0, 9e3))


def test_a_picture_can_go_without_writing(history: xr.Dataset) -> None:
    plotter = drawn(history, SceneOptions(written=False))
    assert "time" not in plotter.actors
    assert not plotter.scalar_bars


def test_a_cut_leaves_half_of_the_body(history: xr.Dataset) -> None:
    def depth(cut: str) -> float:
        plotter = drawn(history, SceneOptions(cut=cut, plate=False, scalar="region"))
        bounds = plotter.actors["layer tissue"].bounds
        return bounds[3] - bounds[2]

    assert depth("y") == pytest.approx(0.5 * depth("none"), rel=0.05)


def test_the_plate_is_where_the_body_touches(history: xr.Dataset) -> None:
    plotter = drawn(history, SceneOptions())
    step = int(np.abs(history["time"].values - float(history["snapshot_time"][2])).argmin())
    height = 1e3 * float(history["counterface_displacement"].values[step, 0, 2])
    assert plotter.actors["plate 0"].bounds[4:] == pytest.approx((height, height), abs=1e-6)


def test_regions_keep_their_order(history: xr.Dataset) -> None:
    assert region_names(history) == ("skin", "tissue")


def test_a_region_that_is_not_there_is_refused(history: xr.Dataset) -> None:
    with pytest.raises(InputError, match="'nail', which is no region, may hold skin, tissue"):
        check_options(history, SceneOptions(hidden=("nail",)))


def test_a_history_without_snapshots_says_what_to_write(history: xr.Dataset) -> None:
    with pytest.raises(ResultError, match="snapshots_every"):
        check_options(history.drop_dims("snapshot_time"), SceneOptions())
