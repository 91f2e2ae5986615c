"""What relaxing layers remember: the force of a step, its energies, and motions of a whole model."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from fingerslip.contact.counterfaces import Plane
from fingerslip.contact.friction import Coulomb
from fingerslip.dynamics.simulation import simulate
from fingerslip.dynamics.step.memory import no_memory, relaxed_force, stiffness_of_step, viscous_steps
from fingerslip.dynamics.system.system import build_system
from fingerslip.errors import InputError
from fingerslip.fe.cell_materials import cell_materials
from fingerslip.fe.forms import relaxing_layers, stiffness_matrix
from fingerslip.fe.space import build_space
from fingerslip.materials.elastic import Elastic, RayleighDamping
from fingerslip.materials.neo_hookean import NeoHookean
from fingerslip.materials.prony import PronyTerm
from fingerslip.model.model import Contact, Model, Recording, ReducedBasis, SupportMotion
from fingerslip.model.programme import Press, Ramp, Slide
from fingerslip.model.timing import QuasiStatic, TimeStepping
from fingerslip.sites import Site
from fingerslip.verification.meshes import box

TERMS = (PronyTerm(0.3, 0.02), PronyTerm(0.2, 0.2))
STEP = 0.02


def layers(formulation, law=None):
    grid = np.linspace(0.0, 1.0, 3)
    space = build_space(box("H8" if formulation == "solid" else "Q4", *[grid] * (3 if formulation == "solid" else 2)))
    materials = cell_materials(space, {"bulk": law or Elastic(34e3, 0.45, 1000.0, prony=TERMS)}, formulation)
    stiffness = stiffness_matrix(space, materials, 1.0, "selective")
    return stiffness, viscous_steps(relaxing_layers(space, materials, 1.0, "selective"), STEP)


@pytest.mark.parametrize("formulation", ["plane_strain", "plane_stress", "solid"])
def test_force_of_a_step_is_that_of_its_memory_and_energies_balance(formulation):
    """K_step u_1 - q from the start alone is K u_1 - S y_1 + T ... at the end, whose work is stored or dissipated."""
    stiffness, viscous = layers(formulation)
    (own,) = viscous
    matrix = stiffness_of_step(stiffness, viscous)
    np.testing.assert_allclose(matrix.toarray(), matrix.T.toarray(), atol=1e-9 * np.abs(matrix).max())
    memory, generator = no_memory(own), np.random.default_rng(4)
    displacement, force, stored = np.zeros(len(memory.given[0])), 0.0, 0.0
    for _ in range(20):
        moved = displacement + generator.normal(size=displacement.size)
        predicted = matrix @ moved - own.force(memory)
        memory = own.after(memory, moved)
        found = stiffness @ moved - relaxed_force([own.layers], viscous, [memory])
        np.testing.assert_allclose(predicted, found, atol=1e-10 * np.abs(found).max())
        now = 0.5 * moved @ stiffness @ moved + memory.stored
        work = 0.5 * (found + force) @ (moved - displacement)
        assert now - stored + memory.dissipated == pytest.approx(work, rel=1e-9, abs=1e-9 * now)
        displacement, force, stored = moved, found, now


def test_stored_energy_at_rest_is_that_of_the_springs_left():
    stiffness, (own,) = layers("plane_strain")
    memory, moved = no_memory(own), np.random.default_rng(1).normal(size=stiffness.shape[0])
    for _ in range(2000):
        memory = own.after(memory, moved)
    left = stiffness - 0.5 * own.layers.shape
    assert 0.5 * moved @ stiffness @ moved + memory.stored == pytest.approx(0.5 * moved @ left @ moved, rel=1e-9)
    assert memory.dissipated == pytest.approx(0.0, abs=1e-9 * moved @ stiffness @ moved)


def bar(formulation="plane_stress", prony=TERMS, time=None, **others):
    """Return a bar that is drawn, and pressed and rubbed on its lower side."""
    solid = formulation == "solid"
    axes = [np.linspace(0.0, 4e-3, 5), np.linspace(0.0, 1e-3, 2), np.linspace(0.0, 2e-3, 3)]
    contact = Contact("bottom", Plane((0.0, 0.0, 1.0) if solid else (0.0, 1.0)), Coulomb(0.5))
    return Model(
        mesh=box("H8", *axes) if solid else box("Q4", axes[0], axes[2]),
        materials={"bulk": Elastic(34e3, 0.45, 1000.0, prony=prony)},
        formulation=formulation,
        depth=1.0 if solid else 1e-3,
        supports={"top": ("x", "y", "z") if solid else ("x", "y")},
        contacts=(contact,),
        programme=(Press(0.2e-3, 1e-3), Slide(0.4e-3, 2e-3)),
        time=time or TimeStepping(0.01),
        record=Recording(sites=(Site("middle", "probe", (2e-3, 1e-3) if not solid else (2e-3, 0.0, 1e-3)),)),
        **others,
    )


@pytest.mark.parametrize("time", [TimeStepping(0.01), QuasiStatic(0.01)], ids=["hht", "static"])
@pytest.mark.parametrize("formulation", ["plane_strain", "plane_stress", "solid"])
def test_energy_of_a_contact_run_closes_and_something_is_dissipated(formulation, time):
    history = simulate(bar(formulation, time=time, damping=RayleighDamping(1.0, 1e-4)))
    work = float(history["external_work"].values.max())
    assert float(np.abs(history["energy_imbalance"].values).max()) < 1e-10 * work
    assert float(history["viscous_dissipation"].values[-1]) > 0.02 * work
    force = simulate(bar(formulation, (), time))["counterface_force"].values[-1, 0, -1]
    assert float(history["counterface_force"].values[-1, 0, -1]) < 0.9 * float(force)


def test_forces_of_supports_and_counterfaces_balance_without_inertia():
    history = simulate(bar(time=QuasiStatic(0.01)))
    total = history["support_force"].values.sum(axis=1) + history["counterface_force"].values[:, 0]
    np.testing.assert_allclose(total, 0.0, atol=1e-10 * np.abs(history["counterface_force"].values).max())


def test_moving_supports_carry_relaxed_forces():
    model = dataclasses.replace(
        bar(time=QuasiStatic(0.01, end=0.5)),
        contacts=(),
        programme=(),
        supports={"left": ("x",), "right": ("x",), "bottom": ("y",)},
        support_motions={"right": SupportMotion((1e-4, 0.0), Ramp((0.0, 0.1), (0.0, 1.0)))},
    )
    history = simulate(model)
    force = history["support_force"].values[:, :, 0]
    np.testing.assert_allclose(force[:, 0], -force[:, 1], atol=1e-10 * np.abs(force).max())
    np.testing.assert_allclose(force[:, 1], 2e-6 * history["stress"].values[:, 0, 0], atol=1e-9 * np.abs(force).max())
    assert force[-1, 1] < 0.8 * force[:, 1].max()


def test_snapshots_show_the_stress_that_sites_record():
    model = dataclasses.replace(
        bar(time=QuasiStatic(0.01, end=0.3)),
        contacts=(),
        programme=(),
        supports={"left": ("x",), "right": ("x",), "bottom": ("y",)},
        support_motions={"right": SupportMotion((1e-4, 0.0), Ramp((0.0, 0.1), (0.0, 1.0)))},
        record=Recording(sites=(Site("middle", "probe", (2e-3, 1e-3)),), snapshots_every=0.3),
    )
    history = simulate(model)
    np.testing.assert_allclose(history["snapshot_von_mises"].values[-1], history["stress"].values[-1, 0, 0], rtol=1e-9)
    np.testing.assert_allclose(
        history["snapshot_strain_energy_density"].values[-1], history["strain_energy_density"].values[-1, 0], rtol=1e-9
    )
    volume = 8e-9
    assert float(history["strain_energy"].values[-1]) == pytest.approx(
        float(history["strain_energy_density"].values[-1, 0]) * volume, rel=1e-9
    )


def test_relaxation_faster_than_half_a_step_is_refused_where_it_stands():
    with pytest.raises(InputError, match=r"materials\.bulk\.prony\.0\.time: got 0\.02 s for a step of 0\.1 s"):
        simulate(bar(time=TimeStepping(0.1)))


def test_a_reduced_basis_gives_way_to_the_mesh(caplog):
    history = simulate(bar(basis=ReducedBasis()))
    assert history.attrs["basis"] == "full"
    assert "materials relax" in caplog.text


def test_bodies_at_large_strain_remember_themselves():
    law = NeoHookean(34e3, 0.45, 1000.0, prony=TERMS)
    model = dataclasses.replace(bar(time=QuasiStatic(0.01)), materials={"bulk": law}, kinematics="finite")
    assert build_system(model).relaxing == ()
    assert build_system(dataclasses.replace(model, kinematics="small")).relaxing != ()
    with pytest.raises(InputError, match=r"materials\.bulk\.prony\.0\.time: got 0\.02 s for a step of 0\.1 s"):
        simulate(dataclasses.replace(model, time=TimeStepping(0.1)))
