"""A cylinder pressed deep into a neo-Hookean block and dragged, computed by CalculiX (``ccx``).

``python tests/physics/calculix_block.py FILE`` writes what CalculiX computes, where ``ccx`` is installed (on Debian in
the package calculix-ccx). ``src/fingerslip/data/independent/calculix_block.json`` is such a file, and
problems.verification.dragged_cylinder compares with it. Nothing else of CalculiX is used.

The block is one layer of hexahedra between two planes that hold it, which is plane strain. The cylinder is a strip
along its surface, all of whose nodes are led, and its facets are half a degree long. Contact is CalculiX's penalty
contact of faces with faces: a pressure of the penalty times the penetration, and friction with the same stiffness while
it sticks. CalculiX takes the direction of contact from the increment before, so its tangential force is of first order
in the increment, and the increment is refined beside the mesh.

Lengths are millimetres and stresses kilopascals here, so forces are millinewtons: of a depth of 1 mm newtons per metre.
"""

import json
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

WIDTH, HEIGHT, RADIUS, FINE = 24.0, 8.0, 4.0, 14.0
SHEAR, RATIO = 10.0, 0.45
BULK = 2.0 * SHEAR * (1.0 + RATIO) / (3.0 * (1.0 - 2.0 * RATIO))
PENALTY, DEPTH, TRAVEL = 1e4, 2.5, 3.0
#: Length of cells along the surface [mm], increments of press and of drag, and friction coefficient of each run.
#: With friction and cells of 0.25 mm CalculiX 2.20 stops where the drag begins.
RUNS = ((0.7, 40, 0.3), (0.5, 40, 0.3), (0.35, 40, 0.3), (0.5, 20, 0.3), (0.5, 80, 0.3), (0.25, 40, 0.0))
#: Where forces are read, in presses and slides, and displacements [mm from the middle of the block at the start].
PARTS = np.arange(1, 9) / 4.0
PLACES = (-8.0, -6.0, -4.0, -2.0, 0.0, 2.0, 4.0, 6.0, 8.0)
#: Nodes of a hexahedron's faces, from 0, in the order in which CalculiX numbers the faces.
FACES = np.array([(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)])
_NUMBER = r"\s+([-+.\dE]+)"


def layer(along, across, planes):
    """Return nodes (n, 3) and hexahedra (m, 8) of a sheet of quadrilaterals between two planes."""
    flat = np.stack([along.ravel(), across.ravel()], axis=1)
    nodes = np.concatenate([np.column_stack([flat, np.full(len(flat), plane)]) for plane in planes])
    numbers = np.arange(len(flat)).reshape(along.shape)
    corners = (numbers[:-1, :-1], numbers[1:, :-1], numbers[1:, 1:], numbers[:-1, 1:])
    quads = np.stack([corner.ravel() for corner in corners], axis=1)
    return nodes, np.concatenate([quads, quads + len(flat)], axis=1)


def block(spacing):
    """Return the block, with cells of one length under the cylinder, longer ones beside it and lower ones on top."""
    fine = np.linspace(-0.5 * FINE, 0.5 * FINE, round(FINE / spacing) + 1)
    coarse = np.linspace(0.5 * FINE, 0.5 * WIDTH, round(1.0 / spacing) + 1)[1:]
    side = np.linspace(0.0, 1.0, round(3.0 / spacing) + 1)
    up = HEIGHT * (1.0 - (1.0 - side) ** 1.5)
    return layer(*np.meshgrid(np.concatenate([-coarse[::-1], fine, coarse]), up, indexing="ij"), (0.0, 1.0))


def strip():
    """Return a strip of the cylinder along its surface, longer out of the plane than the block."""
    angle = np.deg2rad(np.linspace(-110.0, 110.0, 441))
    radius, angle = np.meshgrid([RADIUS - 0.5, RADIUS], angle, indexing="ij")
    return layer(radius * np.sin(angle), HEIGHT + RADIUS - radius * np.cos(angle), (-0.5, 1.5))


def rows(values):
    """Write rows of numbers as CalculiX reads them, numbered from 1."""
    return [f"{number}," + ",".join(f"{value:.12g}" for value in row) for number, row in enumerate(values, 1)]


def faces(cubes, chosen, first):
    """Return the faces of hexahedra all of whose nodes are chosen, as CalculiX names them."""
    cells, sides = np.nonzero(chosen[cubes[:, FACES]].all(axis=2))
    return [f"{cell + first},S{side + 1}" for cell, side in zip(cells, sides, strict=True)]


def nodes_named(name, chosen, first=1):
    return [f"*NSET,NSET={name}", *(f"{node + first}," for node in np.flatnonzero(chosen))]


def bodies(spacing):
    """Return the lines of both meshes, their named nodes and surfaces, and where the nodes of the top are [mm]."""
    (nodes, cubes), (led, facets) = block(spacing), strip()
    count, cells = len(nodes), len(cubes)
    top, front = nodes[:, 1] > HEIGHT - 1e-9, nodes[:, 2] < 1e-9
    outside = np.hypot(led[:, 0], led[:, 1] - HEIGHT - RADIUS) > RADIUS - 1e-9
    elements = rows(np.concatenate([cubes, facets + count]) + 1)
    text = [
        *("*NODE", *rows(np.concatenate([nodes, led]))),
        *("*ELEMENT,TYPE=C3D8,ELSET=BLOCK", *elements[:cells], "*ELEMENT,TYPE=C3D8,ELSET=CYLINDER", *elements[cells:]),
        *nodes_named("BOTTOM", nodes[:, 1] < 1e-9),
        *nodes_named("TOP", top & front),
        *nodes_named("BODY", top | True),
        *nodes_named("LED", outside | True, count + 1),
        *("*SURFACE,NAME=PAD,TYPE=ELEMENT", *faces(cubes, top, 1)),
        *("*SURFACE,NAME=TOUCHED,TYPE=ELEMENT", *faces(facets, outside, cells + 1)),
    ]
    return text, nodes[top & front, 0]


def laws(friction):
    """Return the lines of the materials, of contact and of what is held."""
    sliding = ["*FRICTION", f"{friction},{PENALTY}"] if friction else []
    return [
        *("*MATERIAL,NAME=SOFT", "*HYPERELASTIC,NEO HOOKE", f"{0.5 * SHEAR:.12g},{2.0 / BULK:.12g}"),
        *("*MATERIAL,NAME=HARD", "*ELASTIC", "1000,0.3"),
        *("*SOLID SECTION,ELSET=BLOCK,MATERIAL=SOFT", "*SOLID SECTION,ELSET=CYLINDER,MATERIAL=HARD"),
        *("*SURFACE INTERACTION,NAME=TOUCH", "*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR", f"{PENALTY}", *sliding),
        *("*CONTACT PAIR,INTERACTION=TOUCH,TYPE=SURFACE TO SURFACE", "PAD,TOUCHED"),
        *("*BOUNDARY", "BOTTOM,1,2", "BODY,3,3", "LED,3,3"),
    ]


def motion(travel, increments):
    """Return the lines of a step that leads the cylinder on to its full depth and a travel."""
    length = f"{1.0 / increments:.12g}"
    return [
        *("*STEP,NLGEOM,INC=100000", "*STATIC", f"{length},1.,1e-7,{length}"),
        *("*BOUNDARY", f"LED,1,1,{travel}", f"LED,2,2,{-DEPTH}"),
        *("*NODE PRINT,NSET=BOTTOM,TOTALS=ONLY,FREQUENCY=1", "RF"),
        *("*NODE PRINT,NSET=TOP,FREQUENCY=1", "U", "*END STEP"),
    ]


def forces(printed):
    """Return the forces on the block along and across (8, 2) [N/m], read between the increments."""
    found = re.findall(rf"total force.*?time{_NUMBER * 3}", printed, re.DOTALL)
    time, along, across = np.array(found, dtype=float).T
    # What holds the block is opposite to what the cylinder does to it.
    return -np.stack([np.interp(PARTS, time, along), np.interp(PARTS, time, across)], axis=1)


def displacements(printed, places, time):
    """Return the displacements of the surface (9, 2) [mm] at a time, between the nodes in straight lines."""
    text = re.search(rf"displacements[^\n]*{re.escape(f'{0.1 * time:.7f}E+01')}\n\n(.*?)\n\n", printed, re.DOTALL)
    moved = np.array([line.split()[1:3] for line in text[1].splitlines()], dtype=float)
    return np.stack([np.interp(PLACES, places, moved[:, axis]) for axis in range(2)], axis=1)


def computed(run):
    """Return what CalculiX computes of one run."""
    spacing, increments, friction = run
    text, places = bodies(spacing)
    lines = [*text, *laws(friction), *motion(0.0, increments), *motion(TRAVEL, increments)]
    with tempfile.TemporaryDirectory() as folder:
        deck = Path(folder) / "block.inp"
        deck.write_text("\n".join(lines) + "\n", encoding="ascii")
        subprocess.run(["ccx", "-i", "block"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        printed = deck.with_suffix(".dat").read_text(encoding="ascii") + "\n\n"
    return {
        "spacing_mm": spacing,
        "increments": increments,
        "friction_coefficient": friction,
        "force_N_per_m": forces(printed).round(4).tolist(),
        "pressed_mm": displacements(printed, places, 1.0).round(5).tolist(),
        "dragged_mm": displacements(printed, places, 2.0).round(5).tolist(),
    }


def main(path):
    """Compute all runs, two at a time, and write them with the version of CalculiX."""
    version = subprocess.run(["ccx", "-v"], capture_output=True, text=True, check=False).stdout
    with ThreadPoolExecutor(2) as pool:
        runs = list(pool.map(computed, RUNS))
    made = {
        "code": "CalculiX CrunchiX",
        "version": version.split()[-1],
        "made_by": "tests/physics/calculix_block.py",
        "presses_and_slides": PARTS.tolist(),
        "places_mm": PLACES,
        "runs": runs,
    }
    path.write_text(json.dumps(made, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
