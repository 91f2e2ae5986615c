"""A study fitted to a measurement: a truth comes back, the files are there, and mistakes are told before and after."""

from __future__ import annotations

import contextlib
import dataclasses
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import fingerslip as fs
from fingerslip.report.content import ReportContent
from fingerslip.report.figures import style as figures
from fingerslip.report.page.samples import sample_sections
from fingerslip.results import RunResult, StudyResult, stored_fit
from fingerslip.sampling import posterior as chains
from fingerslip.sampling.curves import Measurement, curves_of
from fingerslip.slip.events import Events, SlipEvents
from fingerslip.storage.files import digest, write_json
from fingerslip.study import fit as fit_module
from fingerslip.study.definition.spec import read_study
from fingerslip.study.inspection.cite import methods_and_papers
from fingerslip.study.inspection.views import FigureChoice, write_figure
from fingerslip.study.storage.reporting import read_results
from fingerslip.tables.table import Missing, texts
from unit.study.block import block_values, changed

MODULUS, FRICTION = "materials.block.youngs_modulus", "contact.friction_coefficient"
TRUTH = {MODULUS: "110 kPa", FRICTION: 0.45}
RANGES: dict[str, Any] = {MODULUS: ["60 kPa", "160 kPa"], FRICTION: [0.2, 0.8]}
FIT = {"over": "displacement", "columns": {"normal_force": "0.2 mN", "tangential_force": "0.2 mN"}}
DEVIATION, DISTANCE = 2e-4, 0.5


def values(**changes: Any) -> dict[str, Any]:
    sample = {"count": 20, "ranges": RANGES}
    programme = [
        {"press": {"depth": "0.1 mm", "speed": "5 mm/s"}},
        {"slide": {"distance": f"{DISTANCE} mm", "speed": "5 mm/s"}},
    ]
    return block_values() | {"sweep": {}, "programme": programme, "sample": sample, "fit": FIT} | changes


def measure(study: Path, data: Path, seed: int = 1) -> Path:
    """Write what a run with the truth would measure."""
    truth = fs.Study(study, changes=TRUTH | {"fit": None, "sample": None}, name="truth")
    history = next(iter(truth.run(data.parent / "truth", workers=1).histories()))[1]
    ways, generator = np.linspace(0.0, 1e-3 * DISTANCE, 21), np.random.default_rng(seed)
    empty = Measurement("displacement", ways, tuple(FIT["columns"]), np.zeros((2, 21)), np.ones((2, 1)))  # type: ignore[arg-type]
    curves = curves_of(history, empty, "truth") + DEVIATION * generator.standard_normal((2, 21))
    columns = {"displacement [mm]": 1e3 * ways, "normal_force [mN]": 1e3 * curves[0], "tangential_force [N]": curves[1]}
    pd.DataFrame(columns).to_csv(data, index=False)
    return data


@pytest.mark.slow
def test_a_truth_comes_back_within_its_interval(
    write_study: Callable[..., Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    reports: list[Any],
    caplog: pytest.LogCaptureFixture,
) -> None:
    pytest.importorskip("emcee")
    monkeypatch.setattr(figures, "_DOTS_PER_INCH", 20)
    study = write_study(values(derived={"way": "overall_slip * slide_speed"}))
    data = measure(study, tmp_path / "data.csv")
    reports.clear()
    posterior = fs.fit(study, data, results_dir=tmp_path / "results", workers=1)
    assert len(reports) == 2, "after the runs, and with the fit"
    summary = posterior.summary.set_index("value")
    for name, truth in (("block Young's modulus", 110.0), ("friction coefficient", 0.45)):
        low, high, left = summary.loc[name, ["95 % from", "95 % to", "share of prior left"]]
        assert low < truth < high
        assert left < 0.2
    assert 0.5 < summary.loc["chi-squared per point", "median"] < 1.6
    assert "WARNING" not in posterior.tables[0].note
    predictions = posterior.predictions.set_index("output")
    truth_events = fs.find_events(fs.read_history(tmp_path / "truth" / "truth" / "run" / "history.nc"))
    low, high = predictions.loc["overall slip (accumulated slip)", ["95 % from", "95 % to"]]
    assert low < truth_events.overall < high
    assert "way" in predictions.index
    assert list(posterior.samples) == [f"{MODULUS} [kPa]", FRICTION, "discrepancy [standard deviations]"]
    modulus, samples = summary.loc["block Young's modulus"], posterior.samples.iloc[:, 0]
    intervals = modulus[["median", "68 % from", "68 % to", "95 % from", "95 % to"]].tolist()
    # The file has 2000 of the samples, so the ends of their intervals differ a little.
    assert intervals == pytest.approx(np.percentile(samples, (50.0, 16.0, 84.0, 2.5, 97.5)), abs=0.3 * samples.std())
    assert modulus["share of prior left"] == pytest.approx((intervals[2] - intervals[1]) / (0.68 * 100.0))
    methods, _, entries = methods_and_papers(posterior.folder.parent).partition("\n\n")
    low, high = modulus[["95 % from", "95 % to"]]
    assert f"block Young's modulus {modulus['median']:.4g} kPa ({low:.4g} to {high:.4g}), friction" in methods
    assert "Young's modulus 60 kPa to 160 kPa" in methods, "the range, not one of its samples"
    assert "foreman2013" in entries
    assert f"chi-squared per point {summary.loc['chi-squared per point', 'median']:.4g} (" in methods
    check_page_and_figure(posterior.folder.parent, posterior)
    write_json(posterior.folder / "about.json", {"runs": "others", "notes": []})
    said = "fit: is of other runs, needs those of .*block; run fingerslip fit again"
    for kind in ("posterior", "fit"):
        with pytest.raises(fs.ResultError, match=said):
            write_figure(posterior.folder.parent, FigureChoice(kind))
    assert "fitted to measured" not in methods_and_papers(posterior.folder.parent)
    assert re.search(said, caplog.text)


@pytest.mark.parametrize(
    ("about", "said"),
    [
        (None, "results: holds no fit; run fingerslip fit with its study"),
        ({"runs": digest(["a", "b"])}, ""),
        ({"runs": digest(["a"])}, "results/fit: is of other runs, needs those of .*results; run fingerslip fit again"),
        ({}, "results/fit: is of other runs"),
    ],
)  # fmt: skip
def test_a_fit_of_other_runs_is_refused(tmp_path: Path, about: dict[str, Any] | None, said: str) -> None:
    folder = tmp_path / "results"
    study = StudyResult(folder, (), tuple(RunResult(name, {}, Events(), identity=name) for name in "ab"))
    if about is not None:
        (folder / "fit").mkdir(parents=True)
        write_json(folder / "fit" / "about.json", about)
    with pytest.raises(fs.ResultError, match=said) if said else contextlib.nullcontext():
        assert stored_fit(study) == about


def check_page_and_figure(folder: Path, posterior: fs.Posterior) -> None:
    """Check the section of a report, that one of other runs has none, and that the posterior can be drawn."""
    content = ReportContent(read_results(folder), {})
    section = sample_sections(content)[0]
    assert (section.title, [picture.name for picture in section.pictures]) == (
        "Fit to a measurement",
        ["corner", "fit"],
    )
    assert all(picture.png.startswith(b"\x89PNG") for picture in section.pictures)
    assert [table.note for table in section.tables] == [table.note for table in posterior.tables]
    row = texts(section.tables[0])[0]
    assert row[:3] == ["block Young's modulus", "kPa", f"{posterior.summary['median'].iloc[0]:.4g}"]
    runs = tuple(dataclasses.replace(run, identity="another") for run in content.study.runs)
    other = dataclasses.replace(content, study=dataclasses.replace(content.study, runs=runs))
    assert sample_sections(other)[0].is_empty
    for kind in ("posterior", "fit"):
        written = write_figure(folder, FigureChoice(kind, form="svg"))
        assert "<svg" in written.read_text(encoding="utf-8")
        with pytest.raises(fs.ResultError, match="holds no fit; run fingerslip fit"):
            write_figure(folder.parent.parent / "truth" / "truth", FigureChoice(kind))
    curves = pd.read_csv(folder / "fit" / "curves.csv").groupby("column", sort=False)
    for name, values in curves:
        assert values["unit"].iloc[0] == "N"
        middle = values["model 50 %"]
        inside = (values["measured"] >= values["noisy 5 %"]) & (values["measured"] <= values["noisy 95 %"])
        assert inside.mean() >= 0.75, name
        assert ((values["runs from"] < middle) & (middle < values["runs to"])).iloc[1:].all()


@pytest.mark.slow
@pytest.mark.usefixtures("reports")
def test_a_fit_is_whole_and_a_range_that_cuts_it_off_is_refused(
    write_study: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where nature ends the range, it may; a short chain tells all of this, too."""
    pytest.importorskip("emcee")
    monkeypatch.setattr(figures, "_DOTS_PER_INCH", 20)
    monkeypatch.setattr(chains, "_LENGTHS", 5)
    monkeypatch.setattr(chains, "_R_HAT", 1.5)
    block = block_values()["materials"]["block"] | {"youngs_modulus": TRUTH[MODULUS]}
    narrow = values(sample={"count": 10, "ranges": {FRICTION: [0.5, 0.8]}}, materials={"block": block})
    study = write_study(narrow)
    data = measure(study, tmp_path / "data.csv")
    said = rf"block\.yaml: sample\.ranges\.{FRICTION}: has .* % of the posterior within 2 % of 0\.5, needs"
    with pytest.raises(fs.InputError, match=said):
        fs.fit(study, data, results_dir=tmp_path / "results", workers=1)
    assert not (tmp_path / "results" / "block" / "fit").exists()
    write_study(narrow | {"fit": FIT | {"bounds": [FRICTION]}})
    posterior = fs.fit(study, data, results_dir=tmp_path / "results", workers=1)
    assert "WARNING: fit.columns: runs miss the measurement smoothly" in posterior.tables[0].note
    assert "Forces of a section go with its depth" in posterior.tables[0].note
    assert list(posterior.samples) == [FRICTION, "discrepancy [standard deviations]"]
    assert posterior.samples[FRICTION].between(0.5, 0.8).all()
    assert posterior.summary.set_index("value").loc["friction coefficient", "median"] < 0.6, "the truth is below"
    files = sorted(path.name for path in posterior.folder.iterdir())
    assert files == [
        "about.json",
        "corner.png",
        "curves.csv",
        "fit.png",
        "posterior.csv",
        "predictions.csv",
        "summary.csv",
    ]

    columns = dict.fromkeys(FIT["columns"], "0.02 mN")  # a tenth of the noise that made the data
    write_study(narrow | {"fit": FIT | {"bounds": [FRICTION], "columns": columns}})
    note = fs.fit(study, data, results_dir=tmp_path / "results", workers=1).tables[0].note
    factor, misfit = re.findall(r"WARNING: fit\.columns: residuals are (\S+) times .* per point (\S+)\),", note)[0]
    assert float(factor) == pytest.approx(float(misfit) ** 0.5, rel=0.1)
    assert 5.0 < float(factor) < 12.0
    assert f"write deviations {factor} times as large" in note


def test_residuals_that_chance_explains_are_not_warned_of() -> None:
    drawn = np.random.default_rng(1).chisquare(42, 2000) / 42
    assert sum(bool(fit_module.noise_warning(misfit, 42)) for misfit in drawn.tolist()) <= 6
    assert fit_module.noise_warning(1.5**2, 42)
    assert not fit_module.noise_warning(1.2**2, 42)
    assert not fit_module.discrepancy_warning(1.4, 0.8, 2.0)
    said = fit_module.discrepancy_warning(2.26, 1.54, 3.28)
    assert "by 2.26 (1.54 to 3.28) standard deviations, more than its noise" in said
    assert "contact.clearance" in said


@pytest.mark.parametrize(("end", "reaching", "beyond"), [(3.0, 1.0, False), (3.0, 0.6, True), (1.9, 1.0, True)])
def test_slip_times_behind_the_end_of_the_runs_have_no_error(end: float, reaching: float, beyond: bool) -> None:
    """Runs slip at one second and a share of the range; some do not, or their programme ends before the intervals."""
    points = np.linspace(0.0, 1.0, 20)[:, None]
    readings = [SlipEvents(0.1 + at, overall=1.0 + at if at <= reaching else None) for at in points[:, 0].tolist()]
    runs = [RunResult("run", {}, Events(slip)) for slip in readings]
    table = fit_module._predictions(runs, points, np.full((400, 1), 0.95), np.random.default_rng(1), end)
    errors = {str(row[0]): row[-2] for row in table.rows}
    assert (errors["overall slip (accumulated slip)"] is Missing.NOT_DEFINED) == beyond
    assert isinstance(errors["incipient slip (accumulated slip)"], float)
    assert ("Extrapolated" in table.note and "overall slip" in table.note) == beyond


@pytest.mark.parametrize(
    ("factor", "said"),
    [
        (1.0, None),
        (20.0, None),
        (1000.0, "the largest value is 2e.03 N, 667 times that of any run, .*; look at its unit"),
        (1e-3, "the largest value is 0.002 N, 0.002 times that of any run"),
        (-1.0, "is negative where that of the runs is positive, .*; reverse its sign"),
    ],
)  # fmt: skip
def test_data_that_no_run_comes_near_to_are_refused_before_they_are_fitted(factor: float, said: str | None) -> None:
    ways = np.linspace(0.0, 1.0, 11) ** 4
    curves = np.array([[1.0 * ways], [3.0 * ways]])
    measured = factor * 2.0 * ways + 1e-3 * (1.0 - ways)  # noise of the other sign at the first touch
    measurement = Measurement("depth", ways, ("normal_force",), measured[None], np.array([[1e-3]]))
    if said is None:
        fit_module._refuse_far(measurement, curves)
        return
    with pytest.raises(fs.InputError, match=rf"fit\.columns\.normal_force: {said}"):
        fit_module._refuse_far(measurement, curves)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"sample": None}, "fit: is given without sample, needs sample.ranges alone; give what is fitted its range"),
        ({"sweep": {"depth": ["1 mm", "2 mm"]}}, "fit: is given with sweep, needs sample.ranges alone"),
        ({"sample": {"count": 20, "ranges": RANGES, "choices": {"title": ["a", "b"]}}}, "fit: is given with sample"),
        ({"sample": {"count": 19, "ranges": RANGES}}, "sample.count: makes 19 runs, needs 10 for .*write count: 20"),
        ({"fit": FIT | {"bounds": [MODULUS, "depth"]}}, "fit.bounds: 'depth' is not known, needs one of materials"),
        ({"fit": FIT | {"columns": {"normal_force": 2}}}, "fit.columns.normal_force: '2' has no unit"),
        ({"fit": FIT | {"over": "force"}}, r"fit\.over: got 'force'"),
    ],
)  # fmt: skip
def test_studies_that_cannot_be_fitted_are_refused(write_study: Callable[..., Path], changes: Any, said: str) -> None:
    with pytest.raises(fs.InputError, match=rf"block\.yaml: {said}"):
        read_study(write_study(values(**changes)))


def test_a_study_without_a_fit_and_data_that_are_no_curves_are_refused_before_anything_runs(
    write_study: Callable[..., Path], tmp_path: Path
) -> None:
    pytest.importorskip("emcee")
    study = write_study(changed("title", "Block"))
    with pytest.raises(fs.InputError, match=r"fit: is missing, needs the measured curves; write fit: \{over: depth"):
        fs.fit(study, tmp_path / "data.csv")
    with pytest.raises(fs.InputError, match="fit: data: got 3, needs the path of a file"):
        fs.fit(study, 3)  # type: ignore[arg-type]
    with pytest.raises(fs.InputError, match=r"gone\.csv: cannot be read"):
        fs.fit(write_study(values()), tmp_path / "gone.csv", results_dir=tmp_path / "results")
    for over, far in (("depth", 0.11), ("displacement", 0.51), ("time", 0.13)):
        ways = np.linspace(0.0, far, 6)
        columns = {f"{over} [{'s' if over == 'time' else 'mm'}]": ways, "normal_force [N]": ways}
        pd.DataFrame(columns).to_csv(tmp_path / "far.csv", index=False)
        fitted = write_study(values(fit={"over": over, "columns": {"normal_force": "1 mN"}}))
        with pytest.raises(fs.InputError, match=rf"block\.yaml: fit\.over: {over}: goes from 0 to .* let the"):
            fs.fit(fitted, tmp_path / "far.csv", results_dir=tmp_path / "results")
    assert not (tmp_path / "results").exists()
