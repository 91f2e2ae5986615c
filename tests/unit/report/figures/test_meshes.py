"""Pictures of meshes: every region and boundary has its name, and is where it is in the mesh."""

import matplotlib.colors as mcolors
import numpy as np
import pytest
import skfem
from matplotlib.collections import LineCollection, PolyCollection

from fingerslip.report.colours import BLUE
from fingerslip.report.figures import meshes
from fingerslip.report.figures.meshes import mesh_figure
from fingerslip.verification.meshes import box

HALVES = {"low": lambda x: x[0] < 0.5, "high": lambda x: x[0] > 0.5}


def test_a_section_shows_its_regions_and_boundaries_by_name():
    mesh = box("Q4", *[np.linspace(0.0, 1.0, 5)] * 2, regions=HALVES)
    mesh = mesh.with_subdomains({"some of both": np.arange(3)})
    figure = mesh_figure(mesh, "pad")
    (axes,) = figure.axes
    (legend,) = figure.legends
    names = [text.get_text() for text in legend.get_texts()]
    assert names == ["low", "high", "some of both", *mesh.boundaries]
    cells = [entry for entry in axes.collections if isinstance(entry, PolyCollection)]
    assert [len(entry.get_paths()) for entry in cells] == [8, 8, 3]
    # What shares cells with a region before it is hatched, so that both are seen.
    assert [entry.get_hatch() is not None for entry in cells] == [False, False, True]
    lines = {entry.get_colors()[0].tobytes(): entry for entry in axes.collections if isinstance(entry, LineCollection)}
    for handle, name in zip(legend.legend_handles[3:], names[3:], strict=True):
        segments = np.array(lines[mcolors.to_rgba_array(handle.get_color())[0].tobytes()].get_segments())
        expected = 1e3 * mesh.p[:, mesh.facets[:, mesh.boundaries[name]]].transpose(2, 1, 0)
        np.testing.assert_allclose(segments, expected)


def test_a_region_and_a_boundary_of_one_name_are_both_in_the_legend():
    mesh = box("Q4", *[np.linspace(0.0, 1.0, 3)] * 2, regions=HALVES)
    mesh = mesh.with_boundaries({"low": mesh.boundaries["bottom"]})
    (legend,) = mesh_figure(mesh).figure.legends
    names = [text.get_text() for text in legend.get_texts()]
    assert sorted(names) == sorted(["low (region)", "high", "low (boundary)", *(set(mesh.boundaries) - {"low"})])


@pytest.mark.slow
@pytest.mark.parametrize(("up", "seen"), [("z", ("right", "top", "front")), ("y", ("right", "top", "back"))])
def test_a_solid_shows_half_of_its_regions_and_each_boundary(monkeypatch, up, seen):
    monkeypatch.setattr(meshes, "_WINDOW", (250, 225))
    mesh = box("H8", *[np.linspace(0.0, 1.0, 3)] * 3, regions=HALVES)
    mesh = mesh.with_subdomains({"some of both": np.arange(3)})
    figure = mesh_figure(mesh, "pad", up)
    names = [axes.get_title("left") for axes in figure.axes if axes.images]
    assert names == ["regions, cut open", "region some of both", *mesh.boundaries]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["low", "high"]
    red, _, blue = (255 * np.array(mcolors.to_rgb(BLUE))).astype(int)
    shares = {}
    for axes in figure.axes[: len(names)]:
        image = np.asarray(axes.images[0].get_array(), dtype=int)
        shares[axes.get_title("left")] = np.mean((image[..., 2] - image[..., 0]) > 0.3 * (blue - red))
    # The camera looks from the right, above and before: these sides are seen as they are, the others through the body.
    assert all(shares[name] > 0.02 for name in seen)
    assert shares["regions, cut open"] < 0.01


@pytest.mark.parametrize("regions", [{}, {"thin": lambda x: x[2] > 0.75, "thick": lambda x: x[2] < 0.75}])
def test_a_cut_leaves_some_of_every_region(regions):
    mesh = skfem.MeshHex.init_tensor(*[np.linspace(0.0, 1.0, 5)] * 3)
    figure = mesh_figure(mesh.with_subdomains(regions))
    assert [axes.get_title("left") for axes in figure.axes] == ["regions, cut open"]
    assert [text.get_text() for text in figure.legends[0].get_texts()] == list(regions or {"no region": 0})
