"""A page behind an address: `clbrdf view --serve`.

The page is complete in itself, so that there is one answer and nothing else to ask for. It listens on the
loopback interface only, unless told otherwise; then a request needs a token. Pages of other origins are
refused in any case, as are other host names: a web page elsewhere could reach a server on the loopback
interface.
"""

from __future__ import annotations

import ipaddress
import os
import secrets
import socket
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import parse_qs, urlsplit

from clbrdf.errors import InputError, settled
from clbrdf.parallel.ending import interrupt_raises

LAST_PORT = 65535
LOOPBACK_NAMES = ("localhost", "127.0.0.1", "::1")
PATHS = ("/", "/index.html")
REFUSED = b"clbrdf: open the address that the command printed, token included\n"
MISSING = b"clbrdf: there is one page here, at /\n"


def is_loopback(host: str) -> bool:
    """Whether a host name or address reaches this machine only."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def allowed(host: str, origin: str, query_token: str, token: str | None) -> bool:
    """Whether a request may pass.

    Parameters
    ----------
    host, origin : str
        The request's headers Host and Origin, "" if absent.
    query_token : str
        The token in the address.
    token : str or None
        What is required; None on the loopback interface, where the host has to be this machine.
    """
    try:
        name = urlsplit(f"//{host}").hostname or ""
        elsewhere = bool(origin) and urlsplit(origin).netloc != host
    except ValueError:
        return False
    if elsewhere:
        return False
    if token is None:
        return name in LOOPBACK_NAMES
    return secrets.compare_digest(query_token.encode(), token.encode())


class PageServer:
    """Serves the text of one page.

    Parameters
    ----------
    text : str
    host : str
    port : int
        0 takes a free one.

    Raises
    ------
    InputError
        There is no such port, or it cannot be listened on.
    """

    def __init__(self, text: str, host: str = "127.0.0.1", port: int = 0) -> None:
        if not 0 <= port <= LAST_PORT:
            given = settled("port", "--port", port)
            raise InputError(f"{given}: ports lie between 0, which takes a free one, and {LAST_PORT}")
        self.host = host
        self.token = None if is_loopback(host) else secrets.token_urlsafe(24)
        kind = type(
            "Server", (ThreadingHTTPServer,), {"address_family": _family(host), "daemon_threads": True}
        )
        try:
            self.server = kind((host, port), _handler(text.encode("utf-8"), self.token))
        except OSError as error:
            reason = os.strerror(error.errno) if error.errno and error.errno > 0 else str(error)
            raise InputError(
                f"cannot listen on {host} port {port} ({reason}); choose another host or port"
            ) from None

    @property
    def address(self) -> str:
        """What to open in a browser."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        query = f"?token={self.token}" if self.token else ""
        return f"http://{host}:{self.server.server_address[1]}/{query}"

    def run(self, ready: Callable[[str], None]) -> None:
        """Serve until interrupted; `ready` gets the address."""
        ready(self.address)
        try:
            with interrupt_raises():
                self.server.serve_forever()
        except KeyboardInterrupt:
            pass
        finally:
            self.server.server_close()


def _family(host: str) -> socket.AddressFamily:
    return socket.AF_INET6 if ":" in host else socket.AF_INET


def _handler(page: bytes, token: str | None) -> type[BaseHTTPRequestHandler]:
    """Return the class that answers requests with the page."""

    class Handler(BaseHTTPRequestHandler):
        server_version, sys_version = "clbrdf", ""

        def do_GET(self) -> None:
            self._answer(body=True)

        def do_HEAD(self) -> None:
            self._answer(body=False)

        def _answer(self, body: bool) -> None:
            asked = urlsplit(self.path)
            given = parse_qs(asked.query).get("token", [""])[0]
            status, kind, content = HTTPStatus.OK, "text/html; charset=utf-8", page
            if not allowed(self.headers.get("Host", ""), self.headers.get("Origin", ""), given, token):
                status, kind, content = HTTPStatus.FORBIDDEN, "text/plain", REFUSED
            elif asked.path not in PATHS:
                status, kind, content = HTTPStatus.NOT_FOUND, "text/plain", MISSING
            self.send_response(status)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(content)))
            self.send_header("Cache-Control", "no-store")
            self.send_header("Referrer-Policy", "no-referrer")
            self.send_header("X-Content-Type-Options", "nosniff")
            self.end_headers()
            if body:
                self.wfile.write(content)

        def log_message(self, format: str, *args: object) -> None:
            """Say nothing of requests: the address may hold the token."""

    return Handler
