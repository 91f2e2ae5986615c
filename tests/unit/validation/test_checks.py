"""Every check of a published statement on evidence for which it holds, and on evidence for which it fails."""

from dataclasses import replace

import pytest

from fingerslip.published import published_set
from fingerslip.results import RunResult
from fingerslip.slip import Events, Peak, PeakTable, SlipEvents
from fingerslip.validation.checks import FINGERPRINT_CHECKS, FRICTION_CHECKS, PHALANX_CHECKS, outcome_of
from fingerslip.validation.evidence import FINGERPRINT, FRICTION, VARIANT, VARIANTS, Evidence
from fingerslip.validation.measures import Densities, Measures
from fingerslip.validation.rows import statement_row

PLACES = [(kind, area) for kind in ("FA-I", "SA-I", "FA-II", "SA-II") for area in ("A", "B")]
DENSITIES = Densities(
    growth=dict.fromkeys(PLACES, 1.2),
    range_after=dict.fromkeys(PLACES, 0.01),
    mean_after={place: 40.0 if place[1] == "B" else 20.0 for place in PLACES},
)
LARGEST = {"FA-I": 0.3, "SA-I": 0.2, "FA-II": 0.05, "SA-II": 0.1}


def one(swept, incipient, overall, peaks, **others):
    """Return the measures of a run; the first peak is read as incipient slip, the last one as overall slip."""
    times = sorted(peaks)
    read = SlipEvents(times[0] if len(times) > 1 else None, overall=times[-1] if times else None)
    events = Events(slip=SlipEvents(incipient=incipient, overall=overall), acceleration=read)
    table = PeakTable(tuple(Peak(time, peaks[time], peaks[time]) for time in times), others.pop("floor", 0.01))
    defaults = {"largest_acceleration": LARGEST, "centre_after_edge": 0.1, "densities": DENSITIES, "rms_after": 0.01}
    return Measures(RunResult("run", dict(swept), events), table, **(defaults | others))


def as_published():
    """Return evidence as the paper describes it."""
    original = {1.53: 0.054, 1.63: 0.1, 1.71: 0.637}
    phalanges = (
        one({VARIANT: "original"}, 1.53, 1.71, original),
        one({VARIANT: "flattened"}, 1.50, 1.72, {1.50: 0.058, 1.72: 0.423}),
        one({VARIANT: "scaled"}, 1.48, 1.77, {1.48: 0.07, 1.77: 0.275}),
    )
    frictions = (
        one({FRICTION: 0.2}, 1.20, 1.25, {1.20: 0.1, 1.25: 0.6}, rms_after=0.05),
        one({FRICTION: 0.4}, 1.36, 1.48, {1.36: 0.1, 1.48: 0.6}),
        one({FRICTION: 0.6}, 1.53, 1.71, original),
        one({FRICTION: 0.8}, 1.70, 1.89, {1.70: 0.05, 1.89: 0.5}),
    )
    without = tuple(replace(phalanx, run=relabelled(phalanx, False)) for phalanx in phalanges)
    ripples = ((1.71, 0.3, 0.01), (1.72, 0.5, 0.01), (1.77, 0.3, 0.03))
    with_ripples = tuple(
        one({FINGERPRINT: True, VARIANT: variant}, None, time, {time: height}, floor=0.05, rms_after=rms)
        for variant, (time, height, rms) in zip(VARIANTS, ripples, strict=True)
    )
    studies = {"table2": phalanges, "friction": frictions, "fingerprint": (*without, *with_ripples)}
    return Evidence({f"wang2014_{name}": runs for name, runs in studies.items()})


def relabelled(measures, fingerprint):
    return replace(measures.run, swept={FINGERPRINT: fingerprint, **measures.run.swept})


def changed(study, place, **values):
    """Return the evidence as published, with one run of a study changed."""
    measured = dict(as_published().measured)
    name = f"wang2014_{study}"
    runs = list(measured[name])
    runs[place] = replace(runs[place], **values)
    return Evidence(measured | {name: tuple(runs)})


def with_events(study, place, incipient, overall):
    run = as_published().measured[f"wang2014_{study}"][place].run
    slip = SlipEvents(incipient=incipient, overall=overall)
    return changed(study, place, run=replace(run, events=replace(run.events, slip=slip)))


def with_peaks(study, place, peaks, **others):
    old = as_published().measured[f"wang2014_{study}"][place]
    new = one(old.run.swept, old.run.events.slip.incipient, old.run.events.slip.overall, peaks, **others)
    return changed(study, place, run=new.run, peaks=new.peaks)


def with_densities(name, value):
    return changed(
        "table2", 0, densities=replace(DENSITIES, **{name: {**getattr(DENSITIES, name), ("FA-II", "B"): value}})
    )


FAILING = {
    "overall-order": with_events("table2", 2, 1.48, 1.70),
    "latency-order": with_events("table2", 1, 1.60, 1.72),
    "overall-peak-order": with_peaks("table2", 2, {1.48: 0.07, 1.77: 0.7}),
    "linear-in-friction": with_events("friction", 3, 1.70, 2.60),
    "latency-grows-with-friction": with_events("friction", 2, 1.64, 1.71),
    "latency-flattens-with-friction": with_events("friction", 3, 1.65, 1.95),
    "surface-receptors-feel-more": changed("table2", 0, largest_acceleration=LARGEST | {"SA-II": 0.25}),
    "edges-first": changed("table2", 2, centre_after_edge=-0.01),
    "density-rises": with_densities("growth", 0.9),
    "density-then-stays": with_densities("range_after", 0.3),
    "density-larger-in-b": with_densities("mean_after", 19.0),
    "flattened-without-middle-peaks": with_peaks("table2", 1, {1.50: 0.058, 1.60: 0.1, 1.72: 0.423}),
    "scaled-middle-peaks-merge": with_peaks("table2", 2, {1.48: 0.07, 1.60: 0.1, 1.77: 0.275}),
    "fingerprint-adds-noise": with_peaks("fingerprint", 5, {1.77: 0.3}, floor=0.005),
    "fingerprint-hides-incipient": with_peaks("fingerprint", 5, {1.50: 0.2, 1.77: 0.3}),
    "fingerprint-leaves-overall": with_peaks("fingerprint", 5, {}),
    "fingerprint-flattened-peak": with_peaks("fingerprint", 4, {1.72: 0.2}),
    "fingerprint-scaled-vibrates": changed("fingerprint", 5, rms_after=0.005),
    "low-friction-vibrates": changed("friction", 0, rms_after=0.005),
    "high-friction-loses-middle-peaks": with_peaks("friction", 3, {1.70: 0.05, 1.80: 0.1, 1.89: 0.5}),
    "high-friction-smaller-peaks": with_peaks("friction", 3, {1.70: 0.05, 1.89: 0.7}),
}
UNLIKE = with_peaks("table2", 0, {1.53: 0.054, 1.71: 0.637})  # absent peaks prove nothing where the original has none
STATEMENTS = {value.id: value for value in published_set("wang2014-qualitative").values}


def verdict(name, evidence):
    return statement_row(STATEMENTS[name], outcome_of(name, evidence), None).verdict


def test_every_published_statement_has_a_check_and_those_of_phalanges_need_the_phalanges_only():
    assert set(STATEMENTS) == {*PHALANX_CHECKS, *FRICTION_CHECKS, *FINGERPRINT_CHECKS} == set(FAILING)
    alone = Evidence({"wang2014_table2": as_published().measured["wang2014_table2"]})
    assert {verdict(name, alone) for name in PHALANX_CHECKS} == {"holds"}
    # Density may be larger at either edge, but at the same one for all types.
    swapped = {(kind, "A" if area == "B" else "B"): value for (kind, area), value in DENSITIES.mean_after.items()}
    other = changed("table2", 0, densities=replace(DENSITIES, mean_after=swapped))
    assert verdict("density-larger-in-b", other) == "holds"


@pytest.mark.parametrize(
    ("name", "evidence"),
    [*FAILING.items(), ("flattened-without-middle-peaks", UNLIKE), ("scaled-middle-peaks-merge", UNLIKE)],
)
def test_check_holds_for_what_the_paper_describes_and_fails_for_the_opposite(name, evidence):
    assert verdict(name, as_published()) == "holds"
    assert verdict(name, evidence) == "fails"


NOT_FOUND = [
    ("overall-order", with_events("table2", 1, 1.5, None)),
    ("latency-order", with_events("table2", 0, None, 1.71)),
    ("overall-peak-order", with_peaks("table2", 0, {})),
    ("linear-in-friction", with_events("friction", 3, 1.7, None)),
    ("latency-grows-with-friction", with_events("friction", 0, None, 1.25)),
    ("latency-flattens-with-friction", with_events("friction", 3, None, 1.89)),
    ("surface-receptors-feel-more", changed("table2", 0, largest_acceleration={"FA-I": 0.1})),
    ("edges-first", changed("table2", 0, centre_after_edge=None)),
    *((f"density-{name}", changed("table2", 0, densities=None)) for name in ("rises", "then-stays", "larger-in-b")),
    ("fingerprint-scaled-vibrates", changed("fingerprint", 5, rms_after=None)),
    ("low-friction-vibrates", changed("friction", 0, rms_after=None)),
    ("high-friction-smaller-peaks", with_peaks("friction", 3, {})),
]


@pytest.mark.parametrize(("name", "evidence"), NOT_FOUND)
def test_check_tells_nothing_where_an_event_did_not_happen(name, evidence):
    assert outcome_of(name, evidence) is None
    assert verdict(name, evidence) == "not found"


def test_numbers_are_those_of_the_evidence():
    wanted = {
        "overall-order": 0.01,
        "latency-grows-with-friction": 0.18 / 0.05,
        "latency-flattens-with-friction": 0.01 / 0.065,
        "surface-receptors-feel-more": 2.0,
        "density-larger-in-b": 2.0,
        "fingerprint-leaves-overall": 3.0,
    }
    assert {name: outcome_of(name, as_published()) for name in wanted} == pytest.approx(wanted)
    assert outcome_of("flattened-without-middle-peaks", as_published()) == (1, 0)
