"""Validation: the shipped studies beside what papers print: all of Wang et al. (2014), the mechanics of bulens2023."""

from __future__ import annotations

from fingerslip.validation.detection import detection_rows
from fingerslip.validation.evidence import STUDIES
from fingerslip.validation.geometry import (
    allowed_geometry,
    geometry_table,
    rows_and_geometry_mapping,
    rows_and_geometry_markdown,
)
from fingerslip.validation.pouring import pouring_rows
from fingerslip.validation.rows import Row, rows_mapping, rows_markdown, rows_table
from fingerslip.validation.validate import validate

__all__ = [
    "STUDIES",
    "Row",
    "allowed_geometry",
    "detection_rows",
    "geometry_table",
    "pouring_rows",
    "rows_and_geometry_mapping",
    "rows_and_geometry_markdown",
    "rows_mapping",
    "rows_markdown",
    "rows_table",
    "validate",
]
