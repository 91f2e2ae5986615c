"""Figures of markers: tracks, fields, quality, cameras, detectors; and of specimens at rest."""

from __future__ import annotations

import numpy as np
import pytest
import skfem
import xarray as xr
from matplotlib.quiver import Quiver

from fingerslip.detect.evaluation.scores import Estimate
from fingerslip.marker_layouts import ring_layout
from fingerslip.marker_tracks import filmed_tracks, marker_tracks
from fingerslip.report.figures.markers import (
    count_figure,
    fields_figure,
    film_times,
    frames_figure,
    importance_figure,
    jump_figure,
    learning_curve_figure,
    marker_places_figure,
    marker_tracks_figure,
    noise_figure,
    onsets,
    ring_colours,
    robustness_figure,
    slide_tracks_figure,
    slip_order_figure,
)
from fingerslip.report.figures.specimens import (
    SENSOR_COLOURS,
    fingertip_figure,
    receptor_positions,
    section_figure,
    tactip_figure,
)
from fingerslip.specimens.tactip import PRESETS
from fingerslip.vision.cameras.camera import external_camera, true_tracks
from fingerslip.vision.fields import marker_fields
from fingerslip.vision.tracks import make_tracks
from unit.filmed import NODES, filmed_history
from unit.fingers import change, change_solid
from unit.report.figures.made import BARE, HISTORY, NO_SLIDE, panels, texts, titles, words
from unit.report.scenes import block_history
from unit.synthetic import KINDS, Process, slip_times

LAYOUT = ring_layout(1e-3, (1, 8, 16))
TIMES = np.arange(31) / 30


def tracks(units: str = "m", **more):
    """Return markers that move apart by a tenth in a second and shift by a millimetre along y."""
    position = LAYOUT.position * (1 + 0.1 * TIMES)[:, None, None] + TIMES[:, None, None] * (0.0, 1e-3)
    position[10:20, 24] = np.nan
    return make_tracks(position * (1.0 if units == "m" else 1e5), TIMES, units=units, **more)


def test_a_line_for_each_marker_in_the_colour_of_its_ring():
    figure = marker_tracks_figure(tracks(ring=LAYOUT.ring), "slide")
    first, second = panels(figure)
    assert len(first.lines) == len(second.lines) == 25
    colours = [line.get_color() for line in first.lines]
    assert [colours.count(colour) for colour in ring_colours(3)] == [1, 8, 16]
    assert colours[-1] == ring_colours(3)[0], "the centre is on top"
    np.testing.assert_allclose(second.lines[-1].get_ydata(), 1.0 * TIMES, atol=1e-12)
    assert {"Markers over time: slide", "displacement [mm]", "centre", "ring 2"} <= words(figure)


def test_lost_markers_leave_gaps_and_layouts_without_rings_have_no_key():
    figure = marker_tracks_figure(tracks("px"))
    gaps = [int(np.isnan(np.asarray(line.get_ydata(), dtype=float)).sum()) for line in panels(figure)[0].lines]
    assert sorted(gaps) == [0] * 24 + [10]
    assert "centre" not in words(figure)
    assert "displacement [px]" in words(figure)
    assert len(panels(marker_tracks_figure(make_tracks(np.empty((0, 2, 2)), [], units="px")))[0].lines) == 2


@pytest.mark.parametrize("units", ["m", "px"])
def test_all_fields_have_their_panel(units):
    figure = fields_figure(marker_fields(tracks(units)), 0.5, "slide")
    fields = ["displacement", "velocity", "rigid residual", "divergence [%]", "curl [%]"]
    assert titles(figure) == [*fields, "larger principal strain [%]"]
    assert sum(isinstance(artist, Quiver) for axes in panels(figure) for artist in axes.get_children()) == 3
    assert panels(figure)[0].yaxis_inverted() == (units == "px")
    assert "Fields from markers at 0.5 s: slide" in words(figure)


def test_the_longest_arrow_is_stated_and_lost_markers_are_marked():
    # The outermost marker moves by 0.2 mm away from the centre and by 1 mm along y.
    assert "longest 1.2 mm" in texts(panels(fields_figure(marker_fields(tracks()), 1.0))[0])
    crosses = panels(fields_figure(marker_fields(tracks()), 0.5))[1].collections[-1].get_offsets()
    np.testing.assert_allclose(crosses, [1e3 * LAYOUT.position[24]], atol=1e-9)
    line = make_tracks(np.tile(np.column_stack([np.arange(4.0), np.zeros(4)]), (31, 1, 1)), TIMES, units="px")
    empty = panels(fields_figure(marker_fields(line), 0.0))[3:6]
    assert [texts(axes) for axes in empty] == [["no triangle of markers"]] * 3


@pytest.fixture
def still() -> xr.Dataset:
    rest = np.array([[10.0, 10.0], [30.0, 10.0], [10.0, 30.0], [30.0, 30.0]])
    position = rest + np.random.default_rng(0).normal(0, 0.1, (12, 4, 2))
    position[4:6, 2] = np.nan
    made = make_tracks(position, np.arange(12) / 10.0, units="px", attributes={"rest_frames": 3, "frame_rate": 10.0})
    dims = ("marker", "axis")
    state = np.eye(12, dtype=np.int8)[5]
    return made.assign(frame_state=("time", state), reference=(dims, rest), rest_noise=(dims, np.full((4, 2), 0.1)))


def test_quality_is_counted_lost_intervals_noise_at_rest_and_jumps(still: xr.Dataset) -> None:
    count, lost = count_figure(still).axes
    assert count.get_lines()[0].get_ydata().tolist() == [4, 4, 4, 4, 3, 3, 4, 4, 4, 4, 4, 4]
    (bar,) = lost.patches
    assert (bar.get_x(), bar.get_width()) == pytest.approx((0.35, 0.2))
    axes, _ = noise_figure(still, np.zeros((40, 40), dtype=np.uint8)).axes
    assert np.asarray(axes.collections[0].get_offsets()) == pytest.approx(still["reference"].values, abs=0.3)
    assert texts(axes) == ["0", "1", "2", "3"]
    (jumps,) = jump_figure(still).axes
    # A marker without three neighbours that were seen is not judged.
    assert sum(patch.get_height() for patch in jumps.patches) == 8 * 4
    assert "no two frames" in texts(jump_figure(still.isel(time=slice(0, 1))).axes[0])[0]


def test_a_learning_curve_shows_accuracy_and_f1() -> None:
    points = [(4, Estimate(0.7, 0.6, 0.8), Estimate(0.6, 0.5, 0.7)), (8, Estimate(0.8, 0.7, 0.9), Estimate(0.75))]
    (axes,) = learning_curve_figure(points).axes
    assert [line.get_ydata().tolist() for line in axes.get_lines()] == [[0.7, 0.8], [0.6, 0.75]]
    bars = [path.vertices[:, 1].tolist() for path in axes.collections[0].get_paths()]
    assert bars == [[0.6, 0.8], [0.7, 0.9]]
    assert [text.get_text() for text in axes.get_xticklabels()] == ["4", "8"]


def test_every_ring_has_a_bar_and_every_disturbance_a_panel() -> None:
    (axes,) = importance_figure({0: Estimate(0.02, 0.01, 0.03), 1: Estimate(-0.01, -0.02, 0.0)}).axes
    assert [bar.get_height() for bar in axes.patches] == pytest.approx([0.02, -0.01])
    right = Estimate(0.9, 0.8, 1.0)
    rows = [("lost", 0.0, right, 0.0), ("lost", 0.7, Estimate(None), 1.0), ("noise", 0.1, right, 0.0)]
    figure = robustness_figure(rows)
    assert titles(figure) == ["lost", "noise"]
    accuracy, unusable = figure.axes[0].get_lines()
    assert accuracy.get_xdata().tolist() == [0.0], "no accuracy where nothing is classified"
    assert unusable.get_ydata().tolist() == [0.0, 1.0]


def test_markers_of_a_sensor_at_rest_and_in_the_slide():
    history = filmed_history()
    figure = marker_places_figure(marker_tracks(history), "a run")
    assert titles(figure) == ["1 internal markers, from inside", "5 external markers, from below"]
    assert {"centre", "ring 1", "ring 2", "Markers at rest: a run"} <= words(figure)
    figure = slide_tracks_figure(marker_tracks(history), history)
    assert titles(figure) == ["internal markers", "external markers"]
    ends = [float(line.get_ydata()[-1]) for line in panels(figure)[1].lines[:5]]
    assert ends[-1] == pytest.approx(max(ends)), "the centre is drawn last and slips last"
    with pytest.raises(ValueError, match="has no slide"):
        slide_tracks_figure(marker_tracks(history), NO_SLIDE)


def seen():
    camera = external_camera(30e-3, 14e-3, frame_rate=100.0, exposure=1e-3)
    return true_tracks(camera, filmed_tracks(filmed_history(), "external", 0.5))


def test_onsets_are_when_markers_leave_their_place_in_the_image_and_only_of_those_that_touch():
    found, distance = onsets(seen(), 1.0)
    slip = slip_times(Process(), filmed_history()["contact_position"].values[list(NODES), 0]) - 1.0
    # A pixel is 22 um, 7 ms of the plate, and a frame 10 ms.
    assert found == pytest.approx(slip, abs=0.04)
    assert found[0] == found.max()
    assert distance[0] == 0.0
    moved, where = panels(slip_order_figure(seen(), 1.0, np.array([True, True, True, True, False])))
    assert len(moved.lines) == 4 + 1
    assert len(where.collections[0].get_offsets()) == 4
    nothing = slip_order_figure(seen(), 1.0, np.zeros(5, dtype=bool))
    assert "no marker touches" in texts(panels(nothing)[0])[0]


@pytest.mark.slow
def test_frames_stand_above_the_body():
    times = film_times(0.05, 0.1, -0.4)
    assert times == pytest.approx((-0.4, 0.05, 0.05 + 0.05 / 3, 0.1))
    frame = np.zeros((12, 16), dtype=np.uint8)
    found = titles(frames_figure(block_history("Q4"), {times[0]: frame, times[1]: frame}))
    assert found[:2] == ["frame at rest", "frame at 0.05 s"]
    assert found[2].startswith("snapshot at 0.00 s")


def test_fingertips_are_drawn_in_both_sections_and_in_3d():
    figure = fingertip_figure(change_solid(), "mine")
    sagittal, transverse, solid = figure.axes[:3]
    assert {"x [mm]", "z [mm]", "epidermis", "phalanx"} <= words(figure)
    for axes in (sagittal, transverse):
        assert max(path.vertices[:, 0].max() for path in axes.collections[0].get_paths()) == pytest.approx(
            8.0, abs=1e-3
        )
    assert solid.name == "3d"
    assert len(solid.collections) == 2
    figure = fingertip_figure(change(fingerprint={"enabled": True}))
    assert all(axes.name != "3d" for axes in figure.axes)
    ring = figure.axes[0].collections[0].get_paths()[0].vertices
    assert ring[:, 1].min() == pytest.approx(-7.05, abs=0.01)
    assert np.isfinite(ring).all()


def test_a_sensor_is_drawn_cut_open_and_with_all_its_markers():
    figure = tactip_figure(PRESETS.read("tactip-ridged-2d"), "ridged")
    section, inside, below = panels(figure)
    assert section.get_title(loc="left") == "cut open along the axis"
    assert len(section.collections[2].get_paths()) == 9, "rods in the plane of the axis"
    assert all(len(axes.collections[0].get_offsets()) == 81 for axes in (inside, below))
    assert set(SENSOR_COLOURS) <= words(figure)


def block() -> skfem.MeshQuad:
    mesh = skfem.MeshQuad.init_tensor(np.linspace(0.0, 4e-3, 9), np.linspace(1e-3, 3e-3, 5))
    return mesh.with_subdomains({"nail": lambda x: x[1] > 2e-3, "epidermis": lambda x: x[1] < 2e-3})


def test_section_fills_regions_and_moves_with_the_displacement() -> None:
    receptors = {"FA-I": np.array([[1e-3, 1.5e-3]])}
    still = section_figure(block(), receptors)
    lifted = section_figure(block(), receptors, np.full((block().p.shape[1], 2), 1e-3), plate=0.0)
    dots = [next(line for line in panels(f)[0].lines if line.get_marker() == "o") for f in (still, lifted)]
    assert [dot.get_ydata()[0] for dot in dots] == pytest.approx([1.5, 2.5])
    assert sum(len(c.get_paths()) for c in panels(still)[0].collections) == block().t.shape[1]
    assert {"x [mm]", "y [mm]", "epidermis", "nail", "FA-I", "plate"} <= words(still)
    assert {kind: places.shape for kind, places in receptor_positions(HISTORY).items()} == dict.fromkeys(KINDS, (25, 2))
    assert receptor_positions(BARE) == {}


def test_plate_stands_at_the_lowest_point_or_where_it_is_put_and_the_close_view_is_framed() -> None:
    for plate, expected in ((None, 1.0), (0.4e-3, 0.4)):
        for axes in panels(section_figure(block(), {}, plate=plate)):
            level = next(line for line in axes.lines if len(set(line.get_ydata())) == 1)
            assert level.get_ydata()[0] == pytest.approx(expected)
    whole, close = panels(section_figure(block(), {}))
    (frame,) = whole.patches
    assert close.get_xlim() == pytest.approx((frame.get_x(), frame.get_x() + frame.get_width()))
    assert close.get_ylim() == pytest.approx((frame.get_y(), frame.get_y() + frame.get_height()))
    assert frame.get_width() == pytest.approx(3.2)


def test_quadratic_triangles_are_drawn_by_their_corners_and_a_mesh_without_regions_whole() -> None:
    mesh = skfem.MeshTri2().refined(1).scaled(1e-3).with_subdomains({"gel": np.arange(8)})
    figure = section_figure(mesh, {"probe": np.array([[0.0, 0.0]])})
    (regions,) = panels(figure)[0].collections
    assert {len(path.vertices) for path in regions.get_paths()} == {4}
    assert {"gel", "probe", "plate"} <= words(figure)
    (cells,) = panels(section_figure(skfem.MeshQuad().refined(1).scaled(1e-3), {}))[0].collections
    assert len(cells.get_paths()) == 4
