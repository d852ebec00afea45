"""An aircraft of JSBSim's own data, in clearway's frames: metres, z up, yaw and roll as here.

North is the world's x, west its y. JSBSim is the extra `plants`; nothing of it is copied.
"""

from __future__ import annotations

import ctypes
import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from typing import Any

import numpy as np

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray, wrap_angle

FT = 0.3048
ABOVE_SEA_M = 500.0
"""Where the world's height 0 lies."""


@contextmanager
def silence() -> Iterator[None]:
    """JSBSim tells of its data on standard output, through Python and past it: here it does not."""
    sys.stdout.flush()
    kept = [(number, os.dup(number)) for number in (1, 2)]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for number, _ in kept:
            os.dup2(nowhere, number)
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
            yield
    finally:
        ctypes.CDLL(None).fflush(None)
        for number, copy in kept:
            os.dup2(copy, number)
            os.close(copy)
        os.close(nowhere)


class JsbsimModel:
    """One aircraft in flight, stepped at its own rate.

    Raises ClearwayError where JSBSim is not installed or cannot start.
    """

    def __init__(self, name: str, rate_hz: int) -> None:
        os.environ.setdefault("JSBSIM_DEBUG", "0")  # Else it prints to standard output.
        try:
            import jsbsim as found
        except ImportError:
            raise ClearwayError(
                f"plant {name}: JSBSim is not installed; pip install 'clearway[plants]'"
            ) from None
        jsbsim: Any = found
        with silence():
            jsbsim.FGJSBBase().debug_lvl = 0
            self.fdm: Any = jsbsim.FGFDMExec(None)
            self.fdm.set_debug_level(0)
            loaded = self.fdm.load_model(name)
            self.fdm.set_output_filename(0, os.devnull)  # Some aircraft write a file of their own.
            self.fdm.disable_output()
        if not loaded:
            raise ClearwayError(f"plant {name}: JSBSim has no such aircraft")
        self.fdm.set_dt(1.0 / rate_hz)
        self.rate_hz = rate_hz
        self._origin = np.zeros(3)
        self._yaw = 0.0

    def start(self, state: FloatArray, speed_mps: float) -> None:
        """In the air at a state [6], level, at a speed."""
        fdm = self.fdm
        fdm["ic/h-sl-ft"] = (ABOVE_SEA_M + state[2]) / FT
        fdm["ic/terrain-elevation-ft"] = 0.0
        fdm["ic/psi-true-deg"] = float(np.degrees(-state[5])) % 360.0
        fdm["ic/u-fps"] = speed_mps / FT
        if not fdm.run_ic():
            raise ClearwayError("plant: JSBSim cannot start from there")
        self._yaw = float(state[5])
        self._origin = state[:3] - self._place()

    def place_at(self, state: FloatArray) -> None:
        """From now on, places are counted so that the present one is that of a state [6]."""
        self._origin = np.asarray(state[:3], dtype=np.float64) - self._place()

    def set_wind(self, air_mps: FloatArray) -> None:
        """[3] how the air moves, world frame."""
        self.fdm["atmosphere/wind-north-fps"] = air_mps[0] / FT
        self.fdm["atmosphere/wind-east-fps"] = -air_mps[1] / FT
        self.fdm["atmosphere/wind-down-fps"] = -air_mps[2] / FT

    def _place(self) -> FloatArray:
        fdm = self.fdm
        north = fdm["position/from-start-neu-n-ft"]
        east = fdm["position/from-start-neu-e-ft"]
        return FT * np.array([north, -east, fdm["position/h-sl-ft"]])

    @property
    def velocity_mps(self) -> FloatArray:
        """[3] world frame."""
        names = ("north", "east", "down")
        north, east, down = (self.fdm[f"velocities/v-{name}-fps"] for name in names)
        return FT * np.array([north, -east, -down])

    @property
    def rates_rps(self) -> FloatArray:
        """[3] of roll, pitch (nose down) and yaw (left): body axes ahead, left, up."""
        p, q, r = (self.fdm[f"velocities/{axis}-rad_sec"] for axis in "pqr")
        return np.array([p, -q, -r])

    @property
    def attitude_rad(self) -> FloatArray:
        """[3] roll, pitch (nose down), yaw (left), which counts on from turn to turn."""
        phi, theta = self.fdm["attitude/phi-rad"], self.fdm["attitude/theta-rad"]
        turned = wrap_angle(np.array([-self.fdm["attitude/psi-rad"] - self._yaw]))
        self._yaw += float(turned[0])
        return np.array([phi, -theta, self._yaw])

    @property
    def state(self) -> FloatArray:
        """[6] world frame."""
        place: FloatArray = self._origin + self._place()
        return np.concatenate([place, self.attitude_rad])
