"""One figure of a history by its name, for scripts and notebooks; it draws what ``fingerslip figure`` does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

import xarray as xr
from matplotlib.figure import Figure

from fingerslip.afferents.model import AfferentModel
from fingerslip.errors import InputError
from fingerslip.report.content import OF_RUNS, RunSubject
from fingerslip.report.figures.style import looking
from fingerslip.report.page.pictures import draw_of_run
from fingerslip.slip import Events, find_events


def draw(
    history: xr.Dataset,
    kind: str = "composed",
    *,
    events: Events | None = None,
    title: str = "",
    times: Sequence[float] = (),
    afferents: Mapping[str, AfferentModel] | None = None,
    style: Literal["page", "paper", "slides"] = "page",
) -> Figure:
    """Draw a figure of a history.

    Parameters
    ----------
    history : xarray.Dataset
        What :func:`fingerslip.simulate` or :func:`fingerslip.read_history` returned.
    kind : str, optional
        Its name, one of those that ``fingerslip figure`` lists for a run: ``composed`` has stimulus, contact, spikes
        and forces on one axis of time.
    events : Events, optional
        The events that are marked; those of :func:`fingerslip.find_events` without it.
    title : str, optional
        What the title adds; figures for papers have none.
    times : sequence of float, optional
        Times of the panels of ``deformed`` and ``slip-frames`` [s].
    afferents : mapping of str to AfferentModel, optional
        Models of afferents by type of receptor, for ``spikes`` and ``composed``; without them those of
        :func:`fingerslip.human_afferents`.
    style : {'page', 'paper', 'slides'}, optional
        How large it is, and its letters: ``paper`` has the widths of journal columns, and letters at its panels.

    Returns
    -------
    matplotlib.figure.Figure
        The figure; :func:`fingerslip.save_figure` writes it with fonts that can be edited.

    Raises
    ------
    InputError
        For a kind that is not there, or that shows histories of another dimension.
    ResultError
        Where the history lacks what the figure shows, such as snapshots.

    Examples
    --------
    Of a history with receptors::

        fs.save_figure(fs.draw(history, "spikes", style="paper"), "spikes.pdf")
    """
    if kind not in OF_RUNS:
        raise InputError("kind", f"got '{kind}'", f"needs one of {', '.join(OF_RUNS)}")
    marked = find_events(history) if events is None else events
    with looking(style):
        return draw_of_run(kind, RunSubject(history, marked, times=tuple(times), title=title, afferents=afferents))
