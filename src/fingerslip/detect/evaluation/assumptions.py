"""What papers do not print and has to be assumed, as it may be, and trials of one condition alone."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from fingerslip.detect.features import MotionSettings
from fingerslip.detect.labels import LabelSettings
from fingerslip.detect.samples import left_out
from fingerslip.detect.trials import TrialSet, condition_text


@dataclass(frozen=True)
class Assumption:
    """Values that a paper does not print, as they may be."""

    quantity: str  # what is assumed, in words
    value: str
    labels: LabelSettings | str = field(default_factory=LabelSettings)
    motion: MotionSettings = field(default_factory=MotionSettings)
    noise: float = 0.0  # standard deviation of noise that is added to all positions, in the unit of the tracks
    trials: tuple[str, ...] = ()  # names of the trials that it is about, as others are not like them

    @property
    def inputs(self) -> dict[str, object]:
        """Its values without its words."""
        return {name: value for name, value in asdict(self).items() if name not in ("quantity", "value")}


#: Sizes of a pixel that are likely, too [m].
_PIXELS = (0.045e-3, 0.09e-3)


def likely_assumptions(
    metres_per_pixel: float, motion: MotionSettings, stored: Sequence[str] = ()
) -> tuple[Assumption, ...]:
    """Return what may be assumed of the trials of Cordova Bulens et al. 2023: first as they are, then one change each.

    A pixel of another size [m] makes the printed thresholds, 2 and 1 px, other lengths; that is all it does here. The
    noise stays as it is in metres.
    """
    default = LabelSettings(rest_frames=motion.rest_frames)
    base = Assumption("as in the data set", f"{1e3 * metres_per_pixel:.3g} mm a pixel", default, motion)

    def changed(quantity: str, value: str, **values: Any) -> Assumption:
        return replace(base, quantity=quantity, value=value, **values)

    def thresholds(share: float, *names: str) -> LabelSettings:
        return replace(default, **{name: share * getattr(default, name) for name in names})

    sizes = {f"{1e3 * size:.3g} mm": thresholds(size / metres_per_pixel, "incipient", "gross") for size in _PIXELS}
    windows = (max(2, motion.window // 3), 3 * motion.window)
    return (
        base,
        *(changed("size of a pixel", words, labels=labels) for words, labels in sizes.items()),
        *(
            changed(f"threshold of {name} slip", f"{share * value:g} px", labels=thresholds(share, name))
            for name, value in (("incipient", default.incipient), ("gross", default.gross))
            for share in (0.5, 2.0)
        ),
        *(changed("labels", name.replace("_", " "), labels=name) for name in stored),
        *(changed("frames in a speed", f"{frames}", motion=replace(motion, window=frames)) for frames in windows),
        changed("noise of positions", "0.1 px more", noise=0.1),
    )


def each_alone(trials: TrialSet, conditions: Sequence[str], base: Assumption) -> tuple[Assumption, ...]:
    """Return an assumption for each combination of the values of conditions: trials of these alone are there.

    Where a condition is a value of the sensor that a paper does not print, such as the stiffness of its skin, each is
    another sensor: to learn from all of them together would ask something else.
    """
    groups = [left_out(trials.conditions, condition) for condition in conditions]
    assumptions = []
    for values in itertools.product(*groups) if groups else ():
        inside = set(trials.names).intersection(*(group[value] for group, value in zip(groups, values, strict=True)))
        names = tuple(name for name in trials.names if name in inside)
        words = ", ".join(condition_text(key, value) for key, value in zip(conditions, values, strict=True))
        assumptions += [replace(base, quantity="trials alone of", value=words, trials=names)] if names else []
    return tuple(assumptions)
