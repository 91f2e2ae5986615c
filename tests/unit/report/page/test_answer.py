"""The answer: one or two plain sentences with the numbers of what was run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from fingerslip.published import published
from fingerslip.report.page.answer import answer
from fingerslip.results import RunResult, StudyResult
from fingerslip.slip import Events, SlipEvents


def run(name: str, overall: float | None, incipient: float | None = 1.1, **more: Any) -> RunResult:
    events = Events(slip=SlipEvents(incipient=incipient, overall=overall))
    return RunResult(name, more.pop("swept", {}), events, **more)


def study(*runs: RunResult, **more: Any) -> StudyResult:
    return StudyResult(Path("s"), (), runs, **more)


def test_a_single_run_says_when_it_slips_and_how_long_there_is_to_react() -> None:
    said = answer(study(run("a", 1.71, uncertainty={"slip.overall": 0.004})), {"a": 1.0})
    first, second = said
    assert first.startswith("The whole contact slips 0.710 s after the slide begins, 1.710 s after the start of the ")
    assert first.endswith("run (± 4 ms, numerical).")
    assert second == "From incipient slip on, 610 ms are left to react."


def test_a_sweep_says_where_it_slips_first_and_last_and_the_trend() -> None:
    times = {0.2: 1.2, 0.4: 1.4, 0.8: 1.9}
    runs = [run(str(mu), time, swept={"contact.friction_coefficient": mu}) for mu, time in times.items()]
    first, second = answer(study(*runs), dict.fromkeys(map(str, times), 1.0))
    assert first == (
        "Over 3 runs that differ in friction coefficient, the whole contact slips between 0.200 s (friction "
        "coefficient 0.2) and 0.900 s (friction coefficient 0.8) after the slide begins, the later the larger the "
        "friction coefficient."
    )
    assert second == "From incipient slip on, 100 to 800 ms are left to react."


def test_no_trend_is_claimed_where_there_is_none() -> None:
    runs = [run(v, t, swept={"mesh.contact_size": v}) for v, t in (("1 mm", 1.2), ("2 mm", 1.1), ("3 mm", 1.3))]
    assert "the later" not in answer(study(*runs), {one.name: 1.0 for one in runs})[0]


def test_what_does_not_slip_and_what_does_not_slide_is_said() -> None:
    assert "overall slip is not reached" in answer(study(run("a", None)), {"a": 1.0})[0]
    mixed = answer(study(run("a", None), run("b", 1.5)), {"a": 1.0, "b": 1.0})
    assert mixed[-1] == "In 1 of 2 runs overall slip is not reached."
    held = run("a", None, numbers={"normal_force_max": 2.0, "normal_force_end": 1.5})
    assert answer(study(held), {}) == (
        "Nothing slides in this study. Of the largest normal force, 2 N, 75 % is left at the end.",
    )
    assert answer(study(run("a", None)), {})[0].startswith("Nothing slides")


def test_samples_have_no_names() -> None:
    runs = [run(f"sample-{n}", 1.5 + 0.1 * n) for n in range(3)]
    said = answer(study(*runs, ranges={"a": (0, 1), "b": (0, 1)}), {one.name: 1.0 for one in runs})[0]
    assert said.startswith("Over 3 samples of 2 uncertain values, the whole contact slips between 0.500 s and 0.700 s")
    assert "sample-" not in said


@pytest.mark.parametrize(("overall", "words"), [(1.71, "agrees to the millisecond"), (1.76, "comes 50 ms later")])
def test_published_times_are_beside_it(overall: float, words: str) -> None:
    table2 = published("wang2014-table2")
    value = next(value for value in table2.values if value.quantity == "overall")
    own = run("a", overall, values={**value.conditions, **value.programme})
    assert any(words in sentence for sentence in answer(study(own), {"a": 1.0}, [table2]))
