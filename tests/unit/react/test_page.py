"""The code of the page on reactions runs as it is printed, and what it says of sensors is so."""

from __future__ import annotations

from pathlib import Path

import pytest

from fingerslip.model.model import Contact
from fingerslip.react.detectors import SlippedArea
from fingerslip.react.latency import critical_start
from fingerslip.react.loads import RampLoad
from fingerslip.react.loop import Grasp
from fingerslip.react.reflex import reaction
from fingerslip.react.scenario import HeldObject, holder_of
from fingerslip.specimens.tactip import PRESETS
from fingerslip.specimens.tactip.meshing.sources import SensorSectionSizes
from places import DOCS
from unit.test_howto import run_page


@pytest.mark.slow
def test_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run_page(DOCS / "reaction.md", tmp_path, monkeypatch)


@pytest.mark.slow
def test_ridges_give_a_sensor_time() -> None:
    held = HeldObject(mass=0.1, load=RampLoad(rate=4.0, force=1.0), step=2e-3)
    sizes, latencies = SensorSectionSizes(contact_size=0.4e-3, bulk_size=1.5e-3), []
    contact = Contact("contact", normal_penalty=5e9, tangential_penalty=5e9, search_distance=6e-3)
    for skin in ("ridged", "smooth"):
        sensor = holder_of(PRESETS.read(f"tactip-{skin}-2d"), sizes, contact=contact, depth=20e-3)
        with Grasp(held, sensor, {"noticed": SlippedArea(0.48)}) as grasp:
            latencies.append(critical_start(grasp, reaction("human-slip")).latency(grasp, "noticed") or 0.0)
    assert latencies == pytest.approx([128e-3, 47e-3], abs=2e-3)
