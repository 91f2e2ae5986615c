"""The answer: one or two plain sentences with the numbers of what was run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from fingerslip.published import published_set
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
    first, second = said  # and no word about error bars, which are there
    assert first.startswith("The whole contact slips 0.710 s after the slide begins, 1.710 s after the start of the ")
    assert first.endswith("run (± 4 ms, numerical).")
    assert second == "From incipient slip on, 610 ms are left to react."


def test_a_sweep_says_where_it_slips_first_and_last_and_the_trend() -> None:
    times = {0.2: 1.2, 0.4: 1.4, 0.8: 1.9}
    runs = [run(str(mu), time, swept={"contact.friction_coefficient": mu}) for mu, time in times.items()]
    first, second, third = answer(study(*runs), dict.fromkeys(map(str, times), 1.0))
    assert first == (
        "Over 3 runs that differ in friction coefficient, the whole contact slips between 0.200 s (friction "
        "coefficient 0.2) and 0.900 s (friction coefficient 0.8) after the slide begins, the later the larger the "
        "friction coefficient."
    )
    assert second == "From incipient slip on, 100 to 800 ms are left to react."
    assert third == "These times have no error bars yet: fingerslip converge finds them."


@pytest.mark.parametrize(
    ("step", "since", "latency"), [(0.5, "0.7 s", "600 ms"), (0.02, "0.71 s", "610 ms"), (1e-4, "0.712 s", "612 ms")]
)
def test_times_have_the_digits_that_the_step_allows(step: float, since: str, latency: str) -> None:
    first, second, *_ = answer(study(run("a", 1.7118, numbers={"slide_step_s": step})), {"a": 1.0})
    assert first.startswith(f"The whole contact slips {since} after")
    assert f", {latency} are left" in second


def test_what_is_too_coarse_is_said() -> None:
    numbers = {"slide_records": 4, "slipped_share_of_one_step": 0.53, "nodes_across_contact": 6.0}
    steps, share, nodes = answer(study(run("a", 1.71, numbers=numbers)), {"a": 1.0})[2:5]
    assert steps == "Too coarse for the times of slip: a (4 steps in the slide): take a smaller step."
    assert "a (53 % of the contact slips in one step)" in share
    assert "a (6 nodes across the contact): take smaller elements" in nodes


def test_without_inertia_millimetres_come_first_and_nobody_reacts() -> None:
    numbers = {"overall_travel_m": 2.13e-3, "latency_travel_m": 1.1e-3}
    values = {"time.scheme": "quasi_static"}
    said = answer(study(run("a", 1.71, numbers=numbers, values=values)), {"a": 1.0})
    assert said[0].startswith("The whole contact slips after 2.13 mm of travel, 0.710 s after the slide begins")
    assert said[1] == "From incipient slip on, the plate travels 1.10 mm, 610 ms at the speed of this slide."
    assert not any("react" in sentence for sentence in said)


def test_no_trend_is_claimed_where_there_is_none() -> None:
    runs = [run(v, t, swept={"mesh.contact_size": v}) for v, t in (("1 mm", 1.2), ("2 mm", 1.1), ("3 mm", 1.3))]
    assert "the later" not in answer(study(*runs), {one.name: 1.0 for one in runs})[0]


def test_what_does_not_slip_and_what_does_not_slide_is_said() -> None:
    assert "overall slip is not reached" in answer(study(run("a", None)), {"a": 1.0})[0]
    mixed = answer(study(run("a", None), run("b", 1.5)), {"a": 1.0, "b": 1.0})
    assert mixed[-2] == "In 1 of 2 runs overall slip is not reached."
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
    table2 = published_set("wang2014-table2")
    value = next(value for value in table2.values if value.quantity == "overall")
    own = run("a", overall, values={**value.conditions, **value.programme})
    assert any(words in sentence for sentence in answer(study(own), {"a": 1.0}, [table2]))
