"""The model as data: defaults, units, and mistakes."""

from __future__ import annotations

import numpy as np
import pytest

import fingerslip as fs
from fingerslip.errors import InputError
from problems.pushed import push_and_slide


def test_the_end_is_that_of_the_programme_unless_given():
    assert push_and_slide().end == pytest.approx(0.1 + 0.02 + 0.1)
    assert push_and_slide(time=fs.TimeStepping(1e-3, end=0.05)).end == 0.05


def test_a_model_without_programme_needs_an_end():
    with pytest.raises(InputError, match=r"time.end: is missing, and there is no programme, needs one of the two"):
        push_and_slide(programme=())


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fs.Press(-1e-3, 1e-3), "Press.depth: got -1 mm, needs a value > 0"),
        (lambda: fs.Press(1e-3, 0.0), "Press.speed: got 0 mm/s, needs a value > 0"),
        (lambda: fs.Hold(0.0), "Hold.duration"),
        (lambda: fs.Slide(distance=1e-3), "Slide.speed: is missing, needs a value"),
        (lambda: fs.Slide(1e-3, 1e-3, velocity=1.0), "Slide.velocity: is not known"),
        (lambda: fs.Lift(0.0, 1e-3), "Lift.distance"),
        (lambda: fs.TimeStepping(0.0), "TimeStepping.step"),
        (lambda: fs.TimeStepping(1e-3, alpha=0.1), "TimeStepping.alpha: got 0.1, needs a number <= 0"),
        (lambda: fs.TimeStepping(1e-3, alpha=-0.6), "TimeStepping.alpha: got -0.6, needs a number >= -0.5"),
        (lambda: fs.Contact("bottom", normal_penalty=-1.0), "Contact.normal_penalty"),
        (lambda: fs.Contact("bottom", search_distance=0.0), "Contact.search_distance"),
        (
            lambda: fs.Contact("bottom", friction=0.5),
            "Contact.friction: got 0.5, needs a friction law, such as Coulomb",
        ),
        (
            lambda: fs.Contact("bottom", friction=fs.Plane()),
            "Contact.friction: got a Plane, needs a friction law, such as Coulomb(0.5)",
        ),
        (
            lambda: fs.Contact("bottom", counterface="plate"),
            "Contact.counterface: got 'plate', needs a counterface, such as Plane, Cylinder or Sphere",
        ),
        (lambda: fs.Contact("bottom", counterface=fs.Plane), "got the class Plane, needs a counterface"),
        (lambda: fs.Recording(snapshots_every=-1.0), "Recording.snapshots_every"),
        (
            lambda: push_and_slide(mesh=fs.preset("wang2014-2d")),
            "Model.mesh: got a Fingertip, needs a mesh with named regions and boundaries; make one with build_section",
        ),
        (lambda: push_and_slide(mesh="block.msh"), "Model.mesh: got 'block.msh', needs a mesh"),
        (lambda: push_and_slide(formulation="plane"), "Model.formulation: got 'plane'"),
        (lambda: push_and_slide(integration="reduced"), "Model.integration: got 'reduced'"),
        (lambda: push_and_slide(depth=0.0), "Model.depth"),
        (lambda: push_and_slide(supports={"top": ("w",)}), "Model.supports.top"),
    ],
)
def test_mistakes_name_place_value_and_need(make, message):
    with pytest.raises(InputError) as caught:
        make()
    assert message in str(caught.value)


def test_text_with_units_is_read():
    assert fs.Press("1.5 mm", "1.5 mm/s") == fs.Press(1.5e-3, 1.5e-3)
    assert fs.TimeStepping("5 ms").step == 5e-3


def test_defaults_are_the_documented_ones():
    assert fs.TimeStepping(1e-3).alpha == -0.05
    assert fs.Contact("bottom").friction == fs.Coulomb(0.0)
    assert fs.Contact("bottom").counterface == fs.Plane(normal=(0.0, 1.0), offset=None)
    assert push_and_slide().integration == "selective"


def test_models_are_frozen():
    with pytest.raises(AttributeError):
        push_and_slide().depth = 2.0


def test_a_model_shows_itself_shortly():
    model = push_and_slide()
    assert repr(model).startswith("<Model: MeshQuad1 of ")
    assert repr(model).endswith("1 contacts, press + hold + slide, 0.22 s>")
    assert "<th>materials</th>" in model._repr_html_()
    assert "Coulomb" in model._repr_html_()


def test_names_from_a_foreign_mesh_are_text_in_a_notebook():
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


def test_a_law_that_cannot_be_in_plane_stress_is_refused_at_once():
    given = {"materials": {"bulk": Sheet()}, "kinematics": "finite"}
    with pytest.raises(InputError, match=r"materials\.bulk: got Sheet, .*plane stress needs.*take plane_strain"):
        push_and_slide(formulation="plane_stress", **given)
    # In plane strain, and at rest, it may be what it is.
    push_and_slide(formulation="plane_strain", **given)
    push_and_slide(formulation="plane_stress", materials=given["materials"])


def test_a_law_that_lacks_members_is_told_which():
    class Unfinished(Sheet):
        kirchhoff_tangent = property()

    with pytest.raises(
        InputError, match=r"materials\.bulk: got a Unfinished, needs .*lacks kirchhoff_tangent$"
    ) as caught:
        push_and_slide(materials={"bulk": Unfinished()})
    assert len(str(caught.value).splitlines()) == 1
    with pytest.raises(InputError, match=r"materials\.bulk: got 0\.5, needs a material: Elastic, NeoHookean"):
        push_and_slide(materials={"bulk": 0.5})
    with pytest.raises(InputError, match=r"materials\.bulk: got the class Elastic, .*write Elastic\(\.\.\.\)"):
        push_and_slide(materials={"bulk": fs.Elastic})
