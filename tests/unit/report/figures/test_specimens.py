"""Figures of specimens at rest."""

from __future__ import annotations

import numpy as np
import pytest
import skfem

from fingerslip.report.figures.specimens import (
    SENSOR_COLOURS,
    fingertip_figure,
    receptor_positions,
    section_figure,
    tactip_figure,
)
from fingerslip.specimens.tactip import PRESETS
from unit.fingers import change, change_solid
from unit.report.figures.made import BARE, HISTORY, panels, words
from unit.synthetic import KINDS


def test_sections_and_the_finger_in_space_are_drawn():
    figure = fingertip_figure(change_solid(), "mine")
    sagittal, transverse, solid = figure.axes[:3]
    assert {"x [mm]", "z [mm]", "epidermis", "phalanx"} <= words(figure)
    tip = max(path.vertices[:, 0].max() for path in sagittal.collections[0].get_paths())
    side = max(path.vertices[:, 0].max() for path in transverse.collections[0].get_paths())
    assert (tip, side) == (pytest.approx(8.0, abs=1e-3), pytest.approx(8.0, abs=1e-3))
    assert solid.name == "3d"
    assert len(solid.collections) == 2


def test_section_alone_has_no_third_panel():
    figure = fingertip_figure(change(fingerprint={"enabled": True}))
    assert all(axes.name != "3d" for axes in figure.axes)
    ring = figure.axes[0].collections[0].get_paths()[0].vertices
    assert ring[:, 1].min() == pytest.approx(-7.05, abs=0.01)
    assert np.isfinite(ring).all()


def test_section_fills_regions_and_moves_with_the_displacement() -> None:
    mesh = skfem.MeshQuad.init_tensor(np.linspace(0.0, 4e-3, 9), np.linspace(0.0, 2e-3, 5))
    mesh = mesh.with_subdomains({"tissue": lambda x: x[1] > 1e-3, "epidermis": lambda x: x[1] < 1e-3})
    receptors = {"FA-I": np.array([[1e-3, 0.5e-3]])}
    still = section_figure(mesh, receptors)
    lifted = section_figure(mesh, receptors, np.full((mesh.p.shape[1], 2), 1e-3), plate=0.0)
    dots = [next(line for line in panels(f)[0].lines if line.get_marker() == "o") for f in (still, lifted)]
    assert [dot.get_ydata()[0] for dot in dots] == pytest.approx([0.5, 1.5])
    assert sum(len(c.get_paths()) for c in panels(still)[0].collections) == mesh.t.shape[1]
    assert {"x [mm]", "y [mm]", "epidermis", "tissue", "FA-I", "plate"} <= words(still)


def test_receptor_positions_are_sorted_by_type() -> None:
    assert {kind: places.shape for kind, places in receptor_positions(HISTORY).items()} == dict.fromkeys(KINDS, (25, 2))
    assert receptor_positions(BARE) == {}


def block() -> skfem.MeshQuad:
    mesh = skfem.MeshQuad.init_tensor(np.linspace(0.0, 4e-3, 9), np.linspace(1e-3, 3e-3, 5))
    return mesh.with_subdomains({"nail": lambda x: x[1] > 2e-3, "epidermis": lambda x: x[1] < 2e-3})


def test_plate_stands_at_the_lowest_point_or_where_it_is_put() -> None:
    for given, expected in ((None, 1.0), (0.4e-3, 0.4)):
        for axes in panels(section_figure(block(), {}, plate=given)):
            level = next(line for line in axes.lines if len(set(line.get_ydata())) == 1)
            assert level.get_ydata()[0] == pytest.approx(expected)


def test_close_view_is_framed_in_the_whole() -> None:
    whole, close = panels(section_figure(block(), {}))
    (frame,) = whole.patches
    assert close.get_xlim() == pytest.approx((frame.get_x(), frame.get_x() + frame.get_width()))
    assert close.get_ylim() == pytest.approx((frame.get_y(), frame.get_y() + frame.get_height()))
    assert frame.get_width() == pytest.approx(3.2)


def test_quadratic_triangles_are_drawn_by_their_corners_and_regions_of_ones_own_have_a_key() -> None:
    mesh = skfem.MeshTri2().refined(1).scaled(1e-3).with_subdomains({"gel": np.arange(8)})
    figure = section_figure(mesh, {"probe": np.array([[0.0, 0.0]])})
    (regions,) = panels(figure)[0].collections
    assert {len(path.vertices) for path in regions.get_paths()} == {4}
    assert {"gel", "probe", "plate"} <= words(figure)


def test_a_mesh_without_regions_is_drawn_whole() -> None:
    mesh = skfem.MeshQuad().refined(1).scaled(1e-3)
    (cells,) = panels(section_figure(mesh, {}))[0].collections
    assert len(cells.get_paths()) == 4


def test_a_sensor_is_drawn_cut_open_and_with_all_its_markers():
    figure = tactip_figure(PRESETS.read("tactip-ridged-2d"), "ridged")
    section, inside, below = panels(figure)
    assert section.get_title(loc="left") == "cut open along the axis"
    assert len(section.collections[2].get_paths()) == 9, "rods in the plane of the axis"
    for axes in (inside, below):
        assert len(axes.collections[0].get_offsets()) == 81
    assert set(SENSOR_COLOURS) <= words(figure)
