"""The scene of a snapshot: the deformed layers coloured by a field, the plate, the recorded sites, a cut."""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Floats
from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.errors import InputError, ResultError
from fingerslip.history import is_solid, nearest_record, site_kinds
from fingerslip.libraries import pyvista, xr
from fingerslip.mesh.mixed import vtk_cells
from fingerslip.report import colours as palette
from fingerslip.report.scene.names import COMPONENTS, FIELDS, Camera, Cut, Scalar
from fingerslip.report.scene.options import SCALARS, SceneOptions
from fingerslip.slip.patch import Patch as ContactPatch
from fingerslip.slip.patch import contact_patch
from fingerslip.slip.windows import travel_direction
from fingerslip.snapshot import Face, faces_at, in_space, read_snapshot

#: Fields that have a value for each cell, of stress; stiff regions are left out of them.
OF_CELLS = ("von_mises", "strain_energy_density", *COMPONENTS)
#: Nodes of a cell of a section that are its corners.
CORNERS = {"Q4": 4, "T3": 3, "T6": 3}
_BAR = {"width": 0.4, "height": 0.12, "position_x": 0.04, "position_y": 0.02, "fmt": "%.4g", "color": palette.BLACK}
_FONTS = {"title_font_size": 18, "label_font_size": 16}
# Labels of a bar at most.
_LABELS = 5
_DIRECTIONS: Mapping[Camera, tuple[tuple[float, float, float], tuple[float, float, float]]] = {
    "side": ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
    "front": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "below": ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0)),
    "oblique": ((0.55, 0.5, 0.9), (0.0, 1.0, 0.0)),
}
# Least part of a plate's normal along z where z is up.
_UPRIGHT = 0.75
# Where z is up: to the right, upwards, to the viewer.
_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
# Levels do not come nearer to zero than this: an edge does not go through a node.
_LEAST_LEVEL = 0.05
# Of the largest extent of the body: the side of a plate's outline; of that side the length of its arrow.
_PLATE, _ARROW = 1.1, 0.3
# How far outside of the skin the states of its contact are drawn [mm].
_OUTSIDE = 0.12
# What VTK fits is the box around everything, which leaves wide margins.
_ZOOM = 1.35
# A wider picture than what moves has room for the scale bar.
_AROUND = 1.12
# Width over height of windows in which it fits.
_WIDE = 4 / 3
_PERCENTILE = 99.0
# The ends of the colours of several runs, by field and hidden regions.
_tops: ContextVar[Mapping[tuple[str, tuple[str, ...]], float]] = ContextVar("_tops", default=MappingProxyType({}))
# Letters of the scale bar across a picture.
_LETTERS = 34.0
# Without light, and without moving the camera.
_FLAT = {"reset_camera": False, "lighting": False}


def region_names(history: xr.Dataset) -> tuple[str, ...]:
    """Return the names of the regions of the mesh."""
    names = str(history.attrs.get("regions", ""))
    return tuple(names.split(", ")) if names else ()


def soft_regions(history: xr.Dataset, hidden: Sequence[str] = ()) -> list[int]:
    """Return the numbers of the regions whose stress sets the colours: all but stiff ones, or these where alone."""
    visible = [name for name in region_names(history) if name not in hidden]
    soft = [name for name in visible if name not in palette.STIFF_REGIONS] or visible
    return [number for number, name in enumerate(region_names(history)) if name in soft]


def scale_length(width: float) -> float:
    """Return the round length [mm] that is the largest within a quarter of a width [mm].

    Examples
    --------
    >>> scale_length(24.0), scale_length(45.0)
    (5.0, 10.0)
    """
    power = 10.0 ** np.floor(np.log10(0.25 * width))
    return float(power * max(step for step in (1, 2, 5) if step * power <= 0.25 * width))


def check_options(history: xr.Dataset, options: SceneOptions) -> None:
    """Check that a history can be shown with these options."""
    if history.sizes.get("snapshot_time", 0) == 0:
        repair = "write record: {snapshots_every: 50 ms} and run again"
        raise ResultError(f"the result has no snapshots of the whole mesh; {repair}")
    names = region_names(history)
    for name in options.hidden:
        if name not in names:
            raise InputError("hidden", f"has '{name}', which is no region", f"may hold {', '.join(names)}")


def fields_of(history: xr.Dataset) -> tuple[Scalar, ...]:
    """Return the fields that a history has: in 2D not all components, and old ones have none."""
    components = history["stress_component"].values if "snapshot_stress" in history else ()
    return tuple(name for name in FIELDS if name not in COMPONENTS or name.partition("_")[2] in components)


def field_values(history: xr.Dataset, scalar: Scalar, numbers: int | slice = slice(None)) -> Floats:
    """Return a field at snapshots [SI]: of cells (n, n_cells), of nodes with its components (n, n_nodes, dim)."""
    if scalar not in COMPONENTS:
        return np.asarray(history[f"snapshot_{scalar}"].values[numbers])
    if scalar not in fields_of(history):
        fault, allowed = f"got '{scalar}', which the result does not have", ", ".join(fields_of(history))
        raise InputError("field", fault, f"needs one of {allowed}")
    tensor, _, component = scalar.partition("_")
    return history[f"snapshot_{tensor}"].sel(stress_component=component).values[numbers].astype(np.float64)


def vtk_grid(cells: NDArray[np.integer[Any]], kind: int, points: Floats) -> pyvista.UnstructuredGrid:
    """Return the mesh of cells (n, k) of one kind in VTK, triangles and prisms as such, on points (m, 3)."""
    nodes, ends, kinds = vtk_cells(cells, kind)
    counts = np.diff(ends, prepend=0)
    return pyvista.UnstructuredGrid(np.insert(nodes, ends - counts, counts), kinds, points)


def snapshot_grid(history: xr.Dataset, number: int, scalar: Scalar = "von_mises") -> pyvista.UnstructuredGrid:
    """Return the deformed mesh of a snapshot [mm] with its fields in the units of :data:`SCALARS`, a component too."""
    snapshot = read_snapshot(history, number)
    points = 1e3 * (snapshot.points + snapshot.point_fields["displacement"])
    grid = vtk_grid(snapshot.cells, snapshot.cell_type, points)
    for name, vectors in snapshot.point_fields.items():
        grid.point_data[name] = SCALARS[name][1] * np.linalg.norm(vectors, axis=1)
    for name, values in snapshot.cell_fields.items():
        grid.cell_data[name] = values if name == "region" else SCALARS[name][1] * values
    if scalar in COMPONENTS:
        grid.cell_data[scalar] = SCALARS[scalar][1] * field_values(history, scalar, number)
    return grid


def draw_scene(plotter: Any, history: xr.Dataset, number: int, options: SceneOptions) -> dict[str, Any]:
    """Draw a snapshot, and return what its layers are drawn as."""
    grid, limits, actors = snapshot_grid(history, number, options.scalar), field_limits(history, options), {}
    is_cut = options.cut != "none" and is_solid(history)
    for region, name in enumerate(region_names(history)):
        layer: Any = grid.extract_cells(np.asarray(grid.cell_data["region"]) == region)
        if name in options.hidden or not layer.n_cells:
            continue
        # Means at the nodes of a layer: its cells are not seen, its borders are.
        layer, border = layer.cell_data_to_point_data(), None
        if is_cut:
            # What is in front, as the viewer sees it, is left out.
            normal = np.eye(3)["xyz".index(options.cut)] * (-1.0 if options.cut == "y" and _is_z_up(history) else 1.0)
            border = layer.slice(normal=normal, origin=grid.center)
            layer = layer.clip(normal=normal, origin=grid.center, invert=True)
        elif not is_solid(history):
            border = layer.extract_surface(algorithm=None)
        actors[name] = plotter.add_mesh(layer, name=f"layer {name}", **_look(name, history, options, limits))
        if border is not None and border.n_cells:
            lines = border.extract_feature_edges(feature_edges=False, manifold_edges=False, non_manifold_edges=False)
            plotter.add_mesh(lines, name=f"border {name}", color=palette.LAYER_LINE, line_width=1.5, **_FLAT)
    _label_bars(plotter, limits)
    time = float(history["snapshot_time"][number])
    if options.plate:
        _draw_plates(plotter, history, number, grid, flat=options.camera in {"side", "front"} or not is_solid(history))
    if options.receptors:
        _draw_sites(plotter, history, time)
    if options.contact:
        _draw_contact(plotter, history, time)
    if options.written:
        plotter.add_text(f"t = {time:.3f} s", name="time", font_size=10, color=palette.BLACK)
    return actors


def _is_z_up(history: xr.Dataset) -> bool:
    """Tell whether the first counterface comes along z; else y is up in pictures."""
    normals = history["counterface_normal"].values[:1]
    return is_solid(history) and bool((np.abs(normals[:, 2:]) > _UPRIGHT).any())


def _directions(history: xr.Dataset, camera: Camera) -> Floats:
    """Return the vectors (2, 3) to a camera and upwards in its picture."""
    directions: Floats = np.matmul(_DIRECTIONS[camera], _Z_UP if _is_z_up(history) else np.eye(3))
    return directions


def upright(history: xr.Dataset) -> xr.Dataset:
    """Return a history whose vectors go right, up and to the viewer: turned where the first counterface is along z."""
    if not _is_z_up(history):
        return history
    vectors = [name for name, variable in history.variables.items() if variable.dims[1:][-1:] == ("component",)]
    return history.assign({name: history[name].copy(data=history[name].values @ _Z_UP.T) for name in vectors})


def middle_cut(history: xr.Dataset) -> Cut:
    """Return the normal of the cut through the middle of a solid, across the counterface and facing the viewer."""
    return "y" if _is_z_up(history) else "z"


def aim(plotter: Any, history: xr.Dataset, options: SceneOptions, numbers: Sequence[int] = ()) -> None:
    """Point the camera at the scene and all that moves in some snapshots, without perspective: scale bars hold."""
    plotter.enable_parallel_projection()
    plotter.view_vector(*_directions(history, options.camera if is_solid(history) else "side"))
    plotter.reset_camera()
    width, height = plotter.window_size
    plotter.camera.zoom(_ZOOM * min(1.0, width / (_WIDE * height)))
    camera, axes = plotter.camera, _axes(plotter)[:2]
    half = camera.parallel_scale * np.array([width / height, 1.0])
    seen = [(_drawn_points(history, options, number) - camera.focal_point) @ axes.T for number in numbers]
    low, high = (end([end(points, axis=0) for points in (*seen, np.zeros((1, 2)))], axis=0) for end in (np.min, np.max))
    # What moves out of the picture is followed by a wider one.
    if (low < -half).any() or (high > half).any():
        shift = 0.5 * (low + high) @ axes
        camera.focal_point, camera.position = camera.focal_point + shift, camera.position + shift
        camera.parallel_scale = _AROUND * 0.5 * max(high[1] - low[1], (high[0] - low[0]) * height / width)


def _drawn_points(history: xr.Dataset, options: SceneOptions, number: int) -> Floats:
    """Return points (n, 3) [mm] of the body, and of its plates where they are drawn whole, in a snapshot."""
    points = in_space(history["node_position"].values + history["snapshot_displacement"].values[number])
    half_side = 0.5 * _PLATE * float(np.ptp(points, axis=0).max())
    faces = faces_at(history, number, half_side) if options.plate and is_solid(history) else ()
    return 1e3 * np.concatenate([points, *(face.surface.reshape(-1, 3) for face in faces)])


def _axes(plotter: Any) -> Floats:
    """Return the directions (3, 3) to the right, up and to the viewer, as the camera sees them."""
    view = np.array(plotter.camera.direction)
    right = np.cross(view, plotter.camera.up)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(right, view), -view])


def draw_scale(plotter: Any, points: Floats, letters: float = 1.0) -> None:
    """Draw a bar of a round length below points (n, 3) [mm] at the right, as the camera sees them, with its length."""
    axes = _axes(plotter)
    low, high = (points @ axes.T).min(axis=0), (points @ axes.T).max(axis=0)
    length, size = scale_length(high[0] - low[0]), float((high - low).max())
    # Before everything, and clear of the plate.
    level, front = low[1] - (0.1 * letters - 0.03) * size, high[2] + size
    ends = np.array([[high[0] - length, high[0]], [level, level], [front, front]]).T @ axes
    plotter.add_mesh(pyvista.Line(*ends), name="scale", color=palette.BLACK, line_width=4.0, **_FLAT)
    look: dict[str, Any] = {"shape": None, "show_points": False, "always_visible": True, "reset_camera": False}
    look |= {"font_size": max(round(letters * plotter.window_size[0] / _LETTERS), 8), "bold": False}
    middle = [ends.mean(axis=0) + 0.01 * size * axes[1]]
    look |= {"justification_horizontal": "center", "text_color": palette.BLACK}
    plotter.add_point_labels(middle, [f"{length:g} mm"], **look)
    plotter.reset_camera_clipping_range()


def _look(name: str, history: xr.Dataset, options: SceneOptions, limits: tuple[float, float]) -> dict[str, Any]:
    """Return how a layer is coloured."""
    shared: dict[str, Any] = {"show_edges": options.edges, "reset_camera": False}
    if is_solid(history) and not options.edges:
        shared |= {"smooth_shading": True, "split_sharp_edges": True}
    is_stiff = region_names(history).index(name) not in soft_regions(history, options.hidden)
    if options.scalar == "region" or (is_stiff and options.scalar in OF_CELLS):
        # Mostly ambient light, so that the layers have the colours of a legend.
        colours = palette.region_colours(region_names(history)) if options.scalar == "region" else {}
        return {**shared, "color": colours.get(name, palette.STIFF_COLOUR), "ambient": 0.7, "diffuse": 0.3}
    bar = {"title": SCALARS[options.scalar][0], **_BAR, **_FONTS}
    look = {**shared, "scalars": options.scalar, "clim": limits, "cmap": palette.field_map(limits)}
    look |= {"scalar_bar_args": bar} if options.written else {"show_scalar_bar": False}
    # Without light: colours are those of the bar.
    return {**look, "lighting": False}


def _label_bars(plotter: Any, limits: tuple[float, float]) -> None:
    """Put round numbers on bars of colours between limits."""
    from matplotlib.ticker import MaxNLocator
    from vtkmodules.vtkCommonCore import vtkDoubleArray

    for bar in plotter.scalar_bars.values():
        labels = vtkDoubleArray()
        values: Floats = np.asarray(MaxNLocator(_LABELS, steps=[1, 2, 5, 10]).tick_values(*limits))
        for value in values[(values >= limits[0]) & (values <= limits[1])]:
            labels.InsertNextValue(float(value))
        bar.SetCustomLabels(labels)
        bar.SetUseCustomLabels(True)
        # An empty line below the title keeps it off the labels.
        bar.SetTitle(f"{bar.GetTitle().rstrip()}\n ")


@contextlib.contextmanager
def one_scale(histories: Iterable[xr.Dataset], *chosen: SceneOptions) -> Iterator[None]:
    """Give all pictures of several runs, with some options or none, one range of colours while the context lasts."""
    tops: dict[tuple[str, tuple[str, ...]], float] = {}
    for history in (history for history in histories if history.sizes.get("snapshot_time", 0)):
        for options in {SceneOptions(), *chosen}:
            key = (options.scalar, options.hidden)
            tops[key] = max(tops.get(key, 0.0), field_limits(history, options)[1])
    token = _tops.set(tops)
    try:
        yield
    finally:
        _tops.reset(token)


def field_limits(history: xr.Dataset, options: SceneOptions) -> tuple[float, float]:
    """Return the range of colours, the same for all snapshots: to a high percentile, as corners have any stress.

    Stiff regions do not count where anything else is shown: soft layers would have one colour. Components of tensors,
    which have signs, have zero in the middle.
    """
    if options.scalar == "region":
        return 0.0, 1.0
    if (options.scalar, options.hidden) in _tops.get():
        top = _tops.get()[options.scalar, options.hidden]
        return -top if options.scalar in COMPONENTS else 0.0, top
    values = field_values(history, options.scalar)
    if options.scalar in {"displacement", "velocity"}:
        values = np.linalg.norm(values, axis=-1)
    else:
        counted = np.isin(history["cell_region"].values, soft_regions(history, options.hidden))
        values = values[:, counted] if counted.any() else values
    is_signed = options.scalar in COMPONENTS
    values = np.abs(values) if is_signed else values
    top = SCALARS[options.scalar][1] * float(np.percentile(values, _PERCENTILE, axis=1).max())
    top = top if top > 0.0 else 1.0
    return -top if is_signed else 0.0, top


def _draw_plates(plotter: Any, history: xr.Dataset, number: int, grid: pyvista.UnstructuredGrid, *, flat: bool) -> None:
    """Draw the outlines of counterfaces, each with an arrow along its motion, below it where seen flat."""
    size = _PLATE * float(np.max(np.ptp(grid.points, axis=0)))
    for face in faces_at(history, number, 0.5e-3 * size):
        pieces = [pyvista.lines_from_points(1e3 * line) for line in _near(face, grid, size) if len(line) > 1]
        if pieces:
            look = {"color": palette.BLACK, "line_width": 2.0 if face.is_flat or not is_solid(history) else 1.0}
            plotter.add_mesh(pyvista.merge(pieces), name=f"plate {face.number}", **look, **_FLAT)
        travel = in_space(travel_direction(history, face.number))
        if travel.any():
            beside = 0.06 * face.normal if flat else 0.42 * np.cross(face.normal, travel)
            if not flat and beside @ _directions(history, "oblique")[0] > 0.0:
                beside = -beside  # on the side of the camera
            start = 1e3 * face.centre - size * (0.5 * _ARROW * travel + beside)
            shape: dict[str, Any] = {"shaft_radius": 0.015, "tip_radius": 0.05, "tip_length": 0.2}
            arrow = pyvista.Arrow(start=start, direction=travel, scale=_ARROW * size, **shape)
            plotter.add_mesh(arrow, name=f"arrow {face.number}", color=palette.BLACK, **_FLAT)


def _near(face: Face, grid: pyvista.UnstructuredGrid, size: float) -> list[Floats]:
    """Return the lines of a counterface; a curved one in 2D as far as the body reaches, within a size [mm]."""
    if face.is_flat or face.surface.shape[1] > 1:
        return face.outline
    along = np.array([face.normal[1], -face.normal[0], 0.0])
    return [line[np.abs((1e3 * line - grid.center) @ along) <= 0.5 * size] for line in face.outline]


def contact_levels(history: xr.Dataset, patch: ContactPatch, step: int) -> tuple[Floats, Floats]:
    """Return how far each node (n,) of a patch is within the contact, and within its stick zone [-].

    Both are positive within and negative outside, so that their zero is a smooth edge: pressure against gap, and what
    the tractions' ratio lacks to the limit against the speed of slip, each as a share of its median along the edge.
    Between what sticks and what is open the stick zone goes at least as far as the contact: nothing slips there.
    """
    state = history["contact_state"].values[step, patch.nodes]
    pressure, gap = (history[name].values[step, patch.nodes] for name in ("normal_traction", "gap"))
    plate = history["counterface_velocity"].values[step, history["contact_counterface"].values[patch.nodes]]
    speed = np.linalg.norm((history["contact_velocity"].values[step, patch.nodes] - plate) @ patch.axes.T, axis=1)
    tangential = np.linalg.norm(history["tangential_traction"].values[step, patch.nodes], axis=1)
    friction = history["counterface_friction_coefficient"].values[history["contact_counterface"].values[patch.nodes]]
    left = 1.0 - tangential / np.maximum(friction * pressure, np.finfo(float).tiny)
    touch = _level(state != OPEN, pressure, gap, patch.triangles)
    stick = _level(state == STICK, left, speed, patch.triangles)
    share = np.full(state.size, np.inf)
    for nodes, others in itertools.permutations(patch.triangles.T, 2):
        np.minimum.at(share, nodes, np.where(state[others] == STICK, stick[others] / touch[others], np.inf))
    return touch, np.where(state == OPEN, touch * np.where(np.isfinite(share), share, 1.0), stick)


def _level(inside: NDArray[np.bool_], rise: Floats, fall: Floats, triangles: NDArray[np.int64]) -> Floats:
    """Return values (n,) above zero inside and below it outside, one at the median along the edge [-]."""
    corners = inside[triangles]
    edge = np.isin(np.arange(inside.size), triangles[corners.any(axis=1) & ~corners.all(axis=1)])
    level = np.where(inside, rise, fall)
    for side in (inside, ~inside):
        members = level[side & edge]
        along_edge = float(np.median(members)) if members.size else 0.0
        level[side] = np.maximum(level[side] / (along_edge or 1.0), _LEAST_LEVEL)
    return np.where(inside, level, -level)


def _draw_contact(plotter: Any, history: xr.Dataset, time: float) -> None:
    """Draw what touches in the colours of stick and slip: in 3D the skin of the contact, in 2D its nodes."""
    step = nearest_record(history, time)
    points = 1e3 * in_space(history["contact_position"].values + history["contact_displacement"].values[step])
    patch = contact_patch(history) if is_solid(history) else None
    for state in (STICK, SLIP):
        plotter.remove_actor(f"contact {state}", render=False)
        look = {"name": f"contact {state}", "color": palette.STATE_COLOURS[state], **_FLAT}
        if patch is None:
            members = np.flatnonzero(history["contact_state"].values[step] == state)
            if members.size:
                plotter.add_points(points[members], point_size=9.0, render_points_as_spheres=True, **look)
            continue
        # A little outside, so that the skin does not cover it.
        outside = points[patch.nodes] - _OUTSIDE * history["counterface_normal"].values[0]
        triangles: Any = patch.triangles
        skin = pyvista.PolyData.from_regular_faces(outside, triangles)
        skin["touch"], skin["stick"] = contact_levels(history, patch, step)
        zone = skin.clip_scalar(scalars="touch", value=0.0, invert=False)
        zone = zone.clip_scalar(scalars="stick", value=0.0, invert=state == SLIP)
        if zone.n_cells:
            plotter.add_mesh(zone, scalars=None, **look)


def _draw_sites(plotter: Any, history: xr.Dataset, time: float) -> None:
    kinds = site_kinds(history)
    if kinds.size == 0:
        return
    displacements = history["displacement"].values[nearest_record(history, time)]
    points = 1e3 * in_space(history["site_position"].values + displacements)
    look: dict[str, Any] = {"point_size": 7.0, "render_points_as_spheres": True, "reset_camera": False}
    for kind in np.unique(kinds):
        colour = palette.RECEPTOR_COLOURS.get(str(kind), palette.BLACK)
        plotter.add_points(points[kinds == kind], name=f"sites {kind}", color=colour, **look)
