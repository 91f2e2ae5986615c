"""What the data card of simulated trials says of limits and assumptions."""

from __future__ import annotations

from fingerslip.dynamics.statics.body import StaticBody
from fingerslip.study.definition.settings import TrialSettings
from fingerslip.study.definition.spec import Study
from fingerslip.study.trials.plates import plate_of

__all__ = ["card_notes"]


def card_notes(study: Study, settings: TrialSettings, body: StaticBody) -> str:
    """Return the notes of a data card in Markdown."""
    ranges = study.sample.ranges if study.sample else {}
    plate = plate_of(study)
    falls = plate is not None and bool(plate.free)
    does = (
        "carries half a plate, which falls along its plane of symmetry"
        if falls
        else "slides along its plane of symmetry"
    )
    noise = " to ".join(f"{value:g}" for value in settings.noise)
    return "\n".join(
        [
            "## What these trials are",
            "",
            f"Simulated, not measured: half an upright sensor {does}, without inertia,",
            f"in steps of {1e3 * study.time.stepping.step:g} ms, joined by straight lines. The other half",
            f"is its mirror image; directions: {settings.directions}, this motion turned about the axis.",
            "",
            "**Strains are small.** That is wrong by 14 % of the normal force at 2 mm of indentation and 27 % at 3 mm",
            "(docs/tactip.md): the kind of slip is shown, not its travel and not its force.",
            f"Contact: {len(body.nodes)} patches of {1e3 * settings.patch:g} mm with constant traction.",
            "",
            "## What is assumed",
            "",
            "The paper prints none of these values. Each trial draws its own from the range, evenly:",
            "",
            "| value | range |",
            "|---|---|",
            *(f"| `{path}` | {low} to {high} |" for path, (low, high) in ranges.items()),
            f"| standard deviation of positions | {noise} px |",
            f"| camera beside the axis, along both axes | up to {1e3 * settings.shift:g} mm |",
            f"| camera turned about its axis | up to {settings.turn:.3g} rad |",
            "",
            f"A pixel is {1e3 * settings.metres_per_pixel:.4g} mm; {settings.frame_rate:.4g} frames a second.",
            "The tilt of the plate lies in the plane of its motion. External markers are seen where they touch when",
            "the film begins. Forces and loads in the conditions are those of the whole sensor.",
        ]
    )
