"""Time the start of every verb of the command line, up to where its own work begins: what it imports.

Run it as it is: ``python tests/benchmarks/bench_start.py [--repeat 3]``. Each verb is started with ``--help``, and some
with arguments that need next to no work, each time in a process of its own, after one start that compiles. The table
has the least seconds of the clock and of the CPU, and how many modules are loaded at the end.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from dataclasses import dataclass

from fingerslip.commands.app import app

COUNT = "import sys, atexit; atexit.register(lambda: sys.stderr.write(f'modules {len(sys.modules)}'))"
START = f"{COUNT}; from fingerslip.commands.app import app; app(sys.argv[1:], prog_name='fingerslip')"
SMALL = (["examples"], ["schema"], ["show"], ["show", "wang2014-2d"], ["check", "studies/wang2014_table2.yaml"])


@dataclass(frozen=True)
class Start:
    """Seconds of the clock and of the CPU, and loaded modules."""

    clock: float
    cpu: float
    modules: int


def started(arguments: list[str]) -> Start:
    """Start a command in a process of its own."""
    before, start = os.times(), time.perf_counter()
    done = subprocess.run([sys.executable, "-c", START, *arguments], capture_output=True, text=True, check=False)
    after = os.times()
    cpu = after.children_user + after.children_system - before.children_user - before.children_system
    return Start(time.perf_counter() - start, cpu, int(done.stderr.rpartition(" ")[2]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeat", type=int, default=3)
    options = parser.parse_args()
    verbs = sorted(filter(None, (one.name or getattr(one.callback, "__name__", "") for one in app.registered_commands)))
    sys.stdout.write(f"{'command':<36}{'clock [s]':>10}{'CPU [s]':>10}{'modules':>9}\n")
    for arguments in (*([verb, "--help"] for verb in verbs), *SMALL):
        started(arguments)
        found = [started(arguments) for _ in range(options.repeat)]
        clock, cpu = min(one.clock for one in found), min(one.cpu for one in found)
        sys.stdout.write(f"{' '.join(arguments):<36}{clock:10.2f}{cpu:10.2f}{found[0].modules:9d}\n")


if __name__ == "__main__":
    main()
