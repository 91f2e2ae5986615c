"""What an optical sensor of the GelSight kind is, in numbers: a flat gel, a grid of markers, and its presets."""

from fingerslip.specimens.gel_pad.gel_pad import PRESETS, GelPad, Markers, PadSizes

__all__ = ["PRESETS", "GelPad", "Markers", "PadSizes"]
