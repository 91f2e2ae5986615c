"""Which pictures a report shows of a kind of runs: sections, or fingertips in space."""

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
    """A run as pictures need it.

    Parameters
    ----------
    name : str
        Its name, with which the names of its pictures begin.
    title : str
        Its title, which the titles of its pictures have.
    history : xarray.Dataset
        Its history.
    events : Events
        Its slip events.
    """

    name: str
    title: str
    history: xr.Dataset
    events: Events


@dataclass(frozen=True)
class RunPictures:
    """Pictures of one run that were drawn before its report is made.

    Parameters
    ----------
    contact : tuple of DrawnPicture or None
        Those of the section that shows it in detail; None where they were not drawn.
    model : tuple of DrawnPicture or None
        Those of its model at the start; None where they were not drawn.
    """

    contact: tuple[DrawnPicture, ...] | None = None
    model: tuple[DrawnPicture, ...] | None = None


@dataclass(frozen=True)
class PictureSet:
    """The pictures that a report shows of a kind of runs.

    Parameters
    ----------
    model : callable
        Gets a run and its mesh; returns the pictures of the model at the start.
    run : callable
        Gets a run; returns the pictures of its contact.
    side_by_side : callable
        Gets histories and events by title; returns the pictures that compare runs.
    """

    model: Callable[[RunToDraw, skfem.Mesh], list[Picture]]
    run: Callable[[RunToDraw], list[Picture]]
    side_by_side: Callable[[Mapping[str, xr.Dataset], Mapping[str, Events]], list[Picture]]
