"""Results for other programs: tables for pandas and R, MATLAB files, files for ParaView."""

from fingerslip.export.formats import FORMATS, export_history, export_tables, history_tables

__all__ = ["FORMATS", "export_history", "export_tables", "history_tables"]
