"""A short history with markers that slip from the edge inwards, for tests of films and of figures of markers."""

from __future__ import annotations

import numpy as np
import xarray as xr

from fingerslip.history import make_history
from unit.synthetic import Process, make

RINGS = (0, 1, 1, 2, 2)
NODES = (20, 28, 12, 34, 6)


def filmed_history() -> xr.Dataset:
    """Return the synthetic press and slide with five markers on the skin and one inside, 5 mm above the middle."""
    whole = make(Process(step=20e-3, jump=False))
    rest = whole["contact_position"].values[list(NODES)]
    moved = whole["contact_displacement"].values[:, list(NODES)]
    names = [f"external-marker-{ring}-{number + 1:02d}" for number, ring in enumerate(RINGS)]
    bare = whole.drop_dims("site")
    values = {name: bare[name].values for name in bare.variables}
    displacement = np.concatenate([moved, 0.5 * moved[:, :1]], axis=1)
    values |= {
        "site": [*names, "internal-marker-0-01"],
        "site_kind": ["external marker"] * len(NODES) + ["internal marker"],
        "site_region": ["skin"] * (len(NODES) + 1),
        "site_position": np.vstack([rest, rest[:1] + np.array([0.0, 5e-3])]),
        "displacement": displacement,
        "velocity": np.zeros_like(displacement),
        "acceleration": np.zeros_like(displacement),
        "strain_energy_density": np.zeros(displacement.shape[:2]),
    }
    return make_history(values, dict(whole.attrs))
