"""Counterfaces from files: units, joined points, holes; wrong files and wrong units are one clear error."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest

from fingerslip.errors import InputError, MeshError
from fingerslip.mesh.scan.surfaces import (
    Surface,
    boundary_loops,
    check_enclosure,
    contains,
    outermost,
    read_surface,
    write_surface,
)
from unit.ellipsoids import ellipsoid, together, with_hole

VOLUME = 4 / 3 * np.pi * 12e-3 * 8e-3 * 7e-3


@pytest.mark.parametrize("suffix", ["stl", "ply", "obj", "vtu"])
@pytest.mark.parametrize("unit", ["mm", "m", "um"])
def test_file_comes_back_in_metres(tmp_path: Path, suffix: str, unit):
    surface = ellipsoid()
    write_surface(surface, tmp_path / f"skin.{suffix}", unit)
    back = read_surface(tmp_path / f"skin.{suffix}", unit)
    assert back.volume == pytest.approx(surface.volume, rel=1e-5)
    assert back.volume == pytest.approx(VOLUME, rel=0.02)
    assert Surface(back.points, back.triangles[:, ::-1]).volume == pytest.approx(-back.volume)
    assert len(back.points) == len(surface.points)
    assert boundary_loops(back) == ()


def test_quadrilaterals_are_cut_in_two(tmp_path: Path):
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float) * 10
    meshio.write(tmp_path / "plane.vtu", meshio.Mesh(points, [("quad", [[0, 1, 2, 3]])]))
    assert read_surface(tmp_path / "plane.vtu").area == pytest.approx(1e-4)


@pytest.mark.parametrize(("written", "read", "repair"), [("mm", "m", "'mm'"), ("m", "mm", "'m'"), ("um", "mm", "'um'")])
def test_wrong_unit_names_the_right_one(tmp_path: Path, written, read, repair: str):
    write_surface(ellipsoid(), tmp_path / "skin.stl", written)
    with pytest.raises(MeshError, match=f"skin.stl: is .* m long when its unit is '{read}', .*is its unit {repair}"):
        read_surface(tmp_path / "skin.stl", read)


def test_unknown_unit(tmp_path: Path):
    with pytest.raises(InputError, match="unit: got 'inch', needs one of m, cm, mm, um"):
        read_surface(tmp_path / "skin.stl", "inch")  # type: ignore[arg-type]


def test_missing_file(tmp_path: Path):
    with pytest.raises(MeshError, match="no such file"):
        read_surface(tmp_path / "skin.stl")


@pytest.mark.parametrize("name", ["skin.stl", "skin.ply", "skin.xyz"])
def test_damaged_file(tmp_path: Path, name: str):
    (tmp_path / name).write_bytes(b"\x00\x01 no surface")
    with pytest.raises(MeshError, match="cannot be read"):
        read_surface(tmp_path / name)


def test_file_of_lines(tmp_path: Path):
    meshio.write(tmp_path / "line.vtu", meshio.Mesh(np.eye(3), [("line", [[0, 1]])]))
    with pytest.raises(MeshError, match="has line, needs triangles"):
        read_surface(tmp_path / "line.vtu")


def test_coordinates_that_are_no_numbers(tmp_path: Path):
    points = np.eye(3) * 10
    points[0, 0] = np.nan
    meshio.write(tmp_path / "skin.vtu", meshio.Mesh(points, [("triangle", [[0, 1, 2]])]))
    with pytest.raises(MeshError, match="no numbers"):
        read_surface(tmp_path / "skin.vtu")


def test_write_to_missing_folder_or_unknown_suffix(tmp_path: Path):
    with pytest.raises(MeshError, match="folder"):
        write_surface(ellipsoid(), tmp_path / "none" / "skin.stl")
    with pytest.raises(MeshError, match="cannot be written"):
        write_surface(ellipsoid(), tmp_path / "skin.nothing")


def test_loop_goes_around_the_hole():
    holed = with_hole(ellipsoid(), (0.0, 0.0, 7e-3), 3e-3)
    (loop,) = boundary_loops(holed)
    assert np.linalg.norm(holed.points[loop].mean(axis=0)[:2]) < 0.5e-3
    lid = np.column_stack([loop, np.roll(loop, -1), np.full(len(loop), len(holed.points))])
    middle = holed.points[loop].mean(axis=0)
    closed = Surface(np.vstack([holed.points, middle]), np.vstack([holed.triangles, lid]))
    check_enclosure(closed)


def test_two_holes_that_meet_in_a_point_are_two_loops():
    node = np.arange(36).reshape(6, 6)
    a, b, c, d = node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]
    squares = np.stack([a, b, c, a, c, d], axis=-1)
    kept = np.ones((5, 5), dtype=bool)
    kept[[1, 2], [1, 2]] = False
    y, x = np.divmod(np.arange(36.0), 6)
    sheet = Surface(np.column_stack([x, y, 0 * x]), squares[kept].reshape(-1, 3))
    assert sorted(len(loop) for loop in boundary_loops(sheet)) == [4, 4, 20]


def test_open_surface_is_refused_with_its_largest_hole():
    with pytest.raises(MeshError, match=r"holed: is open: 1 hole, the largest .* mm wide at .*repair it"):
        check_enclosure(with_hole(ellipsoid(), (0.0, 0.0, 7e-3), 3e-3))


def test_inside_out_surface_is_refused():
    surface = ellipsoid()
    with pytest.raises(MeshError, match=r"inside out.*repair_surface"):
        check_enclosure(Surface(surface.points, surface.triangles[:, ::-1]))


def test_contains():
    surface = ellipsoid()
    assert contains(surface, np.array([[11e-3, 0, 0], [0, 7.5e-3, 0], [0, 0, 7.5e-3]])).tolist() == [True, True, False]


def test_outermost_drops_what_lies_inside():
    outer, inner = ellipsoid(), ellipsoid((3e-3, 3e-3, 3e-3))
    assert outermost(together(outer, inner)).area == pytest.approx(outer.area)
    half_out = ellipsoid((3e-3, 3e-3, 3e-3), (0.0, 8e-3, 0.0))
    kept = outermost(together(outer, half_out)).area
    assert outer.area < kept < outer.area + half_out.area


@pytest.mark.parametrize("shape", ["point", "line"])
def test_triangles_without_area_are_refused(tmp_path: Path, shape: str):
    points = np.outer(np.arange(6.0), [5.0, 0.0, 0.0] if shape == "line" else [1e-9, 0.0, 0.0])
    points[-1, 0] += 5.0
    triangles = [[0, 1, 2], [1, 2, 5]] if shape == "line" else [[0, 1, 2], [2, 3, 5]]
    meshio.write(tmp_path / "skin.vtu", meshio.Mesh(points, [("triangle", triangles)]))
    with pytest.raises(MeshError, match="has no triangle with an area, needs the surface of a body"):
        read_surface(tmp_path / "skin.vtu")
