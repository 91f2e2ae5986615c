"""What the page needs to show a run in motion: the deformed body, the slip map and the signals, at many times.

A solid is shown by the surfaces of its layers, and by the section where a plane cuts it open, as triangles that move.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_hex
from numpy.typing import NDArray

from fingerslip.arrays import Floats, Integers
from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.history import is_solid, nearest_record, sites_of_kinds
from fingerslip.libraries import pyvista, xr
from fingerslip.report import colours as palette
from fingerslip.report.figures.bodies import extent
from fingerslip.report.figures.patches import HAS_SLIPPED, slipped_share
from fingerslip.report.figures.signals import PRESSED, SLIPS
from fingerslip.report.figures.time_axis import event_times
from fingerslip.report.labels import of_histories
from fingerslip.report.scene import scene
from fingerslip.report.scene.options import SCALARS, SceneOptions
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.slip import Events, contact_forces, receptor_signals, slide_tangent, slide_window, slipping_fraction
from fingerslip.slip.windows import EVENTS, travel_direction
from fingerslip.snapshot import CELL_TYPES, faces_at

Arrays = dict[str, NDArray[Any]]

# Data of runs in motion on a page; the first run is shown in any case.
_MOST_BYTES = 10_000_000
# Times of the slip map and the slider; frames of the body in 2D and in 3D.
_MOMENTS, _FRAMES, _SOLID_FRAMES = 300, 31, 16
# Share of the frames that show what comes before the slide.
_BEFORE = 0.25
# Half the side of a plate over the largest extent of a solid.
_HALF_SQUARE = 0.55
# Types that a browser has arrays of, by their names in NumPy.
_TYPES = ("u1", "i2", "u2", "u4", "f4")


def language() -> dict[str, Any]:
    """Return the colours that the script of the page draws with."""
    return {
        "states": [palette.STATE_COLOURS[state] for state in sorted(palette.STATE_COLOURS)],
        "stateNames": [palette.STATE_NAMES[state] for state in sorted(palette.STATE_COLOURS)],
        "map": [to_hex(colormaps[palette.FIELD_MAP](share)) for share in np.linspace(0.0, 1.0, 33)],
        "grey": palette.GREY,
        "black": palette.BLACK,
    }


def run_motions(runs: Iterable[tuple[xr.Dataset, Events, str]]) -> tuple[dict[str, Any], ...]:
    """Return runs in motion, the first and as many more as keep the page small; their colours have one scale."""
    motions: list[dict[str, Any]] = []
    size, touched = 0, [run for run in runs if run[0].sizes.get("counterface", 0)]
    with scene.one_scale(history for history, *_ in touched if not is_solid(history)):
        for history, events, title in touched:
            motion = run_motion(history, events, title)
            size += len(motion["data"])
            if motions and size > _MOST_BYTES:
                break
            motions.append(motion)
    # Solids have the stress of their surface, whose ends are found as it is made.
    bodies = [motion["body"] for motion in motions if motion["body"]]
    top = max((body["top"] for body in bodies), default=0.0)
    for body in bodies:
        body["top"] = top
    return tuple(motions)


def run_motion(history: xr.Dataset, events: Events, title: str) -> dict[str, Any]:
    """Return a run in motion as plain data."""
    every, window = history["time"].values, slide_window(history)
    even = np.linspace(every[0], every[-1], min(_MOMENTS, every.size))
    records = np.unique(np.abs(every[:, None] - even).argmin(axis=0))
    times = event_times(events.slip)
    frames = _frames(history, times)
    arrays: Arrays = {"times": every[records].astype(np.float32)}
    if not is_solid(history):
        states, tangent = history["contact_state"].values[records], slide_tangent(history)
        touched = np.flatnonzero((states != OPEN).any(axis=0))
        along = 1e3 * history["contact_position"].values[touched] @ tangent
        order = np.argsort(along)
        arrays |= {"along": along[order].astype(np.float32), "states": states[:, touched[order]].astype(np.uint8)}
    body: dict[str, Any] | None = None
    if frames:
        body, more = (_solid_body if is_solid(history) else _plane_body)(history, frames)
        arrays |= more
    return {
        "title": title,
        "solid": is_solid(history),
        "mapLabel": of_histories("stick and slip along plate [mm]", [history]),
        "slide": None if window is None else window.start,
        "events": [
            {"name": EVENTS[name], "time": time, "colour": palette.EVENT_COLOURS[name], "dash": dashes}
            for name, time in times.items()
            for dashes in [list(palette.EVENT_DASHES[name])]
        ],
        "panels": _panels(history, records, arrays),
        "body": body,
        **pack_arrays(arrays),
    }


def _frames(history: xr.Dataset, events: Mapping[str, float]) -> list[int]:
    """Return the numbers of the snapshots that are shown: those of events, and more of the slide than before it."""
    times = history["snapshot_time"].values if "snapshot_time" in history.coords else np.empty(0)
    most = _SOLID_FRAMES if is_solid(history) else _FRAMES
    if times.size <= most:
        return list(range(times.size))
    window = slide_window(history)
    start = window.start if window else float(times[0])
    before = int(_BEFORE * most) if start > times[0] else 0
    wanted = [*np.linspace(times[0], start, before, endpoint=False), *np.linspace(start, times[-1], most - before)]
    return sorted({int(np.abs(times - moment).argmin()) for moment in (*wanted, *events.values())})


# How lines differ from others of their colour, as in figures [px].
_WIDTHS: Mapping[str, float] = {HAS_SLIPPED: 2.6, SLIPS: 0.9}
_DASHES: Mapping[str, Sequence[float]] = {"tangential": [6, 3]}


def _panels(history: xr.Dataset, records: NDArray[np.intp], arrays: Arrays) -> list[dict[str, Any]]:
    """Return the panels of signals; their values are added to the arrays."""
    forces = contact_forces(history)
    signals: dict[str, dict[str, tuple[Floats, str]]] = {
        "force [N]": {"normal": (forces.normal, palette.BLACK), "tangential": (forces.friction, palette.BLACK)},
        "ratio, fraction": {
            "tangential / normal force": (forces.ratio(PRESSED), palette.BLACK),
            HAS_SLIPPED: (slipped_share(history), palette.ORANGE),
            SLIPS: (slipping_fraction(history).values, palette.ORANGE),
        },
    }
    if not is_solid(history) and sites_of_kinds(history, RECEPTOR_KINDS).size:
        density = receptor_signals(history)["strain_energy_density"]
        means = {kind: density.sel(kind=kind).mean("area").values for kind in RECEPTOR_KINDS}
        signals["strain energy density at receptors [J/m³]"] = {
            kind: (mean, palette.RECEPTOR_COLOURS[kind]) for kind, mean in means.items() if np.isfinite(mean).any()
        }
    panels = []
    for number, (label, lines) in enumerate((label, lines) for label, lines in signals.items() if lines):
        entries = []
        for index, (name, (values, colour)) in enumerate(lines.items()):
            arrays[f"signal{number}-{index}"] = values[records].astype(np.float32)
            look = {"width": _WIDTHS.get(name, 1.6), "dash": _DASHES.get(name, [])}
            entries.append({"name": name, "colour": colour, "array": f"signal{number}-{index}", **look})
        panels.append({"label": label, "lines": entries})
    return panels


def _common_body(history: xr.Dataset, frames: Sequence[int], top: float) -> dict[str, Any]:
    """Return what sections and solids share; the colours of their stress end at `top` [kPa]."""
    names = scene.region_names(history)
    colours = palette.region_colours(names)
    low, high = extent(history)
    half_side = 1e-3 * float((high - low).max()) * (_HALF_SQUARE if is_solid(history) else 1.0)
    return {
        "low": low.tolist(),
        "high": high.tolist(),
        "frames": [float(history["snapshot_time"].values[number]) for number in frames],
        "regions": [
            {"name": name, "colour": colours[name], "stiff": number not in scene.soft_regions(history)}
            for number, name in enumerate(names)
        ],
        "field": SCALARS["von_mises"][0],
        # Where the plate goes along its surface; zeros where it does not.
        "slide": travel_direction(history).tolist(),
        "plates": [
            [
                {
                    "centre": (1e3 * face.centre).tolist(),
                    "normal": face.normal.tolist(),
                    "flat": face.is_flat,
                    "lines": [np.round(1e3 * line, 3).tolist() for line in face.outline],
                }
                for face in faces_at(history, number, half_side)
            ]
            for number in frames
        ],
        "top": top,
    }


def _moving_arrays(body: dict[str, Any], points: Floats, displacements: Floats, stress: Floats) -> Arrays:
    """Return the arrays of points (n, dim) [m], their displacements (n_frames, n, dim) [m] and a stress [Pa].

    Their units are added to the body.
    """
    places, body["unit"] = quantise(1e3 * points)
    changes, body["movedUnit"] = quantise(1e3 * displacements)
    body["stressUnit"] = body["top"] / 255.0
    shades = np.clip(255e-3 * stress / body["top"], 0.0, 255.0).astype(np.uint8)
    return {"points": places, "moved": _differences(changes), "stress": _differences(shades)}


def _plane_body(history: xr.Dataset, frames: list[int]) -> tuple[dict[str, Any], Arrays]:
    """Return the section: its corners, how they move, the stress in its cells, contact nodes and receptors."""
    cells = history["cell_nodes"].values[:, : scene.CORNERS[history.attrs["element"]]]
    used, corners = np.unique(cells, return_inverse=True)
    points = history["node_position"].values[used]
    displacements = history["snapshot_displacement"].values[frames][:, used]
    top, stress = scene.field_limits(history, SceneOptions())[1], history["snapshot_von_mises"].values[frames]
    body = _common_body(history, frames, top)
    arrays = _moving_arrays(body, points, displacements, stress)
    contact_node, tangent = history["contact_node"].values, slide_tangent(history)
    corner = np.flatnonzero(np.isin(contact_node, used))
    order = corner[np.argsort(history["contact_position"].values[corner] @ tangent)]
    records = [nearest_record(history, moment) for moment in body["frames"]]
    arrays |= {
        "cells": corners.reshape(cells.shape).astype(np.uint16 if used.size < 65536 else np.uint32),
        "region": history["cell_region"].values.astype(np.uint8),
        "skin": np.searchsorted(used, contact_node)[order].astype(np.uint32),
        "skinStates": history["contact_state"].values[records][:, order].astype(np.uint8),
    }
    body["receptors"] = []
    for kind in RECEPTOR_KINDS:
        positions = history["site_position"].values[sites_of_kinds(history, [kind])]
        if len(positions):
            nodes = np.linalg.norm(points[None] - positions[:, None], axis=2).argmin(axis=1).tolist()
            body["receptors"].append({"kind": kind, "colour": palette.RECEPTOR_COLOURS[kind], "nodes": nodes})
    return body, arrays


def _solid_body(history: xr.Dataset, frames: list[int]) -> tuple[dict[str, Any], Arrays]:
    """Return the surfaces of all layers and the cut through them: how they move, their stress, the contact's states."""
    history = scene.upright(history)
    surface, cut_at = solid_surface(history, frames)
    triangles, layers = triangles_of(surface), surface.cell_data["layer"]
    stress, states = (surface.point_data[name].reshape(-1, len(frames)).T for name in ("stress", "state"))
    displacements = surface.point_data["displacement"].reshape(-1, len(frames), 3).swapaxes(0, 1)
    # Means over cells are smaller than what cells have: the colours are those of what is drawn.
    soft = np.unique(triangles[np.isin(layers, scene.soft_regions(history))])
    top = 1e-3 * float(np.quantile(stress[:, soft], 0.999)) if soft.size else 0.0
    body = _common_body(history, frames, top or 1.0) | {"cutAt": 1e3 * cut_at, "receptors": []}
    return body, _moving_arrays(body, surface.points, displacements, stress) | {
        "vertexState": states,
        "triangles": triangles.astype(np.uint32),
        "triangleRegion": layers,
        "triangleCut": surface.cell_data["is_cut"],
    }


def _differences(frames: NDArray[Any]) -> NDArray[Any]:
    """Return each frame less the one before, which compresses better; whole numbers wrap round."""
    return np.concatenate([frames[:1], np.diff(frames, axis=0)]).astype(frames.dtype)


def quantise(values: Floats) -> tuple[NDArray[np.int16], float]:
    """Return numbers as whole multiples of a unit, and the unit: the largest has 32,000."""
    unit = float(np.abs(values).max(initial=0.0)) / 32000.0 or 1.0
    return np.round(values / unit).astype(np.int16), unit


def pack_arrays(arrays: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    """Return arrays as plain data: their types, shapes and places, and all of their bytes compressed, in base 64."""
    header, chunks, at = {}, [], 0
    for name, array in arrays.items():
        kind = array.dtype.str[1:]
        assert kind in _TYPES, f"{name} has the type {kind}"
        data = np.ascontiguousarray(array, dtype=f"<{kind}").tobytes()
        # Browsers read arrays at multiples of the size of their numbers only.
        chunks.append(data + b"\0" * (-len(data) % 4))
        header[name] = {"type": kind, "shape": list(array.shape), "at": at}
        at += len(chunks[-1])
    return {"arrays": header, "data": base64.b64encode(zlib.compress(b"".join(chunks))).decode("ascii")}


#: State of a vertex that never may touch.
NO_CONTACT = 255
# The ends of the edges on whose middles a quadratic tetrahedron has its fifth to tenth node, in the order of VTK.
_MIDDLES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))


def solid_surface(history: xr.Dataset, frames: list[int]) -> tuple[pyvista.PolyData, float]:
    """Return the triangles of all layers and of the section across z through the middle, and where that stands [m].

    Vertices have `displacement` (n, 3 n_frames) [m], `stress` (n, n_frames), the mean von Mises stress of the layer
    around them [Pa], and the `state` of the contact (n, n_frames); triangles have the number of their `layer`, and
    whether they are in the section, `is_cut`.
    """
    points, states = history["node_position"].values, _nodal_states(history, frames).T
    # A little beside the middle, where the nodes of symmetric meshes lie.
    cut_at = float(points[:, 2].mean() + 1e-5 * np.ptp(points[:, 2]))
    pieces, at = list[Any](), (0.0, 0.0, cut_at)
    element, corners = ("H8", 8) if history.attrs["element"] == "H8" else ("T4", 4)
    grid = scene.vtk_grid(history["cell_nodes"].values[:, :corners], CELL_TYPES[element], points)
    grid.point_data["displacement"] = np.concatenate(list(history["snapshot_displacement"].values[frames]), axis=1)
    grid.point_data["node"] = np.arange(grid.n_points)
    grid.cell_data["stress"] = history["snapshot_von_mises"].values[frames].T
    for number in range(max(len(scene.region_names(history)), 1)):
        layer: Any = grid.extract_cells(history["cell_region"].values == number)
        if not layer.n_cells:
            continue
        layer = layer.cell_data_to_point_data()  # means of the layer around its nodes
        outside = layer.extract_surface(algorithm="geometry", pass_pointid=False, pass_cellid=False).triangulate()
        section = layer.slice(normal="z", origin=at, generate_triangles=True)
        for is_cut, piece in enumerate((outside, section)[: 1 + bool(section.n_cells)]):
            contact = np.full((piece.n_points, len(frames)), NO_CONTACT) if is_cut else states[piece.point_data["node"]]
            piece.point_data["state"] = contact.astype(np.uint8)
            piece.cell_data["layer"] = np.full(piece.n_cells, number, dtype=np.uint8)
            piece.cell_data["is_cut"] = np.full(piece.n_cells, is_cut, dtype=np.uint8)
            pieces.append(piece)
    return pieces[0].append_polydata(*pieces[1:]), cut_at


def triangles_of(surface: pyvista.PolyData) -> Integers:
    """Return the corners of triangles (m, 3); those of a cut all face one way, as the normals of vertices are sums."""
    corners: Integers = surface.regular_faces.astype(np.int64)
    first, second, third = (surface.points[corners[:, corner]] for corner in range(3))
    backward = (surface.cell_data["is_cut"] > 0) & (np.cross(second - first, third - first)[:, 2] < 0.0)
    corners[backward] = corners[backward][:, ::-1]
    return corners


def _nodal_states(history: xr.Dataset, frames: list[int]) -> NDArray[np.uint8]:
    """Return the states of the contact at all nodes (n_frames, n_nodes)."""
    records = [nearest_record(history, float(time)) for time in history["snapshot_time"].values[frames]]
    states = np.full((len(frames), history.sizes["node"]), NO_CONTACT, dtype=np.uint8)
    states[:, history["contact_node"].values] = history["contact_state"].values[records]
    if history.attrs["element"] == "T10":
        # Quadratic tetrahedra touch with the middles of edges: corners get the state of most candidates around them.
        cells, order = history["cell_nodes"].values, (SLIP, STICK, OPEN)  # the first of equally many
        ends = [cells[:, [end, 4 + middle]] for middle, both in enumerate(_MIDDLES) for end in both]
        corners, middles = np.unique(np.concatenate(ends), axis=0).T
        counts = np.array([[np.bincount(corners, of[middles] == state, len(of)) for of in states] for state in order])
        beside = (states == NO_CONTACT) & counts.any(axis=0)
        states[beside] = np.array(order, dtype=np.uint8)[counts.argmax(axis=0)[beside]]
    return states
