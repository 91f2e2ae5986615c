"""The scene of a snapshot: the deformed layers coloured by a field, the plate, the recorded sites, a cut."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.contact.states import SLIP, STICK
from fingerslip.errors import InputError, ResultError
from fingerslip.history import is_solid, nearest_record, site_kinds
from fingerslip.report.colours import BLACK, FIELD_MAP, RECEPTOR_COLOURS, STATE_COLOURS, region_colours
from fingerslip.report.scene.names import Camera
from fingerslip.report.scene.options import SCALARS, SceneOptions
from fingerslip.slip.patch import contact_patch, triangle_states
from fingerslip.slip.windows import split_along
from fingerslip.snapshot import FlatFace, flat_faces, in_space, read_snapshot

if TYPE_CHECKING:
    import pyvista
    import xarray as xr

Floats = NDArray[np.float64]

COLOUR_MAP = FIELD_MAP
#: Nodes of a cell of a section that are its corners.
CORNERS = {"Q4": 4, "T3": 3, "T6": 3}
_BAR = {"width": 0.5, "height": 0.1, "position_x": 0.25, "position_y": 0.03}
_BAR_FONTS = {"title_font_size": 18, "label_font_size": 16}
_DIRECTIONS: Mapping[Camera, tuple[tuple[float, float, float], tuple[float, float, float]]] = {
    "side": ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0)),
    "front": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    "below": ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0)),
    "oblique": ((0.8, -0.45, 0.9), (0.0, 1.0, 0.0)),
}
# Of the largest extent of the body: the side of a plate's outline; of that side the length of its arrow.
_PLATE, _ARROW = 1.1, 0.3
# How far outside of the skin the states of its contact are drawn [mm].
_OUTSIDE = 0.05
# Motions along the surface that are rounding [m].
_STILL = 1e-9
# What VTK fits is the box around everything, which leaves wide margins.
_ZOOM = 1.35
# Width over height of windows in which it fits.
_WIDE = 4 / 3
# Without light, and without moving the camera.
_FLAT = {"reset_camera": False, "lighting": False}


def region_names(history: xr.Dataset) -> tuple[str, ...]:
    """Return the names of the regions of the mesh."""
    names = str(history.attrs.get("regions", ""))
    return tuple(names.split(", ")) if names else ()


def soft_regions(history: xr.Dataset, hidden: Sequence[str] = ()) -> list[int]:
    """Return the numbers of the regions whose stress sets the colours: all but the phalanx, or it where it is alone."""
    visible = [name for name in region_names(history) if name not in hidden]
    soft = [name for name in visible if name != "phalanx"] or visible
    return [number for number, name in enumerate(region_names(history)) if name in soft]


def check_options(history: xr.Dataset, options: SceneOptions) -> None:
    """Check that a history can be shown with these options."""
    if history.sizes.get("snapshot_time", 0) == 0:
        raise ResultError(
            "the result has no snapshots of the whole mesh; write record: {snapshots_every: 50 ms} and run again"
        )
    names = region_names(history)
    for name in options.hidden:
        if name not in names:
            raise InputError("hidden", f"has '{name}', which is no region", f"may hold {', '.join(names)}")


def snapshot_grid(history: xr.Dataset, number: int) -> pyvista.UnstructuredGrid:
    """Return the deformed mesh of a snapshot [mm] with its fields in the units of :data:`SCALARS`."""
    # Slow to import; most figures need only the names and limits of this module.
    import pyvista

    snapshot = read_snapshot(history, number)
    points = 1e3 * (snapshot.points + snapshot.point_fields["displacement"])
    grid = pyvista.UnstructuredGrid({snapshot.cell_type: snapshot.cells}, points)
    for name, vectors in snapshot.point_fields.items():
        grid.point_data[name] = SCALARS[name][1] * np.linalg.norm(vectors, axis=1)
    for name, values in snapshot.cell_fields.items():
        grid.cell_data[name] = values if name == "region" else SCALARS[name][1] * values
    return grid


def draw_scene(plotter: Any, history: xr.Dataset, number: int, options: SceneOptions) -> dict[str, Any]:
    """Draw a snapshot, and return what its layers are drawn as."""
    grid, limits, actors = snapshot_grid(history, number), field_limits(history, options), {}
    for region, name in enumerate(region_names(history)):
        layer: Any = grid.extract_cells(np.asarray(grid.cell_data["region"]) == region)
        if name not in options.hidden and layer.n_cells:
            if options.cut != "none" and is_solid(history):
                layer = layer.clip(normal=options.cut, origin=grid.center, invert=True)
            actors[name] = plotter.add_mesh(layer, name=f"layer {name}", **_look(name, history, options, limits))
    time = float(history["snapshot_time"][number])
    if options.plate:
        _draw_plates(plotter, history, number, grid)
    if options.receptors:
        _draw_sites(plotter, history, time)
    if options.contact:
        _draw_contact(plotter, history, time)
    if options.written:
        plotter.add_text(f"t = {time:.3f} s", name="time", font_size=10, color=BLACK)
    return actors


def aim(plotter: Any, history: xr.Dataset, options: SceneOptions) -> None:
    """Point the camera at the whole scene."""
    plotter.view_vector(*_DIRECTIONS[options.camera if is_solid(history) else "side"])
    plotter.reset_camera()
    width, height = plotter.window_size
    plotter.camera.zoom(_ZOOM * min(1.0, width / (_WIDE * height)))


def _look(name: str, history: xr.Dataset, options: SceneOptions, limits: tuple[float, float]) -> dict[str, Any]:
    """Return how a layer is coloured."""
    shared: dict[str, Any] = {"show_edges": options.edges, "reset_camera": False}
    if options.scalar == "region":
        # Mostly ambient light, so that the layers have the colours of a legend.
        return {**shared, "color": region_colours(region_names(history))[name], "ambient": 0.7, "diffuse": 0.3}
    bar = {"title": SCALARS[options.scalar][0], "color": BLACK, "fmt": "%.3g", "n_labels": 4, **_BAR, **_BAR_FONTS}
    look = {**shared, "scalars": options.scalar, "clim": limits, "cmap": COLOUR_MAP, "ambient": 0.4, "diffuse": 0.65}
    return look | ({"scalar_bar_args": bar} if options.written else {"show_scalar_bar": False})


def field_limits(history: xr.Dataset, options: SceneOptions) -> tuple[float, float]:
    """Return the range of colours, the same for all snapshots.

    The range leaves out the largest thousandth of the values. The phalanx does not count where anything else is shown:
    its stresses are so large that the soft layers would have one colour.
    """
    if options.scalar == "region":
        return 0.0, 1.0
    values = history[f"snapshot_{options.scalar}"].values
    if options.scalar in {"displacement", "velocity"}:
        values = np.linalg.norm(values, axis=-1)
    else:
        counted = np.isin(history["cell_region"].values, soft_regions(history, options.hidden))
        values = values[:, counted] if counted.any() else values
    top = SCALARS[options.scalar][1] * float(np.quantile(values, 0.999))
    return 0.0, top if top > 0.0 else 1.0


def _draw_plates(plotter: Any, history: xr.Dataset, number: int, grid: pyvista.UnstructuredGrid) -> None:
    """Draw the flat counterfaces as outlines, each with an arrow along its motion."""
    import pyvista

    size = _PLATE * float(np.max(np.ptp(grid.points, axis=0)))
    for face in flat_faces(history, number):
        outline = _outline(face, size, is_solid(history))
        plotter.add_mesh(outline, name=f"plate {face.number}", color=BLACK, line_width=2.0, **_FLAT)
        _, along = split_along(
            history["counterface_displacement"].values[:, face.number],
            history["counterface_normal"].values[face.number],
        )
        furthest = along[np.linalg.norm(along, axis=1).argmax()]
        length = float(np.linalg.norm(furthest))
        if length > _STILL:
            travel = in_space(furthest[None] / length)[0]
            beside = 0.42 * np.cross(face.normal, travel) if is_solid(history) else 0.06 * face.normal
            start = 1e3 * face.centre - size * (0.5 * _ARROW * travel + beside)
            shape: dict[str, Any] = {"shaft_radius": 0.015, "tip_radius": 0.05, "tip_length": 0.2}
            arrow = pyvista.Arrow(start=start, direction=travel, scale=_ARROW * size, **shape)
            plotter.add_mesh(arrow, name=f"arrow {face.number}", color=BLACK, **_FLAT)


def _outline(face: FlatFace, size: float, solid: bool) -> pyvista.PolyData:
    """Return the outline of a flat counterface with sides of a length [mm], in 2D a line."""
    import pyvista

    centre = 1e3 * face.centre
    if not solid:
        along = 0.5 * size * np.array([face.normal[1], -face.normal[0], 0.0])
        return pyvista.Line(centre - along, centre + along)
    plane = pyvista.Plane(center=centre, direction=face.normal, i_size=size, j_size=size)
    return plane.extract_feature_edges(boundary_edges=True)


def _draw_contact(plotter: Any, history: xr.Dataset, time: float) -> None:
    """Draw what touches in the colours of stick and slip: in 3D the skin of the contact, in 2D its nodes."""
    import pyvista

    step = nearest_record(history, time)
    points = 1e3 * in_space(history["contact_position"].values + history["contact_displacement"].values[step])
    patch = contact_patch(history) if is_solid(history) else None
    states = history["contact_state"].values[step] if patch is None else triangle_states(history, patch, step)
    for state in (STICK, SLIP):
        plotter.remove_actor(f"contact {state}", render=False)
        members = np.flatnonzero(states == state)
        look = {"name": f"contact {state}", "color": STATE_COLOURS[state], **_FLAT}
        if members.size and patch is None:
            plotter.add_points(points[members], point_size=9.0, render_points_as_spheres=True, **look)
        elif members.size and patch is not None:
            # A little outside, so that the skin does not cover it.
            outside = points[patch.nodes] - _OUTSIDE * history["counterface_normal"].values[0]
            faces: Any = patch.triangles[members]
            plotter.add_mesh(pyvista.PolyData.from_regular_faces(outside, faces), **look)


def _draw_sites(plotter: Any, history: xr.Dataset, time: float) -> None:
    kinds = site_kinds(history)
    if kinds.size == 0:
        return
    displacements = history["displacement"].values[nearest_record(history, time)]
    points = 1e3 * in_space(history["site_position"].values + displacements)
    look: dict[str, Any] = {"point_size": 7.0, "render_points_as_spheres": True, "reset_camera": False}
    for kind in np.unique(kinds):
        colour = RECEPTOR_COLOURS.get(str(kind), BLACK)
        plotter.add_points(points[kinds == kind], name=f"sites {kind}", color=colour, **look)
