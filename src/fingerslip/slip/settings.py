"""The constants in the definitions of the slip events, and the reason for each.

None is fitted to a published time. Overall slip hardly depends on them. Incipient slip does, above all on the tolerance
and the area fraction, because slip spreads gradually from the edges; compare it only between runs with equal constants.
"""

from __future__ import annotations

from typing import Annotated

import pydantic

from fingerslip.parameters import Duration, Fraction, NonNegativeNumber, parameters
from fingerslip.units import Unit

Micrometres = Annotated[float, Unit("m", "um"), pydantic.Field(gt=0)]


@parameters
class PeakSettings:
    """How acceleration peaks at the receptors are distinguished from noise.

    Parameters
    ----------
    kinds : tuple of str
        Receptor types whose acceleration is read: FA-I and SA-I, which lie under the surface and feel
        slip most.
    per_area : int
        Receptors per type and edge of the contact: five, so ten of a type as in the published study.
    over_noise : float
        A peak counts when its prominence, and its height over the noise floor, exceed this many noise spreads
        [-]; 6 makes a chance peak unlikely in the few hundred records of a slide.
    over_largest : float
        A peak also has to exceed this share of the largest peak's prominence [-]; below 0.02 nobody sees it
        in a plot.
    separation : float
        Peaks closer than this are one, the highest [s]; 20 ms separates the two published three-quarter peaks.
    transient : float
        The rough end of the press-to-slide transient is where the signal stays below this share of its first
        peak [-].
    quiet : float
        The transient is over once the signal stays within the noise for this long [s].
    followed : float
        After overall slip the skin follows less than this share of the plate's travel [-].
    sites : tuple of str
        Names of the sites to read instead of the receptors around the edges, such as reference nodes.
    """

    kinds: tuple[str, ...] = ("FA-I", "SA-I")
    per_area: Annotated[int, pydantic.Field(gt=0)] = 5
    over_noise: NonNegativeNumber = 6.0
    over_largest: Fraction = 0.02
    separation: Duration = 0.02
    transient: Fraction = 0.1
    quiet: Duration = 0.02
    followed: Fraction = 0.5
    sites: tuple[str, ...] = ()


@parameters
class EventSettings:
    """Constants of the slip events."""

    slip_tolerance: Annotated[
        Micrometres,
        "Accumulated slip from which a node counts as slipped [m]. A plate at 3 mm/s travels less in one step of 5 "
        "ms, so a node that slips only in the step in which the plate's velocity jumps does not count; overall slip "
        "comes at most 7 ms later at that speed.",
    ] = 20e-6
    displacement_tolerance: Annotated[
        Micrometres,
        "Distance from which a node lags the plate [m]: about a hundredth of a travel of 6 mm, the least that shows "
        "in a plot of it.",
    ] = 50e-6
    incipient_fraction: Annotated[
        Fraction, "Area fraction slipped at incipient slip [-]: a tenth is more than one node of a coarse contact mesh."
    ] = 0.10
    noticed_fraction: Annotated[Fraction, "Area fraction slipped when people notice slip [-] (Barrea et al. 2018)."] = (
        0.48
    )
    three_quarter_fraction: Annotated[
        Fraction, "Area fraction slipped shortly before overall slip [-] (Johansson and Westling 1987)."
    ] = 0.75
    overall_fraction: Annotated[
        Fraction, "Area fraction slipped at overall slip [-]: all, up to rounding of areas."
    ] = 0.995
    sustained: Annotated[
        Duration,
        "An event counts when its condition holds for this long, or up to the end of the slide [s]: less than the "
        "fastest grip reflex (60 ms), more than the transient of a velocity jump.",
    ] = 0.05
    peaks: Annotated[PeakSettings, "How acceleration peaks are read."] = PeakSettings()
