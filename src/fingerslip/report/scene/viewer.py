"""Showing a result: an interactive window, a picture, a film."""

from __future__ import annotations

import dataclasses
import functools
import os
import re
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyvista
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from fingerslip.errors import InputError, ResultError
from fingerslip.history import nearest_snapshot, site_kinds
from fingerslip.report.colours import BLUE, EVENT_COLOURS, GREEN, RECEPTOR_COLOURS, VERMILLION
from fingerslip.report.figures.marks import event_keys, mark_run
from fingerslip.report.figures.style import add_legend, figure_grid, with_style
from fingerslip.report.scene.names import CUTS
from fingerslip.report.scene.options import SCALARS, SceneOptions
from fingerslip.report.scene.scene import aim, check_options, draw_scene, region_names
from fingerslip.slip import Events, slide_window
from fingerslip.slip.windows import EVENTS
from fingerslip.storage.files import new_file

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "FILMS",
    "PICTURES",
    "SceneControl",
    "has_display",
    "nearest_node",
    "open_window",
    "picked_figure",
    "prepare_rendering",
    "receptor_legend",
    "save_movie",
    "save_still",
    "still",
    "stills",
]


Floats = NDArray[np.float64]


class SceneControl:
    """A scene that is drawn anew when something of it is changed.

    Units: time [s].
    """

    def __init__(self, plotter: Any, history: xr.Dataset, options: SceneOptions, time: float | None = None) -> None:
        self.plotter, self.history, self.options = plotter, history, options
        self.number = nearest_snapshot(history, time)
        self.plotter.set_background("white")
        self.draw()
        aim(plotter, history, options)

    def draw(self) -> None:
        """Draw the snapshot."""
        draw_scene(self.plotter, self.history, self.number, self.options)

    def show(self, time: float) -> None:
        """Show the snapshot nearest to a time [s]."""
        self.number = nearest_snapshot(self.history, time)
        self.draw()

    def choose(self, **values: Any) -> None:
        """Change options by name, such as the field, the cut or what is drawn."""
        self.options = dataclasses.replace(self.options, **values)
        self._clear()
        self.draw()
        if "camera" in values:
            aim(self.plotter, self.history, self.options)

    def toggle(self, region: str, visible: bool) -> None:
        """Show or hide a layer; at least one stays."""
        hidden = {*self.options.hidden, region} if not visible else {*self.options.hidden} - {region}
        shown = [name for name in region_names(self.history) if name not in hidden]
        if shown:
            self.choose(hidden=tuple(sorted(hidden)))

    def _clear(self) -> None:
        """Remove what the options decide, bars of colours included."""
        for name in list(self.plotter.actors):
            if name.split(" ")[0] in {"layer", "plate", "arrow", "sites", "contact", "time"}:
                self.plotter.remove_actor(name, render=False)
        for title in list(self.plotter.scalar_bars.keys()):
            self.plotter.remove_scalar_bar(title, render=False)


def nearest_node(history: xr.Dataset, number: int, point: Floats) -> int:
    """Return the node of the mesh nearest to a point of the scene.

    Arrays: point (3,) [mm].
    """
    positions = 1e3 * (history["node_position"].values + history["snapshot_displacement"].values[number])
    return int(np.linalg.norm(positions - np.asarray(point)[: positions.shape[1]], axis=1).argmin())


@with_style
def picked_figure(history: xr.Dataset, node: int, events: Events | None = None) -> Figure:
    """Draw what a node does over the snapshots: displacement by components, and von Mises stress around it."""
    times = history["snapshot_time"].values
    place = ", ".join(f"{value:.2f}" for value in 1e3 * history["node_position"].values[node])
    title = f"Node {node} at ({place}) mm"
    figure, (above, below) = figure_grid(2, 1, (4.6, 1.7), title, ("time [s]", ""), share="x")
    moved = 1e3 * history["snapshot_displacement"].values[:, node]
    for component, values, colour in zip("xyz", moved.T, (BLUE, VERMILLION, GREEN), strict=False):
        above.plot(times, values, color=colour, label=component)
    above.set_ylabel("displacement [mm]")
    above.legend(loc="upper left", ncols=3)
    around = (history["cell_nodes"].values == node).any(axis=1)
    factor = SCALARS["von_mises"][1]
    below.plot(times, factor * history["snapshot_von_mises"].values[:, around].mean(axis=1), color=BLUE)
    below.set_ylabel("von Mises stress [kPa]")
    below.set_ylim(bottom=0.0)
    for axes in (above, below):
        mark_run(axes, history, events.slip if events else None)
    add_legend(figure, event_keys([events.slip] if events else []))
    return figure


def receptor_legend(history: xr.Dataset) -> list[tuple[str, str]]:
    """Return the types of recorded receptors with their colours."""
    known = dict.fromkeys(str(kind) for kind in site_kinds(history))
    return [(kind, RECEPTOR_COLOURS[kind]) for kind in RECEPTOR_COLOURS if kind in known]


_PROBE = (
    "import pyvista; plotter = pyvista.Plotter(off_screen=True, window_size=(32, 32)); "
    "plotter.add_mesh(pyvista.Sphere()); assert plotter.screenshot(None).std() > 0"
)
_WINDOW = "VTK_DEFAULT_OPENGL_WINDOW"
# With a graphics driver's EGL, and with Mesa's software renderer.
_WINDOWS = ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow")
_SECONDS = 60
_SECONDS_TO_ANSWER = 3.0
_DISPLAY = re.compile(r"(?P<host>[^:]*):(?P<number>\d{1,4})(\.\d+)?")
_X_PORT = 6000


def has_display() -> bool:
    """Tell whether there is a screen to open windows on: on Linux an X server that answers."""
    return sys.platform != "linux" or _answers(os.environ.get("DISPLAY", ""))


def _answers(display: str) -> bool:
    """Tell whether there is an X server at a display; one is named long after a remote session has ended."""
    known = _DISPLAY.fullmatch(display)
    if known is None:
        return False
    host, number = known["host"], int(known["number"])
    path = f"/tmp/.X11-unix/X{number}"
    if host not in {"", "unix"}:
        return _connects(socket.AF_INET, (host, _X_PORT + number))
    return _connects(socket.AF_UNIX, path) or _connects(socket.AF_UNIX, f"\0{path}")


def _connects(family: socket.AddressFamily, address: str | tuple[str, int]) -> bool:
    with socket.socket(family) as tried:
        tried.settimeout(_SECONDS_TO_ANSWER)
        try:
            tried.connect(address)
        except OSError:
            return False
    return True


def prepare_rendering() -> None:
    """Make VTK draw without a display where there is none.

    VTK ends the whole process where it cannot draw, so each kind of window is tried once in a process of its own.
    """
    if has_display() or _WINDOW in os.environ:
        return
    window = _working_window()
    if window is None:
        raise ResultError(
            "pictures in 3D cannot be drawn here: there is no display, and neither EGL nor OSMesa works; "
            "install Mesa (Debian, Ubuntu: sudo apt-get install libegl1 libgl1-mesa-dri; Fedora: sudo dnf install "
            "mesa-libEGL mesa-dri-drivers) or open the run's snapshots.pvd with ParaView on another machine"
        )
    os.environ[_WINDOW] = window


@functools.cache
def _working_window() -> str | None:
    """Return the first kind of window that draws."""
    return next((window for window in _WINDOWS if _draws(window)), None)


def _draws(window: str) -> bool:
    try:
        tried = subprocess.run(
            [sys.executable, "-c", _PROBE],
            env={**os.environ, _WINDOW: window},
            capture_output=True,
            timeout=_SECONDS,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return tried.returncode == 0


#: Endings of files that can be written.
PICTURES = (".png", ".jpg", ".webp")
FILMS = (".gif", ".webp")

_SIZE = (1200, 900)
_FRAME_MILLISECONDS = 80
_BOX = 28


def still(
    history: xr.Dataset,
    time: float | None = None,
    options: SceneOptions | None = None,
    size: tuple[int, int] = _SIZE,
) -> NDArray[np.uint8]:
    """Render the snapshot nearest to a time, with or without a display.

    Arrays: time [s]; size [pixels]; returns (height, width, 3).
    """
    options = options or SceneOptions()
    check_options(history, options)
    (picture,) = stills(history, [nearest_snapshot(history, time)], options, size)
    return picture


def stills(
    history: xr.Dataset, numbers: Sequence[int], options: SceneOptions, size: tuple[int, int] = _SIZE
) -> Iterator[NDArray[np.uint8]]:
    """Render snapshots with one camera, see :func:`still`.

    Arrays: size [pixels]; returns (height, width, 3).
    """
    check_options(history, options)
    prepare_rendering()
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=list(size))
    try:
        plotter.set_background("white")
        for index, number in enumerate(numbers):
            draw_scene(plotter, history, number, options)
            if index == 0:
                aim(plotter, history, options)
            yield np.asarray(plotter.screenshot(None, return_img=True))[..., :3]
    finally:
        plotter.close()


def save_still(
    history: xr.Dataset, path: str | Path, time: float | None = None, options: SceneOptions | None = None
) -> None:
    """Write a picture of one snapshot, see :func:`still`.

    Units: time [s].
    """
    path = _checked_path(path, PICTURES)
    picture = Image.fromarray(still(history, time, options))
    _write(path, [picture])


def save_movie(history: xr.Dataset, path: str | Path, options: SceneOptions | None = None) -> None:
    """Write a film of all snapshots."""
    path = _checked_path(path, FILMS)
    options = options or SceneOptions()
    check_options(history, options)
    frames = stills(history, range(history.sizes["snapshot_time"]), options, (800, 600))
    _write(path, [Image.fromarray(frame) for frame in frames])


def open_window(
    history: xr.Dataset, options: SceneOptions | None = None, title: str = "fingerslip", events: Events | None = None
) -> None:
    """Open an interactive window: a slider for time, boxes for layers, plate, receptors and contact, keys for the rest.

    The keys F and X show the next field and the next cut; P over the body draws what the node below the mouse does.
    """
    options = options or SceneOptions()
    check_options(history, options)
    if not has_display():
        raise InputError(
            "view",
            "found no display to open a window on",
            "needs one that answers",
            "write --web for a browser, --screenshot FILE for a picture or --movie FILE for a film",
        )
    plotter: Any = pyvista.Plotter(title=title)
    _add_controls(SceneControl(plotter, history, options), events)
    plotter.show()


def _add_controls(control: SceneControl, events: Events | None = None) -> None:
    """Add the slider, the boxes, the keys and the picking of nodes to a scene."""
    plotter, times = control.plotter, control.history["snapshot_time"].values
    if times.size > 1:
        ends, first = (times[0], times[-1]), times[control.number]
        plotter.add_slider_widget(control.show, ends, value=first, title="time [s]", color="black")
    _add_boxes(control)
    _list_events(control, events)
    plotter.add_key_event("f", lambda: control.choose(scalar=_next(tuple(SCALARS), control.options.scalar)))
    plotter.add_key_event("x", lambda: control.choose(cut=_next(CUTS, control.options.cut)))
    plotter.enable_point_picking(lambda point: _draw_picked_node(control, point), show_message=False, show_point=False)


def _add_boxes(control: SceneControl) -> None:
    """Add a box for each layer, and for the plate, the receptors and the contact."""
    layers = region_names(control.history)
    acts: dict[str, tuple[bool, Callable[[bool], None]]] = {
        name: (name not in control.options.hidden, functools.partial(control.toggle, name)) for name in layers
    }
    for name in ("plate", "receptors", "contact"):
        acts[name] = (getattr(control.options, name), functools.partial(_choose, control, name))
    for row, (name, (shown, act)) in enumerate(acts.items()):
        bottom = 10 + row * (_BOX + 6)
        control.plotter.add_checkbox_button_widget(act, value=shown, position=(10, bottom), size=_BOX)
        control.plotter.add_text(name, position=(16 + _BOX, bottom), font_size=9, color="black", name=f"box {name}")


def _choose(control: SceneControl, name: str, state: bool) -> None:
    control.choose(**{name: state})


def _list_events(control: SceneControl, events: Events | None) -> None:
    """Write the times of the events at the right, in their colours."""
    window = slide_window(control.history)
    lines = [] if window is None else [("slide starts", window.start, "#555555")]
    if events is not None:
        named = ((EVENTS[name], events.slip.time(name), EVENT_COLOURS[name]) for name in EVENTS)
        lines += [(words, time, colour) for words, time, colour in named if time is not None]
    for row, (words, time, colour) in enumerate(lines):
        where, text = (0.8, 0.8 - 0.035 * row), f"{words} {time:.3f} s"
        control.plotter.add_text(text, position=where, viewport=True, font_size=9, color=colour, name=f"event {words}")


def _draw_picked_node(control: SceneControl, point: Any) -> None:
    """Draw the displacement of the picked node over time in a corner."""
    node = nearest_node(control.history, control.number, np.asarray(point))
    times = control.history["snapshot_time"].values
    moved = 1e3 * np.linalg.norm(control.history["snapshot_displacement"].values[:, node], axis=1)
    chart = pyvista.Chart2D(size=(0.32, 0.26), loc=(0.66, 0.02), x_label="time [s]", y_label="displacement [mm]")
    chart.line(times, moved, color=BLUE, width=2.0)
    chart.title = f"node {node}"
    if control.plotter.renderer.has_charts:
        control.plotter.remove_chart(0)
    control.plotter.add_chart(chart)


def _next(names: Sequence[str], name: str) -> Any:
    return names[(names.index(name) + 1) % len(names)]


def _checked_path(path: str | Path, endings: tuple[str, ...]) -> Path:
    path = Path(path)
    if path.suffix.lower() not in endings:
        raise InputError(str(path), f"ends in '{path.suffix}'", f"needs one of {', '.join(endings)}")
    return path


def _write(path: Path, frames: list[Image.Image]) -> None:
    """Write frames, whole or not at all."""
    more: dict[str, Any] = {"save_all": True, "append_images": frames[1:], "duration": _FRAME_MILLISECONDS, "loop": 0}
    with new_file(path) as partial:
        frames[0].save(partial, **(more if len(frames) > 1 else {}))
