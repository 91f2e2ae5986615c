"""Draw the figures of docs/validation.md from stored results.

`python docs/figures/make_reference.py` runs what this needs, and this with it. By hand:
First: fingerslip validate && fingerslip run studies/wang2014_peaks.yaml studies/wang2014_accidents.yaml
Then: python docs/figures/make_figures.py [RESULTS]
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fingerslip.contact.states import OPEN
from fingerslip.history import read_history
from fingerslip.report.colours import EVENT_COLOURS
from fingerslip.slip import (
    EventSettings,
    acceleration_peaks,
    find_events,
    peak_signal,
    relative_displacement,
    slide_window,
    slipped_fraction,
    sustained_crossing,
)

FOLDER = Path(__file__).parent
SETTINGS = EventSettings()
VARIANTS = ("original", "flattened", "scaled")
COLOURS = ("#0072b2", "#d55e00", "#009e73")
PUBLISHED_INCIPIENT = {"original": 1.53, "flattened": 1.50, "scaled": 1.48}
PUBLISHED_OVERALL = {"original": 1.71, "flattened": 1.72, "scaled": 1.77}
COARSE = ("0.5", "0.55", "0.6", "0.65", "0.7")
SIZES = ("0.6 mm", "0.3 mm", "0.12 mm")
FRICTIONS = (0.2, 0.4, 0.6, 0.8)


def main(results: Path) -> None:
    """Draw all figures."""
    mpl.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False})
    save(peaks_figure(results / "wang2014_peaks"), "validation-peaks.png")
    save(accidents_figure(results / "wang2014_accidents"), "validation-accidents.png")
    save(models_figure(results), "validation-models.png")
    save(friction_figure(results / "wang2014_friction"), "validation-friction.png")


def save(figure: Figure, name: str) -> None:
    """Write a figure beside this script."""
    figure.savefig(FOLDER / name, dpi=110)


def history_of(folder: Path) -> xr.Dataset:
    """Read the history of a run."""
    return read_history(folder / "history.nc")


def peaks_figure(study: Path) -> Figure:
    """Draw the acceleration signal over three contact meshes, with the moments at which nodes let go."""
    figure = Figure(figsize=(8.0, 5.6), layout="constrained")
    axes = figure.subplots(len(SIZES), 1, sharex=True, sharey=True)
    for axis, size in zip(axes, SIZES, strict=True):
        history = history_of(study / f"contact_size-{size.replace(' ', '')}_alpha--0.41421")
        draw_peaks(axis, history)
        axis.set_title(f"contact elements of {size}", loc="left", fontsize=9)
    axes[1].set_ylabel("largest tangential acceleration of FA-I and SA-I [m/s²]")
    axes[-1].set_xlabel("time [s]; ticks below: a contact node lets go")
    return figure


def accidents_figure(study: Path) -> Figure:
    """Draw all acceleration peaks of the three phalanges over the size of the contact elements."""
    figure = Figure(figsize=(8.0, 3.0), layout="constrained")
    axes = figure.subplots(1, len(VARIANTS), sharey=True)
    for axis, variant, colour in zip(axes, VARIANTS, COLOURS, strict=True):
        for size in COARSE:
            found = acceleration_peaks(history_of(study / f"contact_size-{size}mm_variant-{variant}"))
            assert found.largest is not None
            times = [peak.time for peak in found.peaks]
            axis.plot(times[:-1], np.full(len(times) - 1, float(size)), "|", color=colour, markersize=9)
            axis.plot(times[-1], float(size), "o", color=colour, markersize=4)
        for moment in (PUBLISHED_INCIPIENT[variant], PUBLISHED_OVERALL[variant]):
            axis.axvline(moment, color="0.3", linewidth=0.8, linestyle="--", zorder=0)
        axis.set(xlim=(1.0, 1.85), xlabel="time [s]")
        axis.set_title(variant, loc="left", fontsize=9)
    axes[0].set(ylabel="contact elements [mm]", yticks=[float(size) for size in COARSE])
    return figure


def draw_peaks(axis: Axes, history: xr.Dataset) -> None:
    """Draw the signal of one run, and a tick for every node that begins to lag the plate."""
    signal = peak_signal(history, SETTINGS.peaks)
    assert signal is not None  # these runs slide and record receptors
    axis.plot(signal["time"], signal, color=COLOURS[0], linewidth=1.0)
    axis.plot(leaving_times(history), np.full(len(leaving_times(history)), -0.003), "|", color="0.3", markersize=5)
    axis.axvline(1.53, color=COLOURS[1], linewidth=0.8, linestyle="--")
    axis.text(1.528, 0.048, "published incipient peak, 0.054 m/s²", color=COLOURS[1], fontsize=8, va="top", ha="right")
    axis.set(xlim=(1.1, 1.75), ylim=(-0.006, 0.05))


def leaving_times(history: xr.Dataset) -> list[float]:
    """Return when each node in contact begins to lag the plate by more than 5 micrometres."""
    window = slide_window(history)
    assert window is not None
    times = history["time"].values[window.records]
    touching = history["contact_state"].values[window.first] != OPEN
    lags = relative_displacement(history, window)[:, touching]
    found = (sustained_crossing(times, lag, 5e-6, SETTINGS.sustained) for lag in lags.T)
    return [time for time in found if time is not None]


def models_figure(results: Path) -> Figure:
    """Draw the slipped fraction of the three phalanges in three models, with the published moments of overall slip."""
    models = {
        "plane stress, sagittal": "wang2014_formulation/formulation-plane-stress",
        "plane strain, sagittal": "wang2014_formulation/formulation-plane-strain",
        "plane stress, transverse": "wang2014_section/section-transverse",
    }
    figure = Figure(figsize=(8.0, 3.0), layout="constrained")
    axes = figure.subplots(1, len(models), sharey=True)
    for axis, (title, folder) in zip(axes, models.items(), strict=True):
        for variant, colour in zip(VARIANTS, COLOURS, strict=True):
            history = history_of(results / f"{folder}_variant-{variant}")
            window = slide_window(history)
            assert window is not None
            fraction = slipped_fraction(history, window, SETTINGS.slip_tolerance)
            axis.plot(fraction["time"], fraction, color=colour, label=variant)
            axis.plot(PUBLISHED_OVERALL[variant], 1.04, "v", color=colour, markersize=5, clip_on=False)
        axis.set(xlim=(1.0, 3.0), ylim=(0.0, 1.08), xlabel="time [s]")
        axis.set_title(title, loc="left", fontsize=9)
    axes[0].set_ylabel("slipped area fraction")
    axes[0].legend(frameon=False, fontsize=8, loc="lower right", title="▾ published overall", title_fontsize=8)
    return figure


def friction_figure(study: Path) -> Figure:
    """Draw incipient, three-quarter and overall slip and latency against friction."""
    figure = Figure(figsize=(8.0, 2.8), layout="constrained")
    moments, latency = figure.subplots(1, 2)
    events = [find_events(history_of(study / f"friction_coefficient-{friction}")) for friction in FRICTIONS]
    for name, mark in (("incipient", "o"), ("three_quarter", "^"), ("overall", "s")):
        times = [getattr(one, name) for one in events]
        moments.plot(FRICTIONS, times, f"{mark}-", color=EVENT_COLOURS[name], label=name.replace("_", "-"))
    published = {"incipient": 1.53, "overall": 1.71}
    for name, time in published.items():
        look = {"markersize": 9, "markerfacecolor": "none", "color": EVENT_COLOURS[name]}
        moments.plot(0.6, time, "D", label=f"published, {name}", linestyle="none", **look)
    moments.set(xlabel="friction coefficient", ylabel="time [s]", xticks=FRICTIONS)
    moments.legend(frameon=False, fontsize=8)
    latency.plot(FRICTIONS, [1e3 * (one.latency or 0.0) for one in events], "o-", color=COLOURS[0], label="ours")
    latency.plot(0.6, 180.0, "kD", markersize=9, markerfacecolor="none", linestyle="none", label="published, at 0.6")
    latency.set(xlabel="friction coefficient", ylabel="latency [ms]", xticks=FRICTIONS, ylim=(0.0, None))
    latency.legend(frameon=False, fontsize=8)
    return figure


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "results"))
