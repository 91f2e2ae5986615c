"""Histories of an idealised press and slide whose slip events are known exactly.

A flat patch of half width `HALF_WIDTH` is pressed for `PRESS_END` seconds, then the plate moves at `SPEED`.
Each node goes along with the plate and stops when slip reaches it; slip travels from both edges to the centre
at constant speed, from `edge` to `centre` seconds.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from fingerslip.contact.states import OPEN, SLIP, STICK
from fingerslip.history import make_history

PRESS_END, END, SPEED, HALF_WIDTH = 1.0, 2.0, 3e-3, 4e-3
KINDS = ("FA-I", "SA-I", "FA-II", "SA-II")
DEPTHS = {"FA-I": 0.5e-3, "SA-I": 0.6e-3, "FA-II": 3e-3, "SA-II": 1.5e-3}


@dataclass(frozen=True)
class Process:
    """What happens in a synthetic history."""

    edge: float = 1.30
    centre: float = 1.71
    step: float = 5e-3
    nodes: int = 41
    open_nodes: int = 4
    noise: float = 0.0
    jump: bool = True
    friction: float = 0.6
    peaks: dict[float, float] = field(default_factory=lambda: {1.53: 0.054, 1.63: 0.12, 1.71: 0.637})
    phases: tuple[tuple[str, float, float], ...] = (("press", 0.0, PRESS_END), ("slide", PRESS_END, END))
    seed: int = 1


def slip_times(process: Process, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return when slip reaches places `x` [s]."""
    return process.edge + (process.centre - process.edge) * (1.0 - np.abs(x) / HALF_WIDTH)


def make(process: Process) -> xr.Dataset:
    """Make the history of a process."""
    times = np.arange(0.0, END + 0.5 * process.step, process.step)
    plate = SPEED * np.clip(times - PRESS_END, 0.0, None)
    values = {"time": times, "component": ["x", "y"], **_phases(process)}
    values |= _body(times, plate, process) | _contact(times, plate, process)
    values |= _sites(times, plate, process) | _energies(times, plate)
    return make_history(values, {"title": "synthetic press and slide"})


def with_mesh(history: xr.Dataset) -> xr.Dataset:
    """Return a synthetic history with a mesh of one square."""
    values = {str(name): history[name].values for name in history.variables}
    values["node_position"] = [[-6e-3, -6.5e-3], [6e-3, -6.5e-3], [6e-3, 5.5e-3], [-6e-3, 5.5e-3]]
    values |= {"cell_nodes": [[0, 1, 2, 3]], "cell_region": [0]}
    return make_history(values, {**history.attrs, "element": "Q4", "regions": "tissue"})


def _phases(process: Process) -> dict[str, object]:
    kinds, starts, ends = zip(*process.phases, strict=True)
    return {"phase_kind": list(kinds), "phase_start": list(starts), "phase_end": list(ends)}


def _body(times: NDArray[np.float64], plate: NDArray[np.float64], process: Process) -> dict[str, object]:
    lift = 1.5e-3 * np.clip(times / PRESS_END, 0.0, 1.0)
    normal = 0.4 * (lift / 1.5e-3) ** 1.5
    tangential = process.friction * normal * np.clip((times - PRESS_END) / (process.centre - PRESS_END), 0.0, 1.0)
    way = np.stack([plate, lift], axis=-1)[:, None]
    return {
        "counterface": ["skin"],
        "counterface_normal": [[0.0, 1.0]],
        "counterface_friction_coefficient": [process.friction],
        "counterface_displacement": way,
        "counterface_velocity": np.gradient(way, times, axis=0),
        "counterface_force": np.stack([tangential, normal], axis=-1)[:, None],
        "friction_utilisation": np.clip((times - PRESS_END) / (process.centre - PRESS_END), 0.0, 1.0)[:, None],
        "largest_friction_utilisation": (times > PRESS_END).astype(float)[:, None],
    }


def _contact(times: NDArray[np.float64], plate: NDArray[np.float64], process: Process) -> dict[str, object]:
    x = np.linspace(-HALF_WIDTH, HALF_WIDTH, process.nodes)
    spacing = x[1] - x[0]
    extra = HALF_WIDTH + spacing * np.arange(1, process.open_nodes + 1)
    x = np.concatenate((x, extra))
    inside = np.abs(x) <= HALF_WIDTH + 1e-9
    begin = slip_times(process, x)
    way = np.clip(plate[:, None] - SPEED * (begin - PRESS_END), 0.0, None)
    if process.jump:
        way = way + np.where(times > PRESS_END, SPEED * process.step, 0.0)[:, None]
    touching = inside & (np.abs(x) <= HALF_WIDTH * np.sqrt(np.clip(times / PRESS_END, 0.0, 1.0))[:, None] + 1e-9)
    slipping = times[:, None] > begin + 1e-9
    if process.jump:
        slipping |= (np.abs(times - PRESS_END - process.step) < 0.5 * process.step)[:, None]
    state = np.where(touching, np.where(slipping, SLIP, STICK), OPEN)
    slip = np.where(inside, way, 0.0)
    along = np.where(inside, plate[:, None] - slip, plate[:, None] * 0.8)
    noise = process.noise * 2e-6 * np.random.default_rng(process.seed).standard_normal(along.shape)
    displacement = np.stack([along + noise, np.zeros_like(along)], axis=-1)
    pressure = np.where(touching, 3e3 * np.sqrt(np.clip(1.0 - (x / (1.01 * HALF_WIDTH)) ** 2, 0.0, None)), 0.0)
    return {
        "contact_node": 100 + np.arange(x.size),
        "contact_counterface": np.zeros(x.size, dtype=int),
        "contact_position": np.stack([x, np.full(x.size, -6.5e-3)], axis=-1),
        "contact_area": np.full(x.size, spacing * 1e-3),
        "contact_edge_distance": np.full(x.size, np.inf),
        "contact_displacement": displacement,
        "contact_velocity": np.gradient(displacement, times, axis=0),
        "contact_acceleration": np.gradient(np.gradient(displacement, times, axis=0), times, axis=0),
        "contact_state": state,
        "slip_distance": slip,
        "gap": np.where(touching, -1e-6, 1e-4),
        "normal_traction": pressure,
        "tangential_traction": (process.friction * pressure * (state == SLIP))[..., None] * [1.0, 0.0],
    }


def _sites(times: NDArray[np.float64], plate: NDArray[np.float64], process: Process) -> dict[str, object]:
    places = np.linspace(-6e-3, 6e-3, 25)
    kinds = np.repeat(KINDS, places.size)
    x = np.tile(places, len(KINDS))
    depth = np.array([DEPTHS[kind] for kind in kinds])
    share = np.exp(-depth / 2e-3)
    acceleration = share * pulses(times, process)[:, None]
    rng = np.random.default_rng(process.seed)
    acceleration = acceleration + process.noise * 4e-3 * rng.standard_normal(acceleration.shape)
    skin = share * np.minimum(plate, SPEED * (process.centre - PRESS_END))[:, None]
    density = 40.0 * share * np.clip(times, 0.0, process.centre)[:, None] ** 2 * (1.0 + 0.2 * np.sign(x))
    zero = np.zeros_like(skin)
    return {
        "site": [f"{kind}-{number}" for kind, number in zip(kinds, np.tile(np.arange(25), len(KINDS)), strict=True)],
        "site_kind": kinds,
        "site_region": ["dermis"] * kinds.size,
        "site_position": np.stack([x, depth - 6.5e-3], axis=-1),
        "displacement": np.stack([skin, zero], axis=-1),
        "velocity": np.stack([np.gradient(skin, times, axis=0), zero], axis=-1),
        "acceleration": np.stack([acceleration, 0.3 * acceleration], axis=-1),
        "strain_energy_density": density,
    }


def pulses(times: NDArray[np.float64], process: Process) -> NDArray[np.float64]:
    """Return the acceleration at the surface: a ringing start of the slide, and one pulse for each peak [m/s^2]."""
    signal = np.zeros_like(times)
    if process.jump:
        since = times - PRESS_END
        signal += np.where(since > 0.0, 2.0 * np.exp(-since / 0.015) * np.cos(2.0 * np.pi * 60.0 * since), 0.0)
    for moment, height in process.peaks.items():
        signal -= height * np.exp(DEPTHS["FA-I"] / 2e-3) * np.exp(-(((times - moment) / 6e-3) ** 2))
    return signal


def _energies(times: NDArray[np.float64], plate: NDArray[np.float64]) -> dict[str, object]:
    strain = 2e-4 * np.clip(times / PRESS_END, 0.0, 1.0) ** 2.5 + 0.05 * np.minimum(plate, 2e-3)
    friction = 0.2 * np.clip(plate - 2e-3, 0.0, None)
    return {
        "kinetic_energy": np.full(times.size, 1e-9),
        "strain_energy": strain,
        "contact_energy": 0.02 * strain,
        "friction_dissipation": friction,
        "damping_dissipation": np.zeros(times.size),
        "viscous_dissipation": np.zeros(times.size),
        "numerical_dissipation": 1e-3 * strain,
        "external_work": 1.021 * strain + friction,
        "energy_imbalance": np.full(times.size, 1e-12),
        "contact_iterations": np.ones(times.size, dtype=int),
        "contact_residual": np.zeros(times.size),
    }
