"""What a detector sees after a step, and what it says."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Protocol

import numpy as np

from fingerslip.arrays import Flags, Floats
from fingerslip.contact.states import OPEN, STICK
from fingerslip.errors import InputError
from fingerslip.model.model import Model
from fingerslip.parameters.words import describe_fields
from fingerslip.slip.settings import EventSettings

if TYPE_CHECKING:
    from fingerslip.dynamics.steering.steering import Observation


#: Slip from which a node counts as slipped [m].
SLIPPED = EventSettings().slip_tolerance


@describe_fields
@dataclass(frozen=True)
class Alarm:
    """What a detector says when it notices slip.

    See :class:`Moment`.
    """

    time: Annotated[float, "When, since the load began [s]."]
    value: Annotated[float, "What it measured, such as the share of the contact that has slipped."]


@dataclass(frozen=True)
class Moment:
    """What there is to see after a step.

    Parameters
    ----------
    time : float
        Time since the load began [s].
    observation : Observation
        All that was recorded of the step, by the names of the history.
    areas : (n,) array
        Tributary areas of the contact candidates [m^2].
    slips : (n,) array
        Their slip distances when the load began [m].

    Examples
    --------
    A detector of one's own, and what it says of three nodes of which the last slips:

    >>> import numpy as np
    >>> import fingerslip as fs
    >>> from fingerslip.contact.states import SLIP, STICK
    >>> class Loosened:
    ...     def start(self):
    ...         return self
    ...
    ...     def take(self, moment):
    ...         return fs.Alarm(moment.time, moment.stick_ratio) if moment.stick_ratio < 0.8 else None
    >>> seen = {"contact_state": np.array([STICK, STICK, SLIP])}
    >>> alarm = Loosened().take(fs.Moment(0.1, seen, areas=np.ones(3), slips=np.zeros(3)))
    >>> round(alarm.value, 2)
    0.67
    """

    time: float
    observation: Observation
    areas: Floats
    slips: Floats

    @cached_property
    def touching(self) -> Flags:
        """Which candidates touch, (n,)."""
        return np.asarray(self.observation["contact_state"] != OPEN)

    def slipped_fraction(self, tolerance: float = SLIPPED) -> float:
        """Return the share of the contact area that has slipped by more than a tolerance [m] since the load began."""
        return self._share(self.observation["slip_distance"] - self.slips > tolerance)

    @property
    def stick_ratio(self) -> float:
        """Share of the contact area that sticks."""
        return self._share(self.observation["contact_state"] == STICK)

    @property
    def force_ratio(self) -> float:
        """Tangential over normal force."""
        force = self.observation["counterface_force"][0]
        normal, tangential = abs(force[1]), np.linalg.norm(np.delete(force, 1))
        return float(tangential / normal) if normal > 0.0 else 0.0

    def _share(self, nodes: Flags) -> float:
        area = float(self.areas[self.touching].sum())
        return float(self.areas[nodes & self.touching].sum() / area) if area > 0.0 else 0.0


class Watch(Protocol):
    """A detector at work in one run; it may keep what it saw."""

    def take(self, moment: Moment) -> Alarm | None:
        """Return an alarm, or None, after a step; it may read all that was recorded, `moment.observation`."""


class Detector(Protocol):
    """What notices slip."""

    @property
    def delay(self) -> float:
        """Time from what it measures to its alarm [s], apart from the latency of the reflex."""

    @property
    def groups(self) -> tuple[str, ...]:
        """Kinds of sites that the holder has to record for it."""

    def start(self) -> Watch:
        """Return what watches one run."""


def require_sites(detectors: Mapping[str, Detector], holder: Model, where: str = "detectors") -> None:
    """Refuse detectors that need sites which what holds the object does not record."""
    kinds = {site.kind for site in holder.record.sites}
    # Groups of pins are named by their plural.
    recorded = {*kinds, *(f"{kind.replace(' ', '_')}s" for kind in kinds)}
    for name, detector in detectors.items():
        for missing in (group for group in detector.groups if group not in recorded):
            held = f"the holder has {', '.join(sorted(kinds)) or 'none'}"
            repair = f"write holder_of(..., groups=['{missing}']), or record.sites in a study"
            raise InputError(f"{where}.{name}", f"needs sites of the kind {missing}", held, repair)
