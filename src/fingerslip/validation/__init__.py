"""Validation: the shipped studies beside what papers print: all of Wang et al. (2014), the mechanics of bulens2023."""

from __future__ import annotations

from fingerslip.validation.comparison import (
    PAPERS,
    Comparison,
    compare,
    comparison_mapping,
    comparison_markdown,
    validate,
)
from fingerslip.validation.evidence import STUDIES, Work
from fingerslip.validation.rows import (
    Row,
    Stored,
    allowed_geometry,
    geometry_table,
    rows_mapping,
    rows_markdown,
    rows_table,
)
from fingerslip.validation.sensor import detection_rows, pouring_rows

__all__ = [
    "PAPERS",
    "STUDIES",
    "Comparison",
    "Row",
    "Stored",
    "Work",
    "allowed_geometry",
    "compare",
    "comparison_mapping",
    "comparison_markdown",
    "detection_rows",
    "geometry_table",
    "pouring_rows",
    "rows_mapping",
    "rows_markdown",
    "rows_table",
    "validate",
]
