"""A bar fixed at one end: its natural frequencies, and its motion under a sudden load.

Source: the wave equation; f_n = (2 n - 1) c / (4 L) with c = sqrt(E / rho), nu = 0. Consistent mass of linear
elements raises them by the factor 1 + (k h)^2 / 24 to leading order, below 0.04 % for the third of 80 elements.
"""

import numpy as np
import pytest
from scipy.sparse import linalg

import fingerslip as fs
from fingerslip.fe.forms import mass_matrix
from fingerslip.fe.space import boundary_nodes, vector_dofs
from fingerslip.verification.meshes import box
from problems.blocks import ELEMENTS, elastic, stiffness_of

LENGTH, HEIGHT, MODULUS, DENSITY = 1.0, 0.02, 1e6, 1000.0
SPEED = np.sqrt(MODULUS / DENSITY)


def bar(element, count=80):
    return box(element, np.linspace(0.0, LENGTH, count + 1), np.linspace(0.0, HEIGHT, 2))


@pytest.mark.parametrize("element", ELEMENTS)
def test_first_three_longitudinal_frequencies(element):
    material = elastic(MODULUS, 0.0, DENSITY)
    space, constants, stiffness = stiffness_of(bar(element), material, "plane_stress")
    mass = mass_matrix(space, constants, 1.0)
    held = [vector_dofs(boundary_nodes(space, "left"), 2)[:, 0], np.arange(1, space.n_dofs, 2)]
    free = np.setdiff1d(np.arange(space.n_dofs), np.concatenate(held))
    squares = linalg.eigsh(stiffness[free][:, free], k=3, M=mass[free][:, free], sigma=0.0, return_eigenvectors=False)
    found = np.sort(np.sqrt(squares)) / (2 * np.pi)
    expected = (2 * np.arange(1, 4) - 1) * SPEED / (4 * LENGTH)
    np.testing.assert_allclose(found, expected, rtol=5e-4)


def test_sudden_end_load_makes_a_triangular_wave():
    """The end runs up at the speed t c / E until 2 L / c, where it stands at twice the static extension.

    Tolerance 2 %: alpha = -0.05 rounds the corner of the triangle over a few steps.
    """
    stress = 1000.0
    period = 4 * LENGTH / SPEED
    model = fs.Model(
        mesh=bar("Q4"),
        materials={"bulk": fs.Elastic(MODULUS, 0.0, DENSITY)},
        formulation="plane_stress",
        supports={"left": ("x",), "bulk": ("y",)},
        tractions={"right": (stress, 0.0)},
        time=fs.TimeStepping(period / 400, end=period),
        record=fs.Recording(sites=(fs.Site("end", "", (LENGTH, 0.0)),)),
    )
    history = fs.simulate(model)
    end = history.displacement.values[:, 0, 0]
    static = stress * LENGTH / MODULUS
    triangle = 2 * static * (1 - np.abs(2 * history.time.values / period - 1))
    assert np.abs(end - triangle).max() <= 0.02 * 2 * static
    assert end.max() == pytest.approx(2 * static, rel=0.02)
    assert np.abs(history.energy_imbalance.values).max() <= 1e-10 * history.external_work.values.max()
