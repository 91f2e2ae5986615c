"""What acts on a body: tractions, gravity, drives, the programme of a counterface, and the penalties of contact."""

from dataclasses import replace

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.dynamics.system.bodies import counterface_motion
from fingerslip.dynamics.system.system import build_system
from fingerslip.verification.meshes import box
from problems.pushed import pad, push_and_slide
from unit.dynamics.models import assert_same_history, contact, model_of

# A body by itself, for some steps.
ALONE = {"contacts": (), "programme": (), "time": fs.QuasiStatic(5e-3, end=0.02)}


def test_a_ramped_traction_grows_and_stays():
    ramp = fs.Ramp((0.0, 0.01), (0.0, 1.0))
    history = fs.simulate(push_and_slide(**ALONE, tractions={"left": fs.Traction((7.0, 0.0), ramp)}))
    borne = -history.support_force.values[:, 0, 0] / (7.0 * 1e-3 * 3e-3)
    np.testing.assert_allclose(borne, [0.0, 0.5, 1.0, 1.0, 1.0], rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize("element", ["Q4", "T6"])
def test_gravity_weighs_the_whole_body(element):
    """Of a pad whose area is that of its cells: what moves it is the mass of the system."""
    model = push_and_slide(element, **ALONE, gravity=(0.0, -9.81))
    weight = -9.81 * build_system(replace(model, supports={}, time=fs.TimeStepping(1e-3, end=0.02))).mass.sum() / 2
    assert fs.simulate(model).support_force.values[-1, 0, 1] == pytest.approx(-weight, rel=1e-9)


@pytest.mark.parametrize("load", [{"initial_velocity": (0.3, -0.1)}, {"gravity": (30.0, -10.0)}])
def test_a_free_body_flies_on_and_falls(load):
    """As u = v t and u = g t^2 / 2, which the scheme has exactly."""
    free = {"contacts": (), "programme": (), "supports": {}, "time": fs.TimeStepping(1e-3, end=0.02)}
    history = fs.simulate(push_and_slide(**free, **load, sites=(fs.Site("a", "", (0.0, 2e-3)),)))
    ((name, values),) = load.items()
    way = 0.02 if name == "initial_velocity" else 0.5 * 0.02**2
    np.testing.assert_allclose(history.displacement.values[-1, 0], np.array(values) * way, rtol=1e-9)
    assert np.abs(history.energy_imbalance.values).max() <= 1e-10 * history.kinetic_energy.values.max()


def test_a_quasi_static_press_and_slide_ends_as_the_slow_dynamic_one():
    static = fs.simulate(push_and_slide(time=fs.QuasiStatic(5e-3)))
    dynamic = fs.simulate(push_and_slide(alpha=-1 / 3))
    np.testing.assert_allclose(static.counterface_force.values[-1], dynamic.counterface_force.values[-1], rtol=1e-3)
    assert not static.kinetic_energy.values.any()
    work = static.external_work.values[-1]
    assert np.abs(static.energy_imbalance.values).max() <= 1e-12 * work


def moved(programme, *, normal=(0.0, 1.0), end=None):
    """Return times, displacements [mm] and velocities [mm/s] of a counterface."""
    history = fs.simulate(
        model_of(
            "Q4" if len(normal) == 2 else "H8",
            *[np.linspace(0.0, 1.0, 2)] * len(normal),
            contacts=contact(counterface=fs.Plane(normal, offset=-10e-3), search_distance=2.0),
            gravity=(1e-6,) * len(normal),  # under loads it may slide before it touches
            programme=programme,
            time=fs.QuasiStatic(0.25, end=end),
        )
    )
    motion = history.counterface_displacement.values[:, 0], history.counterface_velocity.values[:, 0]
    return history.time.values, *(1e3 * values for values in motion)


PROGRAMME = (fs.Press(1.5e-3, 1.5e-3), fs.Hold(0.5), fs.Slide(6e-3, 3e-3), fs.Lift(1e-3, 2e-3))
KNOTS = [0.0, 1.0, 1.5, 3.5, 4.0, 4.5]


def test_a_plate_below_presses_up_and_slides_along_x_and_stands_still_without_a_programme():
    """The velocity is the slope, and at a knot that of the phase before."""
    times, places, speeds = moved(PROGRAMME, end=4.5)
    expected = [[0, 0], [0, 1.5], [0, 1.5], [6, 1.5], [6, 0.5], [6, 0.5]]
    np.testing.assert_allclose(places, np.transpose([np.interp(times, KNOTS, row) for row in np.transpose(expected)]))
    phase = np.clip(np.searchsorted(KNOTS, times, side="left") - 1, 0, None)
    slopes = np.array([[0.0, 1.5], [0.0, 0.0], [3.0, 0.0], [0.0, -2.0], [0.0, 0.0]])
    np.testing.assert_allclose(speeds, slopes[phase], atol=1e-9)
    assert not np.any(moved((), end=0.5)[1:])


@pytest.mark.parametrize(
    ("normal", "programme", "end"),
    [
        ((3.0, 4.0), (fs.Press(1e-3, 1e-3), fs.Slide(2e-3, 1e-3)), (0.6 + 1.6, 0.8 - 1.2)),
        ((0.0, 1.0), (fs.Slide(1e-3, 1e-3, direction=(-2.0, 0.0)),), (-1.0, 0.0)),
        ((0.0, 1.0), (fs.Slide(1e-3, 1e-3, direction=(3.0, 4.0)),), (1.0, 0.0)),
        ((0.0, 1.0), (fs.Slide(1e-3, 1e-3, direction=(-1e-3, 5e-3)),), (-1.0, 0.0)),
        ((0.0, 1.0), (fs.Press(1e-3, 1e-3), fs.Slide(2e-3, 1e-3, press=0.5e-3)), (2.0, 1.5)),
        ((0.0, 1.0), (fs.Slide(2e-3, 1e-3, press=0.5e-3), fs.Slide(2e-3, 1e-3, press=-1e-3)), (4.0, -0.5)),
        ((3.0, 4.0), (fs.Slide(2e-3, 1e-3, press=0.5e-3),), (2 * 0.8 + 0.5 * 0.6, -2 * 0.6 + 0.5 * 0.8)),
        *(
            ((0.0, 0.0, 1.0), (fs.Slide(1e-3, 1e-3, (size, 0.5 * size, 0.0)),), (2 / 5**0.5, 1 / 5**0.5, 0.0))
            for size in (1e-300, 1.0, 1e300)
        ),
    ],
)
def test_a_slide_goes_its_whole_way_along_the_counterface_and_may_press(normal, programme, end):
    np.testing.assert_allclose(moved(programme, normal=normal)[1][-1], end, rtol=1e-9, atol=1e-12)


def test_rounding_of_the_steps_does_not_move_a_knot():
    for speed in np.linspace(1e-3, 9e-3, 200):
        motion = counterface_motion((fs.Press(1.5e-3, speed), fs.Slide(6e-3, 3e-3)), fs.Plane())
        times = motion.knots[1] / 30.0 * np.arange(31)
        np.testing.assert_allclose(motion.velocity(times)[1:], [[0.0, speed]] * 30, atol=1e-12)


@pytest.mark.parametrize(
    ("changes", "reach"),
    [
        ({}, 1.5 * 0.4e-3),
        ({"tractions": {"left": (10.0, 0.0)}}, 1.0),
        ({"contacts": contact(search_distance=1.0)}, 1.0),
    ],
)
def test_nodes_within_one_and_a_half_times_the_approach_are_candidates_and_under_loads_all(changes, reach):
    """All have the area of the boundary together."""
    history, heights = fs.simulate(push_and_slide(**changes)), np.linspace(-4.0, 4.0, 9) ** 2 / 16.0 * 1e-3
    np.testing.assert_allclose(np.sort(history.contact_position.values[:, 1]), np.sort(heights[heights <= reach]))
    mesh = pad("Q4")
    ends = mesh.p[:, mesh.facets[:, mesh.boundaries["bottom"]]]
    area = 1e-3 * np.linalg.norm(ends[:, 1] - ends[:, 0], axis=0).sum()
    assert reach < 1.0 or float(history.contact_area.sum()) == pytest.approx(area, rel=1e-12)


def test_corners_of_quadratic_tetrahedra_may_follow_their_neighbours_into_the_plate():
    """They have no tributary area, so that no penalty holds them back: they are neither candidates nor outsiders."""
    history = fs.simulate(
        model_of(
            "T10",
            *[np.linspace(0.0, 1.0, 2)] * 3,
            contacts=contact(counterface=fs.Plane((0.0, 0.0, 1.0)), search_distance=1.0),
            programme=(fs.Press(0.01, 0.01),),
            time=fs.QuasiStatic(0.5),
        )
    )
    assert history.sizes["contact_node"] == 5, "the mid-side nodes of two triangles"
    assert history["counterface_force"].values[-1, 0, 2] > 0.0


GRID, UNEVEN = np.linspace(0.0, 1e-3, 5), [0.0, 1e-3, 1.5e-3, 2e-3, 2.5e-3, 4.5e-3]


@pytest.mark.parametrize("element", ["Q4", "T6"])
@pytest.mark.parametrize(
    ("axes", "layers", "moduli", "penalty"),
    [
        ((GRID, GRID), lambda c: c[1] < 0.5e-3, (2e5, 1e6), 10 * 2e5 / 0.25e-3),
        ((UNEVEN, GRID[::2]), lambda c: c[0] < 1.5e-3, (1e5, 3e5), 10 * 3e5 / 0.5e-3),
    ],
    ids=["one under the other", "side by side, of facets of three sizes"],
)
def test_automatic_penalties_are_those_of_the_stiffest_layer_and_of_a_middling_facet(
    element, axes, layers, moduli, penalty
):
    mesh = box(element, *axes, regions={"first": layers, "second": lambda c: ~layers(c)})
    first, second = (fs.Elastic(modulus, 0.4, 1000.0) for modulus in moduli)
    attrs = fs.simulate(push_and_slide(mesh=mesh, materials={"first": first, "second": second})).attrs
    np.testing.assert_allclose([attrs["normal_penalty"], attrs["tangential_penalty"]], penalty, rtol=1e-12)


def test_groups_of_cells_without_a_material_change_nothing():
    plain = push_and_slide(record=fs.Recording(snapshots_every=0.1))
    probe = plain.mesh.elements_satisfying(lambda x: x[1] < 1.5e-3)
    assert len(probe), "they lie at the contact"
    grouped = plain.mesh.with_subdomains({**plain.mesh.subdomains, "probe": probe})
    assert_same_history(fs.simulate(replace(plain, mesh=grouped)), fs.simulate(plain), 0.0)
