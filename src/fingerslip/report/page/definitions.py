"""How the slip events of a report are defined, in sentences."""

from __future__ import annotations

from fingerslip.slip import EventSettings

__all__ = ["definitions"]


def definitions(settings: EventSettings) -> dict[str, str]:
    """Return a sentence for each reading, by its name, that defines its slip events, and one on latency."""
    latency = "Latency is the time from incipient to overall slip."
    return {
        "slip": _by_slip(settings),
        "displacement": _by_displacement(settings),
        "acceleration": _by_acceleration(settings),
        "latency": latency,
    }


def _by_slip(settings: EventSettings) -> str:
    first, *others, last = _shares(settings)
    return (
        f"From accumulated slip: incipient, noticed, three-quarter and overall slip are the first times from which at "
        f"least {', '.join((first, *others))} and {last} of the area that has been in contact since the slide began "
        f"has slipped by more than {1e6 * settings.slip_tolerance:g} µm since then, for "
        f"{1e3 * settings.sustained:g} ms or up to the end of the slide."
    )


def _by_displacement(settings: EventSettings) -> str:
    _, noticed, three_quarter, _ = _shares(settings)
    return (
        f"From displacement: the times at which the first node, {noticed}, {three_quarter} and all of the nodes in "
        f"contact at the start of the slide lag the plate by more than {1e6 * settings.displacement_tolerance:g} µm."
    )


def _by_acceleration(settings: EventSettings) -> str:
    peaks = settings.peaks
    return (
        f"From acceleration peaks: overall slip is the most prominent peak of the largest acceleration along the plate "
        f"at {' and '.join(peaks.kinds)} around the edges of the contact, after the transient of the press-to-slide "
        f"change and provided that the skin then follows less than {100 * peaks.followed:g} % of the plate's travel. "
        f"Incipient slip is the first peak before it that exceeds the noise by {peaks.over_noise:g} spreads, "
        f"three-quarter slip the most prominent peak between these two."
    )


def _shares(settings: EventSettings) -> list[str]:
    shares = (
        settings.incipient_fraction,
        settings.noticed_fraction,
        settings.three_quarter_fraction,
        settings.overall_fraction,
    )
    return [f"{100 * share:g} %" for share in shares]
