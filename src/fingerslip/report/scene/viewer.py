"""Showing a result: an interactive window, a picture, a film."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyvista
import xarray as xr
from numpy.typing import NDArray
from PIL import Image

from fingerslip.errors import InputError, ResultError
from fingerslip.files import new_file
from fingerslip.history import nearest_snapshot
from fingerslip.report.scene.rendering import has_display, prepare_rendering
from fingerslip.report.scene.scene import SceneOptions, aim, check_options, draw_scene

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

    Parameters
    ----------
    history : xarray.Dataset
        A history with snapshots.
    time : float, optional
        Time [s] whose nearest snapshot is drawn; the last one without it.
    options : SceneOptions, optional
        What is shown.
    size : tuple of int, optional
        Width and height [pixels].

    Returns
    -------
    (height, width, 3) array of uint8
        The picture.

    Raises
    ------
    InputError, ResultError
        Where the history cannot be shown so, or nothing can be drawn on this machine.
    """
    options = options or SceneOptions()
    check_options(history, options)
    (picture,) = stills(history, [nearest_snapshot(history, time)], options, size)
    return picture


def stills(
    history: xr.Dataset, numbers: Sequence[int], options: SceneOptions, size: tuple[int, int] = _SIZE
) -> Iterator[NDArray[np.uint8]]:
    """Render snapshots with one camera, see :func:`still`.

    Parameters
    ----------
    history : xarray.Dataset
        A history with snapshots.
    numbers : sequence of int
        Numbers of the snapshots.
    options : SceneOptions
        What is shown.
    size : tuple of int, optional
        Width and height [pixels].

    Yields
    ------
    (height, width, 3) array of uint8
        A picture.
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

    Parameters
    ----------
    history : xarray.Dataset
        A history with snapshots.
    path : path
        A ``.png``, ``.jpg`` or ``.webp`` file.
    time : float, optional
        Time [s].
    options : SceneOptions, optional
        What is shown.

    Raises
    ------
    InputError, ResultError
        As :func:`still`, and where the file cannot be written.
    """
    path = _checked_path(path, PICTURES)
    picture = Image.fromarray(still(history, time, options))
    _write(path, [picture])


def save_movie(history: xr.Dataset, path: str | Path, options: SceneOptions | None = None) -> None:
    """Write a film of all snapshots.

    Parameters
    ----------
    history : xarray.Dataset
        A history with snapshots.
    path : path
        A ``.gif`` or ``.webp`` file.
    options : SceneOptions, optional
        What is shown.

    Raises
    ------
    InputError, ResultError
        As :func:`still`, and where the file cannot be written.
    """
    path = _checked_path(path, FILMS)
    options = options or SceneOptions()
    check_options(history, options)
    frames = stills(history, range(history.sizes["snapshot_time"]), options, (800, 600))
    _write(path, [Image.fromarray(frame) for frame in frames])


def open_window(history: xr.Dataset, options: SceneOptions | None = None, title: str = "fingerslip") -> None:
    """Open an interactive window: a slider for time, a box for every layer, the mouse for the rest.

    Parameters
    ----------
    history : xarray.Dataset
        A history with snapshots.
    options : SceneOptions, optional
        What is shown at first.
    title : str, optional
        Title of the window.

    Raises
    ------
    InputError, ResultError
        Where the history cannot be shown so, or there is no display.
    """
    options = options or SceneOptions()
    check_options(history, options)
    if not has_display():
        raise ResultError("there is no display to open a window on; use --screenshot FILE or --movie FILE")
    plotter: Any = pyvista.Plotter(title=title)
    _add_controls(plotter, history, options)
    aim(plotter, history, options)
    plotter.show()


def _add_controls(plotter: Any, history: xr.Dataset, options: SceneOptions) -> None:
    """Add the layers with their boxes, and the slider that draws another snapshot."""
    shown = draw_scene(plotter, history, nearest_snapshot(history), options)
    visible = dict.fromkeys(shown, True)

    def move(time: float) -> None:
        for name, actor in draw_scene(plotter, history, nearest_snapshot(history, time), options).items():
            actor.visibility = visible[name]

    def toggle(name: str, state: bool) -> None:
        visible[name] = state
        plotter.actors[f"layer {name}"].visibility = state

    times = history["snapshot_time"].values
    if times.size > 1:
        plotter.add_slider_widget(move, (times[0], times[-1]), value=times[-1], title="time [s]", color="black")
    for row, name in enumerate(shown):
        bottom = 10 + row * (_BOX + 6)
        plotter.add_checkbox_button_widget(
            lambda state, name=name: toggle(name, state), value=True, position=(10, bottom), size=_BOX
        )
        plotter.add_text(name, position=(16 + _BOX, bottom), font_size=9, color="black")


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
