"""What cameras, fields and cuts of scenes are called: once, for options, help, completion and the page in a browser.

Nothing else is loaded here, as help and completion have to be quick.
"""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

Camera: TypeAlias = Literal["oblique", "side", "front", "below"]
Scalar: TypeAlias = Literal["von_mises", "strain_energy_density", "displacement", "velocity", "region"]
Cut: TypeAlias = Literal["none", "x", "y", "z"]

CAMERAS: tuple[Camera, ...] = get_args(Camera)
FIELDS: tuple[Scalar, ...] = get_args(Scalar)
CUTS: tuple[Cut, ...] = get_args(Cut)


def alternatives(names: tuple[str, ...]) -> str:
    """Write names as alternatives, such as 'oblique, side, front or below'."""
    *first, last = names
    return f"{', '.join(first)} or {last}"
