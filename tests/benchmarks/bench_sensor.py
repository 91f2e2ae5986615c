"""What slides of the sensor cost, how much they depend on the mesh, on large strain and on its half: docs/tactip.md.

    OMP_NUM_THREADS=1 python tests/benchmarks/bench_sensor.py [--cases pressed meshes large whole]
        [--skins smooth ridged] [--sizes coarse shipped fine finest] [--depths 2 3] [--travel 1.5] [--part 0.25]

`pressed` slides the section at large strain as small motions about states of a
slide, beside the same slide step by step. `meshes` slides the ridged half in 3D over 14 mm on meshes of which all
sizes have a common factor, with the surface in patches of one size, by the first of the depths and the others.
`large` presses the half in 3D by the last depth and slides it, at small and at large strain (`--strains`); a run that
ends early says where.
`whole` slides a whole sensor, pressed by the first depth, along x and at 45 degrees beside its half; errors are the
largest at any time, over the largest displacement of a marker and the largest force. Both take linear tetrahedra of the
first size, Coulomb friction 0.85 and quasi-static steps of `--part` [mm]. Forces are those of the whole sensor; memory
is the largest so far.
"""

import dataclasses
import itertools
import resource
import sys
import time

import numpy as np
from scipy.interpolate import interp1d
from setups import line, model_of, options_of, run_of, table

import fingerslip as fs
from fingerslip.dynamics.statics.body import static_body
from fingerslip.dynamics.statics.motion import static_motion
from fingerslip.dynamics.statics.pressed import pressed_bodies
from fingerslip.errors import FingerslipError
from fingerslip.linear.resources import limited_threads
from fingerslip.marker_tracks import marker_tracks
from fingerslip.slip import stick_ratio
from fingerslip.specimens.tactip.numbers import modelled_places
from fingerslip.specimens.tactip.tactip import PRESETS, SensorSolidSizes
from fingerslip.study.running.build import build_model
from fingerslip.study.trials import bodies
from problems.sensors import half_of, pressed_sensor, slid_beside_half

#: Sizes at the contact, in the gel and at rods [mm].
SIZES = {
    "coarse": (1.5, 4.0, 0.5),
    "shipped": (1.0, 3.0, 0.35),
    "fine": (0.75, 2.2, 0.25),
    "finest": (0.56, 1.65, 0.19),
}
PATCH, HIDDEN = 0.8e-3, 1e-3
TRAVELS = (0.5e-3, 1e-3, 2e-3)
SPEED = 5e-3
# Distance over which a ring has slipped, and over which the centre has: 2 px and 1 px of 0.07 mm.
SLIPPED = (0.07e-3, 0.14e-3)


def timed(work):
    """Return what a call gives, and its processor seconds on one thread."""
    start = time.process_time()
    with limited_threads(1):
        found = work()
    return found, time.process_time() - start


def pressed(given):
    """Print how far small motions about states at large strain are from whole slides of the section."""
    forces = ("normal, friction force at 1 mm", "largest friction force", "mean normal, friction force from 6 mm on")
    errors = [f"error of {name} [%]" for name in forces]
    slips = [f"{share} of the contact slips: whole, condensed [mm]" for share in ("half", "all")]
    table("skin", "depth [mm]", *errors, "of markers until slip [mm]", *slips, "body, slide, whole [CPU s]", "states")
    for skin, depth in itertools.product(given.skins, given.depths):
        line(skin, depth, *pressed_row(skin, depth))


def pressed_row(skin, depth):
    """Return errors, travels at which the contact slips, and costs of a slide."""
    model = model_of("ridged_vs_smooth_large", f"ridges-{skin == 'ridged'}_depth-{depth:g}mm".lower())
    (contact,), (press, hold, along) = model.contacts, model.programme
    steady = dataclasses.replace(contact, friction=fs.Coulomb(0.85))
    way = (fs.Press(press.depth, 1e-3), fs.Slide(along.distance, 1e-3))
    sheared = dataclasses.replace(model, contacts=(steady,), programme=way, time=fs.QuasiStatic(bodies._STEP / 1e-3))
    # As `fingerslip detect simulate` makes them.
    like = {"spacing": bodies._SPACING, "near": HIDDEN, "stride": bodies._STRIDE / 1e-3}
    (body,), *costs = timed(lambda: list(pressed_bodies(sheared, [press.depth], **like)))
    motion, cost = timed(lambda: static_motion(body, contact, model.programme, model.time.step))
    history, whole_cost = timed(lambda: fs.simulate(model, threads=1))
    begin = press.depth / press.speed + hold.duration
    history = history.sel(time=slice(begin, motion.time[-1]))
    travel, ratio = 1e3 * along.speed * (history["time"].values - begin), stick_ratio(history).values
    force, moved = (
        interp1d(motion.time, each, axis=0)(history["time"]) for each in (motion.force, motion.displacement)
    )
    ratios, first, late = (
        (ratio, np.interp(history["time"], motion.time, motion.stick_ratio)),
        travel >= 1.0,
        travel > 6.0,
    )
    slips = [[round(float(travel[np.argmax(each < share)]), 2) for each in ratios] for share in (0.5, 0.02)]
    own, other = (
        np.concatenate([each[first][0, ::-1], [each[:, 0].max()], each[late].mean(axis=0)[::-1]])
        for each in (force, history["counterface_force"].values[:, 0])
    )
    errors = (100.0 * (own / other - 1.0)).round(2).tolist()
    apart = np.linalg.norm(moved - history["displacement"].values, axis=2)[travel < min(slips[1])].max()
    costs = [round(each, 2) for each in (*costs, cost, whole_cost)]
    return errors[:2], errors[2], errors[3:], 1e3 * float(apart), *slips, costs, len(body.answers)


def solid_mesh(sensor, sizes):
    """Return linear tetrahedra of a sensor; sizes in mm."""
    contact, bulk, rods = (1e-3 * size for size in sizes)
    return SensorSolidSizes(contact_size=contact, bulk_size=bulk, rod_size=rods).build(sensor)


def body_of(run, sizes, deepest):
    """Return the condensed body on a mesh, and what it cost: nodes, patches, seconds of mesh and body, memory."""
    mesh, meshing = timed(lambda: solid_mesh(run.specimen, sizes))
    model, reach = build_model(run, mesh), 1.5 * deepest
    contacts = tuple(dataclasses.replace(one, search_distance=reach) for one in model.contacts)
    model = dataclasses.replace(model, contacts=contacts)
    body, condensing = timed(lambda: static_body(model, reach=reach, hidden=HIDDEN, patch=PATCH))
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    return body, [mesh.p.shape[1], len(body.nodes), meshing, condensing, memory]


def slide(run, body, depth):
    """Return what a slide came to: forces and area of the whole sensor, markers at some travels, when they slip."""
    study = run.study
    press, hold, along = (entry.phase for entry in study.programme)
    programme = (dataclasses.replace(press, depth=depth), hold, along)
    contact = study.all_contacts[0].contact(3)
    motion, seconds = timed(lambda: static_motion(body, contact, programme, study.time.stepping.step))
    start = int(np.searchsorted(motion.time, depth / press.speed + hold.duration - 1e-9))
    elapsed = motion.time[start:] - motion.time[start]
    moved = motion.displacement[start:] - motion.displacement[start]
    places = modelled_places(run.specimen)
    count, weight = len(places.ring), np.where(places.on_x, 1.0, 2.0)
    left = (moved[:, count:] - (motion.counterface[start:] - motion.counterface[start])[:, None])[..., [0, 2]]
    away = np.linalg.norm(left, axis=2)
    slips = [_when(elapsed, away[:, 0], SLIPPED[0])]
    ring = places.ring == 1
    slips.append(_when(elapsed, away[:, ring] @ weight[ring] / weight[ring].sum(), SLIPPED[1]))
    rows = np.searchsorted(along.speed * elapsed, np.array(TRAVELS) - 1e-9)
    force = 2.0 * motion.force[start:]
    outer = places.ring == places.ring.max()
    share = 1e3 * weight[outer] / weight[outer].sum()
    markers = [[1e3 * moved[row, 0, 0], share @ moved[row, :count][outer, 0]] for row in rows]
    area = 2e6 * float(motion.contact_area[start])
    return [1e3 * depth, force[0, 1], force[:, 0].max(), area, *np.ravel(markers).tolist(), slips[1], slips[0], seconds]


def _when(times, values, limit):
    over = np.flatnonzero(values > limit)
    return float(times[over[0]]) if over.size else float("nan")


def meshes(given):
    """Print the slides on all meshes, and what these cost."""
    run, rows = run_of("tactip_directions_3d"), []
    table("mesh", "nodes", "patches", "mesh [CPU s]", "body [CPU s]", "memory [GB]")
    for name in given.sizes:
        body, cost = body_of(run, SIZES[name], 1e-3 * max(given.depths))
        line(name, *cost)
        rows += [[name, *slide(run, body, 1e-3 * depth)] for depth in given.depths]
    markers = [f"{which} at {1e3 * travel:g} mm [mm]" for travel in TRAVELS for which in ("centre", "outermost")]
    forces = ["pressed by [N]", "largest friction force [N]", "area that touches [mm²]"]
    sys.stdout.write("\n")
    table("mesh", "depth [mm]", *forces, *markers, "ring 1 slips [s]", "centre slips [s]", "slide [CPU s]")
    for row in sorted(rows, key=lambda row: row[1]):
        line(*row)


def stepped(model):
    """Return the history as far as it goes, why it ended early, and processor seconds."""
    start, why = time.process_time(), ""
    with limited_threads(1), fs.Simulation(model, threads=1) as sim:
        try:
            while not sim.is_finished:
                sim.step()
        except FingerslipError as error:
            why = str(error)
        return sim.history(), why, time.process_time() - start


def rows_of(history, depth):
    """Return depth, travel, normal and friction force, central marker, outermost ring along x and y [mm, N].

    There is a row for each half of a millimetre of the press and of the slide.
    """
    tracks = marker_tracks(history, ("internal",))
    moved = 1e3 * (tracks["position"].values - tracks["position"].values[0])
    outer = tracks["ring"].values == tracks["ring"].values.max()
    far = outer & (np.abs(tracks["angle"].values) < 1e-6)
    force = 2.0 * history["counterface_force"].values[:, 0]
    way = SPEED * history["time"].values
    halves = np.where(way < depth + 1e-9, way, way - depth) / 0.5e-3
    for number in np.flatnonzero((np.abs(halves - np.round(halves)) < 1e-6) & (np.round(halves) > 0)):
        values = [force[number, 1], force[number, 0], *moved[number, 0][:2], *moved[number, far][0][:2]]
        yield [1e3 * min(way[number], depth), 1e3 * max(way[number] - depth, 0.0), *values]


def large(given):
    """Print the table of each skin at small and at large strain."""
    depth, travel, part = (1e-3 * value for value in (given.depths[-1], given.travel, given.part))
    programme = (fs.Press(depth, SPEED), fs.Slide(travel, SPEED))
    markers = ("centre x [mm]", "centre up [mm]", "outermost x [mm]", "outermost up [mm]")
    table("skin", "strain", "depth [mm]", "travel [mm]", "normal force [N]", "friction force [N]", *markers)
    for skin in given.skins:
        sensor = PRESETS.changed({"preset": f"tactip-{skin}-3d"})
        mesh = solid_mesh(sensor, SIZES[given.sizes[0]])
        model = pressed_sensor(sensor, mesh, fs.Coulomb(0.85), programme, step=part / SPEED)
        for strain in given.strains:
            history, why, seconds = stepped(dataclasses.replace(model, kinematics=strain))
            for row in rows_of(history, depth):
                line(skin, strain, *row)
            cost = {name: history.attrs.get(name) for name in ("newton_iterations", "factorisations", "halved_steps")}
            ended = f"ended early: {why}" if why else "went through"
            sys.stdout.write(f"{mesh.p.shape[1]} nodes, {seconds:.0f} CPU s, {cost}, {ended}\n")
            sys.stdout.flush()


def whole(given):
    """Print a row for each skin and direction."""
    depth, travel, part = (1e-3 * value for value in (given.depths[0], given.travel, given.part))
    table("skin", "direction", "error of markers", "error of force", "friction, normal, transverse force [N]")
    for skin in given.skins:
        sensor = dataclasses.replace(PRESETS.changed({"preset": f"tactip-{skin}-3d"}), part="whole")
        mesh, meshing = timed(lambda sensor=sensor: solid_mesh(sensor, SIZES[given.sizes[0]]))
        with limited_threads(1):
            *slid, of_half, of_whole = slid_beside_half(
                sensor, mesh, fs.Coulomb(0.85), depth=depth, travel=travel, part=part
            )
        for name, own in zip(("along x", "at 45 degrees"), slid, strict=True):
            line(skin, name, own.markers, own.forces, ", ".join(f"{value:.4f}" for value in own.force))
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        sys.stdout.write(f"nodes {half_of(mesh).p.shape[1]} of {mesh.p.shape[1]}; CPU s: mesh {meshing:.0f}, ")
        sys.stdout.write(f"half {of_half:.0f}, both slides of the whole {of_whole:.0f}; {memory:.1f} GB\n")
        sys.stdout.flush()


CASES = {"pressed": pressed, "meshes": meshes, "large": large, "whole": whole}


def main():
    """Print the tables that are asked for."""
    parser = options_of(__doc__)
    parser.add_argument("--cases", nargs="+", default=["pressed"], choices=CASES)
    parser.add_argument("--skins", nargs="+", default=["smooth", "ridged"], choices=["smooth", "ridged"])
    parser.add_argument("--sizes", nargs="+", default=["coarse", "shipped", "fine"], choices=list(SIZES))
    parser.add_argument("--depths", nargs="+", type=float, default=[2.0, 3.0])
    parser.add_argument("--travel", type=float, default=1.5)
    parser.add_argument("--part", type=float, default=0.25)
    parser.add_argument("--strains", nargs="+", default=["small", "finite"], choices=["small", "finite"])
    given = parser.parse_args()
    for name in given.cases:
        CASES[name](given)


if __name__ == "__main__":
    main()
