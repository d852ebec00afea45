"""Ports and domains of DDS that nobody uses."""

from __future__ import annotations

import os
import socket


def free_port() -> int:
    """Of UDP on the loopback interface."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


def own_domain(number: int) -> int:
    """A domain of the tests of this worker alone; ports of domains above 100 may be taken."""
    return number - 10 * int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
