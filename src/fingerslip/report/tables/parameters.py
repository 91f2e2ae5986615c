"""Tables of the values that runs were made with: unit, source and group of each."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from fingerslip.tables.table import Cell, Column, Missing, Table

if TYPE_CHECKING:
    import xarray as xr

#: Sources that set the order of tables: assumed values come first, those that a run does not use last.
ASSUMED, NOT_USED = "assumed", "not used"

#: The columns of a table of values.
COLUMNS = (Column("parameter"), Column("value"), Column("source"), Column("note"))
#: The groups in the order of tables, with the leading parts of the dotted paths of their values.
GROUPS: dict[str, tuple[str, ...]] = {
    "Materials and damping": ("fingertip.materials", "materials", "damping"),
    "Specimen": ("fingertip",),
    "Mesh and formulation": ("mesh", "formulation", "depth", "integration", "kinematics"),
    "Contact and friction": ("contact", "contacts"),
    "Programme": ("programme",),
    "Supports and loads": ("supports", "tractions", "gravity", "initial_velocity"),
    "Time": ("time", "dynamics"),
    "Recording": ("record",),
    "Other values": (),
}


@dataclass(frozen=True)
class ShownValue:
    """One value of a run as a reader needs it."""

    path: str  # dotted path in the study file
    value: str  # the value with its unit
    source: str  # key of the reference that it is from, ``assumed``, ``study file``, ``default`` or ``not used``
    note: str = ""  # what the value rests on


def group_of(path: str) -> str:
    """Return the group of a value.

    Examples
    --------
    >>> group_of("fingertip.materials.dermis.density"), group_of("fingertip.depth"), group_of("contact.normal.0")
    ('Materials and damping', 'Specimen', 'Contact and friction')
    """
    return next(
        (group for group, keys in GROUPS.items() if any(f"{path}.".startswith(f"{part}.") for part in keys)),
        list(GROUPS)[-1],
    )


def value_tables(values: Sequence[ShownValue]) -> tuple[Table, ...]:
    """Show values in a table for each group: the assumed ones first and marked, those that are not used last."""
    ordered = sorted(values, key=lambda value: (value.source == NOT_USED, value.source != ASSUMED))
    tables = []
    for group in GROUPS:
        members = [value for value in ordered if group_of(value.path) == group]
        assumed = sum(value.source == ASSUMED for value in members)
        note = f"{assumed} of {len(members)} values are assumed: the sources do not give them." if assumed else ""
        rows = tuple((value.path, value.value, value.source, value.note) for value in members)
        tables.append(Table(group, COLUMNS, rows, note, marked=tuple(range(assumed))))
    return tuple(table for table in tables if table.rows)


_ATTRIBUTES: Mapping[str, str] = MappingProxyType(
    {
        "element": "element",
        "n_nodes": "nodes",
        "n_degrees_of_freedom": "unknowns",
        "n_contact_candidates": "contact candidates",
        "normal_penalty": "mean normal penalty [Pa/m]",
        "tangential_penalty": "mean tangential penalty [Pa/m]",
        "linear_solver": "linear solver",
        "condensation": "contact response by",
        "basis": "basis",
        "basis_constraint_modes": "constraint modes of the basis",
        "basis_normal_modes": "normal modes of the basis",
        "basis_error": "estimated error of displacement by the basis",
        "basis_acceleration_error": "estimated error of acceleration by the basis",
    }
)


def models_table(histories: Mapping[str, xr.Dataset]) -> Table:
    """Show how runs were computed, as their histories say: a row for each property, a column for each run."""
    columns = (Column("property"), *(Column(title, significant=3) for title in histories))
    attributes = [history.attrs for history in histories.values()]
    rows = tuple(
        (words, *(_plain(values.get(name, Missing.NOT_RECORDED)) for values in attributes))
        for name, words in _ATTRIBUTES.items()
        if any(name in values for values in attributes)
    )
    return Table("Models as computed", columns, rows)


def _plain(value: Any) -> Cell:
    cell: Cell = value if isinstance(value, str | int | float | Missing) else value.item()
    return cell


# Patterns of dotted paths in the order of the table, with the words for them; groups of a pattern go into the words.
_CONDITIONS: tuple[tuple[str, str], ...] = (
    (r"(?:fingertip|tactip)\.preset", "specimen, preset"),
    (r"(?:fingertip|tactip)\.(phalanx)\.variant", "{0}"),
    (r"fingertip\.section", "section"),
    (r"(?:fingertip\.)?formulation", "formulation"),
    (r"(?:fingertip\.)?depth", "depth out of the plane"),
    (r"kinematics", "kinematics"),
    (r"(?:fingertip\.|tactip\.)?materials\.([\w-]+)\.(youngs_modulus|poisson_ratio|law)", "{0}: {1}"),
    (r"contacts?\.(?:\d+\.)?(friction_coefficient|friction|clearance)", "{0}"),
    (r"programme\.\d+\.(press|hold|slide|lift)\.(\w+)", "{0}: {1}"),
    (r"mesh\.(element|contact_size|bulk_size|file|skin)", "mesh: {0}"),
    (r"time\.(step|scheme|alpha|tolerance|end)", "time: {0}"),
    (r"damping\.(mass|stiffness)", "damping by {0}"),
    (r"dynamics\.(basis)", "computed in {0}"),
)


def conditions_table(values: Sequence[ShownValue], histories: Mapping[str, xr.Dataset]) -> Table:
    """Show the conditions of runs: specimen, materials, friction, motion, mesh, time, and all that was changed."""
    named = [(words, value) for value in values if value.source != NOT_USED and (words := _words(value))]
    ordered = sorted(named, key=lambda pair: pair[0][0])
    rows = [(text, value.value, value.source, value.note) for (_, text), value in ordered]
    marked = tuple(number for number, (_, value) in enumerate(ordered) if value.source == ASSUMED)
    columns = (Column("condition"), *COLUMNS[1:])
    note = "Assumed values are marked: no source gives them." if marked else ""
    return Table("What was run", columns, (*rows, *_sizes(histories)), note, marked)


def _words(value: ShownValue) -> tuple[int, str] | None:
    """Return the number of the pattern of a condition and its words; None for a value that the table leaves out."""
    for number, (pattern, words) in enumerate(_CONDITIONS):
        match = re.fullmatch(pattern, value.path)
        if match:
            return number, words.format(*(part.replace("_", " ") for part in match.groups()))
    is_set = value.source.startswith("study file") and not value.path.startswith("record.")
    return (len(_CONDITIONS) - 1, value.path) if is_set else None


def _sizes(histories: Mapping[str, xr.Dataset]) -> list[tuple[str, str, str, str]]:
    """Return how large the meshes are."""
    rows = []
    for name, words in {"n_nodes": "mesh: nodes", "n_contact_candidates": "mesh: nodes that may touch"}.items():
        sizes = sorted({int(history.attrs[name]) for history in histories.values() if name in history.attrs})
        if sizes:
            text = f"{sizes[0]}" if len(sizes) == 1 else f"{sizes[0]} to {sizes[-1]}"
            rows.append((words, text, "as computed", ""))
    return rows
