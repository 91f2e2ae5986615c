"""TacTips that ship, and a study's changes to them."""

from __future__ import annotations

from fingerslip.materials.choice import kept_values
from fingerslip.parameters.presets import Presets
from fingerslip.specimens.tactip.tactip import TacTip

__all__ = ["PRESETS"]

PRESETS = Presets(TacTip, "fingerslip.specimens.tactip", kept_values)
