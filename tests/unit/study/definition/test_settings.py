"""The parts of a study file: the key says the kind, and a mistake is named where it stands."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fingerslip.contact.counterfaces import BuiltInCounterface, Plane, Sphere
from fingerslip.contact.friction import Anisotropic, BuiltInLaw, Conditions, Coulomb
from fingerslip.errors import InputError
from fingerslip.mesh.scan.build import SurfaceMesh
from fingerslip.parameters import kinds_of
from fingerslip.study.definition.runs import expand
from fingerslip.study.definition.schema import study_schema
from fingerslip.study.definition.settings import ContactSettings
from fingerslip.study.definition.spec import known_paths, parse_study, study_mapping
from unit.scans import scan_values
from unit.study.block import block_values

SOURCE = Path("studies/x.yaml")
DROP = {"static_kinetic": {"static": 0.8, "kinetic": 0.5, "decay_speed": "1 mm/s"}}
BALL = {"sphere": {"radius": "5 mm", "normal": [0, 0, 1]}}
SLIDING = Conditions(np.array([1e3]), np.array([1.0]), np.array([1.0]), 1.0)
DRIVE = {"mass": "5 g", "force": "0.3 N"}
LAWS = ", ".join(kinds_of(BuiltInLaw))


def contact(**values: Any) -> dict[str, Any]:
    return block_values() | {"contact": {"boundary": "bottom"} | values, "sweep": {}}


def everything() -> dict[str, Any]:
    """Return a study that uses every choice at once; it need not be computable."""
    values = contact() | {
        "contacts": [
            {"friction": DROP, "drive": DRIVE, "programme": [{"press": {"depth": "1 mm", "speed": "1 mm/s"}}]},
            {"friction": {"anisotropic": {"along": 0.4, "across": 0.6}}, "counterface": BALL},
            {
                "friction": {"coulomb": {"coefficient": 0.3}},
                "counterface": {"plane": {"normal": [0, -1], "offset": "1 mm"}},
            },
        ],
        "tractions": {"top": {"value": ["1 kPa"], "ramp": {"times": ["0 s"], "factors": [1.0]}}, "side": ["2 Pa"]},
        "bodies": {
            "jug": {
                "mass": "0.3 kg",
                "free": ["y", "rz"],
                "centre": ["0 mm", "30 mm"],
                "inertia": ["1 g m^2"],
                "springs": {"y": "2 N/m"},
                "loads": [{"rz": "1 N mm", "ramp": {"times": ["0 s"], "factors": [1.0]}}],
                "programme": [{"press": {"depth": "1 mm", "speed": "1 mm/s"}}],
            }
        },
        "gravity": ["0 m/s^2", "-9.81 m/s^2"],
        "initial_velocity": ["1 mm/s"],
        "time": {"step": "2 ms", "scheme": "quasi_static"},
    }
    del values["contact"]
    return values


def test_short_form_is_a_plate_with_coulomb_friction() -> None:
    contact = ContactSettings(friction_coefficient=0.6, offset=-1e-3).contact(2)
    assert contact.friction == Coulomb(0.6)
    assert contact.counterface == Plane((0.0, 1.0), -1e-3)


def test_long_form_gives_any_law_and_body() -> None:
    contacts = parse_study(everything(), SOURCE).contacts
    assert contacts[1].friction == Anisotropic(0.4, 0.6)
    assert contacts[1].counterface == Sphere(5e-3, (0.0, 0.0, 1.0))
    assert contacts[2].counterface == Plane((0.0, -1.0), 1e-3)


def test_written_study_reads_back_the_same() -> None:
    study = parse_study(everything(), SOURCE)
    assert parse_study(study_mapping(study), SOURCE) == study


def test_resolved_run_reads_back_the_same() -> None:
    (run,) = expand(parse_study(everything(), SOURCE), SOURCE)
    assert parse_study(run.plain_values(), SOURCE).contacts == run.study.contacts


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"friction_coefficient": 0.6, "friction": DROP},
            "contact.friction: is given with friction_coefficient, needs one of the two",
        ),
        (
            {"friction": {"static_kinetic": {"static": 0.8, "kinetic": 0.5, "decay": "1 mm/s"}}},
            (
                "contact.friction.static_kinetic.decay: is not known, may be one of static, kinetic, decay_speed; "
                "did you mean 'decay_speed'?"
            ),
        ),
        (
            {"friction": {"static_kinetik": {}}},
            (f"contact.friction.static_kinetik: is not known, may be one of {LAWS}; did you mean 'static_kinetic'?"),
        ),
        (
            {"friction": {}},
            f"contact.friction: has no law, needs one of {LAWS}",
        ),
        (
            {"friction": DROP | {"coulomb": {"coefficient": 1}}},
            (f"contact.friction: has coulomb and static_kinetic, needs one of {LAWS}"),
        ),
        (
            {"friction": {"coulomb": {"coefficient": -1}}},
            "contact.friction.coulomb.coefficient: got -1, needs a number >= 0",
        ),
        (
            {"friction": DROP, "counterface": {"cylinder": {"radius": 8}}},
            "contact.counterface.cylinder.radius: '8' has no unit, needs a unit of [m]; write '8 mm' or '8 m'",
        ),
        (
            {"friction": DROP, "counterface": {"cylinder": {"radius": "8 mm", "axis": [0, 0, 1]}}},
            "contact.counterface.cylinder.axis: got (0.0, 0.0, 1.0), needs a direction in 3D and none in 2D",
        ),
        (
            {"friction": DROP, "counterface": BALL, "offset": "1 mm"},
            "contact.counterface: is given with normal or offset, needs them inside it; move them into counterface",
        ),
        (
            {"friction": DROP, "clearance": 0.35},
            "contact.clearance: '0.35' has no unit, needs a unit of [m]; write '0.35 mm' or '0.35 m'",
        ),
        (
            {"friction": DROP, "clearance": "-1 mm"},
            "contact.clearance: got '-1 mm', needs a value >= 0",
        ),
        (
            {"friction": DROP, "clearance": "1 mm", "offset": "-8 mm"},
            (
                "contact.clearance: is given with offset or centre, needs a counterface without a given start; "
                "leave out one of them"
            ),
        ),
        (
            {"friction": DROP, "normal": [0, 0]},
            "contact.normal: got (0.0, 0.0), needs two or three components, not all zero",
        ),
        (
            {"friction": DROP, "programme": [{"pres": {}}]},
            "contact.programme.0.pres: is not known, may be one of press, hold, slide, lift; did you mean 'press'?",
        ),
        (
            {"friction": DROP, "drive": {"mass": "5 g", "force": 3}},
            "contact.drive.force: '3' has no unit, needs a unit of [N]; write '3 N'",
        ),
        (
            {"friction": DROP, "drive": DRIVE | {"ramp": {"times": ["1 s", "0 s"], "factors": [0, 1]}}},
            "contact.drive.ramp.times: got (1.0, 0.0) and (0.0, 1.0), needs ascending times, a factor for each",
        ),
    ],
)
def test_mistake_in_a_contact_is_named_with_its_mend(values: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_study(contact(**values), SOURCE)
    assert str(caught.value) == f"studies/x.yaml: {message}"


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"contacts": [{"friction": DROP}]}, "contacts: is given with contact, needs one of the two"),
        ({"time": {"step": "1 ms", "scheme": "static"}}, "time.scheme: got 'static', needs 'hht_alpha' or"),
        (
            {"time": {"step": "1 ms", "scheme": "quasi_static", "alpha": -0.1}},
            "time.alpha: got -0.1 for quasi-static steps, may not be given; leave it out",
        ),
        ({"time": {"step": "auto"}}, "time.output: is missing, step: auto needs the time between records; write"),
        ({"time": {"step": "atuo"}}, "time.step: 'atuo' is not a quantity, needs a number and a unit such as '1.5 ms'"),
        (
            {"time": {"step": "1 ms", "tolerance": 1e-3}},
            "time.tolerance: is given with a fixed step, belongs to step: auto; write step: auto, or leave it out",
        ),
        (
            {"time": {"step": "auto", "output": "5 ms", "smallest": "4 ms"}},
            "time.smallest: got 0.004 s for records every 0.005 s, needs at most half the time between records",
        ),
        (
            {"time": {"step": "auto", "output": "5 ms", "smallest": "1 ms", "largest": "0.5 ms"}},
            "time.largest: got 0.0005 s where the shortest step is 0.001 s, needs at least twice the shortest step",
        ),
        ({"time": {"step": "auto", "output": "5 ms", "tolerance": 2}}, "time.tolerance: got 2, needs a number < 1"),
        (
            {"time": {"step": "auto", "output": "5 ms"}, "dynamics": {"basis": "reduced"}},
            "dynamics.basis: is reduced where time.step is auto, needs a fixed step; write basis: full",
        ),
        ({"gravity": [0, -9.81]}, "gravity.0: '0' has no unit, needs a unit of [m/s^2]"),
        ({"tractions": {"top": [1]}}, "tractions.top.0: '1' has no unit, needs a unit of [Pa]"),
        (
            {"tractions": {"top": {"valu": ["1 Pa"]}}},
            "tractions.top.valu: is not known, may be one of value, ramp; did you mean 'value'?",
        ),
        ({"supports": {"top": ["w"]}}, "supports.top.0: got 'w', needs 'x', 'y' or 'z'"),
        ({"integration": "nodl"}, "integration: got 'nodl', needs 'selective', 'full' or 'nodal'"),
    ],
)
def test_mistake_in_loads_and_time_is_named(values: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_study(block_values() | {"sweep": {}} | values, SOURCE)
    assert str(caught.value).startswith(f"studies/x.yaml: {message}")


def test_mistake_in_one_of_several_contacts_is_numbered() -> None:
    values = everything()
    values["contacts"][1] = {"friction": {"anisotropic": {"along": 0.0, "across": 1.0}}}
    with pytest.raises(
        InputError, match=r"x\.yaml: contacts\.1\.friction\.anisotropic\.along: got 0\.0, needs a number > 0"
    ):
        parse_study(values, SOURCE)


def test_values_in_every_choice_can_be_swept() -> None:
    swept = {"contacts.0.friction.static_kinetic.kinetic": [0.8, 0.5], "contacts.1.counterface.sphere.radius": ["4 mm"]}
    runs = expand(parse_study(everything() | {"sweep": swept}, SOURCE), SOURCE)
    laws = [run.study.contacts[0].friction for run in runs]
    assert [law.coefficients(SLIDING) for law in laws] == pytest.approx([0.8, 0.5])
    assert {run.name for run in runs} == {"kinetic-0.8_radius-4mm", "kinetic-0.5_radius-4mm"}


def test_whole_laws_can_be_swept() -> None:
    values = contact(friction=DROP) | {"sweep": {"contact.friction": [DROP, {"coulomb": {"coefficient": 0.8}}]}}
    runs = expand(parse_study(values, SOURCE), SOURCE)
    assert [type(run.study.all_contacts[0].friction).__name__ for run in runs] == ["StaticKinetic", "Coulomb"]
    assert "contact.drive" in known_paths(values)["contact"]


def test_schema_knows_every_choice() -> None:
    definitions = study_schema()["$defs"]
    laws = {"coulomb", "static_kinetic", "pressure_dependent", "anisotropic"}
    assert laws <= set(definitions["FrictionChoice"]["properties"]) == set(kinds_of(BuiltInLaw))
    shapes = {"plane", "cylinder", "sphere"}
    assert shapes <= set(definitions["CounterfaceChoice"]["properties"]) == set(kinds_of(BuiltInCounterface))
    assert definitions["TimeSettings"]["properties"]["scheme"]["enum"] == ["hht_alpha", "quasi_static"]
    assert definitions["StaticKinetic"]["properties"]["decay_speed"]["examples"] == ["1.5 mm/s"]
    assert "Ramp" in definitions


def test_mesh_of_a_scan_is_si_with_absolute_paths(tmp_path: Path) -> None:
    mesh = parse_study(scan_values(), tmp_path / "study.yaml").mesh
    assert isinstance(mesh, SurfaceMesh)
    assert (mesh.skin, mesh.phalanx) == (str(tmp_path.resolve() / "skin.stl"), str(tmp_path.resolve() / "phalanx.stl"))
    assert mesh.plate_angle == pytest.approx(np.pi / 9)
    assert (mesh.layers.skin_thickness, mesh.layers.cut) == (1.2e-3, 16e-3)


def test_mesh_of_a_scan_reads_back_the_same(tmp_path: Path) -> None:
    study = parse_study(scan_values(), tmp_path / "study.yaml")
    assert parse_study(study_mapping(study), tmp_path / "study.yaml") == study


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"plate_angel": "20 deg"}, "mesh.plate_angel: is not known, .*did you mean 'plate_angle'"),
        ({"tip": [1, 0]}, "mesh.tip"),
        ({"unit": "inch"}, "mesh.unit: got 'inch'"),
        ({"layers": {"cut": "16"}}, "mesh.layers.cut: '16' has no unit.*'16 mm'"),
        ({"layers": {"tolerance": "0.5 mm"}}, r"mesh.layers.tolerance: got 0.5 mm, needs <= 0.25 mm"),
    ],
)
def test_mistake_in_the_mesh_of_a_scan_is_named_with_its_repair(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        parse_study(scan_values(**changes), SOURCE)
