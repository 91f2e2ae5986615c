"""Studies with the block `reaction`: what may stand in them, what they come to, and how that is written down."""

import html
import re
from dataclasses import replace
from importlib import metadata

import numpy as np
import pandas as pd
import pytest

from fingerslip.errors import InputError
from fingerslip.mesh.io import write_mesh
from fingerslip.react import film
from fingerslip.react.figures import map_figure, margin_figure, outcome_figure, reaction_report, reaction_tables
from fingerslip.react.reflex import Reflex
from fingerslip.react.results import answer, cell_table, paper_table, read_reactions, source_table, trial_table
from fingerslip.report.content import ReportContent
from fingerslip.report.figures.motion import Film
from fingerslip.report.figures.study import convergence_figure
from fingerslip.report.tables.runs import summary_table
from fingerslip.results import quantities
from fingerslip.study.convergence import Level, run_at
from fingerslip.study.definition.runs import plan_study, read_runs
from fingerslip.study.inspection.check import check_plans
from fingerslip.study.inspection.show import export_result
from fingerslip.study.inspection.views import FigureChoice, write_figure
from fingerslip.study.running.build import build_model
from fingerslip.study.running.cluster import compute_task
from fingerslip.study.running.runner import run_study
from fingerslip.study.storage.reporting import reactions_of, read_results, study_tables
from fingerslip.uncertainty import Convergence, Series
from fingerslip.vision.video import open_frames
from places import ROOT
from unit.pads import pad

CONTACT = "contact: {boundary: bottom, friction_coefficient: 0.4, search_distance: 4 mm}"
RAMP = "ramp_load: {rate: 4 N/s, force: 2 N}"
SMALL = f"""\
title: Pads
mesh: {{file: pad.msh, length_unit: m}}
materials: {{bulk: {{youngs_modulus: 200 kPa, poisson_ratio: 0.45, density: 1000 kg/m^3}}}}
supports: {{top: [x, y]}}
formulation: plane_strain
depth: 10 mm
damping: {{stiffness: 2 ms}}
{CONTACT}
time: {{step: 4 ms}}
dynamics: {{basis: reduced, acceleration_tolerance: 0.1}}
reaction:
  margin: 0.3
  load: {{{RAMP}}}
  settle: 0.15 s
  rest: 0.02 s
  after: 0.3 s
  detectors:
    force: {{force_ratio: {{friction: 0.4, share: 0.95}}}}
    never: {{never: {{}}}}
  reflex: {{shape: smooth}}
  reactions: [human-slip, gripper]
  latencies: [0 ms, 80 ms, 900 ms]
  tolerance: 4 ms
"""
SWEEP = "sweep: {contact.friction_coefficient: [0.4, 0.6], reaction.load.ramp_load.rate: [4 N/s, 64 N/s]}\n"
LATENCY = "reaction.critical latency after force"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    write_mesh(pad().mesh, folder / "pad.msh")
    (folder / "small.yaml").write_text(SMALL + SWEEP)
    (folder / "series.csv").write_text("time [s],force [N]\n0,0\n0.25,2\n")
    return folder


@pytest.fixture(scope="module")
def study(folder):
    """Return the results of four runs; their film is short and small."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(film, "SHOWN_FILM", Film(size=(640, 480), frame_rate=5.0, seconds=1.0))
        return run_study(folder / "small.yaml", results_dir=folder / "results", workers=1)


@pytest.fixture(scope="module")
def reactions(study):
    return reactions_of(study)


@pytest.mark.slow
def test_map_that_ships_is_complete():
    runs = read_runs(ROOT / "studies" / "reaction_map.yaml").runs
    assert len(runs) == 5 * 6 * 3
    (centre,) = (run for run in runs if run.study.reaction and run.study.reaction.reactions)
    assert centre.swept == {
        "fingertip.phalanx.variant": "original",
        "contact.friction_coefficient": 0.6,
        "reaction.load.ramp_load.rate": "4 N/s",
    }


def test_reactions_save_within_the_critical_latency_and_quick_loads_leave_less_time(reactions):
    (latencies,) = reactions.panels("force").values()
    assert latencies.shape == (2, 2)
    assert np.all(np.nan_to_num(latencies[:, 1]) < latencies[:, 0])
    assert np.isnan(reactions.panels("never")[""]).all()

    trials = reactions.result.trials
    assert {trial.saved for trial in trials} == {True, False}
    assert all(trial.saved == (trial.spare is not None and trial.spare >= 0.0) for trial in trials)
    assert all((trial.chance is None) == (trial.critical is None) for trial in trials)
    assert sum(bool(result.trials) for result in reactions.results) == 1

    travels = list(reactions.result.travels.values())
    assert travels[0] < travels[1] < reactions.settings.travel_limit < travels[2]


@pytest.mark.slow
def test_results_are_those_of_any_study(study, folder):
    assert run_study(folder / "small.yaml", results_dir=folder / "results").unchanged == study.computed
    (run, *_) = read_results(study.folder).runs
    assert run.reaction == read_reactions(study.folder / run.name).times
    assert set(quantities(run)) == {f"reaction.{name}" for name in run.reaction}
    assert "reaction_critical_latency_after_force_s" in (study.folder / "summary.csv").read_text()
    (row, *_) = pd.read_csv(export_result(study.folder, "csv") / "reactions.csv").to_dict("records")
    trial = read_reactions(study.folder / row["run"]).trials[0]
    assert (row["reaction"], row["saved"], row["travel_m"]) == (trial.reaction, trial.saved, trial.travel)
    for kind in ("reaction-map", "reaction-margin", "reaction-outcome"):
        assert write_figure(study.folder, FigureChoice(kind, form="png")).stat().st_size > 10_000
    (model,) = {build_model(one).contacts[0].friction for one in read_runs(study.folder / run.name / "run.yaml").runs}
    assert model.coefficient == run.swept["contact.friction_coefficient"]


def test_answer_names_who_saves_the_object_and_who_loses_it(reactions):
    first, second = answer(reactions)
    assert first.startswith("At friction 0.4 and 4 N/s a grip that rises at 20 N/s from ")
    assert first.endswith("(± 4 ms of search).")
    limits = {trial.reaction: f"{1e3 * (trial.critical or 0.0):.0f} ms" for trial in reactions.result.trials[::2]}
    assert second == (
        "The grip of each reaction has its own rate, so each has its own longest latency, which stands second: "
        f"saved by human-slip (74 of {limits['human-slip']}); lost by gripper (400 of {limits['gripper']})."
    )
    assert limits["human-slip"] != limits["gripper"]
    refined = replace(reactions.runs[0], uncertainty={LATENCY: 0.01})
    assert "ms of search, step and mesh)." in answer(replace(reactions, runs=(refined, *reactions.runs[1:])))[0]


def test_answer_of_samples_is_over_all_of_them_and_says_where_nothing_helps_or_is_needed(reactions):
    detector, latencies = reactions.settings.detector, (0.05, 0.254, 0.09, None, None)
    lost = (0.2, 0.2, 0.2, 0.2, None)
    pairs = zip(lost, latencies, strict=True)
    results = tuple(replace(reactions.result, lost=time, critical={detector: value}) for time, value in pairs)
    runs = tuple(replace(reactions.runs[0], sampled={"reaction.mass": 0.1}) for _ in results)
    first, second = answer(replace(reactions, runs=runs, results=results))
    assert first == "4 of 5 objects are lost without a reaction."
    assert f"saves 3 of them where it begins in time: 50 to 254 ms after '{detector}', 90 ms in the middle." in second
    none = tuple(replace(result, critical={detector: None}) for result in results)
    assert answer(replace(reactions, runs=runs, results=none)) == (first,)
    for changes, expected in (({"critical": {"force": None}}, "no reflex saves"), ({"lost": None}, "no reflex is nee")):
        assert expected in answer(replace(reactions, results=(replace(reactions.result, **changes),)))[0]


def test_tables_have_a_row_for_each_run_and_trial(reactions, study):
    assert [len(table.rows) for table in (cell_table(reactions), trial_table(reactions))] == [4, 4]
    assert study_tables(study) == reaction_tables(reactions)
    assert study_tables(study)[-1].note.startswith(answer(reactions)[0])
    assert len([row for row in source_table().rows if row[3] == "assumed"]) > 9
    assert {row[0] for row in paper_table().rows} == {row[0] for row in source_table().rows}


def test_figures_say_latencies_time_to_spare_error_bars_and_what_another_controller_saves(reactions):
    (axes, *_) = map_figure(reactions).axes
    latencies = reactions.panels("force")[""]
    expected = ["–" if np.isnan(value) else f"{1e3 * value:.0f}" for value in latencies.ravel()]
    assert [text.get_text() for text in axes.texts] == expected
    assert [axes.get_xlabel() for axes in margin_figure(reactions).axes] == ["rate of the load [N/s]", "latency [ms]"]
    without = replace(reactions, results=tuple(replace(result, travels={}) for result in reactions.results))
    assert [axes.get_xlabel() for axes in margin_figure(without).axes] == ["rate of the load [N/s]"]
    (axes,) = outcome_figure(reactions).axes
    labels = [label.get_text() for label in axes.get_yticklabels()]
    assert labels == ["gripper, 400 ms, 100 N/s", "human-slip, 74 ms, 20 N/s"]
    trial, texts = reactions.result.trials[0], [text.get_text() for text in axes.texts]
    assert texts[0] == f"{1e3 * (trial.spare or 0.0):+.0f} ms\n{1e3 * trial.travel:.1f} mm"
    assert texts[1::2] == ["–\nlost", "–\nlost"]
    series = {"step": Series("step", (1.0, 0.5, 0.25), (0.09, 0.092, 0.093))}
    axes, *_ = convergence_figure({LATENCY: Convergence("critical latency", "s", 0.09, series)}, "run").axes
    assert np.asarray(axes.lines[1].get_ydata()) == pytest.approx([3.0, 2.0, 0.0])
    saves = np.array([[True, False], [False, False]])
    axes, *_ = map_figure(reactions, saves={"mine": saves}).axes
    dots = [line for line in axes.lines if line.get_linestyle() == "None"]
    assert [(list(line.get_xdata()), list(line.get_ydata())) for line in dots] == [([0], [-0.28])]


def test_figures_draw_the_reactions_of_the_study_alone(reactions):
    """Of one run no line parts the objects that are saved from the others."""
    own = replace(reactions.settings, reflex=Reflex(latency=0.03), reactions=("gripper", "human-load", "human-slip"))
    critical = dict.fromkeys(own.detectors, 0.06)
    one = replace(reactions, runs=reactions.runs[:1], results=(replace(reactions.result, critical=critical),))
    for settings, keys, lines in (
        (
            reactions.settings,
            ["human-slip, 74 ms: saves none", "gripper, 400 ms: saves none"],
            ["human-slip", "gripper"],
        ),
        (
            own,
            ["this reflex, 30 ms: saves all", "human-slip, 74 ms: saves none", "gripper, 400 ms: saves none"],
            ["this reflex", "human-slip", "gripper"],
        ),
        (replace(own, reactions=()), ["this reflex, 30 ms: saves all"], ["this reflex"]),
    ):
        figure = map_figure(replace(one, settings=settings))
        assert [text.get_text() for text in figure.legends[0].get_texts()] == keys
        figure = margin_figure(replace(one, settings=settings))
        rates, _ = figure.axes
        words = [text.get_text().partition(",")[0] for text in figure.legends[0].get_texts()]
        assert [word for word in words if not word.startswith("after")] == lines
        assert max(*rates.lines[-1].get_ydata()) < rates.get_ylim()[1], "no line is cut"
        assert rates.get_title("left").startswith("Friction")
        assert len({line.get_marker() for line in rates.lines[:2]}) == 2
        assert rates.get_ylim()[1] > 1.1 * 60.0, "no dot is cut"
    figure = map_figure(reactions)
    assert figure.legends[0].get_texts()[0].get_text() == "human-slip, 74 ms: saves the objects to the left"
    critical = dict.fromkeys("abcdef", 0.05)
    results = tuple(replace(result, critical=critical) for result in reactions.results)
    settings = replace(reactions.settings, detectors=dict.fromkeys(critical, next(iter(own.detectors.values()))))
    rates, _ = margin_figure(replace(reactions, settings=settings, results=results)).axes
    looks = {f"{line.get_marker()} {line._dash_pattern}" for line in rates.lines[:6]}
    assert len(looks) == 6, "no detector is left out, and none looks like another"


def test_columns_of_reactions_have_names_that_matlab_takes(reactions):
    run = replace(
        reactions.runs[0],
        reaction={"48 % slipped (area)": 0.1, "48 % slipped [area]": 0.2},
        uncertainty={"reaction.48 % slipped": 0.01},
    )
    names = [column.name for column in summary_table([run]).columns]
    assert {"reaction_48_percent_slipped_area_s", "reaction_48_percent_slipped_area_s_"} <= set(names)
    assert "reaction_48_percent_slipped_uncertainty_s" in names


def test_page_holds_answer_figures_and_film(study, reactions):
    text = html.unescape((study.folder / "report.html").read_text())
    assert all(sentence in text for sentence in answer(reactions))
    assert (text.count("<video"), text.count("<img")) == (1, 3)
    assert "http" not in re.sub(r"<pre.*?</pre>", "", text, flags=re.DOTALL)
    path = study.folder / reactions.runs[reactions.centre].name / "reaction-film.mp4"
    assert [frame.shape for frame in open_frames(path).read()] == [(480, 640)] * 5


def test_page_of_one_run_has_no_map_and_names_travels_only_where_they_are_known(reactions, study):
    one = replace(reactions, runs=reactions.runs[:1], results=(reactions.result,))
    without = replace(one, results=(replace(reactions.result, travels={}),))
    for tried, heroes, says_travels in ((reactions, 1, True), (one, 0, True), (without, 0, False)):
        report = reaction_report(ReportContent(study, {}), tried)
        assert len(report.hero) == heroes
        (margin,) = (part for section in report.sections for part in section.pictures if part.name == "reaction-margin")
        assert ("travel" in margin.caption) == says_travels


def test_refined_and_distant_runs_are_those_of_any_study(folder, study):
    centre = plan_study(folder / "small.yaml").runs[0]
    model = build_model(centre)
    refined = run_at(centre, Level("step", 0.5), model).study
    assert (refined.time.step, refined.reaction and refined.reaction.reactions) == (2e-3, ())
    search = plan_study(folder / "small.yaml").runs[1]
    files = compute_task([(search, search.identity)], metadata.version("fingerslip"), model.mesh)[search.name]
    assert files["reactions.json"] == (study.folder / search.name / "reactions.json").read_bytes()


def test_detector_that_needs_what_the_body_has_not_is_refused_before_anything_runs(folder):
    (folder / "spikes.yaml").write_text(SMALL.replace("never: {}", "spike_count: {kind: FA-I}"))
    with pytest.raises(InputError, match=r"spikes.yaml: reaction.detectors.never: needs sites of the kind FA-I, the"):
        build_model(read_runs(folder / "spikes.yaml").runs[0])


@pytest.mark.parametrize(("latency", "longest"), [("30 s", 30), ("80 ms", None)])
def test_a_latency_that_no_run_lasts_is_doubted(folder, latency, longest):
    (folder / "late.yaml").write_text(SMALL.replace("900 ms", "90 ms").replace("shape: smooth", f"latency: {latency}"))
    note = check_plans([plan_study(folder / "late.yaml")]).note
    text = f"reaction: has a latency of {longest} s, and no run lasts over 0.8 s after its load begins."
    assert (text in note) == (longest is not None) == ("WARNING" in note)
    heavy = SMALL.replace(RAMP, "step_load: {force: 1800 N}")
    (folder / "heavy.yaml").write_text(heavy)
    assert "reaches 1800 N, over 100 times the weight" in check_plans([plan_study(folder / "heavy.yaml")]).note


@pytest.mark.parametrize(
    ("load", "last"),
    [
        ("step_load: {force: 1 N}", 1.0),
        ("ramp_load: {rate: 4 N/s, force: 2 N}", 2.0),
        ("filled_vessel: {mass: 100 g, flow: 50 g/s}", 0.981),
        ("dropped_ball: {mass: 30 g, height: 100 mm}", 0.2943),
        ("load_series: {file: series.csv}", 2.0),
        ("load_series: {times: [0 s, 1 s], forces: [0 N, 3 N]}", 3.0),
    ],
)
def test_every_load_may_stand_in_a_study(folder, load, last):
    path = folder / "load.yaml"
    path.write_text(SMALL.replace(RAMP, load))
    (run,) = read_runs(path).runs
    assert run.study.held_object.load.series()[1][-1] == pytest.approx(last)
    # The file of a run needs no other.
    (folder / "again.yaml").write_text((folder / "load.yaml").read_text())
    assert "series.csv" not in str(run.plain_values)
    assert build_model(run).bodies


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        (CONTACT, "", 11, "reaction: is given without contact, needs the friction of a contact; write "),
        ("margin: 0.3", "margin: 0", 11, "reaction.grip: got 2.453 N, needs more than 2.453 N to hold 1.962 N; "),
        (RAMP, "load_series: {file: no.csv}", 13, "reaction.load.load_series.file: "),
        ("margin: 0.3", "margn: 0.3", 12, "reaction.margn: "),
        ("margin: 0.3", "mass: 100 N", 12, "reaction.mass: got '100 N', needs a unit of [kg]"),
        ("ramp_load: {rate", "tide: {rate", 13, "reaction.load.tide: "),
        (
            "{shape: smooth}",
            "{latency: 30}",
            20,
            "reaction.reflex.latency: '30' has no unit, needs a unit of [s]; write '30 ms' or ",
        ),
        ("rate: 4 N/s", "rate: 4 N", 13, "reaction.load.ramp_load.rate: got '4 N', needs a unit of [N/s]"),
        ("{force_ratio: {friction: 0.4, share: 0.95}}", "{touch: {}}", 18, "reaction.detectors.force.touch: "),
        ("gripper]", "grippers]", 21, "reaction.reactions.1: 'grippers' is not known, needs one of "),
        ("0 ms, 80 ms", "80 ms, 0 ms", 22, "reaction.latencies: got 0.08 s, 0 s, 0.9 s, needs ascending numbers"),
        ("0 ms, 80 ms", "0 ms, 1 ms", 22, "reaction.latencies.1: got 0.001 s, needs 0 s or at least a step, 0.004 s; "),
        ("step: 4 ms", "step: 20 ms", 21, "reaction.reactions.1.reflex.latency: got 0.01 s, needs 0 s or at least a"),
        ("step: 4 ms", "step: 0.2 s", 9, "time.step: got 0.2 s, needs to be shorter than settle and rest"),
        ("step: 4 ms", "step: 4 ms, end: 1 s", 9, "time.end: is given with reaction, needs none: it follows from the"),
        ("step: 4 ms", "scheme: quasi_static, step: 4 ms", 9, "time: is QuasiStatic, needs fixed steps with inertia"),
        ("settle:", "mass: 2 kg\n  actuator: {largest_force: 20 N}\n  settle:", 15, "reaction.actuator.larg"),
        ("coefficient: 0.4", "coefficient: 0", 8, "contact.friction_coefficient: got 0.0, needs "),
        ("time: {", "programme: [{hold: {duration: 1 s}}]\ntime: {", 9, "programme: is given with reaction, needs"),
    ],
)
def test_study_with_a_mistake_is_refused(folder, old, new, line, message):
    path = folder / "wrong.yaml"
    assert old in SMALL
    path.write_text(SMALL.replace(old, new))
    with pytest.raises(InputError) as caught:
        read_runs(path)
    assert str(caught.value).startswith(f"{path}: {message}")
    assert caught.value.line == line
