"""The pictures of the answer."""

from __future__ import annotations

from fingerslip.report.page.hero import are_held, hero_pictures, swept_pictures
from fingerslip.results import result_of
from unit.report.page.contents import content_of, two_runs
from unit.report.scenes import block_history
from unit.synthetic import Process, make


def test_a_sweep_answers_with_latency_and_events() -> None:
    content = two_runs(starts={"0.4": 1.0, "0.6": 1.0})
    assert [picture.name for picture in hero_pictures(content)] == [
        "latency-contact-friction-coefficient", "events-contact-friction-coefficient",
    ]  # fmt: skip
    times = swept_pictures(content)[1].figure
    assert times.get_supylabel() == "time from the start of the slide [s]"


def test_a_single_run_answers_with_its_section_or_its_contact() -> None:
    for element in ("Q4", "T4"):
        history = block_history(element)
        (picture,) = hero_pictures(content_of((result_of(history, "run", {}),), {"run": history}))
        assert picture.name == "answer"
    history = make(Process())
    assert hero_pictures(content_of((result_of(history, "run", {}),), {"run": history})) == ()
    assert not are_held({"run": history})
