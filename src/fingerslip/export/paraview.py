"""A history as files for ParaView: the body with its contact, counterfaces, sites, and a script that shows them."""

from __future__ import annotations

import dataclasses
import zlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fingerslip.arrays import Floats
from fingerslip.errors import ResultError
from fingerslip.history import full_tensors, is_solid, nearest_record, site_kinds
from fingerslip.mesh.mixed import vtk_cells
from fingerslip.sites import RECEPTOR_KINDS
from fingerslip.snapshot import Snapshot, faces_at, in_space, read_snapshot
from fingerslip.storage.files import csv_text, write_text

_HEADER = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n'
_FOOTER = "  </Collection>\n</VTKFile>\n"
_GRID = """<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64"
    compressor="vtkZLibDataCompressor">
<UnstructuredGrid>
"""
#: Names of the contact's fields on the points of the body, and of what a history has.
_CONTACT = {
    "contact_pressure": "normal_traction",
    "friction_traction": "tangential_traction",
    "gap": "gap",
    "slip_distance": "slip_distance",
    "contact_state": "contact_state",
}
# Units of fields, which VTK and ParaView keep beside an array.
_UNITS = {
    **dict.fromkeys(("points", "displacement", "gap", "slip_distance"), "m"),
    **dict.fromkeys(("contact_pressure", "friction_traction", "von_mises", "stress"), "Pa"),
    "velocity": "m/s",
    "strain_energy_density": "J/m^3",
}
_VERTEX, _LINE, _QUAD = 1, 3, 9  # kinds of cells in VTK
_WORTH_IT = 0.4  # compressed size over the size of an array, below which the next ones are compressed, too
_HALF_SIDE = 0.6  # of a plane that is drawn, over the largest extent of the body


def cell_tensors(history: xr.Dataset, number: int) -> dict[str, Floats]:
    """Return the recorded stress [Pa] and strain [-] of all cells in a snapshot, (n_cells, 3, 3) each."""
    names = [name for name in ("stress", "strain") if f"snapshot_{name}" in history]
    return {name: full_tensors(history[f"snapshot_{name}"][number].astype(np.float64)) for name in names}


def write_paraview(history: xr.Dataset, folder: Path) -> None:
    """Write every snapshot as files for ParaView.

    ``body.pvd`` has the body: on its points `displacement` and `velocity` with three components, and on those that may
    touch `contact_pressure`, `friction_traction`, `gap`, `slip_distance` and `contact_state` (0 open, 1 stick, 2 slip;
    elsewhere no number); on its cells strain energy density, von Mises stress, the tensors `stress` [Pa] and `strain`
    [-] at their centres (:func:`~fingerslip.export.paraview.cell_tensors`), and the number of the region, whose names
    are in ``regions.csv``. ``counterfaces.pvd`` has the counterfaces, ``sites.pvd`` the recorded sites with the
    number of their kind. ``show.py``, loaded by File > Load State, shows all of them. Lengths are in metres, points are
    reference positions, and the script warps them by `displacement`.
    """
    if not history.sizes.get("snapshot_time", 0):
        repair = "write record: {snapshots_every: 50 ms} and run again"
        raise ResultError(f"the result has no snapshots of the whole mesh; {repair}")
    series = {"body": _body, "counterfaces": _faces} | ({"sites": _sites} if history.sizes.get("site", 0) else {})
    for name, snapshot_of in series.items():
        write_series(folder, name, (snapshot_of(history, number) for number in range(history.sizes["snapshot_time"])))
    regions = enumerate(str(history.attrs.get("regions", "")).split(", "))
    write_text(folder / "regions.csv", csv_text([("number", "region"), *regions]))
    write_text(folder / "show.py", _SCRIPT)


def write_series(folder: Path, name: str, snapshots: Iterable[Snapshot]) -> None:
    """Write snapshots as a collection ``names.pvd`` and a numbered file ``name_0000.vtu`` for each that has points.

    Readers of VTK fail on files without points; without any snapshot there is no collection.
    """
    entries, kind, blocks = [], name.removesuffix("s"), _Blocks()
    for number, snapshot in enumerate(snapshots):
        if not len(snapshot.points):
            continue
        file = f"{kind}_{number:04d}.vtu"
        (folder / file).write_bytes(_vtu(snapshot, blocks))
        entries.append(f'    <DataSet timestep="{snapshot.time:.9g}" file="{file}"/>\n')
    if entries:
        write_text(folder / f"{name}.pvd", _HEADER + "".join(entries) + _FOOTER)


class _Blocks:
    """Arrays of a series as its files hold them, each compressed where it changes and as long as that is worth it."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[bytes, int, bytes]] = {}

    def block(self, name: str, values: NDArray[Any]) -> bytes:
        """Return an array as one block of zlib, behind the count of blocks, their sizes, and the compressed size."""
        content = values.astype(values.dtype.newbyteorder("<"), copy=False).tobytes()
        before, level, block = self._last.get(name, (b"", 6, b""))
        if content != before:
            packed = zlib.compress(content, level)
            # Most fields are hardly smaller compressed, which would take most of the time of a series.
            level = 1 if level and len(packed) < _WORTH_IT * len(content) else 0
            block = np.array([1, len(content), len(content), len(packed)], "<u8").tobytes() + packed
            self._last[name] = content, level, block
        return block


def _vtu(snapshot: Snapshot, blocks: _Blocks) -> bytes:
    """Return a snapshot as a file of VTK: what arrays there are as XML, and behind it their bytes."""
    nodes, ends, kinds = vtk_cells(snapshot.cells, snapshot.cell_type)
    groups: dict[str, Mapping[str, NDArray[Any]]] = {
        "Points": {"points": snapshot.points},
        "Cells": {"connectivity": nodes, "offsets": ends, "types": kinds},
        "PointData": snapshot.point_fields,
        "CellData": snapshot.cell_fields,
    }
    size = f'NumberOfPoints="{len(snapshot.points)}" NumberOfCells="{len(snapshot.cells)}"'
    text, data = f"{_GRID}<Piece {size}>\n", b""
    for group, arrays in groups.items():
        text += f"<{group}>\n"
        for name, values in arrays.items():
            kind = values.dtype.name.title().replace("Uint", "UInt")
            width = f' NumberOfComponents="{values.shape[1]}"' if values.ndim > 1 else ""
            text += f'<DataArray type="{kind}" Name="{name}"{width} format="appended" offset="{len(data)}">'
            if name in _UNITS:
                text += f'<InformationKey name="UNITS_LABEL" location="vtkDataArray">{_UNITS[name]}</InformationKey>'
            text += "</DataArray>\n"
            data += blocks.block(name, values)
        text += f"</{group}>\n"
    text += '</Piece>\n</UnstructuredGrid>\n<AppendedData encoding="raw">\n_'
    return text.encode() + data + b"\n</AppendedData>\n</VTKFile>\n"


def _body(history: xr.Dataset, number: int) -> Snapshot:
    """Return the body with tensors, and fields of its contact that are no numbers where nothing may touch."""
    snapshot = read_snapshot(history, number)
    step, fields, nodes = nearest_record(history, snapshot.time), {}, history["contact_node"].values
    for name, stored in _CONTACT.items():
        values = history[stored].values[step]
        values = in_space(values) if values.ndim > 1 else values
        fields[name] = np.full((history.sizes["node"], *values.shape[1:]), np.nan)
        fields[name][nodes] = values
    # Tensors are written as their nine numbers row by row.
    tensors = {name: values.reshape(-1, 9) for name, values in cell_tensors(history, number).items()}
    return dataclasses.replace(
        snapshot,
        point_fields={**snapshot.point_fields, **fields},
        cell_fields={**snapshot.cell_fields, **tensors},
    )


def _faces(history: xr.Dataset, number: int) -> Snapshot:
    """Return the counterfaces as surfaces of quadrilaterals, in 2D as lines."""
    half_side = _HALF_SIDE * float(np.ptp(history["node_position"].values, axis=0).max())
    points, cells, numbers, count = [np.empty((0, 3))], [], [], 0
    for face in faces_at(history, number, half_side):
        nodes = count + np.arange(face.surface[..., 0].size).reshape(face.surface.shape[:2])
        corners = [nodes[:-1], nodes[1:]]
        if is_solid(history):
            corners = [nodes[:-1, :-1], nodes[1:, :-1], nodes[1:, 1:], nodes[:-1, 1:]]
        cells.append(np.stack([corner.ravel() for corner in corners], axis=1))
        numbers.append(np.full(len(cells[-1]), face.number, dtype=np.int64))
        points.append(face.surface.reshape(-1, 3))
        count += nodes.size
    kind, n_corners = (_QUAD, 4) if is_solid(history) else (_LINE, 2)
    fields = {"counterface": np.concatenate([np.empty(0, dtype=np.int64), *numbers])}
    nodes = np.concatenate([np.empty((0, n_corners), dtype=np.int64), *cells])
    return Snapshot(float(history["snapshot_time"][number]), kind, np.concatenate(points), nodes, {}, fields)


def _sites(history: xr.Dataset, number: int) -> Snapshot:
    """Return the recorded sites as points with their displacement and the number of their kind."""
    time, points = float(history["snapshot_time"][number]), in_space(history["site_position"].values)
    kinds = [RECEPTOR_KINDS.index(kind) if kind in RECEPTOR_KINDS else -1 for kind in site_kinds(history)]
    displacement = in_space(history["displacement"].values[nearest_record(history, time)])
    fields = {"displacement": displacement, "kind": np.array(kinds)}
    return Snapshot(time, _VERTEX, points, np.arange(len(points))[:, None], fields, {})


_SCRIPT = '''"""Shows this folder in ParaView: File > Load State, or: pvpython --script show.py."""

from pathlib import Path

from paraview import simple

folder = Path(__file__).parent if "__file__" in globals() else Path.cwd()
view = simple.GetActiveViewOrCreate("RenderView")


def warped(name):
    """Load a series and move its points by their displacement."""
    reader = simple.PVDReader(registrationName=name, FileName=str(folder / f"{name}.pvd"))
    return simple.WarpByVector(registrationName=f"deformed {name}", Input=reader, Vectors=["POINTS", "displacement"])


body = simple.Show(warped("body"), view)
body.Representation = "Surface"
simple.ColorBy(body, ("CELLS", "strain_energy_density"))
body.SetScalarBarVisibility(view, True)
if (folder / "sites.pvd").is_file():
    sites = simple.Show(warped("sites"), view)
    sites.PointSize = 6.0
    simple.ColorBy(sites, ("POINTS", "kind"))
if (folder / "counterfaces.pvd").is_file():
    reader = simple.PVDReader(registrationName="counterfaces", FileName=str(folder / "counterfaces.pvd"))
    faces = simple.Show(reader, view)
    faces.Opacity = 0.4
    faces.LineWidth = 2.0
simple.GetAnimationScene().UpdateAnimationUsingDataTimeSteps()
view.ResetCamera()
simple.Render()
'''
