"""Where frames come from and go to: UDP sockets and serial lines, read without ever waiting."""

from __future__ import annotations

import contextlib
import os
import select
import socket
from collections import Counter
from dataclasses import dataclass
from typing import Protocol

from clearway.base.errors import InputError

Peer = tuple[str, int] | None
"""Who sent a piece; None on a line."""
FORMS = "udpin:HOST:PORT, udpout:HOST:PORT, serial:DEVICE[:BAUD] or /dev/DEVICE[:BAUD]"
MOST_PIECES = 1000
"""Pieces read at once: what waits beyond them is left to the system to drop. A link is read every
20 ms at least, but during a decision: 50,000 pieces a second."""
PIECE_BYTES = 4096
KERNEL_BYTES = 1 << 20
LINE_BYTES = 1 << 16
BAUD = 57_600


class FrameLink(Protocol):
    """A way to the autopilot."""

    stream: bool
    """Whether frames may be cut anywhere, as on a line."""
    name: str
    """In words, with the port that was really taken."""

    def receive(self) -> list[tuple[bytes, Peer]]:
        """All that has come, at most MOST_PIECES; never waits."""
        ...

    def answer_to(self, peer: Peer) -> None:
        """Send to the sender of that from now on."""
        ...

    @property
    def peer(self) -> Peer:
        """Where datagrams go; None on a line, and before anybody is known."""
        ...

    def send(self, data: bytes) -> bool:
        """Send one frame, and say whether it went; failures are counted, not raised."""
        ...

    def wait(self, seconds: float) -> None:
        """Until something comes, but no longer."""
        ...

    def fileno(self) -> int:
        """What `select` waits for."""
        ...

    def close(self) -> None: ...


@dataclass(frozen=True, slots=True)
class Address:
    """A parsed --connect: `kind` is udpin, udpout or serial."""

    kind: str
    place: str
    number: int
    """Port, or baud."""

    @classmethod
    def parse(cls, text: str, option: str = "--connect") -> Address:
        """Raises InputError naming the valid forms."""
        kind, _, rest = text.partition(":")
        if text.startswith("/"):
            kind, rest = "serial", text
        place, _, number = rest.rpartition(":") if kind != "serial" else _line(rest)
        if kind not in ("udpin", "udpout", "serial") or not place or not number.isdecimal():
            raise InputError(option, f"{text!r} is no address; valid: {FORMS}")
        if kind != "serial" and int(number) > 65_535:
            raise InputError(option, f"port {number} of {text!r} is above 65535")
        return cls(kind, place, int(number))


def _line(text: str) -> tuple[str, str, str]:
    device, colon, baud = text.partition(":")
    return device, colon, baud if colon else str(BAUD)


def open_link(text: str, counts: Counter[str], option: str = "--connect") -> FrameLink:
    """The link that an option asks for; InputError where it cannot be opened.

    counts grows by what fails later, by reason.
    """
    address = Address.parse(text, option)
    try:
        if address.kind == "serial":
            return SerialLink(address, counts)
        return UdpLink(address, counts)
    except (OSError, OverflowError) as cause:
        told = getattr(cause, "strerror", None) or cause
        raise InputError(option, f"{text} cannot be opened: {told}") from cause


class UdpLink:
    """Datagrams: bound and answering (udpin), or sent out to an address (udpout)."""

    stream = False

    def __init__(self, address: Address, counts: Counter[str]) -> None:
        self._counts = counts
        place = socket.gethostbyname(address.place)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, KERNEL_BYTES)
        self._listens = address.kind == "udpin"
        self._peer: Peer = None if self._listens else (place, address.number)
        try:
            self._socket.bind((place, address.number) if self._listens else ("", 0))
        except OSError:
            self._socket.close()
            raise
        port = self._socket.getsockname()[1] if self._listens else address.number
        self.name = f"{address.kind}:{address.place}:{port}"

    def receive(self) -> list[tuple[bytes, Peer]]:
        pieces: list[tuple[bytes, Peer]] = []
        while len(pieces) < MOST_PIECES:
            try:
                data, peer = self._socket.recvfrom(PIECE_BYTES)
            except BlockingIOError:
                break
            except OSError:
                # Nobody listens there (yet): the system tells it on the next call.
                self._counts["link: nobody listens"] += 1
                break
            pieces.append((data, (peer[0], peer[1])))
        return pieces

    def answer_to(self, peer: Peer) -> None:
        if self._listens:
            self._peer = peer

    @property
    def peer(self) -> Peer:
        return self._peer

    def send(self, data: bytes) -> bool:
        if self._peer is None:
            self._counts["link: nobody to send to"] += 1
            return False
        try:
            self._socket.sendto(data, self._peer)
        except OSError:
            self._counts["link: not sent"] += 1
            return False
        return True

    def wait(self, seconds: float) -> None:
        select.select([self._socket], [], [], max(0.0, seconds))

    def fileno(self) -> int:
        return self._socket.fileno()

    def close(self) -> None:
        self._socket.close()


class SerialLink:
    """A serial line, raw, eight bits, no handshake."""

    stream = True
    peer: Peer = None

    def __init__(self, address: Address, counts: Counter[str]) -> None:
        self._counts = counts
        self.name = f"serial:{address.place}:{address.number}"
        self._line = os.open(address.place, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            _make_raw(self._line, address.number)
        except (OSError, InputError):
            os.close(self._line)
            raise

    def receive(self) -> list[tuple[bytes, Peer]]:
        try:
            data = os.read(self._line, LINE_BYTES)
        except BlockingIOError:
            return []
        except OSError:
            data = b""
        if not data:
            self._counts["link: line is dead"] += 1
            return []
        return [(data, None)]

    def answer_to(self, peer: Peer) -> None:
        """A line has one end only."""

    def send(self, data: bytes) -> bool:
        sent = 0
        with contextlib.suppress(OSError):
            sent = os.write(self._line, data)
        if sent < len(data):
            self._counts["link: not sent"] += 1
        return sent == len(data)

    def wait(self, seconds: float) -> None:
        select.select([self._line], [], [], max(0.0, seconds))

    def fileno(self) -> int:
        return self._line

    def close(self) -> None:
        os.close(self._line)


def _make_raw(line: int, baud: int) -> None:
    import termios
    import tty

    speed = getattr(termios, f"B{baud}", None)
    if speed is None:
        known = sorted(int(name[1:]) for name in dir(termios) if name[1:].isdecimal())
        rates = ", ".join(str(rate) for rate in known if rate >= 9600)
        raise InputError("--connect", f"baud {baud} is none of {rates}")
    try:
        tty.setraw(line)
        attributes = termios.tcgetattr(line)
        attributes[4] = attributes[5] = speed
        attributes[2] = (attributes[2] | termios.CLOCAL | termios.CREAD) & ~termios.CRTSCTS
        termios.tcsetattr(line, termios.TCSANOW, attributes)
    except termios.error as cause:
        raise OSError(None, f"no serial line: {cause}") from cause
