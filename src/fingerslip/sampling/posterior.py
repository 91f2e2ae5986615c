"""What measured curves say of the sampled values of a study: emulator, likelihood and posterior.

Curves count in standard deviations of the measurement. The emulator writes the curves of the runs as their mean and
principal components, and fits a Gaussian process to the score of each (Higdon et al. 2008). Of values x it says scores
with mean a(x) and variance S(x). With components P, the measured curves y are normal with

    mean  m + P a(x),    covariance  (1 + r) I + P S(x) P' + d^2 K:

measurement and what the components leave out (r), emulator, and discrepancy of the model, which is smooth along a
curve (Kennedy & O'Hagan 2001): K has a length of a fifth of the curve. Its standard deviation d is sampled with x by
emcee (Foreman-Mackey et al. 2013).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fingerslip.arrays import Floats
from fingerslip.errors import InputError, optional_module
from fingerslip.sampling.curves import Measurement
from fingerslip.sampling.indices import fit_process

_LEFT_OUT, _MOST_COMPONENTS = 0.1, 12  # standard deviations that components may leave out, and how many there are
_UNPREDICTED = 0.5  # share of the variance of an output
_JITTER = 1e-10  # added to the kernel's matrix, in variances
_LENGTH = 0.2  # of the discrepancy, as a share of the curve
_FIRST, _WALKERS, _CHUNK, _MOST_STEPS = 4096, 32, 500, 40_000
_LENGTHS, _R_HAT = 50, 1.05  # autocorrelation times of a chain at least, and R-hat at most
EMCEE = ("emcee", "fit", "fit", "the posterior needs it")


@dataclass(frozen=True)
class Processes:
    """Gaussian processes of some outputs at the same points."""

    points: Floats  # (n, dim), shares of the ranges
    scales: Floats  # (n_outputs, dim), one over the squared length in each direction
    variances: Floats  # (n_outputs,), of the kernel
    weights: Floats  # (n_outputs, n)
    roots: Floats  # (n_outputs, n, n), inverses of the Cholesky factors of the kernel's matrix
    errors: Floats  # (n_outputs, n), of each run in a process without it
    noises: Floats  # (n_outputs,), variance that is not of the points

    def predict(self, points: Floats) -> tuple[Floats, Floats]:
        """Return means and variances at points (m, dim), both (m, n_outputs).

        No variance is less than the mean square of the errors: else a likelihood has modes beside the runs.
        """
        squares = (points[:, None] - self.points) ** 2
        kernel = self.variances * np.exp(-0.5 * (squares @ self.scales.T))
        mean = np.einsum("mno,on->mo", kernel, self.weights)
        explained = (np.matmul(self.roots, kernel.transpose(2, 1, 0)) ** 2).sum(axis=1).T
        variance = self.variances + self.noises - explained
        return mean, np.maximum(variance, (self.errors**2).mean(axis=1))


def fit_processes(points: Floats, outputs: Floats) -> Processes:
    """Fit a process to each of some outputs (n, n_outputs), of mean 0 and variance 1, at points (n, dim)."""
    columns = []
    for values in outputs.T:
        kernel = fit_process(points, values, None).kernel_
        variance = kernel.k1.k1.constant_value
        matrix = kernel(points) + _JITTER * variance * np.eye(len(points))
        root = np.linalg.inv(np.linalg.cholesky(matrix))
        weights = root.T @ (root @ values)
        # Errors of runs that are left out, in closed form (Rasmussen & Williams 2006).
        errors, noise = weights / (root**2).sum(axis=0), kernel.k2.noise_level
        if np.mean(errors**2) > _UNPREDICTED:  # nothing is known between the runs
            weights, root, variance, noise, errors = 0.0 * weights, 0.0 * root, 1.0, 0.0, values
        lengths = np.broadcast_to(kernel.k1.k2.length_scale, points.shape[1])
        columns.append((lengths**-2.0, variance, weights, root, errors, noise))
    return Processes(points, *map(np.array, zip(*columns, strict=True)))


@dataclass(frozen=True)
class Emulator:
    """Curves between the runs of a study, in standard deviations of the measurement."""

    mean: Floats  # (m,)
    components: Floats  # (n_components, m), each times the standard deviation of its score
    processes: Processes  # of the scores, which have mean 0 and variance 1
    left_out: float  # mean square of what the components leave out

    @property
    def error(self) -> float:
        """Root mean square error of runs that were not fitted to."""
        squares = (self.processes.errors**2).mean(axis=1) @ (self.components**2).mean(axis=1)
        return float(np.sqrt(squares + self.left_out))

    def draw(self, points: Floats, generator: np.random.Generator, most: int | None = None) -> Floats:
        """Draw a curve at each of some points, (n, m); of m numbers the first ones."""
        mean, variance = self.processes.predict(points)
        scores = mean + np.sqrt(variance) * generator.standard_normal(mean.shape)
        return np.asarray(self.mean[:most] + scores @ self.components[:, :most])


def fit_emulator(points: Floats, curves: Floats) -> Emulator:
    """Fit an emulator to curves (n, m) of runs at points (n, dim)."""
    mean = curves.mean(axis=0)
    left, sizes, right = np.linalg.svd(curves - mean, full_matrices=False)
    rest = np.append(np.cumsum(sizes[::-1] ** 2)[::-1][1:], 0.0) / curves.size
    if sizes[0] ** 2 <= _LEFT_OUT**2 * curves.size:
        fault = "hardly differ between the runs, by less than a tenth of the measurement's standard deviation"
        raise InputError("fit.columns", fault, "needs curves that the sampled values change", "sample other values")
    count = min(int(np.argmax(rest <= _LEFT_OUT**2)) + 1, _MOST_COMPONENTS)
    spreads = sizes[:count] / np.sqrt(len(curves))
    scores = left[:, :count] * np.sqrt(len(curves))
    return Emulator(mean, spreads[:, None] * right[:count], fit_processes(points, scores), float(rest[count - 1]))


class Likelihood:
    """Log posterior density of shares of the ranges and the discrepancy, (n, dim + 1) to (n,).

    All matrices are of the size of the scores: along the eigenvectors of K the covariance without the emulator is
    diagonal, and what the likelihood needs of curves and components is summed for each eigenvalue beforehand.
    """

    def __init__(self, emulator: Emulator, measurement: Measurement, scale: float) -> None:
        self.emulator, self.scale = emulator, scale
        self.eigenvalues, vectors = np.linalg.eigh(discrepancy(measurement.positions))
        shape = (-1, *measurement.values.shape)
        residual = (measurement.in_deviations(measurement.values) - emulator.mean).reshape(shape)
        both = np.concatenate((residual, emulator.components.reshape(shape))) @ vectors
        self._products = np.einsum("acj,bcj->jab", both, both)
        self._columns = len(measurement.columns)

    def __call__(self, points: Floats) -> Floats:
        """Return the logarithm of the density, up to a constant."""
        shares, size = points[:, :-1], points[:, -1]
        inside = ((shares >= 0.0) & (shares <= 1.0)).all(axis=1) & (size >= 0.0)
        density = np.full(len(points), -np.inf)
        if not inside.any():
            return density
        squares, volume = self.misfit(shares[inside], size[inside])
        density[inside] = -0.5 * (squares + volume) - 0.5 * (size[inside] / self.scale) ** 2
        return density

    def misfit(self, shares: Floats, size: Floats) -> tuple[Floats, Floats]:
        """Return residuals squared over their covariance, and the logarithm of its determinant, both (n,)."""
        mean, variance = self.emulator.processes.predict(shares)
        diagonal = 1.0 + self.emulator.left_out + np.outer(size**2, np.maximum(self.eigenvalues, 0.0))
        products = np.einsum("wj,jab->wab", 1.0 / diagonal, self._products)
        inner, outer = products[:, 1:, 1:], products[:, 1:, 0]
        rest = outer - np.einsum("wab,wb->wa", inner, mean)
        squares = products[:, 0, 0] - np.einsum("wa,wa->w", mean, outer + rest)
        # The emulator's variance by the formulas of Woodbury and Sylvester.
        capacity = inner + np.eye(mean.shape[1]) / variance[:, None, :]
        squares -= np.einsum("wa,wa->w", rest, np.linalg.solve(capacity, rest[..., None])[..., 0])
        volume = self._columns * np.log(diagonal).sum(axis=1) + np.log(variance).sum(axis=1)
        return squares, np.asarray(volume + np.linalg.slogdet(capacity)[1])


def discrepancy(positions: Floats) -> Floats:
    """Return K, the correlation of the discrepancy between positions (n,) along a curve, (n, n)."""
    distances = (positions[:, None] - positions) / (_LENGTH * np.ptp(positions))
    return np.asarray(np.exp(-0.5 * distances**2))


@dataclass(frozen=True)
class Chain:
    """Samples of a posterior."""

    samples: Floats  # (n, dim + 1), shares of the ranges and the discrepancy
    r_hat: Floats  # (dim + 1,), of halves of the walkers
    times: Floats  # (dim + 1,), autocorrelation times [steps]


def sample_posterior(density: Likelihood, dim: int, seed: int = 1) -> Chain:
    """Sample a posterior until its chain is many autocorrelation times long and its walkers agree."""
    emcee: Any = optional_module(*EMCEE)
    generator = np.random.default_rng(seed)
    walkers = max(_WALKERS, 4 * (dim + 1))
    sizes = density.scale * np.abs(generator.standard_normal((_FIRST, 1)))
    first = np.hstack((generator.random((_FIRST, dim)), sizes))
    moves = [(emcee.moves.DEMove(), 0.5), (emcee.moves.StretchMove(), 0.5)]  # the second brings in those far away
    sampler = emcee.EnsembleSampler(walkers, dim + 1, density, vectorize=True, moves=moves)
    sampler.random_state = np.random.MT19937(seed).state
    state: Any = first[np.argsort(density(first))[-walkers:]]
    for steps in range(_CHUNK, _MOST_STEPS + 1, _CHUNK):
        state = sampler.run_mcmc(state, _CHUNK)
        chain = sampler.get_chain(discard=steps // 3)
        with np.errstate(invalid="ignore"):  # walkers that have not moved yet
            times, r_hat = np.asarray(emcee.autocorr.integrated_time(chain, tol=0, quiet=True)), _r_hat(chain)
        if len(chain) >= _LENGTHS * times.max() and r_hat.max() <= _R_HAT:
            thinned = chain[:: max(int(times.min() / 2), 1)]
            return Chain(thinned.reshape(-1, dim + 1), r_hat, times)
    fault = f"has an R-hat of {r_hat.max():.3g} and {len(chain) / times.max():.0f} autocorrelation times"
    allowed = f"needs at most {_R_HAT} and {_LENGTHS} after {_MOST_STEPS} steps"
    repair = "check the units of the measurement, narrow the ranges, or give it a larger deviation"
    raise InputError("posterior", fault, allowed, repair)


def _r_hat(chain: Floats) -> Floats:
    """Return Gelman and Rubin's R-hat of the halves of all walkers of a chain (n_steps, n_walkers, n)."""
    half = len(chain) // 2
    halves = np.concatenate((chain[:half], chain[half : 2 * half]), axis=1)
    within = halves.var(axis=0, ddof=1).mean(axis=0)
    return np.asarray(np.sqrt((half - 1) / half + halves.mean(axis=0).var(axis=0, ddof=1) / within))
