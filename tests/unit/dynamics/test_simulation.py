"""The loop over time: steps, progress, provenance, contact candidates, and the same history every time."""

import itertools
import pickle
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.contact.friction import ISOTROPIC
from fingerslip.contact.states import OPEN, SLIP
from fingerslip.dynamics import simulation
from fingerslip.dynamics.recording.schedule import step_times
from fingerslip.dynamics.system.bodies import body_centres
from fingerslip.verification.meshes import box
from problems.pushed import pad, push_and_slide
from problems.reduced import REDUCED, fine_pad
from unit.dynamics.models import DEPTH, assert_same_history, contact, pressed_pad, solved_by_steps


def test_provenance_says_solver_sizes_penalties_and_seconds(history):
    attrs = history.attrs
    assert attrs["linear_solver"] in {"MKL PARDISO", "SuperLU"}
    assert (attrs["kinematics"], attrs["basis"]) == ("small", "full")
    assert (attrs["n_nodes"], attrs["n_degrees_of_freedom"]) == (45, 2 * 45 - 18)
    assert attrs["n_contact_candidates"] == history.sizes["contact_node"]
    seconds = [attrs[f"seconds_{name}"] for name in ("substitution", "contact", "recording")]
    assert min(seconds) > 0.0
    assert sum(seconds) <= attrs["seconds_stepping"]
    assert {"seconds_assembly", "seconds_factorisation", "cpu_seconds_stepping"} <= attrs.keys()
    assert history.contact_residual.values.max() <= 1e-12, "contact is solved to more than a step has to have"
    stiff = contact(normal_penalty=3e7, tangential_penalty=5e6)
    attrs = fs.simulate(push_and_slide(contacts=stiff, programme=(fs.Press(0.02e-3, 1e-3),))).attrs
    assert (attrs["normal_penalty"], attrs["tangential_penalty"]) == pytest.approx((3e7, 5e6), rel=1e-12)


def test_a_body_that_touches_nothing_may_have_a_programme():
    """Its slide lasts as long as one on a counterface."""
    history = fs.simulate(push_and_slide(contacts=(), programme=(fs.Slide(1e-3, 20e-3),)))
    assert history["time"].values[-1] == pytest.approx(0.05)


def test_a_body_without_a_name_is_one_of_its_own():
    model = push_and_slide(bodies={"": fs.RigidBody(1.0, centre=(1.0, 1.0))})
    of_bodies, of_contacts = body_centres(model)
    assert (of_bodies.tolist(), of_contacts.tolist()) == ([[1.0, 1.0]], [[0.0, 0.0]])


def test_progress_is_told_after_every_step_and_a_bar_goes_to_standard_error(capsys):
    model, received = push_and_slide(programme=(fs.Press(0.02e-3, 1e-3),)), []
    fs.simulate(model, progress=received.append)
    np.testing.assert_allclose(received, [0.25, 0.5, 0.75, 1.0])
    fs.simulate(model, progress=False)
    assert capsys.readouterr() == ("", "")
    fs.simulate(model, progress=True)
    printed = capsys.readouterr()
    assert "100 %" in printed.err
    assert printed.out == ""


@pytest.mark.parametrize(
    ("time", "end", "count"),
    [
        (fs.TimeStepping(5e-3), 0.22, 44),
        (fs.TimeStepping(7e-3), 0.224, 32),
        (fs.TimeStepping(0.03), 0.24, 8),
        (fs.TimeStepping(5e-3, end=0.05), 0.05, 10),
        *(
            (fs.TimeStepping(step, end=step * count), step * count, count)
            for step in (0.1, 0.07, 1e-3, 1.0 / 3.0)
            for count in (1, 3, 7, 1000)
        ),
    ],
)
def test_steps_are_whole_and_go_on_until_the_end_is_reached(time, end, count):
    times = step_times(push_and_slide(time=time))
    assert times == pytest.approx(time.step * np.arange(count + 1))
    assert times[-1] == pytest.approx(end)


def test_threads_follow_all_nodes_those_in_the_middle_of_edges_too(monkeypatch):
    class SeenError(Exception):
        pass

    def seen(n_dofs, allowed, dim):
        raise SeenError(n_dofs, dim)

    monkeypatch.setattr(simulation, "suitable_threads", seen)
    with pytest.raises(SeenError) as raised:
        fs.simulate(pressed_pad(mesh=box("T10", *[np.linspace(0.0, 1e-3, 3)] * 3)))
    assert raised.value.args == (3 * 5**3, 3)


@pytest.mark.parametrize(("basis", "run"), [(None, fs.simulate), (REDUCED, fs.simulate), (None, solved_by_steps)])
def test_contact_outside_the_candidates_is_refused_with_time_and_node(basis, run, caplog):
    model = push_and_slide(contacts=contact(search_distance=1e-6), basis=basis, mesh=fine_pad())
    with pytest.raises(fs.SlipOutsideContactError, match=r"t = 0.0\d+ s: node \d+ .* larger search_distance") as caught:
        run(model)
    at = str(caught.value).split(": node", maxsplit=1)[0]
    assert (f"no reduced basis: {at}" in caplog.text) == (basis is not None), "the basis sees it first, as early"


def test_a_search_that_nobody_gave_is_made_longer_in_2d_too(monkeypatch, caplog):
    model = push_and_slide(contacts=contact(), mesh=fine_pad())
    history = fs.simulate(model)
    monkeypatch.setattr("fingerslip.dynamics.system.checks._SEARCH", 1e-3)
    with caplog.at_level("INFO"):
        again = fs.simulate(model)
    assert "larger search_distance" in caplog.text
    assert "starts again with more contact candidates" in caplog.text
    assert again.sizes["contact_node"] >= history.sizes["contact_node"]
    np.testing.assert_allclose(again["counterface_force"], history["counterface_force"], rtol=1e-6, atol=1e-9)


def test_nodes_beside_candidates_are_noticed_where_they_move_onto_the_plate_and_not_where_they_yield_to_it():
    """A free block is pushed down onto a plate 0.2 mm below it; only its lowest node may touch.

    The plate passes the places at which outer nodes began, but these rise with the skin that it presses.
    """
    below = contact(counterface=fs.Plane(offset=-0.2e-3), search_distance=0.21e-3)
    loaded = {"supports": {"left": ("x",)}, "tractions": {"top": (0.0, -2e3)}, "programme": ()}
    with pytest.raises(fs.SlipOutsideContactError, match="reached the counterface but is no contact candidate"):
        fs.simulate(push_and_slide(contacts=below, **loaded, time=fs.TimeStepping(1e-3, end=0.2)))
    reached, mesh = 0.06e-3, pad("Q4", 40, 8)
    model = push_and_slide(contacts=contact(search_distance=reached), programme=(fs.Press(0.1e-3, 4e-3),), mesh=mesh)
    heights = mesh.p[1, np.unique(mesh.facets[:, mesh.boundaries["bottom"]])]
    assert ((heights > reached) & (heights < 0.1e-3)).any(), "or this test shows nothing"
    assert fs.simulate(model).sizes["contact_node"] == (heights <= reached).sum()


@pytest.fixture(scope="module")
def pressed():
    return fs.simulate(pressed_pad())


def test_few_candidates_move_as_all_that_may_touch_do(pressed):
    """The first search goes a quarter further than the counterface; half as far again as one may."""
    positions = np.linalg.norm(pressed.contact_position.values[:, :2], axis=1)
    assert np.all(positions**2 / 10e-3 <= 1.25 * DEPTH)
    every = fs.simulate(pressed_pad(search_distance=1.5 * DEPTH))
    assert pressed.sizes["contact_node"] < every.sizes["contact_node"]
    assert_same_history(pressed[["counterface_force"]], every[["counterface_force"]], 1e-9)
    same = np.isin(every.contact_node.values, pressed.contact_node.values)
    slip = every.slip_distance.values
    np.testing.assert_allclose(pressed.slip_distance.values, slip[:, same], atol=1e-9 * slip.max())
    assert not every.contact_state.values[:, ~same].any()


def test_faces_of_a_body_search_as_far_as_the_body_goes(pressed):
    """The press goes along the normal of the first face: away from the second, which may be as near as it is."""
    body = fs.RigidBody(1.0, programme=(fs.Press(DEPTH, 10e-3),))
    lid = fs.Contact("top", fs.Plane((0.0, 0.0, -1.0)), rigid_body="clamp")
    bottom = replace(pressed_pad().contacts[0], rigid_body="clamp")
    changes = {"contacts": (bottom, lid), "bodies": {"clamp": body}, "programme": ()}
    history = fs.simulate(pressed_pad(**changes, time=fs.TimeStepping(5e-3, end=5e-3)))
    assert (history.contact_counterface.values == 0).sum() == pressed.sizes["contact_node"]


def test_where_the_short_search_does_not_suffice_the_simulation_starts_again_with_all(pressed, monkeypatch, caplog):
    """Its first stage finds no candidate, 1.3 times the approach away."""
    caplog.set_level("INFO")
    monkeypatch.setattr(simulation, "_NEAR", 0.3)
    again = fs.simulate(pressed_pad())
    assert "reached the counterface" in caplog.text
    assert "starts again with more contact candidates" in caplog.text
    assert again.sizes["contact_node"] > pressed.sizes["contact_node"]
    assert_same_history(again[["counterface_force"]], pressed[["counterface_force"]], 1e-9)
    far = contact(counterface=fs.Plane((0.0, 0.0, 1.0), offset=-1.3 * DEPTH))
    assert not fs.simulate(pressed_pad(contacts=far, programme=(fs.Press(DEPTH, 10e-3),))).contact_state.values.any()


def test_two_plates_squeeze_a_free_block_with_equal_and_opposite_forces():
    """Nothing else holds the block along y, so once it is at rest the forces of the plates balance."""
    plates = contact() + contact(boundary="top", counterface=fs.Plane(normal=(0.0, -1.0)))
    programme, damping = (fs.Press(0.2e-3, 2e-3), fs.Hold(0.4)), fs.RayleighDamping(mass=20.0, stiffness=5e-3)
    history = fs.simulate(push_and_slide(supports={}, contacts=plates, programme=programme, damping=damping))
    below, above = history.counterface_force.values[-1]
    assert below[1] > 0.0
    np.testing.assert_allclose(above, -below, atol=1e-3 * below[1])
    assert [number for number, _ in itertools.groupby(history.contact_counterface.values.tolist())] == [0, 1]
    np.testing.assert_allclose(history.counterface_displacement.values[-1], [[0.0, 0.2e-3], [0.0, -0.2e-3]], atol=1e-15)


def test_nodes_that_a_slide_leaves_at_the_limit_stick_while_nothing_moves():
    programme = (fs.Press(0.1e-3, 1e-3), fs.Slide(0.5e-3, 5e-3), fs.Hold(0.1))
    history = fs.simulate(push_and_slide(programme=programme, time=fs.QuasiStatic(10e-3)))
    states = history["contact_state"]
    slide, hold = (states.sel(time=slice(*span)).values for span in ((0.195, 0.201), (0.205, 0.4)))
    touching = slide[-1] > 0
    assert (slide[-1][touching] == 2).all(), "the whole contact slides at the end of the slide"
    assert (hold[:, touching] == 1).all(), "and is at rest in the hold"
    force = history["counterface_force"].values[-1, 0]
    assert abs(force[0] / force[1]) == pytest.approx(0.4), "although friction is still at its limit"


@dataclass(frozen=True)
class Drying:
    """A user's friction law: the coefficient grows with time, and more where a node has slipped."""

    coefficient: float = 0.2
    broken_from: float = np.inf
    dims: ClassVar = (2, 3)
    frame: ClassVar = ISOTROPIC

    def coefficients(self, conditions):
        broken = np.nan if conditions.time > self.broken_from else 0.0
        return self.coefficient + 2.0 * conditions.time + 100.0 * conditions.slip_since_contact + broken


def test_a_friction_law_of_a_user_sees_the_conditions_of_every_step():
    """At a slipping node |t| / p is the coefficient at the step's end time, with the slip at its start."""
    history = fs.simulate(push_and_slide(contacts=(fs.Contact("bottom", friction=Drying()),)))
    assert history.counterface_friction_coefficient.values.tolist() == [0.2]
    state, pressure = history.contact_state.values, history.normal_traction.values
    friction = np.abs(history.tangential_traction.values[..., 0])
    slipping = np.argwhere(state == SLIP)
    assert len(slipping) > 40
    for step, node in slipping:
        last_open = np.flatnonzero(state[:step, node] == OPEN)[-1]
        slipped = history.slip_distance.values[step - 1, node] - history.slip_distance.values[last_open, node]
        mu = 0.2 + 2.0 * history.time.values[step] + 100.0 * slipped
        assert friction[step, node] == pytest.approx(mu * pressure[step, node], rel=1e-7)


@pytest.mark.parametrize("element", ["Q4", "H8"])
def test_contact_that_is_not_solved_is_an_error_that_says_when_where_and_what_to_try(element):
    law = fs.Contact("bottom", fs.Plane((0.0, 1.0) if element == "Q4" else (0.0, 0.0, 1.0)), Drying(0.2, 0.012))
    model = (push_and_slide if element == "Q4" else pressed_pad)(contacts=(law,))
    with pytest.raises(fs.ConvergenceError) as caught:
        fs.simulate(model)
    error = caught.value
    assert error.time == pytest.approx(0.015)
    assert error.node in np.unique(model.mesh.facets[:, model.mesh.boundaries["bottom"]])
    message = f"t = 0.015 s, node {error.node}: residual nan, needs <= 1e-10; try a smaller time step"
    assert message in str(error)
    *_, last = error.history["time"].values
    assert (last < error.time, error.history.attrs["failure"]) == (True, str(error))
    assert np.isfinite(error.history["counterface_force"].values).all()
    assert pickle.loads(pickle.dumps(error)).history is None, "it stays in its process"


@dataclass(frozen=True)
class Tilted:
    """A user's counterface: a plane through a point, leaning by a slope."""

    slope: float
    height: float = 0.0
    is_flat: ClassVar = True

    dim = 2

    @property
    def unit_normal(self):
        return np.array([-self.slope, 1.0]) / np.hypot(self.slope, 1.0)

    def at_start(self, points):
        return replace(self, height=float(np.min(points @ self.unit_normal)))

    def gap(self, points):
        return points @ self.unit_normal - self.height

    def normals(self, points):
        return np.tile(self.unit_normal, (len(points), 1))

    def start_hint(self, gap):
        return "height", f"needs {self.height + gap}"


def test_a_counterface_of_a_user_is_touched_as_a_built_in_one():
    of_user, built_in = (
        fs.simulate(push_and_slide(contacts=(fs.Contact("bottom", counterface, fs.Coulomb(0.4)),)))
        for counterface in (Tilted(0.1), fs.Plane((-0.1, 1.0)))
    )
    assert built_in.counterface_force.values[-1, 0, 1] > 0.0
    assert_same_history(of_user[["counterface_force"]], built_in[["counterface_force"]], 1e-10)
