"""The constants of the slip events: what they rest on, and what the documentation says of them."""

import pytest

from fingerslip.errors import InputError
from fingerslip.parameters import from_mapping
from fingerslip.published import published_set
from fingerslip.slip import EventSettings, PeakSettings
from places import ROOT

EVENTS = (ROOT / "docs" / "events.md").read_text(encoding="utf-8")
SLIP, PEAKS = EventSettings(), PeakSettings()
SPEED, STEP, WAY = 3e-3, 5e-3, 6e-3


def section(heading):
    """Return the text under a heading of the page on events, with its lines joined."""
    return " ".join(EVENTS.split(f"## {heading}")[1].split("\n## ")[0].split())


@pytest.mark.parametrize(
    ("heading", "said"),
    [
        ("From accumulated slip", f"slipped by more than {1e6 * SLIP.slip_tolerance:g} µm"),
        ("From accumulated slip", f"stays at or above {100 * SLIP.incipient_fraction:g} %"),
        *(
            ("From accumulated slip", f"the same at {100 * share:g} %")
            for share in (SLIP.noticed_fraction, SLIP.three_quarter_fraction, SLIP.overall_fraction)
        ),
        ("From accumulated slip", f"for {1e3 * SLIP.sustained:g} ms or up to the end of the slide"),
        ("From displacement", f"by more than {1e6 * SLIP.displacement_tolerance:g} µm"),
        ("From displacement", f"the same for {100 * SLIP.noticed_fraction:g} %"),
        ("From acceleration peaks", f"{' and '.join(PEAKS.kinds)} receptors"),
        ("From acceleration peaks", f"{100 * PEAKS.over_largest:g} % of the largest prominence"),
        ("From acceleration peaks", f"at least {1e3 * PEAKS.separation:g} ms from either"),
        ("From acceleration peaks", f"stays within the noise for {1e3 * PEAKS.quiet:g} ms"),
        ("From acceleration peaks", "exceed six spreads of the noise"),
        ("From acceleration peaks", "below a tenth of its own peak"),
        ("From acceleration peaks", "follows less than half of the plate's travel"),
    ],
)
def test_documentation_says_the_constants(heading, said):
    assert said in section(heading)
    assert (PEAKS.over_noise, PEAKS.transient, PEAKS.followed) == (6.0, 0.1, 0.5), "which it says in words"


def test_constants_fit_what_they_rest_on():
    assert SLIP.slip_tolerance > SPEED * STEP, "slip of one step at the published speed does not count"
    assert SLIP.slip_tolerance / SPEED <= 7e-3
    assert SLIP.displacement_tolerance == pytest.approx(WAY / 100, rel=0.2), "a node has left the line"
    assert 0.0 < SLIP.incipient_fraction < SLIP.noticed_fraction < SLIP.three_quarter_fraction < SLIP.overall_fraction
    assert SLIP.overall_fraction <= 1.0
    assert 2 * STEP < SLIP.sustained < 60e-3, "longer than a transient, shorter than the fastest reflex"
    (value,) = (v for v in published_set("wang2014-peaks").values if v.quantity == "three_quarter")
    assert value.span[1] - value.span[0] >= PEAKS.separation - 1e-12


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"slip_tolerance": "0 um"}, "slip_tolerance: got '0 um', needs a value > 0"),
        ({"slip_tolerance": 20e-6}, "slip_tolerance: '2e-05' has no unit, needs a unit of [m]; write '2e-05 um'"),
        ({"incipient_fraction": 1.2}, "incipient_fraction: got 1.2, needs a number <= 1"),
        ({"sustained": "-1 ms"}, "sustained: got '-1 ms', needs a value >= 0"),
        ({"peaks": {"per_area": 0}}, "peaks.per_area: got 0, needs a number > 0"),
    ],
)
def test_impossible_constants_are_refused(values, message):
    with pytest.raises(InputError) as caught:
        from_mapping(EventSettings, values, "f")
    assert f"f: {message}" in str(caught.value)
