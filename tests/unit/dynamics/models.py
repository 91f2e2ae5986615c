"""Small models that several tests of this folder compute."""

import contextlib
from dataclasses import replace

import numpy as np

import fingerslip as fs
from fingerslip.dynamics.system.scheme import hht
from fingerslip.verification.meshes import box
from problems.pushed import push_and_slide

# Of the oscillator: shear modulus 1, so k = G A / H = 1; the consistent mass of linear shear is rho V / 3 = 1.
FREQUENCY, STATIC = 1.0, 0.1
# What depends on how a solution was found.
ROUNDING = {"contact_iterations", "contact_residual", "energy_imbalance"}
# Of the block that rests on a plate; how deep the pad in 3D is pressed.
SIDE, HEIGHT, GRAVITY, MODULUS, DENSITY = 10e-3, 5e-3, 9.81, 1e5, 1000.0
DEPTH = 0.4e-3


class Memory:
    """A store of bases in memory that counts what it is asked."""

    def __init__(self):
        self.arrays, self.loads, self.saves = {}, 0, 0

    def load(self, key):
        self.loads += 1
        return self.arrays.get(key)

    def save(self, key, arrays):
        self.saves += 1
        self.arrays[key] = dict(arrays)

    def alone(self, key):  # noqa: ARG002
        return contextlib.nullcontext()


class Watched(fs.Coulomb):
    """A friction law that remembers times and largest slip rates that it was asked for, and may fail."""

    def __init__(self, coefficient=0.4, fails=lambda _: False):
        super().__init__(coefficient)
        object.__setattr__(self, "seen", [])
        object.__setattr__(self, "fails", fails)

    def coefficients(self, conditions):
        self.seen.append((conditions.time, float(np.max(conditions.slip_rate, initial=0.0))))
        if self.fails(conditions.time):
            raise fs.ConvergenceError(conditions.time, 7, 1.0, 1e-10, "try softer contact")
        return super().coefficients(conditions)


def own_scheme(step, alpha, end, **changes):
    """Return a scheme of a user: HHT-alpha with an end and perhaps other numbers."""
    return replace(hht(step, alpha), end=end, **changes)


def contact(**changes):
    """Return the contacts of a model with one."""
    return (fs.Contact(**({"boundary": "bottom", "friction": fs.Coulomb(0.4)} | changes)),)


def model_of(element, *axes, **values):
    """Return a model of a block of linear tissue, its upper side supported, but for what is given."""
    dim = len(axes)
    defaults = {
        "mesh": box(element, *axes),
        "materials": {"bulk": fs.Elastic(MODULUS, 0.3, DENSITY)},
        "formulation": "plane_strain" if dim == 2 else "solid",
        "supports": {"top": ("x", "y", "z")[:dim]},
    }
    return fs.Model(**(defaults | values))


def oscillator(step, alpha, end):
    """One shear cell under a sudden traction: its two upper nodes move along x as one degree of freedom."""
    return model_of(
        "Q4",
        [0.0, 1.0],
        [0.0, 1.0],
        materials={"bulk": fs.Elastic(2.0, 0.0, 3.0)},
        formulation="plane_stress",
        supports={"bulk": ("y",), "bottom": ("x",)},
        tractions={"top": (0.1, 0.0)},
        time=fs.TimeStepping(step, alpha, end),
        record=fs.Recording(sites=(fs.Site("top", "", (0.0, 1.0)),)),
    )


def block(down=0.1, *, steps=4, element="Q4", time=None, **changes):
    """Return a unit square at large strain whose top is pressed down, clamped, within a second."""
    values = {
        "materials": {"bulk": fs.NeoHookean(1e4, 0.4, 1000.0)},
        "supports": {"bottom": ("x", "y"), "top": ("x", "y")},
        "support_motions": {"top": fs.SupportMotion((0.0, -down), fs.Ramp((0.0, 1.0), (0.0, 1.0)))},
        "kinematics": "finite",
        "time": time or fs.QuasiStatic(1.0 / steps, end=1.0),
    }
    return model_of(element, *[np.linspace(0.0, 1.0, 4)] * 2, **(values | changes))


def supported_block(dim=2, **changes):
    """Return a block that its upper side holds, without inertia."""
    sides = [np.linspace(0.0, 10e-3, 4)] * (dim - 1) + [np.linspace(0.0, 5e-3, 4)]
    return model_of("Q4" if dim == 2 else "H8", *sides, **({"time": fs.QuasiStatic(0.1, end=0.2)} | changes))


def slid_block(kinematics="small", **changes):
    """Return a block that is pressed and slid: 24 steps."""
    values = {
        "materials": {"bulk": fs.NeoHookean(50e3, 0.45, 1000.0)},
        "depth": 0.01,
        "contacts": contact(counterface=fs.Plane((0.0, 1.0))),
        "programme": (fs.Press(0.3e-3, 5e-3), fs.Slide(0.3e-3, 5e-3, (1.0, 0.0))),
        "time": fs.TimeStepping(5e-3),
        "record": fs.Recording(sites=(fs.Site("inside", "probe", (4e-3, 1e-3)),), snapshots_every=20e-3),
        "kinematics": kinematics,
    }
    return model_of("Q4", np.linspace(0.0, 8e-3, 9), np.linspace(0.0, 4e-3, 5), **(values | changes))


def resting(dim=2, *, pull=0.0, gap=0.0, poisson_ratio=0.0, step=0.1, end=0.3, **changes):
    """Return a block under gravity on a frictional plate, that nothing else holds."""
    aside, up = np.eye(dim)[[0, -1]]
    values = {
        "materials": {"bulk": fs.Elastic(MODULUS, poisson_ratio, DENSITY)},
        "supports": {},
        "contacts": contact(counterface=fs.Plane(tuple(up), -gap), friction=fs.Coulomb(0.5)),
        "gravity": tuple(-GRAVITY * up),
        "tractions": {"right": tuple(pull * aside)},
        "time": fs.QuasiStatic(step, end=end),
    }
    sides = [np.linspace(0.0, SIDE, 9)] * (dim - 1) + [np.linspace(0.0, HEIGHT, 5)]
    return model_of("Q4" if dim == 2 else "H8", *sides, **(values | changes))


def pressed_pad(*, search_distance=None, **changes):
    """Return a model in 3D: a bulged block is pressed by 0.4 mm and slid."""

    def bulged(points):
        x, y, z = points
        return np.array([x, y, z + (1.0 - z / z.max()) * (x**2 + y**2) / 10e-3])

    across = np.linspace(-2.5e-3, 2.5e-3, 9)
    values = {
        "mesh": box("H8", across, across, np.linspace(0.0, 3e-3, 4), shift=bulged),
        "formulation": "solid",
        "depth": 1.0,
        "supports": {"top": ("x", "y", "z")},
        "contacts": contact(counterface=fs.Plane((0.0, 0.0, 1.0)), search_distance=search_distance),
        "programme": (fs.Press(DEPTH, 10e-3), fs.Slide(0.1e-3, 5e-3)),
    }
    return push_and_slide(**(values | changes))


def solved_by_steps(model, **options):
    """Return the history of a model that is taken step by step."""
    with fs.Simulation(model, **options) as sim:
        while not sim.is_finished:
            sim.step()
        return sim.history()


def assert_same_history(found, expected, share=1e-8, names=None):
    """Compare what two histories record, each variable to a share of its largest value."""
    assert found.sizes == expected.sizes
    for name in names or sorted(set(expected.data_vars) - ROUNDING):
        values = expected[name].values
        scale = np.abs(values).max(initial=0.0)
        np.testing.assert_allclose(found[name].values, values, atol=share * scale + 1e-300, err_msg=name)


def error_of(found, expected, name):
    """Return the largest difference of a variable over its largest value."""
    values = expected[name].values
    return float(np.abs(found[name].values - values).max() / np.abs(values).max())
