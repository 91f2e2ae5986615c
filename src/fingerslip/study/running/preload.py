"""What workers need, loaded once in the process that they are forked from; nothing else loads this."""

import contextlib
import ctypes
import gc
import importlib

import numpy as np

# Arrays up to this size [bytes] are used again and not given back to the system, whose empty pages take a fifth of the
# time in which a basis is made (measured). Only glibc has this.
_USED_AGAIN, _TRIM, _MAP = 2**26, -1, -3
for _option, _size in ((_MAP, _USED_AGAIN), (_TRIM, 4 * _USED_AGAIN)):
    with contextlib.suppress(AttributeError):
        ctypes.CDLL(None).mallopt(_option, _size)
# Modules are no garbage: to look for some among them takes a sixth of the time here, and 0.2 s every time in a worker.
gc.disable()
for name in (
    *("fingerslip.study.running.compute", "fingerslip.dynamics.simulation", "fingerslip.export.paraview"),
    # xarray loads the last two where they are installed.
    *("fingerslip.report.page.pictures", "scipy.signal", "dask.array", "pint"),
):
    with contextlib.suppress(ImportError):
        importlib.import_module(name)
# With the first function that it compiles or reads, Numba loads what all functions need.
contact = importlib.import_module("fingerslip.contact.interface")
contact.contact_problem(np.zeros((1, 2)), np.zeros((1, 2)), np.zeros((1, 2)), np.ones(1))
gc.freeze()
gc.set_threshold(5_000)  # figures are made of many small objects
gc.enable()
