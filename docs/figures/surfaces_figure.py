"""Draw ``surfaces.png``: the synthetic scan as it comes, placed on the plate, and cut open as layers of tetrahedra.

python docs/figures/surfaces_figure.py
"""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pyvista
import skfem
from PIL import Image

import fingerslip as fs

HERE = Path(__file__).parent
MESHES = HERE.parents[1] / "meshes"
COLOURS = {"skin": "#e8a87c", "tissue": "#f6dfae", "phalanx": "#b9c2cc"}
SCAN = fs.SurfaceMesh(
    skin=str(MESHES / "scan_skin.stl"),
    phalanx=str(MESHES / "scan_phalanx.stl"),
    tip=(0.8, 0.36, 0.48),
    pad=(0.48, -0.86, -0.155),
    plate_angle=np.radians(20.0),
    layers=fs.LayerSizes(contact_size=0.6e-3, bulk_size=1.6e-3, cut=18e-3),
)


def polydata(surface: fs.Surface) -> pyvista.PolyData:
    """Return a surface for drawing [mm]."""
    return pyvista.PolyData.from_regular_faces(surface.points * 1e3, surface.triangles)


def grid(mesh: skfem.MeshTet1, region: str) -> pyvista.UnstructuredGrid:
    """Return the cells of a region that are behind the middle plane, whole [mm]."""
    cells = mesh.t[:, mesh.subdomains[region]].T
    behind = mesh.p[2][cells].mean(axis=1) < 0
    return pyvista.UnstructuredGrid({pyvista.CellType.TETRA: cells[behind]}, mesh.p.T * 1e3)


def picture(plotter: pyvista.Plotter, direction: tuple[float, ...], up: tuple[float, ...]) -> np.ndarray:
    """Render without perspective, and crop to what is drawn."""
    plotter.enable_parallel_projection()
    plotter.view_vector(direction, viewup=up)
    plotter.reset_camera()
    image = np.asarray(plotter.screenshot(return_img=True))
    plotter.close()
    drawn = np.argwhere((image < 250).any(axis=2))
    (top, left), (bottom, right) = drawn.min(axis=0), drawn.max(axis=0)
    return image[top : bottom + 1, left : right + 1]


def canvas() -> pyvista.Plotter:
    """Return an empty white canvas."""
    plotter = pyvista.Plotter(off_screen=True, window_size=(1100, 900))
    plotter.set_background("white")
    return plotter


def as_it_comes(skin: fs.Surface) -> np.ndarray:
    """Draw the scan with its hole, its open end and the triangles that face the wrong way."""
    plotter = canvas()
    plotter.add_mesh(
        polydata(skin), color=COLOURS["skin"], show_edges=True, line_width=0.5, backface_params={"color": "#7a1f3d"}
    )
    x, y = np.array([0.8, 0.36, 0.48]), -np.array([0.48, -0.86, -0.155])
    z = np.cross(x, y)
    return picture(plotter, tuple(0.35 * x + 0.75 * z + 0.3 * y), tuple(y))


def placed(mesh: skfem.MeshTet1) -> np.ndarray:
    """Draw the layers behind the middle plane on the plate."""
    plotter = canvas()
    for region, colour in COLOURS.items():
        plotter.add_mesh(grid(mesh, region), color=colour, show_edges=True, line_width=0.7)
    plate = pyvista.Cube(center=(-8.0, -0.25, -4.0), x_length=24.0, y_length=0.5, z_length=10.0)
    plotter.add_mesh(plate, color="#56657a")
    return picture(plotter, (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))


def from_below(mesh: skfem.MeshTet1) -> np.ndarray:
    """Draw the skin from below, the pad in another colour."""
    plotter = canvas()
    for name, colour in (("skin", COLOURS["skin"]), ("pad", "#3d7ea6")):
        facets = mesh.facets[:, mesh.boundaries[name]].T
        offset = [0.0, 0.0 if name == "skin" else -0.01, 0.0]
        drawn = pyvista.PolyData.from_regular_faces(mesh.p.T * 1e3 + offset, facets)
        plotter.add_mesh(drawn, color=colour, show_edges=True, line_width=0.7)
    return picture(plotter, (0.0, -1.0, 0.0), (0.0, 0.0, 1.0))


def main() -> None:
    """Mesh the scan and draw it."""
    scan = fs.mesh_scan(SCAN)
    images = {
        "scan as it comes": as_it_comes(fs.read_surface(SCAN.skin)),
        "layers on the plate, cut at z = 0": placed(scan.mesh),
        "from below: contact patch (pad)": from_below(scan.mesh),
    }
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.9), layout="constrained")
    for axis, (title, image) in zip(axes, images.items(), strict=True):
        axis.imshow(image)
        axis.set_title(title, fontsize=11)
        axis.axis("off")
    figure.savefig(HERE / "surfaces.png", dpi=110)
    # 256 colours are enough, and a third of the bytes.
    with Image.open(HERE / "surfaces.png") as drawn:
        drawn.convert("RGB").quantize(256).save(HERE / "surfaces.png", optimize=True)


if __name__ == "__main__":
    main()
