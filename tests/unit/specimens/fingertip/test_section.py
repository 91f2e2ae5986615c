"""Sections as meshes: rows and columns of the skin, tissue and phalanx by Gmsh, names, and what is refused."""

import gmsh
import numpy as np
import pytest
import skfem
from scipy.spatial import cKDTree

import fingerslip as fs
from fingerslip.specimens.fingertip.meshing import section as meshing
from fingerslip.specimens.fingertip.meshing.section import DERMIS, EPIDERMIS, NAIL, PHALANX, TISSUE
from fingerslip.specimens.fingertip.outline import (
    arc_length_at_cut,
    at_depth,
    interface_depth,
    outline_curve,
    surface_depth,
)
from fingerslip.specimens.fingertip.phalanx import phalanx_contour
from unit.fingers import SECTIONS, change, shoelace


def test_sizes_resolve_the_ridges_and_both_are_refined():
    sizes = fs.MeshSizes()
    assert (sizes.dim, sizes.element, sizes.needs_specimen, sizes.assumes_metres) == (2, "Q4", True, False)
    assert sizes.contact_size <= 0.47e-3 / 3
    assert fs.MeshSizes(0.12e-3, 0.3e-3, 1e-3, "T6").refined(0.5) == fs.MeshSizes(0.06e-3, 0.15e-3, 1e-3, "T6")


@pytest.mark.parametrize(
    ("section", "element", "sizes"), [("sagittal", "Q4", (0.12e-3, 0.28e-3)), ("transverse", "T3", (0.15e-3, 0.6e-3))]
)
def test_number_of_cells_is_foreseen(section, element, sizes):
    fingertip, source = change(section=section), fs.MeshSizes(*sizes, element=element)
    inspected = source.inspect(fingertip)
    count, rows = inspected.mesh.t.shape[1], inspected.tables[0].rows
    assert 0.6 * count < source.estimated_cells(fingertip) < 1.5 * count
    assert [row[0] for row in rows] == ["epidermis", "dermis", "tissue", "phalanx"]
    assert sum(row[1] for row in rows) == count


def swept(fingertip, **sizes):
    return meshing.sweep_skin(fingertip, fs.MeshSizes(**sizes), phalanx_contour(fingertip))


def depths(curve, points):
    """Return the depths below the outline, negative outside the finger."""
    _, nearest = cKDTree(curve.points).query(points)
    inward = np.column_stack([-curve.tangents[nearest, 1], curve.tangents[nearest, 0]])
    return np.sum((points - curve.points[nearest]) * inward, axis=1)


@pytest.mark.parametrize("section", SECTIONS)
def test_rows_are_the_surfaces_of_the_layers(section):
    fingertip = change(section=section, fingerprint={"enabled": True})
    grid, curve = swept(fingertip), outline_curve(fingertip)
    assert grid.closed == (section == "transverse")
    expected = {0: surface_depth, grid.epidermis_rows: interface_depth, len(grid.points) - 1: lambda *_: 1.5e-3}
    for row, depth in expected.items():
        # The last nodes of an open section are shifted onto the cut.
        assert depths(curve, grid.points[row])[2:-2] == pytest.approx(depth(fingertip, grid.arc_length[2:-2]), abs=5e-7)


@pytest.mark.parametrize(("size", "rows"), [(0.12e-3, (4, 7)), (0.15e-3, (3, 5)), (0.5e-3, (1, 2)), (2e-3, (1, 1))])
def test_rows_are_evenly_spaced_and_their_number_follows_the_contact_size(size, rows):
    """Epidermis: thickness over size; dermis: thickness over one and a quarter of the size; never none."""
    fingertip = change(ridges={"enabled": False})
    grid = swept(fingertip, contact_size=size, bulk_size=3e-3)
    middle, curve = np.abs(grid.arc_length) < 3e-3, outline_curve(fingertip)
    thickness = np.diff([depths(curve, row[middle]).mean() for row in grid.points])
    epidermis, dermis = thickness[: grid.epidermis_rows], thickness[grid.epidermis_rows :]
    assert (len(epidermis), len(dermis)) == rows
    assert epidermis == pytest.approx(0.5e-3 / len(epidermis), rel=1e-3)
    assert dermis == pytest.approx(1e-3 / len(dermis), rel=1e-3)


@pytest.mark.parametrize("size", [0.08e-3, 0.12e-3, 0.15e-3])
def test_every_ridge_tip_has_a_column_and_columns_in_the_contact_are_even(size):
    grid = swept(fs.preset("wang2014-2d"), contact_size=size)
    within = (grid.arc_length >= grid.contact[0]) & (grid.arc_length <= grid.contact[1])
    spacing = np.diff(grid.arc_length[within])
    assert spacing == pytest.approx(spacing[0])
    assert spacing[0] == pytest.approx(size, rel=0.35)
    tips = np.arange(-14, 15) * 0.235e-3
    assert np.abs(tips[:, None] - grid.arc_length).min(axis=1).max() < 1e-12


def test_the_contact_reaches_as_high_as_asked_for_and_rows_end_on_the_cut():
    curve = outline_curve(fs.preset("wang2014-2d"))
    for reach in (1e-3, 2e-3):
        grid = swept(fs.preset("wang2014-2d"), contact_reach=reach)
        heights = np.interp(grid.contact, curve.arc_length, curve.points[:, 1])
        assert heights == pytest.approx(-7e-3 + reach, abs=2e-5)
        assert np.all(grid.points[:, [0, -1], 0] == -16e-3)
        assert np.all(np.diff(grid.points[:, 0, 1]) > 0.0), "inward is up at the palmar end"
        assert np.all(np.diff(grid.points[:, -1, 1]) < 0.0), "and down at the dorsal one"


@pytest.mark.parametrize("section", SECTIONS)
def test_columns_widen_outside_the_contact_but_keep_their_shape(section):
    grid = swept(change(section=section), bulk_size=2e-3)
    width = np.diff(grid.arc_length)
    height = np.linalg.norm(np.diff(grid.points, axis=0), axis=2).min(axis=0)
    beside = np.minimum(height[1:], height[:-1])[: len(width)]
    assert width.max() > 1.5 * width[np.abs(grid.arc_length[:-1]) < 2e-3].max()
    assert np.all(width <= 10.0 * beside)
    assert np.all(np.diff(grid.arc_length) > 0.0)


def test_gmsh_is_closed_after_success_failure_and_interruption(monkeypatch):
    for error, seen in ((RuntimeError("no"), fs.MeshError), (KeyboardInterrupt(), KeyboardInterrupt)):

        def fail(*_, error=error):
            raise error

        monkeypatch.setattr(meshing.pygmsh.geo.Geometry, "generate_mesh", lambda *_, fail=fail, **__: fail())
        with pytest.raises(seen):
            fs.build_section(fs.preset("wang2014-2d"))
        assert not gmsh.isInitialized()


def cell_areas(core, name):
    x, y = np.moveaxis(core.points[core.cells[name]], 2, 0)
    return 0.5 * np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1)


@pytest.mark.parametrize(
    ("element", "section", "variant", "bulk"),
    [
        ("Q4", "sagittal", "original", 0.3e-3),
        ("T3", "sagittal", "scaled", 0.4e-3),
        ("Q4", "transverse", "flattened", 0.4e-3),
    ],
)
def test_tissue_and_phalanx_fill_the_inside_without_overlap(element, section, variant, bulk):
    """A border of even segments keeps its nodes: triangles all, quadrilaterals every second one and the midpoints."""
    fingertip = change(section=section, phalanx={"variant": variant})
    curve = outline_curve(fingertip)
    s = np.linspace(*arc_length_at_cut(fingertip, curve, 1.5e-3), 161)
    border, contour = at_depth(curve, s[: 160 if curve.closed else 161], 1.5e-3), phalanx_contour(fingertip)
    core = meshing.mesh_core(contour, border, curve.closed, fs.MeshSizes(element=element, bulk_size=bulk))
    phalanx, tissue = (cell_areas(core, name) for name in ("phalanx", "tissue"))
    assert phalanx.min() > 0.0
    assert tissue.min() > 0.0
    # The phalanx is a polygon of its nodes here, a fine curve there.
    assert phalanx.sum() == pytest.approx(shoelace(contour), rel=7e-3)
    assert phalanx.sum() + tissue.sum() == pytest.approx(shoelace(border), rel=1e-3)
    assert core.cells["tissue"].shape[1] == (4 if element == "Q4" else 3)
    assert 0.6 * bulk < np.sqrt(max(phalanx.max(), tissue.max())) < 1.5 * bulk
    wanted = border[::2] if element == "Q4" else border
    wanted = np.vstack([wanted, 0.5 * (wanted[1:] + wanted[:-1])]) if element == "Q4" else wanted
    assert np.linalg.norm(wanted[:, None] - core.points[None], axis=2).min(axis=1).max() < 1e-9
    used = np.unique(np.concatenate([cells.ravel() for cells in core.cells.values()]))
    assert np.array_equal(used, np.arange(len(core.points)))
    assert len(np.unique(core.points.round(10), axis=0)) == len(core.points)


def test_ring_is_filled_and_keeps_its_nodes():
    angle = np.linspace(0.0, 2 * np.pi, 49)[:-1]
    outer = 4e-3 * np.column_stack([np.cos(angle), np.sin(angle)])
    inner = 0.5 * outer[::2]
    core = meshing.mesh_ring(outer, inner, 1e-3)
    areas = {name: cell_areas(core, name).sum() for name in core.cells}
    assert areas["phalanx"] == pytest.approx(shoelace(inner), rel=1e-9)
    assert areas["tissue"] == pytest.approx(shoelace(outer) - shoelace(inner), rel=1e-9)
    rings = np.vstack([outer, inner])
    assert np.linalg.norm(rings[:, None] - core.points, axis=2).min(axis=1).max() < 1e-12
    whole = meshing.mesh_ring(outer, None, 1e-3)
    assert set(whole.cells) == {"tissue"}
    assert cell_areas(whole, "tissue").sum() == pytest.approx(shoelace(outer), rel=1e-9)


PLAIN = change(ridges={"enabled": False})

COARSE = {"contact_size": 0.5e-3, "bulk_size": 1e-3}


@pytest.mark.parametrize("element", ["Q4", "T3", "T6"])
def test_coarse_section_has_all_names_and_the_same_mesh_again(element, capfd):
    mesh = fs.build_section(PLAIN, **COARSE, element=element)
    again = meshing.mesh_section(PLAIN, fs.MeshSizes(**COARSE, element=element))
    assert capfd.readouterr() == ("", "")
    assert list(mesh.subdomains) == ["epidermis", "dermis", "tissue", "phalanx"]
    assert {"skin", "pad", "base", "phalanx_base", "dermis_tissue", "phalanx_dorsal"} < set(mesh.boundaries)
    outside = np.concatenate([mesh.boundaries["skin"], mesh.boundaries["base"]])
    assert np.array_equal(np.sort(outside), np.sort(mesh.boundary_facets()))
    assert mesh.doflocs.tobytes() == again.doflocs.tobytes()


def test_poor_cells_are_refused_with_their_place(monkeypatch):
    good = meshing.mesh_core

    def spoilt(*arguments):
        core = good(*arguments)
        corners = core.points[core.cells["phalanx"][30]]
        core.points[core.cells["phalanx"][30][0]] = corners[2]
        return core

    monkeypatch.setattr(meshing, "mesh_core", spoilt)
    place = r"phalanx cell \d+ at x = .* mm, y = .* mm: .*, needs > .*; write a smaller bulk"
    with pytest.raises(fs.MeshError, match=place):
        fs.build_section(PLAIN, **COARSE)


def strip(dim):
    """Return four layers of one cell each, their regions, and which nodes of the lowest row are fine."""
    grid = [np.linspace(0.0, 1.0, 4)] * (dim - 1)
    kind = skfem.MeshQuad1 if dim == 2 else skfem.MeshTet1
    mesh = kind.init_tensor(*grid, np.linspace(0.0, 4.0, 5))
    # In 3D the layers lie above each other along y, as in a finger.
    points = mesh.p if dim == 2 else mesh.p[[0, 2, 1]]
    order = np.argsort(points[1] > 0.0, kind="stable")
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    mesh = kind(np.ascontiguousarray(points[:, order]), np.ascontiguousarray(number[mesh.t]))
    height = mesh.p[1, mesh.t].mean(axis=0)
    region = np.select([height < 1, height < 2, height < 3], [EPIDERMIS, DERMIS, TISSUE], PHALANX)
    lowest = mesh.p[:, : np.count_nonzero(mesh.p[1] == 0.0)]
    return mesh, region, lowest[0] < 0.4


@pytest.mark.parametrize("dim", [2, 3])
def test_names_of_a_strip(dim):
    """Regions and interfaces, the skin first and the rest of the outside the cut, faces of the phalanx."""
    mesh, region, fine = strip(dim)
    named = meshing.with_names(mesh, region, fine)
    at = {name: named.p[:, named.facets[:, facets]] for name, facets in named.boundaries.items()}
    assert list(named.subdomains) == ["epidermis", "dermis", "tissue", "phalanx"]
    for name, height in (("skin", 0.0), ("epidermis_dermis", 1.0), ("dermis_tissue", 2.0), ("phalanx_surface", 3.0)):
        assert np.all(at[name][1] == height)
    outside = np.concatenate([named.boundaries["skin"], named.boundaries["base"]])
    np.testing.assert_array_equal(np.sort(outside), np.sort(mesh.boundary_facets()))
    assert set(named.boundaries["pad"]) < set(named.boundaries["skin"])
    assert np.all(at["pad"][0] < 0.4)
    assert np.all(at["phalanx_base"][1] >= 3.0)
    np.testing.assert_array_equal(named.boundaries["phalanx_palmar"], named.boundaries["phalanx_surface"])
    assert "phalanx_dorsal" not in named.boundaries
    upside_down = meshing.with_names(mesh, np.array([PHALANX, TISSUE, DERMIS, EPIDERMIS])[region], fine)
    np.testing.assert_array_equal(upside_down.boundaries["phalanx_dorsal"], upside_down.boundaries["phalanx_surface"])
    nailed = meshing.with_names(mesh, np.where(region == EPIDERMIS, NAIL, region), fine)
    assert set(nailed.subdomains) == {"dermis", "tissue", "phalanx", "nail"}, "a nail has its part of the skin"
    np.testing.assert_array_equal(nailed.boundaries["nail"], nailed.boundaries["skin"])
