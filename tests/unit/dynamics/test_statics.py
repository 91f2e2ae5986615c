"""A condensed body without inertia: what it answers to contact forces, and that it moves as step by step."""

import dataclasses
import itertools

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.finite.large import Large
from fingerslip.dynamics.statics.body import depth_in_hull, shear_distances, static_body
from fingerslip.dynamics.statics.motion import static_motion
from fingerslip.dynamics.statics.pressed import pressed_bodies
from fingerslip.errors import InputError, SlipOutsideContactError
from fingerslip.slip import contact_area, stick_ratio
from problems.domes import pressed_dome
from problems.pushed import pad, push_and_slide

REACH = 1.2e-3


def searched(model, reach):
    contacts = tuple(dataclasses.replace(contact, search_distance=reach) for contact in model.contacts)
    return dataclasses.replace(model, contacts=contacts)


def marched(model, body):
    return static_motion(body, model.contacts[0], model.programme, model.time.step)


def test_the_compliance_is_symmetric_and_of_the_nodes_within_reach_and_a_site_there_moves_as_its_node():
    body = static_body(pressed_dome(), reach=1e-3, hidden=1e-3)
    (compliance,) = body.compliance
    assert np.array_equal(compliance, compliance.T)
    assert body.positions[:, 1].max() <= 1e-3
    assert (np.linalg.eigvalsh(compliance)[6:] > -1e-15).all()
    crown = int(np.argmin(np.linalg.norm(body.positions, axis=1)))
    at_sites = body.answers[0, body.site_rows]
    assert at_sites == pytest.approx(compliance[3 * crown : 3 * crown + 3], rel=1e-9, abs=1e-12)
    angle = np.linspace(-1.2, 1.2, 41)
    arc = np.column_stack([np.sin(angle), 1.0 - np.cos(angle)])
    assert depth_in_hull(arc, np.array([0.0, 1.0])) == pytest.approx(np.zeros(41), abs=1e-12), (
        "a convex body hides none"
    )


@pytest.fixture(scope="module")
def body():
    return static_body(searched(pressed_dome(), REACH), reach=REACH, hidden=REACH)


@pytest.mark.parametrize("normal", [(0.0, 1.0, 0.0), (0.05, 1.0, 0.0)])
def test_with_a_node_a_patch_the_motion_is_that_of_the_mesh(body, normal):
    model = pressed_dome(normal)
    found, history = marched(model, body), fs.simulate(model)
    size = np.abs(history["displacement"].values).max()
    assert found.displacement == pytest.approx(history["displacement"].values, abs=1e-9 * size)
    assert found.force == pytest.approx(history["counterface_force"].values[:, 0], abs=1e-9)
    assert found.stick_ratio[1:] == pytest.approx(stick_ratio(history).values[1:], abs=1e-9)
    assert found.contact_area == pytest.approx(contact_area(history).values, rel=1e-9)
    assert np.isnan(found.stick_ratio[0])


def test_patches_change_the_contact_alone(body):
    coarse = static_body(searched(pressed_dome(), REACH), reach=REACH, hidden=REACH, patch=1.5e-3)
    assert len(coarse.nodes) < len(body.nodes)
    assert coarse.area.sum() == pytest.approx(body.area.sum())
    model = pressed_dome()
    forces = [marched(model, one).force[:, 1].max() for one in (body, coarse)]
    assert forces[1] == pytest.approx(forces[0], rel=0.2)


@pytest.mark.parametrize("after", [(), (fs.Hold(0.8), fs.Lift(0.4e-3, 1e-3))], ids=["at the end", "on the way"])
def test_what_is_watched_must_not_touch(body, after):
    # A node that no force moves lies where the plate comes to.
    watched = np.array([[0.0, 0.2e-3, 0.0]])
    answers, moved = body.answers[:, : body.watched_rows.start], body.moved[:, : body.watched_rows.start]
    answers, moved = np.pad(answers, ((0, 0), (0, 3), (0, 0))), np.pad(moved, ((0, 0), (0, 3)))
    hidden = dataclasses.replace(body, watched=watched, answers=answers, moved=moved)
    with pytest.raises(SlipOutsideContactError, match="is no contact candidate"):
        static_motion(hidden, pressed_dome().contacts[0], (fs.Press(0.4e-3, 1e-3), *after), 0.1)


def hanging_plate(**changes):
    """Return a plate that is pressed against the dome, and then hangs on it while its load grows."""
    plate = fs.RigidBody(
        mass=0.1,
        free=("x", "z"),
        loads=(fs.BodyLoad(x=0.3, z=0.05, ramp=fs.Ramp((0.6, 3.0), (0.0, 1.0))),),
        dampers=fs.Dampers(x=5.0, z=1.0),
        springs=fs.Springs(x=2.0, z=3.0),
        programme=(fs.Press(0.4e-3, 1e-3), fs.Hold(2.6)),
    )
    return dataclasses.replace(plate, **changes)


def test_a_plate_that_hangs_on_the_body_falls_as_it_does_on_the_mesh(body):
    plate, model = hanging_plate(), pressed_dome()
    contact = dataclasses.replace(model.contacts[0], rigid_body="plate")
    history = fs.simulate(
        dataclasses.replace(model, contacts=(contact,), bodies={"plate": plate}, programme=plate.programme)
    )
    found = static_motion(body, model.contacts[0], plate.programme, model.time.step, plate=plate)
    fallen = history["counterface_displacement"].values[:, 0]
    assert (fallen[-1, [0, 2]] > 1e-3).all()
    assert found.counterface == pytest.approx(fallen, abs=1e-9 * fallen.max())
    assert found.displacement == pytest.approx(history["displacement"].values, abs=1e-9 * fallen.max())
    assert found.force == pytest.approx(history["counterface_force"].values[:, 0], abs=1e-9)
    assert {0.0, 1.0} <= set(found.stick_ratio[1:].round(12))


def test_the_motion_ends_where_the_plate_has_fallen_far_enough(body):
    plate, model = hanging_plate(), pressed_dome()
    whole, part = (
        static_motion(body, model.contacts[0], plate.programme, model.time.step, plate=plate, farthest=farthest)
        for farthest in (np.inf, 1e-3)
    )
    count = part.time.size
    assert part.counterface[-2, 0] <= 1e-3 < part.counterface[-1, 0]
    assert count < whole.time.size
    largest = np.abs(whole.displacement).max()
    np.testing.assert_allclose(part.displacement, whole.displacement[:count], rtol=0.0, atol=1e-12 * largest)
    np.testing.assert_array_equal(part.state, whole.state[:count])


STILL = {"free": (), "loads": (), "dampers": None, "springs": None}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"normal_penalty": None}, r"contact\.normal_penalty: is missing"),
        ({"counterface": fs.Plane((0.0, 1.0, 0.0), offset=-1e-2)}, "needs a press that touches"),
        ({"counterface": fs.Sphere(5e-3, (0.0, 1.0, 0.0))}, r"contact\.counterface: is curved"),
        ({"free": ("ry",), "centre": (0.0, 0.0, 0.0), "inertia": (1.0, 1.0, 1.0)}, "is ry, needs x, y or z"),
        ({"free": ("y",)}, "is y, along which the programme moves the plate"),
        ({"free": ("x",)}, "is x, along which contact alone holds the plate"),
        (
            {"free": ("x",), "dampers": fs.Dampers(x=1.0), "initial_velocity": fs.BodyVelocity(x=1.0)},
            "with a velocity at the start",
        ),
    ],
)
def test_contacts_that_do_not_fit_and_plates_that_move_otherwise_are_refused(body, changes, words):
    contact = pressed_dome().contacts[0]
    if "free" not in changes:
        contact, changes = dataclasses.replace(contact, **changes), {}
    plate = hanging_plate(**(STILL | changes))
    with pytest.raises(InputError, match=words):
        static_motion(body, contact, plate.programme, 0.1, plate=plate)


def pressed_body(model, **sizes):
    """Return the body of a model that is pressed as far as its programme does."""
    (body,) = pressed_bodies(model, [model.programme[0].depth], **sizes)
    return body


def pressed_pad(kinematics="finite", friction=0.5, **changes):
    """Return a pad that is pressed by a fifth of its height and slid until all of it slips."""
    slide = fs.Slide(1.6e-3, 1e-3)
    return push_and_slide(
        mesh=pad("Q4", 24, 8),
        materials={"bulk": fs.NeoHookean(34e3, 0.4, 1000.0)},
        contacts=(fs.Contact("bottom", friction=fs.Coulomb(friction), normal_penalty=4e9, tangential_penalty=4e9),),
        programme=(fs.Press(0.8e-3, 1e-3), slide),
        time=fs.QuasiStatic(0.05),
        kinematics=kinematics,
        sites=(fs.Site("core", "marker", (0.0, 1e-3)),),
        **changes,
    )


FAR = (dataclasses.replace(pressed_pad().contacts[0], counterface=fs.Plane((0.0, 1.0), offset=-1e-5)),)
RELAXING = fs.NeoHookean(34e3, 0.4, 1000.0, prony=(fs.PronyTerm(0.3, 0.1),))


@pytest.fixture(scope="module")
def sheared_body():
    return pressed_body(pressed_pad(), spacing=0.25, near=1e-3)


def test_a_body_at_large_strain_slides_as_step_by_step_where_small_strain_is_far_off(sheared_body):
    model, (history, small) = pressed_pad(), map(fs.simulate, (pressed_pad(), pressed_pad("small")))
    motion = marched(model, sheared_body)
    begun = history["time"].values >= motion.time[0] - 1e-9
    assert motion.time == pytest.approx(history["time"].values[begun])
    forces, far = (each["counterface_force"].values[begun, 0] for each in (history, small))
    sites = history["displacement"].values[begun]
    largest = np.abs(forces).max(axis=0)
    assert np.abs(motion.force - forces).max(axis=0) == pytest.approx(np.zeros(2), abs=0.01 * largest.max())
    assert np.abs(far - forces).max() > 0.05 * largest.max()
    assert motion.displacement[0] == pytest.approx(sites[0], abs=1e-9)
    assert np.abs(motion.displacement - sites).max() < 0.01 * np.abs(sites[-1] - sites[0]).max()
    gone, whole = (ratio[1:] == 0.0 for ratio in (motion.stick_ratio, stick_ratio(history).values[begun]))
    assert np.argmax(gone) == pytest.approx(np.argmax(whole), abs=1)


def test_the_states_of_a_slide_are_apart_by_the_spacing_and_go_until_all_slips(sheared_body):
    states = sheared_body.moved[:, : sheared_body.positions.size].reshape(-1, *sheared_body.positions.shape)
    apart = [
        shear_distances(late, early[None], sheared_body.forces[0])[0] for early, late in itertools.pairwise(states)
    ]
    assert apart == pytest.approx(np.full(len(states) - 1, 0.225e-3), abs=0.026e-3)
    ratios = sheared_body.forces.sum(axis=1)[:, 0] / sheared_body.forces.sum(axis=1)[:, 1]
    assert (np.diff(ratios) > 0.0).all()
    assert ratios[-1] == pytest.approx(0.5, abs=0.1)


def test_strides_of_several_steps_lead_to_the_same_slide_but_for_a_percent(sheared_body):
    bold = pressed_body(pressed_pad(), spacing=0.25, near=1e-3, stride=0.2)
    motion, other = (marched(pressed_pad(), body) for body in (bold, sheared_body))
    assert len(bold.answers) < len(sheared_body.answers)
    assert np.abs(motion.force - other.force).max() < 0.01 * np.abs(other.force).max()
    assert np.abs(motion.displacement - other.displacement).max() < 0.01 * np.abs(other.displacement).max()


@pytest.mark.slow
def test_a_dome_in_3d_with_patches_under_a_tilted_plate_begins_in_balance_and_slides_as_step_by_step():
    law = fs.Coulomb(0.6)
    upright, tilted = (
        pressed_dome(
            normal,
            kinematics="finite",
            materials={"bulk": fs.NeoHookean(1e5, 0.45, 1000.0)},
            programme=(fs.Press(0.9e-3, 1e-3), fs.Slide(0.6e-3, 0.3e-3)),
        )
        for normal in ((0.0, 1.0, 0.0), (0.02, 1.0, 0.0))
    )
    models = [
        dataclasses.replace(model, contacts=(dataclasses.replace(model.contacts[0], friction=law),))
        for model in (upright, tilted)
    ]
    reference = dataclasses.replace(models[0], time=fs.QuasiStatic(0.15))
    fine, coarse = (pressed_body(reference, spacing=1 / 3, near=1e-3, patch=patch) for patch in (0.0, 4e-3))
    for body, model, bound in ((fine, models[0], 0.01), (fine, models[1], 0.02), (coarse, models[0], 0.01)):
        history, motion = fs.simulate(model), marched(model, body)
        begun = history["time"].values >= motion.time[0] - 1e-9
        forces = history["counterface_force"].values[begun, 0]
        assert np.abs(motion.force - forces).max() < bound * np.abs(forces).max()
    steady = static_motion(coarse, models[0].contacts[0], (fs.Press(0.9e-3, 1e-3), fs.Hold(0.5)), 0.1)
    assert steady.force == pytest.approx(np.tile(steady.force[0], (6, 1)), abs=1e-9 * steady.force.max())


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"kinematics": "small"}, "kinematics: is small, needs finite"),
        ({"time": fs.TimeStepping(0.05)}, "time: has inertia, needs scheme: quasi_static"),
        ({"programme": (fs.Hold(0.1),)}, r"programme\.0: is Hold.*, needs a press"),
        ({"contacts": FAR}, r"programme\.0: does not touch"),
        ({"materials": {"bulk": RELAXING}}, "relax, needs elastic ones"),
    ],
)
def test_a_body_that_cannot_be_pressed_is_refused(changes, words):
    with pytest.raises(InputError, match=words):
        list(pressed_bodies(dataclasses.replace(pressed_pad(), **changes), [5e-6], spacing=0.25, near=1e-3))


def test_a_body_that_gives_way_without_its_contact_is_refused_and_later_states_are_left_out(monkeypatch, caplog):
    renewed, counts = Large.renewed, itertools.count()
    monkeypatch.setattr(Large, "renewed", lambda *_: None)
    with pytest.raises(InputError, match=r"programme\.0: presses a body that gives way, needs less depth"):
        pressed_body(pressed_pad(), spacing=0.25, near=1e-3)
    monkeypatch.setattr(Large, "renewed", lambda *given: None if next(counts) else renewed(*given))
    assert len(pressed_body(pressed_pad(), spacing=0.25, near=1e-3).answers) == 1
    assert "no state is taken at t = " in caplog.text


@pytest.mark.parametrize("time", [1.42, 0.42])
def test_a_slide_that_ends_early_leaves_the_states_so_far_and_a_press_is_an_error(time, monkeypatch, caplog):
    advance = Large.advance

    def ending(integrator, states, ends):
        if ends[0] > time:
            raise fs.ConvergenceError(ends[0], 0, 1.0, 1e-6, "fold less")
        return advance(integrator, states, ends)

    monkeypatch.setattr(Large, "advance", ending)
    if time < 0.8:
        with pytest.raises(fs.ConvergenceError, match="fold less"):
            pressed_body(pressed_pad(), spacing=0.25, near=1e-3)
        return
    assert len(pressed_body(pressed_pad(), spacing=0.25, near=1e-3).answers) == 3
    assert "its last state stands for what follows: contact at t = 1.45 s" in caplog.text


@pytest.mark.slow
def test_bodies_of_one_press_are_those_of_a_press_for_each_depth():
    depths, sizes, told = (0.8e-3, 0.4e-3), {"spacing": 0.25, "near": 1e-3}, []
    model = searched(pressed_pad(), REACH)
    half, whole = pressed_bodies(model, depths, **sizes, progress=lambda *shares: told.append(shares))
    alone = dataclasses.replace(model, programme=(fs.Press(0.4e-3, 1e-3), model.programme[1]))
    for body, other in ((half, pressed_body(alone, **sizes)), (whole, pressed_body(model, **sizes))):
        assert len(body.answers) == len(other.answers)
        # Further from a shallower press more skin is watched.
        seen = slice(body.watched_rows.start)
        for name in ("moved", "answers"):
            here, there = getattr(body, name)[:, seen], getattr(other, name)[:, seen]
            assert here == pytest.approx(there, abs=1e-4 * np.abs(there).max()), name
        assert body.forces == pytest.approx(other.forces, abs=1e-4 * other.forces.max())
        assert body.shift == pytest.approx(other.shift)
    assert [depth for depth, _ in told] == sorted(depth for depth, _ in told)
    assert {depth for depth, _ in told} == set(depths)


def test_skin_that_touches_later_has_to_be_near_enough():
    with pytest.raises(
        InputError, match=r"near: got 0\.02 mm, and at t = .* node \d+ at .* reached the counterface.*, needs more"
    ):
        pressed_body(pressed_pad(), spacing=0.25, near=2e-5)
