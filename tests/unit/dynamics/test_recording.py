"""What a history holds: labels, units, snapshots, and values that follow from each other."""

import dataclasses

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

import fingerslip as fs
from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.dynamics.recording import schedule
from fingerslip.history import COORDINATES, VARIABLES
from fingerslip.verification.meshes import box
from problems.pushed import push_and_slide
from problems.reduced import SITES
from unit.dynamics.models import assert_same_history, contact, model_of

RELAXING = fs.Elastic(50e3, 0.45, 1000.0, prony=(fs.PronyTerm(0.3, 0.1),))


def test_every_variable_is_finite_and_has_its_dimensions_units_and_labels(history):
    assert set(history.data_vars) == set(VARIABLES)
    assert set(history.coords) == set(COORDINATES)
    for name, known in (COORDINATES | VARIABLES).items():
        assert history[name].dims == known.dims
        assert history[name].attrs == {"units": known.units, "long_name": known.long_name}
        assert name in COORDINATES or np.isfinite(history[name].values).all(), name
    assert history.site.values.tolist() == ["deep", "low"]
    assert history.site_kind.values.tolist() == ["FA-II", "SA-I"]
    assert history.site_region.values.tolist() == ["", "bulk"]
    assert history.phase_kind.values.tolist() == ["press", "hold", "slide"]
    np.testing.assert_allclose(history.phase_end.values, [0.1, 0.12, 0.22])
    assert history.counterface.values.tolist() == ["bottom"]
    np.testing.assert_array_equal(history.counterface_normal.values, [[0.0, 1.0]])
    assert history.counterface_friction_coefficient.values.tolist() == [0.4]


def test_candidates_know_how_far_they_are_from_the_free_ends_of_their_boundary(history):
    """A boundary that ends at held sides has none."""
    positions, ends = history.contact_position.values, np.array([[-4e-3, 1e-3], [4e-3, 1e-3]])
    distances = np.linalg.norm(positions[:, None] - ends, axis=2).min(axis=1)
    np.testing.assert_allclose(history.contact_edge_distance.values, distances, rtol=1e-12)
    held = fs.simulate(push_and_slide(supports=dict.fromkeys(("top", "left", "right"), ("x", "y"))))
    assert np.isinf(held.contact_edge_distance.values).all()
    assert not [name for name in held.data_vars if name.startswith("snapshot")], "none were asked for"


def test_sites_move_and_strain_as_the_mesh_does():
    """At a node, and on small triangles whose strain is that of the cells around it."""
    model = push_and_slide("T3", record=fs.Recording(SITES, snapshots_every=0.01))
    history = fs.simulate(model)
    nodes = [int(np.argmin(np.linalg.norm(model.mesh.p.T - site.position, axis=1))) for site in SITES]
    at = history.sel(time=history.snapshot_time, method="nearest")
    np.testing.assert_array_equal(at.displacement.values, history.snapshot_displacement.values[:, nodes])
    np.testing.assert_array_equal(at.velocity.values, history.snapshot_velocity.values[:, nodes])
    for number, node in enumerate(nodes):
        around = np.flatnonzero((model.mesh.t == node).any(axis=0))
        stress = history.snapshot_stress.values[-1, around]
        scale = np.abs(stress).max()
        assert (stress.min(axis=0) - 0.05 * scale <= history.stress.values[-1, number]).all()
        assert (history.stress.values[-1, number] <= stress.max(axis=0) + 0.05 * scale).all()


def test_forces_tractions_gaps_states_and_slip_follow_from_each_other(history):
    """A gap is the penetration over the penalty; a sticking node gathers no slip at all, not even rounding."""
    area = history.contact_area
    normal = (history.normal_traction * area).sum("contact_node")
    friction = (history.tangential_traction * area).sum("contact_node")
    np.testing.assert_allclose(history.counterface_force.values[:, 0, 1], normal, rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(history.counterface_force.values[:, 0, 0], friction[:, 0], rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(friction[:, 1], 0.0, atol=1e-12 * float(normal[-1]))
    assert normal[-1] > 0.0
    assert friction[-1, 0] > 0.0, "a plate that moves along +x pulls the skin along +x"
    height = history.contact_position[:, 1] + history.contact_displacement[:, :, 1]
    lowest = float(history.contact_position[:, 1].min())
    gap = (height - lowest - history.counterface_displacement[:, 0, 1]).transpose("time", "contact_node").values
    np.testing.assert_allclose(history.gap.values, gap, atol=1e-15)
    pressure, expected = history.normal_traction.values, np.maximum(-gap, 0.0) * history.attrs["normal_penalty"]
    np.testing.assert_allclose(pressure, expected, atol=1e-9 * expected.max())
    state, friction = history.contact_state.values, np.linalg.norm(history.tangential_traction.values, axis=-1)
    assert ((state == OPEN) == (pressure == 0.0)).all()
    np.testing.assert_allclose(friction[state == SLIP], 0.4 * pressure[state == SLIP], rtol=1e-8)
    assert (friction[state == STICK] < 0.4 * pressure[state == STICK]).all()
    steps = np.diff(history.slip_distance.values, axis=0)
    assert (steps >= 0.0).all()
    assert (state[1:] == STICK).any()
    assert (steps[state[1:] == STICK] == 0.0).all()


def test_energy_of_the_cells_is_the_strain_energy():
    """Linear triangles have one strain each, so density times volume, summed over the cells, is exact."""
    model = push_and_slide("T3", record=fs.Recording(snapshots_every=0.05))
    history = fs.simulate(model)
    x, y = model.mesh.p[:, model.mesh.t]
    areas = 0.5 * np.abs(np.sum(x * np.roll(y, -1, axis=0) - y * np.roll(x, -1, axis=0), axis=0))
    total = model.depth * history.snapshot_strain_energy_density.values @ areas
    at = history.strain_energy.sel(time=history.snapshot_time.values, method="nearest").values
    np.testing.assert_allclose(total, at, rtol=1e-11)
    assert at[-1] > 0.0


def pressed_in_a_sleeve(strain: float, law: type = fs.Elastic, **others) -> xr.Dataset:
    """Return the history of a block that is held sideways and pressed slowly to a uniaxial strain."""
    model = push_and_slide(
        mesh=box("Q4", np.linspace(0.0, 2e-3, 3), np.linspace(0.0, 4e-3, 5)),
        materials={"bulk": law(34e3, 0.4, 1e-3)},
        supports={"bulk": ("x",), "top": ("x", "y")},
        contacts=contact(normal_penalty=1e12),
        programme=(fs.Press(4e-3 * strain, 1e-3),),
        record=fs.Recording((fs.Site("middle", "", (1e-3, 2e-3)),), snapshots_every=0.04),
        **others,
    )
    return fs.simulate(model)


@pytest.mark.parametrize(
    ("kinematics", "law", "expected"), [("small", fs.Elastic, -0.1), ("finite", fs.NeoHookean, np.log(0.9))]
)
def test_strain_of_cells_is_small_or_logarithmic(kinematics, law, expected):
    history = pressed_in_a_sleeve(0.1, law, kinematics=kinematics)
    strain = history.snapshot_strain.sel(snapshot_time=history.snapshot_time[-1])
    np.testing.assert_allclose(strain.sel(stress_component="yy"), expected, rtol=1e-4)
    np.testing.assert_allclose(strain.drop_sel(stress_component="yy"), 0.0, atol=1e-6)


def test_von_mises_of_uniaxial_strain_is_in_closed_form():
    """A block held sideways and pressed slowly: s_yy = (L + 2 G) e, s_xx = s_zz = L e, so von Mises is 2 G |e|."""
    history = pressed_in_a_sleeve(0.01)
    strain, shear = -0.01, 34e3 / 2.8
    lame = 34e3 * 0.4 / (1.4 * 0.2)
    np.testing.assert_allclose(history.snapshot_von_mises.values[-1], 2 * shear * abs(strain), rtol=1e-4)
    xx, yy, zz, xy = history.stress.values[-1, 0]
    assert (xx, yy, zz) == pytest.approx((lame * strain, (lame + 2 * shear) * strain, lame * strain), rel=1e-4)
    assert abs(xy) < 1e-6 * abs(yy)
    density = 0.5 * (lame + 2 * shear) * strain**2
    assert history.strain_energy_density.values[-1, 0] == pytest.approx(density, rel=2e-4)


def test_forces_of_an_inclined_plate_are_along_its_own_axes():
    """The whole problem is turned by 30 degrees: forces and tractions turn with it."""
    angle = np.radians(30.0)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    straight = push_and_slide()
    mesh = dataclasses.replace(straight.mesh, doflocs=np.ascontiguousarray(turn @ straight.mesh.p))
    plate = contact(counterface=fs.Plane(normal=tuple(turn @ [0.0, 1.0])))
    turned, expected = fs.simulate(push_and_slide(mesh=mesh, contacts=plate)), fs.simulate(straight)
    for name, share in {"counterface_force": 1e-8, "tangential_traction": 1e-7}.items():
        values = expected[name].values @ turn.T
        np.testing.assert_allclose(turned[name].values, values, atol=share * np.abs(values).max(), err_msg=name)
    names = ["normal_traction", "slip_distance", "gap"]
    assert_same_history(turned[names], expected[names], 1e-7)


@pytest.mark.parametrize("kinematics", ["small", "finite"])
@pytest.mark.parametrize("dim", [2, 3])
def test_friction_is_along_the_surface_where_the_step_ends(dim, kinematics):
    """A round counterface that slides in large steps turns the normals; without friction nothing is along it."""
    shape = fs.Cylinder(10e-3, (0.0, 1.0)) if dim == 2 else fs.Sphere(10e-3, (0.0, 1.0, 0.0))
    axes = [np.linspace(-4e-3, 4e-3, 9), np.linspace(0.0, 4e-3, 4), np.linspace(-2e-3, 2e-3, 3)]
    values = {
        "materials": {"bulk": (fs.Elastic if kinematics == "small" else fs.NeoHookean)(1e5, 0.3, 1000.0)},
        "programme": (fs.Press(4e-4, 2e-3), fs.Slide(1e-3, 2e-3)),
        "time": fs.TimeStepping(0.1),
        "kinematics": kinematics,
    }
    for mu in (0.0, 0.5):
        touched = contact(counterface=shape, friction=fs.Coulomb(mu))
        history = fs.simulate(model_of("Q4" if dim == 2 else "H8", *axes[:dim], contacts=touched, **values))
        pressure, state = history["normal_traction"].values, history["contact_state"].values
        friction = np.linalg.norm(history["tangential_traction"].values, axis=-1)
        assert pressure.max() > 1e3
        assert (friction <= max(mu * (1.0 + 1e-9), 1e-12) * np.maximum(pressure, 0.0 if mu else pressure.max())).all()
        assert (state == 2).any()
        if mu:
            np.testing.assert_allclose(friction[state == 2], mu * pressure[state == 2], rtol=1e-9)


def loaded(element, load, step, **values):
    """Return the model of a square or cube that hangs at its top and is loaded from below, along its last axis."""
    dim = 3 if element == "T4" else 2
    pull = fs.Traction(tuple(load * np.eye(dim)[-1]), fs.Ramp((0.0, 1.0, 2.0), (0.0, 1.0, 0.0)))
    elastic = {"bulk": fs.Elastic(1e3, 0.0, 1.0)}
    axes, time = [np.linspace(0.0, 1.0, 3)] * dim, fs.QuasiStatic(step, end=1.0 if step == 1.0 else 2.0)
    return model_of(element, *axes, materials=elastic, tractions={"bottom": pull}, time=time, **values)


@pytest.mark.parametrize("element", ["Q4", "T6", "T4"])
def test_cells_that_small_strain_turns_inside_out_are_named_once_also_at_a_snapshot_alone(element, caplog, tmp_path):
    attributes = fs.simulate(loaded(element, 900.0, 1.0)).attrs
    assert "inverted_cells" not in attributes
    # A bar of 1 kPa without lateral strain.
    assert attributes["largest_strain"] == pytest.approx(0.9)
    assert attributes["largest_strain_position"].shape == (3 if element == "T4" else 2,)
    assert not caplog.records
    model = loaded(element, 1100.0, 1.0)
    assert fs.simulate(model).attrs["inverted_cells"] == model.mesh.nelements
    assert f"turns {model.mesh.nelements} of {model.mesh.nelements} cells inside out" in caplog.text
    assert "write kinematics: finite" in caplog.text
    caplog.clear()
    model = loaded(element, 1100.0, 0.5, record=fs.Recording(snapshots_every=0.5))
    with fs.Simulation(model) as simulation:
        for _ in range(3):
            simulation.step()
        simulation.save(tmp_path / "later.npz")
    with fs.Simulation.restore(tmp_path / "later.npz", model) as simulation:
        simulation.step()
        assert simulation.history().attrs["inverted_cells"] == model.mesh.nelements
    assert caplog.text.count("cells inside out") == 1


@settings(deadline=None)
@given(st.integers(1, 40), st.sampled_from([1e-3, 5e-3, 0.1]), st.floats(0.3, 50.0))
def test_snapshots_are_at_the_steps_nearest_to_multiples_of_the_interval_with_both_ends(count, step, ratio):
    """What compares every time with every multiple."""
    times = step * np.arange(count + 1)
    multiples = np.append(np.arange(0.0, times[-1], ratio * step), times[-1])
    nearest = np.unique(np.abs(times[:, None] - multiples).argmin(axis=0))
    assert schedule.snapshot_steps(times, ratio * step) == nearest.tolist()
    assert schedule.snapshot_steps(times, 1e-12) == list(range(count + 1)), "tiny intervals keep every step"


@pytest.mark.parametrize("material", [fs.Elastic(50e3, 0.45, 1000.0), RELAXING], ids=["elastic", "relaxing"])
def test_snapshots_so_far_are_those_of_the_whole_run(material):
    model = push_and_slide(materials={"bulk": material}, record=fs.Recording(snapshots_every=0.02))
    whole = fs.simulate(model)
    names = [name for name in whole.data_vars if "snapshot_time" in whole[name].dims]
    assert whole.sizes["snapshot_time"] > 5
    with fs.Simulation(model) as sim:
        for taken in range(1, whole.sizes["time"]):
            sim.step()
            if taken % 9 == 0:
                so_far = sim.history()
                count = so_far.sizes["snapshot_time"]
                assert count == (whole.snapshot_time <= whole.time[taken]).sum()
                for name in names:
                    np.testing.assert_array_equal(so_far[name], whole[name][:count], err_msg=name)


@pytest.mark.parametrize("every", [0.0, 0.02, 1e-4])
@pytest.mark.parametrize("element", ["Q4", "T6"])
def test_records_are_refused_by_what_they_take_before_there_are_any(every, element, monkeypatch):
    """The estimate is at most a third more than what the history takes."""
    model = push_and_slide(element, record=fs.Recording(SITES, snapshots_every=every))
    taken = sum(variable.nbytes for variable in fs.simulate(model).data_vars.values())
    monkeypatch.setattr(schedule, "available_memory", lambda: taken - 1)
    with pytest.raises(fs.InputError, match=r"GB for their records, .* GB are available; .*or take fewer snapshots"):
        fs.simulate(model)
    monkeypatch.setattr(schedule, "available_memory", lambda: int(1.3 * taken))
    fs.simulate(model)
