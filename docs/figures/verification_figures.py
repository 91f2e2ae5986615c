"""Draw the figures of the page on verification from the same runs as its table.

Run it in the repository's folder: python docs/figures/verification_figures.py
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes

from fingerslip.tables.table import to_markdown
from fingerslip.verification import blocks, line, sphere

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
from problems.verification import locking

mpl.use("Agg")
plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False})

FOLDER = Path(__file__).parent
BLUE, RED, GREY = "#2166ac", "#b2182b", "0.45"


def save(name: str) -> None:
    """Write the current figure."""
    plt.tight_layout()
    plt.savefig(FOLDER / f"verification-{name}.png", dpi=150)
    plt.close()


def mark(axes: Axes, x: np.ndarray, y: np.ndarray, colour: str, label: str) -> None:
    """Draw computed values as dots."""
    axes.plot(x, y, "o", color=colour, markersize=3.2, label=label)


def line_contact() -> None:
    """Pressure of Hertz and shear traction of Cattaneo."""
    history = line.pressed_and_slid("round")
    x, pressure, traction, _ = line.order_nodes(history)
    fine = np.linspace(-1.3, 1.3, 1001)
    _, (left, right) = plt.subplots(1, 2, figsize=(8.0, 3.2), sharey=True)
    half_width, peak = line.closed_form(float(history["counterface_force"].values[line.STEPS, 0, 1]))
    left.plot(fine, line.semicircle(fine, 1.0), color=GREY, label="Hertz")
    mark(left, x / half_width, pressure[line.STEPS] / peak, BLUE, "computed")
    left.set(xlabel="x / a", ylabel="p / p$_0$", xlim=(-1.3, 1.3))
    left.legend(loc="upper right", fontsize=8)
    for wanted, colour in ((0.3, BLUE), (0.6, RED), (0.9, "#1b7837")):
        step = line.nearest_step(history, wanted)
        tangential, normal = history["counterface_force"].values[step, 0]
        half_width, peak = line.closed_form(float(normal))
        ratio = float(tangential / (line.MU * normal))
        stick = np.sqrt(1 - ratio)
        right.plot(fine, line.semicircle(fine, 1.0) - stick * line.semicircle(fine, stick), color=colour, lw=1)
        mark(right, x / half_width, traction[step] / (line.MU * peak), colour, f"Q / (µP) = {ratio:.2f}")
    right.set(xlabel="x / a", ylabel="t / (µ p$_0$)", xlim=(-1.3, 1.3), ylim=(0, 1.32))
    right.tick_params(labelleft=True)
    right.legend(loc="upper center", fontsize=8, ncols=2, title="dots computed, lines Cattaneo", title_fontsize=8)
    save("line")


def ball() -> None:
    """Pressure and shear traction under the ball over the distance from its axis."""
    history = sphere.slid()
    distance = sphere.radii(history)
    fine = np.linspace(0, 1.3, 1001)

    def dome(x: np.ndarray, edge: float) -> np.ndarray:
        return np.sqrt(np.maximum(1 - (x / edge) ** 2, 0.0))

    _, (left, right) = plt.subplots(1, 2, figsize=(8.0, 3.2), sharey=True)
    for step, axes in ((10, left), (16, right)):
        tangential, _, normal = 2 * history["counterface_force"].values[step, 0]
        radius = float((3 * normal * sphere.RADIUS / (4 * sphere.PLANE_MODULUS)) ** (1 / 3))
        peak = 3 * normal / (2 * np.pi * radius**2)
        ratio = float(tangential / (sphere.MU * normal))
        stick = (1 - ratio) ** (1 / 3)
        if step == 10:
            axes.plot(fine, dome(fine, 1.0), color=GREY, label="Hertz")
            mark(axes, distance / radius, history["normal_traction"].values[step] / peak, BLUE, "computed")
        else:
            axes.plot(fine, dome(fine, 1.0) - stick * dome(fine, stick), color=GREY, label="Mindlin")
            along = history["tangential_traction"].values[step, :, 0] / (sphere.MU * peak)
            mark(axes, distance / radius, along, RED, f"computed, Q / (µP) = {ratio:.2f}")
        axes.set(xlabel="r / a", xlim=(0, 1.3), ylim=(0, 1.15))
        axes.legend(loc="upper right", fontsize=8)
    left.set_ylabel("p / p$_0$")
    right.set_ylabel("t / (µ p$_0$)")
    right.tick_params(labelleft=True)
    save("sphere")


def cycle() -> None:
    """Tangential force over displacement of the ball, in one cycle."""
    history = sphere.press_and_cycle()
    force, moved = (
        2 * history["counterface_force"].values[10:, 0, 0],
        history["counterface_displacement"].values[10:, 0, 0],
    )
    normal = 2 * float(history["counterface_force"].values[10, 0, 2])
    full, largest = sphere.MU * normal, float(force[20])
    virgin = np.linspace(0, largest, 200)
    top = float(sphere.mindlin_displacement(largest, normal))
    down = np.linspace(largest, -largest, 400)
    back = top - 2 * sphere.mindlin_displacement((largest - down) / 2, normal)
    _, axes = plt.subplots(figsize=(5.0, 3.6))
    axes.plot(1e6 * sphere.mindlin_displacement(virgin, normal), virgin / full, color=GREY, label="Mindlin, Masing")
    axes.plot(1e6 * back, down / full, color=GREY)
    axes.plot(-1e6 * back, -down / full, color=GREY)
    mark(axes, 1e6 * moved, force / full, BLUE, "computed")
    axes.set(xlabel="displacement [µm]", ylabel="Q / (µP)")
    axes.legend(loc="upper left", fontsize=8)
    save("cycle")


def springs() -> None:
    """Coulomb oscillator and stick-slip."""
    _, (left, right) = plt.subplots(1, 2, figsize=(8.0, 3.2))
    history = blocks.coulomb_oscillator("Q4")
    times, place = history["time"].values, 1e3 * history["displacement"].values[:, 0, 0]
    dead = 1e3 * 0.5 * blocks.LOAD / blocks.STIFFNESS
    first = -dead + np.sqrt(dead**2 + (1e3 * blocks.START_SPEED / blocks.ROTATION) ** 2)
    left.plot(times, place, color=BLUE, label="computed")
    quarter = 0.25 * 2 * np.pi / blocks.ROTATION
    ends = np.array([quarter, 19 * quarter])
    envelope = first - 4 * dead * (ends - quarter) / (4 * quarter)
    left.plot(ends, envelope, "--", color=GREY, label="4 µN/k per cycle")
    left.plot(ends, -envelope, "--", color=GREY)
    left.axhspan(-dead, dead, color="0.9", label="|x| < µN/k")
    left.set(xlabel="time [s]", ylabel="x [mm]")
    left.legend(fontsize=8, loc="lower right")
    history = blocks.stick_slip("Q4")
    times, place = history["time"].values, 1e3 * history["displacement"].values[:, 0, 0]
    middle = 1e3 * blocks.KINETIC * blocks.LOAD / blocks.STIFFNESS
    right.plot(times, place, color=BLUE, label="computed")
    for sign in (-1, 1):
        label = "closed form" if sign > 0 else None
        right.axhline(middle + sign * 500 * blocks.SWING, color=GREY, ls="--", label=label)
    top = float(times[np.argmax(place)])
    for number in range(7):
        at = top % blocks.PERIOD + number * blocks.PERIOD
        if at < times[-1]:
            right.axvline(at, color=GREY, lw=0.6, ls=":")
    right.set(xlabel="time [s]", ylabel="x [mm]", ylim=(-0.5, 7.5))
    right.legend(fontsize=8, loc="upper right", ncols=2)
    save("springs")


def element_errors() -> None:
    """Errors of the elements over their unknowns; prints the table beside it."""
    colours = {"Q4": BLUE, "H8": BLUE, "T3": RED, "T4": RED, "T6": "#1b7837", "T10": "#1b7837"}
    _, panels = plt.subplots(1, 2, figsize=(8.0, 4.2), sharey=True)
    for dim, axes in zip((2, 3), panels, strict=True):
        for kind in (kind for kind in locking.KINDS if kind.dim == dim):
            for ratio, line_style in zip(locking.RATIOS, (":", "-"), strict=True):
                levels = locking.levels(kind, ratio)
                axes.loglog(
                    [level.unknowns for level in levels],
                    [level.error for level in levels],
                    ls=line_style,
                    marker="x" if kind.locks else "o",
                    markersize=4,
                    lw=1.2,
                    color=colours[kind.element] if kind.integration != "nodal" else "#e08214",
                    label=kind.name if ratio == locking.RATIOS[1] else None,
                )
        axes.set(xlabel="unknowns", title=f"{'plane strain' if dim == 2 else 'slice in 3D'}")
        axes.legend(fontsize=8, loc="lower left", title="dotted ν = 0.48, full ν = 0.4999", title_fontsize=8)
    panels[0].set_ylabel("error in L$_2$ / displacement")
    panels[1].tick_params(labelleft=True)
    save("locking")
    sys.stdout.write(to_markdown(locking.error_table()))


if __name__ == "__main__":
    element_errors()
    line_contact()
    ball()
    cycle()
    springs()
