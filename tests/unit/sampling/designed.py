"""Studies whose output is a known function of sampled values between 0 and 1."""

from collections.abc import Callable, Sequence
from pathlib import Path

from fingerslip.results import SAMPLE, Quantity, RunResult, StudyResult
from fingerslip.slip.events import Events
from fingerslip.study.definition.sweep import SampleSettings, drawn


def study_of(
    function: Callable[[Sequence[float]], float | None], dim: int, method: str, count: int, choices: Sequence[str] = ()
) -> StudyResult:
    """Return a study with the derived quantity ``y`` of the values ``a.0``, ``a.1`` ... and the choice ``word``."""
    ranges = {f"a.{number}": (0.0, 1.0) for number in range(dim)}
    words = {"word": tuple(choices)} if choices else {}
    settings = SampleSettings(ranges, count=count, method=method, choices=words)
    runs = tuple(
        RunResult(
            f"sample-{number}",
            {SAMPLE: number},
            Events(),
            sampled=sampled,
            derived={"y": Quantity("y", "m", function(list(sampled.values())))},
        )
        for number, sampled in enumerate(drawn(settings), start=1)
    )
    return StudyResult(Path("study"), (), runs, ranges=ranges, design=settings.design)
