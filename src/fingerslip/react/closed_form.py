"""Rigid pads hold an object: how far it slides until a growing grip stops it, in closed form.

Two pads press an object of mass m by the force N; friction bears 2 mu N. The load exceeds that by e, the object
slides, and from a time on the limit grows at R = 2 mu dN/dt::

    m dv/ds = e - q s,    v(s) = v0 + (e s - q s^2 / 2) / m = 0   at   s = (e + sqrt(e^2 + 2 q m v0)) / q

with q = R less the rate at which the load still grows. Before, a step of the load gives v0 = e tau / m, a ramp of rate
rho through the limit v0 = rho tau^2 / 2 m and e = rho tau.
"""

from __future__ import annotations

import math

__all__ = ["stop_from", "travel_after_ramp", "travel_after_step"]


def stop_from(mass: float, speed: float, excess: float, relief: float) -> tuple[float, float]:
    """Return how long [s] and how far [m] an object slides on, infinitely where nothing stops it.

    `excess` is the load less what friction bears [N] at the start, and it falls by `relief` [N/s].

    Examples
    --------
    Friction that exceeds the load by a constant 1 N stops 0.2 kg at 0.1 m/s within m v / 1 N = 20 ms:

    >>> duration, travel = stop_from(0.2, 0.1, -1.0, 0.0)
    >>> f"{1e3 * duration:.0f} ms, {1e3 * travel:.0f} mm"
    '20 ms, 1 mm'
    """
    if speed <= 0.0 and excess <= 0.0:
        return 0.0, 0.0
    if relief == 0.0:
        duration = mass * speed / -excess if excess < 0.0 else math.inf
        return duration, 0.5 * speed * duration
    root = excess**2 + 2.0 * relief * mass * speed
    if root < 0.0 or (relief < 0.0 and excess >= 0.0):
        return math.inf, math.inf
    duration = (excess + math.sqrt(root)) / relief
    return duration, speed * duration + (excess * duration**2 / 2.0 - relief * duration**3 / 6.0) / mass


def travel_after_step(mass: float, excess: float, limit_rate: float, latency: float) -> float:
    """Return the travel [m] after a step of the load that exceeds the slip limit.

    Parameters
    ----------
    mass : float
        Mass of the object [kg].
    excess : float
        Load less the slip limit 2 mu N [N].
    limit_rate : float
        Rate at which the limit grows after the latency, 2 mu dN/dt [N/s].
    latency : float
        Time from the step to the growth of the grip [s].

    Examples
    --------
    >>> [f"{1e3 * travel_after_step(0.2, 0.5, 20.0, latency):.2f} mm" for latency in (74e-3, 20e-3)]
    ['21.47 mm', '4.45 mm']
    """
    duration, travel = stop_from(mass, excess * latency / mass, excess, limit_rate)
    return excess * latency**2 / (2.0 * mass) + travel if math.isfinite(duration) else math.inf


def travel_after_ramp(mass: float, load_rate: float, limit_rate: float, latency: float) -> float:
    """Return the travel [m] after a load that grows through the slip limit and on.

    Parameters
    ----------
    mass : float
        Mass of the object [kg].
    load_rate : float
        Rate at which the load grows [N/s].
    limit_rate : float
        Rate at which the limit 2 mu N grows after the latency [N/s].
    latency : float
        Time from the limit to the growth of the grip [s].

    Examples
    --------
    >>> [f"{1e3 * travel_after_ramp(0.2, 4.0, 20.0, latency):.3f} mm" for latency in (74e-3, 20e-3)]
    ['4.420 mm', '0.087 mm']
    """
    speed = load_rate * latency**2 / (2.0 * mass)
    duration, travel = stop_from(mass, speed, load_rate * latency, limit_rate - load_rate)
    return load_rate * latency**3 / (6.0 * mass) + travel if math.isfinite(duration) else math.inf
