"""A plate opposite the finger: its slab, the share that it bears, and the equation of motion between stiff faces."""

from dataclasses import replace

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.fe.space import build_space
from fingerslip.react import film
from fingerslip.react.scenario import held_model, join_slab, travel_after
from fingerslip.report.figures.motion import Film
from fingerslip.verification.meshes import box
from fingerslip.vision.video import open_frames
from unit.pads import pad

HELD = fs.HeldObject(
    mass=0.2,
    friction=0.5,
    load=fs.RampLoad(rate=4.0, force=2.0),
    margin=0.45,
    settle=0.1,
    after=0.1,
    step=2e-3,
    opposite="plate",
)


def axes_of(dim):
    return [np.linspace(-4e-3, 4e-3, 5), np.linspace(1e-3, 4e-3, 4), np.linspace(0.0, 2e-3, 3)][:dim]


@pytest.mark.parametrize(("element", "dim"), [("Q4", 2), ("T3", 2), ("T6", 2), ("H8", 3), ("T4", 3), ("T10", 3)])
def test_a_slab_lies_under_the_lowest_point_of_every_kind_of_mesh_and_has_its_cells(element, dim):
    mesh = box(element, *axes_of(dim))
    if element in {"Q4", "H8"}:
        mirrored = replace(mesh, doflocs=mesh.doflocs * np.array([-1.0, 1.0, 1.0])[:dim, None])
        build_space(join_slab(mirrored))
    joined = join_slab(mesh)
    assert type(joined) is type(mesh)
    assert set(joined.subdomains) == {*mesh.subdomains, "plate_slab"}
    assert set(joined.boundaries) == {*mesh.boundaries, "plate_face", "plate_back"}
    for name, height in (("face", 1e-3), ("back", 0.0)):
        nodes = np.unique(joined.facets[:, joined.boundaries[f"plate_{name}"]])
        assert joined.p[1, nodes] == pytest.approx(np.full(nodes.size, height), abs=1e-12)
    build_space(joined)  # refuses cells that are folded, or turn otherwise than the rest


@pytest.mark.slow
def test_stiff_faces_bear_the_same_friction_and_the_travel_is_that_of_the_equation_of_motion():
    margin = 0.25 * HELD.mass * 9.81
    load = fs.RampLoad(rate=4.0, force=margin + 4.0)
    held = replace(HELD, load=load, margin=0.25, rest=0.02, travel_limit=0.02, step=1e-3)
    reaction = fs.Reaction(fs.Reflex(gain=10.0), fs.Actuator(force_rate=20.0, largest_force=1e3))
    with fs.Grasp(held, pad(modulus=1e9, cells=4), {"at once": fs.AtOnce()}) as grasp:
        outcome = grasp.branch(reaction.response(margin / 4.0 + 74e-3, held.first_grip))
    assert outcome.travel == pytest.approx(travel_after(held.mass, 74e-3, 20.0, load_rate=4.0), rel=0.01)


def test_a_plate_bears_what_friction_allows_before_a_soft_finger_shears():
    held = replace(HELD, settle=0.6, load=fs.StepLoad(force=0.0), after=0.01)
    history = fs.simulate(held_model(held, pad()))
    finger, plate, _ = history["counterface_force"].values[-1, :, 0]
    assert plate == pytest.approx(held.friction * held.first_grip, rel=0.01)
    assert finger + plate == pytest.approx(held.first_load, rel=0.01)
    assert finger < 0.8 * held.friction * held.first_grip


@pytest.mark.slow
def test_an_alarm_of_the_skin_saves_the_object_and_a_film_shows_the_plate(tmp_path, monkeypatch):
    monkeypatch.setattr(film, "SHOWN_FILM", Film(size=(640, 480), frame_rate=5.0, seconds=1.0))
    with fs.Grasp(HELD, pad(), {"noticed": fs.SlippedArea(fraction=0.48)}) as grasp:
        assert grasp.open_loop.lost is not None
        assert grasp.open_loop.slipped.max() == pytest.approx(1.0)
        assert grasp.react(fs.Reaction(fs.Reflex(latency=20e-3), fs.Actuator(force_rate=50.0)), "noticed").saved
        film.write_film(tmp_path / "plate.mp4", grasp, "noticed", {"human-slip": fs.reaction("human-slip")})
    assert len(list(open_frames(tmp_path / "plate.mp4").read())) == 5
