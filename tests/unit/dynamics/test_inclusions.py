"""Stiff inclusions of a soft body: coordinates in which they turn, and what they save."""

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.finite import body
from fingerslip.dynamics.finite.body import find_inclusions
from fingerslip.dynamics.system.operators import Unknowns
from fingerslip.verification.meshes import box


def two_inclusions(dim, seed):
    """Return two inclusions of random nodes among softer cells, one node held along the last axis, and two motions."""
    random = np.random.default_rng(seed)
    positions = random.normal(size=(40, dim))
    cells = [8 * part + random.choice(8, dim + 1, replace=False) for part in (0, 0, 0, 0, 1, 1, 1, 1)]
    cells += [random.choice(40, dim + 1, replace=False) for _ in range(20)]
    stiffness = np.where(np.arange(28) < 8, 1e6, 1.0)
    free = np.delete(np.arange(40 * dim), cells[0][0] * dim + dim - 1)
    body = find_inclusions(positions, np.array(cells), stiffness, Unknowns(free), np.zeros(0, dtype=int))
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
    body = find_inclusions(positions, np.array([[0, 1, 2], [1, 2, 3]]), stiffness, Unknowns(np.arange(8)), touching)

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
