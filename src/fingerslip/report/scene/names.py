"""What cameras, fields and cuts of scenes are called: once, for options, help, completion and the page in a browser.

Nothing else is loaded here, as help and completion have to be quick.
"""

from __future__ import annotations

from typing import Literal, TypeAlias, get_args

Camera: TypeAlias = Literal["oblique", "side", "front", "below"]
Component: TypeAlias = Literal[
    "stress_xx", "stress_yy", "stress_zz", "stress_xy", "stress_yz", "stress_xz",
    "strain_xx", "strain_yy", "strain_zz", "strain_xy", "strain_yz", "strain_xz",
]  # fmt: skip
Scalar: TypeAlias = Literal["von_mises", "strain_energy_density", "displacement", "velocity", "region", Component]
Cut: TypeAlias = Literal["none", "x", "y", "z"]

CAMERAS: tuple[Camera, ...] = get_args(Camera)
COMPONENTS: tuple[Component, ...] = get_args(Component)
FIELDS: tuple[Scalar, ...] = get_args(Scalar)
CUTS: tuple[Cut, ...] = get_args(Cut)


def alternatives(names: tuple[str, ...]) -> str:
    """Write names as alternatives, such as 'oblique, side, front or below'."""
    *first, last = names
    return f"{', '.join(first)} or {last}"
