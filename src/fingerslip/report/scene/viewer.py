"""Showing a result: an interactive window, a picture, a film."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import os
import re
import socket
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from fingerslip.arrays import Floats
from fingerslip.contact.states import SLIP, STICK
from fingerslip.errors import InputError, ResultError
from fingerslip.history import nearest_snapshot, site_kinds
from fingerslip.libraries import pyvista
from fingerslip.report import colours as palette
from fingerslip.report.figures import style, time_axis
from fingerslip.report.scene import scene
from fingerslip.report.scene.names import CUTS
from fingerslip.report.scene.options import SCALARS, SceneOptions
from fingerslip.slip import Events, slide_window
from fingerslip.slip.windows import EVENTS
from fingerslip.storage.files import write_bytes

#: What can be shown or hidden beside the layers.
EXTRAS = ("plate", "receptors", "contact")
#: Endings of files that can be written.
PICTURES = (".png", ".jpg", ".webp")
FILMS = (".gif", ".webp")

_SIZE = (1200, 900)
_BOX = 28


class SceneControl:
    """A scene at a time [s] that is drawn anew when something of it is changed."""

    def __init__(self, plotter: Any, history: xr.Dataset, options: SceneOptions, time: float | None = None) -> None:
        self.plotter, self.history, self.options = plotter, history, options
        self.number = nearest_snapshot(history, time)
        self.plotter.set_background("white")
        self.draw()
        scene.aim(plotter, history, options)

    def draw(self) -> None:
        """Draw the snapshot."""
        scene.draw_scene(self.plotter, self.history, self.number, self.options)

    def show(self, time: float) -> None:
        """Show the snapshot nearest to a time [s]."""
        self.number = nearest_snapshot(self.history, time)
        self.draw()

    def choose(self, **values: Any) -> None:
        """Change options by name, such as the field, the cut or what is drawn."""
        self.options = dataclasses.replace(self.options, **values)
        # What the options decide goes first, bars of colours included.
        for name in list(self.plotter.actors):
            if name.split(" ")[0] in {"layer", "border", "plate", "arrow", "sites", "contact", "time"}:
                self.plotter.remove_actor(name, render=False)
        for title in list(self.plotter.scalar_bars.keys()):
            self.plotter.remove_scalar_bar(title, render=False)
        self.draw()
        if "camera" in values:
            scene.aim(self.plotter, self.history, self.options)

    def switch(self, extra: str, visible: bool) -> None:
        """Show or hide one of :data:`EXTRAS`."""
        self.choose(**{extra: visible})

    def toggle(self, region: str, visible: bool) -> None:
        """Show or hide a layer; at least one stays."""
        hidden = {*self.options.hidden} - {region} if visible else {*self.options.hidden, region}
        if not {*scene.region_names(self.history)} <= hidden:
            self.choose(hidden=tuple(sorted(hidden)))


def nearest_node(history: xr.Dataset, number: int, point: Floats) -> int:
    """Return the node of the mesh nearest to a point (3,) of the scene [mm]."""
    positions = 1e3 * (history["node_position"].values + history["snapshot_displacement"].values[number])
    return int(np.linalg.norm(positions - np.asarray(point)[: positions.shape[1]], axis=1).argmin())


@style.with_style
def picked_figure(history: xr.Dataset, node: int, events: Events = time_axis.NO_EVENTS) -> Figure:
    """Draw what a node does over the snapshots: displacement by components, and von Mises stress around it."""
    times = history["snapshot_time"].values
    position = ", ".join(f"{value:.2f}" for value in 1e3 * history["node_position"].values[node])
    title = f"Node {node} at ({position}) mm"
    figure, (above, below) = style.figure_grid(2, 1, (4.6, 1.7), title, ("time [s]", ""), share="x")
    displacement = 1e3 * history["snapshot_displacement"].values[:, node]
    for component, values, colour in zip("xyz", displacement.T, palette.LINES, strict=False):
        above.plot(times, values, color=colour, label=component)
    above.set_ylabel("displacement [mm]")
    above.legend(loc="upper left", ncols=3)
    around = (history["cell_nodes"].values == node).any(axis=1)
    stress = SCALARS["von_mises"][1] * history["snapshot_von_mises"].values[:, around].mean(axis=1)
    below.plot(times, stress, color=palette.BLUE)
    below.set_ylabel("von Mises stress [kPa]")
    below.set_ylim(bottom=0.0)
    time_axis.mark_panels((above, below), history, events.slip, named=0)
    style.add_legend(figure, time_axis.event_keys([events.slip]))
    return figure


def receptor_legend(history: xr.Dataset) -> list[tuple[str, str]]:
    """Return the types of recorded receptors with their colours."""
    recorded = set(map(str, site_kinds(history)))
    return [(kind, colour) for kind, colour in palette.RECEPTOR_COLOURS.items() if kind in recorded]


def event_legend(history: xr.Dataset, events: Events) -> list[tuple[str, float, str]]:
    """Return the start of the slide and the events that happened: in words, when [s], and in which colour."""
    window = slide_window(history)
    start = [] if window is None else [("slide starts", window.start, "#555555")]
    times = time_axis.event_times(events.slip)
    return [*start, *((EVENTS[name], time, palette.EVENT_COLOURS[name]) for name, time in times.items())]


def still(
    history: xr.Dataset, time: float | None = None, options: SceneOptions | None = None, size: tuple[int, int] = _SIZE
) -> NDArray[np.uint8]:
    """Render the snapshot nearest to a time [s] as a picture (height, width, 3), with or without a display."""
    options = options or SceneOptions()
    scene.check_options(history, options)
    return next(stills(history, [nearest_snapshot(history, time)], options, size))


def stills(
    history: xr.Dataset,
    numbers: Sequence[int],
    options: SceneOptions,
    size: tuple[int, int] = _SIZE,
    letters: float = 1.0,
) -> Iterator[NDArray[np.uint8]]:
    """Render snapshots with one camera, see :func:`still`; `letters` is a factor on those of the scale."""
    scene.check_options(history, options)
    with off_screen(size) as plotter:
        for index, number in enumerate(numbers):
            scene.draw_scene(plotter, history, number, options)
            if index == 0:
                scene.aim(plotter, history, options, numbers)
                scene.draw_scale(plotter, scene.snapshot_grid(history, number).points, letters)
                if options.written:
                    _add_names(plotter, history, options)
            plotter.reset_camera_clipping_range()
            yield picture_of(plotter)


@contextlib.contextmanager
def off_screen(size: tuple[int, int]) -> Iterator[Any]:
    """Give a plotter that draws on white without a display, as long as the context lasts."""
    prepare_rendering()
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=list(size))
    plotter.set_background("white")
    try:
        yield plotter
    finally:
        plotter.close()


def picture_of(plotter: Any) -> NDArray[np.uint8]:
    """Return what a plotter shows (height, width, 3)."""
    return np.asarray(plotter.screenshot(None, return_img=True))[..., :3]


def _add_names(plotter: Any, history: xr.Dataset, options: SceneOptions) -> None:
    """Say what the colours of a picture stand for beside its field."""
    regions = palette.region_colours(scene.region_names(history)) if options.scalar == "region" else {}
    names = regions | {
        palette.STATE_NAMES[state]: palette.STATE_COLOURS[state] for state in (STICK, SLIP) if options.contact
    }
    if options.receptors and site_kinds(history).size:
        names |= dict(receptor_legend(history)) or {"recorded sites": palette.BLACK}
    for row, (name, colour) in enumerate(names.items()):
        where = (0.8, 0.95 - 0.04 * row)
        look = {"font_size": 12, "color": "black" if name in regions else colour, "name": f"name {name}"}
        text = plotter.add_text(name, position=where, viewport=True, **look).prop
        # Colours of regions are too pale for letters, and some letters stand on the body.
        text.background_color, text.background_opacity = regions.get(name, "white"), 1.0


def save_still(
    history: xr.Dataset, path: str | Path, time: float | None = None, options: SceneOptions | None = None
) -> None:
    """Write a picture of the snapshot nearest to a time [s]."""
    _save(path, PICTURES, lambda: [still(history, time, options)])


def save_movie(history: xr.Dataset, path: str | Path, options: SceneOptions | None = None) -> None:
    """Write a film of all snapshots."""
    numbers = range(history.sizes.get("snapshot_time", 0))
    _save(path, FILMS, lambda: stills(history, numbers, options or SceneOptions(), (800, 600)))


def _save(path: str | Path, endings: tuple[str, ...], draw: Callable[[], Iterable[NDArray[np.uint8]]]) -> None:
    path = Path(path)
    if path.suffix.lower() not in endings:
        raise InputError(str(path), f"ends in '{path.suffix}'", f"needs one of {', '.join(endings)}")
    write_bytes(path, style.picture_bytes(draw(), path.suffix))


def open_window(history: xr.Dataset, options: SceneOptions, title: str, events: Events) -> None:
    """Open an interactive window: a slider for time, boxes for layers, plate, receptors and contact, keys for the rest.

    The keys F and X show the next field and the next cut; P over the body draws what the node below the mouse does.
    """
    scene.check_options(history, options)
    if not has_display():
        repair = "write --web for a browser, --screenshot FILE for a picture or --movie FILE for a film"
        raise InputError("view", "found no display to open a window on", "needs one that answers", repair)
    plotter: Any = pyvista.Plotter(title=title)
    _add_controls(SceneControl(plotter, history, options), events)
    plotter.show()


def _add_controls(control: SceneControl, events: Events) -> None:
    """Add the slider, the boxes, the times of events, the keys and the picking of nodes to a scene."""
    plotter, times = control.plotter, control.history["snapshot_time"].values
    if times.size > 1:
        ends, first = (times[0], times[-1]), times[control.number]
        plotter.add_slider_widget(control.show, ends, value=first, title="time [s]", color="black")
    boxes: dict[str, tuple[bool, Callable[[bool], None]]] = {
        name: (name not in control.options.hidden, functools.partial(control.toggle, name))
        for name in scene.region_names(control.history)
    }
    for extra in EXTRAS:
        boxes[extra] = getattr(control.options, extra), functools.partial(control.switch, extra)
    for row, (name, (is_on, act)) in enumerate(boxes.items()):
        bottom = 10 + row * (_BOX + 6)
        plotter.add_checkbox_button_widget(act, value=is_on, position=(10, bottom), size=_BOX)
        plotter.add_text(name, position=(16 + _BOX, bottom), font_size=9, color="black", name=f"box {name}")
    for row, (words, time, colour) in enumerate(event_legend(control.history, events)):
        where, look = (0.8, 0.8 - 0.035 * row), {"font_size": 9, "color": colour, "name": f"event {words}"}
        plotter.add_text(f"{words} {time:.3f} s", position=where, viewport=True, **look)
    plotter.add_key_event(
        "f", lambda: control.choose(scalar=_next(scene.fields_of(control.history), control.options.scalar))
    )
    plotter.add_key_event("x", lambda: control.choose(cut=_next(CUTS, control.options.cut)))
    plotter.enable_point_picking(lambda point: _draw_picked_node(control, point), show_message=False, show_point=False)


def _draw_picked_node(control: SceneControl, point: Any) -> None:
    """Draw the displacement of the picked node over time in a corner."""
    node, renderer = nearest_node(control.history, control.number, np.asarray(point)), control.plotter.renderer
    distances = 1e3 * np.linalg.norm(control.history["snapshot_displacement"].values[:, node], axis=1)
    chart = pyvista.Chart2D(size=(0.32, 0.26), loc=(0.66, 0.02), x_label="time [s]", y_label="displacement [mm]")
    chart.line(control.history["snapshot_time"].values, distances, color=palette.BLUE, width=2.0)
    chart.title = f"node {node}"
    if renderer.has_charts:
        control.plotter.remove_chart(0)
    control.plotter.add_chart(chart)


def _next(names: Sequence[str], name: str) -> Any:
    return names[(names.index(name) + 1) % len(names)]


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
    """Tell whether there is a screen to open windows on: on Linux an X server that answers.

    One is named long after a remote session has ended.
    """
    display = _DISPLAY.fullmatch(os.environ.get("DISPLAY", ""))
    if sys.platform != "linux" or display is None:
        return sys.platform != "linux"
    host, number = display["host"], int(display["number"])
    if host not in {"", "unix"}:
        return _connects(socket.AF_INET, (host, _X_PORT + number))
    path = f"/tmp/.X11-unix/X{number}"
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
    window = next(filter(_draws, _WINDOWS), None)
    if window is None:
        raise ResultError(
            "pictures in 3D cannot be drawn here: there is no display, and neither EGL nor OSMesa works; "
            "install Mesa (Debian, Ubuntu: sudo apt-get install libegl1 libgl1-mesa-dri; Fedora: sudo dnf install "
            "mesa-libEGL mesa-dri-drivers) or open the run's snapshots.pvd with ParaView on another machine"
        )
    os.environ[_WINDOW] = window


@functools.cache
def _draws(window: str) -> bool:
    """Tell whether a kind of window draws."""
    command, environ = [sys.executable, "-c", _PROBE], {**os.environ, _WINDOW: window}
    try:
        return not subprocess.run(command, check=False, env=environ, capture_output=True, timeout=_SECONDS).returncode
    except (OSError, subprocess.TimeoutExpired):
        return False
