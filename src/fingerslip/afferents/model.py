"""Models of tactile afferents: what every one answers, a leaky integrate-and-fire one, and which a history resolves."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Annotated, Protocol

import numpy as np
import pydantic
import xarray as xr
from scipy import signal

from fingerslip.afferents import signals
from fingerslip.arrays import Floats
from fingerslip.errors import InputError
from fingerslip.history import site_kinds
from fingerslip.parameters import Duration, PositiveDuration, Rate, parameters
from fingerslip.parameters.presets import Presets
from fingerslip.parameters.schema import require, require_kind
from fingerslip.sites import RECEPTOR_KINDS


class AfferentModel(Protocol):
    """A model of an afferent: arrays in, spike times out.

    A model of someone else's becomes one by two attributes and one method; nothing else of this package is needed.
    """

    @property
    def stimulus(self) -> str:
        """What it responds to: one of :data:`~fingerslip.afferents.signals.STIMULI`, or its rate ``NAME_rate``."""

    @property
    def highest_frequency(self) -> float:
        """Highest frequency of the stimulus that matters to it [Hz]."""

    def spikes(self, times: Floats, values: Floats) -> Sequence[Floats]:
        """Return the spike times [s] of each receptor, from times (n,) [s] and the stimulus (n, k) in SI units."""


def beyond_records(models: Mapping[str, AfferentModel], history: xr.Dataset) -> dict[str, float]:
    """Return how high [Hz] the types go that respond to higher frequencies than the records resolve."""
    resolved = signals.record_bandwidth(history)
    return {kind: model.highest_frequency for kind, model in models.items() if model.highest_frequency > resolved}


def check_models(models: Mapping[str, AfferentModel]) -> None:
    """Refuse what are no models of afferents."""
    require_kind(models, Mapping, "a model by the name of each receptor type, such as {'SA-I': model}", "models")
    for kind, model in models.items():
        needs = "stimulus, highest_frequency [Hz] and spikes(times, values)"
        require(model, AfferentModel, needs, kind)  # type: ignore[type-abstract]
        if model.stimulus.removesuffix("_rate") not in signals.STIMULI:
            allowed = f"needs one of {', '.join(signals.STIMULI)}, or the rate of one, such as speed_rate"
            raise InputError(f"{kind}.stimulus", f"'{model.stimulus}' is not known", allowed)
        if not 0.0 < model.highest_frequency < np.inf:
            fault = f"got {model.highest_frequency} Hz"
            raise InputError(f"{kind}.highest_frequency", fault, "needs a number above 0 Hz", "write for example 200.0")


#: What figures and files say of all spikes that the project's models make.
CAVEAT = "fitted to monkeys, thresholds are rough (of FA-I the least of 39): counts are no result"


def spike_notes(kinds: Iterable[str], beyond: Mapping[str, float], history: xr.Dataset) -> list[str]:
    """Say which recorded types are left out of some, and which respond to more than the records resolve."""
    recorded = dict.fromkeys(kind for kind in map(str, site_kinds(history)) if kind in RECEPTOR_KINDS)
    absent = [kind for kind in recorded if kind not in {*kinds, *resolved_afferents(history)}]
    highest = max((human_afferents()[kind].highest_frequency for kind in absent), default=0.0) / _OF_BANDWIDTH
    needs = {
        f"steps of {signals.step_text(highest)}" if highest else "": highest > signals.record_bandwidth(history),
        "a body with damping": not _is_damped(history),
    }
    lacking = " and ".join(words for words, is_needed in needs.items() if is_needed)
    left_out = f"{', '.join(absent)} left out: vibrations need {lacking}"
    types = ", ".join(f"{kind} ({highest:.0f} Hz)" for kind, highest in beyond.items())
    unresolved = f"{types} respond to more than the {signals.record_bandwidth(history):.3g} Hz that records resolve"
    return [*[left_out] * bool(absent), *[unresolved] * bool(beyond)]


_Positive = Annotated[float, pydantic.Field(gt=0)]
_NotNegative = Annotated[float, pydantic.Field(ge=0)]

# Steps of the membrane are at most these shares of its time constant and of the rest after a spike.
_OF_MEMBRANE, _OF_REST = 0.02, 0.2
# Scale of the inhibition after a spike, and how long it lasts [s].
_INHIBITION_TIME, _INHIBITED = 1e-3, 38e-3


@parameters
class IntegrateAndFire:
    """One type of afferent, as a leaky integrate-and-fire model.

    The stimulus s is low-passed and drives a membrane with the time constant tau ::

        tau dV/dt = -V + |s| / s_0 + |ds/dt| / r_0

    that fires when V reaches 1, falls to 0 and does not rise for a while. So s_0 and r_0 are the least steady stimulus,
    and the least steady rate of it, at which an afferent fires; uninhibited, under a drive d > 1, it fires every
    tau ln(d / (d - 1)) and its rest. Drives saturate, d c / (d + c), and t after a spike, u = ln(1 + t / 1 ms), lack ::

        a_early b(u) + a_late b(u - ln 9),  b(x) = (1 + cos(min(3 pi |x| / ln 81, pi))) / 2

    as in the model of Saal et al. (2017): the first ends after 3.3 ms, the second is largest at 8 ms and ends at 38 ms.

    Parameters
    ----------
    stimulus : str
        What it responds to: one of :data:`~fingerslip.afferents.signals.STIMULI`, or its rate ``NAME_rate``.
    least_steady : float, optional
        Least steady stimulus at which it fires [SI unit of the stimulus]; None where it does not respond to that.
    least_rate : float, optional
        Least steady rate of the stimulus at which it fires [the same per second]; None likewise.
    highest_frequency : float
        Cutoff of the low pass of third order on the stimulus [Hz].
    membrane_time : float
        Time constant of the membrane [s].
    rest : float
        Time after a spike in which there is no other [s].
    delay : float
        Time from the receptor to where spikes are counted [s].
    saturation : float, optional
        Largest drive of the membrane c [of the least steady one]; None where it has no limit.
    early_inhibition, late_inhibition : float
        What a spike takes from the drive soon and later, a_early and a_late [of the least steady one].

    Raises
    ------
    InputError
        Where it responds to nothing.

    Examples
    --------
    A steady speed of twice the least one, so that it fires every tau ln 2 and its rest:

    >>> import numpy as np
    >>> import fingerslip as fs
    >>> model = fs.IntegrateAndFire("speed", highest_frequency=300.0, membrane_time=10e-3, least_steady=1e-3)
    >>> times = np.linspace(0.0, 0.1, 1001)
    >>> (spikes,) = model.spikes(times, np.full((1001, 1), 2e-3))
    >>> np.diff(spikes)[:3].round(4).tolist()
    [0.008, 0.008, 0.008]
    """

    stimulus: str
    highest_frequency: Rate
    membrane_time: PositiveDuration
    least_steady: _Positive | None = None
    least_rate: _Positive | None = None
    rest: Duration = 1e-3
    delay: Duration = 0.0
    saturation: _Positive | None = None
    early_inhibition: _NotNegative = 0.0
    late_inhibition: _NotNegative = 0.0

    def __post_init__(self) -> None:
        if self.least_steady is None and self.least_rate is None:
            raise InputError("least_steady", "is missing, and least_rate too", "needs one of the two")

    def spikes(self, times: Floats, values: Floats) -> Sequence[Floats]:
        """Return the spike times [s] of k receptors, from times (n,) [s] and the stimulus (n, k)."""
        # Only spikes need what compiles.
        from fingerslip.afferents.membranes import fire

        times, values = np.asarray(times, dtype=float), np.asarray(values, dtype=float)
        fine = np.linspace(times[0], times[-1], int(np.ceil((times[-1] - times[0]) / self.longest_step)) + 1)
        low = np.stack([np.interp(fine, times, column) for column in values.T], axis=1)
        # What is above the highest frequency goes, from rest at the first value.
        step = fine[1] - fine[0]
        if (sections := self.low_pass(1.0 / step)) is not None:
            low = signals.filter_from_rest(low, sections, 0)
        # By steps since the last spike; the last entry, of one long ago, is 0.
        inhibition = self.inhibition(step * np.arange(0.5, _INHIBITED / step + 2.0))
        left, resting = np.exp(-step / self.membrane_time), round(self.rest / step)
        drive = self.drive(low, np.gradient(low, fine, axis=0))
        # Under the mean drive of each step.
        rows, columns = fire(0.5 * (drive[1:] + drive[:-1]), left, resting, inhibition).nonzero()
        return [fine[1:][rows[columns == column]] + self.delay for column in range(low.shape[1])]

    @property
    def longest_step(self) -> float:
        """Longest step of its membrane [s]."""
        return min(_OF_MEMBRANE * self.membrane_time, _OF_REST * self.rest or np.inf)

    def low_pass(self, rate: float) -> Floats | None:
        """Return the sections (n, 6) of its low pass at a rate [1/s]; None where that holds nothing to be left out."""
        if self.highest_frequency >= 0.5 * rate:
            return None
        return np.asarray(signal.butter(signals.ORDER, self.highest_frequency, fs=rate, output="sos"))

    def drive(self, values: Floats, rates: Floats) -> Floats:
        """Return what low-passed stimuli and their rates, of one shape, drive membranes with [-]."""
        drive = np.zeros_like(values)
        if self.least_steady is not None:
            drive += np.abs(values) / self.least_steady
        if self.least_rate is not None:
            drive += np.abs(rates) / self.least_rate
        return drive if self.saturation is None else drive / (1.0 + drive / self.saturation)

    def inhibition(self, since: Floats) -> Floats:
        """Return what spikes so long ago [s] take from the drive [-]."""
        logarithm = np.log1p(since / _INHIBITION_TIME)
        early, late = (
            0.5 + 0.5 * np.cos(np.minimum(1.5 * np.pi / np.log(9.0) * np.abs(logarithm - peak), np.pi))
            for peak in (0.0, np.log(9.0))
        )
        return np.asarray(self.early_inhibition * early + self.late_inhibition * late)


#: Afferents that ship.
AFFERENTS = Presets(IntegrateAndFire, "fingerslip.afferents")


def human_afferents() -> Mapping[str, IntegrateAndFire]:
    """Return models of the four types of afferent for the human fingertip, by type.

    Time constants, filters, inhibition and delays were fitted to afferents of monkeys (Saal et al. 2017), for SA-II
    those of SA-I are taken. Thresholds are calibrated on published ones of a pin, of FA-I on the least of 39 of humans
    (``fingerslip.afferents.model.AFFERENTS.table`` says of every value where it comes from).

    Examples
    --------
    >>> import fingerslip as fs
    >>> sorted(fs.human_afferents())
    ['FA-I', 'FA-II', 'SA-I', 'SA-II']
    """
    return MappingProxyType({kind: AFFERENTS.read(kind.lower()) for kind in RECEPTOR_KINDS})


def answering_models(
    history: xr.Dataset, models: Mapping[str, AfferentModel] | None = None
) -> dict[str, AfferentModel]:
    """Return those of the models that a history resolves whose receptors it records, with strain."""
    resolved = resolved_afferents(history, models)
    signals.check_kinds(history, models or (), "afferents")
    recorded = dict.fromkeys(map(str, site_kinds(history))) if "strain" in history else {}
    return {kind: resolved[kind] for kind in recorded if kind in resolved}


# Vibrations of up to so many times what records resolve still have rates that err by some per cent.
_OF_BANDWIDTH = 2.0


def _is_damped(history: xr.Dataset) -> bool:
    return any(np.any(history[name].values) for name in ("damping_dissipation", "viscous_dissipation"))


def resolved_afferents(
    history: xr.Dataset, models: Mapping[str, AfferentModel] | None = None
) -> dict[str, AfferentModel]:
    """Return the models, those of the human fingertip or others, whose stimulus a history resolves.

    Strain is slow where slip is. Models of motion, such as those of FA-II, need records that resolve half of their
    highest frequency, and a body with damping: without it, it chatters as no tissue does. :func:`spike_notes` names
    every type beyond the records.
    """
    highest = _OF_BANDWIDTH * signals.record_bandwidth(history) if _is_damped(history) else 0.0
    every = human_afferents() if models is None else models
    check_models(every)
    return {
        kind: model
        for kind, model in every.items()
        if model.stimulus not in signals.MOTIONS or model.highest_frequency <= highest
    }
