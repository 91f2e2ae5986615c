"""The gel pad as numbers, and which of them do not fit together."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
import pydantic

from fingerslip.errors import InputError
from fingerslip.marker_layouts import MarkerLayout, grid_layout
from fingerslip.materials.choice import MaterialChoice
from fingerslip.parameters import PositiveLength, parameters
from fingerslip.units import millimetres

_Count = Annotated[int, pydantic.Field(ge=1, le=100)]


@parameters
class Markers:
    """A grid of markers on the touched surface of the gel, about its middle.

    Parameters
    ----------
    rows, columns : int
        Markers along z and along x.
    spacing : float
        Distance of neighbours [m].
    """

    rows: _Count
    columns: _Count
    spacing: PositiveLength


@parameters
class GelPadNumbers:
    """The numbers of a gel pad, held to fit together.

    :class:`~fingerslip.specimens.gel_pad.gel_pad.GelPad` explains them.
    """

    part: Literal["section", "whole"]
    length: PositiveLength
    width: PositiveLength
    thickness: PositiveLength
    markers: Markers
    materials: dict[str, MaterialChoice]
    formulation: Literal["plane_strain", "plane_stress"]
    depth: PositiveLength

    def __post_init__(self) -> None:
        if set(self.materials) != {"gel"}:
            raise InputError("materials", f"has {', '.join(self.materials) or 'nothing'}", "needs gel")
        for name, count in (("length", self.markers.columns), ("width", self.markers.rows)):
            span, room = (count - 1) * self.markers.spacing, getattr(self, name)
            if span >= room:
                fault = f"has {count} markers over {millimetres(span)}"
                raise InputError("markers", fault, f"needs < {millimetres(room)} ({name})", "take fewer or closer ones")

    @property
    def layout(self) -> MarkerLayout:
        """The markers of what is modelled; those of a section are one row."""
        rows = 1 if self.part == "section" else self.markers.rows
        return grid_layout(self.markers.spacing, rows, self.markers.columns)

    @property
    def marker_points(self) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        """Points of the markers, shape (n, 2) for a section, else (n, 3) [m]."""
        x, z = self.layout.position.T
        return np.column_stack([x, 0.0 * x] if self.part == "section" else [x, 0.0 * x, z])
