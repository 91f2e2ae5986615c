"""The table of what was run: the conditions that decide a result, as the runs had them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from fingerslip.report.tables.parameters import ASSUMED, NOT_USED, ShownValue
from fingerslip.report.tables.table import Column, Table

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["conditions_table"]

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
_GIVEN = "study file"


def conditions_table(values: Sequence[ShownValue], histories: Mapping[str, xr.Dataset]) -> Table:
    """Show the conditions of runs: specimen, materials, friction, motion, mesh, time, and all that was changed."""
    used = [value for value in values if value.source != NOT_USED]
    named = [(words, value) for value in used if (words := _words(value))]
    places = {words: number for number, (words, _) in enumerate(_CONDITIONS)}
    ordered = sorted(named, key=lambda pair: places[pair[0][0]])
    rows = [(text, value.value, value.source, value.note) for (_, text), value in ordered]
    marked = tuple(number for number, (_, value) in enumerate(ordered) if value.source == ASSUMED)
    columns = (Column("condition"), Column("value"), Column("source"), Column("note"))
    note = "Assumed values are marked: no source gives them." if marked else ""
    return Table("What was run", columns, (*rows, *_sizes(histories)), note, marked)


def _words(value: ShownValue) -> tuple[str, str] | None:
    """Return the pattern of a condition and its words; None for a value that the table leaves out."""
    for pattern, words in _CONDITIONS:
        found = re.fullmatch(pattern, value.path)
        if found:
            return pattern, words.format(*(part.replace("_", " ") for part in found.groups()))
    given = value.source.startswith(_GIVEN) and not value.path.startswith("record.")
    return (_CONDITIONS[-1][0], value.path) if given else None


def _sizes(histories: Mapping[str, xr.Dataset]) -> list[tuple[str, str, str, str]]:
    """Return how large the meshes are."""
    rows = []
    for name, words in {"n_nodes": "mesh: nodes", "n_contact_candidates": "mesh: nodes that may touch"}.items():
        found = sorted({int(history.attrs[name]) for history in histories.values() if name in history.attrs})
        if found:
            text = f"{found[0]}" if len(found) == 1 else f"{found[0]} to {found[-1]}"
            rows.append((words, text, "as computed", ""))
    return rows
