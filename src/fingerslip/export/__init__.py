"""Results for other programs: tables for pandas and R, MATLAB files, files for ParaView.

``tables`` makes tidy tables of a history, ``matlab`` writes MATLAB files, ``paraview`` writes the snapshots with the
contact on the skin, the counterfaces and the sites; ``formats`` is the one list of what can be written.
"""

from fingerslip.export.formats import FORMATS, export_history, export_tables, history_tables

__all__ = ["FORMATS", "export_history", "export_tables", "history_tables"]
