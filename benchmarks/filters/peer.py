"""Filters of other people's packages, which answer from a process of their own environment."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.filters.backup_cbf import wished_acceleration
from benchmarks.filters.protocol import (
    Command,
    Copter,
    Looker,
    Own,
    Surroundings,
    accelerate,
    check_wish,
    pass_on,
)
from benchmarks.filters.shielding import brake
from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray

SCRIPTS = Path(__file__).resolve().parent.parent / "peers"
ASIDE_M = 1e4
"""Where balls stand that fill up their number."""
SAME_MPS2 = 0.02
"""By which solvers are off a wished acceleration that they let pass."""


class PeerTuning(NamedTuple):
    """Of a barrier of relative degree two."""

    spare_m: float = 0.1
    """Kept beside the margin, for what the model does not know."""
    rates_per_s: tuple[float, float] = (1.0, 3.0)
    """How fast distance and barrier may fall, of their values."""
    balls: int = 12
    """Level sectors of which each gives the nearest ball."""


class PeerProcess:
    """A script of `benchmarks/peers` that answers lines of JSON."""

    def __init__(self, python: Path, script: str) -> None:
        self._script = script
        self._process = subprocess.Popen(
            [str(python), str(SCRIPTS / script)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )

    def ask(self, question: Mapping[str, Any]) -> dict[str, Any]:
        """Return its answer; raises ClearwayError if it has ended."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            self._process.stdin.write(json.dumps(question) + "\n")
            self._process.stdin.flush()
            line = self._process.stdout.readline()
        except BrokenPipeError:
            line = ""
        if not line:
            raise ClearwayError(f"{self._script}: ended; is its environment complete?")
        answer: dict[str, Any] = json.loads(line)
        return answer

    def end(self) -> None:
        """Let it end."""
        self._process.communicate()


class PeerFilter(Looker):
    """The filter of one flight; the process may serve many."""

    def __init__(self, copter: Copter, process: PeerProcess, tuning: PeerTuning) -> None:
        self.copter, self.tuning, self._process = copter, tuning, process

    def command(self, own: Own, wish_mps: FloatArray, known: Surroundings) -> Command:
        """Return the wish where it keeps the barrier, else the acceleration that is answered."""
        wish, most = check_wish(wish_mps), self.copter.acceleration_mps2
        count = self.tuning.balls
        wished = wished_acceleration(own, wish, most)
        middles, radii = _filled(*known.nearest_balls(own.position_m, count), own.position_m, count)
        keep_m = self.copter.margin_m + self.tuning.spare_m
        answer = self._process.ask(
            {
                "state": [*own.position_m.tolist(), *own.velocity_mps.tolist()],
                "wished": wished.tolist(),
                "most": most,
                "middles": middles.tolist(),
                "radii": (radii + keep_m).tolist(),
                "rates": self.tuning.rates_per_s,
            }
        )
        return self._flown(own, wish, wished, answer)

    def _flown(
        self, own: Own, wish: FloatArray, wished: FloatArray, answer: Mapping[str, Any]
    ) -> Command:
        found: Sequence[float] | None = answer["acceleration"]
        if found is None:
            command = brake(own, self.copter.acceleration_mps2)
        elif float(np.abs(np.array(found) - wished).max()) <= SAME_MPS2:
            command = pass_on(wish)
        else:
            command = accelerate(own, np.array(found))
        return command._replace(took_ms=float(answer["ms"]))


def _filled(
    middles: FloatArray, radii: FloatArray, place_m: FloatArray, count: int
) -> tuple[FloatArray, FloatArray]:
    lacks = count - len(radii)
    aside = place_m + np.array([ASIDE_M, 0.0, 0.0])
    return np.vstack([middles, np.tile(aside, (lacks, 1))]), np.append(radii, np.zeros(lacks))
