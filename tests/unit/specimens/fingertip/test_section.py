"""Sections as meshes: rows and columns of the skin, tissue and phalanx by Gmsh, names, and what is refused."""

import gmsh
import numpy as np
import pytest
from scipy.spatial import cKDTree

import fingerslip as fs
from fingerslip.specimens.fingertip.meshing import section as meshing
from fingerslip.specimens.fingertip.meshing.section import EPIDERMIS, NAIL
from fingerslip.specimens.fingertip.outline import interface_depth, outline_curve, surface_depth
from fingerslip.specimens.fingertip.phalanx import phalanx_contour
from unit.fingers import SECTIONS, change


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


def test_the_contact_reaches_as_high_as_asked_for_and_rows_end_on_the_cut():
    curve = outline_curve(fs.preset("wang2014-2d"))
    for reach in (1e-3, 2e-3):
        grid = swept(fs.preset("wang2014-2d"), contact_reach=reach)
        heights = np.interp(grid.contact, curve.arc_length, curve.points[:, 1])
        assert heights == pytest.approx(-7e-3 + reach, abs=2e-5)
        assert np.all(grid.points[:, [0, -1], 0] == -16e-3)
        assert np.all(np.diff(grid.points[:, 0, 1]) > 0.0), "inward is up at the palmar end"
        assert np.all(np.diff(grid.points[:, -1, 1]) < 0.0), "and down at the dorsal one"


def test_gmsh_is_closed_after_success_failure_and_interruption(monkeypatch):
    for error, seen in ((RuntimeError("no"), fs.MeshError), (KeyboardInterrupt(), KeyboardInterrupt)):

        def fail(*_, error=error):
            raise error

        monkeypatch.setattr(meshing.pygmsh.geo.Geometry, "generate_mesh", lambda *_, fail=fail, **__: fail())
        with pytest.raises(seen):
            fs.build_section(fs.preset("wang2014-2d"))
        assert not gmsh.isInitialized()


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
    palmar, dorsal = (mesh.p[1, mesh.facets[:, mesh.boundaries[f"phalanx_{face}"]]] for face in ("palmar", "dorsal"))
    assert palmar.max() < dorsal.min()
    region = np.zeros(mesh.nelements, dtype=int)
    for number, cells in enumerate(mesh.subdomains.values()):
        region[cells] = number
    surface = np.ones(np.unique(mesh.facets[:, mesh.boundaries["skin"]]).size, dtype=bool)
    nailed = meshing.with_names(mesh, np.where(region == EPIDERMIS, NAIL, region), surface)
    assert set(nailed.subdomains) == {"dermis", "tissue", "phalanx", "nail"}, "a nail has its part of the skin"
    for name in ("nail", "pad"):
        np.testing.assert_array_equal(nailed.boundaries[name], nailed.boundaries["skin"])


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
