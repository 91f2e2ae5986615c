"""Surfaces from files: units, holes, repair, distances, decimation, and the surface below them."""

import meshio
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fingerslip as fs
from fingerslip.mesh.scan.repair import Repairs, closed_where
from fingerslip.mesh.scan.surfaces import boundary_loops, check_enclosure, contains, distances, outermost
from fingerslip.mesh.scan.winding import winding_numbers
from unit.ellipsoids import ellipsoid, together, with_hole

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
