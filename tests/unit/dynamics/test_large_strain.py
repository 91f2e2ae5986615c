"""Motions at large strain: equilibrium whatever the factors, halved steps, contact, and inclusions that turn."""

import dataclasses
import gc
import itertools
import weakref

import numpy as np
import pytest
from scipy import sparse

import fingerslip as fs
from fingerslip.dynamics.finite import body, factors, iteration, large
from fingerslip.dynamics.finite.body import Body, find_inclusions
from fingerslip.dynamics.finite.large import Large
from fingerslip.dynamics.step.stepper import Stopwatch
from fingerslip.dynamics.system.operators import Unknowns
from fingerslip.dynamics.system.system import build_system
from fingerslip.errors import FingerslipError
from fingerslip.linear.solvers.superlu import SuperLU
from fingerslip.verification.meshes import box
from unit.dynamics.models import assert_same_history, block, contact, error_of, model_of

RELAXING = {
    "materials": {"bulk": fs.NeoHookean(1e4, 0.4, 1000.0, prony=(fs.PronyTerm(0.5, 0.6), fs.PronyTerm(0.2, 2.0)))}
}


def forces(history):
    return history["support_force"].values


def test_small_loads_give_small_strain_and_none_gives_rest():
    """Forces of large and small strain differ by the strain, 1e-5."""
    model = block(1e-5)
    small = fs.simulate(dataclasses.replace(model, kinematics="small"))
    assert error_of(fs.simulate(model), small, "support_force") < 1e-4
    still = fs.simulate(block(support_motions={}, time=fs.TimeStepping(0.1, end=1.0)))
    np.testing.assert_allclose(forces(still), 0.0, atol=1e-9)


def test_forces_of_a_body_that_nothing_moves_are_computed_once_a_step(monkeypatch):
    at, calls = Body.at, []
    monkeypatch.setattr(Body, "at", lambda *given: calls.append(given) or at(*given))
    fs.simulate(block(support_motions={}, time=fs.TimeStepping(0.1, end=1.0)))
    assert len(calls) == 10


@pytest.mark.parametrize("changes", [{}, RELAXING], ids=["elastic", "relaxing"])
def test_every_step_ends_in_equilibrium_and_its_work_is_stored_or_dissipated(changes):
    """Nothing but the two supports acts on the block; energy, force and tangent belong together."""
    history = fs.simulate(block(0.3, steps=60, **changes))
    total = forces(history).sum(axis=1)
    assert np.abs(total).max() < 1e-5 * np.abs(forces(history)).max()
    assert np.abs(history.energy_imbalance.values).max() < 2e-3 * float(history.external_work[-1])
    assert (float(history.viscous_dissipation[-1]) > 0.0) == bool(changes)
    assert 60 <= history.attrs["newton_iterations"] < 60 * 8


def test_a_motion_computed_twice_is_the_same_to_the_last_bit_and_says_what_it_cost():
    model = block(0.3, time=fs.TimeStepping(0.05, end=1.0))
    history, again = fs.simulate(model), fs.simulate(model)
    assert_same_history(again, history, 0.0)
    attributes = history.attrs
    assert attributes["kinematics"] == "finite"
    assert attributes["newton_iterations"] >= 20
    assert 1 <= attributes["factorisations"] < 5, "factors serve many steps"
    assert attributes["halved_steps"] == 0
    assert {"seconds_bulk", "seconds_tangent", "seconds_factorisation", "cpu_seconds_bulk"} <= attributes.keys()


def test_a_slender_beam_bends_far_in_one_step():
    """Its first iterate is stretched a thousand times as much as it bends."""
    length, modulus = 60.0, 1e6
    history = fs.simulate(
        model_of(
            "T6",
            np.linspace(0.0, length, 31),
            [0.0, 1.0],
            materials={"bulk": fs.NeoHookean(modulus, 0.0, 1.0)},
            formulation="plane_stress",
            supports={"left": ("x", "y")},
            tractions={"right": fs.Traction((0.0, -modulus / 12 / length**2), fs.Ramp((0.0, 1.0), (0.0, 1.0)))},
            kinematics="finite",
            time=fs.QuasiStatic(1.0, end=1.0),
            record=fs.Recording(sites=(fs.Site("tip", "", (length, 0.0)),)),
        )
    )
    assert history.attrs["halved_steps"] == 0
    assert history["displacement"].values[-1, 0, 1] / length == pytest.approx(-0.3017, abs=2e-3)


class Rough:
    """A solver whose rough factors are those of a matrix in which each unknown is wrong by up to a factor."""

    name = "rough"

    def __init__(self, wrong):
        self.exact, self.wrong, self.made = SuperLU(), wrong, 0

    def series(self):
        return self.exact

    def rough(self):
        return self

    def factorise_around(self, matrix, interface):
        self.made += 1
        if self.wrong is None:
            raise FingerslipError("the matrix is not positive definite")
        wrong = sparse.diags(self.wrong ** np.random.default_rng(0).uniform(-1.0, 1.0, matrix.shape[0]))
        return self.exact.factorise_around(sparse.csr_matrix(wrong @ matrix @ wrong), interface)


@pytest.mark.parametrize(("wrong", "exact_too"), [(1.0, False), (1.01, False), (5.0, True), (None, True)])
@pytest.mark.usefixtures("as_large")
def test_rough_factors_are_replaced_where_they_do_not_solve_a_step_or_cannot_be_made(wrong, exact_too):
    solver = Rough(wrong)
    history, expected = fs.simulate(block(), solver=solver), fs.simulate(block(), solver=SuperLU())
    assert_same_history(history, expected, 1e-5, ("support_force", "strain_energy"))
    assert solver.made >= 1
    assert (history.attrs["factorisations"] > solver.made or wrong is None) == exact_too


class Watched(SuperLU):
    """A solver that notes whether its last factors still exist when it makes others."""

    def __init__(self):
        self.last, self.existed = None, []

    def series(self):
        return self

    def factorise_around(self, matrix, interface):
        self.existed.append(self.last is not None and self.last() is not None)
        factor, schur = super().factorise_around(matrix, interface)
        self.last = weakref.ref(factor)
        return factor, schur


@pytest.fixture
def uncollected():
    """Python without its search for objects that hold each other."""
    gc.disable()
    yield
    gc.enable()


@pytest.mark.parametrize("cost", [30, 0])
@pytest.mark.usefixtures("uncollected")
def test_factors_go_before_others_are_made_also_where_an_iterate_went_too_far(cost, monkeypatch):
    """In 3D there is no memory for those of two, between steps and, where iterations cost much, within one."""
    monkeypatch.setattr(factors, "_COST", {2: cost})
    at, numbers, solver = Body.at, itertools.count(), Watched()

    def far(*given):
        if next(numbers) % 4 == 2:
            raise FingerslipError("a cell is turned inside out")
        return at(*given)

    monkeypatch.setattr(Body, "at", far)
    model = block(0.4, steps=8)
    integrator = Large(model, build_system(model), solver, Stopwatch(), 0)
    state = integrator.start()[0]
    for end in np.linspace(0.125, 1.0, 8):
        (state,) = integrator.advance({0: state}, np.array([end]))[0]
        integrator.renewed(state)
    assert len(solver.existed) > 8
    assert not any(solver.existed)
    integrator.release()
    assert solver.last() is None


@pytest.mark.usefixtures("uncollected")
def test_a_released_integrator_keeps_nothing_that_served_its_factors():
    class Several(SuperLU):
        def series(self):
            series = SuperLU()
            series_so_far.append(weakref.ref(series))
            return series

    series_so_far, model, solver = [], block(0.4, steps=8), Several()
    integrator = Large(model, build_system(model), solver, Stopwatch(), 0)
    integrator.start()
    before = list(series_so_far)
    integrator.release()
    assert before
    assert not any(series() for series in before)


def test_old_factors_give_the_same_steps_as_new_ones():
    """A dynamic run whose factors serve on, and one in halves of its steps, which need others."""
    one, other = (fs.simulate(block(0.4, steps=count)) for count in (8, 64))
    assert one.attrs["factorisations"] < 8
    np.testing.assert_allclose(forces(one)[1:], forces(other)[8::8], atol=1e-4 * np.abs(forces(other)).max())


@pytest.mark.parametrize("element", ["Q4", "T6"])
def test_an_indefinite_tangent_is_no_obstacle(element):
    """Under half of its height the block would rather buckle; forces are those of many steps all the same."""
    one, other = (fs.simulate(block(0.6, steps=count, element=element)) for count in (5, 40))
    np.testing.assert_allclose(forces(one)[-1], forces(other)[-1], atol=1e-3 * np.abs(forces(other)).max())


@pytest.mark.parametrize("share", [0.1, 1.0])
def test_an_arch_snaps_through_in_one_step_to_where_it_comes_back_from_twice_the_load(share, monkeypatch):
    """It bears 2.312 Pa; the last step ends 0.1 % above, where forces hardly drive it and it has far to go."""
    monkeypatch.setattr(factors, "_DEFINITE", share)
    flat = box("T6", np.linspace(-1.0, 1.0, 13), [0.0, 0.1])
    x, y = flat.doflocs
    mesh = dataclasses.replace(flat, doflocs=np.vstack([x, y + 0.15 * (1.0 - x**2)]))

    def arch(*loads):
        ramp = fs.Ramp((0.0, 1.0, 2.0), (0.0, *loads))
        changes = {"materials": {"bulk": fs.NeoHookean(1e4, 0.0, 1.0)}, "formulation": "plane_stress"}
        changes |= {"supports": {"left": ("x", "y"), "right": ("x", "y")}, "kinematics": "finite"}
        top = fs.Recording(sites=(fs.Site("top", "", (0.0, 0.25)),))
        time = fs.QuasiStatic(1.0 / 3.0, end=2.0)
        tractions = {"top": fs.Traction((0.0, -2.3142), ramp)}
        return fs.simulate(
            model_of("T6", [0, 1], [0, 1], mesh=mesh, tractions=tractions, time=time, record=top, **changes)
        )

    snapped, back = arch(0.5, 1.0), arch(2.0, 1.0)
    down = snapped["displacement"].values[:, 0, 1]
    assert down[-2] > -0.05
    assert down[-1] == pytest.approx(back["displacement"].values[-1, 0, 1], rel=1e-4)
    assert down[-1] < -0.17
    assert snapped.attrs["halved_steps"] == 0


@pytest.fixture
def give_up(monkeypatch):
    """A function that lets steps longer than a time be given up, after they were computed."""
    advance = large.advance_finite

    def longer_than(longest):
        def too_long(factors, before, time, *others, **named):
            after = advance(factors, before, time, *others, **named)
            if time - before.time > longest:
                raise fs.ConvergenceError(time, 0, 1.0, 1e-6, "take less")
            return after

        monkeypatch.setattr(large, "advance_finite", too_long)

    return longer_than


@pytest.mark.parametrize("changes", [{}, RELAXING], ids=["elastic", "relaxing"])
def test_a_step_that_fails_is_halved_and_ends_where_small_steps_do(changes, give_up):
    """What a body remembers goes back with the step, even where this was computed before it was given up."""
    give_up(0.3)
    halved, fine = fs.simulate(block(0.3, steps=1, **changes)), fs.simulate(block(0.3, steps=4, **changes))
    assert halved["time"].values.tolist() == [0.0, 1.0]
    assert (halved.attrs["halved_steps"], fine.attrs["halved_steps"]) == (3, 0)
    scale = np.abs(forces(fine)).max()
    np.testing.assert_allclose(forces(halved)[-1], forces(fine)[-1], atol=1e-5 * scale)
    for name in ("viscous_dissipation", "external_work"):
        assert float(halved[name][-1]) == pytest.approx(float(fine[name][-1]), rel=1e-4), name


def test_halves_of_steps_without_inertia_go_on_with_the_factors_of_whole_ones(give_up):
    model = block(0.05, steps=1)
    whole = fs.simulate(dataclasses.replace(model, time=fs.QuasiStatic(0.5, end=1.0)))
    give_up(0.7)
    halved = fs.simulate(dataclasses.replace(model, time=fs.QuasiStatic(1.0, end=1.0)))
    assert (halved.attrs["halved_steps"], halved.attrs["factorisations"]) == (1, whole.attrs["factorisations"])
    np.testing.assert_allclose(forces(halved)[-1], forces(whole)[-1], atol=1e-5 * np.abs(forces(whole)).max())
    assert halved["velocity"].values[-1] == pytest.approx(whole["velocity"].values[-1], rel=1e-3, abs=1e-6)


def test_an_iterate_that_cells_let_go_nowhere_goes_on_with_other_factors(monkeypatch):
    model = block(0.3, steps=1)
    history, towards, numbers = fs.simulate(model), iteration._towards, itertools.count()

    def stuck(factors, start, iterate, aim):
        if next(numbers) == 1:
            raise fs.ConvergenceError(start.time, 0, np.inf, 1e-6, "a cell is turned inside out")
        return towards(factors, start, iterate, aim)

    monkeypatch.setattr(iteration, "_towards", stuck)
    again = fs.simulate(model)
    assert again.attrs["halved_steps"] == history.attrs["halved_steps"] == 0
    assert again.attrs["factorisations"] > history.attrs["factorisations"]
    np.testing.assert_allclose(forces(again)[-1], forces(history)[-1], atol=1e-5 * np.abs(forces(history)).max())


def test_what_is_never_solved_is_an_error_that_says_when_where_and_what_to_try():
    """A body that is pressed through itself: its halves are halved six times."""
    with pytest.raises(fs.ConvergenceError, match=r"mm is turned inside out.*smaller time step") as caught:
        fs.simulate(block(2.0, steps=1))
    assert 0.3 < caught.value.time < 0.7
    assert caught.value.time * 64 == pytest.approx(round(caught.value.time * 64))


def test_what_was_computed_until_a_step_fails_is_that_of_the_whole_motion(monkeypatch):
    whole, advance = fs.simulate(block(0.3, steps=4)), large.advance_finite

    def failing(factors, before, time, *others):
        if time > 0.5:
            raise fs.ConvergenceError(time, 0, 1.0, 1e-6, "take less")
        return advance(factors, before, time, *others)

    monkeypatch.setattr(large, "advance_finite", failing)
    with pytest.raises(fs.ConvergenceError, match="take less") as caught:
        fs.simulate(block(0.3, steps=4))
    partial = caught.value.history
    assert partial.attrs["failure"] == str(caught.value)
    for name in ("time", "displacement", "stress", "external_work", "counterface_force"):
        np.testing.assert_array_equal(partial[name], whole[name][:3], err_msg=name)


def dragged(**changes):
    """Return the history of a block that is pressed on a plate and dragged."""
    values = {
        "supports": {"top": ("x", "y")},
        "support_motions": {},
        "contacts": contact(counterface=fs.Plane((0.0, 1.0))),
        "programme": (fs.Press(0.1, 0.1), fs.Slide(0.3, 0.1)),
        "time": fs.QuasiStatic(0.1),
    }
    return fs.simulate(block(**(values | changes)))


def test_contact_obeys_its_law_at_the_end_of_every_step():
    """A block pressed on a plate and dragged keeps Coulomb's law, though iterations begin roughly."""
    history = dragged()
    assert history["contact_residual"].values.max() <= 1e-8
    normal, tangential = history["normal_traction"].values, history["tangential_traction"].values
    assert (normal >= 0.0).all()
    assert (np.linalg.norm(tangential, axis=-1) <= 0.4 * normal * (1 + 1e-9) + 1e-12).all()
    force = history["counterface_force"].values[-1, 0]
    assert abs(force[0]) == pytest.approx(0.4 * abs(force[1]), rel=1e-6)
    assert np.abs(history["energy_imbalance"].values).max() < 1e-5 * history["external_work"].values[-1]


@pytest.mark.slow
def test_steps_are_those_of_newtons_method_with_a_new_tangent_in_every_step(monkeypatch):
    """The tolerance of a step, 1e-6 of its forces, leaves as much in forces and 1e-7 in displacements."""
    history = dragged()
    monkeypatch.setattr(factors, "_COST", {2: 0})
    for name, value in {"_TOLERANCE": 1e-9, "_AT_END": 1e-11, "_COARSEST": 1e-11}.items():
        monkeypatch.setattr(iteration, name, value)
    newtons = dragged()
    assert newtons.attrs["factorisations"] >= newtons.sizes["time"] - 1 > history.attrs["factorisations"]
    assert_same_history(history, newtons, 1e-6, ("counterface_force", "support_force", "strain_energy"))


def test_a_reduced_basis_is_not_for_large_strain(caplog):
    caplog.set_level("INFO")
    assert dragged(basis=fs.ReducedBasis()).attrs["basis"] == "full"
    assert "large strain is computed on the mesh" in caplog.text


def two_inclusions(dim, seed):
    """Return two inclusions of random nodes among softer cells, one node held along the last axis, and two motions."""
    random = np.random.default_rng(seed)
    positions = random.normal(size=(40, dim))
    cells = [8 * part + random.choice(8, dim + 1, replace=False) for part in (0, 0, 0, 0, 1, 1, 1, 1)]
    cells += [random.choice(40, dim + 1, replace=False) for _ in range(20)]
    stiffness = np.where(np.arange(28) < 8, 1e6, 1.0)
    free = np.delete(np.arange(40 * dim), cells[0][0] * dim + dim - 1)
    body = find_inclusions(positions, np.array(cells), stiffness, Unknowns(free, 40 * dim), np.zeros(0, dtype=int))
    return body, 0.2 * random.normal(size=(2, free.size)), random.normal(size=(2, free.size))


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("seed", range(5))
def test_coordinates_lead_back_and_a_small_change_is_what_it_is_on_the_mesh(dim, seed):
    body, (displacement, other), (change, force) = two_inclusions(dim, seed)
    assert len(body.means.indptr) == 3, "two inclusions"
    start = body.rotations(other)
    predictor = 0.5 * other
    local = body.local(displacement - predictor, predictor, start)
    back = body.since(local.flat(), predictor, start)
    np.testing.assert_allclose(predictor + back, displacement, atol=1e-14)
    small = 1e-5 * change
    end = body.since(body.moved(local, small, start), predictor, start)
    np.testing.assert_allclose(predictor + end, displacement + small, atol=2e-9)
    turned = body.motion(change, local, start)
    assert force @ turned == pytest.approx(body.forces(force, local, start) @ change, rel=1e-12)
    there = body.rotations(displacement)
    here = body.local(displacement - predictor, predictor, there)
    np.testing.assert_allclose(body.motion(change, here, there), change, atol=1e-13)


def test_a_far_turn_of_an_inclusion_is_no_strain():
    """A linear step that turns an inclusion by half a radian ends in a rotation, not in a stretch."""
    body, (displacement, _), _ = two_inclusions(3, 0)
    held = displacement.size
    change = np.zeros(held + 1)
    change[body.rows] = np.cross([0.0, 0.0, 0.5], body.arms)
    rest = np.zeros(held)
    start = body.rotations(rest)
    end = body.moved(body.local(rest, rest, start), change[:held], start)
    turned = np.append(body.since(end, rest, start), 0.0)
    is_free = body.rows[:, 2] < held
    lengths = np.linalg.norm(body.arms + turned[body.rows], axis=1)
    np.testing.assert_allclose(lengths[is_free], np.linalg.norm(body.arms, axis=1)[is_free], rtol=1e-12)


def test_half_way_between_two_turns_is_between_them_beyond_half_a_turn_too():
    positions = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [5.0, 5.0]])
    stiffness, touching = np.array([1e6, 1.0]), np.zeros(0, dtype=int)
    body = find_inclusions(positions, np.array([[0, 1, 2], [1, 2, 3]]), stiffness, Unknowns(np.arange(8), 8), touching)

    def turned(angle):
        sine, cosine = np.sin(angle), np.cos(angle)
        return (positions @ np.array([[cosine, sine], [-sine, cosine]]) - positions).ravel()

    start, rest = body.rotations(turned(3.1)), np.zeros(8)
    ends = [body.local(turned(angle), rest, start).flat() for angle in (3.1, 3.2)]
    middle = body.since(0.5 * sum(ends), rest, start)
    sides = (positions.ravel() + middle).reshape(-1, 2)[:3]
    np.testing.assert_allclose(sides[1] - sides[0], [np.cos(3.15), np.sin(3.15)], atol=1e-12)


def sheared_block(element, *counts):
    """Return a soft block of 10 mm with a stiff rod upright in its middle, whose top moves aside by 4 mm in 4 steps."""
    mesh = box(element, *(np.linspace(0.0, 10e-3, count + 1) for count in counts))
    centres = mesh.p[:, mesh.t].mean(axis=1)
    is_rod = (np.abs(centres[[0, -1]] - 5e-3) < np.array([[1e-3], [3e-3]])).all(axis=0)
    directions = ("x", "y", "z")[: mesh.dim()]
    return fs.Model(
        mesh=mesh.with_subdomains({"rod": np.flatnonzero(is_rod), "gel": np.flatnonzero(~is_rod)}),
        materials={"rod": fs.NeoHookean(2.5e9, 0.35, 1000.0), "gel": fs.NeoHookean(5e3, 0.45, 1000.0)},
        formulation="plane_strain" if mesh.dim() == 2 else "solid",
        supports={"bottom": directions, "top": directions},
        support_motions={"top": fs.SupportMotion((4e-3, 0.0, 0.0)[: mesh.dim()], fs.Ramp((0.0, 1.0), (0.0, 1.0)))},
        kinematics="finite",
        time=fs.QuasiStatic(0.25, end=1.0),
    )


@pytest.mark.parametrize(
    ("element", "counts"), [("Q4", (10, 10)), pytest.param("H8", (10, 2, 10), marks=pytest.mark.slow)]
)
def test_a_turned_rod_costs_few_factors_and_ends_where_it_does_without_its_coordinates(element, counts, monkeypatch):
    model = sheared_block(element, *counts)
    history = fs.simulate(model)
    monkeypatch.setattr(body, "_STIFF", np.inf)
    plain = fs.simulate(model)
    largest = np.abs(plain.support_force.values).max()
    np.testing.assert_allclose(history.support_force.values, plain.support_force.values, atol=1e-5 * largest)
    assert history.attrs["factorisations"] < 4
    assert plain.attrs["factorisations"] > 12
