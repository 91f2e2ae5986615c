"""How well records and nodes resolve slip."""

from __future__ import annotations

import pytest

from fingerslip.slip import read_measures
from fingerslip.slip.resolution import resolution_warnings
from unit.synthetic import END, PRESS_END, SPEED, Process, make


@pytest.mark.parametrize(("step", "nodes", "warnings"), [(5e-3, 41, 0), (0.1, 41, 2), (5e-3, 5, 2)])
def test_what_resolves_a_slide_is_read_off_and_judged(step: float, nodes: int, warnings: int) -> None:
    numbers = read_measures(make(Process(step=step, nodes=nodes, jump=False)))
    assert numbers["slide_records"] == round((END - PRESS_END) / step)
    assert numbers["slide_step_s"] == pytest.approx(step)
    assert numbers["nodes_across_contact"] == nodes
    texts = resolution_warnings({"a run": numbers})
    assert len(texts) == warnings
    assert all(text.startswith("Too coarse for the times of slip: a run (") for text in texts)


def test_many_coarse_runs_are_counted() -> None:
    runs = {f"run {number}": {"slide_records": 10} for number in range(5)}
    (text,) = resolution_warnings(runs)
    assert "run 2 (10 steps in the slide) and 2 more: take a smaller step" in text


def test_travel_is_that_of_the_plate_between_the_events() -> None:
    history = make(Process(jump=False))
    numbers = read_measures(history)
    assert numbers["overall_travel_m"] == pytest.approx(SPEED * (1.71 - PRESS_END) + 20e-6, rel=1e-3)
    assert numbers["latency_travel_m"] == pytest.approx(SPEED * 0.9 * 0.41, rel=0.03)
    assert read_measures(make(Process(centre=2.5)))["overall_travel_m"] is None
