"""Events and forces are the same whatever instructions the processor has."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

SCRIPT = Path(__file__).with_name("pressed_and_slid.py")
OLDER = {"NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR", "NUMBA_CPU_NAME": "generic"}
PROCESSORS = {
    "Haswell": {"OPENBLAS_CORETYPE": "Haswell"},
    "Sandybridge": {"OPENBLAS_CORETYPE": "Sandybridge", "MKL_CBWR": "COMPATIBLE", **OLDER},
    "SkylakeX": {"OPENBLAS_CORETYPE": "SkylakeX"},
}


def outcomes(folder: Path, settings: dict[str, str]) -> dict[str, dict[str, list[float]]]:
    """Return events and forces of every run under these settings, from a process and Numba caches of its own."""
    paths = os.pathsep.join([str(SCRIPT.parents[1]), *sys.path])
    environment = {**os.environ, "PYTHONPATH": paths, "NUMBA_CACHE_DIR": str(folder), **settings}
    output = subprocess.run([sys.executable, SCRIPT], env=environment, capture_output=True, text=True, check=True)
    return json.loads(output.stdout)


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    return outcomes(tmp_path_factory.mktemp("here"), {})


@pytest.mark.slow
@pytest.mark.parametrize("name", PROCESSORS)
def test_events_and_forces_are_those_of_this_processor(name, here, tmp_path):
    there = outcomes(tmp_path, PROCESSORS[name])
    for run, values in here.items():
        assert there[run]["events"] == pytest.approx(values["events"], rel=1e-9, abs=1e-12), run
        force, other = np.array(values["force"]), np.array(there[run]["force"])
        assert np.abs(other - force).max() <= 1e-9 * np.abs(force).max(), run
