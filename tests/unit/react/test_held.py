"""An object that is held: its loads, the reflexes that answer them, its grip and times, its travel in closed form."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fingerslip.errors import InputError
from fingerslip.materials.elastic import RayleighDamping
from fingerslip.model.model import Contact
from fingerslip.react.loads import GRAVITY, DroppedBall, FilledVessel, LoadSeries, RampLoad, StepLoad
from fingerslip.react.reflex import REACTIONS, Actuator, Reaction, Reflex
from fingerslip.react.scenario import OBJECT, HeldObject, held_model, holder_of, travel_after
from fingerslip.specimens.choice import SPECIMENS
from fingerslip.specimens.fingertip.fingertip import MeshSizes
from fingerslip.specimens.tactip.tactip import SensorSectionSizes
from unit.pads import pad

LOAD = RampLoad(rate=4.0, force=2.0)


def test_every_load_has_its_force_and_momentum(tmp_path):
    assert LOAD.series() == ((0.0, 0.5), (0.0, 2.0))
    assert StepLoad(force=1.0).series() == ((0.0, 1e-3), (0.0, 1.0))
    times, forces = map(np.array, DroppedBall(mass=0.06, height=0.1).series())
    pulse = forces - 0.06 * GRAVITY * times / times[-1]
    assert np.trapezoid(pulse, times) == pytest.approx(0.06 * np.sqrt(2 * GRAVITY * 0.1))
    assert forces[-1] == pytest.approx(0.06 * GRAVITY)
    times, forces = FilledVessel(mass=0.2, flow=0.1, height=0.2, rise=10e-3).series()
    blow = 0.1 * np.sqrt(2 * GRAVITY * 0.2)
    assert times == pytest.approx((0.0, 0.01, 2.0, 2.01))
    assert forces == pytest.approx((0.0, 0.1 * GRAVITY * 0.01 + blow, 0.2 * GRAVITY + blow, 0.2 * GRAVITY))
    (tmp_path / "load.csv").write_text("force [N],time [s],note\n0,0,start\n1.5,0.2,end\n")
    assert LoadSeries.read(tmp_path / "load.csv") == LoadSeries((0.0, 0.2), (0.0, 1.5))
    (tmp_path / "load.csv").write_text("time [ms], force [mN]\n0, 0\n250, 1500\n")
    assert LoadSeries.read(tmp_path / "load.csv") == LoadSeries((0.0, 0.25), (0.0, 1.5))


ONE_EACH = "needs one column time and one force, with their units; write"
NO_NUMBERS = f"has no numbers in 'force [N]', {ONE_EACH} a number in every row"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        *(
            (f"{names}\n0,0,0\n", f"has the columns {names.replace(',', ', ')}, {ONE_EACH} the first line")
            for names in ("time,force,note", "time [s],force [N],force [mN]")
        ),
        *((f"time [s],{rows}\n", NO_NUMBERS) for rows in ("force [N]\n0,a", "force [N]\n0,")),
        ("time [s],force [N]\n0,0\n0,1\n", "times: got 2 times and 2 forces, 0 s after 0 s, needs ascending times"),
        ("time [s],force [N]\n1,0\n2,1\n", "times: got 2 times and 2 forces, the first at 1 s, needs ascending times"),
        ("time [s],force [g]\n0,0\n", "column 'force [g]': got '1 g', needs a unit of [N]; write for example '1 N'"),
        ("", "is no table (No columns to parse from file), needs CSV with a line of names"),
    ],
)
def test_file_that_is_no_load_is_refused(text, message, tmp_path):
    path = tmp_path / "load.csv"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        LoadSeries.read(path)
    assert str(caught.value).startswith(f"{path}: {message}")


ASCENDING = r"needs ascending times from 0 s on, a force for each$"


@pytest.mark.parametrize(
    ("make", "values", "message"),
    [
        *((LoadSeries, values, ASCENDING) for values in (((), ()), ((0.0, 1.0), (1.0,)), ((0.0, 0.0), (0.0, 1.0)))),
        (LoadSeries, ((0.1, 1.0), (0.0, 1.0)), ASCENDING),
        (LoadSeries, ((0.0,), (1.0,), "force.csv"), r"file: is given with times or forces, needs one of the two$"),
        (FilledVessel, (1e-4, 0.1), r"mass: got 0.0001 kg, needs more than flows in while the blow comes, 0.0005"),
        (REACTIONS.read, ("human-slips",), r"^preset: 'human-slips' is not known, .* did you mean 'human-slip'\?$"),
    ],
)
def test_what_is_no_load_and_no_reaction_is_refused(make, values, message):
    with pytest.raises(InputError, match=message):
        make(*values)


@pytest.mark.parametrize("shape", ["ramp", "smooth", "exponential"])
@given(rate=st.floats(1.0, 200.0), gain=st.floats(0.05, 3.0), start=st.floats(0.0, 0.3))
def test_force_rises_from_the_grip_to_the_gain_and_never_faster_than_the_actuator(shape, rate, gain, start):
    response = Reaction(Reflex(gain=gain, shape=shape), Actuator(force_rate=rate)).response(start, 2.0)
    times = np.linspace(0.0, start + 12.0 * 2.0 * gain / rate, 2001)
    forces = np.array([response.force(time) for time in times])
    assert np.all(forces[times <= start] == 2.0)
    assert np.all(np.diff(forces) >= 0.0)
    assert np.diff(forces).max() <= rate * times[1] * (1.0 + 1e-6)
    assert forces[-1] == pytest.approx(2.0 * (1.0 + gain), rel=1e-4)


def test_grip_is_a_ramp_that_changes_at_updates_and_is_bounded_by_the_largest_force():
    ramp = Reaction(Reflex(gain=1.0), Actuator(force_rate=20.0)).response(0.1, 2.0)
    assert [ramp.force(time) for time in (0.1, 0.125, 0.15, 0.2, 1.0)] == pytest.approx([2.0, 2.5, 3.0, 4.0, 4.0])
    stairs = Reaction(Reflex(), Actuator(force_rate=20.0, update_period=20e-3)).response(0.0, 2.0)
    assert [stairs.force(time) for time in (0.019, 0.020, 0.039, 0.041)] == pytest.approx([2.0, 2.4, 2.4, 2.8])
    bounded = Reaction(Reflex(gain=5.0), Actuator(largest_force=3.0))
    assert bounded.response(0.0, 2.0).force(10.0) == 3.0
    with pytest.raises(InputError, match=r"^actuator.largest_force: got 3 N, needs at least the grip force, 3.5 N$"):
        bounded.response(0.0, 3.5)


def test_reactions_that_ship_are_as_published_with_assumed_rates_and_trials_follow_their_jitter():
    latencies = {name: REACTIONS.read(name).reflex.latency for name in REACTIONS.names}
    published = {"human-slip": 0.074, "human-skin": 0.09, "robot-piezo": 0.0204, "robot-spiking": 0.085}
    assert {**published, "prosthesis": 0.3}.items() <= latencies.items()
    assert REACTIONS.read("human-slip").reflex.jitter == 0.009
    for name in REACTIONS.names:
        assert {row.path: row.source for row in REACTIONS.table(name)}["actuator.force_rate"] == "assumed", name
        assert REACTIONS.header(name)["claims_not"], name
    assert [Reflex(latency=0.1).share_within(latency) for latency in (0.09, 0.1)] == [0.0, 1.0]
    assert Reflex(latency=0.1, jitter=0.01).share_within(0.1) == 0.5
    assert Reflex(latency=0.1, jitter=0.01).share_within(0.12) == pytest.approx(0.97725, abs=1e-5)


def test_grip_is_the_margin_over_the_least_and_the_limit_what_friction_bears_in_whole_steps():
    held = HeldObject(load=LOAD, mass=0.2, friction=0.5, margin=0.45)
    assert (held.first_load, held.first_grip) == (pytest.approx(1.962), pytest.approx(1.45 * 1.962))
    assert HeldObject(load=LOAD, weight=1.0, friction=0.5, margin=0.2).first_grip == pytest.approx(1.2)
    assert HeldObject(load=LOAD, weight=1.0, friction=0.5, grip=3.0).first_grip == 3.0
    held = HeldObject(load=LOAD, weight=1.0, friction=0.5, margin=0.5)
    assert held.time_to_limit == pytest.approx(0.5 / 4.0)
    assert HeldObject(load=StepLoad(force=0.4), weight=1.0, margin=0.5).time_to_limit is None
    assert held.total_load(0.25) == pytest.approx(2.0)
    held = HeldObject(load=RampLoad(rate=3.0, force=1.0), step=2e-3, rest=0.0511, after=0.1)
    for time in (held.begins, held.duration):
        assert time / held.step == pytest.approx(round(time / held.step))
    assert held.duration >= 1 / 3 + 0.1


def test_model_is_half_of_the_object():
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


def test_a_load_series_that_begins_with_a_force_leaves_the_rest_alone():
    held = HeldObject(load=LoadSeries((0.0, 1.0), (1.0, 3.0)), opposite="plate")
    load = held_model(held, pad()).bodies[OBJECT].loads[-1]
    times = held.begins + np.array([-1.0, -held.step, 0.0, 0.5])
    assert [load.ramp.at(time) for time in times] == pytest.approx([0.0, 0.0, 1.0, 2.0])


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
def test_object_that_cannot_be_held_is_refused(changes, message):
    with pytest.raises(InputError) as caught:
        HeldObject(load=LOAD, **changes)
    assert str(caught.value).removeprefix("HeldObject.").startswith(message)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"damping": RayleighDamping(mass=3.0)}, "damping.mass: got 3 1/s, needs 0: it would brake the object"),
        ({"contacts": ()}, "contacts: got 0, needs one, which touches the object"),
    ],
)
def test_holder_that_cannot_hold_is_refused(changes, message):
    with pytest.raises(InputError, match=f"^{message}"):
        held_model(HeldObject(), replace(pad(), **changes))


@pytest.mark.parametrize(
    ("kind", "name", "sizes", "boundary", "group"),
    [
        ("fingertip", "wang2014-2d", MeshSizes(contact_size=0.15e-3, bulk_size=1e-3), "skin", "FA-I"),
        pytest.param(
            *(
                "tactip",
                "tactip-ridged-2d",
                SensorSectionSizes(contact_size=0.5e-3, bulk_size=2e-3),
                "contact",
                "rod_feet",
            ),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_fingertip_and_sensor_hold_objects(kind, name, sizes, boundary, group):
    specimen = SPECIMENS[kind].read(name)
    holder = holder_of(specimen, sizes, contact=Contact(boundary), groups=[group])
    model = held_model(HeldObject(load=LOAD), holder)
    assert set(model.materials) <= set(holder.mesh.subdomains)
    assert boundary in holder.mesh.boundaries
    assert {site.kind for site in model.record.sites} == {site.kind for site in specimen.sites([group], 2)}
    assert len(model.record.sites) > 2


def integrated(mass, latency, limit_rate, load, steps=20000):
    """Return the travel by the midpoint rule; the load exceeds the limit by load[0] + load[1] t."""
    step, time, speed, travel = 3.0 * latency / steps, 0.0, 0.0, 0.0
    while speed >= 0.0:
        middle = time + step / 2
        force = load[0] + load[1] * middle - limit_rate * max(middle - latency, 0.0)
        travel += step * (speed + step * force / mass / 2)
        speed, time = speed + step * force / mass, time + step
    return travel


@pytest.mark.parametrize("load", [(0.5, 0.0), (0.0, 4.0), (0.5, 4.0)])
def test_travel_is_that_of_the_equation_of_motion(load):
    travel = travel_after(0.2, 74e-3, 20.0, excess=load[0], load_rate=load[1])
    assert travel == pytest.approx(integrated(0.2, 74e-3, 20.0, load), rel=1e-3)


@given(latency=st.floats(1e-3, 0.3), more=st.floats(1e-3, 0.1), rate=st.floats(1.0, 19.0))
def test_more_latency_is_more_travel_and_a_slow_grip_never_stops_it(latency, more, rate):
    for load in ({"excess": rate}, {"load_rate": rate}):
        assert travel_after(0.2, latency, 20.0, **load) < travel_after(0.2, latency + more, 20.0, **load)
    for limit_rate, load in ((rate, {"load_rate": rate}), (0.5 * rate, {"load_rate": rate}), (0.0, {"excess": rate})):
        assert travel_after(0.2, latency, limit_rate, **load) == math.inf
