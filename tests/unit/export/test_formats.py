"""Histories as tidy tables, in every format, and as MATLAB files."""

import json
import shutil
import subprocess
import sys
from functools import partial

import numpy as np
import pandas as pd
import pytest
from scipy.io import loadmat

import fingerslip as fs
from fingerslip.afferents.model import CAVEAT
from fingerslip.errors import InputError, ResultError
from fingerslip.export.formats import export_tables, result_tables, write_history_mat, write_table_mat
from fingerslip.history import VARIABLES
from fingerslip.results import FORMATS


def test_every_record_is_in_a_table_with_a_row_for_a_moment_and_a_site(pushed):
    tables = fs.history_tables(pushed)
    assert list(tables) == ["series", "sites", "contact", "counterfaces", "supports"]
    columns = " ".join(column for frame in tables.values() for column in frame.columns)
    missing = [name for name, known in VARIABLES.items() if known.dims[0] == "time" and name not in columns]
    assert all(name.startswith("rigid_body") for name in missing)
    sites = fs.history_tables(pushed)["sites"]
    assert len(sites) == pushed.sizes["time"] * 2
    low = sites[sites["site"] == "low"]
    assert set(low["site_region"]) == {"bulk"}
    np.testing.assert_array_equal(low["displacement_y_m"], pushed["displacement"].values[:, 1, 1])
    np.testing.assert_array_equal(low["stress_yy_Pa"], pushed["stress"].sel(stress_component="yy").values[:, 1])
    np.testing.assert_array_equal(low["time_s"], pushed["time"].values)


def test_units_are_in_the_names_and_beside_the_table_and_sums_of_the_contact_table_are_the_forces(pushed):
    tables = fs.history_tables(pushed)
    contact, units = tables["contact"], tables["contact"].attrs["units"]
    assert tables["counterfaces"].attrs["units"]["counterface_velocity_x_m_per_s"] == "m/s"
    assert "contact_state" in contact.columns
    assert "contact_state" not in units
    assert units["contact_area_m2"] == "m^2"
    places = contact.query("time_s == 0")[["contact_position_x_m", "contact_position_y_m"]]
    np.testing.assert_array_equal(places, pushed["contact_position"].values)
    normal = (contact["normal_traction_Pa"] * contact["contact_area_m2"]).groupby(contact["time_s"]).sum()
    assert normal.to_numpy() == pytest.approx(tables["counterfaces"]["counterface_force_y_N"].to_numpy(), rel=1e-9)


def test_times_of_slip_have_text_beside_them_even_without_any_and_spikes_are_lost_with_an_error_alone(pushed):
    tables = result_tables(pushed.isel(time=slice(3)))
    assert (list(tables), len(tables["events"])) == (["events"], 0)
    assert pd.api.types.is_string_dtype(tables["events"]["event"].dtype)
    felt = pushed.assign_coords(site_kind=("site", ["SA-I", "SA-I"]))
    tables = result_tables(felt)
    assert list(tables) == ["events", "spikes", "afferents"]
    afferents = tables["afferents"]
    assert afferents[["site", "kind"]].to_numpy().tolist() == [["deep", "SA-I"], ["low", "SA-I"]], "silent or not"
    np.testing.assert_array_equal(afferents[["site_position_x_m", "site_position_y_m"]], pushed["site_position"].values)
    assert afferents["spikes"].sum() == len(tables["spikes"])
    assert afferents.attrs["units"] == {"site_position_x_m": "m", "site_position_y_m": "m"}
    (note,) = set(afferents["note"])
    assert note.startswith("SA-I (101 Hz) respond to more than the ")
    assert note.endswith(f"; {CAVEAT}")
    # Ten times as fast the records resolve what SA-I respond to, but not FA-I.
    fast = pushed.assign_coords(site_kind=("site", ["SA-I", "FA-I"]), time=pushed["time"] / 10.5)
    notes = result_tables(fast)["afferents"].set_index("kind")["note"]
    assert notes["SA-I"] == CAVEAT
    assert notes["FA-I"].startswith("FA-I (117 Hz) respond to more than the 105 Hz ")
    unknown = felt.assign(strain=np.nan * felt["strain"])
    with pytest.raises(ResultError, match="is not known at some receptor"):
        result_tables(unknown)


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.filterwarnings("ignore::fingerslip.afferents.signals.BandwidthWarning")
def test_every_format_leaves_a_folder(pushed, tmp_path, kind):
    if kind == "nwb":
        pytest.importorskip("pynwb")
        pushed = pushed.assign_coords(site_kind=("site", ["SA-I", "FA-I"]))
    folder = fs.export_history(pushed, tmp_path / kind, kind)
    assert any(folder.iterdir())
    assert [path.name for path in tmp_path.iterdir()] == [kind]


@pytest.mark.parametrize(
    ("kind", "read"), [("csv", partial(pd.read_csv, keep_default_na=False)), ("parquet", pd.read_parquet)]
)
def test_tables_read_back_the_same(pushed, tmp_path, kind, read):
    folder = fs.export_history(pushed, tmp_path / kind, kind)
    for name, frame in fs.history_tables(pushed).items():
        pd.testing.assert_frame_equal(read(folder / f"{name}.{kind}"), frame, check_dtype=False)


def test_only_named_tables_are_written(pushed, tmp_path):
    for name in ("events", "series"):
        folder = fs.export_history(pushed, tmp_path / name, "csv", only=[name])
        assert {path.name for path in folder.iterdir()} == {f"{name}.csv", "fingerslip-export.json"}
    with pytest.raises(InputError, match="only: got 'spike', needs some of events, "):
        fs.export_history(pushed, tmp_path / "out", "csv", only=["events", "spike"])


def test_json_has_columns_units_and_null(tmp_path):
    frame = pd.DataFrame({"run": ["a"], "overall_s": [float("nan")]})
    frame.attrs["units"] = {"overall_s": "s"}
    export_tables({"runs": frame}, tmp_path / "json", "json")
    found = json.loads((tmp_path / "json" / "runs.json").read_text(encoding="utf-8"))
    assert found == {"units": {"overall_s": "s"}, "columns": {"run": ["a"], "overall_s": [None]}}


def test_what_cannot_be_exported_leaves_nothing(pushed, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    for history, kind, message in (
        (pushed, "xls", "format: got 'xls', needs one of csv, json, mat, nwb, parquet, vtu"),
        (pushed, "parquet", r'format: pyarrow is missing .*, parquet needs it; pip install "fingerslip\[export\]"'),
        (pushed.isel(snapshot_time=slice(0, 0)), "vtu", "has no snapshots of the whole mesh; write record: "),
    ):
        with pytest.raises((InputError, ResultError), match=message):
            fs.export_history(history, tmp_path / "out", kind)
    assert list(tmp_path.iterdir()) == []


def test_an_export_is_replaced_and_nothing_else(pushed, tmp_path):
    folder = tmp_path / "out"
    fs.export_history(pushed, folder, "csv")
    fs.export_history(pushed, folder, "mat")
    assert sorted(path.name for path in folder.iterdir()) == ["events.mat", "fingerslip-export.json", "history.mat"]
    own = tmp_path / "mine"
    own.mkdir()
    (own / "thesis.txt").write_text("years", encoding="utf-8")
    for target in (own, own / "thesis.txt"):
        with pytest.raises(InputError, match="needs a"):
            fs.export_history(pushed, target, "csv")
    assert (own / "thesis.txt").read_text(encoding="utf-8") == "years"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mine", "out"]


COUNTED = ("contact_node", "contact_counterface", "cell_nodes", "cell_region")


def test_histories_and_tables_read_back_with_units_under_names_that_matlab_takes(pushed, tmp_path):
    write_history_mat(pushed, tmp_path)
    history = loadmat(tmp_path / "history.mat", simplify_cells=True)["history"]
    np.testing.assert_array_equal(history["displacement"], pushed["displacement"].values)
    np.testing.assert_array_equal(history["contact_state"], pushed["contact_state"].values)
    assert list(history["dimensions"]["displacement"]) == ["time", "site", "component"]
    assert (history["units"]["stress"], history["meaning"]["time"]) == ("Pa", "time")
    assert {name for name, meaning in history["meaning"].items() if "counted from 1" in meaning} == set(COUNTED)
    for name in COUNTED:
        np.testing.assert_array_equal(np.ravel(history[name]), pushed[name].values.ravel() + 1, "as in MATLAB")
        assert "counted from 0" in pushed[name].attrs["long_name"]
    assert not any("counted from 0" in meaning for meaning in history["meaning"].values())
    assert list(history["site"]) == ["deep", "low"]
    assert history["attributes"]["element"] == pushed.attrs["element"]
    frame = pd.DataFrame({"run": ["a", "b"], "contact.friction_coefficient": [0.2, np.nan]})
    frame.attrs["units"] = {"contact.friction_coefficient": "1"}
    write_table_mat(frame, tmp_path / "runs.mat")
    runs = loadmat(tmp_path / "runs.mat", simplify_cells=True)["runs"]
    assert list(runs["run"]) == ["a", "b"]
    np.testing.assert_array_equal(runs["contact_friction_coefficient"], [0.2, np.nan])
    assert runs["units"]["contact_friction_coefficient"] == "1"


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("octave") is None, reason="needs Octave")
def test_octave_reads_a_history(pushed, tmp_path):
    write_history_mat(pushed, tmp_path)
    code = (
        "load('history.mat'); printf('%.17g|%s|%s|%s|%d', history.displacement(end, 1, 2), history.units.stress, "
        "history.site{2}, history.attributes.element, size(history.contact_state, 2));"
    )
    command = ["octave", "--no-gui", "--quiet", "--eval", code]
    printed = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    number, *words = printed.split("|")
    assert float(number) == float(pushed["displacement"].values[-1, 0, 1])
    assert words == ["Pa", "low", pushed.attrs["element"], str(pushed.sizes["contact_node"])]
