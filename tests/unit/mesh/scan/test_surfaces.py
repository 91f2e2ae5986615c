"""Scans: their surfaces, and meshes from them."""

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
from fingerslip.mesh.scan.repair import Repairs, closed_where
from fingerslip.mesh.scan.surfaces import boundary_loops, check_enclosure, contains, distances, outermost
from fingerslip.mesh.scan.winding import winding_numbers
from unit.ellipsoids import ellipsoid, together, with_hole
from unit.scans import MESHES, SCAN, mesh_of_a_scan

VOLUME = 4 / 3 * np.pi * 12e-3 * 8e-3 * 7e-3


@pytest.mark.parametrize("suffix", ["stl", "ply", "obj", "vtu"])
@pytest.mark.parametrize("unit", ["mm", "m", "um"])
def test_file_comes_back_in_metres(tmp_path, suffix, unit):
    surface = ellipsoid()
    fs.write_surface(surface, tmp_path / f"skin.{suffix}", unit)
    back = fs.read_surface(tmp_path / f"skin.{suffix}", unit)
    assert back.volume == pytest.approx(surface.volume, rel=1e-5)
    assert back.volume == pytest.approx(VOLUME, rel=0.02)
    assert fs.Surface(back.points, back.triangles[:, ::-1]).volume == pytest.approx(-back.volume)
    assert len(back.points) == len(surface.points)
    assert boundary_loops(back) == ()
    square = meshio.Mesh(10.0 * np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), [("quad", [[0, 1, 2, 3]])])
    meshio.write(tmp_path / "plane.vtu", square)
    assert fs.read_surface(tmp_path / "plane.vtu").area == pytest.approx(1e-4), "quadrilaterals are cut in two"


def test_loop_goes_around_the_hole_and_two_holes_that_meet_in_a_point_are_two_loops():
    holed = with_hole(ellipsoid(), (0.0, 0.0, 7e-3), 3e-3)
    (loop,) = boundary_loops(holed)
    assert np.linalg.norm(holed.points[loop].mean(axis=0)[:2]) < 0.5e-3
    lid = np.column_stack([loop, np.roll(loop, -1), np.full(len(loop), len(holed.points))])
    middle = holed.points[loop].mean(axis=0)
    closed = fs.Surface(np.vstack([holed.points, middle]), np.vstack([holed.triangles, lid]))
    check_enclosure(closed)
    node = np.arange(36).reshape(6, 6)
    a, b, c, d = node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]
    squares = np.stack([a, b, c, a, c, d], axis=-1)
    kept = np.ones((5, 5), dtype=bool)
    kept[[1, 2], [1, 2]] = False
    y, x = np.divmod(np.arange(36.0), 6)
    sheet = fs.Surface(np.column_stack([x, y, 0 * x]), squares[kept].reshape(-1, 3))
    assert sorted(len(loop) for loop in boundary_loops(sheet)) == [4, 4, 20]


@pytest.mark.slow
def test_points_inside_are_told_and_outermost_drops_what_lies_inside():
    outer, inner = ellipsoid(), ellipsoid((3e-3, 3e-3, 3e-3))
    assert contains(outer, np.array([[11e-3, 0, 0], [0, 7.5e-3, 0], [0, 0, 7.5e-3]])).tolist() == [True, True, False]
    assert outermost(together(outer, inner)).area == pytest.approx(outer.area)
    half_out = ellipsoid((3e-3, 3e-3, 3e-3), (0.0, 8e-3, 0.0))
    kept = outermost(together(outer, half_out)).area
    assert outer.area < kept < outer.area + half_out.area


UNIT_BALL, COORDINATE = ellipsoid((1.0, 1.0, 1.0)), st.floats(-2.0, 2.0)


@given(st.tuples(COORDINATE, COORDINATE, COORDINATE))
def test_closed_surface_winds_once_or_not_at_all(point):
    distance = np.linalg.norm(point)
    if abs(distance - 0.995) > 0.02:
        number = winding_numbers(UNIT_BALL.corners, np.array([point]))[0]
        assert number == pytest.approx(1.0 if distance < 1 else 0.0, abs=1e-9)


def test_solid_angles_add_up_and_a_hole_takes_away_its_own():
    centre = np.zeros((1, 3))
    assert winding_numbers(np.eye(3)[None], centre)[0] == pytest.approx(1 / 8, rel=1e-12)
    assert winding_numbers(UNIT_BALL.corners[:, ::-1], centre)[0] == pytest.approx(-1.0)
    both = together(UNIT_BALL, ellipsoid((0.5, 0.5, 0.5)))
    assert winding_numbers(both.corners, np.array([[0.0, 0, 0], [0.8, 0, 0]])) == pytest.approx([2.0, 1.0])
    holed = with_hole(UNIT_BALL, (0.0, 0.0, 1.0), 0.4)
    left = len(holed.triangles) / len(UNIT_BALL.triangles)
    assert winding_numbers(holed.corners, centre)[0] == pytest.approx(left, abs=2e-3)


SPHERE = ellipsoid((8e-3, 8e-3, 8e-3), points=1200)


def test_decimation_keeps_the_shape_and_distances_count_on_both_sides():
    points = np.array([[0.0, 0, 0], [7e-3, 0, 0], [0, 10e-3, 0]])
    assert distances(SPHERE, points) == pytest.approx([8e-3, 1e-3, 2e-3], abs=0.04e-3)
    assert fs.decimate_surface(SPHERE, 0.1e-3) is SPHERE, "as coarse already"
    fewer = fs.decimate_surface(SPHERE, 1.5e-3)
    assert len(fewer.triangles) == pytest.approx(SPHERE.area / (np.sqrt(3) / 4 * 1.5e-3**2), rel=0.05)
    check_enclosure(fewer)
    assert fewer.volume == pytest.approx(SPHERE.volume, rel=0.01)


@pytest.mark.parametrize(("thickness", "inside"), [(2e-3, None), (3e-3, (2e-3, 2e-3, 2e-3))])
def test_inner_sphere_has_the_smaller_radius_whatever_piece_is_inside(thickness, inside):
    body = SPHERE if inside is None else together(SPHERE, ellipsoid(inside))
    inner = fs.offset_inwards(body, thickness)
    check_enclosure(inner)
    assert inner.volume > 0
    assert np.linalg.norm(inner.points, axis=1) == pytest.approx(8e-3 - thickness, abs=0.05 * thickness)


@pytest.mark.slow
def test_thin_neck_parts_in_two():
    # Two balls that a neck of 1 mm radius joins: 1.5 mm below the skin only balls of 3.5 mm radius are left.
    balls = (ellipsoid((5e-3,) * 3, (x, 0.0, 0.0)) for x in (-6e-3, 6e-3))
    inner = fs.offset_inwards(together(*balls, ellipsoid((7e-3, 1e-3, 1e-3), points=2000)), 1.5e-3)
    radius = np.linalg.norm(np.abs(inner.points) - [6e-3, 0.0, 0.0], axis=1)
    assert np.median(radius) == pytest.approx(3.5e-3, abs=0.05e-3)
    assert radius.max() < 3.55e-3


WHOLE = ellipsoid()


@pytest.mark.slow
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 1.0))
def test_any_turned_triangles_are_turned_back(seed, share):
    turned = np.random.default_rng(seed).random(len(WHOLE.triangles)) < share
    dirty = np.where(turned[:, None], WHOLE.triangles[:, ::-1], WHOLE.triangles)
    repaired, repairs = fs.repair_surface(fs.Surface(WHOLE.points, dirty))
    assert repairs.turned_triangles == turned.sum()
    assert repaired.volume == pytest.approx(WHOLE.volume)
    check_enclosure(repaired)


def test_triangles_that_share_no_points_are_joined_and_two_pieces_are_both_turned_outwards():
    apart = fs.Surface(WHOLE.corners.reshape(-1, 3), np.arange(WHOLE.triangles.size).reshape(-1, 3))
    repaired, repairs = fs.repair_surface(apart)
    assert repairs == Repairs(0, 0, (), ())
    assert len(repaired.points) == len(WHOLE.points)
    assert repaired.volume == pytest.approx(WHOLE.volume)
    check_enclosure(repaired)
    other = ellipsoid((3e-3, 3e-3, 3e-3), (0.0, 30e-3, 0.0))
    repaired, repairs = fs.repair_surface(together(WHOLE, fs.Surface(other.points, other.triangles[:, ::-1])))
    assert repairs.turned_triangles == len(other.triangles)
    # Volume about a common point adds up for closed pieces.
    assert repaired.volume == pytest.approx(WHOLE.volume + other.volume)


def test_a_small_hole_is_closed_on_its_sphere_a_large_one_is_reported_and_debris_is_dropped():
    sphere = ellipsoid((10e-3, 10e-3, 10e-3), points=2000)
    repaired, repairs = fs.repair_surface(with_hole(sphere, (0.0, -10e-3, 0.0), 1.6e-3))
    assert repairs.closed_holes == (pytest.approx(3.2e-3, abs=1e-3),)
    assert repairs.open_holes == ()
    check_enclosure(repaired)
    # A flat lid would lie 0.15 mm too deep.
    assert np.linalg.norm(repaired.points[-1]) == pytest.approx(10e-3, abs=0.03e-3)
    repaired, repairs = fs.repair_surface(with_hole(WHOLE, (0.0, 0.0, 7e-3), 4e-3), largest_hole=5e-3)
    assert repairs.closed_holes == ()
    assert len(repairs.open_holes) == len(boundary_loops(repaired)) == 1
    assert repairs.open_holes[0] > 5e-3
    repaired, repairs = fs.repair_surface(together(WHOLE, ellipsoid((2e-4,) * 3, (0.0, 9e-3, 0.0), 20)))
    assert repairs.dropped_pieces == 1
    assert len(repaired.points) == len(WHOLE.points)


def test_moebius_strip_has_no_inside():
    count = 30
    turn = 2 * np.pi * np.arange(count) / count
    across = np.array([[-0.3], [0.3]])
    radius = 1 + across * np.cos(turn / 2)
    points = np.stack([radius * np.cos(turn), radius * np.sin(turn), across * np.sin(turn / 2)], -1).reshape(-1, 3)
    a, b = np.arange(count), count + np.arange(count)
    c, d = np.append(a[1:], b[0]), np.append(b[1:], a[0])
    strip = fs.Surface(points, np.vstack([np.column_stack([a, b, c]), np.column_stack([b, d, c])]))
    with pytest.raises(fs.MeshError, match="Moebius"):
        fs.repair_surface(strip)


def test_proximal_end_is_closed_whatever_its_size():
    stump = fs.Surface(WHOLE.points, WHOLE.triangles[WHOLE.corners[:, :, 0].max(axis=1) > -6e-3])
    assert len(boundary_loops(stump)) == 1
    check_enclosure(closed_where(stump, -4e-3))
    with pytest.raises(fs.MeshError, match="is open"):
        check_enclosure(closed_where(stump, -9e-3))


def flat(shape):
    """Return points of triangles without an area."""
    points = np.outer(np.arange(6.0), [5.0, 0.0, 0.0] if shape == "line" else [1e-9, 0.0, 0.0])
    points[-1, 0] += 5.0
    return points


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ((np.eye(3), "line", [[0, 1]]), "has line, needs triangles"),
        ((flat("point"), "triangle", [[0, 1, 2], [2, 3, 5]]), "has no triangle with an area, needs the surface of a"),
        ((flat("line"), "triangle", [[0, 1, 2], [1, 2, 5]]), "has no triangle with an area"),
    ],
)
def test_files_that_are_no_surface(tmp_path, content, message):
    file = tmp_path / "skin.vtu"
    meshio.write(file, meshio.Mesh(content[0], [content[1:]]))
    with pytest.raises(fs.MeshError, match=message):
        fs.read_surface(file)


HOLED = with_hole(ellipsoid(), (0.0, 0.0, 7e-3), 3e-3)
NOTHING = fs.Surface(np.zeros((3, 3)), np.empty((0, 3), dtype=np.int64))
TURNED = fs.Surface(WHOLE.points, WHOLE.triangles[:, ::-1])


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: fs.read_surface("skin.stl", "inch"), fs.InputError, "unit: got 'inch', needs one of m, cm, mm, um"),
        (lambda: check_enclosure(HOLED), fs.MeshError, r"holed: is open: 1 hole, the largest .* mm wide at .*repair"),
        (lambda: check_enclosure(TURNED), fs.MeshError, r"inside out.*repair_surface"),
        (lambda: fs.offset_inwards(SPHERE, 8.5e-3), fs.MeshError, r"is nowhere 8.5 mm deep.*smaller skin_thickness"),
        (lambda: fs.offset_inwards(SPHERE, 0.05e-3), fs.MeshError, "needs a thicker skin"),
        (lambda: fs.offset_inwards(SPHERE, 0.0), fs.InputError, "thickness"),
        (lambda: fs.decimate_surface(SPHERE, -1.0), fs.InputError, "edge_length"),
        (lambda: fs.decimate_surface(ellipsoid(), 1e3), fs.MeshError, "has no triangle with an area"),
        (lambda: fs.repair_surface(NOTHING), fs.MeshError, "has no triangle with an area"),
    ],
)
def test_surfaces_and_lengths_that_do_not_fit(call, error, message):
    with pytest.raises(error, match=message):
        call()


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
