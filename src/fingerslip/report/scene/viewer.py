"""Showing a result: an interactive window, a picture, a film."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyvista
from numpy.typing import NDArray
from PIL import Image

from fingerslip.errors import InputError
from fingerslip.files import new_file
from fingerslip.history import nearest_snapshot
from fingerslip.report.colours import BLUE, EVENT_COLOURS
from fingerslip.report.scene.control import SceneControl, nearest_node
from fingerslip.report.scene.names import CUTS
from fingerslip.report.scene.options import SCALARS, SceneOptions
from fingerslip.report.scene.rendering import has_display, prepare_rendering
from fingerslip.report.scene.scene import aim, check_options, draw_scene, region_names
from fingerslip.slip import Events, slide_window
from fingerslip.slip.names import EVENTS

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["FILMS", "PICTURES", "open_window", "save_movie", "save_still", "still", "stills"]

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
    plotter.enable_point_picking(lambda point: _draw_picked(control, point), show_message=False, show_point=False)


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


def _draw_picked(control: SceneControl, point: Any) -> None:
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
