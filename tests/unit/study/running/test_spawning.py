"""Workers do not import the main module of the process that starts them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import pytest

from fingerslip.study.running.spawning import without_main_module

# Its worker says who it is and would then wait for an hour.
PARENT = """
import multiprocessing, os, signal, time
from concurrent.futures import ProcessPoolExecutor
from fingerslip.study.running.spawning import without_main_module
from fingerslip.study.trials.simulate import _begin_worker
pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), initializer=_begin_worker, initargs=((),))
with without_main_module():
    first, _ = pool.submit(os.getpid), pool.submit(time.sleep, 3600.0)
print(first.result(), flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_the_main_module_is_there_again_behind_the_block() -> None:
    main = sys.modules["__main__"]
    with without_main_module():
        assert sys.modules["__main__"] is not main
        assert not hasattr(sys.modules["__main__"], "__file__")
    assert sys.modules["__main__"] is main
    with pytest.raises(ZeroDivisionError), without_main_module():
        raise ZeroDivisionError
    assert sys.modules["__main__"] is main


@pytest.mark.skipif(sys.platform == "win32", reason="has no such signals")
def test_a_worker_of_a_killed_process_ends() -> None:
    """The pipe to this process is closed when the last of both has ended."""
    with subprocess.Popen([sys.executable, "-c", PARENT], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        worker = int(parent.stdout.readline())
        try:
            parent.communicate(timeout=60.0)
        except subprocess.TimeoutExpired:
            os.kill(worker, signal.SIGKILL)
            raise
    assert parent.returncode == -signal.SIGKILL
