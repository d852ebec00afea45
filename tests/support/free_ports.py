"""Ports that nobody uses."""

from __future__ import annotations

import socket


def free_port() -> int:
    """Of UDP on the loopback interface."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])
