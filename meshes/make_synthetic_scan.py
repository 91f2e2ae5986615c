"""Make a synthetic scan of a fingertip, ``scan_skin.stl`` and ``scan_phalanx.stl``, in millimetres.

The skin has noise, a hole on its side, an open proximal end and some triangles the wrong way round; the finger lies
askew in the scanner. Its shape is made up: no person was scanned.

    python meshes/make_synthetic_scan.py [folder]
"""

from __future__ import annotations

import struct
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

TIP = np.array([0.8, 0.36, 0.48])
"""Direction from the palm to the tip, in the scanner's axes."""
PAD = np.array([0.48, -0.86, -0.155])
"""Direction in which the pad faces, in the scanner's axes."""
NOISE = 0.03
HOLE_CENTRE, HOLE_RADIUS = np.array([-11.0, 2.0, 7.0]), 1.6


def tube(stations: Floats, half_width: Floats, top: Floats, bottom: Floats, around: int) -> tuple[Floats, Integers]:
    """Sweep closed rings along x, superelliptic ones, and close the distal end with a point.

    Parameters
    ----------
    stations : (n,) array
        Where the rings are along x [mm].
    half_width, top, bottom : (n,) arrays
        Half of each ring's width in z, and its extent up and down [mm].
    around : int
        Points of a ring.
    """
    angle = 2 * np.pi * np.arange(around) / around
    up, side = np.sin(angle), np.cos(angle)
    height = np.where(up > 0, top[:, None], bottom[:, None]) * np.sign(up) * np.abs(up) ** 0.9
    x = np.repeat(stations[:, None], around, axis=1)
    points = np.stack([x, height, half_width[:, None] * side], axis=-1).reshape(-1, 3)
    end = np.array([[2 * stations[-1] - stations[-2], (height[-1].max() + height[-1].min()) / 2, 0.0]])
    node = np.arange(len(stations) * around).reshape(len(stations), around)
    ahead = np.roll(node, -1, axis=1)
    a, b, c, d = node[:-1], ahead[:-1], ahead[1:], node[1:]
    sides = np.concatenate([np.stack([a, c, b], -1), np.stack([a, d, c], -1)]).reshape(-1, 3)
    cap = np.stack([node[-1], np.full(around, len(points)), ahead[-1]], axis=-1)
    return np.vstack([points, end]), np.vstack([sides, cap])


def rounded(stations: Floats, start: float) -> Floats:
    """Return a factor that falls from 1 at `start` to 0 at the last station as an ellipse does."""
    beyond = np.clip((stations - start) / (stations[-1] + 0.15 - start), 0.0, 1.0)
    return np.sqrt(1.0 - beyond**2)


def skin() -> tuple[Floats, Integers]:
    """Return the skin of a fingertip 26 mm long with its tip at x = 0 [mm]."""
    x = -0.1 - 25.9 * np.linspace(1.0, 0.0, 34) ** 1.35
    factor = rounded(x, -9.0)
    pad = 1.0 + 0.16 * np.exp(-(((x + 9.0) / 6.0) ** 2))
    return tube(x, 7.8 * factor, 5.6 * factor, 6.0 * pad * factor, 48)


def phalanx() -> tuple[Floats, Integers]:
    """Return a distal phalanx: base, waist and tuft, open at its base [mm]."""
    x = -26.0 + 21.0 * np.linspace(0.0, 1.0, 26) ** 0.9
    shaft = 0.62 + 0.38 * np.exp(-(((x + 24.0) / 4.0) ** 2)) + 0.12 * np.exp(-(((x + 7.5) / 2.0) ** 2))
    factor = shaft * rounded(x, -8.5)
    return tube(x, 4.6 * factor, 3.0 * factor, 2.6 * factor, 24)


def scanned(points: Floats, random: np.random.Generator) -> Floats:
    """Add noise and put the finger askew into the scanner [mm]."""
    x = TIP / np.linalg.norm(TIP)
    y = -(PAD - (PAD @ x) * x)
    y /= np.linalg.norm(y)
    noisy = points + random.normal(0.0, NOISE, points.shape)
    return noisy @ np.stack([x, y, np.cross(x, y)]) + [120.0, -35.0, 410.0]


def with_hole(points: Floats, triangles: Integers) -> Integers:
    """Drop the triangles that the scanner did not see."""
    centre = points[triangles].mean(axis=1)
    return triangles[np.linalg.norm(centre - HOLE_CENTRE, axis=1) > HOLE_RADIUS]


def write_stl(path: Path, points: Floats, triangles: Integers) -> None:
    """Write a binary STL file."""
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    record = np.zeros(len(triangles), dtype=[("values", "<f4", 12), ("attribute", "<u2")])
    record["values"] = np.concatenate([normals[:, None], corners], axis=1).reshape(-1, 12)
    path.write_bytes(b"synthetic fingertip, mm".ljust(80) + struct.pack("<I", len(triangles)) + record.tobytes())


def main(folder: Path) -> None:
    """Write both surfaces."""
    random = np.random.default_rng(20)
    points, triangles = skin()
    seen = with_hole(points, triangles)
    turned = random.random(len(seen)) < 0.03
    seen[turned] = seen[turned][:, ::-1]
    write_stl(folder / "scan_skin.stl", scanned(points, random), seen)
    points, triangles = phalanx()
    write_stl(folder / "scan_phalanx.stl", scanned(points, random), triangles)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
