"""Values of runs for readers: every value of run.yaml with its unit and source, and none of another run."""

import copy
import functools
import tempfile
from pathlib import Path
from unittest.mock import ANY

import pytest
import yaml

from fingerslip.parameters import as_mapping
from fingerslip.parameters.dotted import assign, flatten
from fingerslip.report.page.page import Report, ReportSection, render_page
from fingerslip.report.tables.parameters import ASSUMED, DEFAULT, NOT_USED, ShownValue, value_tables
from fingerslip.specimens.fingertip.fingertip import preset_table
from fingerslip.study.definition.file import write_mapping
from fingerslip.study.definition.runs import expand_mapping
from fingerslip.study.running.build import build_model
from fingerslip.study.storage.reporting import STUDY_FILE, SWEPT, read_run_values, value_rows
from fingerslip.units import parse_quantity
from unit.study.block import block_values

COMMON = yaml.safe_load("""
contact:
  {friction_coefficient: 0.6, search_distance: 3 mm, offset: 0 mm, normal_penalty: 1e9 Pa/m,
  tangential_penalty: 1e9 Pa/m}
programme:
  - press: {depth: 1.5 mm, speed: 1.5 mm/s}
  - hold: {duration: 0.1 s}
  - slide: {distance: 6 mm, speed: 3 mm/s, direction: [1.0, 0.5]}
  - lift: {distance: 1 mm, speed: 2 mm/s}
damping: {mass: 1 1/s, stiffness: 1e-5 s}
time: {step: 5 ms, alpha: -0.41421, end: 3 s}
""")
PLANE = COMMON | yaml.safe_load("""
title: A section
fingertip: {preset: wang2014-2d, fingerprint: {enabled: true}}
mesh: {contact_size: 0.12 mm, bulk_size: 0.28 mm}
record: {receptors: [FA-I, SA-I], snapshots_every: 50 ms}
tractions: {skin: [1 kPa, 2 kPa], base: {value: [1 Pa, 0 Pa], ramp: {times: [0 s, 1 s], factors: [0, 1]}}}
gravity: [0 m/s^2, -9.81 m/s^2]
""")
SOLID = COMMON | yaml.safe_load("""
title: A finger
fingertip: {preset: wang2014-3d, solid: {angle: 20 deg}}
mesh: {element: T4, contact_size: 0.45 mm, bulk_size: 0.55 mm}
integration: nodal
supports: {phalanx_dorsal: [x, y, z]}
record: {reference_nodes: true, snapshots_every: 50 ms}
""")
BASES = {"plane": PLANE, "solid": SOLID}
#: Values that have to agree.
TOGETHER = {
    ("solid", "fingertip.sagittal.half_height"): "fingertip.transverse.half_height",
    ("solid", "fingertip.transverse.half_height"): "fingertip.sagittal.half_height",
}
#: What a word or a truth value is changed to, null for none; numbers and quantities are made smaller.
OTHER = dict.fromkeys(("fingertip.preset", "time.scheme", "title")) | yaml.safe_load("""
fingertip.section: transverse
fingertip.formulation: plane_strain
fingertip.phalanx.variant: scaled
mesh.element: {Q4: T3, T4: T10}
integration: {selective: full, nodal: full}
kinematics: finite
contact.boundary: pad
dynamics.basis: full
contact.clearance: null # may not be given with an offset; see below
record.receptors.0: FA-II
record.receptors.1: SA-II
supports.phalanx_dorsal.0: y
supports.phalanx_dorsal.1: z
supports.phalanx_dorsal.2: x
""")
OTHER |= {f"fingertip.materials.{layer}.law": "neo_hookean" for layer in ("epidermis", "dermis", "tissue", "phalanx")}


def resolved(values):
    """Return what the run.yaml of a study without a sweep holds."""
    return expand_mapping(values, Path("study.yaml")).runs[0].plain_values


@functools.cache
def base(kind):
    return resolved(BASES[kind])


def leaves():
    """Return all values of both runs; those that the solid has like the plane are in the slow tier."""
    paths = {kind: [path for path in flatten(base(kind)) if OTHER.get(path, "") is not None] for kind in BASES}
    alike = {path for path in paths["solid"] if path in paths["plane"] and ("solid", path) not in TOGETHER}
    return [
        pytest.param(kind, path, marks=[pytest.mark.slow] * (kind == "solid" and path in alike))
        for kind in BASES
        for path in paths[kind]
    ]


def changed(value, path):
    """Return another value that may stand at a path."""
    if path in OTHER:
        other = OTHER[path]
        return other[value] if isinstance(other, dict) else other
    if isinstance(value, bool):
        return not value
    if isinstance(value, str):
        number, _, unit = value.partition(" ")
        return f"{smaller(float(number))!r} {unit}"
    assert isinstance(value, int | float), f"{path} needs an entry in OTHER"
    return smaller(value)


def smaller(number):
    return 0.97 * number if number else 0.03125


def with_value(mapping, path, value):
    """Return a deep copy of nested data with another value at a path."""
    other = copy.deepcopy(mapping)
    assign(other, path, value)
    return other


def shown(mapping, folder):
    """Return the values of a run.yaml by path."""
    write_mapping(mapping, folder / "run.yaml")
    rows = value_rows([read_run_values(folder / "run.yaml")])
    assert len({row.path for row in rows}) == len(rows), "no value may be shown twice"
    return {row.path: row for row in rows}


@functools.cache
def base_rows(kind):
    with tempfile.TemporaryDirectory() as folder:
        return shown(base(kind), Path(folder))


def row_of(path, rows):
    """Return the row that shows a leaf: its own, or that of the list it is in."""
    return rows[path] if path in rows else rows[path.rpartition(".")[0]]


def in_display_units(value, path, row):
    """Return the number that a changed quantity or number must be shown as."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    if not isinstance(value, str):
        return float(value)
    number, _, si = value.partition(" ")
    try:
        float(number)
    except ValueError:
        return None
    unit = row.value.split(", ")[0].partition(" ")[2]
    return float(number) / parse_quantity(f"1 {unit}", si)


@pytest.mark.parametrize(("kind", "path"), leaves(), ids=str)
def test_every_changed_value_is_shown(kind, path, tmp_path):
    """The report shows the value of the run, whatever the preset or the default is."""
    new = changed(flatten(base(kind))[path], path)
    mapping = with_value(base(kind), path, new)
    if (kind, path) in TOGETHER:
        mapping = with_value(mapping, TOGETHER[kind, path], new)
    row, before = row_of(path, shown(mapping, tmp_path)), row_of(path, base_rows(kind))
    assert row.value != before.value, "the page has to show another value"
    expected = in_display_units(new, path, row)
    if expected is None:
        assert (str(new).lower() if isinstance(new, bool) else new) in row.value.split(", ")
    else:
        numbers = [float(part.split(" ")[0]) for part in row.value.split(", ")]
        assert any(number == pytest.approx(expected, rel=1e-5) for number in numbers)
    assert row.source != before.source or row.source in (STUDY_FILE, NOT_USED), "it has another source, too"


@pytest.mark.parametrize("kind", BASES)
def test_every_leaf_of_run_yaml_has_a_row_that_is_in_the_page(kind):
    rows = base_rows(kind)
    page = render_page(Report("r", (ReportSection("Values", tables=value_tables(tuple(rows.values()))),)))
    for path in flatten(base(kind)):
        if path != "title":
            row = row_of(path, rows)
            cells = page[page.index(f">{row.path}<") :]
            assert f">{row.value}<" in cells[: cells.index("</tr>")]


FINGER = {"preset": "wang2014-2d"}
OFF = FINGER | {"ridges": {"enabled": False}}
STIFF = {"epidermis": {"youngs_modulus": "1 MPa"}}
DERMIS = {"dermis": {"youngs_modulus": "1 kPa", "poisson_ratio": 0.3, "density": "1 kg/m^3"}}
ACROSS, SECTIONS = "of the transverse section only", "of 2D sections only"
BLOCK_STATIC = block_values() | {
    "time": {"step": "2 ms", "scheme": "quasi_static"},
    "programme": [{"slide": {"distance": "1 mm", "speed": "5 mm/s"}}],
    "contact": {"boundary": "bottom", "normal": [1, 0], "friction_coefficient": 0.5},
    "sweep": {},
}
#: Studies, and value, source and note of some of their values as they are shown.
SHOWN = {
    "quasi-static": (
        BLOCK_STATIC,
        {
            "time.scheme": ("quasi_static", STUDY_FILE, ""),
            "time.alpha": ("-0.05", NOT_USED, "quasi-static steps have no numerical damping"),
        },
    ),
    "defaults": (
        PLANE,
        {
            "time.step": ("5 ms", STUDY_FILE, ""),
            "time.alpha": ("-0.41421", STUDY_FILE, ""),
            "time.scheme": ("hht_alpha", DEFAULT, ""),
            "contact.boundary": ("skin", DEFAULT, ""),
            "contact.normal": (ANY, DEFAULT, ""),
            "programme.0.press.depth": ("1.5 mm", STUDY_FILE, ""),
            "tractions.skin": ("1 kPa, 2 kPa", STUDY_FILE, ""),
            "tractions.base.ramp.times": ("0 s, 1 s", STUDY_FILE, ""),
            "fingertip.transverse.half_width": (ANY, NOT_USED, ACROSS),
            "fingertip.phalanx.transverse.palmar_level": (ANY, NOT_USED, ACROSS),
            "fingertip.sagittal.half_height": (ANY, ASSUMED, ANY),
            "fingertip.fingerprint.height": (ANY, ASSUMED, "groove to crest"),
            "fingertip.ridges.pitch": ("0.47 mm", "corniani2024", ANY),
        },
    ),
    "changes beside a preset": (
        PLANE | {"fingertip": OFF | {"formulation": "plane_strain", "materials": STIFF}},
        {
            "fingertip.formulation": ("plane_strain", STUDY_FILE, "preset: plane_stress"),
            "fingertip.ridges.enabled": ("false", STUDY_FILE, "preset: true"),
            "fingertip.materials.epidermis.youngs_modulus": ("1000 kPa", STUDY_FILE, "preset: 136 kPa"),
            "fingertip.ridges.pitch": ("0.47 mm", "corniani2024", ANY),  # receptors sit at the ridges all the same
            **{
                f"fingertip.{entry.path}": (entry.value, entry.source, entry.note)
                for entry in preset_table("wang2014-2d")
                if entry.path in {"layers.skin_thickness", "materials.phalanx.youngs_modulus", "depth"}
            },
        },
    ),
    "the other section": (
        PLANE | {"fingertip": FINGER | {"section": "transverse"}},
        {
            "fingertip.sagittal.half_height": (ANY, NOT_USED, "of the sagittal section only"),
            "fingertip.transverse.half_width": (ANY, ASSUMED, ANY),
        },
    ),
    "a solid": (
        SOLID,
        {
            "formulation": ("solid", ANY, ANY),
            **{f"fingertip.{name}": (ANY, NOT_USED, SECTIONS) for name in ("formulation", "depth", "section")},
            "fingertip.ridges.pitch": (ANY, NOT_USED, "of 2D sections and receptors only"),
            "fingertip.transverse.half_width": (ANY, ASSUMED, ANY),  # the solid has both outlines
            "fingertip.solid.angle": ("20 deg", STUDY_FILE, "preset: 0 rad"),
        },
    ),
    "values of the study before those of the fingertip": (
        PLANE | {"materials": DERMIS, "formulation": "plane_strain", "depth": "2 mm"},
        {
            "materials.dermis.youngs_modulus": ("1 kPa", STUDY_FILE, ""),
            "fingertip.materials.dermis.youngs_modulus": (ANY, NOT_USED, "the study gives its own material"),
            "fingertip.materials.tissue.youngs_modulus": (ANY, "wang2014", ANY),
            "formulation": (ANY, STUDY_FILE, ""),
            "depth": (ANY, STUDY_FILE, ""),
            "fingertip.formulation": (ANY, NOT_USED, "the study gives its own formulation"),
            "fingertip.depth": (ANY, NOT_USED, "the study gives its own depth"),
        },
    ),
    "switched off": (
        PLANE | {"fingertip": OFF, "record": {}},
        {
            "fingertip.fingerprint.height": (ANY, NOT_USED, "switched off"),
            "fingertip.ridges.pitch": (ANY, NOT_USED, "switched off"),
            "fingertip.ridges.enabled": ("false", STUDY_FILE, "preset: true"),
        },
    ),
    "a clearance": (
        PLANE | {"contact": {"friction_coefficient": 0.6, "clearance": "0.35 mm"}},
        {"contact.clearance": ("0.35 mm", STUDY_FILE, "")},
    ),
}


@pytest.mark.parametrize(("values", "expected"), SHOWN.values(), ids=SHOWN)
def test_values_are_shown_with_their_sources_and_notes(values, expected, tmp_path):
    rows = shown(resolved(values), tmp_path)
    assert {path: (rows[path].value, rows[path].source, rows[path].note) for path in expected} == expected


def test_given_paths_count_where_they_are_known_and_what_another_law_brings_is_a_default():
    (run,) = expand_mapping(PLANE, Path("study.yaml")).runs
    rows = {row.path: row for row in value_rows([run], ["time.scheme", "fingertip.layers.skin_thickness"])}
    assert (rows["time.scheme"].source, rows["time.alpha"].source) == (STUDY_FILE, DEFAULT)
    (block,) = expand_mapping(BLOCK_STATIC, Path("study.yaml")).runs
    directions = [row for row in value_rows([block], ["programme.0.slide.speed"]) if row.path.endswith("direction")]
    assert directions == [ShownValue("programme.0.slide.direction", "0, -1", DEFAULT)], "as it was resolved"
    skin = rows["fingertip.layers.skin_thickness"]
    assert (skin.value, skin.source, skin.note) == ("1.5 mm", STUDY_FILE, "preset: 1.5 mm")
    law = {"law": "mooney_rivlin", "c10": "2 kPa", "poisson_ratio": 0.45}
    fingertip = {"preset": "wang2014-2d", "materials": {"tissue": law}}
    (run,) = expand_mapping({**PLANE, "fingertip": fingertip}, Path("x.yaml")).runs
    given = tuple(f"fingertip.materials.tissue.{name}" for name in law)
    rows = {row.path.removeprefix("fingertip.materials.tissue."): row for row in value_rows([run], given)}
    assert {rows[name].source for name in law} == {STUDY_FILE}
    assert (rows["stable_between"].source, rows["c01"].source) == (DEFAULT, DEFAULT)
    assert "youngs_modulus" not in rows


def test_values_that_differ_between_runs_are_swept_and_those_that_only_some_have_say_so(tmp_path):
    runs = []
    for number, (angle, friction) in enumerate((("0 deg", 0.2), ("30 deg", 0.2), ("-30 deg", 0.4))):
        mapping = with_value(base("solid"), "fingertip.solid.angle", angle)
        write_mapping(with_value(mapping, "contact.friction_coefficient", friction), tmp_path / f"{number}.yaml")
        runs.append(read_run_values(tmp_path / f"{number}.yaml"))
    rows = {row.path: row for row in value_rows(runs)}
    angle = rows["fingertip.solid.angle"]
    assert (angle.value, angle.source) == ("0 deg, 30 deg, -30 deg", SWEPT)
    assert "preset: 0 rad" in angle.note
    assert rows["contact.friction_coefficient"] == ShownValue("contact.friction_coefficient", "0.2, 0.4", SWEPT)
    assert rows["time.step"].source == STUDY_FILE
    contact = {"boundary": "bottom", "friction_coefficient": 0.3}
    shapes = [{"cylinder": {"radius": "8 mm"}}, {"sphere": {"radius": "9 mm", "normal": [0, 1]}}]
    contacts = [contact | {"counterface": shapes[0]}]
    values = block_values() | {"contacts": contacts, "sweep": {"contacts.0.counterface": shapes}}
    del values["contact"]
    rows = {row.path: row for row in value_rows(expand_mapping(values, Path("study.yaml")).runs)}
    radius = rows["contacts.0.counterface.cylinder.radius"]
    assert (radius.value, radius.source, radius.note) == ("8 mm", SWEPT, "in 1 of 2 runs")
    assert rows["contacts.0.friction_coefficient"].value == "0.3"


@pytest.mark.slow
def test_no_value_that_is_shown_as_not_used_changes_the_section(tmp_path):
    coarse = {"mesh": {"contact_size": "0.4 mm", "bulk_size": "0.8 mm"}}
    for record in ({"receptors": ["FA-I", "SA-II"]}, {}):
        check_unused(resolved(PLANE | coarse | {"fingertip": OFF, "record": record}), 13, tmp_path)


@pytest.mark.slow
def test_no_value_that_is_shown_as_not_used_changes_the_solid(tmp_path):
    coarse = {"mesh": {"element": "T4", "contact_size": "1.2 mm", "bulk_size": "2.5 mm"}}
    check_unused(resolved(SOLID | coarse), 12, tmp_path)


def check_unused(mapping, least, folder):
    """Change all values that are not used, and hold that the model stays the same."""
    unused = [path for path, row in shown(mapping, folder).items() if row.source == NOT_USED]
    assert len(unused) >= least
    other = mapping
    for path in unused:
        other = with_value(other, path, changed(flatten(mapping)[path], path))
    assert model_of(other, folder) == model_of(mapping, folder), unused


def model_of(mapping, folder):
    source = folder / "built.yaml"
    write_mapping(mapping, source)
    (run,) = expand_mapping(as_mapping(read_run_values(source).study), source).runs
    model = build_model(run)
    mesh = (model.mesh.p.tobytes(), model.mesh.t.tobytes())
    return (mesh, model.materials, model.formulation, model.depth, model.record)
