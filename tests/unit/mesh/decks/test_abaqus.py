"""Decks of Abaqus: what its preprocessor writes comes with its regions and boundaries; a damaged deck is one error."""

import pytest

from fingerslip.mesh.io import read_mesh
from unit.mesh.decks.texts import CAE


def write(folder, text, name="deck.inp"):
    (folder / name).write_text(text)
    return folder / name


def middles(mesh, name):
    """Return the middles of the facets of a boundary, rounded and sorted."""
    return sorted(map(tuple, mesh.p[:, mesh.facets[:, mesh.boundaries[name]]].mean(axis=1).T.round(9).tolist()))


def test_a_deck_of_the_preprocessor_comes_with_its_regions_and_boundaries(tmp_path):
    mesh = read_mesh(write(tmp_path, CAE))
    counts = {"Touch": 3, "Round": 4, "Fixed_CNS_": 2, "Fixed": 2, "Line": 2}
    # Shifted by 10, then turned by 90 degrees about (10, 0): what was up is left.
    assert mesh.p.T.min(axis=0) == pytest.approx([8.0, 0.0])
    assert {name: len(cells) for name, cells in mesh.subdomains.items()} == {"Gel": 2, "Outer layer": 2, "Half": 3}
    assert (mesh.p[0, mesh.t[:, mesh.subdomains["Gel"]]] >= 9.0 - 1e-9).all()
    assert {name: len(facets) for name, facets in mesh.boundaries.items()} == counts
    assert middles(mesh, "Touch") == [(8.0, 0.5), (8.0, 1.5), (8.5, 2.0)]
    assert middles(mesh, "Fixed") == middles(mesh, "Fixed_CNS_") == [(10.0, 0.5), (10.0, 1.5)]
    assert middles(mesh, "Line") == [(8.5, 0.0), (9.5, 0.0)]
