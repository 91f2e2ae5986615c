"""What workers need, loaded once in the process that they are forked from; nothing else loads this."""

import contextlib
import gc
import importlib

import numpy as np

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
