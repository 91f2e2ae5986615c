"""Rigid pads hold an object: how far it slides until a growing grip stops it, in closed form."""

from __future__ import annotations

import math

__all__ = ["travel_after"]


def travel_after(
    mass: float, latency: float, limit_rate: float, *, excess: float = 0.0, load_rate: float = 0.0
) -> float:
    """Return the travel [m] of an object whose load exceeds the slip limit, and that a growing grip stops.

    Two pads press an object of mass m; friction bears the limit 2 mu N. The load exceeds it by e at once, and grows on
    at the rate rho. After the latency tau the limit grows at R = 2 mu dN/dt; from then on, with q = R - rho, ::

        v0 = (e tau + rho tau^2 / 2) / m,    m dv/ds = e + rho tau - q s,    v(s) = 0

    Parameters
    ----------
    mass : float
        Mass of the object [kg].
    latency : float
        Time from when the load reaches the limit to the growth of the grip [s].
    limit_rate : float
        Rate at which the limit grows after the latency [N/s].
    excess : float, optional
        Load less the limit after a step of the load [N].
    load_rate : float, optional
        Rate at which the load grows on [N/s].

    Returns
    -------
    float
        The travel; infinite where the limit does not grow faster than the load.

    Examples
    --------
    >>> [f"{1e3 * travel_after(0.2, latency, 20.0, excess=0.5):.2f} mm" for latency in (74e-3, 20e-3)]
    ['21.47 mm', '4.45 mm']
    >>> [f"{1e3 * travel_after(0.2, latency, 20.0, load_rate=4.0):.3f} mm" for latency in (74e-3, 20e-3)]
    ['4.420 mm', '0.087 mm']
    """
    relief, force = limit_rate - load_rate, excess + load_rate * latency
    if relief <= 0.0:
        return math.inf
    speed = (excess * latency + load_rate * latency**2 / 2.0) / mass
    before = (excess * latency**2 / 2.0 + load_rate * latency**3 / 6.0) / mass
    duration = (force + math.sqrt(force**2 + 2.0 * relief * mass * speed)) / relief
    return before + speed * duration + (force * duration**2 / 2.0 - relief * duration**3 / 6.0) / mass
