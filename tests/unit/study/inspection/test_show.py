"""Presets, studies and results as tables, two runs side by side, what moves results, and results for other programs."""

import re

import numpy as np
import pandas as pd
import pytest
import yaml
from scipy.io import loadmat

import fingerslip as fs
from fingerslip.specimens.choice import preset_names
from fingerslip.study.inspection.show import (
    diff_runs,
    export_result,
    predict_table,
    presets_table,
    show,
    write_sensitivities,
)
from fingerslip.study.inspection.views import FigureChoice, write_figure
from fingerslip.study.storage import reporting
from fingerslip.study.storage.reporting import read_run_values, value_rows
from fingerslip.study.storage.store import RunConvergence
from fingerslip.tables.table import Measured, Missing
from fingerslip.uncertainty import Convergence, Series
from fingerslip.vision.tracks import make_tracks, write_tracks
from unit.study.block import FRICTIONS, NAMES, block_values, finger_values, run_block


def rows_of(values, folder):
    """Return value, source and note by path of a study as it is shown."""
    path = folder / "x.yaml"
    path.write_text(yaml.safe_dump(values))
    (table,) = show(str(path))
    paths = [row[0] for row in table.rows]
    assert len(set(paths)) == len(paths), "no value may be shown twice"
    return {path: tuple(rest) for path, *rest in table.rows}


def finger(**more):
    changed = {"phalanx": {"variant": "scaled"}, "layers": {"skin_thickness": "1.4 mm"}}
    return finger_values(fingertip={"preset": "wang2014-2d", **changed}, **more)


def test_presets_and_materials_are_listed_and_shown_with_the_assumed_values_first():
    presets, materials = show()
    assert presets == presets_table()
    assert tuple(row[0] for row in presets.rows) == preset_names()
    assert "ROBOMECH" in str(presets.rows[0][1])
    assert tuple(row[0] for row in materials.rows) == fs.material_names()
    (pulp,), (finger) = show("pulp-relaxing"), show("wang2014-2d")[0]
    assert {row[0]: row[1:] for row in pulp.rows}["youngs_modulus"][:2] == ("85 kPa", "assumed")
    assert len(finger.rows) == len(fs.preset_table("wang2014-2d"))
    assert "no dimension" in finger.note
    for table in (pulp, finger):
        sources = [row[2] for row in table.rows]
        assert sources == sorted(sources, key=lambda source: source != "assumed")


def test_values_of_materials_that_ship_have_their_sources_in_a_study(tmp_path):
    values = finger(materials={"dermis": {"preset": "ecoflex-00-30", "density": "1080 kg/m^3"}})
    values["fingertip"]["materials"] = {"tissue": {"preset": "pulp-relaxing", "youngs_modulus": "90 kPa"}}
    rows = rows_of(values, tmp_path)
    assert rows["fingertip.materials.tissue.preset"][:2] == ("pulp-relaxing", "study file")
    assert rows["fingertip.materials.tissue.youngs_modulus"] == ("90 kPa", "study file", "preset: 85 kPa")
    assert rows["fingertip.materials.tissue.poisson_ratio"] == ("0.48", "wang2014", "Table 1, tissue")
    terms = rows["fingertip.materials.tissue.prony.1.time"]
    assert terms == ("70 ms", "assumed", "times of pawluk1999, equal shares assumed")
    assert rows["materials.dermis.preset"][:2] == ("ecoflex-00-30", "study file")
    assert rows["materials.dermis.terms.0.modulus"][:2] == ("10.55 kPa", "marechal2021")
    assert rows["materials.dermis.density"] == ("1080 kg/m^3", "study file", "preset: 1070 kg/m^3")
    assert rows["materials.dermis.poisson_ratio"][1] == "assumed"
    assert rows["fingertip.materials.dermis.density"][1] == "not used"
    first = [source for _, source, _ in rows.values()]
    assert first[: first.count("assumed")] == ["assumed"] * first.count("assumed")


def test_assumed_values_of_a_study_come_first_and_a_body_that_is_no_fingertip_has_no_preset(tmp_path):
    rows = rows_of(finger(), tmp_path)
    assumed = [source == "assumed" for _, source, _ in rows.values()]
    assert assumed == sorted(assumed, reverse=True)
    assert assumed[0]
    assert rows["mesh.contact_size"] == ("0.12 mm", "default", "")
    assert "time.end" not in rows, "nothing stands for what was not given"
    assert rows["fingertip.receptors.fa_ii_depth"] == ("3 mm", "not used", "no FA-II receptors are recorded")
    recorded = rows_of(finger(record={"receptors": ["FA-II"]}), tmp_path)
    assert recorded["fingertip.receptors.fa_ii_depth"][:2] == ("3 mm", "wang2014")
    rows = rows_of(block_values(), tmp_path)
    assert not [path for path in rows if path.startswith("fingertip")]
    assert rows["mesh.file"] == (str(tmp_path / "block.msh"), "study file", "")
    assert rows["supports.top"] == ("x, y", "study file", "")


def test_result_of_a_run_has_events_numbers_and_swept_values(finished):
    events, measures, swept = show(str(finished / SECOND))
    assert [row[0] for row in events.rows] == ["accumulated slip", "displacement", "acceleration peaks"]
    numbers = {row[0]: row[2] for row in measures.rows}
    assert numbers["friction over normal force at the end of the slide"] == pytest.approx(0.6)
    assert "numpy" in measures.note
    assert swept.rows == (("contact.friction_coefficient", "0.6"),)
    whole, _ = show(str(finished))
    assert [row[0] for row in whole.rows] == FRICTIONS


FIRST, _, SECOND = NAMES


def rows_by_name(table):
    return {str(row[0]): row[1:] for row in table.rows}


def test_two_runs_stand_beside_each_other_where_they_differ_and_a_run_does_not_from_itself(finished):
    values, results = diff_runs(finished / FIRST, finished / SECOND)
    assert rows_by_name(values) == {"contact.friction_coefficient": ("0.2", "0.6")}
    copies = {row.path: row.value for row in value_rows([read_run_values(finished / FIRST / "run.yaml")])}
    assert re.fullmatch(r"block\.msh \(content [0-9a-f]{8}\)", copies["mesh.file"])
    assert values.note == f"A: {finished / FIRST}; B: {finished / SECOND}."
    rows = rows_by_name(results)
    unit, first, second, difference = rows["overall slip (accumulated slip)"]
    assert unit == "s"
    assert (first, second) == (pytest.approx(1.5, abs=0.02), pytest.approx(1.7, abs=0.02))
    assert difference == pytest.approx(second - first, rel=1e-12)
    assert rows["latency (accumulated slip)"][0] == "ms"
    assert rows["friction over normal force at the end of the slide"][3] == pytest.approx(0.4)
    assert rows["records"][1:] == (401, 401, 0.0)
    none = Missing.NOT_DEFINED
    assert rows["smallest distance from the contact to a free edge"] == ("mm", none, none, None)
    assert results.marked == (), "without uncertainties no difference is clear"
    values, results = diff_runs(finished / FIRST, finished / FIRST)
    assert values.rows == ()
    assert "same values" in values.note
    assert {row[-1] for row in results.rows} <= {0.0, None}


def test_differences_beyond_the_uncertainties_of_both_stand_out_and_studies_may_have_other_values(
    finished, write_study, tmp_path, monkeypatch
):
    largest = {"slip.overall": 3e-3, "slip.incipient": 0.4, "slip_margin_incipient": 0.01}
    known = {
        key: Convergence(key, "", 0.0, {"alpha": Series("alpha", (0.0, -0.1), (0.0, change))})
        for key, change in largest.items()
    }
    with monkeypatch.context() as patch:
        patch.setattr(
            reporting.store, "read_convergences", lambda _, ids: {name: RunConvergence(name, "", known) for name in ids}
        )
        _, results = diff_runs(finished / FIRST, finished / SECOND)
    difference = rows_by_name(results)["overall slip (accumulated slip)"][3]
    assert isinstance(difference, Measured)
    assert difference.uncertainty == pytest.approx(3e-3 * 2**0.5)
    marked = {results.rows[number][0] for number in results.marked}
    assert "overall slip (accumulated slip)" in marked
    assert "incipient slip (accumulated slip)" not in marked
    assert "Bold: the difference" in results.note
    law = {"static_kinetic": {"static": 0.6, "kinetic": 0.5, "decay_speed": "1 mm/s"}}
    path = write_study(block_values() | {"contact": {"boundary": "bottom", "friction": law}, "sweep": {}}, name="drop")
    other = run_block(path)
    values, _ = diff_runs(finished / SECOND, other.folder / other.runs[0].name)
    rows = rows_by_name(values)
    assert rows["contact.friction_coefficient"] == ("0.6", Missing.NOT_DEFINED)
    assert rows["contact.friction.static_kinetic.decay_speed"] == (Missing.NOT_DEFINED, "1 mm/s")
    assert "title" not in rows


@pytest.mark.slow
def test_a_study_is_a_table_of_its_runs_and_a_run_the_tables_of_its_history(finished, tmp_path):
    written = export_result(finished, "parquet")
    assert written == finished / "export-parquet"
    frame = pd.read_parquet(written / "runs.parquet")
    assert frame["contact.friction_coefficient"].tolist() == FRICTIONS
    assert export_result(finished / FIRST, "csv", tmp_path / "out") == tmp_path / "out"
    assert "time_s" in (tmp_path / "out" / "series.csv").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda _: show("wang2013"), "show wang2013: is not there.*presets: wang2014-2d"),
        (lambda finished: show(str(finished.parent)), "holds no results of a study"),
        (lambda finished: show(str(finished / "gone.yaml")), r"gone\.yaml: is not there"),
        (lambda finished: export_result(finished.parent, "csv"), "holds no finished run"),
        (
            lambda finished: export_result(finished, "xls"),
            "export: --format: got 'xls', needs one of csv, json",
        ),
        (
            lambda finished: export_result(finished, "vtu"),
            f"is a study of 3 runs, vtu needs the folder of one of them: {FIRST}, .*; name .*block/{FIRST}",
        ),
        (lambda finished: diff_runs(finished, finished / SECOND), "needs the folder of one of its runs"),
    ],
)
def test_what_is_no_result_is_refused(finished, ask, message):
    with pytest.raises(fs.FingerslipError, match=message):
        ask(finished)


def test_a_study_of_one_run_is_written_as_its_run(finished, monkeypatch):
    runs = {finished: {"runs": {FIRST: ""}}}
    monkeypatch.setattr("fingerslip.study.inspection.show.read_manifest", lambda folder: runs.get(folder, {}))
    with pytest.raises(fs.ResultError, match="snapshots"):
        export_result(finished, "vtu")


RANGES = {"contact.friction_coefficient": [0.2, 0.4], "programme.0.press.depth": ["0.05 mm", "0.1 mm"]}
AT = ["contact.friction_coefficient=0.3", "programme.0.press.depth=0.07 mm"]


def folder_of(write_study, method, count):
    pytest.importorskip("SALib")
    sample = {"method": method, "count": count, "ranges": RANGES}
    path = write_study(block_values() | {"sweep": {}, "sample": sample})
    return run_block(path).folder


pytestmark = pytest.mark.usefixtures("reports", "simulated")


@pytest.mark.slow
def test_sobol_indices_are_written_with_their_figure(write_study):
    folder = folder_of(write_study, "saltelli", 4)
    (table,) = write_sensitivities(folder, "overall_slip", "auto")
    # The stand-in of the simulation knows friction alone.
    assert table.rows[0][0] == "friction coefficient"
    assert table.rows[1][1] == pytest.approx(0.0, abs=1e-12)
    assert (folder / "sensitivity-overall_slip-sobol.png").is_file()
    assert (folder / "sensitivity-overall_slip-sobol.csv").is_file()
    (linear,) = write_sensitivities(folder, "overall_slip", "linear")
    assert linear.title == "What moves overall slip (accumulated slip)"
    assert write_figure(folder, FigureChoice("sensitivity", form="png")).read_bytes().startswith(b"\x89PNG")
    with pytest.raises(fs.InputError, match="of: no regression of 'normal_force_max'"):
        write_sensitivities(folder, "normal_force_max", "linear")


@pytest.mark.slow
def test_elementary_effects_and_predictions(write_study):
    folder = folder_of(write_study, "morris", 6)
    (table,) = write_sensitivities(folder, "overall_slip", "auto")
    assert table.rows[0][0] == "friction coefficient"
    (row,) = predict_table(folder, AT, ["overall_slip"]).rows
    assert row[2] == pytest.approx(1.4 + 0.5 * 0.3, abs=0.2)
    with pytest.raises(fs.InputError, match=r"needs path=value, such as contact\.friction_coefficient=0\.5"):
        predict_table(folder, ["x"], ["overall_slip"])
    with pytest.raises(fs.InputError, match=r"time\.step: does not differ between the runs"):
        predict_table(folder, [*AT, "time.step=1 ms"], ["overall_slip"])


@pytest.mark.parametrize("target", [".", "tracks.nc"])
def test_tracks_are_exported_as_a_table(tmp_path, target):
    write_tracks(make_tracks(np.ones((2, 3, 2)), [0.0, 0.1], units="px"), tmp_path / "tracks.nc")
    for kind in ("csv", "json", "mat"):
        written = export_result(tmp_path / target, kind)
        assert written == tmp_path / f"export-{kind}"
    assert loadmat(written / "tracks.mat")["tracks"]["x_px"][0, 0].shape == (6, 1)


def test_a_file_that_is_no_result_is_refused(tmp_path):
    (tmp_path / "a.yaml").touch()
    with pytest.raises(
        fs.InputError, match=r"a\.yaml: is a file, needs the folder of a run or of a study, or tracks\.nc"
    ):
        export_result(tmp_path / "a.yaml", "mat")
