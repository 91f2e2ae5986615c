"""How the load on a held object changes: what there is beside its weight, in newtons over seconds."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Annotated

import numpy as np
import pydantic

from fingerslip.errors import InputError
from fingerslip.parameters import Duration, Force, Mass, PositiveDuration, PositiveLength, one_of, parameters
from fingerslip.react.reflex import ForceRate, PositiveForce
from fingerslip.units import Unit, parse_quantity
from fingerslip.vision.tracks import read_csv

GRAVITY = 9.81
_PULSE_KNOTS = 9
_UNITS = {"time": "s", "force": "N"}


@parameters
class StepLoad:
    """A force that comes at once.

    Examples
    --------
    >>> import fingerslip as fs
    >>> fs.StepLoad(force=1.0).series()
    ((0.0, 0.001), (0.0, 1.0))
    """

    force: Annotated[Force, "The force [N]."]
    rise: Annotated[PositiveDuration, "How long it takes to come [s]."] = 1e-3

    def series(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return times [s] and forces [N]."""
        return (0.0, self.rise), (0.0, self.force)


@parameters
class RampLoad:
    """A force that grows evenly, as that of a motor or of what is poured into a vessel.

    Examples
    --------
    >>> import fingerslip as fs
    >>> fs.RampLoad(rate=4.0, force=1.0).series()  # 4 N/s up to 1 N
    ((0.0, 0.25), (0.0, 1.0))
    """

    rate: Annotated[ForceRate, "How fast it grows [N/s]."]
    force: Annotated[PositiveForce, "What it grows to [N]."]

    def series(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return times [s] and forces [N]."""
        return (0.0, self.force / self.rate), (0.0, self.force)


@parameters
class DroppedBall:
    """A ball that falls into the object: a pulse in the form of half a sine, then its weight.

    Examples
    --------
    >>> import fingerslip as fs
    >>> times, forces = fs.DroppedBall(mass=0.02, height=0.1).series()
    >>> f"{max(forces):.1f} N, then {forces[-1]:.2f} N"
    '4.6 N, then 0.20 N'
    """

    mass: Annotated[Mass, "Mass of the ball [kg]."]
    height: Annotated[PositiveLength, "How deep it falls [m]."]
    contact_time: Annotated[PositiveDuration, "How long the pulse lasts [s]."] = 10e-3

    def series(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return times [s] and forces [N]."""
        shares = np.linspace(0.0, 1.0, _PULSE_KNOTS)
        pulse = np.sin(np.pi * shares)
        momentum = self.mass * np.sqrt(2.0 * GRAVITY * self.height)
        # Linear between its knots, the pulse has exactly the momentum of the ball.
        peak = momentum / (self.contact_time * np.mean(0.5 * (pulse[1:] + pulse[:-1])))
        forces = peak * pulse + self.mass * GRAVITY * shares
        return tuple((self.contact_time * shares).tolist()), tuple(forces.tolist())


@parameters
class FilledVessel:
    """A vessel that is filled: the weight of what is in it, and the blow of the jet as long as it flows.

    The vessel's inertia stays that of the object.

    Examples
    --------
    >>> import fingerslip as fs
    >>> times, forces = fs.FilledVessel(mass=0.1, flow=0.05).series()
    >>> [f"{time:.3f} s: {force:.2f} N" for time, force in zip(times, forces)]
    ['0.000 s: 0.00 N', '0.005 s: 0.07 N', '2.000 s: 1.05 N', '2.005 s: 0.98 N']
    """

    mass: Annotated[Mass, "Mass that is poured in [kg]."]
    flow: Annotated[float, Unit("kg/s"), pydantic.Field(gt=0), "Mass that is poured in a second [kg/s]."]
    height: Annotated[PositiveLength, "How deep it falls [m]."] = 0.1
    rise: Annotated[PositiveDuration, "How long the blow takes to come, and to go [s]."] = 5e-3

    def __post_init__(self) -> None:
        if self.mass <= self.flow * self.rise:
            allowed = f"needs more than flows in while the blow comes, {self.flow * self.rise:g} kg"
            raise InputError("mass", f"got {self.mass:g} kg", allowed, "pour more, or more slowly")

    def series(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return times [s] and forces [N]."""
        blow, full = self.flow * np.sqrt(2.0 * GRAVITY * self.height), self.mass / self.flow
        first, last = GRAVITY * self.flow * self.rise + blow, GRAVITY * self.mass
        return (0.0, self.rise, full, full + self.rise), (0.0, float(first), float(last + blow), last)


@parameters
class LoadSeries:
    """A force that was recorded: its times and forces, or the file that has them.

    Examples
    --------
    >>> import fingerslip as fs
    >>> pull = fs.LoadSeries(times=(0.0, 0.1, 0.4), forces=(0.0, 1.0, 0.5))
    >>> fs.HeldObject(mass=0.1, load=pull).load.series()
    ((0.0, 0.1, 0.4), (0.0, 1.0, 0.5))
    """

    times: Annotated[tuple[Duration, ...], "Ascending times, the first 0 [s]."] = ()
    forces: Annotated[tuple[Force, ...], "The force at each [N]."] = ()
    file: Annotated[
        str | None,
        "A file of comma-separated values with the columns `time [s]` and `force [N]`, or other units of these; "
        "of a study beside its file.",
    ] = None

    def __post_init__(self) -> None:
        if self.file is not None:
            if self.times or self.forces:
                raise InputError("file", "is given with times or forces", "needs one of the two")
            return
        falls = next((f", {late:g} s after {early:g} s" for early, late in pairwise(self.times) if late <= early), "")
        if not self.times or len(self.times) != len(self.forces) or falls or self.times[0] != 0.0:
            first = f", the first at {self.times[0]:g} s" if self.times else ""
            fault = f"got {len(self.times)} times and {len(self.forces)} forces{falls or first}"
            raise InputError("times", fault, "needs ascending times from 0 s on, a force for each")

    def series(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return times [s] and forces [N]; those of a file are read each time, see :meth:`read`."""
        return (self.times, self.forces) if self.file is None else self.read(self.file).series()

    @classmethod
    def read(cls, path: str | Path) -> LoadSeries:
        """Return the force of a CSV file with the columns `time [s]` and `force [N]`, or other units of these."""
        table = read_csv(Path(path)).rename(columns=str.strip)
        allowed = "needs one column time and one force, with their units"
        series: list[tuple[float, ...]] = []
        for name, si in _UNITS.items():
            headings = [text for text in table.columns if text.startswith(f"{name} [") and text.endswith("]")]
            if len(headings) != 1:
                repair = "write the first line as time [s],force [N], each with the unit of its numbers"
                raise InputError(str(path), f"has the columns {', '.join(table.columns)}", allowed, repair)
            heading = headings[0]
            unit = heading.partition(" [")[2][:-1]
            factor = parse_quantity(f"1 {unit}", si, where=f"{path}: column '{heading}'")
            if table[heading].dtype.kind not in "if" or table[heading].isna().any():
                raise InputError(str(path), f"has no numbers in '{heading}'", allowed, "write a number in every row")
            series.append(tuple((factor * table[heading].to_numpy(dtype=float)).tolist()))
        try:
            return cls(series[0], series[1])
        except InputError as error:
            raise error.moved(lambda where: f"{path}: {where.removeprefix('LoadSeries.')}") from None


BuiltInLoad = StepLoad | RampLoad | FilledVessel | DroppedBall | LoadSeries
#: A load as a parameter; files write ``ramp_load: {...}``.
LoadChoice = Annotated[
    BuiltInLoad,
    one_of(BuiltInLoad, "load", "LoadChoice", "A load, under the key that names its kind; exactly one is given."),
]
