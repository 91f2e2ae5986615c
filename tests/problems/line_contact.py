"""A large body with a curved lower side against a plate: line contacts with closed forms."""

from __future__ import annotations

import numpy as np

import fingerslip as fs
from fingerslip.verification.meshes import box, grade, mirror

MODULUS, RATIO, RADIUS = 1e5, 0.4999, 200e-3
PLANE_MODULUS = MODULUS / (1 - RATIO**2)
HALF_WIDTH = 0.5e-3
OUTER = 30 * HALF_WIDTH


def hertz_profile(x):
    return x**2 / (2 * RADIUS)


def flattened_profile(x):
    """Lower side of a body that is flat in its middle: a quartic."""
    return x**4 / (8 * RADIUS * HALF_WIDTH**2)


def model(profile, programme, *, friction=0.5, steps=(20, 0), size=HALF_WIDTH / 20, element="Q4"):
    """Return the body with its lower side along `profile`, at rest below its fixed top, nearly without inertia."""
    xs = mirror(grade(1.6 * HALF_WIDTH, size, OUTER, 1.15))
    ys = grade(2 * HALF_WIDTH, size, OUTER, 1.15)
    edge = 2 * HALF_WIDTH

    def shift(points):
        x, y = points
        near = np.minimum(np.abs(x), edge)
        slope = (profile(edge) - profile(edge * (1 - 1e-6))) / (edge * 1e-6)
        bottom = profile(near) + slope * (np.abs(x) - near)
        return np.array([x, y + bottom * np.exp(-y / (4 * HALF_WIDTH))])

    mesh = box(element, xs, ys, shift=shift)
    contact = fs.Contact(
        boundary="bottom",
        friction=fs.Coulomb(friction),
        normal_penalty=1e3 * MODULUS / size,
        tangential_penalty=1e3 * MODULUS / size,
        search_distance=profile(1.5 * HALF_WIDTH),
    )
    return fs.Model(
        mesh=mesh,
        materials={"bulk": fs.Elastic(MODULUS, RATIO, 1e-4)},
        formulation="plane_strain",
        supports={"top": ("x", "y"), "left": ("x",), "right": ("x",)},
        contacts=(contact,),
        programme=programme,
        time=fs.TimeStepping(0.05),
    )


def ordered(history, *names):
    """Return the contact nodes' x, and variables sorted along it, (n_times, n_c); of vectors the x component."""
    order = np.argsort(history.contact_position.values[:, 0])
    x = history.contact_position.values[order, 0]
    values = (history[name].values[:, order] for name in names)
    return x, *(value[..., 0] if value.ndim == 3 else value for value in values)
