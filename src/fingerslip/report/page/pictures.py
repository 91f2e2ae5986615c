"""Which pictures a report shows of a kind of runs: sections, or fingertips in 3D."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fingerslip.report.page.page import DrawnPicture, Picture
from fingerslip.slip import Events

if TYPE_CHECKING:
    import skfem
    import xarray as xr

__all__ = ["PictureSet", "RunPictures", "RunToDraw"]


@dataclass(frozen=True)
class RunToDraw:
    """A run as pictures need it."""

    name: str  # its name, with which the names of its pictures begin
    title: str  # its title, which the titles of its pictures have
    history: xr.Dataset  # its history
    events: Events  # its slip events


@dataclass(frozen=True)
class RunPictures:
    """Pictures of one run that were drawn before its report is made."""

    contact: tuple[DrawnPicture, ...] | None = None  # those of the section that shows it in detail
    model: tuple[DrawnPicture, ...] | None = None  # those of its model at the start


@dataclass(frozen=True)
class PictureSet:
    """The pictures that a report shows of a kind of runs."""

    model: Callable[[RunToDraw, skfem.Mesh], list[Picture]]  # gets a run and its mesh
    run: Callable[[RunToDraw], list[Picture]]  # gets a run
    # gets histories and events by title
    side_by_side: Callable[[Mapping[str, xr.Dataset], Mapping[str, Events]], list[Picture]]
