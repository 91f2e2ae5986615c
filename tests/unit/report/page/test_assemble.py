"""The report of a study, which tables and figures its runs call for, and that of two studies side by side."""

import dataclasses
from pathlib import Path
from types import SimpleNamespace

import pytest
from matplotlib.figure import Figure

from fingerslip.marker_tracks import filmed_tracks
from fingerslip.published import published_set
from fingerslip.report.content import MOST_RUNS, Film, ReportContent, RunSubject, has_receptors
from fingerslip.report.page import assemble, pictures
from fingerslip.report.page.assemble import comparison_report, pairs_of, run_section, study_report
from fingerslip.report.page.page import ReportSection, render_page
from fingerslip.report.page.pictures import hero_pictures, model_pictures, run_pictures, swept_pictures
from fingerslip.report.page.sensor import cameras_section
from fingerslip.report.tables.parameters import DEFAULT, ShownValue
from fingerslip.results import RunResult, StudyResult, result_of
from fingerslip.slip import Events, SlipEvents, find_events, measures
from fingerslip.slip.front import EdgeContact
from fingerslip.slip.measures import Measure
from fingerslip.tables.table import Column, Missing, Table, texts
from fingerslip.uncertainty import Convergence, Series
from fingerslip.vision.cameras.camera import external_camera, true_tracks
from unit.filmed import filmed_history
from unit.report.page.contents import checked, content_of, two_runs, with_runs
from unit.report.scenes import block_history
from unit.synthetic import Process, make, with_mesh

VALUES = (
    ShownValue("fingertip.layers.skin_thickness", "1.5 mm", "wang2014"),
    ShownValue("fingertip.depth", "1 mm", "assumed", "scales all forces"),
)


def section_of(report, title):
    (section,) = (section for section in report.sections if section.title == title)
    return section


@pytest.mark.slow
def test_standard_report_has_its_sections_and_figures():
    references = (published_set("wang2014-table2"), published_set("wang2014-qualitative"))
    content = two_runs(references=references, values=VALUES, provenance={"commit": "abc"})
    meshed = {name: with_mesh(history) for name, history in content.histories.items()}
    report = study_report(dataclasses.replace(content, histories=meshed))
    assert [picture.name for picture in section_of(report, "The model").pictures] == ["section-0.4"]
    assert [section.title for section in report.sections] == [
        "Slip events",
        "How slip events are defined",
        "Comparison with published values",
        "In motion",
        "The runs side by side",
        "What was run",
        "Energy balance",
        "The model",
        "Values and their sources",
        "friction coefficient 0.4",
        "friction coefficient 0.6",
        "Citations",
    ]
    assert [picture.name for picture in report.hero] == [
        "latency-contact-friction-coefficient", "events-contact-friction-coefficient"
    ]  # fmt: skip
    side_by_side = section_of(report, "The runs side by side")
    assert [picture.name for picture in side_by_side.pictures] == ["slip-maps", "force-ratios", "acceleration-peaks"]
    assert [table.title for table in side_by_side.tables] == ["Measures"]
    assert len(report.sections[-2].pictures) == 5
    assert report.sections[-2].folded
    assert "@article{wang2014," in report.sections[-1].code
    assert report.title == "A <study>"


@pytest.mark.slow
@pytest.mark.parametrize(("starts", "is_said"), [((1.0, 1.0), True), ((1.0, 1.2), False)])
def test_both_origins_of_times_and_what_may_be_quoted_are_said(starts, is_said):
    page = render_page(study_report(two_runs(starts=dict(zip(("0.4", "0.6"), starts, strict=True)))))
    checked(page)
    assert ("Slides begin 1.000 s after the start of the run; the answer counts from there." in page) == is_said
    assert '<dl class="quote"><dt>Quote</dt><dd>overall slip; ' in page


@pytest.mark.slow
def test_single_run_is_called_the_run_and_unrecorded_readings_have_no_table():
    history = make(Process()).drop_dims("site")
    content = content_of((result_of(history, "run", {}),), {"run": history})
    assert content.titles == {"run": "the run"}
    report = study_report(content)
    assert [section.title for section in report.sections] == [
        "Slip events", "How slip events are defined", "In motion", "Energy balance", "The run", "Citations"
    ]  # fmt: skip
    events = report.sections[0]
    readings = ("accumulated slip", "displacement")
    assert [table.title for table in events.tables] == [
        f"Slip events from {reading}, counted from the start of the run" for reading in readings
    ]
    assert "No times from acceleration peaks: no run records the signals." in events.text
    assert "FA-I" not in report.sections[1].body
    page = render_page(report)
    checked(page)
    assert "Run run" not in page


def test_what_only_some_runs_recorded_or_have_is_said_and_contact_at_a_free_edge_is_a_warning():
    content = two_runs()
    first, second = content.study.runs
    unrecorded = dataclasses.replace(first.events, acceleration=SlipEvents(recorded=False))
    cut_off = dataclasses.replace(second, edge=EdgeContact("skin", 0.1, 0.0))
    some = with_runs(content, dataclasses.replace(first, events=unrecorded), cut_off)
    report = study_report(dataclasses.replace(some, histories={"0.6": content.histories["0.6"]}))
    events = report.sections[0]
    assert texts(events.tables[2])[0][1:] == ["n/r", "n/a", "n/r", "n/r", "n/r"]
    assert "n/r: not recorded" in events.tables[2].remarks
    assert len(events.tables[0].rows) == 2
    titles = [section.title for section in report.sections]
    assert "friction coefficient 0.6" in titles
    assert "friction coefficient 0.4" not in titles, "a run without a history is in the tables only"
    (warning,) = (sentence for sentence in report.answer if "cut off" in sentence)
    assert "friction coefficient 0.6 ('skin' from 0.1 s on" in warning
    assert "0.4" not in warning
    assert render_page(report).count("cut off") == 1, "said once"


def test_swept_values_that_differ_have_pictures_and_refined_runs_a_section_of_their_own():
    swept = [{"time.step": "5 ms", "fingertip.fingerprint.enabled": on} for on in (False, True)]
    swept += [{"time.step": "10 ms", "fingertip.fingerprint.enabled": False}]
    runs = tuple(RunResult(str(number), values, Events()) for number, values in enumerate(swept))
    assert [picture.name for picture in study_report(content_of(runs, {})).pictures] == [
        f"{kind}-{path}" for path in ("time-step", "fingertip-fingerprint-enabled") for kind in ("latency", "events")
    ]
    same = tuple(RunResult(str(number), {"contact.friction_coefficient": 0.6}, Events()) for number in (1, 2))
    assert study_report(content_of(same, {})).pictures == ()
    series = Series("step", (1.0, 0.5, 0.25), (1.7, 1.65, 1.625))
    names = ("slip.incipient", "slip.three_quarter", "slip.overall")
    found = {name: Convergence(name, "s", 1.7, {"step": series}) for name in names}
    runs = (RunResult("a", {"n": 1}, Events()), RunResult("b", {"n": 2}, Events()))
    section = section_of(study_report(content_of(runs, {}, convergences={"b": found})), "Numerical uncertainty")
    assert [picture.name for picture in section.pictures] == ["b-convergence"]
    assert [table.title for table in section.tables] == ["Numerical uncertainty, n 2"]
    assert "Numerical uncertainty" not in [section.title for section in study_report(content_of(runs, {})).sections]


@pytest.mark.parametrize(("count", "detailed"), [(12, 12), (15, 1)])
def test_a_long_study_has_few_runs_in_detail(monkeypatch, count, detailed):
    table = Table("t", (Column("a"),), ((1,),))
    monkeypatch.setattr(assemble, "run_section", lambda _, run: ReportSection(run.name, (), (table,)))
    for name in ("overview_pictures", "swept_pictures", "hero_pictures"):
        monkeypatch.setattr(assemble, name, lambda *_: ())
    history = make(Process())
    runs = tuple(RunResult(str(number), {"n": number}, Events()) for number in range(count))
    report = study_report(content_of(runs, {run.name: history for run in runs}))
    assert len(report.sections[0].tables[0].rows) == count
    named = [part.title for part in report.sections if part.title.isdigit()]
    assert named == [str(number) for number in range(detailed)]
    (moving,) = (part for part in report.sections if part.motions)
    assert len(moving.motions) == 12
    assert (f"first 12 of {count} runs" in " ".join(moving.text)) == (count > 12)


HISTORY = make(Process())


def names(history):
    return [picture.name for picture in run_pictures(RunSubject(history, Events(), name="r", title="a title"))]


def test_section_of_a_run_has_events_measures_and_pictures_under_its_name(monkeypatch):
    added = Measure("slides", "number of slides", lambda _: 1)
    monkeypatch.setattr(measures, "MEASURES", (*measures.MEASURES, added))
    run = result_of(HISTORY, "a", {"x": 1})
    section = run_section(content_of((run,), {"a": HISTORY}), run)
    assert (section.title, section.folded) == ("x 1", True)
    alone = result_of(HISTORY, "a", {})
    assert run_section(content_of((alone,), {"a": HISTORY}), alone).title == "The run"
    titles = ["Slip events, counted from the start of the run", "Measures", "Acceleration peaks"]
    assert [table.title for table in section.tables] == titles
    assert ("number of slides", "", 1) in section.tables[1].rows
    assert [picture.name for picture in section.pictures] == [
        "a-slip-map", "a-displacement", "a-forces", "a-acceleration", "a-strain-energy-density"
    ]  # fmt: skip
    assert section.pictures[0].figure.axes[0].get_title(loc="left") == "x 1"
    assert all(picture.figure.get_suptitle().endswith(": x 1") for picture in section.pictures[1:])


def test_pictures_are_those_that_a_history_has_the_signals_for(monkeypatch):
    monkeypatch.setattr(pictures, "_DRAW_RUNS", {name: lambda _: Figure() for name in pictures._DRAW_RUNS})
    assert has_receptors(HISTORY)
    assert not has_receptors(HISTORY.assign_coords(site_kind=("site", ["marker"] * HISTORY.sizes["site"])))
    assert names(HISTORY.drop_dims("site")) == ["r-slip-map", "r-displacement", "r-forces"]
    held = HISTORY.assign(phase_kind=("phase", ["press", "hold"]))
    assert names(held) == ["r-slip-map", "r-forces", "r-strain-energy-density"]
    history = block_history()
    solid = ["r-slip-frames", "r-stick-ratio", "r-surface-strain"]
    signals = ["r-forces", "r-acceleration", "r-strain-energy-density"]
    assert names(history) == [*solid, "r-cut", *signals]
    plain = history.drop_dims("snapshot_time").assign_coords(site_kind=("site", ["skin surface"]))
    assert names(plain) == [*solid, "r-reference-nodes", "r-forces"]
    assert model_pictures(RunSubject(plain, Events())) == []
    filmed = with_mesh(filmed_history())
    assert "r-markers" in names(filmed)
    run = RunSubject(filmed, find_events(filmed), name="a", title="t")
    model = model_pictures(run)
    assert [picture.name for picture in model] == ["section-a", "markers-a"]
    assert model[0].figure.get_suptitle() == "Section: t"


@pytest.mark.slow
def test_a_study_in_space_has_a_report():
    history = block_history()
    runs = tuple(
        result_of(history, name, {"fingertip.solid.angle": angle})
        for name, angle in (("a", "-30 deg"), ("b", "30 deg"))
    )
    report = study_report(content_of(runs, {"a": history, "b": history}))
    pictures = {picture.name for picture in report.pictures}
    assert {"stick-ratio", "slip-onset", "scene-a", "a-slip-frames", "b-cut", "a-forces"} <= pictures
    assert not {"slip-maps", "section-a", "a-slip-map"} & pictures
    assert [section.title for section in report.sections[-3:-1]] == ["angle -30 deg", "angle 30 deg"]


OF_AFFERENTS = "Models of afferents are fitted to monkeys and have rough thresholds."


@pytest.mark.parametrize(
    ("element", "kind", "words"),
    [
        ("Q4", "FA-II", "times, stick and slip along it, and forces."),
        ("T4", "FA-II", "times, and forces."),
        (
            "T4",
            "SA-I",
            f"times, what afferents answer, and forces. {OF_AFFERENTS}",
        ),
    ],
)
def test_the_answer_has_a_caption_of_what_it_shows_and_no_more(element, kind, words):
    history = block_history(element).assign_coords(site_kind=("site", [kind]))
    (answer,) = hero_pictures(content_of((result_of(history, "run", {}),), {"run": history}))
    assert answer.caption == f"What the plate does, the contact at several {words}"


@pytest.mark.slow
def test_a_sweep_answers_with_latency_and_events_by_title_and_a_run_with_all_signals_over_time():
    content = two_runs(starts={"0.4": 1.0, "0.6": 1.0})
    assert [picture.name for picture in hero_pictures(content)] == [
        "latency-contact-friction-coefficient", "events-contact-friction-coefficient"
    ]  # fmt: skip
    times = swept_pictures(content)[1].figure
    assert times.get_supylabel() == "time from the start of the slide [s]"
    for history, expected in ((block_history("Q4"), ["answer"]), (block_history("T4"), ["answer"]), (HISTORY, [])):
        single = content_of((result_of(history, "run", {}),), {"run": history})
        assert [picture.name for picture in hero_pictures(single)] == expected
    seen = content_of(
        tuple(result_of(block_history("Q4"), name, {"n": name}) for name in "abc"),
        dict.fromkeys("abc", block_history("Q4")),
    )
    last = hero_pictures(seen)[-1]
    assert (last.name, last.figure.get_suptitle()[-3:]) == ("answer", "n b")
    content = two_runs()
    titles = ["friction coefficient 0.4", "friction coefficient 0.6"]
    assert list(content.titled_histories()) == list(content.subject().events) == titles
    assert content.subject().events[titles[1]] == content.study.runs[1].events
    untitled = dataclasses.replace(content, study=dataclasses.replace(content.study, title=""))
    assert (content.title, untitled.title) == ("A <study>", "study")
    runs = tuple(RunResult(str(number), {"n": number}, Events()) for number in range(MOST_RUNS + 3))
    many = content_of(runs, {run.name: HISTORY for run in runs[1:]})
    assert [run.name for run in many.drawn] == [str(number) for number in range(1, MOST_RUNS + 1)]


def test_cameras_have_a_row_each_and_the_order_of_slip():
    history = filmed_history()
    camera = external_camera(30e-3, 14e-3, frame_rate=100.0, exposure=1e-3)
    truth = true_tracks(camera, filmed_tracks(history, "external", 0.5))
    numbers = {"frames": 76, "markers": 5, "rms": 0.01, "largest": 0.04, "kept": 0.995, "swapped": 0}
    film = Film("run", "external", truth, numbers, {})
    content = SimpleNamespace(films=(film,), histories={"run": history}, titles={"run": "A run"})
    section = cameras_section(content)
    assert section.tables[0].rows == (("run", "external", 76, 5, 0.01, 0.04, 99.5, 0),)
    assert [picture.name for picture in section.pictures] == ["run-external-camera-order"]


def compared(title, times, friction="0.6", **bars):
    runs = tuple(
        RunResult(
            str(mu), {"contact.friction_coefficient": mu}, Events(SlipEvents(incipient=1.1, overall=time)), **bars
        )
        for mu, time in times.items()
    )
    values = (ShownValue("time.step", "5 ms", "study file"), ShownValue("a.b", friction, "study file"))
    study, starts = StudyResult(Path(title), (), runs, title=title), {run.name: 1.0 for run in runs}
    return ReportContent(study, {}, values=values, starts=starts, provenance={"study": f"{title}.yaml"})


def test_runs_with_the_same_values_are_compared_and_values_that_differ_are_shown():
    report = comparison_report(compared("one", {0.4: 1.4, 0.6: 1.7}), compared("two", {0.6: 1.75, 0.8: None}, "0.7"))
    assert report.answer == (
        "One value differs between the studies; what follows is the effect of it.",
        "In the run that both studies have, overall slip of B comes 50 ms later into the slide than that of A.",
    )
    assert report.provenance == {"A: study": "one.yaml", "B: study": "two.yaml"}
    assert [picture.name for picture in report.hero] == ["paired"]
    differences, values = (report.sections[number].tables[0] for number in (0, 1))
    assert ["friction coefficient 0.6", "overall", "1.700", "1.750", "50"] in texts(differences)
    assert values.rows == (("a.b", "0.6", "0.7"),)
    checked(render_page(report))


def test_what_the_error_bars_of_one_study_do_not_explain_is_marked_and_a_mesh_alone_is_named():
    overall = Convergence("overall slip", "s", 1.4, {"step": Series("step", (1.0, 2.0, 4.0), (1.4, 1.401, 1.402))})
    bars = {"uncertainty": {"slip.overall": 5e-3}, "convergence": {"slip.overall": overall}}
    first, second = compared("one", {0.4: 1.4}, **bars), compared("two", {0.4: 1.465})
    values = [
        (ShownValue("mesh.file", f"pad.inp (content {name})", ""), ShownValue("dynamics.basis", basis, DEFAULT))
        for name, basis in (("0a", "full"), ("0b", "reduced"))
    ]
    sides = [dataclasses.replace(side, values=own) for side, own in zip((first, second), values, strict=True)]
    report = comparison_report(*sides)
    differences, differing = (report.sections[number].tables[0] for number in (0, 1))
    assert differing.rows == (("mesh.file", "pad.inp (content 0a)", "pad.inp (content 0b)"),)
    assert "Only the mesh differs: B - A is what its element sizes change" in report.answer[0]
    assert [differences.rows[number][1] for number in differences.marked] == ["overall"]
    assert "After ±: numerical uncertainty over time steps, not element sizes. Bold: the" in differences.note


def test_single_runs_are_a_pair_whatever_their_values_and_without_common_runs_it_says_so():
    first, second = compared("one", {0.4: 1.4}), compared("two", {0.6: None})
    assert len(pairs_of(first.study, second.study)) == 1
    report = comparison_report(first, second)
    assert report.answer[0] == "No value differs between the studies."
    assert "none reaches overall slip in both" in report.answer[-1]
    overall = next(row for row in report.sections[0].tables[0].rows if row[1] == "overall")
    assert overall[-1] is Missing.NO_EVENT
    cut_off = dataclasses.replace(second.study.runs[0], edge=EdgeContact("skin", 0.1, 0.0))
    beside = dataclasses.replace(second, study=dataclasses.replace(second.study, runs=(cut_off,)))
    assert comparison_report(first, beside).answer[-1].startswith("B: Contact within two facets of a free edge")
    report = comparison_report(first, compared("two", {0.6: 1.7, 0.8: 1.8}))
    assert report.answer[-1].startswith("The studies have no runs with the same swept values")
    assert report.hero == ()
