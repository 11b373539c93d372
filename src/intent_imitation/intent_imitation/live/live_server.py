"""A web server for one page, its picture and its numbers, on the loopback alone.

These are pictures of people: it listens on 127.0.0.1 only, and answers only requests that ask for
this host by name, so that no page of another site can read it through the visitor's browser.
"""

import json
import threading
import time
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from intent_imitation.live.live_page import PAGE

_HOST = "127.0.0.1"
_LOOKING = 3.0
"""Somebody who asked so lately still looks [s]."""


class LiveServer:
    """Serves until it is closed, in threads of its own."""

    def __init__(
        self, port: int, picture: Callable[[], bytes], state: Callable[[], dict[str, Any]]
    ) -> None:
        """Begin to listen.

        Args:
            port: on the loopback; 0: any that is free.
            picture: returns the newest picture as JPEG, empty while there is none.
            state: returns what `state.json` says.

        Raises:
            ValueError: if the port is taken.
        """
        self._asked = -_LOOKING
        outer = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                outer._answer(self, picture, state)

            def log_message(self, *_: Any) -> None:
                """Keep quiet: a line for every picture helps nobody."""

        try:
            self._server = ThreadingHTTPServer((_HOST, port), Handler)
        except OSError as error:
            raise ValueError(f"port {port} of {_HOST} cannot be used: {error.strerror}") from error
        self._server.daemon_threads = True
        self.port = int(self._server.server_address[1])
        """Where it listens."""
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    @property
    def looked_at(self) -> bool:
        """Whether somebody has the page open."""
        return time.monotonic() - self._asked < _LOOKING

    def close(self) -> None:
        """Stop to listen."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def _answer(
        self,
        request: BaseHTTPRequestHandler,
        picture: Callable[[], bytes],
        state: Callable[[], dict[str, Any]],
    ) -> None:
        host = request.headers.get("Host", "").rpartition(":")[0] or request.headers.get("Host", "")
        if host not in (_HOST, "localhost"):
            _send(request, 403, "text/plain", b"only for 127.0.0.1 and localhost\n")
            return
        path = request.path.partition("?")[0]
        if path == "/":
            _send(request, 200, "text/html; charset=utf-8", PAGE.encode())
        elif path == "/image.jpg":
            self._asked = time.monotonic()
            shown = picture()
            _send(request, 200 if shown else 404, "image/jpeg", shown)
        elif path == "/state.json":
            self._asked = time.monotonic()
            text = json.dumps(state(), allow_nan=False)
            _send(request, 200, "application/json", text.encode())
        else:
            _send(request, 404, "text/plain", b"there is /, /image.jpg and /state.json\n")


def _send(request: BaseHTTPRequestHandler, status: int, kind: str, body: bytes) -> None:
    try:
        request.send_response(status)
        request.send_header("Content-Type", kind)
        request.send_header("Content-Length", str(len(body)))
        request.send_header("Cache-Control", "no-store")
        request.send_header("Cross-Origin-Resource-Policy", "same-origin")
        request.send_header("X-Content-Type-Options", "nosniff")
        request.end_headers()
        request.wfile.write(body)
    except (BrokenPipeError, ConnectionResetError):  # the visitor has left
        pass
