"""What the data card of simulated trials says of limits and assumptions."""

from __future__ import annotations

from fingerslip.dynamics.statics.body import StaticBody
from fingerslip.study.definition.spec import Study
from fingerslip.study.definition.trial_settings import TrialSettings

__all__ = ["card_notes"]


def card_notes(study: Study, settings: TrialSettings, body: StaticBody) -> str:
    """Return the notes of a data card in Markdown."""
    ranges = study.sample.ranges if study.sample else {}
    noise = " to ".join(f"{value:g}" for value in settings.noise)
    return "\n".join(
        [
            "## What these trials are",
            "",
            "Simulated, not measured: half an upright sensor slides along its plane of symmetry, without inertia,",
            f"in steps of {1e3 * study.time.stepping.step:g} ms, joined by straight lines. The other half",
            f"is its mirror image, and the {settings.directions} directions are this slide turned about the axis.",
            "",
            "**Strains are small.** In the section of this sensor that is wrong by 60 % of the normal force at 2 mm of",
            "indentation and by 134 % at 3 mm: the kind of slip is shown, not its travel and not its force.",
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
            "The tilt of the plate lies in the plane of the slide. External markers are seen where they touch when the",
            "film begins. Normal and friction forces in the conditions are those of the whole sensor.",
        ]
    )
