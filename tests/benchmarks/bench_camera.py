"""What frames of markers cost: 81 markers that slide, filmed clean and with all faults, on one core.

The clock and the cores' seconds of each, beside the seconds that the film lasts. Run it with nothing beside it.

    python tests/benchmarks/bench_camera.py [--width 640] [--height 480] [--seconds 10]
"""

from __future__ import annotations

import argparse
import sys
import time

import numpy as np

from fingerslip.marker_layouts import ring_layout
from fingerslip.vision.cameras.camera import Camera, Pose
from fingerslip.vision.cameras.intrinsics import pinhole_for_view
from fingerslip.vision.cameras.pixel import DARK_ON_BRIGHT, HARSH_LIGHT, PixelCamera, SensorNoise, frames_of
from fingerslip.vision.cameras.point import PointCamera, point_tracks
from fingerslip.vision.tracks import make_tracks
from fingerslip.vision.video import opencv


def main() -> None:
    """Print the times."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--width", type=int, default=640)
    parser.add_argument("--height", type=int, default=480)
    parser.add_argument("--seconds", type=float, default=10.0)
    given = parser.parse_args()
    opencv().setNumThreads(1)
    layout = ring_layout(2.6e-3)
    times = np.arange(0.0, given.seconds, 0.01)
    position = np.zeros((times.size, layout.count, 3))
    position[:, :, :2] = layout.position
    position[:, :, 0] += 0.3e-3 * times[:, None]
    tracks = make_tracks(position, times, units="m")
    lens = pinhole_for_view(given.width, given.height, 0.04, 0.05)
    camera = Camera(lens, Pose((0.0, 0.0, 0.05), (0.0, 0.0, 0.0)))
    harsh = {"lighting": HARSH_LIGHT, "noise": SensorNoise(2.0, 0.05), "jpeg_quality": 80}
    cameras = {
        "clean": PixelCamera(camera),
        "dark on bright": PixelCamera(camera, DARK_ON_BRIGHT),
        "all faults": PixelCamera(camera, **harsh),
    }
    lines = [f"{'':16}{'frames':>8}{'clock':>12}{'cores':>12}{'a frame':>12}{'times real time':>18}"]
    for name, one in cameras.items():
        next(frames_of(one, tracks))
        start, cpu = time.perf_counter(), time.process_time()
        count = sum(1 for _ in frames_of(one, tracks))
        clock, cores = time.perf_counter() - start, time.process_time() - cpu
        real = count / camera.frame_rate / cores
        lines.append(f"{name:16}{count:8}{clock:10.2f} s{cores:10.2f} s{1e3 * cores / count:9.2f} ms{real:18.1f}")
    point_tracks(PointCamera(camera), tracks)
    cpu = time.process_time()
    count = point_tracks(PointCamera(camera), tracks).sizes["time"]
    cores = time.process_time() - cpu
    real = count / camera.frame_rate / cores
    lines.append(f"{'points':16}{count:8}{'':12}{cores:10.2f} s{1e3 * cores / count:9.3f} ms{real:18.1f}")
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
