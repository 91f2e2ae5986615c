"""The study file: every mistake gives one error that says where, what, what is allowed and how to repair it."""

import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

import fingerslip as fs
from fingerslip.contact.friction import Anisotropic, Conditions, Coulomb
from fingerslip.mesh.source import MeshFile
from fingerslip.parameters import as_mapping, from_mapping
from fingerslip.parameters.dotted import assign, walk
from fingerslip.specimens.choice import SPECIMENS
from fingerslip.study.definition.relations import mistakes_between
from fingerslip.study.definition.runs import expand_mapping, read_runs, with_directions
from fingerslip.study.definition.settings import CameraSettings, ContactSettings, TimeSettings, TrialSettings
from fingerslip.study.definition.spec import Study, known_paths, parse_study, read_study
from places import ROOT
from unit.scans import scan_values
from unit.study.block import block_values, finger_values

FINGER = """
title: Slip onset against friction
fingertip:
  preset: wang2014-2d
  phalanx: {variant: original}
mesh: {contact_size: 0.15 mm, bulk_size: 0.6 mm}
contact: {friction_coefficient: 0.6}
programme:
  - press: {depth: 1.5 mm, speed: 1.5 mm/s}
  - slide: {distance: 6 mm, speed: 3 mm/s}
time: {step: 5 ms, alpha: -0.05}
record: {receptors: [FA-I, SA-I], snapshots_every: 50 ms}
"""
SOURCE = Path("studies/x.yaml")
STUDIES = sorted((ROOT / "studies").glob("*.yaml"))


def finger():
    return yaml.safe_load(FINGER)


@pytest.mark.parametrize("values", ["finger", "everything", "scan_values"])
def test_written_study_and_its_run_read_back_the_same(values):
    plain = globals()[values]()
    study = parse_study(plain, SOURCE)
    assert plain == globals()[values](), "reading changes nothing in its argument"
    assert parse_study(as_mapping(study), SOURCE) == study
    (run,) = expand_mapping(plain, SOURCE).runs
    (again,) = expand_mapping(run.plain_values, SOURCE).runs
    assert (again.study.all_contacts, again.specimen) == (run.study.all_contacts, run.specimen)


DROP = {"static_kinetic": {"static": 0.8, "kinetic": 0.5, "decay_speed": "1 mm/s"}}
SLIDING = Conditions(np.array([1e3]), np.array([1.0]), np.array([1.0]), 1.0)


def contact(**values):
    return block_values() | {"contact": {"boundary": "bottom"} | values, "sweep": {}}


ABOVE, BELOW, TILTED = ({"normal": normal} for normal in ([0, -1], [0, 2], [3, 4]))
SLIDES = [{"slide": {"distance": "1 mm", "speed": "1 mm/s"}}]
OTHER_WAY = {"programme": [{"slide": {"distance": "1 mm", "speed": "1 mm/s", "direction": [-1, 0]}}]}


@pytest.mark.parametrize(
    ("contacts", "directions"),
    [
        ([BELOW], [(1, 0)]),
        ([ABOVE], [(-1, 0)]),
        ([TILTED], [(0.8, -0.6)]),
        ([{"counterface": {"sphere": {"radius": "5 mm", "normal": [0, 0, -1]}}}], [(1, 0, 0)]),
        ([BELOW, BELOW], [(1, 0)]),
        ([BELOW, ABOVE], [None]),
        ([BELOW, ABOVE | {"programme": SLIDES}], [(1, 0), (-1, 0)]),
        ([BELOW | OTHER_WAY], [None, (-1, 0)]),
    ],
)
def test_slides_say_in_which_direction_counterfaces_go(contacts, directions):
    mapping = contact() | {"programme": SLIDES, "contacts": [{"friction_coefficient": 0.5} | each for each in contacts]}
    del mapping["contact"]
    study = parse_study(mapping, SOURCE)
    resolved = with_directions(study)
    programmes = [resolved.programme, *(each.programme for each in resolved.contacts if each.programme)]
    assert [programme[0].direction for programme in programmes] == [
        direction and pytest.approx(direction) for direction in directions
    ]
    assert study == with_directions(study, default=False) == with_directions(resolved, default=False)
    alone = {**mapping, "contact": mapping["contacts"][0]}
    del alone["contacts"]
    assert with_directions(parse_study(alone, SOURCE)).contact == resolved.contacts[0]


EVERYTHING = """
contacts:
  - friction: {static_kinetic: {static: 0.8, kinetic: 0.5, decay_speed: 1 mm/s}}
    drive: {mass: 5 g, force: 0.3 N}
    programme: [{press: {depth: 1 mm, speed: 1 mm/s}}]
  - friction: {anisotropic: {along: 0.4, across: 0.6}}
    counterface: {sphere: {radius: 5 mm, normal: [0, 0, 1]}}
  - friction: {coulomb: {coefficient: 0.3}}
    counterface: {plane: {normal: [0, -1], offset: 1 mm}}
tractions: {top: {value: [1 kPa], ramp: {times: [0 s], factors: [1.0]}}, side: [2 Pa]}
bodies:
  jug:
    mass: 0.3 kg
    free: [y, rz]
    centre: [0 mm, 30 mm]
    inertia: [1 g m^2]
    springs: {y: 2 N/m}
    loads: [{rz: 1 N mm, ramp: {times: [0 s], factors: [1.0]}}]
    programme: [{press: {depth: 1 mm, speed: 1 mm/s}}]
gravity: [0 m/s^2, -9.81 m/s^2]
initial_velocity: [1 mm/s]
time: {step: 2 ms, scheme: quasi_static}
"""


def everything():
    """Return a study that uses every choice at once; it need not be computable."""
    values = contact() | yaml.safe_load(EVERYTHING)
    del values["contact"]
    return values


HEIGHT = "fingertip.sagittal.half_height"
REFUSING = {
    "finger": finger,
    "block": lambda: block_values() | {"sweep": {}},
    "tip": finger_values,
    "sampled": lambda: finger_values(sample={"count": 4, "ranges": {HEIGHT: ["6 mm", "7 mm"]}}),
    "scan": scan_values,
    "everything": everything,
}
REFUSALS = yaml.safe_load(Path(__file__).with_name("refusals.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("study", "change", "error"),
    [(study, entry["change"], entry["error"]) for study, entries in REFUSALS.items() for entry in entries],
    ids=str,
)
def test_mistake_is_named_with_its_repair(study, change, error):
    values = REFUSING[study]()
    for path, value in change.items():
        if value is None:
            drop(values, path)
        elif path == "sweep":
            values[path] = value
        else:
            assign(values, path, value)
    with pytest.raises(fs.InputError) as caught:
        expand_mapping(values, SOURCE)
    said = str(caught.value).replace("studies/x.yaml: ", "")
    assert said == error if not error.endswith("...") else said.startswith(error.removesuffix("..."))


def drop(values, path):
    """Remove the value at a dotted path."""
    *groups, last = path.split(".")
    for group in groups:
        values = values[group]
    del values[last]


LEAVES = {
    "title": 3,
    "fingertip.phalanx.variant": "flat",
    "fingertip.layers.skin_thickness": "1 s",
    "fingertip.materials.dermis.poisson_ratio": "x",
    "mesh.contact_size": 0.15,
    "mesh.bulk_size": "0.6",
    "contact.friction_coefficient": -1,
    "contact.boundary": 7,
    "programme.0.press.depth": 1.5,
    "programme.0.press.speed": "1 kg",
    "programme.1.slide.distance": "far",
    "programme.1.slide.sped": "1 mm/s",
    "time.step": "0 ms",
    "time.alpha": 1,
    "record.receptors.0": "FA",
    "record.snapshots_every": 50,
    "supports.phalanx.0": "q",
    "gravity.1": "9.81",
    "integration": "half",
    "depth": "-1 mm",
    "compare.0": "wang2014-table3",
    "sweep.contact.offset.1": "1 s",
    "sweep.fingertip.section.0": "middle",
    "sweep.time.end.0": 3,
}


def whole():
    """Return a study in which every leaf above stands."""
    return finger() | {
        "supports": {"phalanx": ["x", "y"]},
        "gravity": ["0 m/s^2", "0 m/s^2"],
        "compare": ["wang2014-table2"],
        "sweep": {"contact.offset": ["0 mm", "1 mm"], "fingertip.section": ["sagittal"], "time.end": ["1 s", "2 s"]},
    }


def put(values, path, value):
    """Put a value at a path, also where a key of the sweep has dots in its name."""
    if path.startswith("sweep."):
        name, _, number = path.removeprefix("sweep.").rpartition(".")
        values["sweep"][name][int(number)] = value
    else:
        assign(values, path, value)


@given(broken=st.sets(st.sampled_from(sorted(LEAVES)), min_size=1))
def test_every_mistake_of_a_file_is_told_in_its_order_with_its_line(tmp_path_factory, broken):
    values = whole()
    parse_study(values, SOURCE)
    for path in broken:
        put(values, path, LEAVES[path])
    file = tmp_path_factory.mktemp("studies") / "x.yaml"
    file.write_text(yaml.safe_dump(values, sort_keys=False), encoding="utf-8")
    with pytest.raises(fs.InputError) as caught:
        read_study(file)
    told = caught.value.all
    assert {error.where.removeprefix(f"{file}: ") for error in told} == broken
    assert str(caught.value).splitlines() == [str(error) for error in told]
    assert len(told) == len(broken)
    lines = [error.line for error in told]
    assert None not in lines
    assert lines == sorted(lines)
    text = file.read_text(encoding="utf-8").splitlines()
    for error in told:
        value = str(LEAVES[error.where.removeprefix(f"{file}: ")])
        assert value in text[error.line - 1], "the line is that of the wrong value"


odd = st.sampled_from(
    [None, True, -1, 10**299, float("nan"), "", "1 s", "1 mm mm", "1 (m", [], [None], {}, {"": 1}, [{}]]
)


@pytest.mark.slow
@given(path=st.sampled_from(list(walk(whole()))), value=odd, swept=st.booleans())
def test_any_value_anywhere_gives_a_study_or_clear_errors(path, value, swept):
    values = whole()
    if swept:
        values["sweep"] |= {path: [value]}
    elif not path.startswith("sweep."):
        assign(values, path, value)
    try:
        found = parse_study(values, SOURCE)
    except fs.InputError as error:
        found = error
    if not isinstance(found, Study):
        assert len(str(found).splitlines()) == len(found.all)
        assert all(one.where.startswith("studies/x.yaml") for one in found.all)


def test_files_of_meshes_are_relative_to_the_study(tmp_path):
    here, source = tmp_path.resolve(), tmp_path / "x.yaml"
    source.write_text(yaml.safe_dump(block_values()))
    assert read_study(source).mesh == MeshFile(str(here / "block.msh"))
    mesh = parse_study(scan_values(), source).mesh
    assert isinstance(mesh, fs.SurfaceMesh)
    assert (mesh.skin, mesh.phalanx) == (str(here / "skin.stl"), str(here / "phalanx.stl"))
    assert mesh.plate_angle == pytest.approx(np.pi / 9)
    assert (mesh.layers.skin_thickness, mesh.layers.cut) == (1.2e-3, 16e-3)


def documented(page):
    """Return the examples of a page of the documentation."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return [yaml.safe_load(block) for block in re.findall(r"```yaml\n(.*?)```", text, re.DOTALL)]


def test_laws_and_relaxation_of_the_documentation_are_read_and_can_be_swept():
    laws, example = documented("materials.md")[:2]
    materials = parse_study(finger() | laws, SOURCE).specimen("").materials
    assert materials["tissue"] == fs.NeoHookean(34e3, 0.48, 1000.0)
    assert isinstance(materials["dermis"], fs.Ogden)
    assert materials["epidermis"] == fs.Elastic(136e3, 0.48, 1000.0)
    terms = (fs.PronyTerm(0.3, 0.1), fs.PronyTerm(0.2, 2.0))
    study = parse_study(finger() | example, SOURCE)
    assert study.materials["skin"] == fs.Elastic(136e3, 0.48, 1000.0, prony=terms)
    assert parse_study(as_mapping(study), SOURCE) == study
    values = finger() | example | {"sweep": {"materials.skin.prony.0.time": ["0.2 s", "0.4 s"]}}
    swept = [run.study.materials["skin"].prony[0].time for run in expand_mapping(values, SOURCE).runs]
    assert swept == [0.2, 0.4]


def test_materials_that_ship_are_named_in_a_study_with_changes():
    example = next(values for values in documented("materials.md") if "ecoflex" in str(values))
    study = parse_study(finger() | example, SOURCE)
    tissue = dataclasses.replace(fs.material("pulp-relaxing"), youngs_modulus=90e3)
    assert study.specimen("").materials["tissue"] == tissue
    assert study.specimen("").materials["epidermis"] == fs.Elastic(136e3, 0.48, 1000.0)
    assert study.all_materials == {"dermis": fs.material("ecoflex-00-30")}
    assert study.materials == {"dermis": {"preset": "ecoflex-00-30"}}
    assert parse_study(as_mapping(study), SOURCE) == study
    (run,) = expand_mapping(as_mapping(study), SOURCE).runs
    again = parse_study(run.plain_values, SOURCE)
    assert again.all_materials == study.all_materials
    assert again.specimen("") == study.specimen("")


STIFFER = fs.Ogden((fs.OgdenTerm(10.55e3, 2.608),), 1070.0, bulk_modulus=1e6)


@pytest.mark.parametrize(
    ("entry", "expected"),
    [
        ({"preset": "pulp"}, fs.NeoHookean(34e3, 0.48, 1000.0)),
        ({"preset": "pulp-relaxing", "prony": []}, fs.NeoHookean(85e3, 0.48, 1000.0)),
        ({"preset": "pulp", "law": "elastic"}, fs.Elastic(34e3, 0.48, 1000.0)),
        ({"preset": "ecoflex-00-30", "bulk_modulus": "1 MPa", "poisson_ratio": None}, STIFFER),
    ],
)
def test_materials_that_ship_may_change_in_any_value(entry, expected):
    study = parse_study(finger() | {"materials": {"dermis": entry}}, SOURCE)
    assert study.all_materials["dermis"] == expected
    (run,) = expand_mapping(as_mapping(study), SOURCE).runs
    assert parse_study(run.plain_values, SOURCE).all_materials["dermis"] == expected


def test_names_and_values_of_materials_that_ship_are_swept():
    sweep = {
        "fingertip.materials.tissue.preset": ["pulp", "pulp-relaxing"],
        "materials.dermis.preset": ["ecoflex-00-30", "dragon-skin-30"],
        "materials.dermis.poisson_ratio": [0.48, 0.485],
    }
    values = finger() | {"materials": {"dermis": {"preset": "ecoflex-00-30"}}, "sweep": sweep}
    runs = expand_mapping(values, SOURCE).runs
    assert len(runs) == 8
    last, first = runs[-1], runs[0]
    assert last.study.all_materials["dermis"] == dataclasses.replace(fs.material("dragon-skin-30"), poisson_ratio=0.485)
    assert first.specimen.materials["tissue"] == fs.material("pulp")
    assert last.specimen.materials["tissue"] == fs.material("pulp-relaxing")


# Tens and hundreds of runs each.
LONG = (
    *("latency_sensitivity", "bulens2023_dataset", "bulens2023_section_moduli", "bulens2023_section_ridges"),
    *("bulens2023_section_rods", "bulens2023_section_slides", "wang2014_geometry"),
    *("bulens2023_section_shape", "bulens2023_pouring_3d", "wang2014_geometry_3d"),
)


@pytest.mark.parametrize(
    "path", [pytest.param(path, id=path.stem, marks=[pytest.mark.slow] * (path.stem in LONG)) for path in STUDIES]
)
def test_shipped_study_is_read_and_read_back(path):
    for run in read_runs(path).runs:
        again = parse_study(run.plain_values, path)
        for name in ("all_contacts", "programme", "time"):
            assert getattr(again, name) == getattr(run.study, name)


def test_examples_of_the_documentation_are_read(tmp_path):
    """The page shows a study in parts: together they are one, and every one of its runs is right.

    The short form of the contact, the samples, and steps that control their own error are those of a fingertip.
    """
    blocks = documented("studies.md")
    (controlled,) = (block for block in blocks if block.get("time", {}).get("step") == "auto")
    assert parse_study(finger() | controlled, SOURCE).time.records_per_decade == 20
    short, *parts, samples = (block for block in blocks if block is not controlled)
    assert len(expand_mapping(finger() | short | samples, SOURCE).runs) == 2 * 60
    whole = {}
    for part in parts:
        whole |= part
    source = tmp_path / "x.yaml"
    assert len(expand_mapping(whole, source).runs) == 8


@pytest.mark.parametrize(
    ("preset", "mesh", "element"),
    [
        ("wang2014-3d", None, "T10"),
        ("wang2014-3d", {"contact_size": "1 mm", "bulk_size": "2 mm"}, "T10"),
        ("wang2014-3d", {"element": "T4"}, "T4"),
        ("wang2014-3d", {"element": "Q4"}, "Q4"),
        ("wang2014-2d", None, "Q4"),
        ("wang2014-2d", {"element": "T3"}, "T3"),
    ],
)
def test_a_preset_in_space_is_meshed_in_space_unless_the_element_says_otherwise(preset, mesh, element):
    values = finger() | {"fingertip": {"preset": preset}, "record": {}, "mesh": mesh}
    if mesh is None:
        del values["mesh"]
    assert parse_study(values, SOURCE).mesh.element == element


def test_short_and_long_form_give_plate_and_law_and_values_in_every_choice_can_be_swept():
    short = ContactSettings(friction_coefficient=0.6, offset=-1e-3).contact(2)
    assert (short.friction, short.counterface) == (Coulomb(0.6), fs.Plane((0.0, 1.0), -1e-3))
    contacts = parse_study(everything(), SOURCE).contacts
    assert contacts[1].friction == Anisotropic(0.4, 0.6)
    assert contacts[1].counterface == fs.Sphere(5e-3, (0.0, 0.0, 1.0))
    assert contacts[2].counterface == fs.Plane((0.0, -1.0), 1e-3)
    swept = {"contacts.0.friction.static_kinetic.kinetic": [0.8, 0.5], "contacts.1.counterface.sphere.radius": ["4 mm"]}
    runs = expand_mapping(everything() | {"sweep": swept}, SOURCE).runs
    laws = [run.study.contacts[0].friction for run in runs]
    assert [law.coefficients(SLIDING) for law in laws] == pytest.approx([0.8, 0.5])
    assert {run.name for run in runs} == {"kinetic-0.8_radius-4mm", "kinetic-0.5_radius-4mm"}
    values = contact(friction=DROP) | {"sweep": {"contact.friction": [DROP, {"coulomb": {"coefficient": 0.8}}]}}
    runs = expand_mapping(values, SOURCE).runs
    assert [type(run.study.all_contacts[0].friction).__name__ for run in runs] == ["StaticKinetic", "Coulomb"]
    assert "contact.drive" in known_paths(values)["contact"]
    laws = ["elastic", "neo_hookean"]
    runs = expand_mapping(finger() | {"sweep": {"fingertip.materials.tissue.law": laws}}, SOURCE).runs
    assert [run.specimen.materials["tissue"].law for run in runs] == laws


def test_fields_that_are_missing_together_come_with_mistakes_elsewhere_and_relations_where_all_are_known():
    values = block_values() | {"time": {"step": 3}, "contacts": [{"friction_coefficient": 0.1}]}
    for name in ("materials", "formulation", "depth"):
        del values[name]
    with pytest.raises(fs.InputError) as caught:
        parse_study(values, SOURCE)
    missing = [(name, "is missing") for name in ("materials", "formulation", "depth")]
    faults = [(error.where.removeprefix("studies/x.yaml: "), error.found) for error in caught.value.all]
    assert faults == [("time.step", "'3' has no unit"), ("contacts", "is given with contact"), *missing]
    fields = {"contact": None, "contacts": (), "programme": (object(),)}
    (mistake,) = mistakes_between(fields)
    assert (mistake.where, mistake.found) == ("contact", "is missing, and the programme moves the plate")
    assert mistakes_between({**fields, "programme": ()}) == []
    assert mistakes_between({**fields, "contacts": (object(),)}) == []
    none = dict.fromkeys(SPECIMENS)
    fields = {**none, "mesh": MeshFile("a.msh"), "formulation": "solid", "materials": {}}
    assert [mistake.where for mistake in mistakes_between(fields)] == ["materials"]
    assert mistakes_between({**none, "materials": {}}) == []
    mistakes = mistakes_between(fields | {"formulation": None, "depth": None})
    assert [mistake.where for mistake in mistakes] == ["materials", "formulation", "depth"]


def test_settings_of_time_decide_the_stepping_and_are_refined_and_those_of_cameras_have_defaults():
    assert TimeSettings(1e-3, alpha=-0.1, end=1.0).stepping == fs.TimeStepping(1e-3, -0.1, 1.0)
    assert TimeSettings(1e-3, scheme="quasi_static", end=1.0).stepping == fs.QuasiStatic(1e-3, 1.0)
    assert TimeSettings(1e-3).alpha == fs.TimeStepping(1e-3).alpha
    given = {"output": 5e-3, "tolerance": 1e-2, "smallest": 1e-4, "largest": 1.0, "records_per_decade": 20, "end": 9.0}
    stepping = TimeSettings("auto", "quasi_static", **given).stepping
    assert stepping == fs.Adaptive(scheme="quasi_static", **given)
    assert TimeSettings("auto", alpha=-0.1, output=5e-3).stepping == fs.Adaptive(5e-3, alpha=-0.1)
    runs = expand_mapping(block_values() | {"sweep": {"time.step": ["2 ms", "1 ms"]}}, SOURCE).runs
    assert [run.study.time.step for run in runs] == [2e-3, 1e-3]
    assert TimeSettings(2e-3, alpha=-0.1).refined(0.25) == TimeSettings(0.5e-3, alpha=-0.1)
    finer = TimeSettings("auto", output=8e-3, tolerance=8e-3, smallest=1e-3).refined(0.5)
    assert finer.stepping == fs.Adaptive(4e-3, 1e-3, smallest=0.5e-3)
    camera = from_mapping(CameraSettings, {"view_width": "30 mm", "frame_rate": "60 1/s", "exposure": "5 ms"})
    assert (camera.view_width, camera.frame_rate, camera.exposure) == (0.03, 60.0, 5e-3)
    assert (camera.tier, camera.markers, camera.light) == ("pixel", "bright", "even")
    assert TrialSettings(view_width=64e-3, width=640).metres_per_pixel == pytest.approx(1e-4)


def test_groups_of_sites_reactions_and_mesh_sizes_that_are_wrong_come_together():
    load = {"ramp_load": {"rate": "4 N/s", "force": "1 N"}}
    values = finger() | {
        "mesh": {"contact_size": "0.5 mm", "bulk_size": "0.1 mm"},
        "reaction": {"mass": "100 g", "load": load, "reactions": ["human-slipp", "servoo"], "detectors": {}},
    }
    with pytest.raises(fs.InputError) as caught:
        parse_study(values, SOURCE)
    places = {error.where.removeprefix("studies/x.yaml: ") for error in caught.value.all}
    assert places >= {"mesh.bulk_size", "reaction.reactions.0", "reaction.reactions.1", "reaction.detectors"}
    with pytest.raises(fs.InputError) as caught:
        parse_study(finger() | {"time": {"step": 3}, "record": {"groups": ["whisker"]}}, SOURCE)
    faults = [(error.where.removeprefix("studies/x.yaml: "), error.found) for error in caught.value.all]
    assert ("record.groups", "a fingertip has no 'whisker'") in faults
    assert ("time.step", "'3' has no unit") in faults
