"""Signals at receptors: what the tissue does there, filters, spectra, and how far a simulation resolves them."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np
import xarray as xr
from scipy import signal

from fingerslip.arrays import Floats
from fingerslip.errors import InputError, ResultError
from fingerslip.history import full_tensors, site_kinds, sites_of_kinds
from fingerslip.model.model import Model
from fingerslip.parameters.schema import require_kind
from fingerslip.sites import RECEPTOR_KINDS

# What others call the types of receptors.
_OTHER_NAMES = {
    **dict.fromkeys(("SA1", "SA-1", "SAI"), "SA-I"),
    **dict.fromkeys(("RA", "RA1", "RA-I", "FA1", "FAI"), "FA-I"),
    **dict.fromkeys(("PC", "RA2", "RA-II", "FA2", "FAII"), "FA-II"),
    **dict.fromkeys(("SA2", "SA-2", "SAII"), "SA-II"),
}


def check_kinds(history: xr.Dataset, kinds: Iterable[str], where: str) -> None:
    """Refuse types of receptors that are neither known nor recorded."""
    names = tuple(dict.fromkeys((*RECEPTOR_KINDS, *map(str, site_kinds(history)))))
    for kind in kinds:
        if kind not in names:
            repair = f"write {_OTHER_NAMES[kind]}" if kind in _OTHER_NAMES else ""
            raise InputError(where, f"'{kind}' is not known", f"needs some of {', '.join(names)}", repair)


def receptor_stimuli(history: xr.Dataset, kinds: Sequence[str] = RECEPTOR_KINDS) -> xr.Dataset:
    """Return what the tissue does at the recorded receptors.

    See :func:`spikes_of`.

    Parameters
    ----------
    history : xarray.Dataset
        A history with receptors.
    kinds : sequence of str, optional
        Receptor types.

    Returns
    -------
    xarray.Dataset
        The variables of :data:`STIMULI`, dimensions (time, site), with `units` and `long_name`, and for each its rate
        ``NAME_rate``: differences over two steps, over one at both ends. Coordinates are time [s], site and site_kind.

    Raises
    ------
    InputError
        For a type that is neither known nor recorded.
    ResultError
        Where no receptor of these types was recorded, or the history is of a version that recorded no strain.
    """
    require_kind(history, xr.Dataset, "a history, which simulate returns", "history")
    check_kinds(history, kinds, "kinds")
    rows = sites_of_kinds(history, kinds)
    if not rows.size:
        raise ResultError(f"history: has no receptor of the types {', '.join(kinds)}, needs one; record receptors")
    if "strain" not in history:
        raise ResultError("history: holds no strain at the sites, needs it; run the study again with this version")
    at, dims = history.isel(site=rows), ("time", "site")
    times, variables = at["time"].values, {}
    for name, (units, meaning, stimulus) in STIMULI.items():
        values = stimulus(at)
        rate = np.gradient(values, times, axis=0) if times.size > 1 else np.zeros_like(values)
        changing = {"units": f"{units}/s", "long_name": f"rate of {meaning}"}
        variables[name] = xr.Variable(dims, values, {"units": units, "long_name": meaning})
        variables[f"{name}_rate"] = xr.Variable(dims, rate, changing)
    return xr.Dataset(variables, coords={name: at[name] for name in ("time", "site", "site_kind")})


def _equivalent_strain(at: xr.Dataset) -> Floats:
    """Return sqrt(2/3 e:e) of the deviator e of the strain tensor."""
    strain = full_tensors(at["strain"])
    mean = np.trace(strain, axis1=-2, axis2=-1) / 3.0
    deviator = strain - mean[..., None, None] * np.eye(3)
    return np.asarray(np.sqrt(2.0 / 3.0 * (deviator**2).sum(axis=(-2, -1))))


def _principal(at: xr.Dataset, which: int) -> Floats:
    """Return a principal strain, numbered from the smallest; NaN where the strain across the plane is not known."""
    strain = full_tensors(at["strain"])
    finite = np.asarray(np.isfinite(strain).all(axis=(-2, -1), keepdims=True))
    # Eigenvalues of a tensor with NaN are numbers that mean nothing.
    principal = np.linalg.eigvalsh(np.where(finite, strain, 0.0))
    return np.asarray(np.where(finite[..., 0, 0], principal[..., which], np.nan))


#: Name of each stimulus with its SI unit, its meaning, and how a history gives it.
STIMULI: Mapping[str, tuple[str, str, Callable[[xr.Dataset], Floats]]] = {
    "strain_energy_density": ("J/m^3", "strain energy density", lambda at: at["strain_energy_density"].values),
    "equivalent_strain": ("1", "equivalent strain, sqrt(2/3 e:e) of the deviator", _equivalent_strain),
    "largest_strain": ("1", "largest principal strain", lambda at: _principal(at, 2)),
    "smallest_strain": ("1", "smallest principal strain", lambda at: _principal(at, 0)),
    "pressure": ("Pa", "hydrostatic pressure", lambda at: -at["stress"].values[..., :3].mean(axis=-1)),
    "speed": ("m/s", "speed of the tissue", lambda at: np.linalg.norm(at["velocity"], axis=-1)),
    "acceleration": (
        "m/s^2",
        "acceleration of the tissue",
        lambda at: np.linalg.norm(at["acceleration"], axis=-1),
    ),
}
#: Those that are motions, in which vibrations are, with their rates.
MOTIONS = ("speed", "acceleration", "speed_rate", "acceleration_rate")


ORDER = 3  # of low passes and high passes
# Steps that differ by less than this share are equal.
_SAME = 1e-6


def filter_band(values: xr.DataArray, low: float | None = None, high: float | None = None) -> xr.DataArray:
    """Return a signal over time, at equal steps, without what is below `low` and above `high` [Hz].

    The filter is a Butterworth filter of third order that looks back only, as a receptor does, and starts at rest at
    the first value. Without one of the ends the band is open on that side.
    """
    rate = _rate(values)
    for name, frequency in (("low", low), ("high", high)):
        if frequency is not None and not 0.0 < frequency < 0.5 * rate:
            raise InputError(name, f"got {frequency:g} Hz", f"must be above 0 and below {0.5 * rate:g} Hz")
    if low is not None and high is not None and low >= high:
        raise InputError("low", f"got {low:g} Hz", f"must be below high, {high:g} Hz")
    axis, signals = values.get_axis_num("time"), values.values
    for frequency, kind in ((high, "lowpass"), (low, "highpass")):
        if frequency is not None:
            signals = filter_from_rest(signals, signal.butter(ORDER, frequency, kind, fs=rate, output="sos"), axis)
    return values.copy(data=signals)


def spectrum(values: xr.DataArray) -> xr.DataArray:
    """Return the one-sided power spectral density of a signal over time, at equal steps [its unit squared per Hz].

    It is that of the signal without its mean, under a Hann window, over ``frequency`` [Hz]; its integral is the
    variance of the windowed signal. Take a phase with ``.sel(time=slice(start, end))``.
    """
    rate, axis = _rate(values), values.get_axis_num("time")
    frequency, density = signal.periodogram(values.values, rate, window="hann", axis=axis)
    others = {name: coord for name, coord in values.coords.items() if "time" not in coord.dims}
    dims = ["frequency" if name == "time" else name for name in values.dims]
    units = values.attrs.get("units", "")
    powers = xr.DataArray(density, {**others, "frequency": frequency}, dims, attrs={"units": f"({units})^2/Hz"})
    powers["frequency"].attrs = {"units": "Hz"}
    return powers


def filter_from_rest(values: Floats, sections: Floats, axis: int) -> Floats:
    """Return values after a filter of second-order sections (n, 6), from a state at rest at the first value."""
    by_time = np.moveaxis(values, axis, 0)
    rest = signal.sosfilt_zi(sections).reshape(len(sections), 2, *([1] * (by_time.ndim - 1))) * by_time[0]
    return np.asarray(np.moveaxis(signal.sosfilt(sections, by_time, axis=0, zi=rest)[0], 0, axis))


def _rate(values: xr.DataArray) -> float:
    """Return how many records there are a second."""
    steps = np.diff(values["time"].values)
    if not steps.size or np.ptp(steps) > _SAME * steps.mean():
        raise InputError("time", "steps differ", "needs equal ones", "interpolate the signal first")
    return 1.0 / float(steps.mean())


# At 20 steps a period the trapezoidal rule errs by (2 pi/20)^2 / 12 of the period, 0.8 %.
STEPS_A_PERIOD = 20.0
# At 10 linear elements a wavelength, waves are too fast or too slow by about (2 pi/10)^2 / 24, 1.6 %.
_ELEMENTS_A_WAVE = 10.0


class BandwidthWarning(UserWarning):
    """A question asks for higher frequencies than the simulation resolves."""


def record_bandwidth(history: xr.Dataset) -> float:
    """Return up to which frequency [Hz] records resolve a signal: 20 a period, at the longest of their steps."""
    times = history["time"].values
    return 1.0 / (STEPS_A_PERIOD * float(np.diff(times).max())) if times.size > 1 else 0.0


def mesh_bandwidth(model: Model) -> dict[str, float]:
    """Return up to which frequency [Hz] the mesh carries shear waves through each region: 10 edges a wave.

    Shear waves are the slowest, of speed sqrt(G/rho) with G a third of the material's `stiffness`, as in nearly
    incompressible tissue. The longest edge of a region counts; rigid regions without a material have no entry.
    """
    limits, mesh = {}, model.mesh
    corners = mesh.p[:, mesh.t[: mesh.refdom.nnodes]]
    pairs = mesh.refdom.edges if mesh.dim() == 3 else mesh.refdom.facets
    # The longest distance between two corners of a cell that share an edge, (n_cells,) [m].
    longest = np.max([np.linalg.norm(corners[:, a] - corners[:, b], axis=0) for a, b in map(tuple, pairs)], axis=0)
    for region, material in model.materials.items():
        speed = np.sqrt(material.stiffness / (3.0 * material.density))
        limits[region] = float(speed / (_ELEMENTS_A_WAVE * longest[mesh.subdomains[region]].max()))
    return limits


def warn_beyond(history: xr.Dataset, highest: float, what: str) -> None:
    """Warn where a question asks for a higher frequency [Hz] than the records resolve."""
    bandwidth = record_bandwidth(history)
    if highest > bandwidth:
        resolved = f"the records resolve {bandwidth:.3g} Hz; a step of {step_text(highest)} would do"
        warnings.warn(f"{what} reaches {highest:g} Hz, and {resolved}", BandwidthWarning, stacklevel=3)


def step_text(highest: float) -> str:
    """Write the longest step that resolves a frequency [Hz], rounded down.

    Examples
    --------
    >>> step_text(324.0)
    '0.15 ms'
    """
    step = 1e3 / (STEPS_A_PERIOD * highest)
    unit = 10.0 ** (math.floor(math.log10(step)) - 1)
    return f"{math.floor(step / unit * (1.0 + 1e-9)) * unit:.2g} ms"
