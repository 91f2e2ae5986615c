"""Tissue and phalanx by Gmsh: regions, border nodes, sizes, and a Gmsh that is left as it was found."""

from __future__ import annotations

import gmsh
import numpy as np
import pytest

from fingerslip.errors import MeshError
from fingerslip.specimens.fingertip import at_depth, outline_curve, phalanx_contour, preset
from fingerslip.specimens.fingertip.meshing.section import build as core_module
from fingerslip.specimens.fingertip.meshing.section.build import mesh_core, mesh_ring
from fingerslip.specimens.fingertip.meshing.section.source import MeshSizes, build_section
from fingerslip.specimens.fingertip.outline import arc_length_at_cut
from unit.fingers import change, shoelace


def test_gmsh_is_closed_after_success_failure_and_interruption(monkeypatch):
    build_section(preset("wang2014-2d"), bulk_size=1e-3)
    assert not gmsh.isInitialized()
    for error, seen in ((RuntimeError("no"), MeshError), (KeyboardInterrupt(), KeyboardInterrupt)):

        def fail(*_, error=error):
            raise error

        monkeypatch.setattr(core_module.pygmsh.geo.Geometry, "generate_mesh", lambda *_, fail=fail, **__: fail())
        with pytest.raises(seen):
            build_section(preset("wang2014-2d"))
        assert not gmsh.isInitialized()


def test_building_prints_nothing(capfd):
    build_section(preset("wang2014-2d"), bulk_size=1e-3)
    assert capfd.readouterr() == ("", "")


def made(element="Q4", section="sagittal", variant="original", **sizes):
    """Return core, contour and border of a section whose border has even segments."""
    fingertip = change(section=section, phalanx={"variant": variant})
    curve = outline_curve(fingertip)
    first, last = arc_length_at_cut(fingertip, curve, 1.5e-3)
    s = np.linspace(first, last, 161)
    border = at_depth(curve, s, 1.5e-3)
    border = border[:-1] if curve.closed else border
    contour = phalanx_contour(fingertip)
    return mesh_core(contour, border, curve.closed, MeshSizes(element=element, **sizes)), contour, border


def cell_areas(core, name):
    x, y = np.moveaxis(core.points[core.cells[name]], 2, 0)
    return 0.5 * np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1)


@pytest.mark.parametrize("element", ["Q4", "T3"])
@pytest.mark.parametrize(
    ("section", "variant"), [("sagittal", "original"), ("sagittal", "scaled"), ("transverse", "flattened")]
)
def test_tissue_and_phalanx_fill_the_inside_without_overlap(element, section, variant):
    core, contour, border = made(element, section, variant, bulk_size=0.4e-3)
    phalanx, tissue = (cell_areas(core, name) for name in ("phalanx", "tissue"))
    assert phalanx.min() > 0.0
    assert tissue.min() > 0.0
    # The phalanx is a polygon of its nodes here, a fine curve there.
    assert phalanx.sum() == pytest.approx(shoelace(contour), rel=7e-3)
    assert phalanx.sum() + tissue.sum() == pytest.approx(shoelace(border), rel=1e-3)
    assert core.cells["tissue"].shape[1] == (4 if element == "Q4" else 3)


@pytest.mark.parametrize("element", ["Q4", "T3"])
def test_border_nodes_are_kept(element):
    """Triangles keep all of them; quadrilaterals every second one, and the midpoints between."""
    core, _, border = made(element)
    kept = border[::2] if element == "Q4" else border
    wanted = np.vstack([kept, 0.5 * (kept[1:] + kept[:-1])]) if element == "Q4" else kept
    nearest = np.linalg.norm(wanted[:, None] - core.points[None], axis=2).min(axis=1)
    assert nearest.max() < 1e-9


def test_no_point_is_left_without_a_cell_and_none_is_twice_there():
    core, _, _ = made()
    used = np.unique(np.concatenate([cells.ravel() for cells in core.cells.values()]))
    assert np.array_equal(used, np.arange(len(core.points)))
    assert len(np.unique(core.points.round(10), axis=0)) == len(core.points)


def test_the_bulk_size_is_the_largest_size():
    for bulk in (0.3e-3, 0.8e-3):
        core, _, _ = made(bulk_size=bulk)
        largest = np.sqrt(max(cell_areas(core, name).max() for name in core.cells))
        assert 0.6 * bulk < largest < 1.5 * bulk


def test_ring_is_filled_and_keeps_its_nodes():
    angle = np.linspace(0.0, 2 * np.pi, 49)[:-1]
    outer = 4e-3 * np.column_stack([np.cos(angle), np.sin(angle)])
    inner = 0.5 * outer[::2]
    core = mesh_ring(outer, inner, 1e-3)
    areas = {name: cell_areas(core, name).sum() for name in core.cells}
    assert areas["phalanx"] == pytest.approx(shoelace(inner), rel=1e-9)
    assert areas["tissue"] == pytest.approx(shoelace(outer) - shoelace(inner), rel=1e-9)
    rings = np.vstack([outer, inner])
    assert np.linalg.norm(rings[:, None] - core.points, axis=2).min(axis=1).max() < 1e-12
    whole = mesh_ring(outer, None, 1e-3)
    assert set(whole.cells) == {"tissue"}
    assert cell_areas(whole, "tissue").sum() == pytest.approx(shoelace(outer), rel=1e-9)
