"""The steps of a simulation: their number and times, which of them are kept whole, and what their records take.

Steps that control their error are taken in spans of time between knots of a model. Knots are the times at which a
velocity of the programme, the slope of a ramp or the end says that something changes. A span is divided into a whole
number of units, records lie on multiples of its unit, and steps are powers of two of it: so few lengths of steps occur,
and all of them meet records and knots.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import compress, pairwise

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.errors import InputError
from fingerslip.history import VARIABLES
from fingerslip.linear.resources import available_memory
from fingerslip.materials.material import STRAIN_COMPONENTS
from fingerslip.model.model import Model, Traction
from fingerslip.model.programme import Hold, phase_duration
from fingerslip.model.timing import Adaptive

# Of the length of the simulation: knots that are nearer are one.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Span:
    """A span of time between two knots."""

    start: float  # [s]
    end: float  # [s]
    unit: float  # shortest time between records [s]
    count: int  # records in the span, that at its end included
    # time to the next record over the time since the start, rounded down to a power of two of the unit
    growth: float = 0.0

    def intervals(self) -> Iterator[int]:
        """Yield the time from record to record, in units: powers of two."""
        position = 0
        for _ in range(self.count):
            length = _power(position * self.growth)
            position += length
            yield length

    def record_times(self) -> Floats:
        """Return the times of the records, that at the start excluded, shape (count,) [s]."""
        places = np.cumsum(np.fromiter(self.intervals(), np.float64, self.count))
        times: Floats = self.start + self.unit * places
        times[-1] = self.end
        return times


def spans_of(model: Model, time: Adaptive) -> tuple[Span, ...]:
    """Return the spans of a model from its start to its end."""
    growth = 10.0 ** (1.0 / time.records_per_decade) - 1.0 if time.records_per_decade else 0.0
    programmes = [*model.programmes, *(body.programme for body in model.bodies.values())]
    phases = [(np.cumsum([phase_duration(phase) for phase in programme]), programme) for programme in programmes]
    ramps = [load.ramp for load in model.tractions.values() if isinstance(load, Traction)]
    ramps += [contact.drive.ramp for contact in model.contacts if contact.drive]
    ramps += [load.ramp for body in model.bodies.values() for load in body.loads]
    ramps += [motion.ramp for motion in model.support_motions.values()]

    def is_quiet(start: float, end: float) -> bool:
        """Tell whether nothing is moved and no load changes between two knots."""
        middle = 0.5 * (start + end)
        present = [next(compress(programme, middle < ends), None) for ends, programme in phases]
        moves = any(phase is not None and not isinstance(phase, Hold) for phase in present)
        return not moves and all(ramp.at(start) == ramp.at(end) for ramp in ramps)

    moments = {0.0, *(moment for ramp in ramps for moment in ramp.times)}
    moments |= {moment for ends, _ in phases for moment in ends.tolist()}
    inner = sorted(moment for moment in moments if moment < model.end * (1.0 - _ROUNDING))
    first = [before for before, after in pairwise([*inner, model.end]) if after - before > _ROUNDING * model.end]
    return tuple(
        _span(start, end, time.output, growth if is_quiet(start, end) else 0.0)
        for start, end in pairwise([*first, model.end])
    )


def _power(size: float) -> int:
    """Return the largest power of two up to a size, at least 1."""
    return 1 << max(0, math.floor(math.log2(size))) if size >= 1.0 else 1


def _span(start: float, end: float, output: float, growth: float) -> Span:
    """Divide a span so that its last record is at its end, with units of at most `output` [s]."""
    least = max(1, math.ceil((end - start) / output * (1.0 - _ROUNDING)))
    if not growth:
        return Span(start, end, (end - start) / least, least)
    count = position = 0
    while position < least:
        position += _power(position * growth)
        count += 1
    return Span(start, end, (end - start) / position, count, growth)


def step_count(model: Model) -> int:
    """Return how many whole steps a model takes until its end is reached, or records where steps control their error.

    A given end is reached exactly. The end of the programme may lie within the last step.
    """
    if isinstance(model.time, Adaptive):
        return sum(span.count for span in spans_of(model, model.time))
    steps = model.end / model.time.step
    if steps < 1.0 - 1e-9:
        fault = f"got {model.time.step:g} s for a run of {model.end:g} s"
        raise InputError("time.step", fault, "needs at least one step", "write a smaller step")
    if model.time.end is not None and abs(steps - round(steps)) > 1e-6:
        fault = f"got {model.end:g} s, which is {steps:.4g} steps of {model.time.step:g} s"
        before, after = (model.time.step * count for count in (math.floor(steps), math.ceil(steps)))
        repair = f"write {before:g} s or {after:g} s, or a step of {model.end / math.ceil(steps):.6g} s"
        raise InputError("time.end", fault, "needs a multiple of time.step", repair)
    return math.ceil(steps - 1e-9)


def step_times(model: Model) -> Floats:
    """Return the times of the steps that are recorded, start included, shape (n_steps + 1,) [s]."""
    count = step_count(model) + 1
    require_record_memory(model, count * np.dtype(np.float64).itemsize)
    if isinstance(model.time, Adaptive):
        return np.concatenate([[0.0], *(span.record_times() for span in spans_of(model, model.time))])
    times: Floats = model.time.step * np.arange(count, dtype=np.float64)
    return times


def snapshot_steps(times: Floats, interval: float) -> list[int]:
    """Return the steps nearest to multiples of an interval [s], first and last included; none for an interval of 0."""
    if interval <= 0.0:
        return []
    if times.size < 2 or interval <= float(np.diff(times).min()):
        return list(range(times.size))
    wanted = np.append(np.arange(0.0, times[-1], interval), times[-1])
    after = np.clip(np.searchsorted(times, wanted), 1, times.size - 1)
    nearest = np.where(wanted - times[after - 1] <= times[after] - wanted, after - 1, after)
    return sorted(set(nearest.tolist()))


# Types of variables that are no doubles. For pictures and other programs seven digits are enough, and half the memory.
_TYPES: Mapping[str, type] = {
    "contact_state": np.int8,
    "contact_iterations": np.int32,
    "snapshot_stress": np.float32,
    "snapshot_strain": np.float32,
}


def record_type(name: str) -> type:
    """Return the type of the numbers of a variable of a history."""
    return _TYPES.get(name, np.float64)


def record_bytes(model: Model, nodes: int, candidates: int) -> int:
    """Return what the records of a model will take [bytes], before any are made."""
    dim, count, every = model.mesh.dim(), step_count(model) + 1, model.record.snapshots_every
    snapshots = 0 if every <= 0.0 else int(min(count, model.end / every + 2))
    selected = 8 * count * (len(model.record.sites) * STRAIN_COMPONENTS[dim] + candidates)
    return selected + sum(
        np.dtype(record_type(name)).itemsize * math.prod(shape)
        for name, shape in record_shapes(model, count, snapshots, nodes, candidates).items()
    )


def record_shapes(model: Model, count: int, snapshots: int, nodes: int, candidates: int) -> dict[str, list[int]]:
    """Return the shapes of the variables of a history, by numbers of times, snapshots, nodes and candidates."""
    dim = model.mesh.dim()
    sizes: Mapping[str, int] = {
        "time": count,
        "site": len(model.record.sites),
        "contact_node": candidates,
        "component": dim,
        "stress_component": STRAIN_COMPONENTS[dim] + (dim == 2),
        "counterface": len(model.contacts),
        "rotation_axis": 1 if dim == 2 else 3,
        "rigid_body": len(model.bodies),
        "support": len(model.supports),
        "snapshot_time": snapshots,
        "node": nodes,
        "cell": model.mesh.nelements,
    }
    return {name: [sizes[size] for size in variable.dims] for name, variable in VARIABLES.items()}


def require_record_memory(model: Model, needed: int) -> None:
    """Refuse so many steps or snapshots that the bytes that their records need do not fit into the memory."""
    available = available_memory()
    if available is None or needed <= available:
        return
    fault = f"{step_count(model):.3g} steps of {model.time.step:g} s need about {needed / 1e9:.2g} GB for their records"
    shortest = model.time.step * needed / available
    repair = f"write a step of at least {shortest:.2g} s, record fewer sites, or take fewer snapshots"
    where = "time.output" if isinstance(model.time, Adaptive) else "time.step"
    raise InputError(where, fault, f"{available / 1e9:.2g} GB are available", repair)
