"""The history: everything that a simulation recorded, as a labelled dataset with units.

The variables, their dimensions and their units are in :data:`VARIABLES`; a history is an
:class:`xarray.Dataset` with exactly these names, so it opens in anything that reads netCDF-4/HDF5.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fingerslip.arrays import Floats
from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.errors import ResultError
from fingerslip.libraries import xr
from fingerslip.storage.files import write_bytes
from fingerslip.storage.netcdf import netcdf_bytes, read_netcdf


@dataclass(frozen=True)
class Variable:
    """What one variable of a history is: its dimensions, SI unit and meaning."""

    dims: tuple[str, ...]
    units: str
    long_name: str


COORDINATES: Mapping[str, Variable] = {
    "time": Variable(("time",), "s", "time"),
    "component": Variable(("component",), "", "vector component"),
    "stress_component": Variable(("stress_component",), "", "component of stress and strain"),
    "phase_kind": Variable(("phase",), "", "kind of programme phase: press, hold, slide or lift"),
    "phase_start": Variable(("phase",), "s", "start of the phase"),
    "phase_end": Variable(("phase",), "s", "end of the phase"),
    "site": Variable(("site",), "", "name of the site"),
    "site_kind": Variable(("site",), "", "kind of the site: a mechanoreceptor type or empty"),
    "site_region": Variable(("site",), "", "region in which stress and strain energy are recovered"),
    "site_position": Variable(("site", "component"), "m", "reference position of the site's node"),
    "counterface": Variable(("counterface",), "", "boundary that the counterface touches"),
    "counterface_normal": Variable(("counterface", "component"), "1", "outward unit normal of the counterface"),
    "counterface_shape": Variable(("counterface",), "", "kind of counterface: plane, cylinder, sphere or another"),
    "counterface_outline": Variable(
        ("counterface", "outline_row", "outline_column", "component"), "m", "points of the counterface at the start"
    ),
    "counterface_rigid_body": Variable(("counterface",), "", "rigid body that the counterface is on, or empty"),
    "counterface_friction_coefficient": Variable(("counterface",), "1", "friction coefficient"),
    "rotation_axis": Variable(("rotation_axis",), "", "axis of rotations and moments"),
    "rigid_body": Variable(("rigid_body",), "", "name of the rigid body"),
    "rigid_body_centre": Variable(("rigid_body", "component"), "m", "centre of the rigid body at the start"),
    "support": Variable(("support",), "", "boundary or region that the support holds"),
    "contact_node": Variable(("contact_node",), "", "mesh node of the contact candidate, counted from 0"),
    "contact_counterface": Variable(
        ("contact_node",), "", "number of the counterface that the candidate may touch, counted from 0"
    ),
    "contact_position": Variable(("contact_node", "component"), "m", "reference position of the candidate"),
    "contact_area": Variable(("contact_node",), "m^2", "tributary area of the candidate"),
    "contact_edge_distance": Variable(("contact_node",), "m", "distance to the nearest free edge of the boundary"),
    "snapshot_time": Variable(("snapshot_time",), "s", "time of the snapshot"),
    "node_position": Variable(("node", "component"), "m", "reference position of the mesh node"),
    "cell_nodes": Variable(
        ("cell", "cell_node"),
        "",
        "mesh nodes of the cell, counted from 0, in the order of VTK; a triangle among quadrilaterals and each end of "
        "a prism among hexahedra has its last node twice",
    ),
    "cell_region": Variable(
        ("cell",), "", "number of the cell's region in the attribute regions, counted from 0; one less for none"
    ),
}

_TIME, _SITE, _CONTACT = ("time",), ("time", "site"), ("time", "contact_node")
_FACE, _RIGID, _CELL = ("time", "counterface"), ("time", "rigid_body"), ("snapshot_time", "cell")

VARIABLES: Mapping[str, Variable] = {
    "displacement": Variable((*_SITE, "component"), "m", "displacement at the sites"),
    "velocity": Variable((*_SITE, "component"), "m/s", "velocity at the sites"),
    "acceleration": Variable((*_SITE, "component"), "m/s^2", "acceleration at the sites"),
    "stress": Variable((*_SITE, "stress_component"), "Pa", "Cauchy stress at the sites"),
    "strain": Variable((*_SITE, "stress_component"), "1", "strain tensor at the sites, logarithmic at large strain"),
    "strain_energy_density": Variable(_SITE, "J/m^3", "strain energy density at the sites"),
    "contact_displacement": Variable((*_CONTACT, "component"), "m", "displacement of the contact nodes"),
    "contact_velocity": Variable((*_CONTACT, "component"), "m/s", "velocity of the contact nodes"),
    "contact_acceleration": Variable((*_CONTACT, "component"), "m/s^2", "acceleration of the contact nodes"),
    "gap": Variable(_CONTACT, "m", "distance from the counterface, negative is penetration"),
    "normal_traction": Variable(_CONTACT, "Pa", "contact pressure"),
    "tangential_traction": Variable((*_CONTACT, "component"), "Pa", "friction traction on the skin"),
    "slip_distance": Variable(_CONTACT, "m", "slip accumulated while in contact"),
    "contact_state": Variable(_CONTACT, "", f"{OPEN} open, {STICK} stick, {SLIP} slip"),
    "counterface_displacement": Variable((*_FACE, "component"), "m", "displacement of the counterface"),
    "counterface_velocity": Variable((*_FACE, "component"), "m/s", "velocity of the counterface"),
    "counterface_force": Variable((*_FACE, "component"), "N", "force on the deformable body"),
    "counterface_moment": Variable(
        (*_FACE, "rotation_axis"),
        "N m",
        "moment on the deformable body about the centre of the counterface's rigid body, else about the moved origin",
    ),
    "friction_utilisation": Variable(
        _FACE, "1", "friction force of the counterface over the largest that its normal forces bear"
    ),
    "largest_friction_utilisation": Variable(
        _FACE, "1", "largest friction force of a node over the largest that its normal force bears"
    ),
    "rigid_body_displacement": Variable((*_RIGID, "component"), "m", "displacement of the rigid body's centre"),
    "rigid_body_velocity": Variable((*_RIGID, "component"), "m/s", "velocity of the rigid body's centre"),
    "rigid_body_acceleration": Variable(
        (*_RIGID, "component"), "m/s^2", "acceleration of the rigid body's centre along its free directions"
    ),
    "rigid_body_rotation": Variable((*_RIGID, "rotation_axis"), "rad", "rotation of the rigid body"),
    "rigid_body_angular_velocity": Variable((*_RIGID, "rotation_axis"), "rad/s", "angular velocity of the rigid body"),
    "rigid_body_angular_acceleration": Variable(
        (*_RIGID, "rotation_axis"), "rad/s^2", "angular acceleration of the rigid body"
    ),
    "rigid_body_force": Variable((*_RIGID, "component"), "N", "force of all contacts on the rigid body"),
    "rigid_body_moment": Variable(
        (*_RIGID, "rotation_axis"), "N m", "moment of all contacts on the rigid body about its centre"
    ),
    "support_force": Variable(("time", "support", "component"), "N", "force of the support on the deformable body"),
    "kinetic_energy": Variable(_TIME, "J", "kinetic energy"),
    "strain_energy": Variable(_TIME, "J", "strain energy, that of springs of rigid bodies included"),
    "contact_energy": Variable(_TIME, "J", "energy stored in the contact penalties"),
    "friction_dissipation": Variable(_TIME, "J", "energy dissipated by friction"),
    "damping_dissipation": Variable(_TIME, "J", "energy dissipated by material damping and dampers"),
    "viscous_dissipation": Variable(_TIME, "J", "energy dissipated by the Prony terms of materials"),
    "numerical_dissipation": Variable(_TIME, "J", "energy dissipated by the time integration"),
    "external_work": Variable(_TIME, "J", "work done by the counterfaces, the moving supports and the loads"),
    "energy_imbalance": Variable(_TIME, "J", "external work less all stored and dissipated energy"),
    "contact_iterations": Variable(_TIME, "1", "iterations of the contact solver"),
    "contact_residual": Variable(_TIME, "1", "relative residual of the contact solver"),
    "snapshot_displacement": Variable(("snapshot_time", "node", "component"), "m", "displacement of all nodes"),
    "snapshot_velocity": Variable(("snapshot_time", "node", "component"), "m/s", "velocity of all nodes"),
    "snapshot_strain_energy_density": Variable(_CELL, "J/m^3", "strain energy density of cells"),
    "snapshot_von_mises": Variable(_CELL, "Pa", "von Mises stress at the cells' centres"),
    "snapshot_stress": Variable((*_CELL, "stress_component"), "Pa", "Cauchy stress at the cells' centres"),
    "snapshot_strain": Variable(
        (*_CELL, "stress_component"), "1", "strain tensor of cells, logarithmic at large strain"
    ),
}


# Share of zeros from which values are compressed, the share of all values that is counted, and how many are worth it.
_ZEROS, _ONE_OF, _MANY = 0.5, 7, 10_000


def make_history(values: Mapping[str, Any], attributes: Mapping[str, Any]) -> xr.Dataset:
    """Label arrays as a history."""

    def with_units(table: Mapping[str, Variable]) -> dict[str, xr.Variable]:
        return {
            name: xr.Variable(variable.dims, values[name], {"units": variable.units, "long_name": variable.long_name})
            for name, variable in table.items()
            if name in values
        }

    unknown = set(values) - set(COORDINATES) - set(VARIABLES)
    if unknown:
        raise KeyError(f"no variables of a history: {sorted(unknown)}")
    return xr.Dataset(with_units(VARIABLES), coords=with_units(COORDINATES), attrs=dict(attributes))


def write_history(history: xr.Dataset, path: str | Path) -> None:
    """Write a history as netCDF-4, whole or not at all.

    Parameters
    ----------
    history : xarray.Dataset
        What :func:`make_history` or ``simulate`` returned.
    path : path
        The file; a file that is there is replaced only when the new one is whole.

    Raises
    ------
    ResultError
        Where the file cannot be written.

    Examples
    --------
    A block of one cell under a load, written and read again:

    >>> import tempfile
    >>> import skfem
    >>> import fingerslip as fs
    >>> block = skfem.MeshQuad().with_defaults().with_subdomains({"pulp": [0]})
    >>> model = fs.Model(
    ...     mesh=block,
    ...     materials={"pulp": fs.material("pulp")},
    ...     formulation="plane_strain",
    ...     supports={"bottom": ("x", "y")},
    ...     tractions={"top": (0.0, -100.0)},
    ...     time=fs.QuasiStatic(step=0.1, end=0.2),
    ... )
    >>> history = fs.simulate(model)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     fs.write_history(history, f"{folder}/block.nc")
    ...     fs.read_history(f"{folder}/block.nc").equals(history)
    True
    """
    # Compression takes longer than all other work on a file. Where nodes are open or at rest values are zero, and a
    # third of the bytes is left. Most bytes of other numbers look random: two thirds are left, after five to ten times
    # as long for a byte. Where these prevail, writing is faster.
    large = {name: item for name, item in history.variables.items() if item.dtype.kind == "f" and item.size > _MANY}
    samples = {name: item.values.ravel("K")[::_ONE_OF] for name, item in large.items()}
    compressed = [name for name, some in samples.items() if np.count_nonzero(some) < (1.0 - _ZEROS) * some.size]
    # Built in memory first: on a full disk the HDF5 library ends the process, writing bytes only fails.
    write_bytes(Path(path), netcdf_bytes(history, compressed))


def read_history(path: str | Path) -> xr.Dataset:
    """Return the history of a file, with arrays in memory.

    See :func:`write_history`.

    Parameters
    ----------
    path : path
        A file that :func:`write_history` wrote, or the folder of a run.

    Raises
    ------
    ResultError
        Where the file is missing or is no history.
    """
    path = Path(path, "history.nc") if Path(path).is_dir() else path
    history = read_netcdf(path, "a history", "run the study again")
    fault = next(_faults(history), "")
    if fault:
        raise ResultError(f"{path}: is no history ({fault}); needs a file written by fingerslip run")
    if failure := history.attrs.get("failure"):
        warnings.warn(f"{path} is no result: it ends where its run failed: {failure}", stacklevel=2)
    return history


_ALWAYS = ("time", "component", "phase_kind", "phase_start", "phase_end")
# What files of earlier versions do not have.
_LATER = ("counterface_shape", "counterface_outline", "counterface_rigid_body")


def _faults(history: xr.Dataset) -> Iterator[str]:
    """Yield what a history lacks, or has of other dimensions, units or kind."""
    for name, variable in {**COORDINATES, **VARIABLES}.items():
        if name not in history.variables:
            is_recorded = all(history.sizes.get(dim) for dim in variable.dims)
            if (is_recorded or name in _ALWAYS) and name not in _LATER:
                yield f"it has no {name}"
            continue
        values = history.variables[name]
        if values.dims != variable.dims:
            yield f"{name} has the dimensions {', '.join(map(str, values.dims))}, not {', '.join(variable.dims)}"
        if values.attrs.get("units", "") != variable.units:
            yield f"{name} is in {values.attrs.get('units') or 'no unit'}, not in {variable.units or 'none'}"
        if variable.units and values.dtype.kind not in "fiu":
            yield f"{name} holds {values.dtype}, no numbers"
    if not history.sizes.get("time"):
        yield "it has no records"
    if history.sizes.get("contact_node") and not history.sizes.get("counterface"):
        yield "its contact nodes have no counterface"


def phase_times(history: xr.Dataset, kind: str) -> list[tuple[float, float]]:
    """Return start and end [s] of every phase of one kind."""
    # Without the coordinates that come with an array of a dataset, which is asked for them many times.
    variables = history.variables
    chosen = np.flatnonzero(variables["phase_kind"].values == kind)
    starts, ends = variables["phase_start"].values, variables["phase_end"].values
    return [(float(starts[i]), float(ends[i])) for i in chosen]


def stored_phases(path: str | Path, kind: str) -> list[tuple[float, float]]:
    """Return start and end [s] of every phase of one kind, reading nothing else of a file."""
    import h5py

    try:
        with h5py.File(path, "r") as stored:
            kinds = stored["phase_kind"].asstr()[:]
            starts, ends = stored["phase_start"][:], stored["phase_end"][:]
    except (OSError, KeyError) as error:
        raise ResultError(f"{path}: cannot be read as a history ({error}); run the study again") from None
    return [(float(starts[i]), float(ends[i])) for i in np.flatnonzero(kinds == kind)]


def is_solid(history: xr.Dataset) -> bool:
    """Tell whether a history is one in 3D, with three components."""
    return bool(history.sizes["component"] == len("xyz"))


def site_kinds(history: xr.Dataset) -> NDArray[np.str_]:
    """Return the kind of every recorded site, shape (n_sites,); empty where none is recorded."""
    return np.asarray(history.variables["site_kind"].values if "site" in history.coords else [], dtype=str)


def reference_kinds(history: xr.Dataset) -> list[str]:
    """Return the kinds of the recorded reference nodes, those that end in ``surface``."""
    return [kind for kind in dict.fromkeys(map(str, site_kinds(history))) if kind.endswith("surface")]


def sites_of_kinds(history: xr.Dataset, kinds: Sequence[str]) -> NDArray[np.intp]:
    """Return the rows of the recorded sites of some kinds, in the order of the history, shape (n,)."""
    return np.flatnonzero(np.isin(site_kinds(history), list(kinds)))


def site_rows(history: xr.Dataset, names: Sequence[str]) -> NDArray[np.intp]:
    """Return the rows of recorded sites by name, shape (n_names,)."""
    row_of_site = (
        {str(name): row for row, name in enumerate(history["site"].values)} if "site" in history.coords else {}
    )
    return np.array([row_of_site[name] for name in names], dtype=np.intp)


def nearest_record(history: xr.Dataset, time: float) -> int:
    """Return the number of the record nearest to a time [s]."""
    return int(np.abs(history["time"].values - time).argmin())


def nearest_snapshot(history: xr.Dataset, time: float | None = None) -> int:
    """Return the number of the snapshot nearest to a time [s]; of the last one without a time."""
    times = history["snapshot_time"].values
    return times.size - 1 if time is None else int(np.abs(times - time).argmin())


def full_tensors(components: xr.DataArray) -> Floats:
    """Return symmetric tensors, shape (..., 3, 3), from their components over the last dimension `stress_component`."""
    values = components.values
    tensors = np.zeros((*values.shape[:-1], 3, 3))
    for column, name in enumerate(components["stress_component"].values):
        row, other = ("xyz".index(axis) for axis in str(name))
        tensors[..., row, other] = tensors[..., other, row] = values[..., column]
    return tensors
