"""What the page needs to show a run in motion: the deformed section, the slip map and the signals, at many times."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import to_hex
from numpy.typing import NDArray

from fingerslip.contact.states import OPEN
from fingerslip.history import is_solid, nearest_record, sites_of_kinds
from fingerslip.report.colours import (
    BLACK,
    BLUE,
    EVENT_COLOURS,
    EVENT_DASHES,
    FIELD_MAP,
    GREY,
    ORANGE,
    RECEPTOR_COLOURS,
    STATE_COLOURS,
    STATE_NAMES,
    VERMILLION,
    region_colours,
)
from fingerslip.report.page.packing import pack_arrays, quantise
from fingerslip.report.page.surface import surface_arrays
from fingerslip.report.scene.options import SceneOptions
from fingerslip.report.scene.scene import field_limits, region_names, soft_regions
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.slip import Events, contact_forces, receptor_signals, slide_tangent, slide_window, slipping_fraction
from fingerslip.slip.windows import EVENTS
from fingerslip.snapshot import flat_faces

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["language", "run_motion", "run_motions"]

Floats = NDArray[np.float64]

# Data of runs in motion on a page; the first run is shown in any case.
_MOST_BYTES = 10_000_000
# Times of the slip map and the slider; frames of the body in 2D and in 3D.
_MOMENTS, _FRAMES, _SOLID_FRAMES = 300, 31, 16
_PRESSED = 0.02
# Share of the frames that show what comes before the slide.
_BEFORE = 0.25


def language() -> dict[str, Any]:
    """Return the colours that the script of the page draws with."""
    return {
        "states": [STATE_COLOURS[state] for state in sorted(STATE_COLOURS)],
        "stateNames": [STATE_NAMES[state] for state in sorted(STATE_COLOURS)],
        "map": [to_hex(colormaps[FIELD_MAP](share)) for share in np.linspace(0.0, 1.0, 33)],
        "grey": GREY,
        "black": BLACK,
    }


def run_motion(history: xr.Dataset, events: Events, title: str) -> dict[str, Any]:
    """Return a run in motion as plain data."""
    records = _records(history)
    times = history["time"].values[records]
    frames = _frames(history, events)
    arrays = {"times": times.astype(np.float32), **_map_arrays(history, records)}
    body: dict[str, Any] | None = None
    if frames:
        body, more = _solid_body(history, frames) if is_solid(history) else _plane_body(history, frames)
        arrays |= more
    window = slide_window(history)
    return {
        "title": title,
        "solid": is_solid(history),
        "slide": None if window is None else window.start,
        "events": _events(events),
        "panels": _panels(history, records, arrays),
        "body": body,
        "friction": float(history["counterface_friction_coefficient"].values[0]),
        **pack_arrays(arrays),
    }


def run_motions(shown: Iterable[tuple[xr.Dataset, Events, str]]) -> tuple[dict[str, Any], ...]:
    """Return runs in motion, the first and as many more as keep the page small."""
    motions: list[dict[str, Any]] = []
    size = 0
    for history, events, title in shown:
        if not history.sizes.get("counterface", 0):
            continue
        motion = run_motion(history, events, title)
        size += len(motion["data"])
        if motions and size > _MOST_BYTES:
            break
        motions.append(motion)
    return tuple(motions)


def _records(history: xr.Dataset) -> NDArray[np.intp]:
    """Return the numbers of the records that are shown, even in time."""
    times = history["time"].values
    wanted = np.linspace(times[0], times[-1], min(_MOMENTS, times.size))
    return np.unique(np.abs(times[:, None] - wanted).argmin(axis=0))


def _frames(history: xr.Dataset, events: Events) -> list[int]:
    """Return the numbers of the snapshots that are shown: those of events, and more of the slide than before it."""
    times = history["snapshot_time"].values if "snapshot_time" in history.coords else np.empty(0)
    most = _SOLID_FRAMES if is_solid(history) else _FRAMES
    if times.size <= most:
        return list(range(times.size))
    window = slide_window(history)
    start = window.start if window else float(times[0])
    before = int(_BEFORE * most) if start > times[0] else 0
    wanted = [*np.linspace(times[0], start, before, endpoint=False), *np.linspace(start, times[-1], most - before)]
    wanted += [time for name in EVENTS if (time := events.slip.time(name)) is not None]
    return sorted({int(np.abs(times - moment).argmin()) for moment in wanted})


def _events(events: Events) -> list[dict[str, Any]]:
    return [
        {"name": EVENTS[name], "time": time, "colour": EVENT_COLOURS[name], "dash": list(EVENT_DASHES[name])}
        for name in EVENTS
        if (time := events.slip.time(name)) is not None
    ]


def _map_arrays(history: xr.Dataset, records: NDArray[np.intp]) -> dict[str, NDArray[Any]]:
    """Return the contact's states at the shown times, along the plate in 2D, and where in 3D."""
    states = history["contact_state"].values[records]
    touched = np.flatnonzero((states != OPEN).any(axis=0))
    tangent = slide_tangent(history)
    along = 1e3 * history["contact_position"].values[touched] @ tangent
    if not is_solid(history):
        order = np.argsort(along)
        return {"along": along[order].astype(np.float32), "states": states[:, touched[order]].astype(np.uint8)}
    normal = history["counterface_normal"].values[0]
    across = 1e3 * history["contact_position"].values[touched] @ np.cross(normal, tangent)
    where = {"along": along.astype(np.float32), "across": across.astype(np.float32)}
    return {**where, "states": states[:, touched].astype(np.uint8)}


def _panels(history: xr.Dataset, records: NDArray[np.intp], arrays: dict[str, NDArray[Any]]) -> list[dict[str, Any]]:
    """Return the panels of signals; their values are added to the arrays."""
    forces = contact_forces(history)
    panels = [
        _panel("force [N]", {"normal": (forces.normal, BLUE), "tangential": (forces.friction, VERMILLION)}),
        _panel(
            "ratio, fraction",
            {
                "tangential / normal force": (forces.ratio(_PRESSED), BLUE),
                "slipping area fraction": (slipping_fraction(history).values, ORANGE),
            },
        ),
    ]
    if not is_solid(history) and sites_of_kinds(history, RECEPTOR_KINDS).size:
        density = receptor_signals(history)["strain_energy_density"]
        means = {kind: density.sel(kind=kind).mean("area").values for kind in RECEPTOR_KINDS}
        lines = {kind: (one, RECEPTOR_COLOURS[kind]) for kind, one in means.items() if np.isfinite(one).any()}
        panels.append(_panel("strain energy density at receptors [J/m³]", lines))
    for number, panel in enumerate(panels):
        for index, line in enumerate(panel["lines"]):
            line["array"] = f"signal{number}-{index}"
            arrays[line["array"]] = line.pop("values")[records].astype(np.float32)
    return [panel for panel in panels if panel["lines"]]


def _panel(label: str, lines: Mapping[str, tuple[Floats, str]]) -> dict[str, Any]:
    return {
        "label": label,
        "lines": [{"name": name, "values": values, "colour": colour} for name, (values, colour) in lines.items()],
    }


def _common_body(history: xr.Dataset, frames: Sequence[int]) -> dict[str, Any]:
    names = region_names(history)
    colours = region_colours(names)
    return {
        "frames": [float(history["snapshot_time"].values[number]) for number in frames],
        "regions": [{"name": name, "colour": colours[name]} for name in names],
        "field": f"von Mises stress [kPa]{', the phalanx may exceed it' if {*names} > {'phalanx'} else ''}",
        "slide": slide_tangent(history).tolist(),
        "travels": _travels(history),
        "plates": [
            [
                {"centre": (1e3 * face.centre).tolist(), "normal": face.normal.tolist()}
                for face in flat_faces(history, n)
            ]
            for n in frames
        ],
    }


def _travels(history: xr.Dataset) -> float:
    """Return how the plate moves along the tangent: 1, -1, or 0 where it does not."""
    moved = history["counterface_displacement"].values[:, 0] @ slide_tangent(history)
    return float(np.sign(np.round(moved[np.abs(moved).argmax()], 9)))


def _plane_body(history: xr.Dataset, frames: Sequence[int]) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Return the section: its corners, how they move, the stress in its cells, contact nodes and receptors."""
    body = _common_body(history, frames) | {"top": field_limits(history, SceneOptions())[1]}
    cells = history["cell_nodes"].values[:, : _corners(history)]
    used, corners = np.unique(cells, return_inverse=True)
    points, unit = quantise(1e3 * history["node_position"].values[used])
    moved, moved_unit = quantise(1e3 * history["snapshot_displacement"].values[list(frames)][:, used])
    stress = 1e-3 * history["snapshot_von_mises"].values[list(frames)]
    arrays: dict[str, NDArray[Any]] = {
        "points": points,
        "cells": corners.reshape(cells.shape).astype(np.uint16 if used.size < 65536 else np.uint32),
        "region": history["cell_region"].values.astype(np.uint8),
        "moved": _differences(moved),
        "stress": _differences(np.clip(255.0 * stress / body["top"], 0.0, 255.0).astype(np.uint8)),
    }
    node, place = np.searchsorted(used, history["contact_node"].values), history["contact_node"].values
    kept = np.isin(place, used)
    order = np.flatnonzero(kept)[np.argsort(history["contact_position"].values[kept] @ slide_tangent(history))]
    at_frames = [nearest_record(history, moment) for moment in body["frames"]]
    arrays["skin"] = node[order].astype(np.uint32)
    arrays["skinStates"] = history["contact_state"].values[at_frames][:, order].astype(np.uint8)
    body |= {"unit": unit, "movedUnit": moved_unit, "receptors": _receptors(history, used)}
    return body, arrays


def _corners(history: xr.Dataset) -> int:
    return {"Q4": 4, "T3": 3, "T6": 3}[history.attrs["element"]]


def _differences(frames: NDArray[Any]) -> NDArray[Any]:
    """Return each frame less the one before, which compresses better; whole numbers wrap round."""
    return np.concatenate([frames[:1], np.diff(frames, axis=0)]).astype(frames.dtype)


def _receptors(history: xr.Dataset, used: NDArray[Any]) -> list[dict[str, Any]]:
    """Return the nodes of the recorded receptors by type."""
    found = []
    for kind in RECEPTOR_KINDS:
        rows = sites_of_kinds(history, [kind])
        if rows.size:
            positions = history["site_position"].values[rows]
            distance = np.linalg.norm(history["node_position"].values[used][None] - positions[:, None], axis=2)
            found.append({"kind": kind, "colour": RECEPTOR_COLOURS[kind], "nodes": distance.argmin(axis=1).tolist()})
    return found


def _solid_body(history: xr.Dataset, frames: Sequence[int]) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Return the surfaces of all layers and the cut through them: how they move, their stress, the contact's states."""
    surface = surface_arrays(history, frames)
    # Means over cells are smaller than what cells have: the colours are those of what is drawn.
    soft = np.unique(surface.triangles[np.isin(surface.regions, soft_regions(history))])
    top = 1e-3 * float(np.quantile(surface.stress[:, soft], 0.999)) if soft.size else 0.0
    body = _common_body(history, frames) | {"top": top or 1.0}
    points, unit = quantise(1e3 * surface.points)
    moved, moved_unit = quantise(1e3 * surface.moved)
    stress = np.clip(255e-3 * surface.stress / body["top"], 0.0, 255.0).astype(np.uint8)
    arrays: dict[str, NDArray[Any]] = {
        "points": points,
        "moved": _differences(moved),
        "stress": _differences(stress),
        "vertexState": surface.states,
        "triangles": surface.triangles.astype(np.uint32),
        "triangleRegion": surface.regions.astype(np.uint8),
        "triangleCut": surface.is_cut.astype(np.uint8),
    }
    body |= {"unit": unit, "movedUnit": moved_unit, "cutAt": 1e3 * surface.cut_at, "receptors": []}
    return body, arrays
