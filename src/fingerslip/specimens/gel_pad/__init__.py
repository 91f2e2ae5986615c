"""What a flat gel with a grid of markers is, in numbers, as in optical sensors of the GelSight kind, and its presets."""

from fingerslip.specimens.gel_pad.gel_pad import PRESETS, GelPad
from fingerslip.specimens.gel_pad.numbers import GelPadNumbers, Markers

__all__ = ["PRESETS", "GelPad", "GelPadNumbers", "Markers"]
