"""The loop over time: steps, progress, provenance, and the same history every time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import pytest
import skfem

import fingerslip as fs
from fingerslip.contact.friction import ISOTROPIC
from fingerslip.contact.states import OPEN, SLIP
from fingerslip.dynamics import simulation
from fingerslip.dynamics.recording.steps import step_times
from fingerslip.history import VARIABLES
from problems.pushed import pad, push_and_slide

SITES = (fs.Site("deep", "FA-II", (0.0, 2e-3)), fs.Site("low", "SA-I", (1e-3, 0.0), "bulk"))


@pytest.fixture(scope="module")
def history():
    return fs.simulate(push_and_slide(record=fs.Recording(SITES, snapshots_every=0.05)))


def test_the_plate_moves_as_the_programme_says(history):
    np.testing.assert_allclose(history.counterface_displacement.values[-1, 0], [0.8e-3, 0.4e-3])
    sliding = (history.time.values > 0.13) & (history.time.values < 0.21)
    np.testing.assert_allclose(
        history.counterface_velocity.values[sliding, 0], [[8e-3, 0.0]] * sliding.sum(), atol=1e-9
    )


def test_provenance_says_solver_sizes_and_seconds(history):
    attrs = history.attrs
    assert attrs["linear_solver"] in {"MKL PARDISO", "SuperLU"}
    assert attrs["n_nodes"] == 45
    assert attrs["n_degrees_of_freedom"] == 2 * 45 - 18
    assert attrs["n_contact_candidates"] == history.sizes["contact_node"]
    parts = [attrs[f"seconds_{name}"] for name in ("substitution", "contact", "recording")]
    assert min(parts) > 0.0
    assert sum(parts) <= attrs["seconds_stepping"]


def test_progress_is_told_after_every_step():
    received = []
    fs.simulate(push_and_slide(programme=(fs.Press(0.02e-3, 1e-3),)), progress=received.append)
    np.testing.assert_allclose(received, [0.25, 0.5, 0.75, 1.0])


def test_the_same_model_gives_the_same_history_bit_by_bit(history):
    again = fs.simulate(push_and_slide(record=fs.Recording(SITES, snapshots_every=0.05)))
    for name in VARIABLES:
        np.testing.assert_array_equal(history[name].values, again[name].values, err_msg=name)


def test_steps_are_whole_and_end_where_the_programme_ends():
    times = step_times(push_and_slide())
    np.testing.assert_allclose(times, 5e-3 * np.arange(45))
    assert step_times(push_and_slide(time=fs.TimeStepping(5e-3, end=0.05)))[-1] == pytest.approx(0.05)


def test_a_programme_that_ends_between_two_steps_is_run_to_its_end():
    assert step_times(push_and_slide(step=0.03))[-1] == pytest.approx(0.24)


@pytest.mark.parametrize("timing", [fs.TimeStepping, fs.QuasiStatic])
def test_an_end_between_two_steps_is_refused(timing):
    message = r"time.end: got 1 s, which is 3.333 steps of 0.3 s, .* write 0.9 s or 1.2 s, or a step of 0.25 s"
    with pytest.raises(fs.InputError, match=message):
        fs.simulate(push_and_slide(time=timing(step=0.3, end=1.0)))


@pytest.mark.parametrize("step", [0.1, 0.07, 1e-3, 1.0 / 3.0])
@pytest.mark.parametrize("count", [1, 3, 7, 1000])
def test_a_whole_number_of_steps_ends_at_the_given_end(step, count):
    times = step_times(push_and_slide(time=fs.TimeStepping(step, end=step * count)))
    assert times.size == count + 1
    assert times[-1] == pytest.approx(step * count)


def test_a_step_longer_than_the_run_is_refused():
    with pytest.raises(fs.InputError, match=r"time.step: got 1 s for a run of 0.22 s, needs at least one step"):
        fs.simulate(push_and_slide(step=1.0))


def test_contact_outside_the_candidates_is_refused():
    contacts = (fs.Contact(boundary="bottom", friction=fs.Coulomb(0.4), search_distance=1e-6),)
    with pytest.raises(fs.SlipOutsideContactError, match=r"reached the counterface .* write a larger search_distance"):
        fs.simulate(push_and_slide(contacts=contacts))


def test_penalties_are_told_as_mean_over_the_contact():
    contacts = (fs.Contact("bottom", friction=fs.Coulomb(0.4), normal_penalty=3e7, tangential_penalty=5e6),)
    attrs = fs.simulate(push_and_slide(contacts=contacts, programme=(fs.Press(0.02e-3, 1e-3),))).attrs
    assert attrs["normal_penalty"] == pytest.approx(3e7, rel=1e-12)
    assert attrs["tangential_penalty"] == pytest.approx(5e6, rel=1e-12)


def test_two_plates_squeeze_a_free_block_with_equal_and_opposite_forces():
    """Nothing else holds the block along y, so once it is at rest the forces of the plates balance."""
    plates = (
        fs.Contact("bottom", friction=fs.Coulomb(0.5)),
        fs.Contact("top", counterface=fs.Plane(normal=(0.0, -1.0)), friction=fs.Coulomb(0.5)),
    )
    model = push_and_slide(
        supports={},
        contacts=plates,
        programme=(fs.Press(0.2e-3, 2e-3), fs.Hold(0.4)),
        damping=fs.RayleighDamping(mass=20.0, stiffness=5e-3),
    )
    history = fs.simulate(model)
    below, above = history.counterface_force.values[-1]
    assert below[1] > 0.0
    np.testing.assert_allclose(above, -below, atol=1e-3 * below[1])
    assert history.contact_counterface.values.tolist() == sorted(history.contact_counterface.values.tolist())
    assert set(history.contact_counterface.values.tolist()) == {0, 1}
    np.testing.assert_allclose(history.counterface_displacement.values[-1], [[0.0, 0.2e-3], [0.0, -0.2e-3]], atol=1e-15)


def test_a_run_to_the_left_is_the_mirror_image_of_one_to_the_right():
    """The pad is symmetric, so forces along x change their sign and nothing else changes."""
    press, slide = fs.Press(0.4e-3, 4e-3), fs.Slide(0.8e-3, 8e-3)
    right = fs.simulate(push_and_slide(programme=(press, slide)))
    left = fs.simulate(push_and_slide(programme=(press, fs.Slide(0.8e-3, 8e-3, direction=(-1.0, 0.0)))))
    force = right.counterface_force.values[:, 0]
    scale = np.abs(force).max()
    np.testing.assert_allclose(left.counterface_force.values[:, 0], force * [-1.0, 1.0], atol=1e-8 * scale)
    assert np.abs(force[-1, 0]) > 0.3 * force[-1, 1]
    order = np.argsort(right.contact_position.values[:, 0])
    mirrored = np.argsort(-left.contact_position.values[:, 0])
    np.testing.assert_allclose(
        left.slip_distance.values[:, mirrored], right.slip_distance.values[:, order], atol=1e-8 * 0.8e-3
    )


def test_a_node_that_moves_onto_the_plate_is_noticed_though_the_plate_stands_still():
    """A free block is pushed down onto a plate 0.2 mm below it; only its lowest node may touch."""
    contact = fs.Contact(
        "bottom", counterface=fs.Plane(offset=-0.2e-3), friction=fs.Coulomb(0.4), search_distance=0.21e-3
    )
    model = push_and_slide(
        supports={"left": ("x",)},
        contacts=(contact,),
        programme=(),
        tractions={"top": (0.0, -2e3)},
        time=fs.TimeStepping(1e-3, end=0.2),
    )
    with pytest.raises(fs.SlipOutsideContactError, match="reached the counterface but is no contact candidate"):
        fs.simulate(model)


def test_a_node_that_yields_to_the_plate_is_not_reached_by_it():
    """The plate passes the places at which outer nodes began, but these rise with the skin that it presses."""
    reached = 0.06e-3
    contact = fs.Contact("bottom", friction=fs.Coulomb(0.4), search_distance=reached)
    model = push_and_slide(contacts=(contact,), programme=(fs.Press(0.1e-3, 4e-3),), mesh=pad("Q4", 40, 8))
    bottom = np.unique(model.mesh.facets[:, model.mesh.boundaries["bottom"]])
    heights = model.mesh.p[1, bottom]
    assert ((heights > reached) & (heights < 0.1e-3)).any(), "or this test shows nothing"
    history = fs.simulate(model)
    assert history.sizes["contact_node"] == (heights <= reached).sum()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: fs.simulate(fs.preset("wang2014-2d")), "model: got a Fingertip, needs a Model; write fs.Model(mesh="),
        (lambda: fs.simulate(None), "model: got None, needs a Model; write fs.Model("),
        (lambda: fs.simulate(pad("Q4")), "model: got a MeshQuad1, needs a Model"),
        (lambda: fs.simulate_together("x"), "models: got 'x', needs a list of models; write fs.Model("),
        (lambda: fs.simulate_together(push_and_slide()), "models: got a Model, needs a list of models; write [model]"),
        (lambda: fs.simulate_together([push_and_slide(), 3]), "models.1: got 3, needs a Model"),
        (lambda: fs.simulate_together([]), "models: got none, needs one or more"),
    ],
)
def test_what_is_no_model_is_refused_with_how_to_make_one(call, message):
    with pytest.raises(fs.InputError) as caught:
        call()
    assert str(caught.value).startswith(message)


@dataclass(frozen=True)
class Drying:
    """A user's friction law: the coefficient grows with time, and more where a node has slipped."""

    coefficient: float = 0.2
    dims: ClassVar = (2, 3)
    frame: ClassVar = ISOTROPIC

    def coefficients(self, conditions):
        return self.coefficient + 2.0 * conditions.time + 100.0 * conditions.slip_since_contact


def test_a_friction_law_of_a_user_sees_the_conditions_of_every_step():
    """At a slipping node |t| / p is the coefficient at the step's end time, with the slip at its start."""
    contact = fs.Contact("bottom", friction=Drying())
    history = fs.simulate(push_and_slide(contacts=(contact,)))
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


def test_an_anisotropic_law_is_refused_in_the_plane():
    contact = fs.Contact("bottom", friction=fs.Anisotropic(0.4, 0.8))
    with pytest.raises(fs.InputError, match=r"contacts.0.friction: got Anisotropic in 2 dimensions, needs 3"):
        fs.simulate(push_and_slide(contacts=(contact,)))


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
    own, built_in = (
        fs.simulate(push_and_slide(contacts=(fs.Contact("bottom", counterface, fs.Coulomb(0.4)),)))
        for counterface in (Tilted(0.1), fs.Plane((-0.1, 1.0)))
    )
    force = built_in.counterface_force.values
    assert force[-1, 0, 1] > 0.0
    np.testing.assert_allclose(own.counterface_force.values, force, atol=1e-10 * np.abs(force).max())


def test_nodes_that_a_slide_leaves_at_the_limit_stick_while_nothing_moves():
    programme = (fs.Press(0.1e-3, 1e-3), fs.Slide(0.5e-3, 5e-3), fs.Hold(0.1))
    history = fs.simulate(push_and_slide(programme=programme, time=fs.QuasiStatic(10e-3)))
    kinds = {
        phase: history["contact_state"].sel(time=slice(start, end)).values
        for phase, start, end in (
            ("slide", 0.195, 0.201),
            ("hold", 0.205, 0.4),
        )
    }
    touching = kinds["slide"][-1] > 0
    assert (kinds["slide"][-1][touching] == 2).all(), "the whole contact slides at the end of the slide"
    assert (kinds["hold"][:, touching] == 1).all(), "and is at rest in the hold"
    force = history["counterface_force"].values[-1, 0]
    assert abs(force[0] / force[1]) == pytest.approx(0.4), "although friction is still at its limit"


def test_a_press_first_closes_the_clearance():
    apart, touching = (
        fs.simulate(
            push_and_slide(
                programme=(fs.Press(depth, 4e-3),),
                time=fs.QuasiStatic(5e-3),
                contacts=(fs.Contact(boundary="bottom", friction=fs.Coulomb(0.4), clearance=clearance),),
            )
        )
        for depth, clearance in ((0.4e-3, 0.1e-3), (0.3e-3, 0.0))
    )
    forces = [history["counterface_force"].values[:, 0, 1] for history in (apart, touching)]
    np.testing.assert_allclose(forces[0][:6], 0.0, atol=1e-12)
    np.testing.assert_allclose(forces[0][5:], forces[1], rtol=1e-6, atol=1e-9)


def test_threads_follow_all_nodes_those_in_the_middle_of_edges_too(monkeypatch):
    class SeenError(Exception):
        pass

    def seen(n_dofs, allowed, dim):
        raise SeenError(n_dofs, dim)

    monkeypatch.setattr(simulation, "suitable_threads", seen)
    mesh = skfem.MeshTet2.from_mesh(skfem.MeshTet1.init_tensor(*[np.linspace(0.0, 1e-3, 3)] * 3)).with_defaults()
    block = mesh.with_subdomains({"bulk": np.arange(mesh.nelements)})
    contact = fs.Contact("bottom", fs.Plane((0.0, 1.0, 0.0)))
    values = {"formulation": "solid", "depth": 1.0, "contacts": (contact,), "supports": {"top": ("x", "y", "z")}}
    with pytest.raises(SeenError) as raised:
        fs.simulate(push_and_slide(mesh=block, **values))
    assert raised.value.args == (3 * 5**3, 3)
