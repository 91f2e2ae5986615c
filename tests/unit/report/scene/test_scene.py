"""What a scene is made of, snapshots as VTK has them, and where a browser finds it."""

import itertools
import socket
from unittest.mock import Mock

import numpy as np
import pytest
import pyvista
from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter

from fingerslip.commands.shared import cameras, fields
from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.errors import InputError, ResultError
from fingerslip.parameters import from_mapping
from fingerslip.report.scene import scene
from fingerslip.report.scene.names import CAMERAS, CUTS, FIELDS, alternatives
from fingerslip.report.scene.options import LOCAL, SCALARS, SceneOptions, Served, require_free
from fingerslip.report.scene.viewer import stills
from fingerslip.slip import contact_patch
from fingerslip.snapshot import CELL_TYPES, in_space, read_snapshot
from unit.report.scenes import block_history


@pytest.fixture(scope="module")
def history():
    return block_history()


def test_grid_is_the_deformed_mesh_in_millimetres_with_fields_in_their_units(history):
    grid = scene.snapshot_grid(history, 0)
    assert grid.volume == pytest.approx(1000.0)
    assert grid.bounds == pytest.approx((0.0, 10.0) * 3)
    pressed = scene.snapshot_grid(history, history.sizes["snapshot_time"] - 1)
    assert pressed.bounds[4] == pytest.approx(0.5, abs=0.05)  # on soft penalties
    later, moved = scene.snapshot_grid(history, 1), history["snapshot_displacement"].values[1]
    assert later.point_data["displacement"] == pytest.approx(1e3 * np.linalg.norm(moved, axis=1))
    assert later.cell_data["von_mises"] == pytest.approx(1e-3 * history["snapshot_von_mises"].values[1])


@pytest.mark.parametrize(("element", "name"), [
    ("Q4", "QUAD"), ("T3", "TRIANGLE"), ("T6", "QUADRATIC_TRIANGLE"),
    ("H8", "HEXAHEDRON"), ("T4", "TETRA"), ("T10", "QUADRATIC_TETRA")
])  # fmt: skip
def test_every_element_has_its_cells_with_reference_positions_and_vectors_of_three_components(element, name):
    history = block_history(element)
    dim, snapshot, grid = history.sizes["component"], read_snapshot(history, 2), scene.snapshot_grid(history, 0)
    assert set(grid.celltypes) == {CELL_TYPES[element]} == {getattr(pyvista.CellType, name)}
    assert grid.compute_cell_sizes()["Area" if dim == 2 else "Volume"].sum() == pytest.approx(10.0**dim)
    np.testing.assert_array_equal(snapshot.points[:, :dim], history["node_position"])
    assert snapshot.points.shape == snapshot.point_fields["displacement"].shape == (history.sizes["node"], 3)
    np.testing.assert_array_equal(snapshot.point_fields["displacement"][:, :dim], history["snapshot_displacement"][2])
    assert np.abs(snapshot.point_fields["displacement"]).max() > 1e-4, "the block has moved"
    assert snapshot.time == float(history["snapshot_time"][2])
    assert set(snapshot.cell_fields) == {"strain_energy_density", "von_mises", "region"}
    assert in_space(np.array([[1.0, 2.0, 3.0][:dim]])).tolist() == [[1.0, 2.0, 3.0 * (dim - 2)]]


def drawn(history, **options):
    plotter = pyvista.Plotter(off_screen=True)
    scene.draw_scene(plotter, history, 2, SceneOptions(**options))
    scene.aim(plotter, history, SceneOptions(**options))
    return plotter


@pytest.mark.parametrize(
    ("options", "has", "lacks"),
    [
        ({}, {"layer skin", "layer tissue", "plate 0", "sites FA-II", "time"}, set()),
        ({"hidden": ("skin",), "plate": False}, {"layer tissue"}, {"layer skin", "plate 0"}),
        ({"written": False, "receptors": False}, {"layer skin"}, {"time", "sites FA-II"}),
    ],
)
def test_what_is_chosen_is_there(history, options, has, lacks):
    plotter = drawn(history, **options)
    assert has <= set(plotter.actors)
    assert not lacks & set(plotter.actors)
    assert bool(plotter.scalar_bars) == options.get("written", True)


def test_colours_are_scaled_to_what_is_shown_and_not_to_the_bone(history):
    values = np.where(history["cell_region"].values == 0, 1e3, 9e6) * np.ones_like(history["snapshot_von_mises"])
    names = scene.region_names(history)
    assert names == ("skin", "tissue")
    stressed = history.assign(snapshot_von_mises=(history["snapshot_von_mises"].dims, values))
    assert scene.field_limits(stressed, SceneOptions()) == pytest.approx((0.0, 9e3))
    assert scene.field_limits(stressed, SceneOptions(hidden=names[1:])) == pytest.approx((0.0, 1.0))
    bone = stressed.assign_attrs(regions=f"{names[0]}, phalanx")
    assert scene.field_limits(bone, SceneOptions()) == pytest.approx((0.0, 1.0))
    assert scene.field_limits(bone, SceneOptions(hidden=names[:1])) == pytest.approx((0.0, 9e3))


def test_components_of_stress_and_strain_are_fields_with_zero_in_the_middle(history):
    options = SceneOptions(scalar="stress_zz")
    shown = 1e-3 * history["snapshot_stress"].sel(stress_component="zz").values
    low, high = scene.field_limits(history, options)
    assert low == -high == -np.percentile(np.abs(shown), 99.0, axis=1).max() < 0.0
    with scene.one_scale([history], options):
        assert scene.field_limits(history, options) == (low, high)
    plotter = drawn(history, scalar="stress_zz")
    layer = plotter.actors["layer tissue"].mapper.dataset
    inside = shown[2][history["cell_region"].values == 1]
    assert inside.min() <= layer["stress_zz"].min() < -1.0
    assert layer["stress_zz"].max() <= inside.max()
    assert "Cauchy stress zz [kPa]" in plotter.scalar_bars
    section = block_history("Q4")
    assert scene.fields_of(section)[5:] == tuple(f"{name}_{at}" for name in ("stress", "strain") for at in AXES_2D)
    with pytest.raises(InputError, match="field: got 'strain_xz', which the result does not have, needs one of von_m"):
        scene.field_limits(section, SceneOptions(scalar="strain_xz"))
    assert "stress_xx" not in scene.fields_of(section.drop_vars(["snapshot_stress", "snapshot_strain"]))


AXES_2D = ("xx", "yy", "zz", "xy")


def test_colours_of_several_runs_have_one_scale(history):
    weak = history.assign(snapshot_von_mises=0.5 * history["snapshot_von_mises"])
    unlike = SceneOptions(scalar="displacement")
    alone = [scene.field_limits(run, SceneOptions()) for run in (weak, history)]
    assert alone[0][1] == pytest.approx(0.5 * alone[1][1])
    with scene.one_scale([weak, history.drop_dims("snapshot_time"), history], SceneOptions(hidden=("skin",))):
        assert [scene.field_limits(run, SceneOptions()) for run in (weak, history)] == [alone[1]] * 2
        hidden = [scene.field_limits(run, SceneOptions(hidden=("skin",))) for run in (weak, history)]
        assert hidden[0] == hidden[1]
        assert scene.field_limits(weak, SceneOptions(scalar="region")) == (0.0, 1.0)
        assert scene.field_limits(weak, unlike) == scene.field_limits(history, unlike)
    assert scene.field_limits(weak, SceneOptions()) == alone[0]


@pytest.mark.parametrize("camera", ["side", "below"])
def test_a_film_shows_the_body_wherever_it_is_dragged(history, camera):
    count = history.sizes["snapshot_time"]
    drag = np.linspace(0.0, 0.04, count)[:, None, None] * np.array([1.0, 0.0, 0.0])
    dragged = history.assign(snapshot_displacement=history["snapshot_displacement"] + drag)
    options = SceneOptions(camera=camera, written=False, plate=False, receptors=False)
    pictures = [picture < 250 for picture in stills(dragged, range(count), options, (240, 160))]
    edges = [np.concatenate([seen[0], seen[-1], seen[:, 0], seen[:, -1]]).any() for seen in pictures]
    assert [seen.any() for seen in pictures] == [True] * count
    assert edges == [False] * count


def test_a_cut_leaves_half_of_the_body_and_the_plate_is_where_it_touches(history):
    def depth(cut):
        bounds = drawn(history, cut=cut, plate=False, scalar="region").actors["layer tissue"].bounds
        return float(bounds[3] - bounds[2])

    assert depth("y") == pytest.approx(0.5 * depth("none"), rel=0.05)
    step = int(np.abs(history["time"].values - float(history["snapshot_time"][2])).argmin())
    height = 1e3 * float(history["counterface_displacement"].values[step, 0, 2])
    assert drawn(history).actors["plate 0"].bounds[4:] == pytest.approx((height, height), abs=1e-6)


@pytest.mark.parametrize(("normal", "cut"), [((0, 0, 1), "y"), ((0, 0, -1), "y"), ((0, 1, 0), "z")])
def test_a_body_stands_upright_on_its_plate_and_is_open_towards_the_camera(history, normal, cut):
    seen = history.assign(counterface_normal=(history["counterface_normal"].dims, np.array([normal], dtype=float)))
    assert scene.middle_cut(seen) == cut
    plotter = drawn(seen, camera="side", cut=cut, plate=False, receptors=False)
    assert np.abs(plotter.camera.up) == pytest.approx(np.abs(normal), abs=1e-9)
    half, whole = (
        np.mean(np.reshape(shape.bounds, (3, 2)), axis=1)
        for shape in (plotter.actors["layer tissue"], scene.snapshot_grid(seen, 2))
    )
    assert (half - whole) @ plotter.camera.direction > 1.0  # mm


def test_within_the_contact_and_its_stick_zone_levels_are_above_zero_and_nowhere_else(history):
    patch = contact_patch(history)
    seen = set()
    for step in range(history.sizes["time"]):
        states = history["contact_state"].values[step, patch.nodes]
        touch, stick = scene.contact_levels(history, patch, step)
        np.testing.assert_array_equal(touch > 0.0, states != OPEN)
        np.testing.assert_array_equal(stick > 0.0, states == STICK)
        seen |= set(states.tolist())
    assert seen == {OPEN, STICK, SLIP}


def test_no_slip_is_drawn_between_what_sticks_and_what_is_open(history):
    patch = contact_patch(history)
    x, y, _ = history["contact_position"].values.T
    sticks = x < 4e-3

    def everywhere(name, values):
        return history[name].copy(data=np.broadcast_to(values, history[name].shape))

    # What is open slides faster the nearer it is to the plate.
    fields = {"contact_state": np.where(sticks, STICK, OPEN), "gap": np.where(sticks, -1e-6, 1e-5 + y)}
    fields["contact_velocity"] = np.where(sticks, 0.0, 1e-6 / (1e-3 + y))[:, None] * (1.0, 0.0, 0.0)
    changed = history.assign({name: everywhere(name, values) for name, values in fields.items()})
    states = changed["contact_state"]
    touch, stick = scene.contact_levels(changed, patch, 8)
    corners = states.values[8, patch.nodes][patch.triangles]
    for first, second in itertools.permutations(range(3), 2):
        edge = (corners[:, first] == STICK) & (corners[:, second] == OPEN)
        start, end = patch.triangles[edge][:, [first, second]].T
        touching, sticking = (level[start] / (level[start] - level[end]) for level in (touch, stick))
        assert np.all(sticking >= touching * (1.0 - 1e-12))


@pytest.mark.parametrize(("camera", "length"), [("side", 2.0), ("oblique", 2.0)])
def test_a_bar_has_a_round_length_below_the_body_whatever_the_camera(history, camera, length):
    plotter = drawn(history, camera=camera)
    scene.draw_scale(plotter, scene.snapshot_grid(history, 2).points)
    low, high = np.reshape(plotter.actors["scale"].bounds, (3, 2)).T
    assert np.linalg.norm(high - low) == pytest.approx(length)
    assert plotter.camera.parallel_projection


def test_every_name_is_an_option_that_can_be_drawn_and_what_cannot_be_shown_is_refused(history):
    assert set(CAMERAS) == set(scene._DIRECTIONS)
    assert tuple(SCALARS) == FIELDS
    assert SCALARS["displacement"] == ("displacement [mm]", 1e3)
    for name, names in (("camera", CAMERAS), ("scalar", FIELDS), ("cut", CUTS)):
        assert [getattr(SceneOptions(**{name: one}), name) for one in names] == list(names)
    assert (cameras(""), fields(""), fields("re")) == (list(CAMERAS), list(FIELDS), ["region"])
    assert [alternatives(names) for names in (("a", "b"), ("a", "b", "c"))] == ["a or b", "a, b or c"]
    with pytest.raises(InputError, match="'nail', which is no region, may hold skin, tissue"):
        scene.check_options(history, SceneOptions(hidden=("nail",)))
    with pytest.raises(ResultError, match="snapshots_every"):
        scene.check_options(history.drop_dims("snapshot_time"), SceneOptions())
    with pytest.raises(InputError, match="view: camera: got 'top', needs 'oblique', 'side', 'front' or 'below'"):
        from_mapping(SceneOptions, {"camera": "top"}, "view")


PORT, HOST = (
    "--port: got .*, needs a number from 0 to 65535; 0 takes",
    "--host: .* is no address of this machine, needs",
)


@pytest.mark.parametrize(
    ("host", "port", "words"),
    [
        *((LOCAL, port, PORT) for port in (-1, 65536, 10**9)),
        *((host, 0, HOST) for host in ("192.0.2.1", "no such host", "a" * 300, "256.1.1.1")),
    ],
)
def test_a_place_at_which_nothing_can_listen_is_refused(host, port, words):
    with pytest.raises(InputError, match=f"view: {words}"):
        require_free(Served(host, port))


def test_a_free_port_is_taken_and_one_in_use_or_of_the_system_is_refused(monkeypatch):
    assert Served().host == LOCAL == "127.0.0.1", "only this machine can look unless told otherwise"
    for host in (LOCAL, "localhost", "0.0.0.0"):
        require_free(Served(host, 0))
    with socket.create_server((LOCAL, 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(InputError, match=f"--port: port {port} is in use at 127.0.0.1, needs .*; write --port 0"):
            require_free(Served(LOCAL, port))
    require_free(Served(LOCAL, port))
    monkeypatch.setattr(socket.socket, "bind", Mock(side_effect=PermissionError(13, "Permission denied")))
    with pytest.raises(InputError, match="port 80 is reserved for the system, needs one from 1024 to 65535"):
        require_free(Served(LOCAL, 80))


def test_prisms_on_each_other_hide_the_face_between_them_and_look_outwards():
    """As hexahedra with edges without length they showed it, dark in the cut."""
    triangle, height = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([0, 0, 1])
    points = np.concatenate([triangle, triangle + height, triangle + 2 * height])
    grid = scene.vtk_grid(np.array([[0, 1, 2, 2, 3, 4, 5, 5], [3, 4, 5, 5, 6, 7, 8, 8]]), CELL_TYPES["H8"], points)
    surface = vtkGeometryFilter()
    surface.SetInputData(grid)
    surface.Update()
    outside = pyvista.wrap(surface.GetOutput()).triangulate()
    a, b, c = (outside.points[outside.regular_faces[:, corner]] for corner in range(3))
    assert outside.area == pytest.approx(1 + 2 * (2 + np.sqrt(2)))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(1.0), "the volume"
