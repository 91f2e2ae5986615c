"""A study before it is run, and its stored results seen: figures, films, pictures and windows."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import yaml

import fingerslip as fs
from fingerslip.detect.synthetic import SyntheticSlide, synthetic_trial
from fingerslip.mesh.source import MeshFile
from fingerslip.parameters import from_mapping
from fingerslip.report.colours import EVENT_COLOURS
from fingerslip.report.content import RunSubject
from fingerslip.report.page.pictures import draw_of_study
from fingerslip.report.scene import viewer
from fingerslip.report.scene.options import SceneOptions
from fingerslip.report.scene.scene import field_limits
from fingerslip.results import RunResult, StudyResult, result_of, write_result
from fingerslip.study.definition.runs import plan_studies
from fingerslip.study.inspection import views
from fingerslip.study.inspection.check import check_plans, draw_specimen, fold_samples, save_mesh
from fingerslip.study.inspection.views import FigureChoice, view_result, write_figure
from fingerslip.study.running.cost import estimated_seconds
from fingerslip.tables.table import Table
from fingerslip.vision.video import read_frames, stated_rate
from unit.mesh.decks.texts import CAE, FEBIO
from unit.report.scenes import block_history
from unit.scans import mesh_of_a_scan, scan_values
from unit.study.block import NAMES, block_mesh, block_values, changed, run_block
from unit.synthetic import Process, make


def test_every_run_is_counted_with_its_size_and_what_is_too_coarse_is_said(write_study, monkeypatch):
    table = check_plans(plan_studies([write_study()]))
    # 9 x 5 nodes with two unknowns; 60 ms in steps of 2 ms.
    assert [row[:6] for row in table.rows] == [("block.yaml", name, "to do", 90, 30, 30) for name in NAMES]
    assert [row[6] for row in table.rows] == [estimated_seconds(90, 30)] * 3
    assert table.note.startswith(
        "3 runs, about 0.1 min of computing in one process. Meshing and the report come on top. "
        "Each process takes about 0.4 GB.\nWARNING: "
    )
    assert table.title == "Checked: no mistakes found, 3 warnings"
    assert "block.yaml: programme.0: the press takes 10 steps, and fewer than 25 are too coarse" in table.note
    monkeypatch.setattr("fingerslip.dynamics.step.sharing._WORTH_SHARING", {2: 0, 3: 0})
    fine = check_plans(plan_studies([write_study(block_values() | {"time": {"step": "0.5 ms"}})]))
    assert "steps" not in fine.note
    assert "3 of those to do are computed in 1 group with one matrix each." in fine.note
    reduced = check_plans(plan_studies([write_study(block_values() | {"dynamics": {"basis": "reduced"}})]))
    assert ". Meshing, reduced bases and the report come on top." in reduced.note


def test_a_force_on_a_section_is_told_as_that_on_a_finger(write_study):
    driven = {"contact": {**block_values()["contact"], "drive": {"mass": "5 g", "force": "2 N"}}}
    driven |= {"programme": [{"hold": {"duration": "60 ms"}}]}
    (said,) = (line for line in check_plans(plan_studies([write_study(block_values() | driven)])).note.splitlines()
               if ".drive: " in line)  # fmt: skip
    assert said.startswith("contacts.0.drive: 2 N on a section 1 mm deep is 2 N per mm: as much as 20 N on a finger")
    assert said.endswith("It acts at once, so that the plate rings: give it a ramp.")


@pytest.mark.parametrize(
    ("swept", "doubted"), [([0.3, 0, 6], "0, 0.3, 6"), ([0.3, 0.6], ""), ([3.0], "3"), ([0.0], "")]
)
def test_a_decimal_comma_between_frictions_is_doubted(swept, doubted, write_study):
    note = check_plans(
        plan_studies([write_study(block_values() | {"sweep": {"contact.friction_coefficient": swept}})])
    ).note
    assert (f"sweep: has friction coefficients of {doubted}: " in note) == bool(doubted)


@pytest.mark.parametrize(("scheme", "fewest"), [("hht_alpha", 30), ("quasi_static", 60)])
def test_steps_that_control_their_error_are_told_from_records(write_study, scheme, fewest):
    path = write_study(block_values() | {"time": {"step": "auto", "output": "2 ms", "scheme": scheme}})
    table = check_plans(plan_studies([path]))
    assert [row[4:6] for row in table.rows] == [(30, f"at least {fewest}")] * 3
    assert [row[6] for row in table.rows] == [estimated_seconds(90, fewest)] * 3
    assert table.note.startswith(
        "3 runs, at least 0.1 min of computing in one process. Meshing and the report come on top. "
        "Each process takes about 0.4 GB. With step: auto"
    )


@pytest.mark.usefixtures("simulated", "reports")
def test_time_is_that_of_what_is_to_do_and_the_first_mistake_of_any_study_is_told(write_study, tmp_path, monkeypatch):
    monkeypatch.setattr("fingerslip.study.inspection.check.estimated_seconds", lambda *_, **__: 60.0)
    assert check_plans(plan_studies([write_study()])).note.startswith("3 runs, about 3.0 min")
    run_block(write_study())
    path = write_study(block_values() | {"sweep": {"contact.friction_coefficient": [0.4, 0.8]}})
    monkeypatch.setattr("fingerslip.study.inspection.check.resolution_warnings", lambda runs: [f"coarse: {[*runs]}."])
    table = check_plans(plan_studies([path], tmp_path / "results"))
    assert [row[2] for row in table.rows] == ["finished", "to do"]
    assert table.note.startswith("2 runs, about 1.0 min")
    assert "WARNING: block.yaml: coarse: ['friction_coefficient-0.4']." in table.note
    good, bad = write_study(), write_study(changed("contact.boundary", "pulp"), name="bad")
    with pytest.raises(fs.InputError, match=r"bad\.yaml.*boundary 'pulp' not in mesh"):
        check_plans(plan_studies([good, bad]))


@pytest.mark.parametrize(
    ("path", "value", "message", "key"),
    [
        ("contact.boundary", "pulp", "contact.boundary: boundary 'pulp' not in mesh, it has: bottom, top", "boundary"),
        ("supports", {"nail": ["x"]}, "supports.nail: boundary 'nail' not in mesh, it has: bottom, top", "nail"),
        ("tractions", {"nail": ["0 Pa", "1 Pa"]}, "tractions.nail: boundary 'nail' not in mesh, it has", "nail"),
        ("materials", {"nail": block_values()["materials"]["block"]},
         "materials.nail: no such region in the mesh, it has: block", "nail"),
        ("record", {"sites": [{"kind": "b", "name": "a", "position": ["0 mm", "0 mm"], "region": "nail"}]},
         "record.sites.0: region 'nail' is not in the mesh, it has: block", "- kind"),
        ("sweep", {"contact.boundary": ["pulp"]}, r"= pulp\): contact.boundary: .*'pulp' not", "sweep"),
    ],
)  # fmt: skip
def test_a_name_that_the_mesh_lacks_is_refused_with_its_place_and_line(path, value, message, key, write_study):
    study = write_study(changed(path, value))
    lines = study.read_text(encoding="utf-8").splitlines()
    line = next(number for number, text in enumerate(lines, start=1) if text.strip().startswith(key))
    runs = r"" if path == "sweep" else r"^\S+block\.yaml: "  # the friction of a run has nothing to do with it
    with pytest.raises(fs.InputError, match=rf"{runs}{message}.*\(line {line + (path == 'sweep')}\)$"):
        check_plans(plan_studies([study]))


def test_mistakes_that_only_some_runs_have_say_which(write_study):
    moduli = {"materials.block.poisson_ratio": [0.3, 0.5]}
    with pytest.raises(fs.InputError, match=r"block\.yaml \(materials.block.poisson_ratio = 0.5\): materials.block.po"):
        check_plans(plan_studies([write_study(changed("sweep", moduli))]))
    meshes = {"contact.friction_coefficient": [0.2, 0.4], "mesh.file": ["block.msh", "other.msh"]}
    path, mesh = write_study(changed("sweep", meshes)), block_mesh()
    fs.write_mesh(dataclasses.replace(mesh, _boundaries={"top": mesh.boundaries["top"]}), path.with_name("other.msh"))
    with pytest.raises(fs.InputError, match=r"block\.yaml \(.*, mesh\.file = other\.msh\): contact.boundary: .* top "):
        check_plans(plan_studies([path]))
    gone = changed("mesh", {"file": "gone.msh"})
    with pytest.raises(fs.InputError, match=r"block\.yaml: mesh\.file: cannot read"):
        plan_studies([write_study(gone)])


SAMPLED = {"ranges": {"time.end": ["50 ms", "60 ms"]}, "choices": {"contact.boundary": ["bottom", "top"]}, "count": 2}
MOVED = {"nail": {"displacement": ["1 mm", "0 mm"], "ramp": {"times": ["0 s", "1 s"], "factors": [0, 1]}}}


@pytest.mark.parametrize(
    ("changes", "places"),
    [
        (
            {"materials.block.poisson_ratio": 0.5, "supports": {"bottom": ["x", "z"], "nail": ["y"]}},
            ["materials.block.poisson_ratio", "supports.bottom", "supports.nail"],
        ),
        ({"depth": 1, "contact.boundary": "pulp"}, ["contact.boundary", "depth"]),
        ({"depth": 1, "supports": {"nail": ["x"]}}, ["supports.nail", "depth"]),
        ({"depth": 1, "tractions": {"block": ["0 Pa", "1 Pa"]}}, ["tractions.block", "depth"]),
        ({"depth": 1, "supports": {"block": ["x"]}}, ["depth"]),
        ({"depth": 1, "mesh": {"file": "gone.msh"}}, ["depth"]),
        # What runs have in their place does not count.
        ({"depth": 1, "contact.boundary": "pulp", "sweep": {"contact.boundary": ["bottom"]}}, ["depth"]),
        ({"depth": 1, "contact.boundary": "pulp", "sweep": {"mesh.file": ["other.msh"]}}, ["depth"]),
        ({"depth": 1, "contact.boundary": "pulp", "sweep": {}, "sample": SAMPLED}, ["depth"]),
        (
            {"contact.boundary": "pulp", "initial_velocity": ["0 m/s"] * 3, "support_motions": MOVED},
            ["contact.boundary", "initial_velocity", "support_motions.nail"],
        ),
    ],
)
def test_mistakes_that_do_not_depend_on_each_other_are_told_together(changes, places, write_study):
    values = block_values()
    for path, value in changes.items():
        values = changed(path, value, values)
    with pytest.raises(fs.InputError) as caught:
        check_plans(plan_studies([write_study(values)]))
    assert sorted(error.where.rpartition(": ")[2] for error in caught.value.all) == sorted(places)


def test_meshes_of_studies_and_presets_are_written_under_the_names_that_are_asked_or_their_own(
    write_study, tmp_path, monkeypatch
):
    (table,) = save_mesh(str(write_study()), tmp_path / "copy.msh")
    mesh = fs.read_mesh(tmp_path / "copy.msh")
    assert mesh.p.shape[1] == 45
    assert set(mesh.boundaries) == {"bottom", "top"}
    assert table.note == "45 nodes, 32 cells; boundaries: bottom, top"
    # Rectangles of 1.25 mm by 1.25 mm.
    ((region, cells, jacobian, smallest, largest, aspect),) = table.rows
    assert (region, cells) == ("block", 32)
    assert (jacobian, smallest, largest, aspect) == pytest.approx((1.0, 90.0, 90.0, 1.0))
    monkeypatch.chdir(tmp_path)
    (table,) = save_mesh("wang2014-2d")
    mesh = fs.read_mesh(tmp_path / "meshes" / "wang2014-2d.msh")
    assert table.title == str(Path("meshes") / "wang2014-2d.msh")
    assert [row[0] for row in table.rows] == ["epidermis", "dermis", "tissue", "phalanx"]
    for row, known in zip(table.rows, fs.quality_table(mesh), strict=True):
        assert row[3:5] == pytest.approx(np.degrees([known.smallest_angle, known.largest_angle]))
    save_mesh(str(write_study(block_values() | {"sweep": {}}, name="mine")))
    assert (tmp_path / "meshes" / "mine.msh").is_file()


def test_mesh_of_a_scan_is_written_for_paraview_with_its_tables(tmp_path, monkeypatch):
    made = mesh_of_a_scan()
    for name in ("skin.stl", "phalanx.stl"):
        (tmp_path / name).write_text(name)
    monkeypatch.setattr("fingerslip.mesh.scan.build.mesh_scan", lambda _: made)
    monkeypatch.setattr("fingerslip.mesh.scan.build.SurfaceMesh.estimated_cells", lambda *_: 1e4)
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "finger.yaml"
    path.write_text(yaml.safe_dump(scan_values()), encoding="utf-8")
    tables = save_mesh(str(path))
    assert [table.title for table in tables][1:] == ["Distance of the mesh from the scan", "Repairs"]
    assert tables[0].title == str(Path("meshes") / "finger.vtu")
    back = fs.read_mesh(tmp_path / "meshes" / "finger.vtu")
    assert set(back.boundaries) == {"skin"}
    assert len(back.subdomains["tissue"]) == 5
    named = (tmp_path / "meshes" / "finger.regions.csv").read_text(encoding="utf-8").split()
    assert named == ["number,region", *(f"{number},{name}" for number, name in enumerate(back.subdomains))]


@pytest.mark.slow
def test_a_deck_is_drawn_and_what_it_has_besides_a_mesh_is_told(write_study, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("pad.feb").write_text(FEBIO, encoding="latin-1")
    quality, materials, rest = save_mesh("pad.feb", unit="mm")
    assert quality.title == str(Path("meshes") / "pad.feb.png")
    assert "metres" not in quality.note
    weightless = "1000 kg/m^3 for Tissue, whose density is none of a tissue"
    said = save_mesh("pad.feb", tmp_path / "pad.vtu")
    assert (said[0].note, said[1].note) == (quality.note, f"Assumed: {weightless}.")
    Path("silent.feb").write_text(FEBIO.replace("<units>mm-N-s</units>", ""), encoding="latin-1")
    silent = save_mesh("silent.feb", tmp_path / "pad.vtu")
    assert silent[0].note.endswith(
        "metres without --unit\nWARNING: it is 2 m large: say the unit of its lengths, such as --unit mm."
    )
    assert silent[1].note.startswith("Assumed: the file names no units, so moduli are taken in N/m^2; 1000 kg/m^3")
    assert Path(quality.title).read_bytes().startswith(b"\x89PNG")
    # What is printed goes into a study as it is.
    laws = yaml.safe_load("\n".join([materials.columns[0].name, *(line for (line,) in materials.rows)]))["materials"]
    read = fs.read_materials("pad.feb", "mm")
    assert {name: from_mapping(type(read[name]), law) for name, law in laws.items()} == read
    assert ("<Control>",) in rest.rows
    (quality, rest) = save_mesh(write_deck(tmp_path), tmp_path / "copy.vtu", "mm")
    assert list(fs.read_mesh("copy.vtu").subdomains) == ["Gel", "Outer layer", "Half"]
    assert rest.title == "Left out of the file"
    assert ("*Material",) in rest.rows
    # Its regions share cells.
    assert MeshFile("deck.inp").inspect().suffix == ".vtu"
    assert MeshFile("pad.feb").inspect().suffix == ".vtu"
    with pytest.raises(fs.MeshError, match=r"region 'Half' shares cells with another, .*; write a \.vtu"):
        save_mesh("deck.inp", tmp_path / "copy.msh")
    (table,) = save_mesh(str(write_study()), tmp_path / "study.svg")
    assert (table.title, Path("study.svg").read_bytes()[:5]) == (str(tmp_path / "study.svg"), b"<?xml")


@pytest.mark.parametrize(
    ("kinematics", "swept", "is_said"),
    [("small", [], True), ("finite", [], False), ("small", ["finite"], False), ("finite", ["small", "finite"], True)],
)
def test_a_deck_of_large_strain_in_a_study_of_small_strain_is_a_warning(tmp_path, kinematics, swept, is_said):
    (tmp_path / "pad.feb").write_text(FEBIO, encoding="latin-1")
    law = {"law": "neo_hookean", "youngs_modulus": "50 kPa", "poisson_ratio": 0.45, "density": "1000 kg/m^3"}
    values = {
        "mesh": {"file": "pad.feb"},
        "materials": {"Tissue": law, "Skin": law},
        "formulation": "solid",
        "supports": {"Fixed": ["x", "y", "z"]},
        "kinematics": kinematics,
        "time": {"step": "1 ms", "end": "10 ms"},
        "sweep": {"kinematics": swept} if swept else {},
    }
    (tmp_path / "pad.yaml").write_text(yaml.safe_dump(values), encoding="utf-8")
    note = check_plans(plan_studies([tmp_path / "pad.yaml"])).note
    assert ("pad.yaml: kinematics: is small, and FEBio computes at large strain: write" in note) == is_said


def write_deck(folder):
    (folder / "deck.inp").write_text(CAE)
    return str(folder / "deck.inp")


@pytest.mark.slow
def test_preset_and_study_are_drawn(tmp_path):
    study = tmp_path / "study.yaml"
    study.write_text("fingertip: {preset: wang2014-2d}\ntime: {step: 5 ms, end: 10 ms}\n", encoding="utf-8")
    for number, target in enumerate(("wang2014-3d", "tactip-ridged-3d", "gelsight-mini-2d", str(study))):
        picture = tmp_path / "new" / f"{number}.png"
        draw_specimen(target, picture)
        assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("make", "target", "message"),
    [
        (save_mesh, "wang2014-2e a.msh", r"mesh wang2014-2e: is neither .*; did you mean 'wang2014-2d'"),
        (save_mesh, "nix a.msh", "mesh nix: is neither a preset nor a file that is there, .*; presets: wang2014-2d"),
        (save_mesh, "pad.inp a.msh", "mesh pad.inp: is no file that is there, .* or of a mesh"),
        (save_mesh, ". a.msh", "mesh .: is a folder, needs the name of a preset or the path of a study"),
        (lambda *paths: save_mesh(*paths, "inch"), "file a.png", "unit: got 'inch', needs one of m, cm, mm, um"),
        (
            lambda *paths: save_mesh(*paths, "mm"),
            "block.yaml a.msh",
            "got 'mm' beside block.yaml, belongs to mesh files",
        ),
        (lambda *paths: save_mesh(*paths, "mm"), "wang2014-2d a.msh", "got 'mm' beside wang2014-2d"),
        (save_mesh, "block.yaml file/copy.msh", r"file/copy\.msh: cannot be written"),
        (draw_specimen, "wang2014-3d finger.doc", r"needs a file that ends in \.png, \.svg, \.pdf"),
        (draw_specimen, "nobody finger.png", "preset: 'nobody' is not known"),
    ],
)
def test_what_cannot_be_meshed_or_drawn_is_refused(write_study, monkeypatch, make, target, message):
    monkeypatch.chdir(write_study().parent)
    Path("file").write_text("")
    name, path = target.split()
    with pytest.raises(fs.FingerslipError, match=message):
        make(name, Path(path))


@pytest.mark.parametrize(("form", "start"), [("pdf", b"%PDF"), ("svg", b"<?xml"), ("png", b"\x89PNG")])
def test_a_figure_of_a_study_or_of_a_run_stands_beside_its_results(finished, form, start):
    written = write_figure(finished, FigureChoice("latency", form=form))
    assert written == finished / f"latency.{form}"
    assert written.read_bytes().startswith(start)
    if form == "pdf":
        assert write_figure(finished, FigureChoice("forces", run=RUN, style="slides")).name == f"forces-{RUN}.pdf"


def test_the_colours_of_fields_have_one_scale_over_the_runs_of_a_study(tmp_path, monkeypatch):
    history, tops = block_history("Q4"), []
    for name, factor in (("a", 0.5), ("b", 1.0)):
        (tmp_path / name).mkdir()
        run = history.assign(snapshot_von_mises=factor * history["snapshot_von_mises"])
        fs.write_history(run, tmp_path / name / "history.nc")
        (tmp_path / name / "run.yaml").write_text("title: block\n", encoding="utf-8")
        write_result(result_of(run, name, {}), tmp_path / name)
    monkeypatch.setattr(
        views, "read_manifest", lambda folder: {"runs": {"a": {}, "b": {}}} if folder == tmp_path else {}
    )
    monkeypatch.setattr(views, "_save", lambda *_: tops.append(field_limits(run, SceneOptions())[1]))
    run = history.assign(snapshot_von_mises=0.5 * history["snapshot_von_mises"])
    for target, choice in ((tmp_path, FigureChoice("deformed", run="a")), (tmp_path / "a", FigureChoice("deformed"))):
        write_figure(target, choice)
    write_figure(tmp_path, FigureChoice("energy", run="a"))
    (tmp_path / "b" / "history.nc").write_bytes(b"damaged")
    write_figure(tmp_path, FigureChoice("deformed", run="a"))
    assert tops == pytest.approx([2.0 * tops[2]] * 2 + [tops[2]] * 2), "of the runs that can be read"


def test_a_composed_figure_of_a_study_with_several_runs_says_which_it_shows(finished, monkeypatch):
    drawn = []
    monkeypatch.setattr(views, "_save", lambda draw, path, _: drawn.append((path.name, draw.args[-1].title)))
    write_figure(finished, FigureChoice("composed"))
    write_figure(finished, FigureChoice("composed", run=RUN), finished / "other.pdf")
    write_figure(finished / RUN, FigureChoice("composed"))
    write_figure(finished, FigureChoice("spikes"))
    assert drawn == [
        (f"composed-{MIDDLE}.pdf", "friction coefficient 0.4"),
        ("other.pdf", "friction coefficient 0.2"),
        ("composed.pdf", ""),
        (f"spikes-{MIDDLE}.pdf", "friction coefficient 0.4"),
    ]


def test_what_the_detector_finds_in_the_markers_of_a_run_stands_beside_its_events(monkeypatch):
    tracks = synthetic_trial("slide", SyntheticSlide(travel=4e-3)).tracks
    tracks = tracks.assign(position=(1e-4 * tracks["position"]).assign_attrs(units="m"))
    monkeypatch.setattr(views, "marker_tracks", lambda _: tracks)
    monkeypatch.setattr(views, "phase_times", lambda *_: [(0.0, 1.0)])
    truth = fs.SlipEvents(incipient=1.2, overall=2.0)
    figure = views._detector_figure(RunSubject(make(Process()), fs.Events(slip=truth)))
    assert figure.axes[0].get_xlim()[1] < 3.0, "a while after overall slip"
    assert [axes.get_ylabel() for axes in figure.axes] == ["displaced [mm]", "left pattern [%]", "sure of slip [%]"]
    assert 0.1 < max(figure.axes[0].lines[0].get_ydata()) < 10.0
    keys = [text.get_text() for text in figure.legends[0].get_texts()]
    assert keys == ["slip begins", "gross slip begins"], "no press was seen"
    lines = {float(line.get_xdata()[0]) for line in figure.axes[-1].lines if line.get_color() in EVENT_COLOURS.values()}
    assert lines == {1.2, 2.0}
    assert [text.get_text() for text in figure.axes[0].texts][-2:] == ["incipient", "overall"]


def test_listed_are_the_kinds_that_a_study_has_something_for(finished, monkeypatch):
    monkeypatch.setattr(views, "_save", lambda *_: None)
    listed = [line.partition(":")[0] for line in views.kinds_text(finished).splitlines()]
    assert {"latency", "events", "slip-maps", "composed", "forces", "film"} <= {*listed}
    refused = {line.partition(":")[0] for line in views.kinds_text().splitlines()} - {*listed}
    assert {"sensitivity", "posterior", "fit", "reaction-map", "cut", "markers", "detector", "roc"} <= refused
    for kind in listed[:-1]:
        write_figure(finished, FigureChoice(kind))


def test_times_of_samples_stand_over_a_sampled_value_and_are_not_joined(monkeypatch, tmp_path):
    path, moduli = "materials.skin.youngs_modulus", range(60, 20, -4)
    runs = tuple(
        RunResult(
            f"sample-{number}",
            {"sample": number},
            fs.Events(slip=fs.SlipEvents(incipient=1.0, overall=1.0 + 1e-3 * modulus)),
            sampled={path: f"{modulus} kPa"},
        )
        for number, modulus in enumerate(moduli)
    )
    study = StudyResult(tmp_path, (), runs, ranges={path: ("20 kPa", "60 kPa")})
    monkeypatch.setattr(views, "read_manifest", lambda _: {"runs": {run.name: {} for run in runs}})
    monkeypatch.setattr(views, "read_results", lambda _: study)
    monkeypatch.setattr(views, "slide_starts", lambda _: {})
    (axes,) = draw_of_study("latency", views._study_subject(tmp_path, FigureChoice("latency"))).axes
    (line,) = axes.lines
    np.testing.assert_allclose(line.get_data(), [moduli[::-1]] * 2)
    assert (line.get_linestyle(), axes.get_xlabel()) == ("None", "skin Young's modulus [kPa]")


RUN, MIDDLE = "friction_coefficient-0.2", "friction_coefficient-0.4"


@pytest.mark.parametrize(
    ("target", "choice", "output", "words"),
    [
        ("", FigureChoice("nothing"), None, "--kind: got 'nothing', needs one of latency"),
        (
            "",
            FigureChoice("latency", style="poster"),
            None,
            "--style: got 'poster', needs one of page, paper, column, slides",
        ),
        ("", FigureChoice("latency", form="gif"), None, "--format: got 'gif', needs one of pdf, svg, png"),
        ("", FigureChoice("latency", path="mesh.size"), None, "--over: 'mesh.size' is not swept"),
        (
            "",
            FigureChoice("forces", path="x"),
            None,
            "--over: does not fit --kind forces, needs --kind latency",
        ),
        ("", FigureChoice("spikes", times=("1 s",)), None, "--time: got 1 for spikes, needs one of composed"),
        ("", FigureChoice("slip-maps", times=("1 s",)), None, "--time: got 1 for slip-maps, needs one of"),
        ("", FigureChoice("forces", run="x"), None, "--run: 'x' is not there"),
        ("", FigureChoice("reaction-map"), None, "has nothing, needs results of a study with the block reaction"),
        ("", FigureChoice("latency", run="x"), None, "--run: got 'x' with --kind latency, needs a kind that shows one"),
        ("..", FigureChoice("latency"), None, "holds no study"),
        (RUN, FigureChoice("composed", times=("99 s",)), None, "--time: got 99 s, needs a time of the run, 0 to"),
        (RUN, FigureChoice("forces", run="x"), None, "--run: got 'x' with the folder of a run, needs the folder of"),
        (RUN, FigureChoice("detector"), None, "has no hold before its slide, needs markers at rest first; write hold"),
        (
            RUN,
            FigureChoice("composed", options={"scalar": "strain"}),
            None,
            "figure: --field: got 'strain', needs one of",
        ),
        (
            RUN,
            FigureChoice("forces", film={"size": (480, 270)}),
            None,
            "--size: does not fit --kind forces, needs --kind film",
        ),
        ("", FigureChoice("latency", film={"frame_rate": 5.0}), None, "--rate: does not fit --kind latency"),
        (RUN, FigureChoice("film"), "film.avi", "--output: got '.*film.avi', needs a name that ends in .mp4"),
    ],
)
def test_wrong_choices_say_what_is_allowed(finished, target, choice, output, words):
    with pytest.raises(fs.FingerslipError, match=words):
        write_figure(finished / target, choice, output and finished / output)
    assert list(finished.glob("film*")) == []


@pytest.mark.slow
def test_a_film_is_an_mp4_of_the_asked_size_and_rate(tmp_path):
    history = block_history("Q4")
    fs.write_history(history, tmp_path / "history.nc")
    (tmp_path / "run.yaml").write_text("title: block\n", encoding="utf-8")
    write_result(result_of(history, "run", {}), tmp_path)
    film = {"size": (480, 270), "frame_rate": 10.0, "seconds": 0.5}
    written = write_figure(tmp_path, FigureChoice("film", film=film))
    frames = list(read_frames(written))
    assert written.name == "film.mp4"
    assert (len(frames), frames[0].shape, stated_rate(written)) == (5, (270, 480), 10.0)
    assert views.film_options("640x480") == {"size": (640, 480)}
    assert views.film_options(rate=0.0) == {"frame_rate": 0.0}
    with pytest.raises(fs.InputError, match="got '640', needs a width and a height"):
        views.film_options("640")
    assert "deformed: " in views.kinds_text()
    assert "deformed: " in views.kinds_text(tmp_path)
    with pytest.raises(fs.ResultError, match="nothing: is not there; run the study again"):
        views.kinds_text(tmp_path / "nothing")


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    (folder / "run").mkdir()
    fs.write_history(block_history(), folder / "run" / "history.nc")
    return folder


@pytest.mark.parametrize("target", ["", "run", "run/history.nc"])
def test_a_run_is_found_in_its_study_its_folder_and_its_file(study, target, monkeypatch):
    drawn, picture = [], Path("p.png")
    monkeypatch.setattr(viewer, "save_still", lambda *asked: drawn.append(asked))
    assert view_result(study / target, {"scalar": "region"}, time="50 ms", screenshot=picture) == (picture,)
    ((history, *asked, options),) = drawn
    assert asked == [picture, pytest.approx(0.05)]
    assert (history.sizes["snapshot_time"], options.scalar) == (3, "region")


def test_of_several_runs_one_has_to_be_chosen_and_a_folder_without_runs_is_refused(study, tmp_path):
    with pytest.raises(fs.ResultError, match="holds no run"):
        view_result(tmp_path, {}, screenshot=tmp_path / "p.png")
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "history.nc").write_bytes((study / "run" / "history.nc").read_bytes())
    with pytest.raises(fs.InputError, match="holds 2 runs, needs one of a, b"):
        view_result(tmp_path, {}, screenshot=tmp_path / "p.png")


@pytest.mark.parametrize(
    ("options", "time", "message"),
    [({"scalar": "stress"}, "", "view: --field"), ({"cut": "q"}, "", "view: --cut"), ({}, "1.2", "view: --time")],
)
def test_wrong_options_are_refused_before_anything_is_drawn(study, tmp_path, options, time, message):
    with pytest.raises(fs.InputError, match=message):
        view_result(study, options, time=time, screenshot=tmp_path / "p.png")
    assert list(tmp_path.iterdir()) == []


HISTORY = xr.Dataset(coords={"time": [0.0, 0.5, 1.0]})


@pytest.mark.parametrize(
    ("given", "seconds"),
    [
        *(("0 s", 0.0), ("500 ms", 0.5), ("1 s", 1.0)),
        *(("1.1 s", "0 to 1 s"), ("-1 ms", "0 to 1 s"), ("1", "unit"), ("1 mm", "s")),
    ],
)
def test_a_time_has_a_unit_and_lies_in_the_run(given, seconds):
    if isinstance(seconds, float):
        assert views.time_of_run(HISTORY, given, "view: --time") == pytest.approx(seconds)
    else:
        with pytest.raises(fs.InputError, match=f"^view: --time: .*{seconds}"):
            views.time_of_run(HISTORY, given, "view: --time")


def test_samples_that_cost_the_same_are_one_row():
    row = "a.yaml", "to do", 10, 20, 20, 1.0
    names = [f"sample-{number}" for number in range(1, 31)]
    rows = [(row[0], name, *row[1:]) for name in (*names, "mu-0.2", "mu-0.3")]
    dear = ("a.yaml", "sample-31", "to do", 99, 20, 20, 1.0)
    folded = fold_samples(Table("", (), (*rows, dear), ""))
    assert [row[1] for row in folded.rows] == ["30 runs: sample-1 to sample-30", "mu-0.2", "mu-0.3", "sample-31"]
    fast = [("a.yaml", name, "to do", 10, 20, 20, time) for name, time in (("a", 0.4), ("b", 0.0), ("c", 1.2))]
    assert [row[-1] for row in fold_samples(Table("", (), tuple(fast), "")).rows] == ["under 1", 0.0, 1.2]
