"""Which values of a TacTip make no difference to a model of it, and why."""

from __future__ import annotations

from fingerslip.specimens.protocol import ModelUse
from fingerslip.specimens.tactip.numbers import TacTipNumbers

__all__ = ["why_unused"]

_SHAPE = ("part", "dome", "skin", "rods", "markers", "window")
_OF_SECTIONS = ("formulation", "depth")


def why_unused(sensor: TacTipNumbers, path: str, use: ModelUse) -> str:
    """Return why a value of a TacTip makes no difference to a model.

    Parameters
    ----------
    sensor : TacTipNumbers
        The sensor.
    path : str
        Dotted path of the value, such as ``skin.ridges.pitch``.
    use : ModelUse
        What the model takes from it.

    Returns
    -------
    str
        The reason; empty for a value that the model uses.
    """
    group = path.partition(".")[0]
    if group in _OF_SECTIONS:
        return "of 2D sections only" if use.dim == 3 else ""
    if group in _SHAPE and not use.meshed and not use.groups:
        return "the mesh comes from a file"
    return _of_other_choice(sensor, path)


def _of_other_choice(sensor: TacTipNumbers, path: str) -> str:
    if path.startswith("skin.ridges.") and path != "skin.ridges.enabled" and not sensor.skin.ridges.enabled:
        return "switched off"
    if path == "markers.layers" and sensor.markers.layout == "rings":
        return "of the hexagonal layout only"
    if path.partition(".rings")[0] == "markers" and sensor.markers.layout == "hexagonal":
        return "of rings only"
    return ""
