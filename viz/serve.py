"""The viewer in a browser: trame draws here and sends pictures; the controls are the page's own.

It listens on the loopback interface only, unless told otherwise; then every request needs a token. Pages of
other origins are refused in any case: a web page elsewhere could reach a server on the loopback interface.
"""

from __future__ import annotations

import ipaddress
import os
import secrets
from collections.abc import Awaitable, Callable
from http.cookies import SimpleCookie
from typing import Any
from urllib.parse import urlsplit

from clbrdf.errors import InputError
from clbrdf.viz.control import Control
from clbrdf.viz.radius import RADIUS_MODES
from clbrdf.viz.style import COLOUR_MODES
from clbrdf.viz.window import CLICK_REACH

COOKIE = "clbrdf_token"
LAST_PORT = 65535
LOOPBACK_NAMES = ("localhost", "127.0.0.1", "::1")
MISSING = "the browser viewer needs trame: pip install 'clbrdf[web]'"


def is_loopback(host: str) -> bool:
    """Whether a host name or address reaches this machine only."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def allowed(host: str, origin: str, query_token: str, cookie: str, token: str | None) -> bool:
    """Whether a request may pass.

    Parameters
    ----------
    host, origin : str
        The request's headers Host and Origin, "" if absent.
    query_token, cookie : str
        The token in the address and the cookie header.
    token : str or None
        What is required; None on the loopback interface, where the host has to be this machine.
    """
    name = urlsplit(f"//{host}").hostname or ""
    if origin and urlsplit(origin).netloc != host:
        return False
    if token is None:
        return name in LOOPBACK_NAMES
    morsel = SimpleCookie(cookie).get(COOKIE)
    shown = query_token or (morsel.value if morsel is not None else "")
    return secrets.compare_digest(shown.encode(), token.encode())


def guard(token: str | None) -> Any:
    """Return the aiohttp middleware that refuses what is not `allowed`."""
    from aiohttp import web

    async def check(request: Any, handler: Callable[[Any], Awaitable[Any]]) -> Any:
        headers = request.headers
        query = request.query.get("token", "")
        if not allowed(
            headers.get("Host", ""), headers.get("Origin", ""), query, headers.get("Cookie", ""), token
        ):
            raise web.HTTPForbidden(text="clbrdf: open the address that the command printed, token included")
        try:
            response = await handler(request)
        except web.HTTPException as other:
            response = other
        if token is not None and query and not response.prepared:
            response.set_cookie(COOKIE, token, httponly=True, samesite="Strict")
        if isinstance(response, Exception):
            raise response
        return response

    return web.middleware(check)


def session_answer(secret: str) -> Any:
    """Return the handler that tells the page's client where its socket is, and its secret.

    The client asks before it tries, and takes a refusal for an error.
    """
    from aiohttp import web

    async def answer(request: Any) -> Any:
        return web.json_response({"sessionURL": f"ws://{request.host}/ws", "secret": secret, "id": "clbrdf"})

    return answer


class Page:
    """The page of a control and the server behind it.

    Parameters
    ----------
    control : Control
        Of a scene without a screen.
    host : str
    port : int
        0 takes a free one.

    Raises
    ------
    InputError
        trame is not installed, or there is no such port.
    """

    def __init__(self, control: Control, host: str = "127.0.0.1", port: int = 0) -> None:
        try:
            from trame.app import get_server
            from trame.widgets import client, html, vtk, vuetify3  # noqa: F401
        except ImportError:
            raise InputError(MISSING) from None
        if not 0 <= port <= LAST_PORT:
            raise InputError(f"--port {port}: ports lie between 0, which takes a free one, and {LAST_PORT}")
        self.control, self.host, self.port = control, host, port
        self.token = None if is_loopback(host) else secrets.token_urlsafe(24)
        self.server = get_server(f"clbrdf-{secrets.token_hex(4)}", client_type="vue3")
        self._secret = secrets.token_urlsafe(24)
        # trame would read this program's own command line; it gets its defaults and a secret instead.
        options, _ = self.server.cli.parse_known_args([])
        options.authKey = self._secret
        self.server.cli.parse_known_args = lambda *_: (options, [])
        self._build()

    def _build(self) -> None:
        from trame.ui.vuetify3 import VAppLayout
        from trame.widgets import client, html, vtk
        from trame.widgets import vuetify3 as v

        control, state = self.control, self.server.state
        scene = control.scene
        state.trame__title = "clbrdf: BRDF lobes"
        state.trame__favicon = "data:,"
        waves = control.wavelengths
        state.update(
            {
                "place": waves.index(control.wavelength),
                "wavelength": f"{control.wavelength:g}",
                "incident": control.theta_i,
                "shown_incident": f"{control.theta_i:g}",
                "radius": scene.look.radius,
                "colour": scene.look.colour,
                "points": True,
                "held": False,
                "readout": "",
            }
        )
        state.change("place")(self._wavelength)
        state.change("incident")(self._incident)
        state.change("radius")(self._radius)
        state.change("colour")(self._colour)
        state.change("points")(self._points)
        state.change("held")(self._held)
        small = {"density": "compact", "hide_details": True}
        with VAppLayout(self.server):
            client.Style("html { overflow: hidden } .controls { gap: 18px; padding: 6px 14px; }")
            with html.Div(style="display:flex; flex-direction:column; height:100vh"):
                with html.Div(classes="controls d-flex align-center"):
                    if len(waves) > 1:
                        html.Span("λ = {{ wavelength }} nm", style="min-width: 7em")
                        v.VSlider(
                            v_model=("place",), min=0, max=len(waves) - 1, step=1, id="wavelength", **small
                        )
                    html.Span("θi = {{ shown_incident }}°", style="min-width: 5em")
                    top = control.largest_incident
                    v.VSlider(v_model=("incident",), min=0, max=top, step=0.5, id="incident", **small)
                    v.VSelect(
                        v_model=("radius",),
                        items=("radii", list(RADIUS_MODES)),
                        label="radius",
                        id="radius",
                        **small,
                    )
                    v.VSelect(
                        v_model=("colour",),
                        items=("colours", list(COLOUR_MODES)),
                        label="colour",
                        id="colour",
                        **small,
                    )
                    v.VCheckbox(v_model=("points",), label="points", id="points", **small)
                    v.VCheckbox(v_model=("held",), label="hold scale", id="held", **small)
                    v.VBtn(
                        "first view",
                        click=self._first_view,
                        id="first-view",
                        variant="outlined",
                        size="small",
                    )
                with html.Div(style="flex: 1; min-height: 0; position: relative", id="picture"):
                    self.view = vtk.VtkRemoteView(
                        scene.plotter.render_window,
                        interactive_ratio=1,
                        still_ratio=1,
                        interactor_events=("events", ["LeftButtonPress", "LeftButtonRelease"]),
                        LeftButtonPress=(self._press, "[$event.position]"),
                        LeftButtonRelease=(self._release, "[$event.position]"),
                    )
                html.Div("{{ readout }}", id="readout", style="padding: 4px 14px; min-height: 1.9em")
        control.redraw = self._redraw
        self._pressed: tuple[float, float] | None = None

    def _redraw(self) -> None:
        self.server.state.readout = self.control.message
        self.server.state.wavelength = f"{self.control.wavelength:g}"
        self.server.state.shown_incident = f"{self.control.theta_i:g}"
        self.view.update()

    def _wavelength(self, place: float, **_: object) -> None:
        self.control.set_wavelength(self.control.wavelengths[int(place)])

    def _incident(self, incident: float, **_: object) -> None:
        self.control.set_incident(float(incident))

    def _radius(self, radius: str, **_: object) -> None:
        while self.control.scene.look.radius != radius and radius in RADIUS_MODES:
            self.control.next_radius()

    def _colour(self, colour: str, **_: object) -> None:
        if colour in COLOUR_MODES and self.control.scene.look.colour != colour:
            self.control.next_colour()
            self.server.state.colour = self.control.scene.look.colour

    def _points(self, points: bool, **_: object) -> None:
        marks = [m for p in self.control.scene.panels for m in p.marks]
        if marks and marks[0].visible != points:
            self.control.toggle_points()

    def _held(self, held: bool, **_: object) -> None:
        if (self.control.scene.held is not None) != held:
            self.control.toggle_hold()

    def _first_view(self) -> None:
        self.control.first_view()

    def _press(self, position: dict[str, float]) -> None:
        self._pressed = position["x"], position["y"]

    def _release(self, position: dict[str, float]) -> None:
        x, y = position["x"], position["y"]
        if self._pressed and max(abs(x - self._pressed[0]), abs(y - self._pressed[1])) <= CLICK_REACH:
            self.control.pick(x, y)
        self._pressed = None

    def _protect(self, web: Any) -> None:
        web.app.middlewares.append(guard(self.token))
        web.app.router.add_post("/paraview/", session_answer(self._secret))

    @property
    def address(self) -> str:
        """What to open in a browser, once the server runs."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        query = f"?token={self.token}" if self.token else ""
        return f"http://{host}:{self.server.port}/index.html{query}"

    def run(self, ready: Callable[[str], None]) -> None:
        """Serve until interrupted; `ready` gets the address.

        Raises
        ------
        InputError
            The host or port cannot be listened on.
        """
        self.server.controller.on_server_bind.add(self._protect)
        self.server.controller.on_server_ready.add(lambda **_: ready(self.address))
        try:
            self.server.start(
                host=self.host,
                port=self.port,
                open_browser=False,
                show_connection_info=False,
                timeout=0,
                disable_logging=True,
            )
        except OSError as error:
            reason = os.strerror(error.errno) if error.errno else str(error)
            raise InputError(
                f"cannot listen on {self.host} port {self.port} ({reason}); choose another --host or --port"
            ) from None
