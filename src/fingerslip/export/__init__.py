"""Results for other programs: tables for pandas and R, MATLAB files, files for ParaView, spikes for NWB and Neo."""

from fingerslip.export.formats import export_history, export_tables, history_tables
from fingerslip.export.spikes import neo_block, write_nwb

__all__ = ["export_history", "export_tables", "history_tables", "neo_block", "write_nwb"]
