"""Time a sweep of 100 runs of the paper-size section, friction by depth by direction, beside separate runs.

Run it as it is: ``python tests/benchmarks/bench_hundred.py [--workers 2] [--apart 5] [--basis automatic]``. The sweep
is computed in a process of its own, from an empty folder to its summary, without figures; so are some of its runs, each
as a study of its own on one worker, whose mean time is multiplied by 100. Seconds are those of the clock and of the CPU
of all processes, imports included.
"""

from __future__ import annotations

import argparse
import sys

import numpy as np
from bench_sweep import STUDY, Timing, apart

FRICTIONS = [round(float(friction), 2) for friction in np.linspace(0.3, 0.9, 10)]
DEPTHS = [f"{depth} mm" for depth in (1.1, 1.2, 1.3, 1.4, 1.5)]
DIRECTIONS = "[[-1, 0], [1, 0]]"


def sweep(frictions: list[float], depths: list[str], directions: str) -> str:
    return (
        f"sweep:\n  contact.friction_coefficient: {frictions}\n  programme.0.press.depth: [{', '.join(depths)}]\n"
        f"  programme.1.slide.direction: {directions}\n"
    )


def separate(base: str, count: int) -> list[Timing]:
    """Return what single runs of the sweep take, each in a process of its own."""
    return [
        apart(base + sweep([friction], [DEPTHS[number % len(DEPTHS)]], "[[-1, 0]]"), 1)
        for number, friction in enumerate(FRICTIONS[:: len(FRICTIONS) // count][:count])
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--apart", type=int, default=5, help="how many separate runs are timed")
    parser.add_argument("--basis", choices=["automatic", "full"], default="automatic")
    options = parser.parse_args()
    base = STUDY.format(basis=options.basis)
    apart(base, 1)  # the first time, code is compiled
    single = separate(base, options.apart)
    together = apart(base + sweep(FRICTIONS, DEPTHS, DIRECTIONS), options.workers)
    clock, cpu = (100 * float(np.mean([getattr(one, name) for one in single])) for name in ("clock", "cpu"))
    sys.stdout.write(
        f"{'':<28}{'clock':>9}{'CPU':>9}\n"
        f"{'100 separate runs [s]':<28}{clock:9.1f}{cpu:9.1f}\n"
        f"{f'a sweep of {together.runs} runs [s]':<28}{together.clock:9.1f}{together.cpu:9.1f}\n"
        f"{'gain':<28}{clock / together.clock:9.1f}{cpu / together.cpu:9.1f}\n"
    )


if __name__ == "__main__":
    main()
