"""Designs: where in the unit cube samples lie, as shares of the ranges of the sampled values.

``saltelli`` and ``morris`` come in blocks, each of which asks what every value does from one point on:

- A block of ``saltelli`` is a point a, then for every value j the point a with the j-th share of another point b, then
  b (Saltelli et al. 2010); a and b are halves of one point of a scrambled Sobol sequence.
- A block of ``morris`` is a walk through the levels 0, 1/3, 2/3, 1 that moves every share once by 2/3, in random order
  (Morris 1991).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Literal

import numpy as np
from numpy.typing import NDArray

__all__ = ["LEVELS", "METHODS", "Method", "block_size", "design_size", "draw_shares", "needs_power_of_two"]

Array = NDArray[np.float64]
Method = Literal["latin_hypercube", "sobol", "random", "saltelli", "morris"]

#: Levels of Morris's walks.
LEVELS = 4

_WITH_POWERS = ("sobol", "saltelli")


def draw_shares(method: Method, count: int, dim: int, seed: int) -> Array:
    """Draw the points of a design.

    Arrays: returns (n, dim).

    Examples
    --------
    >>> draw_shares("morris", 1, 2, seed=1).round(2).tolist()
    [[0.33, 0.67], [0.33, 0.0], [1.0, 0.0]]
    """
    return METHODS[method](count, dim, seed)


def block_size(method: Method, dim: int) -> int:
    """Return how many points belong together: 1 where every point stands for itself."""
    return {"saltelli": dim + 2, "morris": dim + 1}.get(method, 1)


def design_size(method: Method, count: int, dim: int) -> int:
    """Return the number of points of a design."""
    return count * block_size(method, dim)


def needs_power_of_two(method: Method) -> bool:
    """Tell whether the count of a method has to be a power of two, as that of Sobol sequences has."""
    return method in _WITH_POWERS


# scipy.stats is slow to import, and needed here alone.
def _latin_hypercube(count: int, dim: int, seed: int) -> Array:
    from scipy.stats import qmc

    points: Array = qmc.LatinHypercube(dim, seed=seed).random(count)
    return points


def _sobol(count: int, dim: int, seed: int) -> Array:
    from scipy.stats import qmc

    points: Array = qmc.Sobol(dim, seed=seed).random(count)
    return points


def _random(count: int, dim: int, seed: int) -> Array:
    return np.random.default_rng(seed).random((count, dim))


def _saltelli(count: int, dim: int, seed: int) -> Array:
    both = _sobol(count, 2 * dim, seed)
    first, second = both[:, :dim], both[:, dim:]
    blocks = np.repeat(first[:, None, :], dim + 2, axis=1)
    for j in range(dim):
        blocks[:, j + 1, j] = second[:, j]
    blocks[:, -1] = second
    return blocks.reshape(-1, dim)


def _morris(count: int, dim: int, seed: int) -> Array:
    generator, step = np.random.default_rng(seed), LEVELS // 2
    walks = np.repeat(generator.integers(0, LEVELS, (count, 1, dim)), dim + 1, axis=1)
    for walk in walks:
        for number, j in enumerate(generator.permutation(dim), start=1):
            walk[number:, j] += step if walk[0, j] < step else -step
    return walks.reshape(-1, dim) / (LEVELS - 1.0)


#: What draws shares, by the name of the method; called with count, dimension and seed.
METHODS: Mapping[str, Callable[[int, int, int], Array]] = MappingProxyType(
    {
        "latin_hypercube": _latin_hypercube,
        "sobol": _sobol,
        "random": _random,
        "saltelli": _saltelli,
        "morris": _morris,
    }
)
