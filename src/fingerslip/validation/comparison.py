"""All that ``fingerslip validate`` prints: rows of studies that are run, and of parts that are stored."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from fingerslip.errors import InputError, shortened
from fingerslip.report.tables.table import Table, to_markdown
from fingerslip.study.running.progress import StudyProgress
from fingerslip.study.shipped import studies_folder
from fingerslip.validation.detection import detection_rows
from fingerslip.validation.geometry import GeometryRow, allowed_geometry, geometry_table
from fingerslip.validation.pouring import pouring_rows
from fingerslip.validation.rows import Row, rows_mapping, rows_markdown, rows_table
from fingerslip.validation.stored import Stored
from fingerslip.validation.validate import PAPERS, validate

__all__ = ["PARTS", "Comparison", "compare", "comparison_mapping", "comparison_markdown"]

#: Parts that take so long that they are stored, and the paper that each of them is compared with.
PARTS: Mapping[str, str] = MappingProxyType(
    {"geometry": "wang2014", "pouring": "bulens2023", "detection": "bulens2023"}
)
_ROWS: Mapping[str, Callable[..., Stored[Row]]] = MappingProxyType(
    {"pouring": pouring_rows, "detection": detection_rows}
)


@dataclass(frozen=True)
class Comparison:
    """Published values beside ours."""

    rows: tuple[Row, ...]  # the rows
    origins: tuple[str, ...] = ()  # where those come from that were stored, in sentences
    geometry: Stored[GeometryRow] | None = None  # what the unknown geometry of the finger allows

    @property
    def tables(self) -> list[Table]:
        """The rows as tables."""
        first = rows_table(self.rows, *self.origins)
        return [first, *([] if self.geometry is None else [geometry_table(self.geometry.rows, self.geometry.origin)])]


def compare(
    studies: str | Path | None = None,
    results: str | Path = "results",
    workers: int = 2,
    progress: StudyProgress | None = None,
    *,
    only: str | None = None,
    computed: Collection[str] = (),
) -> Comparison:
    """Compare the shipped studies with published values.

    Parameters
    ----------
    studies : path, optional
        Folder of the study files; without it `studies` of the current folder, or else that of the package.
    results : path, optional
        Folder of the results.
    workers : int, optional
        How many runs are computed at once.
    progress : StudyProgress, optional
        Receives the progress.
    only : str, optional
        The paper to compare with, among :data:`~fingerslip.validation.validate.PAPERS`; all of them without it.
    computed : collection of str, optional
        The :data:`PARTS` to compute; rows of the others are read where they are stored.

    Raises
    ------
    InputError
        Where a paper is unknown, a part belongs to a paper that is left out, or a study file is missing or wrong.
    FingerslipError
        Where runs or trials fail, or results cannot be written or read back.
    """
    papers = _papers(only, computed)
    given = studies_folder() if studies is None else studies, results, workers, progress
    # Stored rows first: a damaged file is told before anything is computed.
    geometry = allowed_geometry(*given, compute="geometry" in computed) if "wang2014" in papers else None
    parts = [rows(*given, compute=part in computed) for part, rows in _ROWS.items() if PARTS[part] in papers]
    rows = (*validate(*given, papers=papers), *(row for part in parts for row in part.rows))
    return Comparison(rows, tuple(part.origin for part in parts if part.origin), geometry)


def comparison_mapping(found: Comparison) -> Any:
    """Return the rows as plain data, under keys beside those of the geometry if it was computed."""
    plain, geometry = rows_mapping(found.rows), found.geometry
    return {"rows": plain, "geometry": rows_mapping(geometry.rows)} if geometry and geometry.computed else plain


def comparison_markdown(found: Comparison) -> str:
    """Write the rows as a page in Markdown, with those of the geometry where it was computed."""
    page, geometry = rows_markdown(found.rows), found.geometry
    if geometry is None or not geometry.computed:
        return page
    table = geometry_table(geometry.rows)
    return f"{page}\n## {table.title}\n\n{table.note}\n\n{to_markdown(table)}"


def _papers(only: str | None, computed: Collection[str]) -> tuple[str, ...]:
    if only is None:
        return PAPERS
    if only not in PAPERS:
        raise InputError("--only", f"got {shortened(only)!r}", f"needs one of {', '.join(PAPERS)}")
    for part in computed:
        if PARTS[part] != only:
            raise InputError(f"--{part}", f"is of {PARTS[part]}", f"needs no --only {only}", "leave one of them out")
    return (only,)
