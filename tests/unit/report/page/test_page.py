"""The HTML page: well formed, self-contained, every text escaped; the pages of samples and of tracks."""

import base64
import dataclasses
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import fingerslip as fs
from fingerslip.published import published_set
from fingerslip.report.content import ReportContent
from fingerslip.report.page import samples
from fingerslip.report.page.assemble import study_report
from fingerslip.report.page.page import Picture, Report, ReportSection, render_page, write_page
from fingerslip.report.page.sensor import quality_report, write_tracking
from fingerslip.report.page.tracking import track_video
from fingerslip.results import RefusedRun
from fingerslip.sampling.sensitivity import fits_of
from fingerslip.storage.netcdf import read_netcdf
from fingerslip.tables.table import Column, Measured, Missing, Table
from fingerslip.vision.overlay import SHOWN_FIELDS
from fingerslip.vision.video import open_frames, read_frames, write_video
from problems import clips
from unit.report.page.contents import checked
from unit.sampled import study_of
from unit.synthetic import Process, make


def picture(name):
    figure = Figure(figsize=(1.0, 1.0))
    figure.subplots().plot([0.0, 1.0])
    return Picture(name, f'caption of "{name}"', figure)


def report():
    table = Table(
        "times", (Column("time", "s", 2), Column("name")), ((1.5, "a"), (Missing.NO_EVENT, "b")), "a note", marked=(1,)
    )
    sections = (
        ReportSection("First", ("a paragraph",), (table,), (picture("one"),), warnings=("cut off at <edge>",)),
        ReportSection("Second", pictures=(picture("two"),), folded=True),
    )
    return Report(
        "A <study>", sections, {"commit": "<abc>"}, "Does it <slip>?", ("After 1 s.",), hero=(picture("answer"),)
    )


def page_with(table):
    return render_page(Report("r", (ReportSection("s", tables=(table,)),)))


def test_texts_are_escaped_and_notes_and_code_stand_as_they_are():
    table = Table("t", (Column("x"),), (("<script>",),))
    section = ReportSection("a & b", ("1 < 2",), (table,), body="<p>a note</p>", code="@article{a<b}")
    page = render_page(Report("<title>", (section,), {"k": "<v>"}))
    checked(page)
    assert page.count("<script>") == 1, "the page's own"
    for text in ("&lt;script&gt;", "1 &lt; 2", "&lt;v&gt;", "<p>a note</p>", "@article{a&lt;b}"):
        assert text in page
    assert not section.is_empty
    assert ReportSection("s", ("text",)).is_empty


def test_tables_say_what_is_missing_and_stands_out_long_texts_may_wrap_and_uncertainties_keep_to_their_sign():
    page = render_page(report())
    for text in (
        '<th class="number short" scope="col">time [s]</th>',
        '<td class="number short">1.50</td>',
        '<td class="number short" title="the event did not happen">none</td>',
        '<p class="note">a note none: the event did not happen.</p>',
        '<p class="warning">cut off at &lt;edge&gt;</p>',
    ):
        assert text in page
    assert page.index("cut off") < page.index("<p>a paragraph</p>")
    assert page.count('<tr class="marked">') == 1
    marked = page[page.index('<tr class="marked">') :]
    assert marked[: marked.index("</tr>")].endswith('<td class="text short">b</td>')
    assert "data-sortable>" not in page
    columns = (Column("x"), Column("overall", "s", 2, answers=True))
    rows = (("short", None), ("a text that is longer than most values are", None), ("a", Measured(1.5, 0.25)))
    page = page_with(Table("t", columns, rows))
    for text in (
        '<td class="text short">short</td>',
        '<td class="text">a text that is longer',
        '<th class="number answers short" scope="col">overall [s]</th>',
        '<td class="number answers short">1.50 ±\u00a00.25</td>',
        "data-sortable>",
    ):
        assert text in page


def test_runs_in_motion_have_one_player_whose_data_neither_end_nor_swallow_a_script():
    # '<!--<script>' opens a state in which the next '</script>' does not end the script.
    title = "</script><script>alert(1)</script> <!--<script>"
    motions = tuple({"title": name, "data": "", "arrays": {}} for name in (title, "b"))
    page = render_page(Report("r", (ReportSection("In motion", motions=motions),)))
    checked(page)
    assert page.count("<script") == page.count("</script>") == 4, "the colours, the runs, and the page's own"
    assert "<!--" not in page
    assert page.count('class="motion"') == 1
    assert page.count("<script data-motion") == 2
    data = page[page.index("<script data-motion") :]
    assert json.loads(data[data.index(">") + 1 : data.index("</script>")])["title"] == title
    assert "class Solid" in page
    assert "class Solid" not in render_page(report())


def test_page_is_well_formed_needs_no_other_file_begins_with_the_answer_and_is_written_whole(tmp_path):
    page = render_page(report())
    checker = checked(page)
    assert len(checker.loaded) == 3
    for source in checker.loaded:
        kind, data = source.split(",")
        assert kind == "data:image/png;base64"
        assert base64.b64decode(data, validate=True).startswith(b"\x89PNG")
    assert checker.links == ["data:,", "#content", "#s0", "#s1", "#provenance"]
    assert {"s0", "s1", "one", "two", "provenance"} <= checker.anchors
    order = ["<h1>A", "Does it &lt;slip&gt;?", "<p>After 1 s.</p>", 'id="answer"', 'id="s0"', "<details>", 'id="s1"']
    assert sorted(order, key=page.index) == order
    assert page.count("<details>") == 1, "folded sections open at a click, the others are open"
    assert 'id="provenance"' not in render_page(Report("r", ()))
    write_page(report(), tmp_path / "report.html")
    assert "caption of" in (tmp_path / "report.html").read_text(encoding="utf-8")
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]
    with pytest.raises(fs.ResultError, match="cannot be written"):
        write_page(Report("r", ()), tmp_path / "missing" / "report.html")


REFERENCES = (published_set("wang2014-table2"),)


def content(**more):
    return ReportContent(study_of(**more), {}, references=REFERENCES)


@pytest.mark.slow
def test_a_study_with_samples_has_its_sections_and_the_published_times_of_its_phalanges():
    report, titles = study_report(content()), ("Slip times over the samples", "What moves overall slip")
    assert [section.title for section in report.sections] == [
        *titles, "What moves the other times", "All samples", "Citations"
    ]  # fmt: skip
    assert [picture.name for picture in report.pictures] == ["tornado-overall", "tornado-incipient"]
    assert "clearance" in render_page(report)
    section = samples.sample_sections(content(count=3))[2]
    assert section.text == ("Too few samples for 3 ranges: a regression needs 5.",)
    made, refused = content(), (RefusedRun("sample-3", {}, {}, "too large"),)
    made = dataclasses.replace(made, study=dataclasses.replace(made.study, refused=refused))
    assert "Refused samples" in [section.title for section in study_report(made).sections]
    study = study_of(12, ("original", "scaled"))
    fits = [fit for fit in fits_of(study) if fit.time == "overall"]
    assert samples.published_times(study.runs, fits, REFERENCES) == {0: (1.71, 1.71), 1: (1.77, 1.77)}
    assert len(samples.tornado_pictures(study.runs, fits, REFERENCES)) == 1


HISTORY = make(Process())


def starts_of(study):
    return {run.name: 1.0 for run in study.runs}


def content_in_motion(study):
    histories = {one.run.name: HISTORY for one in samples.representatives(study, starts_of(study))}
    return ReportContent(study, {}, starts=starts_of(study), representatives=histories)


def test_the_middle_and_both_ends_of_overall_slip_are_chosen_or_of_an_earlier_event():
    study = study_of(count=11)
    found = samples.representatives(study, starts_of(study))
    titles = ["overall slip nearest to the median", "earliest overall slip", "latest overall slip"]
    assert [one.title for one in found] == titles
    times = sorted(run.events.overall or 0.0 for run in study.runs)
    assert [one.since + 1.0 for one in found] == [times[5], times[0], times[-1]]
    assert [one.run.events.overall for one in found] == [times[5], times[0], times[-1]]
    # Times are counted from the start of each slide.
    late = study.runs[0].name
    assert samples.representatives(study, {**starts_of(study), late: -10.0})[-1].run.name == late
    partly = tuple(
        dataclasses.replace(run, events=fs.Events(fs.SlipEvents(incipient=run.events.incipient))) for run in study.runs
    )
    found = samples.representatives(dataclasses.replace(study, runs=partly), starts_of(study))
    assert [one.title for one in found][1:] == ["earliest incipient slip", "latest incipient slip"]
    assert samples.representatives(study_of(count=5, time=lambda *_: None), starts_of(study)) == ()
    assert samples.representatives(study, {}) == ()


def test_the_page_shows_them_by_what_they_are_with_their_values_and_without_names_of_runs():
    made = content_in_motion(study_of(count=11))
    section = samples.samples_in_motion(made)
    titles = ["Overall slip nearest to the median", "Earliest overall slip", "Latest overall slip"]
    assert [motion["title"] for motion in section.motions] == titles
    (table,) = section.tables
    headings = ["sample", "overall slip [s]", "phalanx", "clearance", "half height", "tissue Poisson's ratio"]
    assert [column.heading for column in table.columns] == headings
    assert all(len(str(cell).split()[0]) <= 7 for row in table.rows for cell in row[3:])
    report = study_report(made)
    page = render_page(dataclasses.replace(report, sections=tuple(one for one in report.sections if one.motions)))
    assert "Samples in motion" in page
    assert not [run.name for run in made.study.runs if run.name in page]
    assert samples.samples_in_motion(dataclasses.replace(made, representatives={})).is_empty


def test_a_video_that_is_not_there_is_an_error_before_anything_is_said():
    told: list[str] = []
    with pytest.raises(fs.InputError, match="is not there"):
        list(track_video(Path("nosuch.avi"), None, {"frame_rate": 30.0}, told.append))
    assert told == []


@pytest.mark.slow
def test_folder_stands_beside_the_video_its_page_says_what_is_wrong_and_a_failure_leaves_nothing(tmp_path, monkeypatch):
    frames = list(clips.filmed(clips.still(clips.field(rings=2), 5)))
    write_video(tmp_path / "a.mkv", frames, 30.0)
    length = "5 frames at 30 a second (the file's)"
    assert list(track_video(tmp_path / "a.mkv", None, {"rest_frames": 3})) == [
        f"tracks of 25 markers in {length}, 100.00 % of the positions found, at rest in the first 3",
        f"quality: {tmp_path / 'a_tracks' / 'quality.html'}",
    ]
    with monkeypatch.context() as patch:
        patch.setattr("fingerslip.vision.tracking.track.seen_share", lambda _: 0.5)
        again = list(track_video(tmp_path / "a.mkv", None, {"rest_frames": 3}))
    assert "100.00 % of the positions found, 50.00 % of those of all visible markers, at rest" in again[0]
    assert again[-1] == f"quality: {tmp_path / 'a_tracks' / 'quality.html'}, which was replaced"
    other = shutil.copy(tmp_path / "a.mkv", tmp_path / "a.avi")
    assert "a-avi_tracks" in list(track_video(other, None, {"rest_frames": 3}))[-1], "not over those of the other"
    tracks = fs.read_tracks(tmp_path / "a_tracks" / "tracks.nc")
    tracks.attrs |= {"partial": 1, "warnings": "something is odd"}
    report = quality_report(tracks.assign(visible=("time", [50] * 5)), frames[0])
    values = {row[0]: row[1] for section in report.sections for table in section.tables for row in table.rows}
    assert values["marker-frames with a position, of followed markers"] == 100.0
    assert values["the same, of all visible markers"] == 50.0
    page = render_page(report)
    for words in ("These tracks are partial.", "something is odd", "largest noise at rest", "No marker was lost"):
        assert words in page
    broken = open_frames([*frames[:3], frames[3][:100]], 30.0)
    with pytest.raises(fs.InputError, match="frame 3"):
        write_tracking(tracks, broken, tmp_path / "out")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a-avi_tracks", "a.avi", "a.mkv", "a_tracks"]


@pytest.mark.slow
def test_more_markers_than_asked_for_are_said_and_on_the_page_and_those_that_are_often_lost_counted(tmp_path):
    write_video(tmp_path / "a.mkv", clips.filmed(clips.still(clips.field(), 5)), 30.0)
    lines = list(track_video(tmp_path / "a.mkv", None, {"rest_frames": 3, "n_markers": 5}))
    warning = "asked for 5 markers, found 81 of the same kind in the first frames"
    assert any(line.startswith("warning: ") and warning in line for line in lines)
    assert any(line.startswith("partial tracks of ") for line in lines)
    page = (tmp_path / "a_tracks" / "quality.html").read_text(encoding="utf-8")
    assert warning in page
    assert "These tracks are partial." in page
    still = np.asarray(clips.still(clips.field(), 10))
    frames, (x, y) = list(clips.filmed(still)), np.round(still[0, 0]).astype(int)
    for frame in frames[5:]:
        frame[y - 15 : y + 15, x - 15 : x + 15] = np.median(frame)
    write_video(tmp_path / "b.mkv", frames, 30.0)
    lines = list(track_video(tmp_path / "b.mkv", None, {"rest_frames": 3, "n_markers": 81}))
    warning = "1 of 81 markers were not seen in more than a tenth of the frames"
    assert any(line.startswith("warning: ") and warning in line for line in lines)


@pytest.mark.slow
def test_fields_are_written_with_a_picture_and_videos(tmp_path):
    write_video(tmp_path / "a.mkv", clips.filmed(clips.still(clips.field(), 8)), 30.0)
    lines = list(track_video(tmp_path / "a.mkv", None, {"rest_frames": 3, "n_markers": 81}, fields=True))
    assert lines[-1].startswith(f"fields: {tmp_path / 'a_tracks' / 'fields.nc'}, fields.png, displacement.avi")
    assert read_netcdf(tmp_path / "a_tracks" / "fields.nc")["strain"].sizes["time"] == 8
    for name in SHOWN_FIELDS:
        assert len(list(read_frames(tmp_path / "a_tracks" / f"{name}.avi", colour="bgr"))) == 8
