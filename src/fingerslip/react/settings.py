"""The block `reaction` of a study: an object that is held, what notices slip, and which reactions are tried."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Annotated

import pydantic

from fingerslip.contact.friction import Coulomb
from fingerslip.errors import InputError, Mistakes, unknown_name
from fingerslip.model.model import Contact
from fingerslip.model.timing import TimeStepping, Timing
from fingerslip.parameters import PositiveDuration, ShortDuration, parameters
from fingerslip.react.detectors import DetectorChoice, SlippedArea
from fingerslip.react.loads import LoadSeries
from fingerslip.react.reflex import REACTIONS, Actuator, Reaction, Reflex, require_whole_step
from fingerslip.react.scenario import HeldObject, ObjectSettings

_DETECTORS = {"48 % slipped": SlippedArea()}
# Where a study has what a held object has beside its settings.
_IN_STUDY = {"friction": "contact.friction_coefficient", "step": "time.step"}


@parameters
class ReactionSettings(ObjectSettings):
    """An object between the body of a study and its mirror image, and what may save it.

    Its friction is that of the study's contact, its step that of the study's time. Where a sweep has a run with the
    study's own values, `reactions` and `latencies` are tried there alone, and in all runs elsewhere.

    Examples
    --------
    >>> settings = ReactionSettings(mass=0.1, reactions=("human-slip", "servo"))
    >>> list(settings.named_reactions)
    ['human-slip', 'servo']
    """

    detectors: Annotated[Mapping[str, DetectorChoice], "What notices slip; the first one is that of the answer."] = (
        pydantic.Field(default_factory=lambda: dict(_DETECTORS))
    )
    reflex: Annotated[
        Reflex,
        "How the grip rises in the search for the critical latency. If it has a latency itself, it is tried as a "
        "reaction in all runs.",
    ] = Reflex()
    actuator: Annotated[Actuator, "What moves the fingers in this search."] = Actuator()
    reactions: Annotated[tuple[str, ...], "Names of reactions that ship, which are tried after every detector."] = ()
    latencies: Annotated[
        tuple[ShortDuration, ...], "Latencies after the alarm of the first detector whose travel is computed [s]."
    ] = ()
    tolerance: Annotated[PositiveDuration, "Largest error of a critical latency [s]."] = 1e-3

    def __post_init__(self) -> None:
        mistakes = Mistakes()
        if not self.detectors:
            repair = "leave it out for 48 % slipped"
            mistakes.found.append(InputError("detectors", "has none", "needs one or more", repair))
        for number, name in enumerate(self.reactions):
            if name not in REACTIONS.names:
                mistakes.found.append(unknown_name(f"reactions.{number}", name, REACTIONS.names))
        if any(first >= second for first, second in itertools.pairwise(self.latencies)):
            texts = ", ".join(f"{latency:g} s" for latency in self.latencies)
            mistakes.found.append(InputError("latencies", f"got {texts}", "needs ascending numbers"))
        mistakes.raise_all()

    @property
    def detector(self) -> str:
        """Name of the detector of the answer."""
        return next(iter(self.detectors))

    @property
    def groups(self) -> tuple[str, ...]:
        """Groups of sites that its detectors need."""
        return tuple(group for detector in self.detectors.values() for group in detector.groups)

    @property
    def rise(self) -> Reaction:
        """How the grip rises in the search for the critical latency."""
        return Reaction(self.reflex, self.actuator)

    @property
    def named_reactions(self) -> Mapping[str, Reaction]:
        """The reactions that are tried, by name."""
        shipped = {name: REACTIONS.read(name) for name in self.reactions}
        return shipped | ({"this reflex": self.rise} if self.reflex.latency else {})

    @property
    def computed_runs(self) -> int:
        """About how many runs it takes: one without a reaction, four in the search of each rise, and what is tried."""
        n_named = len(self.named_reactions)
        return 1 + 4 * (1 + n_named) + n_named * len(self.detectors) + len(self.latencies)

    def without_trials(self) -> ReactionSettings:
        """Return the search for the critical latency, with no reaction but its own."""
        return replace(self, reactions=(), latencies=())

    def beside(self, folder: Path) -> ReactionSettings:
        """Return settings whose load has what its file has, which is named from a folder."""
        file = self.load.file if isinstance(self.load, LoadSeries) else None
        if file is None:
            return self
        if not (folder / file).is_file():
            raise InputError(
                "reaction.load.load_series.file", f"'{file}' is not there", "needs a file beside the study"
            )
        try:
            return replace(self, load=LoadSeries.read(folder / file))
        except InputError as error:
            raise error.moved(lambda where: f"reaction.load.load_series.file: {where}") from None

    def held_object(self, contact: Contact, time: Timing) -> HeldObject:
        """Return the object under a contact of a study at its steps; errors stand where they are in the study."""
        if not isinstance(contact.friction, Coulomb):
            fault, repair = f"is {type(contact.friction).__name__}", "write friction_coefficient: 0.6"
            raise InputError("contact.friction", fault, "needs Coulomb friction under a held object", repair)
        if not isinstance(time, TimeStepping):
            raise InputError("time", f"is {type(time).__name__}", "needs fixed steps with inertia under a held object")
        if time.end is not None:
            raise InputError("time.end", "is given with reaction", "needs none: it follows from the load")
        values = {field.name: getattr(self, field.name) for field in fields(ObjectSettings)}
        try:
            held = HeldObject(**values, friction=contact.friction.coefficient, step=time.step)
            self._check_reactions(held)
        except InputError as error:
            names = {**_IN_STUDY, **{f"HeldObject.{name}": path for name, path in _IN_STUDY.items()}}
            raise error.moved(lambda where: names.get(where, f"reaction.{where.removeprefix('HeldObject.')}")) from None
        return held

    def _check_reactions(self, held: HeldObject) -> None:
        """Refuse reactions that are quicker than a step, or cannot even hold the first grip."""
        for number, latency in enumerate(self.latencies):
            require_whole_step(f"latencies.{number}", latency, held.step)
        self.rise.response(0.0, held.first_grip)
        for number, reaction in enumerate(self.named_reactions.values()):
            prefix = f"reactions.{number}." if number < len(self.reactions) else ""
            try:
                require_whole_step("reflex.latency", reaction.reflex.latency, held.step)
                reaction.response(0.0, held.first_grip)
            except InputError as error:
                raise error.moved(lambda where, prefix=prefix: f"{prefix}{where}") from None  # type: ignore[misc]
