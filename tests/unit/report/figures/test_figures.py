"""All figures: one table of the panels, words and marks that each has, and the numbers that they draw."""

import dataclasses
import functools
import itertools

import numpy as np
import pytest
import xarray as xr
from matplotlib.collections import LineCollection, PolyCollection, TriMesh
from matplotlib.colors import to_hex
from matplotlib.patches import ConnectionPatch
from matplotlib.quiver import Quiver
from matplotlib.text import Text

import fingerslip as fs
from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.detect.evaluation import figures as detectors
from fingerslip.detect.evaluation.scores import Estimate
from fingerslip.marker_tracks import filmed_tracks, marker_tracks
from fingerslip.published import published_set
from fingerslip.report.colours import RECEPTOR_COLOURS, RECEPTOR_MARKS, STATE_COLOURS, STIFF_COLOUR
from fingerslip.report.content import RunSubject, StudySubject
from fingerslip.report.figures import bodies, composed, markers, patches, signals, specimens, study, style
from fingerslip.report.page.pictures import draw_of_run, draw_of_study
from fingerslip.report.scene import viewer
from fingerslip.report.scene.options import SceneOptions
from fingerslip.results import RunResult
from fingerslip.sampling.sensitivity import fits_of
from fingerslip.slip import Events, EventSettings, SlipEvents, slide_window
from fingerslip.slip.windows import slipped_fraction
from fingerslip.specimens.gel_pad.gel_pad import PRESETS as GEL_PADS
from fingerslip.specimens.tactip.tactip import PRESETS
from fingerslip.uncertainty import Convergence, Series
from unit.filmed import NODES, filmed_history
from unit.fingers import change, change_solid
from unit.report.figures.made import (
    ALL,
    APART,
    BARE,
    EVENTS,
    HISTORIES,
    HISTORY,
    NO_SLIDE,
    line,
    marked,
    panels,
    texts,
    titles,
    words,
)  # fmt: skip
from unit.report.scenes import block_history
from unit.report.tables.runs import sensitivity
from unit.sampled import study_of
from unit.synthetic import HALF_WIDTH, KINDS, PRESS_END, Process, make, slip_times

READING = EVENTS.acceleration
NAMES = ("incipient", "noticed", "three_quarter", "overall")
ON_SLIP = [PRESS_END, *(EVENTS.slip.time(name) for name in NAMES)]
ON_PEAKS = [PRESS_END, READING.incipient, READING.three_quarter, READING.overall]
TABLE2 = published_set("wang2014-table2")
FRICTION, VARIANT = "contact.friction_coefficient", "fingertip.phalanx.variant"
SLIPPED = Events(slip=SlipEvents(1.5, None, 1.6, 1.7))
LAYOUT, TIMES = fs.ring_layout(1e-3, (1, 8, 16)), np.arange(31) / 30


def swept_runs():
    def events(friction):
        overall = 1.0 + 0.71 * friction / 0.6
        times = SlipEvents(overall - 0.18, None, overall - 0.05, overall)
        return Events(times, times, SlipEvents(None, None, None, overall))

    values = {**TABLE2.values[0].programme, "fingertip.fingerprint.enabled": False}
    return [
        RunResult(f"{variant} {friction}", {VARIANT: variant, FRICTION: friction}, events(friction), values=values)
        for variant in ("original", "scaled")
        for friction in (0.2, 0.6, 0.8)
    ]


def runs_over(path, *values, events=SLIPPED):
    return [RunResult(str(value), {path: value}, events) for value in values]


def overall_fits(*variants):
    return [fit for fit in fits_of(study_of(12, variants)) if fit.time == "overall"]


def tracks(units="m", **more):
    """Return markers that move apart by a tenth in a second and shift by a millimetre along y."""
    position = LAYOUT.position * (1 + 0.1 * TIMES)[:, None, None] + TIMES[:, None, None] * (0.0, 1e-3)
    position[10:20, 24] = np.nan
    return fs.make_tracks(position * (1.0 if units == "m" else 1e5), TIMES, units=units, **more)


def seen():
    camera = fs.external_camera(30e-3, 14e-3, frame_rate=100.0, exposure=1e-3)
    return fs.true_tracks(camera, filmed_tracks(filmed_history(), "external", 0.5))


def reference_nodes():
    kinds, names = ["skin surface", "skin surface", "tissue surface"], ["skin-h1", "skin-h2", "tissue-v1"]
    return block_history().isel(site=[0, 0, 0]).assign_coords(site=names, site_kind=("site", kinds))


RIGHT = Estimate(0.9, 0.8, 1.0)
DISTURBED = [("lost", 0.0, RIGHT, 0.0), ("lost", 0.7, Estimate(None), 1.0), ("noise", 0.1, RIGHT, 0.0)]
FIELDS = ["displacement", "velocity", "rigid residual", "divergence [%]", "curl [%]", "larger principal strain [%]"]
PHALANGES = ["phalanx original", "phalanx scaled"]
VIEWED = SceneOptions(scalar="region", contact=True, camera="below", written=False)
AT_EVENTS = Events(slip=SlipEvents(incipient=0.06, noticed=0.07, overall=0.1))
ON_ACCELERATION = "Events are those from acceleration peaks."
STRESS_BAR = "von Mises\n[kPa]"
LATER = Events(slip=SlipEvents(incipient=0.055, overall=0.085))
ACROSS = [{VARIANT: name} for name in ("original", "scaled")]
STRAIN_MODELS = {"FA-II": fs.human_afferents()["SA-I"]}


def of_run(kind, history=lambda: HISTORY, events=EVENTS, **more):
    return lambda: draw_of_run(kind, RunSubject(history(), events, **more))


def of_study(kind, histories=lambda: HISTORIES, runs=(), path="", reference=None):
    return lambda: draw_of_study(kind, StudySubject(runs, histories(), ALL, reference, path=path))


# fmt: off
# How a figure is drawn, the titles of its panels, some of its words, and the times that its first panel marks, if any.
FIGURES = {
    "forces": (of_run("forces"), [], {"time [s]", "force [mN]"}, ON_SLIP),
    "force-ratios": (of_study("force-ratios"), list(HISTORIES), {"overall"}, ON_SLIP),
    "energy": (of_run("energy", title="a"), [], {"energy [µJ]", "Energy balance: a"}),
    "held": (lambda: signals.held_figure({"one": NO_SLIDE, "other": NO_SLIDE}), [], {"normal force [mN]"}),
    "slip-map": (of_run("slip-map", title="a"), ["a"], {"time [s]", "open", "incipient"},
        ON_SLIP),
    "slip-maps": (
        of_study("slip-maps"), list(HISTORIES),
        {"time [s]", "position along the plate [mm]", "open", "stick", "slip", "incipient", "48 %"},
        ON_SLIP),
    "displacement": (
        of_run("displacement"), [],
        {"displacement since the slide began [mm]", "time [s]\nEvents are those from displacement."},
        [EVENTS.displacement.time(name) for name in NAMES]),
    "acceleration-peaks": (
        of_study("acceleration-peaks"), list(HISTORIES),
        {"acceleration along the plate [m/s²]", "peak that counts", "overall", ON_ACCELERATION}, ON_PEAKS),
    "acceleration": (
        of_run("acceleration", title="original"), list(KINDS),
        {"acceleration along the plate [m/s²]", "Acceleration at the receptors: original",
         f"time [s]\n{ON_ACCELERATION}"}, ON_PEAKS),
    "strain-energy-density": (
        of_run("strain-energy-density"), list(KINDS), {"strain energy density [J/m³]"}, ON_SLIP),
    "events": (
        of_study("events", dict, [*swept_runs(), RunResult("other", {}, Events())], FRICTION, TABLE2), PHALANGES,
        {"friction coefficient", "time from the start of the run [s]", "published", "accumulated slip"}),
    "latency": (
        of_study("latency", dict, swept_runs(), VARIANT, TABLE2),
        [f"friction coefficient {friction}" for friction in (0.2, 0.6, 0.8)], {"latency [ms]", "published"}),
    "slip-onset": (of_study("slip-onset", lambda: {"a": block_history()}), [], {"time into the slide [s]"}),
    "stick-ratio": (
        of_study("stick-ratio", lambda: dict.fromkeys(("one", "other"), block_history())), [],
        {"tangential force / normal force"}),
    "tornado": (
        lambda: study.tornado_figure(overall_fits("original", "scaled"), {0: (1.71, 1.71), 1: (1.75, 1.77)}), PHALANGES,
        {"published", "at the smallest value", "5 to 95 % of the samples"}),
    "Sobol": (
        lambda: study.indices_figure([sensitivity("sobol", group=group) for group in ACROSS]), PHALANGES,
        {"total", "first order", "Sobol index [-]"}),
    "Morris": (
        lambda: study.indices_figure([sensitivity("morris")]), [],
        {"mean size", "standard deviation", "elementary effect [s]"}),
    "deformed": (
        of_run("deformed", lambda: block_history("Q4"), AT_EVENTS),
        ["0.050 s, start of slide, 10 ms before incipient", "0.100 s, overall"],
        {"von Mises stress [kPa]", "stick"}),
    "views": (
        lambda: bodies.deformed_figure(block_history(), times=[0.0, 0.1]), ["0.000 s", "0.100 s"],
        {"von Mises stress [kPa]"}),
    "flat regions": (
        lambda: bodies.deformed_figure(block_history("Q4"), options=SceneOptions(scalar="region"), times=[0.1]),
        ["0.100 s"], {"skin", "tissue"}),
    "regions": (
        lambda: bodies.deformed_figure(block_history(), options=VIEWED, times=[0.1]), ["0.100 s"],
        {"skin", "tissue", "stick", "slip"}),
    "cut": (
        of_run("cut", block_history, Events(), title="a"), ["0.050 s", "0.100 s"],
        {"von Mises stress [kPa]", "Stress on a cut along the finger: a"}),
    "slip-frames": (
        of_run("slip-frames", block_history, LATER, times=(0.05, 0.07, 0.1)),
        ["0.050 s: 0 % has slipped", "0.070 s: 0 % has slipped, after incipient",
         "0.100 s: 100 % has slipped, after overall"],
        {"along the slide [mm]", "stick", "slip", "open", f"%: {patches.HAS_SLIPPED}"}),
    "surface-strain": (
        of_run("surface-strain", block_history, Events()), [],
        {"strain along the slide [%]", "its rate [%/s]", "not in contact"}),
    "reference-nodes": (
        of_run("reference-nodes", reference_nodes, Events(SlipEvents(overall=0.09))),
        ["h1, skin", "h2, skin", "v1, tissue"], {"displacement", "plate", "overall"}, [0.05, 0.09]),
    "marker tracks": (
        lambda: markers.marker_tracks_figure(tracks(ring=LAYOUT.ring), "slide"), ["along x", "along y"],
        {"Markers over time: slide", "displacement [mm]", "markers in the middle", "at the rim"}),
    "fields": (
        lambda: markers.fields_figure(fs.marker_fields(tracks()), 0.5, "slide"), FIELDS,
        {"Fields from markers at 0.5 s: slide", "x at rest [mm]"}),
    "fields in an image": (
        lambda: markers.fields_figure(fs.marker_fields(tracks("px")), 0.5), FIELDS, {"x at rest [px]"}),
    "robustness": (lambda: detectors.robustness_figure(DISTURBED), ["lost", "noise"], {"share of positions lost"}),
    "markers at rest": (
        lambda: markers.marker_places_figure(marker_tracks(filmed_history()), "a run"),
        ["1 internal markers, from inside", "5 external markers, from below"],
        {"centre", "ring 1", "ring 2", "Markers at rest: a run"}),
    "markers": (
        of_run("markers", filmed_history, Events()), ["internal markers", "external markers"],
        {"travel of the plate [mm]", "centre", "starts at x < 0"}),
    "sensor": (
        lambda: specimens.tactip_figure(PRESETS.read("tactip-ridged-2d"), "ridged"),
        ["cut open along the axis", "81 internal markers, from inside", "81 external markers, from below"],
        {*specimens.SENSOR_COLOURS, "Sensor: ridged"}),
    "gel pad": (
        lambda: specimens.gel_pad_figure(GEL_PADS.read("gelsight-mini-2d"), "flat"),
        ["cut open along the middle", "63 internal markers, from inside"], {"Sensor: flat", "y [mm]", "z [mm]"}),
    "fingertip": (
        lambda: specimens.fingertip_figure(change_solid(), "mine"),
        ["along the finger (sagittal, z = 0)", "across the finger (transverse, x = 0)"],
        {"x [mm]", "z [mm]", "epidermis", "phalanx"}),
    "composed": (
        of_run("composed", lambda: block_history("Q4"), AT_EVENTS, afferents=STRAIN_MODELS),
        ["0.000 s", "0.050 s", "0.100 s"],
        {"plate\n[mm]", "contact\n[mm]", "1 FA-II\nby x", "force of 1000 mm\ndepth [N]", "ratio,\nfraction",
         STRESS_BAR}),
    "composed in 3D": (
        of_run("composed", block_history, LATER), ["0.030 s", "0.050 s", "0.060 s", "0.080 s", "0.090 s"],
        {"plate\n[mm]", "force [mN]", "ratio,\nfraction", "open"}),
    "spikes": (
        of_run("spikes", lambda: block_history("Q4"), AT_EVENTS, afferents=STRAIN_MODELS), [],
        {"plate\n[mm]", "1 FA-II\nby x", "mean rate\nin 100 ms\n[1/s]"}, [0.05, 0.06, 0.07, 0.1]),
    "mesh": (
        of_run("mesh", lambda: block_history("Q4")), ["close view of the framed part"],
        {"x [mm]", "y [mm]", "skin", "tissue", "FA-II", "plate"}),
    "mesh of quadratic triangles": (of_run("mesh", lambda: block_history("T6")), [], {"skin", "tissue", "plate"}),
    "sensitivity": (
        lambda: draw_of_study("sensitivity", StudySubject((), {}, {}, sensitivities=[sensitivity("sobol")])), [],
        {"total", "first order"}),
}
# fmt: on


@pytest.fixture(autouse=True, scope="module")
def small_pictures():
    """Render bodies small: what they show is tested, not how finely."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (bodies, markers):
            patch.setattr(module, "stills", lambda *scene: viewer.stills(*scene[:3], (320, 240)))
        yield


@functools.cache
def drawn(name):
    """Return a figure of the table, which tests leave as it is."""
    return FIGURES[name][0]()


@pytest.mark.parametrize("name", list(FIGURES))
def test_figures_have_their_panels_words_and_marks(name):
    _, expected, some_words, *marks = FIGURES[name]
    figure = drawn(name)
    assert titles(figure)[: len(expected)] == expected
    assert some_words <= words(figure)
    if marks:
        assert marked(panels(figure)[0]) == pytest.approx(marks[0])


INCOMPLETE = {"no slide": NO_SLIDE, "no contact": APART, "no receptors": BARE}
NO_RECEPTORS = ["no receptor in area A", "no receptor in area B", "slide starts"]
OVER_TIME = {
    "slip maps": (lambda history: signals.slip_maps_figure({"a": history}, {}), {"no contact": ["no contact"]}),
    "displacement": (
        signals.contact_displacement_figure,
        {"no slide": ["no slide in contact"], "no contact": ["no slide in contact"]},
    ),
    "acceleration": (signals.acceleration_figure, {"no contact": NO_RECEPTORS, "no receptors": NO_RECEPTORS}),
    "peaks": (
        lambda history: signals.acceleration_overview_figure({"a": history}, {}),
        {fault: ["no slide or no receptor"] for fault in INCOMPLETE},
    ),
    "density": (signals.strain_energy_density_figure, {"no contact": NO_RECEPTORS, "no receptors": NO_RECEPTORS}),
    "forces": (signals.force_figure, {"no slide": [], "no contact": ["slide starts"]}),
    "forces of runs": (
        lambda history: signals.force_overview_figure({"a": history}, {}),
        {"no slide": [], "no contact": [], "no receptors": []},
    ),
}


@pytest.mark.parametrize("name", list(OVER_TIME))
def test_figures_of_incomplete_histories_say_why_they_are_empty_and_warn_of_nothing(name):
    draw, reasons = OVER_TIME[name]
    for fault, reason in reasons.items():
        figure = draw(INCOMPLETE[fault])
        figure.draw_without_rendering()
        assert texts(panels(figure)[0]) == reason


def test_ratio_reaches_the_friction_coefficient_and_is_left_out_while_hardly_anything_presses():
    forces, ratios = panels(signals.force_figure(HISTORY, EVENTS))
    assert max(forces.lines[0].get_ydata()) == pytest.approx(400.0)
    ratio, normal = line(ratios, "tangential / normal force").get_ydata(), HISTORY["counterface_force"].values[:, 0, 1]
    assert ratio[-1] == pytest.approx(0.6)
    assert np.array_equal(np.isnan(ratio), normal <= 0.02 * normal.max())
    assert line(ratios, "friction coefficient").get_ydata()[0] == 0.6
    back = HISTORY.assign(counterface_force=HISTORY["counterface_force"] * [-1.0, 1.0])
    curves = [panels(signals.force_figure(history))[0].lines[1].get_ydata() for history in (HISTORY, back)]
    np.testing.assert_allclose(curves[0], curves[1], err_msg="a magnitude, whatever the direction of the slide")


def test_the_stimulus_of_a_composed_figure_ends_where_its_axis_of_time_does():
    plate = panels(draw_of_run("composed", RunSubject(HISTORY, SLIPPED)))[0]
    last = plate.lines[0].get_xdata()[-1]
    assert last == pytest.approx(plate.get_xlim()[1]) == slide_window(HISTORY).end, "no shorter than the slide"


@pytest.mark.parametrize(
    ("last", "times", "end"), [("hold", (), 0.1), ("press", (), 0.1), ("lift", (), 0.05), ("lift", (0.1,), 0.1)]
)
def test_a_composed_figure_has_the_whole_programme_until_it_only_lifts_and_all_its_pictures(last, times, end):
    history = block_history("Q4")
    history = history.assign_coords(
        phase_kind=("phase", ["slide", last]), phase_start=("phase", [0.0, 0.05]), phase_end=("phase", [0.05, 0.1])
    )
    figure = draw_of_run("composed", RunSubject(history, AT_EVENTS, times=times))
    assert panels(figure)[0].get_xlim() == pytest.approx((0.0, end))
    notes = [text for axes in panels(figure) if "Lift" in (text := axes.get_xlabel())]
    assert notes == ["time [s]\nLift from 0.05 s not shown."] * (end < 0.1)


def test_figures_of_spikes_end_with_the_run_and_count_them_in_whole_windows():
    history = block_history("Q4")
    history = history.assign_coords(
        phase_kind=("phase", ["slide", "lift"]), phase_start=("phase", [0.0, 0.05]), phase_end=("phase", [0.05, 0.1])
    )
    spikes = fs.Spikes(tuple(history["site"].values[:1]), ("FA-I",), (np.array([0.02, 0.08, 0.14]),), 0.0, 0.15)
    rates = panels(composed.spike_figure(spikes, history))[-1]
    stimulus = panels(composed.composed_figure(history, spikes=spikes))[0]
    assert rates.get_xlim() == stimulus.get_xlim() == pytest.approx((0.0, 0.1)), "the lift has spikes, too"
    # The block records every 10 ms, so windows are of 0.1 s.
    steps = rates.patches[0].get_data()
    assert steps.edges == pytest.approx([0.0, 0.1])
    assert steps.values == pytest.approx([20.0])
    assert steps.baseline is None, "no fall at the end"


def test_forces_have_the_body_beside_at_the_start_of_the_slide_and_at_overall_slip():
    expected = ["0.050 s, start of slide", "0.100 s, overall"]
    for element, has_bar in (("Q4", True), ("T4", False)):
        figure = signals.force_figure(block_history(element), AT_EVENTS)
        assert titles(figure) == expected
        states = ["stick", "slip"] if has_bar else ["stick", "slip", "open"]
        assert [text.get_text() for text in figure.legends[0].get_texts()][-len(states) :] == states
        assert (STRESS_BAR in words(figure)) == has_bar
    assert titles(signals.force_figure(block_history("Q4"))) == expected[:1]
    assert titles(signals.force_figure(HISTORY, EVENTS)) == [], "without snapshots there is none"
    late = signals.force_figure(block_history("Q4"), LATER)
    assert titles(late)[1] == "0.100 s, 15 ms after overall", "the snapshot's own time, not that of the event"


def test_pictures_of_a_run_are_led_to_their_times_on_one_axis_with_all_signals():
    figure = drawn("composed")
    states = next(axes for axes in figure.axes if axes.get_ylabel() == "contact\n[mm]")
    leads = [artist for artist in figure.artists if isinstance(artist, ConnectionPatch)]
    assert [lead.xy2[0] for lead in leads] == pytest.approx([0.0, 0.05, 0.1])
    assert all(lead.coords2 == states.get_xaxis_transform() for lead in leads)
    timed = [axes for axes in panels(figure) if axes.get_ylabel() not in {"", STRESS_BAR}]
    assert len({axes.get_xlim() for axes in timed}) == 1
    assert all(
        marked(axes) == pytest.approx([0.05, 0.06, 0.07, 0.1])
        for axes in timed
        if axes.get_ylabel() != "ratio,\nfraction"
    )


def test_a_picture_says_how_far_it_is_from_the_time_that_was_asked_for_and_the_last_has_the_scale():
    figure = draw_of_run("composed", RunSubject(block_history("Q4"), AT_EVENTS, times=(0.05, 0.08)))
    bars = {" ".join(axes.get_title("left").split()): "mm" in "".join(texts(axes)) for axes in panels(figure)}
    assert {title: bars[title] for title in titles(figure)} == {"0.050 s": False, "0.100 s, 20 ms after 0.080 s": True}


@pytest.mark.slow
@pytest.mark.parametrize("element", ["Q4", "T4"])
def test_in_one_column_of_a_journal_no_text_is_small_beyond_the_edge_or_over_another(element):
    history, models = block_history(element), STRAIN_MODELS if element == "Q4" else None
    with style.looking("column"):
        figure = draw_of_run("composed", RunSubject(history, AT_EVENTS, afferents=models))
        _, grid = style.figure_grid(3, 3, (3.0, 2.0), "", ("", ""))
    assert grid[0].get_subplotspec().get_gridspec().ncols == 2
    figure.draw_without_rendering()
    assert 25.4 * figure.get_figwidth() == pytest.approx(85.0)
    hidden = {
        label
        for axis in (axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis))
        for tick in axis.get_major_ticks()
        for label in (tick.label1, tick.label2)
        if not min(axis.get_view_interval()) <= tick.get_loc() <= max(axis.get_view_interval())
    }
    shown = [text for text in {*figure.findobj(Text)} - hidden if text.get_text() and text.get_visible()]
    assert min(text.get_fontsize() for text in shown) >= 6.0
    boxes = {text: text.get_window_extent() for text in shown if text.get_rotation() in {0.0, 90.0}}
    assert all(box.x0 >= 0.0 and box.x1 <= figure.bbox.x1 for box in boxes.values())
    overlaps = [
        (a.get_text(), b.get_text()) for a, b in itertools.combinations(boxes, 2) if boxes[a].overlaps(boxes[b])
    ]
    assert overlaps == []


def test_energy_balance_keeps_small_parts_apart_as_shares_of_the_largest_work():
    small, work = panels(signals.energy_figure(HISTORY))[1], float(HISTORY["external_work"].max())
    share = np.asarray(line(small, "contact penalty").get_ydata())
    assert share[-1] == pytest.approx(float(HISTORY["contact_energy"][-1]) / work)
    assert line(small, "time integration"), "which steps without inertia have, too, and of either sign"
    assert "material damping" not in {item.get_label() for item in small.lines}, "zero is left out"
    relaxing = HISTORY.assign(viscous_dissipation=HISTORY["external_work"] / 3.0)
    for history, drawn in ((HISTORY, False), (relaxing, True), (HISTORY.drop_vars("viscous_dissipation"), False)):
        labels = {item.get_label() for item in panels(signals.energy_figure(history))[0].lines}
        assert ("relaxation of the layers" in labels) == drawn
    readable = {0.4: (1e3, "mN"), 1.0: (1.0, "N"), 2e-5: (1e6, "µN"), 4e-12: (1e12, "pN"), 0.0: (1.0, "N")}
    assert {largest: signals._scale(largest, "N") for largest in readable} == readable


def test_slip_map_shows_the_states_by_position_whatever_the_numbering():
    order = np.random.default_rng(1).permutation(HISTORY.sizes["contact_node"])
    meshes = [
        panels(signals.slip_maps_figure({"a": history}, {}))[0].collections[0]
        for history in (HISTORY, HISTORY.isel(contact_node=order))
    ]
    values, others = (np.asarray(mesh.get_array()) for mesh in meshes)
    np.testing.assert_array_equal(values, others)
    assert values.shape == (41, HISTORY.sizes["time"])
    assert set(np.unique(values)) == {0, 1, 2}
    assert (values == 1).sum(axis=1).argmax() == 20, "the centre sticks longest"
    heights = meshes[0].get_coordinates()[:, 0, 1]
    assert (heights[0], heights[-1]) == pytest.approx((-1e3 * HALF_WIDTH - 0.1, 1e3 * HALF_WIDTH + 0.1))


def test_displacement_has_nine_nodes_and_the_plate():
    axes = panels(signals.contact_displacement_figure(HISTORY, EVENTS))[0]
    curves = [item.get_ydata() for item in axes.lines if len(item.get_xdata()) > 2]
    assert (len(curves), curves[-1][-1]) == (10, pytest.approx(3.0))
    ends = [curve[-1] for curve in curves[:-1]]
    # Slip starts at the edges, so the centre follows furthest, and both sides alike.
    assert (int(np.argmax(ends)), max(ends)) == (4, pytest.approx(3.0 * 0.71, abs=0.03))
    assert ends[:4] == pytest.approx(ends[:4:-1], abs=0.01)
    names = ("counterface_displacement", "contact_displacement")
    left = HISTORY.assign({name: HISTORY[name] * [-1.0, 1.0] for name in names})
    low, high = panels(signals.contact_displacement_figure(left))[0].get_ylim()
    assert low < -2.0 < 0.0 < high < 0.5


def test_held_runs_have_a_line_each_and_a_panel_for_bodies_that_are_free():
    (forces,) = panels(signals.held_figure({"one": NO_SLIDE, "other": NO_SLIDE}))
    assert [item.get_label() for item in forces.lines] == ["one", "other"]
    assert max(forces.lines[0].get_ydata()) == pytest.approx(400.0)
    moved = np.zeros((NO_SLIDE.sizes["time"], 1, 2))
    moved[:, 0, 1] = np.linspace(0.0, 3e-4, len(moved))
    free = NO_SLIDE.drop_dims("rigid_body", errors="ignore").assign_coords(rigid_body=["plate"])
    free = free.assign(rigid_body_displacement=(("time", "rigid_body", "component"), moved))
    _, motion = panels(signals.held_figure({"run": free}))
    assert motion.get_ylabel() == "displacement of the body [mm]"
    assert max(motion.lines[0].get_ydata()) == pytest.approx(0.3)


def test_receptors_that_were_recorded_have_a_panel_each_and_peaks_that_count_are_dotted():
    assert len({axes.get_ylim() for axes in panels(signals.acceleration_figure(HISTORY, EVENTS))}) == 1
    axes = panels(signals.acceleration_figure(make(Process(step=1e-3, peaks={1.5: 0.02, 1.71: 0.1}))))[0]
    assert 0.05 < axes.get_ylim()[1] < 0.15
    assert any(text.startswith("cut, reaches ") for text in texts(axes))
    assert not any(text.startswith("cut") for text in texts(panels(signals.acceleration_figure(NO_SLIDE))[0]))
    some = HISTORY.isel(site=np.flatnonzero(np.isin(HISTORY["site_kind"].values, ["FA-I", "SA-II"])))
    for draw in (signals.acceleration_figure, signals.strain_energy_density_figure):
        assert titles(draw(some)) == ["FA-I", "SA-II"]
    densities = panels(signals.strain_energy_density_figure(HISTORY, EVENTS))
    assert all(axes.get_ylim()[0] == 0.0 for axes in densities)
    area_a, area_b = (item for item in densities[0].lines if len(item.get_xdata()) > 2)
    assert area_b.get_ydata()[-1] > area_a.get_ydata()[-1]
    axes = panels(signals.acceleration_overview_figure({"a": HISTORY}, {"a": EVENTS}))[0]
    dots = next(item for item in axes.lines if item.get_marker() == "o")
    assert list(dots.get_xdata()) == pytest.approx([1.53, 1.63, 1.71], abs=0.0051)
    alone = Events(acceleration=SlipEvents(overall=1.7))
    for events, keys in ((EVENTS, {"incipient", "three-quarter", "overall"}), (alone, {"overall"})):
        figure = signals.acceleration_overview_figure({"a": HISTORY}, {"a": events})
        assert words(figure) & {"incipient", "three-quarter", "overall"} == keys


def test_every_type_has_its_raster_below_the_stimulus_with_rows_by_place_and_rates_come_last():
    names, kinds = ("b", "a", "c"), ("SA-I", "SA-I", "FA-I")
    places = np.array([[4e-3, 0.0], [-2e-3, 0.0], [1e-3, 0.0]])
    history = block_history("Q4").isel(site=[0, 0, 0])
    history = history.assign_coords(site=list(names), site_position=(("site", "component"), places))
    # The receptor of the block is an FA-II.
    times = (np.array([0.3]), np.array([0.1, 0.2]), np.array([0.15, 0.35]))
    figure = composed.spike_figure(fs.Spikes(names, kinds, times, 0.0, 0.5), history)
    stimulus, slow, fast, rates = figure.axes
    assert line(stimulus, "slide").get_ydata()[-1] == pytest.approx(1.0)
    assert line(stimulus, "press").get_ydata()[-1] == pytest.approx(0.5)
    assert [[row.get_lineoffset() for row in axes.collections] for axes in (slow, fast)] == [[0, 1], [0]]
    assert (slow.get_ylabel(), rates.get_ylabel()) == ("2 SA-I\nby x", "mean rate\nin 100 ms\n[1/s]")
    assert [label.get_text() for label in slow.get_yticklabels()] == ["\N{MINUS SIGN}2.0 mm", "4.0 mm"]
    np.testing.assert_allclose(np.concatenate([row.get_positions() for row in slow.collections]), [0.1, 0.2, 0.3])
    # Records of 10 ms resolve no rate of 20 a second in windows of less than 100 ms.
    edges = rates.patches[0].get_data().edges
    assert np.diff(edges) == pytest.approx(0.1)
    assert edges[0] == 0.0
    assert stimulus.get_xlim() == (0.0, pytest.approx(slide_window(history).end)), "all of the slide"
    assert titles(figure) == [], "notes are no titles of panels"
    empty = np.empty(0)
    silent = composed.spike_figure(fs.Spikes(names, kinds, (empty, empty, times[2]), 0.0, 0.5), history).axes
    said = [[text.get_text() for text in axes.texts].count("no spikes") for axes in silent]
    assert said == [0, 1, 0, 0]
    felt = fs.Spikes(names, kinds, times, 0.0, 0.5, {"FA-I": 117.0})
    for drawn in (
        composed.spike_figure(felt, history, assumed=True),
        composed.composed_figure(history, spikes=felt, assumed=True),
    ):
        (note,) = (text for axes in drawn.axes if "Spikes: " in (text := axes.get_xlabel().replace("\n", " ")))
        assert "FA-II left out: vibrations need steps of 0.3 ms and a body with damping" in note
        assert "FA-I (117 Hz) respond to more than the 5 Hz that records resolve" in note
        assert note.endswith("counts are no result.")


def test_the_lines_of_events_cross_the_share_that_has_slipped_at_their_levels():
    axes = panels(signals.force_figure(HISTORY, EVENTS))[1]
    slipped, slips = line(axes, signals.HAS_SLIPPED), line(axes, signals.SLIPS)
    times, window = HISTORY["time"].values, slide_window(HISTORY)
    share = slipped_fraction(HISTORY, window, EventSettings().slip_tolerance).values
    np.testing.assert_array_equal(slipped.get_ydata()[window.records], share)
    assert (slips.get_ydata()[window.records] > share + 0.01).any(), "what slips has not all slipped far"
    for name, level in (("incipient", 0.1), ("noticed", 0.48), ("three_quarter", 0.75)):
        share = np.interp(EVENTS.slip.time(name), times, slipped.get_ydata())
        assert share == pytest.approx(level, abs=0.06), name
    assert np.isnan(slipped.get_ydata()[0])
    assert slips.get_linewidth() < slipped.get_linewidth()
    receptors = set(RECEPTOR_COLOURS.values())
    every = [each for axes in panels(signals.force_figure(HISTORY)) for each in axes.lines]
    assert not receptors & {each.get_color() for each in every}, "a colour means one thing"


def diamonds(axes):
    """Return where published values are drawn."""
    return sorted((item.get_xdata()[0], item.get_ydata()[0]) for item in axes.lines if item.get_marker() == "D")


def ticks(axes):
    return [label.get_text() for label in axes.get_xticklabels()]


def test_events_and_latency_over_a_swept_value_stand_beside_the_published_values_that_hold():
    first, second = panels(study.event_times_figure(swept_runs(), reference=TABLE2))
    assert diamonds(first) == [(0.6, 1.53), (0.6, 1.71)]
    assert diamonds(second) == [(0.6, 1.48), (0.6, 1.77)], "those of the scaled phalanx at 0.6, and no latency"
    overall = first.lines[9]
    assert list(first.get_xticks()) == [0.2, 0.6, 0.8]
    for curve in (*first.lines[:12], *panels(study.latency_figure(swept_runs(), FRICTION))[0].lines):
        assert curve.get_xdata().tolist() == [0.2, 0.6, 0.8], "points stand at their value"
    assert overall.get_ydata()[1] == pytest.approx(1.71)
    axes = panels(study.latency_figure(swept_runs(), reference=TABLE2))[1]
    slip, _, *others = axes.lines
    assert slip.get_ydata() == pytest.approx([180.0, 180.0])
    assert {line.get_marker() for line in others} == {"D"}, "missing where an event is"
    assert sorted(value for _, value in diamonds(axes)) == pytest.approx([180.0, 290.0])
    assert "published" not in words(study.latency_figure(swept_runs()))
    assert not axes.containers, "no bars where no uncertainty is known"
    first, *others = swept_runs()
    studied = dataclasses.replace(first, uncertainty={"slip.latency": 20e-3})
    (bars,) = panels(study.latency_figure([studied, *others]))[0].containers
    (bar,) = (ends for ends in bars.lines[2][0].get_segments() if len(ends) and np.isfinite(ends).all())
    assert bar[:, 1].tolist() == pytest.approx([160.0, 200.0])
    bulk = Convergence("latency", "s", 0.18, {"bulk": Series("bulk", (1.0, 0.5), (0.18, 0.19))})
    noted = study.latency_figure([dataclasses.replace(studied, convergence={"slip.latency": bulk}), *others])
    assert "leave out element sizes" in panels(noted)[-1].get_xlabel()
    studied = dataclasses.replace(first, uncertainty={"slip.overall": 20e-3})
    (bars,) = panels(study.event_times_figure([studied, *others]))[0].containers
    (bar,) = (ends for ends in bars.lines[2][0].get_segments() if len(ends) and np.isfinite(ends).all())
    assert np.diff(bar[:, 1]) == pytest.approx(40e-3)


def test_the_axis_has_numbers_to_scale_where_all_have_one_unit_and_else_words_in_order():
    axes = panels(study.event_times_figure(swept_runs(), VARIANT))[0]
    assert (ticks(axes), list(axes.get_xticks())) == (["original", "scaled"], [0, 1])
    starts = [float(curve.get_xdata()[0]) for curve in axes.lines[:12]]
    assert len(set(starts)) == len(starts), "no event hides another"
    angle = "fingertip.bodies.angle"
    axes = panels(study.event_times_figure(runs_over(angle, "30 deg", "-15 deg", "15 deg"), angle))[0]
    assert (ticks(axes), list(axes.get_xticks())) == (["30 deg", "-15 deg", "15 deg"], [30.0, -15.0, 15.0])
    assert np.all(np.diff(axes.lines[0].get_xdata()) > 0.0), "joined in order"
    mixed = panels(study.event_times_figure(runs_over(angle, "30 deg", "0.5 rad"), angle))[0]
    assert list(mixed.get_xticks()) == [0, 1], "no common scale"
    direction = "programme.1.slide.direction"
    axes = panels(study.latency_figure(runs_over(direction, [1, 0, 0], [-1, 0, 0]), direction))[0]
    assert ticks(axes) == ["1, 0, 0", "-1, 0, 0"]


@pytest.mark.parametrize("draw", [study.event_times_figure, study.latency_figure])
def test_only_readings_that_were_recorded_have_a_key_and_panels_can_be_read(draw):
    silent = Events(SLIPPED.slip, acceleration=SlipEvents(recorded=False))
    heard, never = Events(SLIPPED.slip, acceleration=SLIPPED.slip), Events(SLIPPED.slip, acceleration=SlipEvents())
    for events, is_named in ((silent, False), (heard, True), (never, False)):
        runs = runs_over(FRICTION, 0.2, 0.4, events=events)
        assert ("acceleration peaks" in words(draw(runs, FRICTION))) == is_named
        alone = draw([runs[0], *runs_over(FRICTION, 0.4, 0.6)], FRICTION)
        assert "acceleration peaks" not in words(alone)
        assert "X" not in {line.get_marker() for line in panels(alone)[0].lines}
    cases = [{FRICTION: mu, "mesh.depth": depth} for depth in range(20) for mu in (0.2, 0.4)]
    figure = draw([RunResult(str(case), case, SLIPPED) for case in cases], FRICTION)
    assert len(titles(figure)) == 12
    assert (titles(figure)[0][-1:], titles(figure)[-1][-2:]) == ("0", "19")
    assert "12 of 20 combinations of the other values" in " ".join(figure.get_suptitle().split())


def test_changes_are_in_milliseconds_for_each_refined_setting_and_the_curve_ends_at_the_limit():
    def refined(*values):
        sources = {name: Series(name, (1.0, 0.5, 0.25), values) for name in ("mesh", "step")}
        return Convergence("event", "s", values[0], sources)

    series = {"incipient": (1.2, 1.3, 1.25), "three_quarter": (None,) * 3, "overall": (1.8, 1.75, 1.725)}
    figure = study.convergence_figure({f"slip.{name}": refined(*values) for name, values in series.items()}, "run")
    assert [axes.get_xlabel() for axes in panels(figure)] == ["element size / that in use", "time step / that in use"]
    points = [item for item in figure.axes[0].lines if item.get_marker() == "o"]
    assert len(points) == 2, "the event that did not happen is left out"
    assert sorted(np.asarray(points[1].get_ydata()).tolist()) == pytest.approx([-75.0, -50.0, 0.0])
    assert [y for _, y in diamonds(figure.axes[0])] == pytest.approx([-100.0], abs=1e-3)


def test_bars_go_from_the_time_at_the_smallest_to_that_at_the_largest_value():
    (axes,) = panels(study.tornado_figure(overall_fits("original")))
    bars = [(bar.get_x(), bar.get_x() + bar.get_width(), bar.get_y() + 0.5 * bar.get_height()) for bar in axes.patches]
    smallest, largest = bars[2:5], bars[5:8]
    labels = [label.get_text() for label in axes.get_yticklabels()]
    assert [label.partition(",")[0] for label in labels] == ["tissue Poisson's ratio", "half height", "clearance"]
    assert labels[2] == "clearance, 0 to 0.4 mm"
    # Overall slip is at 1.8 s without clearance and at 1.6 s with 0.4 mm of it.
    assert smallest[2] == (pytest.approx(1.7), pytest.approx(1.8), pytest.approx(2.0))
    assert largest[2][1] == pytest.approx(1.6)
    both = panels(drawn("tornado"))
    dashed = [[item.get_xdata()[0] for item in axes.lines if item.get_linestyle() == "--"] for axes in both]
    assert dashed == [[1.71], [1.75, 1.77]]
    (axes,) = panels(study.indices_figure([sensitivity("sobol")]))
    assert [bar.get_width() for bar in axes.patches] == [0.3, 0.6, 0.2, 0.5]
    assert [text.get_text() for text in axes.get_yticklabels()] == ["press depth", "friction coefficient"]


def test_each_pair_has_a_row_with_both_studies():
    slipped = RunResult("a", {}, Events(slip=SlipEvents(incipient=1.2, overall=1.7)))
    pairs = study.Pair("one", (slipped, slipped)), study.Pair("two", (slipped, RunResult("a", {}, Events())))
    left, right = panels(study.paired_figure(pairs, ("A", "B"), ({"a": 1.0}, {"a": 1.1})))
    marks = [item for item in left.lines if item.get_marker() in "os"]
    assert [round(float(item.get_xdata()[0]), 3) for item in marks[:2]] == [0.7, 0.6]
    assert np.isnan(marks[3].get_xdata()[0])
    assert float(right.lines[1].get_xdata()[0]) == 500.0
    assert [text.get_text() for text in left.get_yticklabels()] == ["one", "two"]


def test_a_section_has_its_field_layer_by_layer_and_lines_where_layers_end_and_needs_snapshots():
    flat = block_history("Q4")
    stress = np.tile(1e3 * (1.0 + flat["cell_region"].values), (flat.sizes["snapshot_time"], 1))
    of_cells = flat.assign(snapshot_von_mises=(flat["snapshot_von_mises"].dims, stress))
    for scalar, expected in (("displacement", None), ("von_mises", {1.0, 2.0})):
        figure = bodies.deformed_figure(of_cells, options=SceneOptions(scalar=scalar), times=[0.0, 0.1])
        axes, other = panels(figure)[:2]
        fields = [item for item in other.collections if isinstance(item, TriMesh)]
        assert len(fields) == 2, "a layer each"
        values = [np.unique(field.get_array().round(6)) for field in fields]
        assert expected is None or {float(value) for found in values for value in found if value} == expected
        assert min(np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim())) > 10.0, "the whole body, in millimetres"
    lines = max(
        (item for item in axes.collections if isinstance(item, LineCollection)), key=lambda c: len(c.get_paths())
    )
    assert len(lines.get_paths()) == 4 * 4 + 4, "the outline, and the line between the layers"
    cells = [item for item in panels(drawn("flat regions"))[0].collections if isinstance(item, PolyCollection)]
    assert sum(len(item.get_paths()) for item in cells) == flat.sizes["cell"]
    stiff = bodies.deformed_figure(of_cells.assign_attrs(regions="skin, phalanx"), times=[0.1])
    colours = [item.get_facecolor() for item in panels(stiff)[0].collections if isinstance(item, PolyCollection)]
    assert to_hex(colours[0][0]) == STIFF_COLOUR, "bone has no field"
    assert not bodies.has_pictures(make(Process()))
    with pytest.raises(fs.ResultError, match="no snapshots of the whole mesh; write record"):
        bodies.deformed_figure(make(Process()))


def test_every_snapshot_is_cut_once_with_the_same_margins():
    history = block_history()
    assert history["snapshot_time"].values == pytest.approx([0.0, 0.05, 0.1])
    assert titles(bodies.cut_frames_figure(history, Events(SlipEvents(overall=0.06)))) == ["0.050 s"]
    figure = drawn("cut")
    first, second = (axes.images[0].get_array() for axes in figure.axes if axes.images)
    assert first.shape == second.shape
    assert np.abs(first.astype(int) - second.astype(int)).max() > 50, "pictures differ as the stress does"
    assert [axes.get_ylabel() for axes in figure.axes if axes.get_ylabel()] == ["von Mises stress [kPa]"]
    blank = np.full((3, 3, 3), 255, dtype=np.uint8)
    assert style.crop([blank])[0].shape == blank.shape


@pytest.mark.slow
def test_frames_end_after_overall_slip_and_strains_and_stick_ratios_have_their_rows_and_scales():
    history = block_history()
    for time, states in ((0.0, [STICK, SLIP, OPEN]), (0.06, [STICK, SLIP])):
        zones = panels(patches.slip_frames_figure(history, times=[time]))[0].collections
        assert [to_hex(zone.get_facecolor()[0]) for zone in zones] == [STATE_COLOURS[state] for state in states]
    assert len(titles(patches.slip_frames_figure(history))) == 6, "records of the slide, each once"
    until = titles(patches.slip_frames_figure(history, Events(SlipEvents(overall=0.07))))
    assert (len(until), until[0][:7], until[-1][:7]) == (3, "0.050 s", "0.070 s")
    times = history["time"].values
    events = SlipEvents(incipient=times[-4] - 1e-6, overall=times[-2] - 1e-6)
    after = [title.partition(" after ")[::2] for title in titles(patches.slip_frames_figure(history, Events(events)))]
    happened = {words: title[:7] for title, words in after if words}
    assert happened == {"incipient": f"{times[-4]:.3f} s", "overall": f"{times[-2]:.3f} s"}
    together = SlipEvents(incipient=times[-3] - 2e-6, noticed=times[-3] - 1e-6, overall=times[-1])
    frames = titles(patches.slip_frames_figure(history, Events(together)))
    assert len({title[:7] for title in frames}) == len(frames), "no frame twice"
    assert sum("after incipient, 48 %" in title for title in frames) == 1
    scales = [axes for axes in panels(drawn("surface-strain")) if "[" in axes.get_ylabel()]
    assert [axes.get_ylabel() for axes in scales] == ["strain along the slide [%]", "its rate [%/s]"]
    assert all(axes.get_ylim()[0] == pytest.approx(-axes.get_ylim()[1]) for axes in scales)
    (axes,) = panels(drawn("stick-ratio"))
    assert axes.lines[0].get_xdata().size == 6  # records of the slide, its start included
    assert np.nanmax(axes.lines[0].get_xdata()) <= 0.5 * (1.0 + 1e-9)
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["one", "other"]


def test_every_event_has_its_frame_where_several_are_near_the_last():
    events = SlipEvents(incipient=1.541, noticed=1.725, three_quarter=1.962, overall=1.981)
    moments = patches._moments_with_events(make(Process()), Events(events))
    assert {1.545, 1.725, 1.965, 1.985} <= set(np.round(moments, 6))


def with_states(before, after, switch):
    """Return a history whose whole contact changes its state once."""
    history = block_history()
    states = np.where(history["time"].values[:, None] < switch, before, after)
    shape = history["contact_state"].shape
    return history.assign(contact_state=history["contact_state"].copy(data=np.broadcast_to(states, shape)))


def triangles_of(figure):
    """Return the colours of the triangles, panel by panel."""
    return [axes.collections[0].get_facecolor() for axes in figure.axes if axes.collections and axes.get_title("left")]


def test_onsets_count_from_the_start_of_the_slide_on_one_scale_in_the_axes_of_the_plate():
    window = slide_window(block_history())
    early, late = window.start + 0.02, window.end - 0.01
    figure = patches.slip_onset_figure({name: with_states(STICK, SLIP, at) for name, at in (("a", early), ("b", late))})
    first, second = triangles_of(figure)
    assert len({tuple(colour) for colour in first}) == len({tuple(colour) for colour in second}) == 1
    assert not np.array_equal(first[0], second[0])
    (scale,) = [axes for axes in figure.axes if "time into" in axes.get_ylabel()]
    assert scale.get_ylim()[1] == pytest.approx(late - window.start, abs=0.011)  # a record
    same = {state: with_states(state, state, 0.0) for state in (STICK, OPEN)}
    stuck, never = triangles_of(patches.slip_onset_figure(same))
    assert np.allclose(stuck, stuck[0])
    assert stuck[0][:3].max() < 0.25, "dark"
    assert len(never) == 0
    history = block_history()
    turned = history.assign(counterface_displacement=-history["counterface_displacement"])
    figure = patches.slip_onset_figure({"there": history, "back": turned})
    first, second = (axes for axes in figure.axes if axes.get_title("left"))
    (there,), (back,) = ([text for text in axes.texts if hasattr(text, "arrow_patch")] for axes in (first, second))
    forth = np.subtract(there.xy, there.xyann)
    assert np.linalg.norm(forth) > 1.0, "millimetres of the plate"
    np.testing.assert_allclose(forth, -np.subtract(back.xy, back.xyann), atol=1e-12)
    assert first.get_xlim() == second.get_xlim()


PLATE = (":", "#000000")


def test_reference_nodes_are_drawn_with_the_plate_and_without_the_jerk_at_the_start_of_the_slide():
    history = block_history()
    assert bodies.reference_kinds(reference_nodes()) == ["skin surface", "tissue surface"]
    assert bodies.reference_kinds(history) == bodies.reference_kinds(history.drop_dims("site")) == []
    figure = drawn("reference-nodes")
    dotted = [item.get_ydata() for item in panels(figure)[0].lines if (item.get_linestyle(), item.get_color()) == PLATE]
    assert dotted[0][-1] == pytest.approx(1.0)
    assert "incipient" not in words(figure), "it did not happen"
    slow = {name: 5.0 * history[name] for name in ("time", "phase_start", "phase_end")}
    longer = history.assign_coords({**slow, "site_kind": ("site", ["skin surface"])})
    size = xr.where((longer["time"] > 0.24) & (longer["time"] < 0.3), 100.0, 0.1)
    jerked = (size * xr.ones_like(longer["acceleration"])).transpose(*longer["acceleration"].dims)
    axes = panels(bodies.reference_nodes_figure(longer.assign(acceleration=jerked)))[-1]
    assert (axes.get_ylabel(), axes.get_ylim()[1]) == ("acceleration [m/s²]", pytest.approx(0.13))


def test_markers_are_lines_coloured_by_their_distance_from_the_middle_with_gaps_where_they_are_lost():
    first, second = panels(drawn("marker tracks"))
    colours = [item.get_color() for item in first.lines]
    rings = list(map(tuple, markers.ring_colours(np.arange(3))))
    assert [colours.count(colour) for colour in rings] == [1, 8, 16]
    np.testing.assert_allclose(second.lines[-1].get_ydata(), 1.0 * TIMES, atol=1e-12)
    figure = markers.marker_tracks_figure(tracks("px"))
    gaps = [int(np.isnan(np.asarray(item.get_ydata(), dtype=float)).sum()) for item in panels(figure)[0].lines]
    assert sorted(gaps) == [0] * 24 + [10]
    assert len(panels(markers.marker_tracks_figure(fs.make_tracks(np.empty((0, 2, 2)), [], units="px")))[0].lines) == 2


def test_the_longest_arrow_is_stated_and_lost_markers_are_marked():
    # The outermost marker moves by 0.2 mm away from the centre and by 1 mm along y.
    first = panels(markers.fields_figure(fs.marker_fields(tracks()), 1.0))
    assert "longest 1.2 mm" in texts(first[0])
    assert sum(isinstance(artist, Quiver) for axes in first for artist in axes.get_children()) == 3
    crosses = panels(markers.fields_figure(fs.marker_fields(tracks()), 0.5))[1].collections[-1].get_offsets()
    np.testing.assert_allclose(crosses, [1e3 * LAYOUT.position[24]], atol=1e-9)
    row = fs.make_tracks(np.tile(np.column_stack([np.arange(4.0), np.zeros(4)]), (31, 1, 1)), TIMES, units="px")
    image = panels(markers.fields_figure(fs.marker_fields(row), 0.0))
    assert image[0].yaxis_inverted()
    assert [texts(axes) for axes in image[3:6]] == [["no triangle of markers"]] * 3


def test_quality_is_counted_lost_intervals_noise_at_rest_and_jumps():
    rest = np.array([[10.0, 10.0], [30.0, 10.0], [10.0, 30.0], [30.0, 30.0]])
    position = rest + np.random.default_rng(0).normal(0, 0.1, (12, 4, 2))
    position[4:6, 2] = np.nan
    bare = fs.make_tracks(position, np.arange(12) / 10.0, units="px", attributes={"rest_frames": 3, "frame_rate": 10.0})
    noise, state = np.full((4, 2), 0.1), np.eye(12, dtype=np.int8)[5]
    still = bare.assign(
        frame_state=("time", state), reference=(("marker", "axis"), rest), rest_noise=(("marker", "axis"), noise)
    )
    count, lost = markers.count_figure(still).axes
    assert count.get_lines()[0].get_ydata().tolist() == [4, 4, 4, 4, 3, 3, 4, 4, 4, 4, 4, 4]
    (bar,) = lost.patches
    assert (bar.get_x(), bar.get_width()) == pytest.approx((0.35, 0.2))
    axes, _ = markers.noise_figure(still, np.zeros((40, 40), dtype=np.uint8)).axes
    assert np.asarray(axes.collections[0].get_offsets()) == pytest.approx(rest, abs=0.3)
    assert texts(axes) == ["0", "1", "2", "3"]
    (jumps,) = markers.jump_figure(still).axes
    # A marker without three neighbours that were seen is not judged.
    assert sum(patch.get_height() for patch in jumps.patches) == 8 * 4
    assert "no two frames" in texts(markers.jump_figure(still.isel(time=slice(0, 1))).axes[0])[0]


def test_figures_of_detectors_draw_estimates_with_their_intervals():
    points = [(4, Estimate(0.7, 0.6, 0.8), Estimate(0.6, 0.5, 0.7)), (8, Estimate(0.8, 0.7, 0.9), Estimate(0.75))]
    (axes,) = detectors.learning_curve_figure(points).axes
    assert [item.get_ydata().tolist() for item in axes.get_lines()] == [[0.7, 0.8], [0.6, 0.75]]
    assert [path.vertices[:, 1].tolist() for path in axes.collections[0].get_paths()] == [[0.6, 0.8], [0.7, 0.9]]
    assert ticks(axes) == ["4", "8"]
    (axes,) = detectors.importance_figure({0: Estimate(0.02, 0.01, 0.03), 1: Estimate(-0.01, -0.02, 0.0)}).axes
    assert [bar.get_height() for bar in axes.patches] == pytest.approx([0.02, -0.01])
    accuracy, unusable = detectors.robustness_figure(DISTURBED).axes[0].get_lines()
    assert accuracy.get_xdata().tolist() == [0.0], "no accuracy where nothing is classified"
    assert unusable.get_ydata().tolist() == [0.0, 1.0]


def test_the_order_of_slip_is_read_from_when_markers_leave_their_position_in_the_image():
    figure = drawn("markers")
    ends = [float(item.get_ydata()[-1]) for item in panels(figure)[1].lines[:5]]
    assert ends[-1] == 0.0, "the centre is drawn last, and displacements are less its own"
    assert max(ends[:-1]) < -0.1, "it slips last"
    with pytest.raises(ValueError, match="has no slide"):
        markers.slide_tracks_figure(marker_tracks(filmed_history()), NO_SLIDE)
    # A recording in axes that are turned, of the external markers alone, 2 % longer.
    simulated = marker_tracks(filmed_history(), ("external",))
    turned = fs.make_tracks(-1.02 * simulated["position"].values[:, :, [1, 0]], simulated["time"].values, units="m")
    turned = turned.assign_coords(kind=simulated["kind"])
    lost = fs.make_tracks(np.nan * turned["position"].values, turned["time"].values, units="m")
    inside, outside = panels(fs.draw(filmed_history(), "markers", recorded=turned))
    count = simulated.sizes["marker"]
    assert (len(inside.lines), len(outside.lines)) == (len(panels(figure)[0].lines), 2 * count)
    both = np.array(
        [
            sorted(float(line.get_ydata()[-1]) for line in outside.lines[part])
            for part in (slice(count), slice(count, None))
        ]
    )
    assert both[0].min() < -0.1
    assert both[1] == pytest.approx(1.02 * both[0], rel=0.02, abs=1e-3)
    for changed, kind, fault in (
        (turned, "forces", "is tracks, given for 'forces', needs the kind markers"),
        (seen(), "markers", "is in px, needs metres; fs.make_tracks"),
        (turned.assign_coords(time=turned["time"] + 99.0), "markers", "needs some in the slide, .* shift its times"),
        (turned.isel(time=[]), "markers", "sees markers up to 0 s, needs some in the slide"),
        (lost, "markers", "sees markers up to 0 s, needs some in the slide"),
    ):
        with pytest.raises(fs.InputError, match=f"recorded: .*{fault}"):
            fs.draw(filmed_history(), kind, recorded=changed)
    times, distance = markers.onsets(seen(), 1.0)
    # A pixel is 22 um, 7 ms of the plate, and a frame 10 ms.
    slip = slip_times(Process(), filmed_history()["contact_position"].values[list(NODES), 0]) - 1.0
    assert times == pytest.approx(slip, abs=0.04)
    assert (times[0], distance[0]) == (times.max(), 0.0)
    moved, where = panels(markers.slip_order_figure(seen(), 1.0, np.array([True, True, True, True, False])))
    assert (len(moved.lines), len(where.collections[0].get_offsets())) == (4 + 1, 4), "only those that touch"
    nothing = markers.slip_order_figure(seen(), 1.0, np.zeros(5, dtype=bool))
    assert "no marker touches" in texts(panels(nothing)[0])[0]


@pytest.mark.slow
def test_frames_stand_above_the_body():
    times, frame = markers.film_times(0.05, 0.1, -0.4), np.zeros((12, 16), dtype=np.uint8)
    assert times == pytest.approx((-0.4, 0.05, 0.05 + 0.05 / 3, 0.1))
    first, second, third = titles(markers.frames_figure(block_history("Q4"), dict.fromkeys(times[:2], frame)))[:3]
    assert (first, second, third[:18]) == ("frame at rest", "frame at 0.05 s", "snapshot at 0.00 s")


def test_fingertips_and_sensors_are_drawn_to_scale():
    sagittal, transverse, body = drawn("fingertip").axes[:3]
    for axes in (sagittal, transverse):
        outline = axes.collections[0].get_paths()[0].vertices
        assert outline[:, 0].max() == pytest.approx(8.0, abs=1e-3)
    assert (body.name, len(body.collections)) == ("3d", 2)
    figure = specimens.fingertip_figure(change(fingerprint={"enabled": True}))
    assert all(axes.name != "3d" for axes in figure.axes)
    ring = figure.axes[0].collections[0].get_paths()[0].vertices
    assert ring[:, 1].min() == pytest.approx(-7.05, abs=0.01)
    assert np.isfinite(ring).all()
    section, inside, below = panels(drawn("sensor"))
    assert len(section.collections[2].get_paths()) == 9, "rods in the plane of the axis"
    assert all(len(axes.collections[0].get_offsets()) == 81 for axes in (inside, below))


def test_a_meshed_section_has_its_cells_and_receptors_and_a_frame_round_what_is_drawn_closer():
    whole, close = panels(drawn("mesh"))
    (dot,) = (item for item in whole.lines if item.get_marker() == RECEPTOR_MARKS["FA-II"])
    assert dot.get_ydata()[0] == pytest.approx(5.0)
    assert sum(len(c.get_paths()) for c in whole.collections) == 16
    positions = specimens.receptor_positions(HISTORY)
    assert {kind: values.shape for kind, values in positions.items()} == dict.fromkeys(KINDS, (25, 2))
    assert specimens.receptor_positions(BARE) == {}
    for axes in (whole, close):
        assert axes.lines[0].get_ydata()[0] == pytest.approx(0.0), "the plate is where the body touches it"
    (frame,) = whole.patches
    assert close.get_xlim() == pytest.approx((frame.get_x(), frame.get_x() + 3.2))
    assert close.get_ylim() == pytest.approx((frame.get_y(), frame.get_y() + frame.get_height()))


@pytest.mark.parametrize(("side", "inside"), [(1.0, 1.0), (-1.0, -1.0)])
def test_the_plate_of_a_section_is_drawn_where_it_starts_and_the_close_view_is_of_what_it_touches_first(side, inside):
    history = block_history("Q4")
    flipped = [history[name] * [1.0, side] for name in ("counterface_normal", "node_position", "contact_position")]
    names = ("counterface_normal", "node_position", "contact_position")
    turned = history.assign_coords(dict(zip(names, flipped, strict=True)))
    turned = turned.assign(contact_displacement=turned["contact_displacement"] * [1.0, side], gap=turned["gap"] + 2e-3)
    whole, close = panels(specimens.mesh_figure(turned))
    for axes in (whole, close):
        assert axes.lines[0].get_ydata() == pytest.approx([-2.0 * side] * 2), "2 mm off the body"
    low, high = close.get_ylim()
    assert np.mean(close.get_xlim()) == pytest.approx(5.0), "the middle of the nodes that touch at the same time"
    assert (0.5 * (low + high)) * inside > 0.0, "most of it is the body"
    assert low < 0.0 < high
    assert whole.get_ylim()[0] < -2.0 * side < whole.get_ylim()[1]
    bare = history.isel(contact_node=slice(0), counterface=slice(0))
    assert "plate" not in words(specimens.mesh_figure(bare))
