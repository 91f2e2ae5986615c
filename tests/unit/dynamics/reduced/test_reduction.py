"""A reduced system moves as that on the mesh does: in every scheme, under every load, everything recorded."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.contact.candidates import node_operator
from fingerslip.dynamics.reduced.reduction import (
    ReducedCoordinates,
    further_shapes,
    interface_unknowns,
    observed_unknowns,
    reduced_system,
)
from fingerslip.dynamics.system.system import build_system
from fingerslip.history import VARIABLES
from fingerslip.linear.craig_bampton import StaticResponses, craig_bampton, slow_motions, static_responses, vibrations
from fingerslip.linear.solver import preferred_solver
from problems.reduced import REDUCED, SITES, deep_push_and_slide, difference, fine_pad

# What shows the acceleration that few vibrations give, and what is rounding itself.
COARSE = {"velocity", "acceleration", "contact_velocity", "contact_acceleration", "snapshot_velocity"}
COARSE |= {"kinetic_energy", "numerical_dissipation"}
ROUNDING = {"energy_imbalance", "contact_iterations", "contact_residual"}


def both(model):
    """Return the history on the mesh and that in a reduced basis."""
    reduced = fs.simulate(dataclasses.replace(model, basis=REDUCED))
    assert reduced.attrs["basis"] == "reduced"
    return fs.simulate(model), reduced


def parts(model, count=10):
    """Return a system, its body and a basis of it."""
    system = build_system(model)
    body = StaticResponses(system.stiffness, system.mass, interface_unknowns([system]), preferred_solver())
    rows = observed_unknowns([model], [system])
    responses = static_responses(body, rows)
    further = further_shapes(body, [system])
    start = np.column_stack([slow_motions(body, responses[0], 5), *further])
    basis = craig_bampton(body, responses, vibrations(body, start, count), rows, further)
    return system, body, basis


@pytest.fixture(scope="module")
def press_and_slide():
    return both(deep_push_and_slide(damping=fs.RayleighDamping(mass=2.0, stiffness=1e-4)))


@pytest.mark.parametrize("name", sorted(set(VARIABLES) - ROUNDING - {"contact_state"}))
def test_everything_recorded_is_that_of_the_mesh(press_and_slide, name):
    full, reduced = press_and_slide
    if not full[name].size or not np.abs(full[name].values).max():
        pytest.skip("nothing to compare")
    assert difference(reduced, full, name) < (5e-2 if name in COARSE else 1e-3)


def test_contact_sticks_and_slips_where_it_does_on_the_mesh(press_and_slide):
    full, reduced = press_and_slide
    np.testing.assert_array_equal(reduced.contact_state, full.contact_state)
    assert set(np.unique(full.contact_state)) == {0, 1, 2}


def test_the_energy_of_the_reduced_body_is_balanced(press_and_slide):
    _, reduced = press_and_slide
    assert np.abs(reduced.energy_imbalance.values).max() < 1e-10 * np.abs(reduced.external_work.values).max()


def test_the_more_vibrations_the_nearer(monkeypatch):
    model = deep_push_and_slide()
    full, errors = fs.simulate(model), []
    for count in (5, 40, 160):
        monkeypatch.setattr("fingerslip.dynamics.reduced.march._FEWEST", count)
        reduced = fs.simulate(dataclasses.replace(model, basis=fs.ReducedBasis(0.5, 0.99)))
        assert reduced.attrs["basis_vibrations"] == count
        errors.append([difference(reduced, full, name) for name in ("displacement", "contact_acceleration")])
    (few, _), (some, _), (many, many_accelerations) = errors
    assert few > 2.0 * some > 2.0 * many
    assert many < 1e-5
    assert many_accelerations < 1e-3


def test_quasi_static_motions_are_exact():
    model = deep_push_and_slide(
        time=fs.QuasiStatic(5e-3),
        gravity=(0.5, -2.0),
        tractions={"left": fs.Traction((0.0, 30.0), fs.Ramp((0.0, 0.1), (0.0, 1.0)))},
    )
    full, reduced = both(model)
    for name in set(VARIABLES) - ROUNDING:
        if full[name].size and np.abs(full[name].values.astype(float)).max() > 1e-14:
            assert difference(reduced, full, name) < 1e-7, name


def test_gravity_and_initial_velocity_are_held_by_the_basis():
    full, reduced = both(deep_push_and_slide(gravity=(0.0, -5.0), initial_velocity=(0.0, -0.01)))
    assert difference(reduced, full, "displacement") < 1e-3
    assert difference(reduced, full, "normal_traction") < 1e-3


def test_a_driven_counterface_moves_as_on_the_mesh():
    contact = fs.Contact("bottom", friction=fs.Coulomb(0.4), drive=fs.Drive(mass=1e-3, force=2e-4))
    slide = (fs.Hold(0.05), fs.Slide(0.2e-3, 4e-3))
    full, reduced = both(deep_push_and_slide(contacts=(contact,), programme=slide))
    for name in ("counterface_displacement", "counterface_velocity", "counterface_force"):
        assert difference(reduced, full, name) < 1e-2
    assert np.abs(full.counterface_displacement.values[-1, 0, 1]) > 1e-6


def test_a_curved_counterface_turns_the_frames():
    contact = fs.Contact("bottom", fs.Cylinder(radius=20e-3, centre=(0.0, -20e-3)), fs.Coulomb(0.4))
    full, reduced = both(deep_push_and_slide(contacts=(contact,)))
    assert difference(reduced, full, "tangential_traction") < 1e-3


def test_motions_together_are_those_alone():
    models = [deep_push_and_slide(friction=friction, basis=REDUCED) for friction in (0.3, 0.6)]
    models[1] = dataclasses.replace(models[1], mesh=models[0].mesh, materials=models[0].materials)
    for alone, beside in zip(map(fs.simulate, models), fs.simulate_together(models), strict=True):
        for name in ("displacement", "contact_acceleration", "counterface_force"):
            assert difference(beside, alone, name) < 1e-7


def test_the_interface_is_that_of_candidates_and_drives():
    contact = fs.Contact("bottom", drive=fs.Drive(mass=1e-3, force=1e-3))
    system = build_system(deep_push_and_slide(contacts=(contact,)))
    found = interface_unknowns([system])
    assert found[-1] == system.mass.shape[0] - 1
    nodes = system.candidates.nodes
    dofs = np.concatenate([2 * nodes, 2 * nodes + 1])
    np.testing.assert_array_equal(system.free[found[:-1]], np.intersect1d(system.free, dofs))


def test_fields_and_sites_are_read_from_the_coordinates():
    system, body, basis = parts(deep_push_and_slide())
    coordinates = ReducedCoordinates(system, body, basis)
    z = np.random.default_rng(1).normal(size=basis.eigenvalues.size)
    field = np.concatenate([z, basis.at_interface @ z])
    on_mesh = coordinates.on_mesh(field)
    touching = 2 * system.candidates.nodes[:2]
    np.testing.assert_allclose(coordinates.components(touching).read(field), on_mesh[touching], rtol=1e-9)
    taken, read = coordinates.apply_map(node_operator(system.site_nodes, 2, system.space.n_dofs))
    at_sites = (2 * system.site_nodes[:, None] + [0, 1]).ravel()
    np.testing.assert_allclose(read @ taken.read(field), on_mesh[at_sites], rtol=1e-9)
    both = np.stack([field, 2.0 * field], axis=1)
    np.testing.assert_allclose(coordinates.on_mesh(both), np.stack([on_mesh, 2.0 * on_mesh], axis=1), rtol=1e-9)
    held = np.setdiff1d(np.arange(system.space.n_dofs), system.free)
    np.testing.assert_array_equal(on_mesh[held], 0.0)
    np.testing.assert_array_equal(coordinates.components(held).read(field), 0.0)


def test_the_displacement_of_an_unknown_that_is_not_of_the_interface_is_not_at_hand():
    system, body, basis = parts(deep_push_and_slide())
    inside = np.setdiff1d(np.arange(system.mass.shape[0]), basis.interface)[:1]
    with pytest.raises(AssertionError, match="no unknown of the interface"):
        ReducedCoordinates(system, body, basis).components(system.free[inside])


def test_loads_are_those_that_do_the_same_work():
    system, body, basis = parts(deep_push_and_slide(gravity=(0.0, -5.0)))
    reduced = reduced_system(system, body, basis)
    z = np.random.default_rng(2).normal(size=basis.eigenvalues.size)
    field = np.concatenate([z, basis.at_interface @ z])
    assert reduced.load(0.1) @ field == pytest.approx(system.load(0.1) @ basis.field(body, z), rel=1e-9)


def test_a_system_takes_over_the_matrices_of_its_twin():
    model = deep_push_and_slide()
    (contact,) = model.contacts
    other = dataclasses.replace(model, contacts=(dataclasses.replace(contact, friction=fs.Coulomb(0.1)),))
    system, body, basis = parts(model)
    first, alone = reduced_system(system, body, basis), reduced_system(build_system(other, system), body, basis)
    taken = reduced_system(build_system(other, system), body, basis, first)
    assert taken.stiffness is first.stiffness
    assert taken.mass is first.mass
    assert taken.counterfaces == alone.counterfaces != first.counterfaces
    np.testing.assert_array_equal(taken.stiffness.toarray(), alone.stiffness.toarray())
    for name in ("stiffness", "mass"):
        np.testing.assert_array_equal(getattr(taken.supports, name), getattr(alone.supports, name))


def test_sites_of_all_motions_are_observed():
    model = deep_push_and_slide()
    other = dataclasses.replace(model, record=fs.Recording(sites=model.record.sites[:1]))
    systems = [build_system(model), build_system(other)]
    both = observed_unknowns([model, other], systems)
    np.testing.assert_array_equal(both, observed_unknowns([model], systems[:1]))
    assert both.size > observed_unknowns([other], systems[1:]).size


def test_sites_do_not_have_to_be_recorded():
    full, reduced = both(deep_push_and_slide(mesh=fine_pad(), record=fs.Recording()))
    assert reduced.sizes["site"] == 0 < len(SITES)
    assert difference(reduced, full, "contact_displacement") < 1e-3
