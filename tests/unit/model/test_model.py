"""Models as data: phases, time settings, sites, rigid bodies; defaults, units, and mistakes."""

import numpy as np
import pytest
import yaml

import fingerslip as fs
from fingerslip.errors import InputError
from fingerslip.model.programme import phase_duration, phase_travel
from fingerslip.model.rigid_bodies import directions_in
from fingerslip.model.timing import shortest_step
from fingerslip.parameters import as_mapping, from_mapping
from fingerslip.sites import RECEPTOR_KINDS
from problems.pushed import push_and_slide


def adaptive(**values):
    return fs.Adaptive(**({"output": 5e-3} | values))


def bottom(**values):
    return fs.Contact("bottom", **values)


def body(**values):
    return fs.RigidBody(**({"mass": 1.0} | values))


TURNED = {"free": ("rz",), "centre": (0.0, 0.0)}
NO_MESH = "needs a mesh with named regions and boundaries; make one with build_section"
STEPS = "got 0.001 s where the shortest step is"


@pytest.mark.parametrize(
    ("make", "values", "message"),
    [
        (fs.Press, {"depth": -1e-3, "speed": 1e-3}, "Press.depth: got -1 mm, needs a value > 0"),
        (fs.Press, {"depth": 1e-3, "speed": 0.0}, "Press.speed: got 0 mm/s, needs a value > 0"),
        (fs.Hold, {"duration": 0.0}, "Hold.duration"),
        (fs.Slide, {"distance": 1e-3}, "Slide.speed: is missing, needs a value such as 1.5 mm/s"),
        (fs.Slide, {"distance": 1e-3, "speed": 1e-3, "velocity": 1.0}, "Slide.velocity: is not known"),
        (fs.Lift, {"distance": 0.0, "speed": 1e-3}, "Lift.distance"),
        (fs.TimeStepping, {"step": 0.0}, "TimeStepping.step"),
        (fs.TimeStepping, {"step": 1e-3, "alpha": 0.1}, "TimeStepping.alpha: got 0.1, needs a number <= 0"),
        (fs.TimeStepping, {"step": 1e-3, "alpha": -0.6}, "TimeStepping.alpha: got -0.6, needs a number >= -0.5"),
        (adaptive, {"smallest": 5e-3}, "Adaptive.smallest: got 0.005 s for records every 0.005 s"),
        (adaptive, {"smallest": 1e-3, "largest": 1e-3}, f"Adaptive.largest: {STEPS} 0.001 s"),
        (adaptive, {"smallest": 2e-3, "largest": 1e-3}, f"Adaptive.largest: {STEPS} 0.002 s"),
        (adaptive, {"tolerance": 0.0}, "Adaptive.tolerance: got 0.0, needs a number > 0"),
        (adaptive, {"tolerance": 1.0}, "Adaptive.tolerance: got 1.0, needs a number < 1"),
        (adaptive, {"end": 1e-3}, "Adaptive.output: got 0.005 s for a run of 0.001 s"),
        (adaptive, {"scheme": "quasi_static", "alpha": -0.1}, "Adaptive.alpha: got -0.1 for quasi-static steps"),
        (adaptive, {"records_per_decade": 0}, "Adaptive.records_per_decade: got 0"),
        (adaptive, {"output": -1.0}, "Adaptive.output: got -1000 ms, needs a value > 0"),
        (adaptive, {"scheme": "euler"}, "Adaptive.scheme: got 'euler'"),
        (bottom, {"normal_penalty": -1.0}, "Contact.normal_penalty"),
        (bottom, {"search_distance": 0.0}, "Contact.search_distance"),
        (bottom, {"friction": 0.5}, "Contact.friction: got 0.5, needs a friction law, such as Coulomb"),
        (bottom, {"friction": fs.Plane()}, "friction: got a Plane, needs a friction law, such as Coulomb(0.5)"),
        (bottom, {"counterface": "plate"}, "Contact.counterface: got 'plate', needs a counterface, such as Plane, Cyl"),
        (bottom, {"counterface": fs.Plane}, "got the class Plane, needs a counterface"),
        (fs.Recording, {"snapshots_every": -1.0}, "Recording.snapshots_every"),
        (push_and_slide, {"mesh": fs.preset("wang2014-2d")}, f"Model.mesh: got a Fingertip, {NO_MESH}"),
        (push_and_slide, {"mesh": "block.msh"}, "Model.mesh: got 'block.msh', needs a mesh"),
        (push_and_slide, {"formulation": "plane"}, "Model.formulation: got 'plane'"),
        (push_and_slide, {"integration": "reduced"}, "Model.integration: got 'reduced'"),
        (push_and_slide, {"depth": 0.0}, "Model.depth"),
        (push_and_slide, {"supports": {"top": ("w",)}}, "Model.supports.top"),
        (push_and_slide, {"programme": ()}, "time.end: is missing, and there is no programme, needs one of the two"),
        (push_and_slide, {"materials": {"bulk": 0.5}}, "bulk: got 0.5, needs a material: Elastic, NeoHookean"),
        (push_and_slide, {"materials": {"bulk": fs.Elastic}}, "materials.bulk: got the class Elastic, "),
        (push_and_slide, {"materials": {"bulk": fs.Elastic}}, "write Elastic(...)"),
        (body, {"mass": 0.0}, "RigidBody.mass: got 0 g, needs a value > 0"),
        (body, {"free": ("x", "x")}, "RigidBody.free: got x, x, needs each direction once"),
        (body, {"free": ("along",)}, "RigidBody.free.0: got 'along'"),
        (body, {"free": ("rz",), "inertia": (1.0,)}, "centre: is missing, a body that is free about an axis (rz)"),
        (body, TURNED, "inertia: is missing"),
        (body, {**TURNED, "inertia": (0.0,)}, "inertia.0: got 0 kg m^2, needs a value > 0"),
        (body, {"filling": fs.Ramp((0.0,), (-1.0,))}, "filling: got -1, needs shares of the mass, 0 or more"),
        (body, {"springs": fs.Springs(x=1.0)}, "x: acts where the body is not free, free is: none; add x to free"),
        (
            body,
            {"free": ("y",), "dampers": fs.Dampers(x=1.0)},
            "dampers.x: acts where the body is not free, free is: y",
        ),
        (body, {"free": ("y",), "loads": (fs.BodyLoad(rz=1.0),)}, "loads.0.rz: acts where the body is not free"),
        (body, {"initial_velocity": fs.BodyVelocity(z=1.0)}, "initial_velocity.z: acts where the body is not free"),
        (fs.Springs, {"x": -1.0}, "Springs.x: got -1 N/m, needs a value >= 0"),
        (fs.Springs, {"rz": "1 N/m"}, "rz: got '1 N/m', needs a unit of [N m]"),
        (fs.Dampers, {"rx": -1.0}, "Dampers.rx: got -1 N m s, needs a value >= 0"),
    ],
)
def test_mistakes_name_place_value_and_need(make, values, message):
    with pytest.raises(InputError) as caught:
        make(**values)
    assert message in str(caught.value)


def test_defaults_are_the_documented_ones_and_models_are_frozen():
    assert fs.TimeStepping(1e-3).alpha == -0.05
    assert fs.Contact("bottom").friction == fs.Coulomb(0.0)
    assert fs.Contact("bottom").counterface == fs.Plane(normal=(0.0, 1.0), offset=None)
    assert push_and_slide().integration == "selective"
    assert push_and_slide().end == pytest.approx(0.1 + 0.02 + 0.1), "that of the programme, unless given"
    assert push_and_slide(time=fs.TimeStepping(1e-3, end=0.05)).end == 0.05
    with pytest.raises(AttributeError):
        push_and_slide().depth = 2.0


def test_a_model_shows_itself_shortly_and_names_from_a_foreign_mesh_are_text_in_a_notebook():
    model = push_and_slide()
    assert repr(model).startswith("<Model: MeshQuad1 of ")
    assert repr(model).endswith("1 contacts, press + hold + slide, 0.22 s>")
    assert "<th>materials</th>" in model._repr_html_()
    assert "Coulomb" in model._repr_html_()
    name = "<img src=x onerror=alert(1)>"
    mesh = push_and_slide().mesh
    mesh = mesh.with_subdomains({name: np.arange(mesh.nelements)}).with_boundaries({name: mesh.boundary_facets()})
    contact = fs.Contact(name, friction=fs.Coulomb(0.5))
    tissue = fs.Elastic(1e4, 0.4, 1000.0)
    model = push_and_slide(mesh=mesh, materials={name: tissue}, supports={name: ("x", "y")}, contacts=(contact,))
    assert "<img" not in model._repr_html_()
    assert model._repr_html_().count("&lt;img") == 3


class Sheet:
    """A law of large strain that has no stress across the plane, whatever the strain."""

    density, stiffness = 1000.0, 1e4

    def at_rest(self):
        return fs.Elastic(1e4, 0.4, 1000.0)

    def stored_energy(self, log_strain):
        return 0.5e4 * (log_strain[:, :2] ** 2).sum(axis=1)

    def kirchhoff_stress(self, log_strain):
        return 1e4 * log_strain * [1.0, 1.0, 0.0]

    def kirchhoff_tangent(self, log_strain):
        return np.tile(np.diag([1e4, 1e4, 0.0]), (len(log_strain), 1, 1))

    def volumetric(self, log_volume):
        return tuple(np.zeros((3, len(log_volume))))


def test_a_law_that_cannot_be_in_plane_stress_or_lacks_members_is_refused_at_once():
    given = {"materials": {"bulk": Sheet()}, "kinematics": "finite"}
    with pytest.raises(InputError, match=r"materials\.bulk: got Sheet, .*plane stress needs.*take plane_strain"):
        push_and_slide(formulation="plane_stress", **given)
    # In plane strain, and at rest, it may be what it is.
    push_and_slide(formulation="plane_strain", **given)
    push_and_slide(formulation="plane_stress", materials=given["materials"])

    class Unfinished(Sheet):
        kirchhoff_tangent = property()

    message = r"materials\.bulk: got a Unfinished, needs .*lacks kirchhoff_tangent$"
    with pytest.raises(InputError, match=message) as caught:
        push_and_slide(materials={"bulk": Unfinished()})
    assert len(str(caught.value).splitlines()) == 1


def test_the_shortest_step_is_a_part_of_the_output_and_a_fixed_one_has_the_same_scheme():
    assert fs.Adaptive(16e-3).shortest == shortest_step(fs.Adaptive(16e-3)) == pytest.approx(1e-3)
    assert fs.Adaptive(16e-3, smallest=2e-3).shortest == pytest.approx(2e-3)
    assert shortest_step(fs.QuasiStatic(5e-3)) == pytest.approx(5e-3)
    assert fs.Adaptive(5e-3, alpha=-0.1, end=1.0).fixed(1e-3) == fs.TimeStepping(1e-3, -0.1, 1.0)
    assert fs.Adaptive(5e-3, scheme="quasi_static", end=1.0).fixed(1e-3) == fs.QuasiStatic(1e-3, 1.0)
    for scheme, power in (("quasi_static", 1), ("hht_alpha", 3)):
        finer = fs.Adaptive(8e-3, 1e-2, scheme, smallest=1e-3, largest=4e-3).refined(0.5)
        assert finer.tolerance == pytest.approx(1e-2 * 0.5**power)
        assert (finer.output, finer.smallest, finer.largest) == pytest.approx((4e-3, 0.5e-3, 2e-3))


def test_travel_and_duration_of_every_phase():
    phases = (fs.Press("1.5 mm", "1 mm/s"), fs.Hold("500 ms"), fs.Slide(6e-3, 3e-3), fs.Lift(1e-3, 2e-3))
    assert [phase_travel(phase) for phase in phases] == pytest.approx([1.5e-3, 0.0, 6e-3, 1e-3])
    assert [phase_duration(phase) for phase in phases] == pytest.approx([1.5, 0.5, 2.0, 0.5])


@pytest.mark.parametrize(("press", "sign"), [(0.1e-3, 1.0), (-0.05e-3, -1.0)])
def test_the_normal_force_grows_or_falls_while_the_plate_slides(press, sign):
    programme = (fs.Press(0.1e-3, 1e-3), fs.Slide(0.5e-3, 5e-3, press=press))
    history = fs.simulate(push_and_slide(programme=programme, time=fs.QuasiStatic(5e-3)))
    normal = history["counterface_force"].sel(time=slice(0.1, 0.2)).values[:, 0, 1]
    assert (sign * np.diff(normal) > 0.0).all()
    friction = history["counterface_force"].values[-1, 0]
    assert abs(friction[0]) == pytest.approx(0.4 * friction[1], rel=1e-6)


JUG = yaml.safe_load("""
{mass: 300 g, free: [y, rz], centre: [0 mm, 40 mm], inertia: [2 g m^2], filling: {times: [0 s, 2 s], factors: [0, 1]},
loads: [{rz: 1 N mm, ramp: {times: [0 s], factors: [2]}}, {y: -1 N}], springs: {y: 2 N/mm, rz: 3 N mm},
dampers: {rz: 4 N m s}, initial_velocity: {y: 5 mm/s, rz: 1 rad/s}, programme: []}
""")
BODY = fs.RigidBody(
    mass=0.3,
    free=("y", "rz"),
    centre=(0.0, 0.04),
    inertia=(2e-3,),
    filling=fs.Ramp((0.0, 2.0), (0.0, 1.0)),
    loads=(fs.BodyLoad(rz=1e-3, ramp=fs.Ramp((0.0,), (2.0,))), fs.BodyLoad(y=-1.0)),
    springs=fs.Springs(y=2e3, rz=3e-3),
    dampers=fs.Dampers(rz=4.0),
    initial_velocity=fs.BodyVelocity(y=5e-3, rz=1.0),
)
SITE = {"name": "mine", "kind": "probe", "position": ["0 mm", "-6.5 mm"], "region": "dermis"}


@pytest.mark.parametrize(
    ("kind", "values", "expected"),
    [
        (fs.RigidBody, JUG, BODY),
        (fs.Site, SITE, fs.Site("mine", "probe", (0.0, -6.5e-3), "dermis")),
        (fs.Slide, {"distance": "6 mm", "speed": "3 mm/s", "press": "-200 um"}, fs.Slide(6e-3, 3e-3, press=-0.2e-3)),
    ],
)
def test_what_a_file_gives_with_units_is_read_and_written_back(kind, values, expected):
    found = from_mapping(kind, values, "f")
    assert found == expected
    assert from_mapping(kind, as_mapping(found), "f") == found


def test_a_position_needs_units_and_receptors_and_directions_have_their_names():
    with pytest.raises(InputError, match="has no unit"):
        from_mapping(fs.Site, SITE | {"position": [0.0, -6.5]}, "x")
    assert RECEPTOR_KINDS == ("FA-I", "SA-I", "FA-II", "SA-II")
    assert directions_in(2) == ("x", "y", "rz")
    assert directions_in(3) == ("x", "y", "z", "rx", "ry", "rz")
