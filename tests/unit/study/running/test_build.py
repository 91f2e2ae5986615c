"""From a run to its model."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

import fingerslip as fs
from fingerslip.dynamics.system.checks import inspect_model
from fingerslip.study.definition.runs import expand_mapping, plan_studies
from fingerslip.study.definition.spec import parse_study
from fingerslip.study.running.build import build_mesh, build_model, inspect_mesh, name_errors, prepare
from places import ROOT
from unit.fingers import change_solid, coarse_solid
from unit.scans import mesh_of_a_scan, scan_values
from unit.study.block import block_mesh, block_values, finger_values

SOURCE = Path("studies/x.yaml")
ROLLER = yaml.safe_load("""
counterface: {cylinder: {radius: 8 mm, centre: [0 mm, -9 mm]}}
friction: {pressure_dependent: {reference_coefficient: 0.6, reference_pressure: 10 kPa, exponent: -0.2}}
""")


def run_of(values, folder=SOURCE.parent):
    source = folder / "x.yaml"
    return expand_mapping(values | {"sweep": {}}, source).runs[0]


HELD = yaml.safe_load("""
title: Held
fingertip: {preset: wang2014-2d, ridges: {enabled: false}}
mesh: {contact_size: 1 mm, bulk_size: 2 mm}
depth: 12 mm
contact: {friction_coefficient: 0.6}
time: {step: 2 ms}
reaction:
  {mass: 100 g, margin: 0.3, settle: 0.1 s, rest: 0.02 s, after: 0.1 s, load: {ramp_load: {rate: 4 N/s, force: 1 N}}}
sweep: {reaction.opposite: [mirror, plate]}
""")


@pytest.mark.slow
def test_a_plate_opposite_a_held_object_is_in_the_mesh_of_its_runs_alone(tmp_path):
    (tmp_path / "x.yaml").write_text(yaml.safe_dump(HELD))
    (plan,) = plan_studies([tmp_path / "x.yaml"])
    mirrored, beside = (set(job.model.mesh.subdomains) for job in prepare(plan, plan.runs))
    assert beside - mirrored == {"plate_slab"}
    (tmp_path / "x.yaml").write_text(yaml.safe_dump({name: HELD[name] for name in HELD if name != "depth"}))
    (plan,) = plan_studies([tmp_path / "x.yaml"])
    with pytest.raises(fs.InputError, match=r"reaction: is given without depth, .*; write depth: 12 mm beside it"):
        list(prepare(plan, plan.runs))


def test_model_holds_what_the_file_says_and_own_values_go_before_those_of_the_fingertip():
    model = build_model(run_of(block_values() | {"tractions": {"top": ["0 Pa", "-1 kPa"]}}), block_mesh())
    assert model.materials == {"block": fs.Elastic(100e3, 0.3, 1000.0)}
    assert (model.formulation, model.depth) == ("plane_strain", 1e-3)
    assert (model.contacts[0].boundary, model.contacts[0].friction.coefficient) == ("bottom", 0.6)
    assert (model.supports, model.tractions) == ({"top": ("x", "y")}, {"top": (0.0, -1000.0)})
    inspect_model(model)
    own = {"tissue": {"youngs_modulus": "50 kPa", "poisson_ratio": 0.4, "density": "900 kg/m^3"}}
    values = finger_values(materials=own, supports={"phalanx_surface": ["y"]}, formulation="plane_strain", depth="2 mm")
    model = build_model(run_of(values), block_mesh())
    assert model.materials["tissue"] == fs.Elastic(50e3, 0.4, 900.0)
    assert model.materials["dermis"].youngs_modulus == 80e3
    assert model.supports == {"phalanx_surface": ("y",)}
    assert (model.formulation, model.depth) == ("plane_strain", 2e-3)


def test_only_the_wanted_receptors_are_recorded_and_reference_nodes_of_a_section_refused():
    extra = {"name": "middle", "kind": "own", "position": ["0 mm", "-5 mm"], "region": "tissue"}
    model = build_model(run_of(finger_values(record={"receptors": ["FA-II"], "sites": [extra]})), block_mesh())
    assert {site.kind for site in model.record.sites} == {"FA-II", "own"}
    assert model.record.sites[-1].position == (0.0, -5e-3)
    with pytest.raises(fs.InputError, match=r"x\.yaml: record\.reference_nodes: without a fingertip in 3D, .* T10"):
        build_model(run_of(finger_values(record={"reference_nodes": True})), block_mesh())


def test_mesh_is_shared_exactly_where_its_inputs_are_the_same_and_a_missing_file_named(tmp_path):
    first = run_of(finger_values()).mesh_key
    assert run_of(finger_values(contact={"friction_coefficient": 0.2})).mesh_key == first
    assert run_of(finger_values(mesh={"contact_size": "0.2 mm"})).mesh_key != first
    flattened = {"preset": "wang2014-2d", "phalanx": {"variant": "flattened"}}
    assert run_of(finger_values(fingertip=flattened)).mesh_key != first
    for values, path in (
        (block_values(), r"mesh\.file: cannot read .*block\.msh"),
        (scan_values(), r"mesh\.skin: .*stl"),
    ):
        with pytest.raises(fs.InputError, match=rf"x\.yaml: {path} \(No such file"):
            _ = run_of(values, tmp_path).mesh_key


@pytest.mark.parametrize("own", [{}, {"fingertip": {"preset": "wang2014-2d"}}])
def test_mesh_file_in_millimetres_is_refused_until_it_says_so(tmp_path, own):
    fs.write_mesh(block_mesh().scaled(1e3), tmp_path / "block.msh")
    with pytest.raises(
        fs.InputError, match=r"x\.yaml: mesh\.file: the body is 10 m large, .* needs .* metres"
    ) as caught:
        build_mesh(run_of(block_values() | own, tmp_path))
    assert "'length_unit: mm'" in caught.value.repair
    said = block_values() | own | {"mesh": {"file": "block.msh", "length_unit": "mm"}}
    run = run_of(said, tmp_path)
    assert np.ptp(build_mesh(run).p, axis=1) == pytest.approx([0.01, 0.005])
    assert set(build_mesh(run).boundaries) == {"bottom", "top"}
    metres = run_of(block_values() | {"mesh": {"file": "block.msh", "length_unit": "m"}}, tmp_path)
    assert np.ptp(build_mesh(metres).p, axis=1) == pytest.approx([10.0, 5.0])
    assert run.mesh_key != metres.mesh_key


DERMIS = {"dermis": {"youngs_modulus": "80 kPa", "poisson_ratio": 0.48, "density": "1000 kg/m^3"}}


def with_contacts(**contacts):
    return {key: value for key, value in block_values().items() if key not in ("contact", "sweep")} | contacts


@pytest.mark.parametrize(
    ("values", "place", "shown"),
    [
        (block_values(), "contacts.0.counterface.normal", "contact.normal"),
        (block_values(), "contacts.0.friction.coefficient", "contact.friction_coefficient"),
        (block_values(), "contacts.0", "contact"),
        (block_values(), "Model.depth", "depth"),
        (block_values(), "mesh", "mesh"),
        (block_values(), "studies/x.yaml: title", "title"),
        *(
            (finger_values(materials=DERMIS), place, shown)
            for place, shown in {
                "materials.tissue.poisson_ratio": "fingertip.materials.tissue.poisson_ratio",
                "materials.dermis.poisson_ratio": "materials.dermis.poisson_ratio",
                "phalanx.sagittal.distal_end": "fingertip.phalanx.sagittal.distal_end",
                "sagittal.zone": "fingertip.sagittal.zone",
                "Model.depth": "fingertip.depth",
                "mesh.contact_size": "mesh.contact_size",
            }.items()
        ),
        (with_contacts(contact={"friction_coefficient": 0.6}), "contacts.0.offset", "contact.offset"),
        (with_contacts(contacts=[{"friction_coefficient": 0.6}]), "contacts.0.counterface.normal", "contacts.0.normal"),
        (with_contacts(contacts=[ROLLER]), "contacts.0.centre", "contacts.0.counterface.cylinder.centre"),
        (with_contacts(contacts=[ROLLER]), "contacts.0.counterface.normal", "contacts.0.counterface.cylinder.normal"),
        (with_contacts(contact=ROLLER), "contacts.0.friction", "contact.friction"),
        (with_contacts(contact=ROLLER), "contacts.0.drive", "contact.drive"),
        (with_contacts(contact=ROLLER), "contacts.0.programme.1.slide.speed", "contact.programme.1.slide.speed"),
    ],
)
def test_places_of_the_model_get_the_names_of_the_study(values, place, shown):
    run = SimpleNamespace(where="studies/x.yaml (a = 1)", study=parse_study(values, SOURCE))
    with pytest.raises(fs.SlipOutsideContactError) as caught, name_errors(run):
        raise fs.SlipOutsideContactError(place, "a", "b", "c")
    front = "studies/x.yaml" if place.startswith("studies/x.yaml") else run.where
    assert str(caught.value) == f"{front}: {shown}: a, b; c"


FLAT = finger_values(fingertip={"preset": "wang2014-2d", "phalanx": {"sagittal": {"distal_end": "-17 mm"}}})


@pytest.mark.parametrize(
    ("build", "values", "message"),
    [
        (build_mesh, FLAT, r"x\.yaml: fingertip\.phalanx\.sagittal\.distal_end: got -17 mm"),
        (build_model, block_values() | {"formulation": "solid"}, r"x\.yaml: depth: got 0\.001 m for a solid"),
        (
            build_model,
            block_values() | {"contact": {"friction_coefficient": 0.6, "rigid_body": "jug"}},
            r"x\.yaml: contact\.rigid_body: got 'jug', the bodies are: none",
        ),
    ],
)
def test_errors_of_mesh_and_model_name_the_file_and_the_place_in_it(build, values, message, tmp_path):
    fs.write_mesh(block_mesh(), tmp_path / "block.msh")
    with pytest.raises(fs.InputError, match=message):
        build(run_of(values, tmp_path))


EVERYTHING = """
contacts:
  - boundary: top
    normal: [0, -1]
    friction: {static_kinetic: {static: 0.8, kinetic: 0.5, decay_speed: 1 mm/s}}
    drive: {mass: 5 g, force: 0.3 N, ramp: {times: [0 s, 0.1 s], factors: [0.0, 1.0]}}
    programme: [{hold: {duration: 1 s}}]
tractions: {top: {value: [0 Pa, -1 kPa], ramp: {times: [0 s, 1 s], factors: [0, 1]}}}
gravity: [0 m/s^2, -9.81 m/s^2]
initial_velocity: [10 mm/s, 0 mm/s]
integration: nodal
time: {step: 2 ms, scheme: quasi_static, end: 0.1 s}
"""


def test_everything_that_python_can_say_reaches_the_model():
    """Two bodies of other shapes, each with its own law and motion, loads over time, quasi-static steps."""
    values = block_values() | yaml.safe_load(EVERYTHING)
    values["contacts"].insert(0, ROLLER | {"boundary": "bottom"})
    del values["contact"]
    model = build_model(run_of(values), block_mesh())
    roller, plane = model.contacts
    assert roller.counterface == fs.Cylinder(8e-3, centre=(0.0, -9e-3))
    assert roller.friction == fs.PressureDependent(0.6, 10e3, -0.2)
    assert roller.programme is None
    assert plane.counterface == fs.Plane((0.0, -1.0))
    assert plane.friction == fs.StaticKinetic(0.8, 0.5, 1e-3)
    assert plane.programme == (fs.Hold(1.0),)
    assert plane.drive == fs.Drive(5e-3, 0.3, fs.Ramp((0.0, 0.1), (0.0, 1.0)))
    assert model.tractions["top"] == fs.Traction((0.0, -1e3), fs.Ramp((0.0, 1.0), (0.0, 1.0)))
    assert (model.gravity, model.initial_velocity) == ((0.0, -9.81), (0.01, 0.0))
    assert (model.integration, model.time) == ("nodal", fs.QuasiStatic(2e-3, 0.1))


def test_rigid_bodies_reach_the_model_with_the_contacts_on_them():
    jug = """{mass: 300 g, free: [x], springs: {x: 2 N/mm}, filling: {times: [0 s, 1 s], factors: [0, 1]},
        programme: [{press: {depth: 1 mm, speed: 1 mm/s}}]}"""
    values = block_values() | {"bodies": {"jug": yaml.safe_load(jug)}, "programme": []}
    values["contact"] = values["contact"] | {"rigid_body": "jug"}
    model = build_model(run_of(values), block_mesh())
    filling, press = fs.Ramp((0.0, 1.0), (0.0, 1.0)), fs.Press(1e-3, 1e-3)
    expected = fs.RigidBody(0.3, ("x",), springs=fs.Springs(x=2e3), filling=filling, programme=(press,))
    assert model.bodies == {"jug": expected}
    assert model.contacts[0].rigid_body == "jug"
    assert model.programmes == ((press,),)
    assert model.end == 1.0


SOFT = finger_values(fingertip={"preset": "wang2014-2d", "phalanx": {"rigid": False}})
SOLID = finger_values(formulation="solid", contact={"friction_coefficient": 0.6, "normal": [0, 1, 0]})
WITHOUT_DEPTH = {key: value for key, value in block_values().items() if key != "depth"} | {"formulation": "solid"}


@pytest.mark.parametrize(
    ("values", "supports", "formulation", "depth"),
    [
        (finger_values(), {"phalanx": ("x", "y")}, "plane_stress", 1e-3),
        (SOFT, {"phalanx_dorsal": ("x", "y")}, "plane_stress", 1e-3),
        (SOLID, {"phalanx": ("x", "y", "z")}, "solid", 1.0),
        (WITHOUT_DEPTH, {"top": ("x", "y")}, "solid", 1.0),
    ],
)
def test_a_phalanx_is_held_and_a_solid_needs_no_depth(values, supports, formulation, depth):
    model = build_model(run_of(values), block_mesh())
    assert (model.supports, model.formulation, model.depth) == (supports, formulation, depth)
    if values is SOLID:
        assert model.contacts[0].counterface == fs.Plane((0.0, 1.0, 0.0))


@pytest.mark.slow
def test_tetrahedra_make_a_model_in_3d(monkeypatch):
    sizes = {"element": "T4", "contact_size": "0.8 mm", "bulk_size": "1.6 mm"}
    run = run_of(finger_values(fingertip={"preset": "wang2014-3d"}, mesh=sizes, record={"receptors": ["FA-I"]}))
    mesh, built = coarse_solid(), []
    monkeypatch.setattr(fs.SolidSizes, "build", lambda *source: built.append(source) or mesh)
    model = build_model(run, build_mesh(run))
    assert built == [(fs.SolidSizes("T4", 0.8e-3, 1.6e-3), change_solid())]
    assert (model.formulation, model.depth) == ("solid", 1.0)
    assert model.supports == {"phalanx_dorsal": ("x", "y", "z")}
    assert model.contacts[0].counterface.normal == (0.0, 1.0, 0.0)
    assert {len(site.position) for site in model.record.sites} == {3}
    inspect_model(model)


SMALL_ELEMENTS = finger_values(
    fingertip={"preset": "wang2014-3d"}, mesh={"element": "T4", "contact_size": "0.45 mm", "bulk_size": "0.55 mm"}
)
LAYERS = {"contact_size": "0.1 mm", "bulk_size": "0.1 mm", "cut": "16 mm"}
SKIN = str(ROOT / "meshes" / "scan_skin.stl")
SMALL_IN_SCAN = {"skin": SKIN, "unit": "mm", "tip": [1, 0, 0], "pad": [0, -1, 0], "layers": LAYERS}


@pytest.mark.parametrize(
    ("source", "memory", "values"),
    [(fs.SolidSizes, 5 * 10**8, SMALL_ELEMENTS), (fs.SurfaceMesh, 10**9, block_values() | {"mesh": SMALL_IN_SCAN})],
)
def test_elements_too_small_for_the_memory_are_refused_before_they_are_made(monkeypatch, source, memory, values):
    """130,000 tetrahedra take more than half a gigabyte; nothing is meshed to find that out."""
    monkeypatch.setattr(source, "build", lambda *_: pytest.fail("it must not mesh"))
    monkeypatch.setattr("fingerslip.linear.resources.available_memory", lambda: memory)
    with pytest.raises(fs.InputError, match=r"memory: .* about [\d.e+]+ GB \(assembly of about .* tetrahedra"):
        build_mesh(run_of(values))


def test_mesh_of_a_run_is_that_of_its_scan_and_its_error_names_the_study(tmp_path, monkeypatch):
    for name in ("skin.stl", "phalanx.stl"):
        (tmp_path / name).write_text(name)
    scanned = run_of(scan_values(), tmp_path)
    with pytest.raises(fs.InputError, match=r"x\.yaml: .*skin.stl: cannot be read"):
        build_mesh(scanned)
    made = mesh_of_a_scan()
    monkeypatch.setattr(
        "fingerslip.mesh.scan.build.mesh_scan", lambda settings: made if settings.layers.cut == 16e-3 else None
    )
    monkeypatch.setattr("fingerslip.mesh.scan.build.SurfaceMesh.estimated_cells", lambda *_: 1e4)
    assert build_mesh(scanned) is inspect_mesh(scanned).mesh is made.mesh
