"""The page of a run over HTTP, for a browser on this computer and nobody else."""

from __future__ import annotations

import errno
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from clearway.base.errors import ClearwayError

HOST = "127.0.0.1"


def serve_page(page: str, port: int, ready: Callable[[str], None]) -> None:
    """Serve the page until interrupted; calls `ready` with its address once it can be asked for.

    port: 0 takes any that is free. Raises ClearwayError where the port cannot be had.
    """
    try:
        server = ThreadingHTTPServer((HOST, port), _handler(page.encode()))
    except OSError as cause:
        if cause.errno == errno.EADDRINUSE:
            raise ClearwayError(
                f"--port {port}: in use on {HOST}; choose another one, or 0 for any that is free"
            ) from cause
        reason = cause.strerror or cause
        raise ClearwayError(f"--port {port}: cannot be served on {HOST}: {reason}") from cause
    with server:
        ready(f"http://{HOST}:{server.server_port}/")
        try:
            server.serve_forever()
        except KeyboardInterrupt:  # The usual way to end it.
            return


def _handler(page: bytes) -> type[BaseHTTPRequestHandler]:
    class PageHandler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            # A page elsewhere whose name is made to point here must not read the flight.
            host = self.headers.get("Host", "").rpartition(":")[0]
            if host not in (HOST, "localhost"):
                self.send_error(403, "only asked for as 127.0.0.1 or localhost")
            elif self.path != "/":
                self.send_error(404)
            else:
                self.send_response(200)
                self.send_header("Content-Type", "text/html; charset=utf-8")
                self.send_header("Content-Length", str(len(page)))
                self.send_header("X-Content-Type-Options", "nosniff")
                self.send_header("Cache-Control", "no-store")
                self.end_headers()
                self.wfile.write(page)

        def log_message(self, format: str, *args: object) -> None:
            """Requests are nothing to tell the user."""

    return PageHandler
