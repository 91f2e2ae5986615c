"""Materials that relax: what is left in the end, energies, forces of supports, stresses, and what cannot be."""

import numpy as np
import pytest

import fingerslip as fs
from unit.dynamics.models import contact, model_of

TERMS = (fs.PronyTerm(0.3, 0.02), fs.PronyTerm(0.2, 0.2))
MODULUS, POISSON, STRETCH = 34e3, 0.45, 0.025


def bar(formulation="plane_stress", prony=TERMS, time=None, **others):
    """Return a bar that is pressed and rubbed on its lower side."""
    solid = formulation == "solid"
    along, across, high = np.linspace(0.0, 4e-3, 5), np.linspace(0.0, 1e-3, 2), np.linspace(0.0, 2e-3, 3)
    normal, middle = ((0.0, 0.0, 1.0), (2e-3, 0.0, 1e-3)) if solid else ((0.0, 1.0), (2e-3, 1e-3))
    values = {
        "materials": {"bulk": fs.Elastic(MODULUS, POISSON, 1000.0, prony=prony)},
        "formulation": formulation,
        "depth": 1.0 if solid else 1e-3,
        "contacts": contact(counterface=fs.Plane(normal), friction=fs.Coulomb(0.5)),
        "programme": (fs.Press(0.2e-3, 1e-3), fs.Slide(0.4e-3, 2e-3)),
        "time": time or fs.TimeStepping(0.01),
        "record": fs.Recording(sites=(fs.Site("middle", "probe", middle),)),
    }
    return model_of(*(("H8", along, across, high) if solid else ("Q4", along, high)), **(values | others))


def drawn(formulation="plane_stress", end=0.5, **others):
    """Return the history of the bar, drawn along x within 0.1 s and free across."""
    supports = {"left": ("x",), "right": ("x",), "bottom": ("y",)}
    motion = (1e-4, 0.0)
    if formulation == "solid":
        supports, motion = {"left": ("x",), "right": ("x",), "bottom": ("z",), "front": ("y",)}, (1e-4, 0.0, 0.0)
    still = {"contacts": (), "programme": (), "supports": supports, "time": fs.QuasiStatic(0.02, end=end)}
    motions = {"right": fs.SupportMotion(motion, fs.Ramp((0.0, 0.1), (0.0, 1.0)))}
    return fs.simulate(bar(formulation, **still, support_motions=motions, **others))


@pytest.mark.parametrize("formulation", ["plane_strain", "plane_stress", "solid"])
def test_in_the_end_the_springs_alone_are_left(formulation):
    """Half of the shear modulus and the whole bulk modulus; the elastic bar has both whole."""
    bulk, shear = MODULUS / (3 * (1 - 2 * POISSON)), MODULUS / (2 * (1 + POISSON))
    for prony, left in ((TERMS, 0.5), ((), 1.0)):
        modulus = 9 * bulk * left * shear / (3 * bulk + left * shear)
        poisson = modulus / (2 * left * shear) - 1
        along = modulus / (1 - poisson**2) if formulation == "plane_strain" else modulus
        history = drawn(formulation, 2.5, materials={"bulk": fs.Elastic(MODULUS, POISSON, 1000.0, prony=prony)})
        assert history.stress.values[-1, 0, 0] == pytest.approx(along * STRETCH, rel=1e-5)
        assert float(history.strain_energy[-1]) == pytest.approx(0.5 * along * STRETCH**2 * 8e-9, rel=1e-5)
        assert (float(history.viscous_dissipation[-1]) > 0.0) == bool(prony)


@pytest.mark.parametrize("time", [fs.TimeStepping(0.01), fs.QuasiStatic(0.01)], ids=["hht", "static"])
@pytest.mark.parametrize("formulation", ["plane_strain", "plane_stress", "solid"])
def test_energy_of_a_contact_run_closes_and_something_is_dissipated(formulation, time):
    history = fs.simulate(bar(formulation, time=time, damping=fs.RayleighDamping(1.0, 1e-4)))
    work = float(history["external_work"].values.max())
    assert float(np.abs(history["energy_imbalance"].values).max()) < 1e-10 * work
    assert float(history["viscous_dissipation"].values[-1]) > 0.02 * work
    force = fs.simulate(bar(formulation, (), time))["counterface_force"].values[-1, 0, -1]
    assert float(history["counterface_force"].values[-1, 0, -1]) < 0.9 * float(force)


def test_supports_carry_relaxed_forces_in_balance_and_snapshots_show_the_stress_of_sites():
    record = fs.Recording(sites=(fs.Site("middle", "probe", (2e-3, 1e-3)),), snapshots_every=0.5)
    history = drawn(record=record)
    force, stress = history["support_force"].values[:, :, 0], history["stress"].values[:, 0, 0]
    np.testing.assert_allclose(force[:, 0], -force[:, 1], atol=1e-10 * np.abs(force).max())
    np.testing.assert_allclose(force[:, 1], 2e-6 * stress, atol=1e-9 * np.abs(force).max())
    assert force[-1, 1] < 0.8 * force[:, 1].max()
    density = history["strain_energy_density"].values[-1, 0]
    np.testing.assert_allclose(history["snapshot_von_mises"].values[-1], stress[-1], rtol=1e-9)
    np.testing.assert_allclose(history["snapshot_strain_energy_density"].values[-1], density, rtol=1e-9)
    assert float(history["strain_energy"].values[-1]) == pytest.approx(8e-9 * float(density), rel=1e-9)
    history = fs.simulate(bar(time=fs.QuasiStatic(0.01)))
    total = history["support_force"].values.sum(axis=1) + history["counterface_force"].values[:, 0]
    np.testing.assert_allclose(total, 0.0, atol=1e-10 * np.abs(history["counterface_force"].values).max())
