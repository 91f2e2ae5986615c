"""Validation: the shipped studies beside all that Wang, Chathuranga & Hirai (2014) print."""

from __future__ import annotations

from fingerslip.validation.evidence import STUDIES
from fingerslip.validation.geometry import geometry_mapping, geometry_table, run_geometry, stored_geometry
from fingerslip.validation.rows import Row, rows_mapping, rows_markdown, rows_table
from fingerslip.validation.validate import validate

__all__ = [
    "STUDIES",
    "Row",
    "geometry_mapping",
    "geometry_table",
    "rows_mapping",
    "rows_markdown",
    "rows_table",
    "run_geometry",
    "stored_geometry",
    "validate",
]
