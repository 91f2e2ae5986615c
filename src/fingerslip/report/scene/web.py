"""Showing a result in a browser: the scene is drawn here and sent as pictures, by default to this machine only."""

from __future__ import annotations

import base64
import threading
import webbrowser
from typing import TYPE_CHECKING, Any

import numpy as np
import pyvista
from vtkmodules.vtkRenderingCore import vtkCellPicker

from fingerslip.errors import ResultError
from fingerslip.report.colours import EVENT_COLOURS, STATE_COLOURS, STATE_NAMES
from fingerslip.report.figures.style import figure_bytes
from fingerslip.report.scene.names import CAMERAS, CUTS
from fingerslip.report.scene.options import SCALARS, SceneOptions
from fingerslip.report.scene.scene import check_options, region_names
from fingerslip.report.scene.served import Served, require_free
from fingerslip.report.scene.viewer import SceneControl, nearest_node, picked_figure, prepare_rendering, receptor_legend
from fingerslip.slip import Events, slide_window
from fingerslip.slip.windows import EVENTS

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["serve"]

_SIZE = (1100, 800)


def serve(history: xr.Dataset, events: Events, options: SceneOptions, title: str, served: Served | None = None) -> None:
    """Serve a result to a browser until it is stopped."""
    served = served or Served()
    require_free(served)
    check_options(history, options)
    prepare_rendering()
    server = _server()
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=list(_SIZE))
    control = SceneControl(plotter, history, options)
    page = _Page(server, control, events, title)
    page.build()
    server.controller.on_server_ready.add(lambda **_: _show(served, f"http://{served.host}:{server.port}/"))
    try:
        server.start(
            host=served.host,
            port=served.port,
            open_browser=False,  # trame would say how its own command line keeps the browser closed
            show_connection_info=False,
            disable_logging=True,
        )
    finally:
        plotter.close()


def _show(served: Served, address: str) -> None:
    """Tell where the page is, and open it where that is wanted."""
    served.announce(address)
    if served.opened:
        # A browser of the terminal would hold the server until it is closed.
        threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()


def _server() -> Any:
    try:
        from trame.app import get_server
    except ImportError:
        raise ResultError("view --web needs trame; install it with: pip install 'fingerslip[web]'") from None
    return get_server("fingerslip", client_type="vue3")


class _Page:
    """The page: its state, what happens when that changes, and its elements."""

    def __init__(self, server: Any, control: SceneControl, events: Events, title: str) -> None:
        self._server, self._control, self._events, self._title = server, control, events, title
        self._history = control.history
        self._times = self._history["snapshot_time"].values

    def build(self) -> None:
        """Make the page."""
        state, options = self._server.state, self._control.options
        regions = region_names(self._history)
        state.update(
            {
                "trame__title": self._title,
                "frame": self._control.number,
                "moment": "",
                "field": options.scalar,
                "cut": options.cut,
                "camera": options.camera,
                "layers": [name for name in regions if name not in options.hidden],
                "shown": [name for name in ("plate", "receptors", "contact") if getattr(options, name)],
                "picked": "",
            }
        )
        self._say()
        for name, act in {
            "frame": self._move,
            "field": self._choose_field,
            "cut": self._choose_view,
            "camera": self._choose_view,
            "layers": self._choose_layers,
            "shown": self._choose_shown,
        }.items():
            state.change(name)(act)
        self._layout(list(regions))

    def _move(self, frame: int, **_: Any) -> None:
        self._control.show(float(self._times[int(frame)]))
        self._update()

    def _choose_field(self, field: str, **_: Any) -> None:
        self._control.choose(scalar=field)
        self._update()

    def _choose_view(self, cut: str, camera: str, **_: Any) -> None:
        self._control.choose(cut=cut, camera=camera)
        self._update()

    def _choose_layers(self, layers: list[str], **_: Any) -> None:
        names = region_names(self._history)
        if layers:
            self._control.choose(hidden=tuple(name for name in names if name not in layers))
        self._update()

    def _choose_shown(self, shown: list[str], **_: Any) -> None:
        self._control.choose(**{name: name in shown for name in ("plate", "receptors", "contact")})
        self._update()

    def _pick(self, position: dict[str, float]) -> None:
        """Show the signals of the node below the mouse, which is given in pixels of the picture from below."""
        picker = vtkCellPicker()
        if not picker.Pick(position["x"], position["y"], 0.0, self._control.plotter.renderer):
            return
        node = nearest_node(self._history, self._control.number, np.array(picker.GetPickPosition()))
        png = figure_bytes(picked_figure(self._history, node, self._events))
        self._server.state.picked = f"data:image/png;base64,{base64.b64encode(png).decode('ascii')}"

    def _update(self) -> None:
        self._say()
        self._server.controller.view_update()

    def _say(self) -> None:
        time = float(self._times[self._control.number])
        window = slide_window(self._history)
        words = f"t = {time:.3f} s"
        if window is not None and time >= window.start:
            words += f", {time - window.start:.3f} s into the slide"
        self._server.state.moment = words

    def _layout(self, regions: list[str]) -> None:
        from trame.ui.vuetify3 import SinglePageWithDrawerLayout
        from trame.widgets import html, vuetify3
        from trame.widgets import vtk as vtk_widgets

        with SinglePageWithDrawerLayout(self._server) as page:
            page.title.set_text(self._title)
            with page.toolbar:
                html.Div("{{ moment }}", classes="mx-4", id="moment")
            with page.drawer, vuetify3.VContainer():
                self._controls(vuetify3, html, regions)
            with page.content, html.Div(style="height: 100%; display: flex; flex-direction: column"):
                with html.Div(style="flex: 1 1 auto; min-height: 0"):
                    view = vtk_widgets.VtkRemoteView(
                        self._control.plotter.render_window,
                        interactive_ratio=1,
                        interactor_events=("interactions", ["LeftButtonPress"]),
                        LeftButtonPress=(self._pick, "[$event.position]"),
                    )
                    self._server.controller.view_update = view.update
                self._time(vuetify3, html)
            page.footer.hide()

    def _controls(self, vuetify3: Any, html: Any, regions: list[str]) -> None:
        fields = [{"title": words, "value": name} for name, (words, _) in SCALARS.items()]
        vuetify3.VSelect(label="field", v_model=("field",), items=("fields", fields), density="compact")
        vuetify3.VSelect(label="cut across", v_model=("cut",), items=("cuts", list(CUTS)), density="compact")
        vuetify3.VSelect(label="camera", v_model=("camera",), items=("cameras", list(CAMERAS)), density="compact")
        for model, names in (("layers", regions), ("shown", ["plate", "receptors", "contact"])):
            for name in names:
                vuetify3.VCheckbox(v_model=(model,), value=name, label=name, density="compact", hide_details=True)
        self._legend(html)
        html.Img(v_if="picked", src=("picked",), alt="signals of the picked node", style="width: 100%", id="picked")
        html.P("A click on the body shows what that node does.", v_if="!picked", classes="text-caption mt-2")

    def _legend(self, html: Any) -> None:
        states = [(STATE_NAMES[state], STATE_COLOURS[state]) for state in (1, 2)]
        with html.Div(classes="mt-2", id="legend"):
            for shown, entries in (("contact", states), ("receptors", receptor_legend(self._history))):
                for name, colour in entries:
                    style = f"display:inline-block;width:.8em;height:.8em;border:1px solid #555;background:{colour}"
                    with html.Span(
                        v_show=f"shown.includes('{shown}')", style="margin-right: .8em; white-space: nowrap"
                    ):
                        html.Span(style=style)
                        html.Span(f" {name}")

    def _time(self, vuetify3: Any, html: Any) -> None:
        """Add the slider of time, with the events marked below it."""
        last = len(self._times) - 1
        with html.Div(style="flex: 0 0 auto; padding: 0 24px 8px"):
            vuetify3.VSlider(
                v_model=("frame",), min=0, max=max(last, 1), step=1, hide_details=True, aria_label="time", id="slider"
            )
            with html.Div(style="position: relative; height: 4.2em; margin: 0 8px; font-size: .75rem", id="events"):
                for row, (words, time, colour) in enumerate(self._marks()):
                    share = 100.0 * np.interp(time, self._times, np.arange(last + 1)) / max(last, 1)
                    style = f"position:absolute;left:{share:.2f}%;top:{row % 4 * 1.05:.2f}em;color:{colour}"
                    html.Span(f"| {words} {time:.3f} s", style=f"{style};white-space:nowrap")

    def _marks(self) -> list[tuple[str, float, str]]:
        window = slide_window(self._history)
        marks = [] if window is None else [("slide starts", window.start, "#555555")]
        named = ((EVENTS[name], self._events.slip.time(name), EVENT_COLOURS[name]) for name in EVENTS)
        return [*marks, *((words, time, colour) for words, time, colour in named if time is not None)]
