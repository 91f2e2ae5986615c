"""Scans as a source of meshes: files, placement, layers, quality, and what is refused; nothing is meshed here."""

import dataclasses
import subprocess
import sys

import meshio
import numpy as np
import pytest
import skfem
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import fingerslip as fs
from fingerslip.mesh.scan import build
from fingerslip.mesh.scan.build import deviation, layer_quality, skin_range
from fingerslip.mesh.scan.layered import _bodies, _wanted_sizes
from unit.ellipsoids import ellipsoid, with_hole
from unit.scans import MESHES, SCAN, mesh_of_a_scan


def test_files_are_what_the_script_makes(tmp_path):
    subprocess.run([sys.executable, MESHES / "make_synthetic_scan.py", tmp_path], check=True)
    for name in ("scan_skin.stl", "scan_phalanx.stl"):
        made, shipped = (fs.read_surface(folder / name) for folder in (tmp_path, MESHES))
        assert made.triangles.shape == shipped.triangles.shape
        assert made.area == pytest.approx(shipped.area, rel=1e-6)
        assert (MESHES / name).stat().st_size < 200_000


def test_number_of_tetrahedra_is_foreseen_from_the_volume():
    """As many of the bulk's size as fill the convex hull up to the cut: between the finger and the box around it."""
    skin = fs.read_surface(SCAN.skin)
    box = np.ptp(skin.points, axis=0).prod()
    of_one_cell = SCAN.layers.bulk_size**3 / (6.0 * np.sqrt(2.0))
    whole = dataclasses.replace(SCAN, layers=dataclasses.replace(SCAN.layers, cut=None))
    assert 0.3 * box < whole.estimated_cells() * of_one_cell < box
    assert SCAN.estimated_cells() < whole.estimated_cells()
    assert (SCAN.dim, SCAN.element, SCAN.needs_specimen, SCAN.assumes_metres) == (3, "T4", False, False)
    assert SCAN.refined(0.5) is None


def test_paths_are_relative_to_a_folder_and_the_key_follows_content_and_settings_alone(tmp_path):
    def scan(folder, skin="skin"):
        (tmp_path / folder).mkdir(exist_ok=True)
        (tmp_path / folder / "skin.stl").write_text(skin)
        return fs.SurfaceMesh("skin.stl", (1, 0, 0), (0, -1, 0)).beside(tmp_path / folder)

    first = scan("a").key()
    assert scan("a").key() == scan("b").key() == first
    assert dataclasses.replace(scan("a"), plate_angle=0.1).key() != first
    assert scan("b", "another skin").key() != first
    both = fs.SurfaceMesh("skin.stl", (1, 0, 0), (0, -1, 0), "phalanx.stl").beside(tmp_path)
    assert (both.skin, both.phalanx) == (str(tmp_path.resolve() / "skin.stl"), str(tmp_path.resolve() / "phalanx.stl"))
    assert scan("a").phalanx is None


def test_mesh_and_its_tables_in_millimetres_come_from_one_scan(monkeypatch):
    scan = mesh_of_a_scan()
    monkeypatch.setattr(build, "mesh_scan", lambda settings: scan if settings is SCAN else None)
    assert SCAN.build() is scan.mesh
    inspected = SCAN.inspect()
    assert (inspected.mesh, inspected.suffix) == (scan.mesh, ".vtu")
    quality, distances, repairs = inspected.tables
    assert [table.title for table in inspected.tables] == ["", "Distance of the mesh from the scan", "Repairs"]
    (row,) = quality.rows
    assert row[:3] == ("tissue", 5, pytest.approx(1000.0))
    assert "8 nodes, 5 cells; boundaries: skin" in quality.note
    assert distances.rows == (("skin", pytest.approx(0.02), pytest.approx(0.07)),)
    assert "0.9 to 1.1 mm, mean 1 mm" in distances.note
    assert repairs.rows == (("skin.stl", 1, 94, 1, 1, pytest.approx(15.6)),)
    for table in inspected.tables:
        assert {len(row) for row in table.rows} == {len(table.columns)}


def test_quality_of_a_known_tetrahedron_and_deviation_of_a_ball_from_a_smaller_sphere():
    regular = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    (row,) = layer_quality(skfem.MeshTet1(regular.T, np.arange(4)[:, None]))
    assert row.least_radius_ratio == pytest.approx(1.0)
    assert row.volume == pytest.approx(8 / 3)
    assert row.shortest_edge == pytest.approx(np.sqrt(8))
    corner = np.vstack([np.zeros(3), np.eye(3)])
    (row,) = layer_quality(skfem.MeshTet1(corner.T, np.arange(4)[:, None]))
    assert row.mean_radius_ratio == pytest.approx(3 * (3 - np.sqrt(3)) / 6 / (np.sqrt(3) / 2))
    sphere = ellipsoid((5e-3, 5e-3, 5e-3), points=400)
    points = np.vstack([sphere.points * 1.1, np.zeros((1, 3))])
    cells = np.column_stack([sphere.triangles, np.full(len(sphere.triangles), 400)])
    ball = skfem.MeshTet1(points.T.copy(), cells.T.copy())
    ball = ball.with_boundaries({"skin": ball.boundary_facets()})
    found = deviation(ball, "skin", sphere)
    assert found.mean == pytest.approx(0.5e-3, rel=0.02)
    assert found.largest == pytest.approx(0.5e-3, rel=0.05)
    assert skin_range(ball, sphere) == (0.0, 0.0, 0.0), "without an inside"


SKIN = ellipsoid(points=400, name="skin.stl")
PHALANX = ellipsoid((7e-3, 3e-3, 3e-3), points=200, name="phalanx.stl")
SIZES = fs.LayerSizes(
    skin_thickness=1.2e-3, contact_size=2e-3, bulk_size=4e-3, contact_reach=3e-3, tolerance=0.2e-3, cut=14e-3
)


def test_wanted_sizes_grow_from_the_pad():
    bodies = _bodies(SKIN, None, dataclasses.replace(SIZES, skin_thickness=2.4e-3))
    # On the pad, two millimetres and a centimetre above it; the grid of the sizes has a spacing of one.
    places = np.array([[1e-3, -7.9e-3, 0.0], [1e-3, -5.9e-3, 0.0], [1e-3, 2.1e-3, 0.0]])
    on, above, far = _wanted_sizes(places, 1e-3, bodies, SIZES)
    assert on == SIZES.contact_size
    assert SIZES.contact_size < above < SIZES.contact_size + 0.4 * 1.1e-3
    assert far == SIZES.bulk_size


FINGER = ellipsoid()
TIP, PAD = np.array([0.9, 0.3, -0.2]), np.array([0.1, -1.0, 0.2])


@given(st.integers(0, 2**32 - 1))
def test_any_pose_comes_back(seed):
    rotation = Rotation.random(random_state=seed).as_matrix()
    scanned = fs.place_surface(FINGER, fs.Placement(rotation, np.array([0.3, -0.1, 0.5])))
    placement = fs.placement_from_directions(scanned, rotation @ TIP, rotation @ PAD)
    assert placement.rotation @ placement.rotation.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(placement.rotation) == pytest.approx(1.0)
    placed = fs.place_surface(scanned, placement)
    assert placed.volume == pytest.approx(FINGER.volume)
    assert placed.points[:, 0].max() == pytest.approx(0.0, abs=1e-12)
    assert placed.points[:, 1].min() == pytest.approx(0.0, abs=1e-12)
    assert np.ptp(placed.points[:, 0]) == pytest.approx(24e-3, rel=0.01)
    assert placement.rotation @ (rotation @ [1.0, 0.0, 0.0]) == pytest.approx([1.0, 0.0, 0.0], abs=0.02)


def test_landmarks_give_the_axes_and_a_plate_angle_lowers_the_tip():
    for angle in (0.0, 20.0, -10.0):
        placement = fs.placement_from_directions(FINGER, (1, 0, 0), (0, -1, 0), np.radians(angle))
        tip = placement.rotation @ [1.0, 0.0, 0.0]
        assert np.degrees(np.arcsin(-tip[1])) == pytest.approx(angle, abs=1.0)
    level = fs.placement_from_landmarks(FINGER, (12e-3, 1e-3, 0), (-12e-3, 1e-3, 0), (0, -8e-3, 0))
    assert level.rotation == pytest.approx(np.eye(3), abs=1e-12)
    assert level.shift == pytest.approx([-12e-3, 8e-3, 0.0], abs=0.2e-3)
    for tip, message in (
        ((1, 0), "tip: got"),
        ((np.nan, 0, 1), "tip: got"),
        ((0, -2, 0), "pad: is parallel to the "),
    ):
        with pytest.raises(fs.InputError, match=message):
            fs.placement_from_landmarks(FINGER, tip, (0, 0, 0) if len(tip) == 3 else (0, 0), (0, -1, 0))


def moved(shift):
    return dataclasses.replace(PHALANX, points=PHALANX.points + np.array([shift, 0.0, 0.0]))


INSIDE_OUT = fs.Surface(SKIN.points, SKIN.triangles[:, ::-1])
UNFIT = ({"bulk_size": 1e-3}, {"tolerance": 0.5e-3}, {"cut": -1.0})
BEHIND = ellipsoid((2e-3, 2e-3, 2e-3), (-6e-3, 0, 0), name="phalanx.stl")


@pytest.mark.parametrize(
    ("skin", "phalanx", "changes", "message"),
    [
        (SKIN, moved(7e-3), {}, r"phalanx.stl: pokes 2.* mm through the skin at x = 14 mm, .*inside skin.stl"),
        (SKIN, moved(0.1), {}, r"phalanx.stl: pokes .* with all points.*same unit and axes"),
        (SKIN, BEHIND, {}, "wholly proximal of the cut"),
        (with_hole(SKIN, (6e-3, 7e-3, 0.0), 3e-3), PHALANX, {}, "is open: 1 hole"),
        (INSIDE_OUT, PHALANX, {}, "inside out"),
        (SKIN, PHALANX, {"cut": 30e-3}, r"cut: got 30 mm from the tip, needs < 23.9"),
        (SKIN, PHALANX, {"skin_thickness": 7.5e-3}, "smaller skin_thickness"),
        *((SKIN, PHALANX, change, next(iter(change))) for change in UNFIT),
    ],
)
def test_bodies_and_sizes_that_are_no_finger(skin, phalanx, changes, message):
    with pytest.raises((fs.InputError, fs.MeshError), match=message):
        fs.build_from_surfaces(skin, phalanx, dataclasses.replace(SIZES, **changes))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"unit": "m"}, r"scan_skin.stl: is 2\d.* m long when its unit is 'm'.*is its unit 'mm'"),
        ({"layers": fs.LayerSizes()}, r"scan_skin.stl: is open: 1 hole.*cut the finger"),
        ({"phalanx": SCAN.skin}, r"phalanx: got .* the file of the skin"),
        ({"skin": "none.stl"}, r"mesh.skin: cannot read none.stl"),
        ({"skin": "flat.vtu"}, r"flat\.vtu: is flat, needs a surface around a body"),
        ({"tip": (0, 1, 0), "pad": (0, 0, -1)}, r"long axis is \d\d degrees off the direction of the tip"),
        ({"tip": (0, 0, 0)}, "tip: got"),
    ],
)
def test_scans_that_do_not_fit(changes, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    points = np.array([[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]], dtype=float)
    meshio.write("flat.vtu", meshio.Mesh(points, [("quad", [[0, 1, 2, 3]])]))
    scan = dataclasses.replace(SCAN, **changes)
    make = {"none.stl": scan.key, "flat.vtu": scan.estimated_cells}.get(scan.skin, scan.build)
    with pytest.raises((fs.InputError, fs.MeshError), match=message):
        make()
