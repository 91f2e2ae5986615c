"""A press-and-slide with enough inside it for a reduced basis, and the comparison of its histories."""

import dataclasses

import numpy as np

import fingerslip as fs
from problems.pushed import pad, push_and_slide

SITES = (fs.Site("deep", "FA-II", (0.0, 2e-3)), fs.Site("low", "SA-I", (1e-3, 0.0), "bulk"))
REDUCED = fs.ReducedBasis(1e-3, 0.5)


def fine_pad(columns=24, rows=12):
    return pad("Q4", columns, rows)


def deep_push_and_slide(**changes):
    """Return a press and slide whose pad has 300 unknowns beside those of contact and sites."""
    values = {"mesh": fine_pad(), "record": fs.Recording(SITES, snapshots_every=0.05)} | changes
    return push_and_slide(**values)


def random_model(seed):
    """Return a model with anything that a reduced basis may have to do with, at random."""
    rng = np.random.default_rng(seed)

    def sometimes(share, **change):
        return change if rng.random() < share else {}

    step, count, stiffness = 10 ** rng.uniform(-3.3, -2.2), int(rng.integers(60, 150)), 10 ** rng.uniform(4.0, 5.3)
    press, slide = np.array([0.2, 0.7]) * count * step * rng.uniform(0.6, 1.2)
    depth, distance = rng.uniform(0.1e-3, 0.5e-3), rng.uniform(0.2e-3, 1e-3)
    friction = fs.Coulomb(rng.uniform(0.2, 0.9))
    programme = (fs.Press(depth, depth / press), fs.Hold(2 * step), fs.Slide(distance, distance / slide))
    contact = fs.Contact("bottom", friction=friction)
    if rng.random() < 0.2:
        drive = fs.Drive(mass=10 ** rng.uniform(-5.0, -2.5), force=10 ** rng.uniform(-4.0, -2.5))
        contact, programme = fs.Contact("bottom", friction=friction, drive=drive), (fs.Hold(press), programme[2])
    traction = tuple(1e-3 * stiffness * rng.normal(size=2))
    ramp = fs.Ramp((0.0, press), (float(rng.integers(2)), 1.0))
    return fs.Model(
        mesh=fine_pad(int(rng.integers(12, 34)), int(rng.integers(8, 20))),
        materials={"bulk": fs.Elastic(stiffness, rng.uniform(0.2, 0.48), 10 ** rng.uniform(2.8, 3.5))},
        formulation=str(rng.choice(["plane_strain", "plane_stress"])),
        depth=1e-3,
        supports={"top": ("x", "y")},
        contacts=(contact,),
        programme=programme,
        time=fs.TimeStepping(step, float(rng.choice([-0.41421, -0.3, -0.1, -0.05, -0.02]))),
        record=fs.Recording(
            tuple(
                fs.Site(f"site {number}", "", (rng.uniform(-3.5e-3, 3.5e-3), rng.uniform(1e-3, 3.7e-3)), "bulk")
                for number in range(int(rng.integers(1, 5)))
            )
        ),
        **sometimes(0.5, damping=fs.RayleighDamping(10 ** rng.uniform(-1.0, 1.3), 10 ** rng.uniform(-5.5, -3.5))),
        **sometimes(0.5, gravity=tuple(rng.uniform(-10.0, 10.0, 2))),
        **sometimes(0.4, tractions={"left": fs.Traction(traction, ramp)}),
        **sometimes(0.2, initial_velocity=tuple(0.01 * rng.normal(size=2))),
    )


def with_moving_support(seed):
    """Return a random model whose support moves, with three changes of its velocity."""
    rng, model = np.random.default_rng(seed), random_model(seed)
    times = (0.0, *np.sort(rng.uniform(0.05, 0.95, 3)) * model.end)
    moving = fs.SupportMotion(tuple(rng.uniform(-0.4e-3, 0.4e-3, 2)), fs.Ramp(times, (0.0, *rng.uniform(-1.0, 1.0, 3))))
    return dataclasses.replace(model, support_motions={"top": moving})


def with_damper(seed):
    """Return a random model whose plate is pressed by a load against a damper, and by half of them a spring."""
    rng, model = np.random.default_rng(seed), random_model(seed)
    time = dataclasses.replace(model.time, end=round(model.end / model.time.step) * model.time.step)
    mass, is_sprung = 10 ** rng.uniform(-5.0, -2.5), rng.random() < 0.5
    table = fs.RigidBody(
        mass,
        free=("y",),
        springs=fs.Springs(y=10 ** rng.uniform(0.0, 2.0) if is_sprung else 0.0),
        dampers=fs.Dampers(y=10 ** rng.uniform(-2.0, 0.5)),
        loads=(fs.BodyLoad(y=10 ** rng.uniform(-4.0, -2.0)),),
    )
    on_table = (dataclasses.replace(model.contacts[0], drive=None, rigid_body="table"),)
    return dataclasses.replace(model, contacts=on_table, bodies={"table": table}, programme=(), time=time)


def difference(found, expected, name):
    """Return the largest difference of a variable of two histories over its largest value."""
    one, other = (history[name].values.astype(float) for history in (found, expected))
    return float(np.abs(one - other).max() / np.abs(other).max())
