"""How time passes, in a study file."""

from __future__ import annotations

import dataclasses
from typing import Annotated, Literal

import pydantic

from fingerslip.errors import InputError
from fingerslip.parameters import PositiveDuration, parameters
from fingerslip.timing import Adaptive, NumericalDamping, QuasiStatic, RecordsPerDecade, TimeStepping, Tolerance

__all__ = ["TimeSettings"]

_ALPHA = -0.05
# What only steps that control their own error have.
_OF_AUTO = ("output", "tolerance", "smallest", "largest", "records_per_decade")


def _step_kind(value: object) -> str:
    return "auto" if value == "auto" else "Duration"


#: The length of a step, or steps that control their own error.
StepSettings = Annotated[
    Annotated[PositiveDuration, pydantic.Tag("Duration")] | Annotated[Literal["auto"], pydantic.Tag("auto")],
    pydantic.Discriminator(_step_kind),
]


@parameters
class TimeSettings:
    """How time passes.

    Parameters
    ----------
    step : float or 'auto'
        Time step [s], or steps that control their own error.
    scheme : {'hht_alpha', 'quasi_static'}
        Implicit dynamics, or steps without inertia of which every one is in equilibrium.
    alpha : float
        Numerical damping of `hht_alpha`, from -1/2 to 0; quasi-static steps have none.
    end : float, optional
        End of the simulation [s]; without it the end of the programme.
    output : float, optional
        Of steps that control their own error: longest time between records, in holds with `records_per_decade` the
        first one there [s].
    tolerance : float, optional
        Of these, largest error over the largest displacement; see :class:`~fingerslip.timing.Adaptive`.
    smallest, largest : float, optional
        Shortest and longest of these steps [s].
    records_per_decade : int, optional
        Logarithmic records in holds: how many there are at least while the time in the hold grows tenfold.
    """

    step: StepSettings
    scheme: Literal["hht_alpha", "quasi_static"] = "hht_alpha"
    alpha: NumericalDamping = _ALPHA
    end: PositiveDuration | None = None
    output: PositiveDuration | None = None
    tolerance: Tolerance | None = None
    smallest: PositiveDuration | None = None
    largest: PositiveDuration | None = None
    records_per_decade: RecordsPerDecade | None = None

    def __post_init__(self) -> None:
        if self.scheme == "quasi_static" and self.alpha != _ALPHA:
            raise InputError("alpha", f"got {self.alpha:g} for quasi-static steps", "may not be given", "leave it out")
        for name in _OF_AUTO:
            if self.step != "auto" and getattr(self, name) is not None:
                repair = "write step: auto, or leave it out"
                raise InputError(name, "is given with a fixed step", "belongs to step: auto", repair)
        if self.step == "auto" and self.output is None:
            raise InputError("output", "is missing", "step: auto needs the time between records", "write output: 5 ms")
        _check_stepping(self)

    @property
    def stepping(self) -> TimeStepping | QuasiStatic | Adaptive:
        """The time stepping of the model."""
        if self.step == "auto":
            given = {name: getattr(self, name) for name in _OF_AUTO if getattr(self, name) is not None}
            return Adaptive(**given, scheme=self.scheme, alpha=self.alpha, end=self.end)
        if self.scheme == "quasi_static":
            return QuasiStatic(self.step, self.end)
        return TimeStepping(self.step, self.alpha, self.end)

    def refined(self, factor: float) -> TimeSettings:
        """Return settings whose steps are those of these times a factor; see :meth:`Adaptive.refined`."""
        if self.step != "auto":
            return dataclasses.replace(self, step=factor * self.step)
        finer = self.stepping
        assert isinstance(finer, Adaptive)
        finer = finer.refined(factor)
        changed = {name: getattr(finer, name) for name in ("output", "tolerance", "smallest", "largest")}
        return dataclasses.replace(self, **changed)


def _check_stepping(settings: TimeSettings) -> None:
    """Refuse what makes no time integration, under its name in the study file."""
    try:
        assert settings.stepping
    except InputError as error:
        raise error.moved(lambda where: where.removeprefix("Adaptive.")) from None
