"""Showing a result in a browser: the scene is drawn here and sent as pictures, by default to this machine only."""

from __future__ import annotations

import base64
import threading
import webbrowser
from typing import Any

import numpy as np
import xarray as xr
from vtkmodules.vtkRenderingCore import vtkCellPicker

from fingerslip.errors import ResultError
from fingerslip.report.colours import STATE_COLOURS, STATE_NAMES
from fingerslip.report.figures.style import figure_bytes
from fingerslip.report.scene import viewer
from fingerslip.report.scene.names import CAMERAS, CUTS
from fingerslip.report.scene.options import SCALARS, SceneOptions, Served
from fingerslip.report.scene.scene import check_options, fields_of, region_names
from fingerslip.slip import Events, slide_window

_SIZE = (1100, 800)


def serve(history: xr.Dataset, events: Events, options: SceneOptions, title: str, served: Served) -> None:
    """Serve a result to a browser until it is stopped."""
    check_options(history, options)
    server = _server()
    server.controller.on_server_ready.add(lambda **_: _show(served, f"http://{served.host}:{server.port}/"))
    # Trame would say how its own command line keeps the browser closed.
    quiet = {"open_browser": False, "show_connection_info": False, "disable_logging": True}
    with viewer.off_screen(_SIZE) as plotter:
        _Page(server, viewer.SceneControl(plotter, history, options), events, title).build()
        server.start(host=served.host, port=served.port, **quiet)


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

    def __init__(self, server: Any, control: viewer.SceneControl, events: Events, title: str) -> None:
        self._server, self._control, self._events, self._title = server, control, events, title
        self._history = control.history
        self._times, self._layers = self._history["snapshot_time"].values, region_names(self._history)

    def build(self) -> None:
        """Make the page."""
        options = self._control.options
        choices = {
            "frame": self._control.number,
            "field": options.scalar,
            "cut": options.cut,
            "camera": options.camera,
            "layers": [name for name in self._layers if name not in options.hidden],
            "extras": [name for name in viewer.EXTRAS if getattr(options, name)],
        }
        self._server.state.update({"trame__title": self._title, "picked": "", **choices})
        self._say()
        self._server.state.change(*choices)(self._change)
        self._lay_out()

    def _change(self, frame: int, camera: str, layers: list[str], extras: list[str], **state: Any) -> None:
        """Draw what the page has chosen; the camera moves where another one was chosen."""
        options, self._control.number = self._control.options, int(frame)
        hidden = tuple(name for name in self._layers if name not in layers) if layers else options.hidden
        aimed = {} if camera == options.camera else {"camera": camera}
        switches = {name: name in extras for name in viewer.EXTRAS}
        self._control.choose(scalar=state["field"], cut=state["cut"], hidden=hidden, **switches, **aimed)
        self._say()
        self._server.controller.view_update()

    def _pick(self, position: dict[str, float]) -> None:
        """Show the signals of the node below the mouse, which is given in pixels of the picture from below."""
        picker = vtkCellPicker()
        if not picker.Pick(position["x"], position["y"], 0.0, self._control.plotter.renderer):
            return
        node = viewer.nearest_node(self._history, self._control.number, np.array(picker.GetPickPosition()))
        png = figure_bytes(viewer.picked_figure(self._history, node, self._events))
        self._server.state.picked = f"data:image/png;base64,{base64.b64encode(png).decode('ascii')}"

    def _say(self) -> None:
        time, window = float(self._times[self._control.number]), slide_window(self._history)
        since = f", {time - window.start:.3f} s into the slide" if window and time >= window.start else ""
        self._server.state.moment = f"t = {time:.3f} s{since}"

    def _lay_out(self) -> None:
        from trame.ui.vuetify3 import SinglePageWithDrawerLayout
        from trame.widgets import html, vuetify3
        from trame.widgets import vtk as vtk_widgets

        with SinglePageWithDrawerLayout(self._server) as page:
            page.title.set_text(self._title)
            with page.toolbar:
                html.Div("{{ moment }}", classes="mx-4", id="moment")
            with page.drawer, vuetify3.VContainer():
                self._add_controls(vuetify3, html)
            with page.content, html.Div(style="height: 100%; display: flex; flex-direction: column"):
                with html.Div(style="flex: 1 1 auto; min-height: 0"):
                    view = vtk_widgets.VtkRemoteView(
                        self._control.plotter.render_window,
                        interactive_ratio=1,
                        interactor_events=("interactions", ["LeftButtonPress"]),
                        LeftButtonPress=(self._pick, "[$event.position]"),
                    )
                    self._server.controller.view_update = view.update
                self._add_time(vuetify3, html)
            page.footer.hide()

    def _add_controls(self, vuetify3: Any, html: Any) -> None:
        fields = [{"title": SCALARS[name][0], "value": name} for name in fields_of(self._history)]
        choices = {"field": ("field", fields), "cut": ("cut across", list(CUTS)), "camera": ("camera", list(CAMERAS))}
        for model, (label, items) in choices.items():
            vuetify3.VSelect(label=label, v_model=(model,), items=(f"{model}s", items), density="compact")
        for model, names in (("layers", self._layers), ("extras", viewer.EXTRAS)):
            for name in names:
                vuetify3.VCheckbox(v_model=(model,), value=name, label=name, density="compact", hide_details=True)
        states = [(STATE_NAMES[state], STATE_COLOURS[state]) for state in (1, 2)]
        box = "display:inline-block;width:.8em;height:.8em;border:1px solid #555;background:"
        with html.Div(classes="mt-2", id="legend"):
            for extra, entries in (("contact", states), ("receptors", viewer.receptor_legend(self._history))):
                for name, colour in entries:
                    style = "margin-right: .8em; white-space: nowrap"
                    with html.Span(v_show=f"extras.includes('{extra}')", style=style):
                        html.Span(style=f"{box}{colour}")
                        html.Span(f" {name}")
        html.Img(v_if="picked", src=("picked",), alt="signals of the picked node", style="width: 100%", id="picked")
        html.P("A click on the body shows what that node does.", v_if="!picked", classes="text-caption mt-2")

    def _add_time(self, vuetify3: Any, html: Any) -> None:
        """Add the slider of time, with the events marked below it."""
        last = max(len(self._times) - 1, 1)
        look = {"step": 1, "hide_details": True, "aria_label": "time", "id": "slider"}
        with html.Div(style="flex: 0 0 auto; padding: 0 24px 8px"):
            vuetify3.VSlider(v_model=("frame",), min=0, max=last, **look)
            with html.Div(style="position: relative; height: 4.2em; margin: 0 8px; font-size: .75rem", id="events"):
                for row, (words, time, colour) in enumerate(viewer.event_legend(self._history, self._events)):
                    share = 100.0 * np.interp(time, self._times, np.arange(len(self._times))) / last
                    style = f"position:absolute;left:{share:.2f}%;top:{row % 4 * 1.05:.2f}em;color:{colour}"
                    html.Span(f"| {words} {time:.3f} s", style=f"{style};white-space:nowrap")
