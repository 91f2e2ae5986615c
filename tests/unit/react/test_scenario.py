"""The object that is held: its grip, its times, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fingerslip.errors import InputError
from fingerslip.materials.elastic import RayleighDamping
from fingerslip.model.model import Contact
from fingerslip.react.loads import RampLoad, StepLoad
from fingerslip.react.scenario import OBJECT, HeldObject, held_model, holder_of
from fingerslip.specimens.choice import SPECIMENS
from fingerslip.specimens.fingertip.meshing.sources import MeshSizes
from fingerslip.specimens.protocol import Specimen
from fingerslip.specimens.tactip.meshing.sources import SensorSectionSizes
from unit.pads import pad

LOAD = RampLoad(rate=4.0, force=2.0)


def test_grip_is_the_margin_over_the_least() -> None:
    held = HeldObject(load=LOAD, mass=0.2, friction=0.5, margin=0.45)
    assert held.first_load == pytest.approx(1.962)
    assert held.first_grip == pytest.approx(1.45 * 1.962)
    assert HeldObject(load=LOAD, weight=1.0, friction=0.5, margin=0.2).first_grip == pytest.approx(1.2)
    assert HeldObject(load=LOAD, weight=1.0, friction=0.5, grip=3.0).first_grip == 3.0


def test_limit_is_reached_when_the_load_is_what_friction_bears() -> None:
    held = HeldObject(load=LOAD, weight=1.0, friction=0.5, margin=0.5)
    assert held.time_to_limit == pytest.approx(0.5 / 4.0)
    assert HeldObject(load=StepLoad(force=0.4), weight=1.0, margin=0.5).time_to_limit is None
    assert held.total_load(0.25) == pytest.approx(2.0)


def test_times_are_whole_steps() -> None:
    held = HeldObject(load=RampLoad(rate=3.0, force=1.0), step=2e-3, rest=0.0511, after=0.1)
    for time in (held.begins, held.duration):
        assert time / held.step == pytest.approx(round(time / held.step))
    assert held.duration >= 1 / 3 + 0.1


def test_model_is_half_of_the_object() -> None:
    held = HeldObject(load=LOAD, mass=0.2, direction=-1)
    body = held_model(held, pad()).bodies[OBJECT]
    grip, weight, load = body.loads
    assert body.mass == 0.1
    assert grip.y * grip.ramp.at(held.begins) == pytest.approx(held.first_grip)
    assert weight.x * weight.ramp.at(held.begins) == pytest.approx(-0.981)
    assert [load.x * load.ramp.at(held.begins + time) for time in (-0.05, 0.0, 0.25)] == pytest.approx([0.0, 0.0, -0.5])
    for rising in (grip, weight):
        assert rising.ramp.factors[0] == 0.0
        assert np.all(np.diff(rising.ramp.factors) > 0.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"grip": 0.8, "weight": 1.0}, "grip: got 0.8 N, needs more than 0.8333 N to hold 1 N; grip harder, or give a"),
        ({"margin": 0.0, "weight": 1.0}, "grip: got 0.8333 N, needs more than 0.8333 N to hold 1 N; grip harder"),
        ({"weight": 0.0}, "grip: got 0 N, needs more than 0 N to hold 0 N; grip harder, or give a margin"),
        ({"margin": -0.1}, "margin: got -0.1, needs a number >= 0"),
        ({"step": 0.2}, "step: got 0.2 s, needs to be shorter than settle and rest"),
        ({"friction": 0.0}, "friction: got 0.0, needs a number > 0"),
        ({"direction": 2}, "direction: got 2, needs 1 or -1"),
    ],
)
def test_object_that_cannot_be_held_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError) as caught:
        HeldObject(load=LOAD, **changes)
    assert str(caught.value).removeprefix("HeldObject.").startswith(message)


def test_damping_that_would_brake_the_object_is_refused() -> None:
    with pytest.raises(InputError, match=r"^damping.mass: got 3 1/s, needs 0: it would brake the object"):
        held_model(HeldObject(), replace(pad(), damping=RayleighDamping(mass=3.0)))


@pytest.mark.parametrize(
    ("kind", "name", "sizes", "boundary", "group"),
    [
        ("fingertip", "wang2014-2d", MeshSizes(contact_size=0.15e-3, bulk_size=1e-3), "skin", "FA-I"),
        ("tactip", "tactip-ridged-2d", SensorSectionSizes(contact_size=0.5e-3, bulk_size=2e-3), "contact", "rod_feet"),
    ],
)
def test_fingertip_and_sensor_hold_objects(kind: str, name: str, sizes: Any, boundary: str, group: str) -> None:
    specimen: Specimen = SPECIMENS[kind].read(name)
    holder = holder_of(specimen, sizes, contact=Contact(boundary), groups=[group])
    model = held_model(HeldObject(load=LOAD), holder)
    assert set(model.materials) <= set(holder.mesh.subdomains)
    assert boundary in holder.mesh.boundaries
    assert {site.kind for site in model.record.sites} == {site.kind for site in specimen.sites([group], 2)}
    assert len(model.record.sites) > 2
