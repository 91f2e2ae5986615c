"""Samples whose slip times are known functions of the sampled values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from fingerslip.published import published_set
from fingerslip.results import SAMPLE, RunResult, StudyResult
from fingerslip.slip import Events, SlipEvents
from fingerslip.study.definition.sweep import SampleSettings, drawn

VARIANT = "fingertip.phalanx.variant"
RANGES: dict[str, tuple[Any, Any]] = {
    "contact.clearance": ("0 mm", "0.4 mm"),
    "fingertip.sagittal.half_height": ("6 mm", "7 mm"),
    "fingertip.materials.tissue.poisson_ratio": (0.45, 0.49),
}


def overall(clearance: float, height: float, ratio: float) -> float:
    """Return overall slip [s]: -0.5 s/mm of clearance and 0.1 s/mm of height; the ratio does nothing."""
    return 1.7 - 0.5 * (clearance - 0.2) + 0.1 * (height - 6.5) + 0.0 * ratio


def study_of(
    count: int = 12,
    variants: tuple[str, ...] = ("original",),
    time: Callable[[float, float, float], float | None] = overall,
    compare: str = "wang2014-table2",
) -> StudyResult:
    """Return a study of samples with these times of overall slip; incipient slip is 0.2 s earlier.

    The programme of its runs is that of the published values `compare`.
    """
    samples, programme = drawn(SampleSettings(RANGES, count=count, seed=3)), published_set(compare).values[0].programme
    runs = tuple(
        _run(variant, number, sampled, time, programme)
        for variant in variants
        for number, sampled in enumerate(samples, start=1)
    )
    return StudyResult(Path("study"), (compare,), runs, title="A study", ranges=RANGES)


def _run(
    variant: str,
    number: int,
    sampled: dict[str, Any],
    time: Callable[[float, float, float], float | None],
    programme: Mapping[str, Any],
) -> RunResult:
    numbers = [float(str(value).split()[0]) for value in sampled.values()]
    last = time(*numbers)
    events = SlipEvents() if last is None else SlipEvents(incipient=last - 0.2, overall=last)
    return RunResult(
        f"variant-{variant}_sample-{number:02}",
        {VARIANT: variant, SAMPLE: number},
        Events(events, SlipEvents(recorded=False), SlipEvents(recorded=False)),
        values={"contact.friction_coefficient": 0.6, "fingertip.fingerprint.enabled": False, **programme},
        sampled=sampled,
    )
