"""Safety filters by name, as they are flown: with the tuning of the tuning seeds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType

from benchmarks.filters.backup_cbf import BackupCbf, BackupCbfTuning
from benchmarks.filters.gatekeeper import Gatekeeper, GatekeeperTuning
from benchmarks.filters.guarded import GuardianFilter
from benchmarks.filters.peer import PeerFilter, PeerProcess, PeerTuning
from benchmarks.filters.protocol import Copter, SafetyFilter, Unfiltered
from benchmarks.filters.shielding import BackupTuning, ModelPredictiveShield
from clearway.base.errors import ClearwayError
from clearway.missions.setup import FlightSetup

HOLD_S = 0.5
"""A wish counts for so long to the guardian, as by default."""
Make = Callable[[FlightSetup, Copter], SafetyFilter]


@dataclass(frozen=True)
class Method:
    """A filter, and what it uses of what all are told."""

    make: Callable[[Peers], Make]
    knows: str
    """Of the same LiDAR, in a word."""
    tuning: str = ""
    """In words, for journals: other ones are other flights."""
    needs_peers: bool = False


class Peers:
    """Processes of the peers' environment, each begun when it is first needed."""

    def __init__(self, python: Path | None) -> None:
        self._python = python
        self._begun: dict[str, PeerProcess] = {}

    @property
    def are_there(self) -> bool:
        """Whether there is an environment."""
        return self._python is not None

    def process(self, script: str) -> PeerProcess:
        """Return the process of a script; raises ClearwayError without an environment."""
        if self._python is None:
            raise ClearwayError(f"{script}: needs --python of the peers' environment")
        if script not in self._begun:
            self._begun[script] = PeerProcess(self._python, script)
        return self._begun[script]

    def end(self) -> None:
        """Let all end."""
        for process in self._begun.values():
            process.end()
        self._begun.clear()


def _unfiltered(_peers: Peers) -> Make:
    return lambda _setup, _copter: Unfiltered()


def _guardian(_peers: Peers) -> Make:
    return lambda setup, _copter: GuardianFilter(setup.guardian(HOLD_S, None))


def _gatekeeper(_peers: Peers) -> Make:
    return lambda _setup, copter: Gatekeeper(copter, GatekeeperTuning())


def _shield(_peers: Peers) -> Make:
    return lambda _setup, copter: ModelPredictiveShield(copter, BackupTuning())


def _backup_cbf(_peers: Peers) -> Make:
    return lambda _setup, copter: BackupCbf(copter, BackupCbfTuning())


def _peer(script: str, tuning: PeerTuning, peers: Peers) -> Make:
    return lambda _setup, copter: PeerFilter(copter, peers.process(script), tuning)


SEEN, RETURNS = "returns, seen space", "returns"
CBFPY, SIMPLEX = PeerTuning(), PeerTuning(balls=72)
METHODS: Mapping[str, Method] = MappingProxyType(
    {
        "unfiltered": Method(_unfiltered, "nothing"),
        "guardian": Method(_guardian, SEEN),
        "gatekeeper": Method(_gatekeeper, SEEN, str(GatekeeperTuning())),
        "mps": Method(_shield, SEEN, str(BackupTuning())),
        "backup-cbf": Method(_backup_cbf, RETURNS, str(BackupCbfTuning())),
        "cbfpy": Method(partial(_peer, "fly_cbfpy.py", CBFPY), "nearest returns", needs_peers=True),
        "rta-simplex": Method(
            partial(_peer, "fly_rta.py", SIMPLEX), "nearest returns", str(SIMPLEX), needs_peers=True
        ),
    }
)
GUARDIAN, NONE = "guardian", "unfiltered"
