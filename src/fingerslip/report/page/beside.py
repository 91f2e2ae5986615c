"""What the answer of a report says of published values: how far off, what was calibrated, what cannot be compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from fingerslip.published import PublishedSet, PublishedValue
from fingerslip.results import RunResult
from fingerslip.slip.windows import LATENCY

__all__ = ["published_rows_beside"]


@dataclass(frozen=True)
class _Pair:
    """A published time and that of a run which meets its conditions, both [s]; None where it did not happen."""

    published: PublishedValue
    ours: float | None
    is_calibrated: bool

    @property
    def span(self) -> tuple[float, float]:
        """The smallest and the largest published time."""
        assert self.published.value is not None  # held by _pairs
        return self.published.span or (self.published.value, self.published.value)

    @property
    def change(self) -> float | None:
        """How much later ours is [ms], 0 within a published range."""
        return None if self.ours is None else 1e3 * (self.ours - min(max(self.ours, self.span[0]), self.span[1]))


def published_rows_beside(runs: Sequence[RunResult], references: Sequence[PublishedSet]) -> tuple[str, ...]:
    """Put overall slip, incipient slip and latency from accumulated slip beside published times, in plain sentences."""
    overall, incipient, latency = (_pairs(runs, references, name) for name in ("overall", "incipient", LATENCY))
    second = _sentence([part for part in (_early(incipient), _left(latency)) if part])
    reasons = dict.fromkeys(pair.published.otherwise for pair in (*incipient, *latency) if pair.published.otherwise)
    third = f"These do not compare like with like: {'; '.join(reasons)}." if second and reasons else ""
    return tuple(sentence for sentence in (_overall(overall), second, third) if sentence)


def _pairs(runs: Sequence[RunResult], references: Sequence[PublishedSet], quantity: str) -> list[_Pair]:
    """Return published times that runs meet the conditions of; one that several sets have counts once."""
    found = {
        (run.name, value.span or value.value): _Pair(
            value, run.events.slip.time(quantity), value.is_calibrated(run.all_values)
        )
        for run in runs
        for reference in references
        for value in reference.values
        if value.quantity == quantity and value.reading in ("", "slip") and value.value is not None
        if value.holds_for(run.all_values)
    }
    return list(found.values())


def _sentence(parts: Sequence[str]) -> str:
    text = ", and ".join(parts)
    return f"{text[0].upper()}{text[1:]}." if text else ""


def _overall(pairs: Sequence[_Pair]) -> str:
    if not pairs:
        return ""
    known = [pair.change for pair in pairs if pair.change is not None]
    if not known:
        return "Overall slip, for which a time is published, is not reached."
    one, lacking, calibrated = len(pairs) == 1, len(pairs) - len(known), sum(pair.is_calibrated for pair in pairs)
    said = f"Beside {'the published time' if one else f'{len(pairs)} published times'}, overall slip {_off(known)}"
    missing = f"; it is not reached in {lacking} of these runs" if lacking else ""
    fitted = f"; the model was calibrated on {'it' if one else f'{calibrated} of them'}" if calibrated else ""
    return f"{said}{missing}{fitted}."


def _early(pairs: Sequence[_Pair]) -> str:
    known = [pair.change for pair in pairs if pair.change is not None]
    if not known:
        return ""
    return f"incipient slip {_off(known)}{' than published' if _are_off(known) else ' with the published one'}"


def _left(pairs: Sequence[_Pair]) -> str:
    known = [pair for pair in pairs if pair.ours is not None]
    if not known:
        return ""
    ours = _span([1e3 * pair.ours for pair in known if pair.ours is not None])
    theirs = _span([1e3 * end for pair in known for end in pair.span])
    return f"{ours} ms are left to react, against {theirs} ms published"


def _are_off(changes: Sequence[float]) -> bool:
    return any(abs(change) >= 0.5 for change in changes)


def _off(changes: Sequence[float]) -> str:
    """Say how much later or earlier times are [ms]."""
    if not _are_off(changes):
        return "agrees to the millisecond"
    low, high = min(changes), max(changes)
    if low < -0.5 and high > 0.5:
        return f"comes {-low:.0f} ms earlier to {high:.0f} ms later"
    sizes = [abs(change) for change in changes]
    return f"comes {_span(sizes)} ms {'later' if high > 0.5 else 'earlier'}"


def _span(values: Sequence[float]) -> str:
    low, high = f"{min(values):.0f}", f"{max(values):.0f}"
    return low if low == high else f"{low} to {high}"
