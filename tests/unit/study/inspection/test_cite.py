"""What a paper may say of a run: every sentence comes from what was run, and every paper named has its entry."""

import dataclasses
import re
from pathlib import Path

import pytest
import xarray as xr
import yaml

from fingerslip.dynamics.finite import iteration
from fingerslip.dynamics.step import contact_step
from fingerslip.errors import ResultError
from fingerslip.mesh.io import write_mesh
from fingerslip.report.tables.parameters import ShownValue
from fingerslip.results import StudyResult
from fingerslip.study.definition.runs import plan_studies
from fingerslip.study.inspection import cite, facts
from fingerslip.study.inspection.cite import methods_and_papers
from fingerslip.study.running.runner import run_study
from fingerslip.study.storage.reporting import SWEPT, value_rows
from fingerslip.uncertainty import Convergence, Series
from unit.study.block import block_mesh, block_values, finger_values
from unit.study.conftest import draw_nothing
from unit.whole_result import WHOLE

LIBRARIES = {"gustafsson2020", "harris2020", "virtanen2020", "lam2015", "hoyer2017"}
BLOCK = block_values() | {"sweep": {"contact.friction_coefficient": [0.2, 0.4]}}
PRONY = {"youngs_modulus": "100 kPa", "poisson_ratio": 0.3, "density": "1000 kg/m^3", "law": "neo_hookean"}
LARGE = block_values() | {
    "kinematics": "finite",
    "materials": {"block": {**PRONY, "prony": [{"share": 0.2, "time": "40 ms"}, {"share": 0.1, "time": "80 ms"}]}},
    "contact": {
        "friction": {"static_kinetic": {"static": 0.5, "kinetic": 0.4, "decay_speed": "1 mm/s"}},
        "boundary": "bottom",
    },
    "damping": {"stiffness": "1 ms"},
    "time": {"step": "10 ms", "scheme": "quasi_static"},
    "sweep": {},
}
FINGER = finger_values(
    fingertip={"preset": "wang2014-2d", "ridges": {"enabled": False}, "layers": {"skin_thickness": "1.4 mm"}},
    mesh={"contact_size": "1 mm", "bulk_size": "2 mm"},
    time={"step": "50 ms", "alpha": -0.41421},
    dynamics={"basis": "reduced"},
    record={"receptors": ["FA-I", "FA-II"]},
)
OGDEN = {"law": "ogden", "terms": [{"modulus": "6 kPa", "exponent": 6}], "poisson_ratio": 0.45}
AT_REST = block_values() | {"materials": {"block": {**OGDEN, "density": "1000 kg/m^3"}}, "sweep": {}}
CASES = {
    "large strain at small strain": (
        AT_REST,
        (
            "the mesh block.msh, in plane strain",
            "Ogden's law (Ogden 1972), taken as Hooke's law with its modulus at rest, E = 52.2 kPa (",
            "6 kPa, exponent 6, density 1000 kg/m^3, Poisson's ratio 0.45).",
        ),
        {"ogden1972", "alart1991", "malkus1978", "hilber1977", *LIBRARIES},
    ),
    "block": (
        BLOCK,
        (
            "The specimen was the mesh block.msh, in plane strain with an out-of-plane depth of 1 mm.",
            "block, isotropic linear elastic (Young's modulus 100 kPa, Poisson's ratio 0.3, density 1000 kg/m^3).",
            "Fixed: top (x, y). Strains and rotations were taken as small.",
            "45 nodes and 72 unknowns in bilinear quadrilaterals (Q4); their volumetric part was integrated at their",
            "Contact of the boundary bottom with a rigid plane (outward normal (0, 1)) was unilateral, with friction (",
            "Coulomb's, friction coefficient 0.2 and 0.4), by penalties at the nodes (0.8 GPa/m normal, 0.8",
            "(Alart & Curnier 1991) held to 1e-10 of the largest force. The counterface",
            "press (depth 0.1 mm, speed 5 mm/s), then slide (distance 0.2 mm, speed 5 mm/s, direction (1, 0)).",
            "HHT method (Hilber et al. 1977) with alpha = -0.05, in steps of 2 ms.",
            "2 runs differ in friction coefficient.",
            "has slipped by more than 20 µm since then",
            "Numerical uncertainty was not studied.",
        ),
        {"alart1991", "malkus1978", "hilber1977", "barrea2018", *LIBRARIES},
    ),
    "large strain": (
        LARGE,
        (
            "block, neo-Hookean (",
            "density 1000 kg/m^3, of the shear modulus 0.2 relaxes in 40 ms and 0.1 relaxes in 80 ms).",
            "Relaxation is that of the deviatoric stress, a sum of exponentials (Prony terms, Simo 1987).",
            "Strains and rotations were taken as large.",
            "with friction (static 0.5, kinetic 0.4, decay speed 1 mm/s), by penalties",
            "of the largest force; at large strain the balance of forces to 1e-06.",
            "Rayleigh damping was proportional to mass and stiffness (mass 0 1/s, stiffness 0.001 s), which no source",
            "Inertia was left out: every one of the steps of 10 ms was in equilibrium.",
        ),
        {"alart1991", "malkus1978", "simo1987", *LIBRARIES},
    ),
    "fingertip": (
        FINGER,
        (
            "two-dimensional sagittal section of a fingertip (preset wang2014-2d), in plane stress with an",
            "Its values were taken from Wang et al. 2014 and Corniani et al. 2024.",
            "Set differently from the preset: skin thickness 1.4 mm, ridges false.",
            "with published results in view: half height, distal end and formulation.",
            "contact size 1 mm, bulk size 2 mm",
            "alpha = -0.41421 and beyond the range that its authors recommend, in steps of 50 ms.",
            "constraint modes and",
            "FA-II. Spikes come from leaky integrate-and-fire models, alike within a type and without noise, with",
            "and delays of Saal et al. 2017, fitted to afferents of monkeys",
            "driven by equivalent strain (FA-I); stimuli were assumed, thresholds calibrated on single published ",
            "values: FA-I 0.11/s (Knibestöl 1973). That of FA-I is the least of 39,",
            "no result. FA-II left out: vibrations need steps of 0.3 ms and a body with damping. FA-I (117 Hz) respond",
            " to more than the 1 Hz that records resolve.",
        ),
        {
            "saal2017",
            "knibestol1973",
            "corniani2024",
            "alart1991",
            "malkus1978",
            "hilber1977",
            "craig1968",
            "wang2014",
            "geuzaine2009",
            *LIBRARIES,
        },
    ),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.usefixtures("settled")
def test_a_text_says_what_was_run_and_has_an_entry_for_each_paper_in_it(case, tmp_path, monkeypatch):
    draw_nothing(monkeypatch)
    values, sentences, keys = CASES[case]
    write_mesh(block_mesh(), tmp_path / "block.msh")
    (tmp_path / "study.yaml").write_text(yaml.safe_dump({"title": "A study"} | values, sort_keys=False))
    study = run_study(tmp_path / "study.yaml", results_dir=tmp_path / "results", workers=1)
    text, _, entries = methods_and_papers(study.folder).partition("\n\n")
    assert [sentence for sentence in sentences if sentence not in text] == [], text
    assert not re.search(r"@|\{|  |None|\(\)", text)
    solver = {"schenk2004" if "MKL PARDISO" in text else "li2005"}
    assert set(re.findall(r"^@\w+\{(\w+),", entries, re.MULTILINE)) == {"fingerslip", *keys, *solver}
    assert methods_and_papers(study.folder, only_bibtex=True) == entries
    run = methods_and_papers(study.folder / study.runs[0].name)
    assert "runs differ in" not in run
    assert ("friction coefficient 0.2" in run) == (case == "block")


@pytest.mark.parametrize(
    ("text", "source", "words"),
    [
        ("0.3, 0.6", SWEPT, "0.3 and 0.6"),
        ("small, large, rigid", SWEPT, "small, large and rigid"),
        ("(-1, 0), (0, 1)", SWEPT, "(-1, 0) and (0, 1)"),
        ("0.1, … (12 values)", SWEPT, "0.1, … (12 values)"),
        ("0.6", SWEPT, "0.6"),
        ("-1, 0", "study file", "-1, 0"),
    ],
)
def test_values_that_differ_between_runs_are_a_list_in_a_sentence(text, source, words):
    assert facts._in_a_sentence(ShownValue("path", text, source)).value == words


def test_regions_without_cells_of_their_own_are_left_out_and_triangles_among_quadrilaterals_are_told():
    coordinates = {"cell_nodes": (("cell", "corner"), [[0, 1, 2, 3], [1, 4, 2, 2]]), "cell_region": ("cell", [2, 1])}
    history = xr.Dataset(coords=coordinates, attrs={"regions": "ALL, Skin, Tissue", "element": "Q4"})
    assert cite._regions_with_cells(history) == ["Skin", "Tissue"]
    assert cite._elements_of(history) == "bilinear quadrilaterals (Q4) with linear triangles among them"
    assert cite._elements_of(history.isel(cell=[0])) == "bilinear quadrilaterals (Q4)"


def test_vectors_that_differ_between_runs_are_told_apart(write_study):
    directions = [[1, 0], [-1, 0]]
    path = write_study(block_values() | {"sweep": {"programme.1.slide.direction": directions}})
    rows = {row.path: row.value for row in value_rows(plan_studies([path])[0].runs)}
    assert rows["programme.1.slide.direction"] == "(1, 0), (-1, 0)"


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        (
            {"contact.drive.mass": "5 g", "contact.drive.force": "1 N"},
            "Along its normal, a force moved the counterface: mass 5 g, force 1 N, constant from the start.",
        ),
        (
            {"contacts.1.drive.force": "1 N", "contacts.1.drive.ramp.times": "0 s, 1 s"},
            "Along its normal, a force moved the counterface: force 1 N, times (0 s, 1 s).",
        ),
        (
            {"contacts.0.programme.0.press.depth": "1 mm"},
            "Counterfaces with a motion of their own: press depth 1 mm.",
        ),
        (
            {"bodies.jug.mass": "300 g", "bodies.jug.loads.0.y": "-1 N", "bodies.jug.free": "x, y"},
            "Rigid bodies: mass 300 g, y -1 N, free (x, y).",
        ),
        ({"support_motions.bone.displacement": "1 mm, 0 mm"}, "Supports moved: displacement (1 mm, 0 mm)."),
        ({"tractions.base": "1 kPa, 0 kPa"}, "Tractions: base (1 kPa, 0 kPa)."),
        ({"gravity": "0 m/s^2, -9.81 m/s^2"}, "Body force: gravity (0 m/s^2, -9.81 m/s^2)."),
    ],
)
def test_all_that_moves_or_loads_is_told_beside_the_programme(values, sentence):
    rows = {path: ShownValue(path, text, "study file") for path, text in values.items()}
    rows |= {"time.step": ShownValue("time.step", "1 ms", "study file")}
    rows |= {path: ShownValue(path, "0 s", "default") for path in ("contact.drive.ramp.times", "initial_velocity")}
    histories, study = (xr.Dataset(),), StudyResult(Path("s"), (), ())
    said = list(cite._motion(facts.Facts(rows | {"time.alpha": ShownValue("", "0", "")}, (), histories, study, "")))
    assert said[0] == sentence


def test_what_is_assumed_of_afferents_is_told_of_those_that_are_resolved(monkeypatch):
    monkeypatch.setattr("fingerslip.afferents.model.resolved_afferents", lambda _: ("SA-I", "SA-II"))
    kinds = ["SA-I", "SA-II", "FA-II"]
    history = xr.Dataset(
        dict.fromkeys(("strain", "damping_dissipation", "viscous_dissipation"), 0.0),
        {"time": [0.0, 2e-3], "site": kinds, "site_kind": ("site", kinds)},
    )
    said = list(cite._receptors_and_afferents(facts.Facts({}, (), (history,), StudyResult(Path("s"), (), ()), "")))
    assert "monkeys (those of SA-II are those of SA-I), driven by" in said[1]
    assert "stimuli and the threshold of SA-I for rates were assumed" in said[1]
    assert "FA-" not in said[1]
    assert said[2] == "FA-II left out: vibrations need steps of 0.3 ms and a body with damping."
    assert said[3] == "SA-I (101 Hz), SA-II (101 Hz) respond to more than the 25 Hz that records resolve."


def test_error_bars_are_the_largest_of_all_runs():
    bars = ({"slip.overall": 4e-3}, {"slip.overall": 2e-3, "slip.latency": 0.03, "displacement.overall": 1.0}, {})
    runs = [
        dataclasses.replace(WHOLE, swept={"friction": number}, uncertainty=uncertainty)
        for number, uncertainty in enumerate(bars)
    ]
    assert cite._error_bars(runs[:2]) == "Numerical uncertainty is at most: overall 4 ms and latency 30 ms."
    assert cite._error_bars(runs[2:]) == "Numerical uncertainty was not studied."
    values = {"step": Series("step", (1.0, 0.5, 0.25), (1.0, 1.2, 1.1))}
    known = {"slip.latency": Convergence("latency", "s", 1.0, values)}
    assert cite._error_bars([dataclasses.replace(runs[1], convergence=known), runs[2]]) == (
        "Numerical uncertainty over time steps in friction 1 is at most: overall 2 ms and latency 30 ms. "
        "Not converged: latency with time steps. It was not studied in friction 2."
    )


def test_tolerances_are_those_of_the_solvers_and_what_is_no_result_is_refused(tmp_path):
    assert cite._TOLERANCE == contact_step.TOLERANCE
    assert cite._TOLERANCE_FINITE == iteration._TOLERANCE
    with pytest.raises(ResultError, match="holds no finished run"):
        methods_and_papers(tmp_path)
    (tmp_path / "study.yaml").write_text("")
    with pytest.raises(ResultError, match=r"study\.yaml: is a file; needs a folder that fingerslip run wrote$"):
        methods_and_papers(tmp_path / "study.yaml")
