"""What an optical sensor of the TacTip kind is, in numbers: dome, ridged skin, gel, rods, markers, and its presets."""

from fingerslip.specimens.tactip.numbers import REGIONS, TacTipNumbers
from fingerslip.specimens.tactip.parts import Dome, Markers, Ridges, Rods, Skin, Window
from fingerslip.specimens.tactip.profile import MarkerPlaces, SkinLines, marker_places, place_points, skin_lines
from fingerslip.specimens.tactip.tactip import PRESETS, TacTip

__all__ = [
    "PRESETS",
    "REGIONS",
    "Dome",
    "MarkerPlaces",
    "Markers",
    "Ridges",
    "Rods",
    "Skin",
    "SkinLines",
    "TacTip",
    "TacTipNumbers",
    "Window",
    "marker_places",
    "place_points",
    "skin_lines",
]
