"""How time passes in a simulation: steps of a fixed length, or steps that control their own error."""

from __future__ import annotations

import dataclasses
from typing import Annotated, Literal, Protocol

import pydantic

from fingerslip.errors import InputError
from fingerslip.parameters import Number, PositiveDuration, parameters

NumericalDamping = Annotated[Number, pydantic.Field(ge=-0.5, le=0.0)]
SchemeName = Annotated[
    Literal["hht_alpha", "quasi_static"],
    "Implicit dynamics, or steps without inertia of which every one is in equilibrium.",
]
SchemeDamping = Annotated[
    NumericalDamping, "Numerical damping of `hht_alpha`, from -1/2 to 0; quasi-static steps have none."
]
Tolerance = Annotated[Number, pydantic.Field(gt=0.0, lt=1.0)]
#: How many records there are at least while time grows tenfold in a hold.
RecordsPerDecade = Annotated[int, pydantic.Field(ge=1, le=1000)]

#: Steps that a press or a slide needs, nodes across a contact, and the share of it that may begin to slip in one step.
LEAST_STEPS, LEAST_ACROSS, LARGEST_SHARE = 25, 10, 0.2

_ALPHA = -0.05
# The longest time between records over the shortest step, where that is not given.
_FINEST = 16


class Timing(Protocol):
    """What a model needs to know of its time integration."""

    @property
    def step(self) -> float:
        """Time step [s]."""

    @property
    def end(self) -> float | None:
        """End of the simulation [s]; None for the end of the programme."""


@parameters
class TimeStepping:
    """HHT-alpha time integration at a fixed step.

    See :func:`simulate`.
    """

    step: Annotated[PositiveDuration, "Time step [s]."]
    alpha: Annotated[NumericalDamping, "Numerical damping, from -1/2 to 0; 0 is the trapezoidal rule."] = _ALPHA
    end: Annotated[
        PositiveDuration | None,
        "End of the simulation [s], a multiple of the step; without it the end of the programme.",
    ] = None


@parameters
class QuasiStatic:
    """Steps without inertia: every step is in equilibrium.

    Supports or contact have to hold the body, and no counterface may be driven by a force.

    See :class:`Model`.
    """

    step: Annotated[PositiveDuration, "Time step [s]."]
    end: Annotated[
        PositiveDuration | None,
        "End of the simulation [s], a multiple of the step; without it the end of the programme.",
    ] = None


@parameters
class Adaptive:
    """Steps that control their own error, and records at times that are chosen apart from them.

    Between two knots of the programme and of all ramps there is a whole number of records, and every step ends at or
    before the next of them. See docs/solver.md for the estimates of the error.

    Examples
    --------
    Steps from 0.6 ms up, and a record at least every 10 ms:

    >>> import fingerslip as fs
    >>> timing = fs.Adaptive(output=10e-3, tolerance=1e-4)
    >>> timing.shortest
    0.000625
    """

    output: Annotated[
        PositiveDuration, "Longest time between records, in holds with `records_per_decade` the first one there [s]."
    ]
    tolerance: Annotated[
        Tolerance,
        "Largest estimated error of a step over the largest displacement so far, both as root of the mean square over "
        "the body, weighted by mass. Of quasi-static steps that of all steps since the last knot together, about.",
    ] = 1e-3
    scheme: SchemeName = "hht_alpha"
    alpha: SchemeDamping = _ALPHA
    smallest: Annotated[
        PositiveDuration | None,
        "Shortest step [s]; without it 1/16 of `output`. Behind every knot the steps begin with it. It is taken "
        "whatever its error; the history's attributes say how often that was above the tolerance.",
    ] = None
    largest: Annotated[
        PositiveDuration | None, "Longest step [s]; without it as long as the tolerance and the records allow."
    ] = None
    records_per_decade: Annotated[
        RecordsPerDecade | None,
        "Logarithmic records where nothing moves and no load changes: how many there are at least while the time "
        "since the last knot grows tenfold. Without it they are even there, too.",
    ] = None
    end: Annotated[PositiveDuration | None, "End of the simulation [s]; without it the end of the programme."] = None

    def __post_init__(self) -> None:
        if self.scheme == "quasi_static" and self.alpha != _ALPHA:
            raise InputError("alpha", f"got {self.alpha:g} for quasi-static steps", "may not be given", "leave it out")
        if self.shortest > 0.5 * self.output:
            fault = f"got {self.shortest:g} s for records every {self.output:g} s"
            allowed = "needs at most half the time between records"
            raise InputError("smallest", fault, allowed, f"write {0.5 * self.output:g} s or less, or leave it out")
        if self.largest is not None and self.largest < 2 * self.shortest:
            fault = f"got {self.largest:g} s where the shortest step is {self.shortest:g} s"
            allowed = "needs at least twice the shortest step"
            raise InputError("largest", fault, allowed, f"write {2 * self.shortest:g} s or more, or leave it out")
        if self.end is not None and self.end < self.output:
            fault = f"got {self.output:g} s for a run of {self.end:g} s"
            raise InputError("output", fault, "needs at most the length of the run", f"write {self.end:g} s or less")

    @property
    def step(self) -> float:
        """Longest time between even records [s]."""
        return self.output

    @property
    def shortest(self) -> float:
        """Shortest step [s]."""
        return self.output / _FINEST if self.smallest is None else self.smallest

    def refined(self, factor: float) -> Adaptive:
        """Return settings whose steps and times between records are those of these times a factor.

        The estimated error grows with the third power of a dynamic step, and beside what is allowed of it with a
        quasi-static step itself.
        """
        order = 1 if self.scheme == "quasi_static" else 3
        return dataclasses.replace(
            self,
            output=factor * self.output,
            tolerance=factor**order * self.tolerance,
            smallest=factor * self.shortest,
            largest=None if self.largest is None else factor * self.largest,
        )

    def fixed(self, step: float) -> TimeStepping | QuasiStatic:
        """Return the same integration at a fixed step [s]."""
        if self.scheme == "quasi_static":
            return QuasiStatic(step, self.end)
        return TimeStepping(step, self.alpha, self.end)


def shortest_step(time: Timing) -> float:
    """Return the shortest step that a time integration takes [s], where every step is solved."""
    return time.shortest if isinstance(time, Adaptive) else time.step
