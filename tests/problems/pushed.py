"""Presses and slides: of a small block, and of the section of the fingertip in the paper."""

import numpy as np

import fingerslip as fs
from fingerslip.verification.meshes import box


def curved(radius):
    """Return a shift that turns the bottom y = 0 of a block into the parabola x^2 / (2 radius)."""

    def shift(points):
        x, y = points
        return np.array([x, y + (1.0 - y / y.max()) * x**2 / (2.0 * radius)])

    return shift


def pad(element, columns=8, rows=4):
    """Return a block of 8 mm by 4 mm with a bulged lower side, the boundary `bottom`."""
    xs, ys = np.linspace(-4e-3, 4e-3, columns + 1), np.linspace(0.0, 4e-3, rows + 1)
    return box(element, xs, ys, shift=curved(8e-3))


def push_and_slide(element="Q4", *, friction=0.4, damping=None, alpha=-0.05, sites=(), step=5e-3, **changes):
    """Return the model: press by 0.4 mm, hold, slide by 0.8 mm, so that the contact sticks, slips and slides."""
    values = {
        "mesh": pad(element),
        "materials": {"bulk": fs.Elastic(34e3, 0.4, 1000.0)},
        "formulation": "plane_strain",
        "depth": 1e-3,
        "supports": {"top": ("x", "y")},
        "contacts": (fs.Contact(boundary="bottom", friction=fs.Coulomb(friction)),),
        "programme": (fs.Press(0.4e-3, 4e-3), fs.Hold(0.02), fs.Slide(0.8e-3, 8e-3)),
        "time": fs.TimeStepping(step, alpha),
        "damping": damping or fs.RayleighDamping(),
        "record": fs.Recording(sites=sites),
    }
    return fs.Model(**(values | changes))


def section(finger=None, *, sizes=(0.15e-3, 0.4e-3), travel=3e-3, towards=-1.0, **changes):
    """Return the model of the section, of cells of two sizes [m]: press by 1.5 mm, slide at 3 mm/s along x."""
    finger = finger or fs.preset("wang2014-2d")
    values = {
        "mesh": fs.build_section(finger, contact_size=sizes[0], bulk_size=sizes[1]),
        "materials": finger.materials,
        "formulation": finger.formulation,
        "depth": finger.depth,
        "supports": {"phalanx": ("x", "y")},
        "contacts": (fs.Contact("skin", fs.Plane(normal=(0.0, 1.0)), fs.Coulomb(0.6)),),
        "programme": (fs.Press(1.5e-3, 1.5e-3), fs.Slide(travel, 3e-3, direction=(towards, 0.0))),
        "time": fs.TimeStepping(5e-3, -0.41421),
    }
    return fs.Model(**(values | changes))
