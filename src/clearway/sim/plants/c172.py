"""JSBSim's Cessna 172 with plain loops: bank, climb, speed and slip.

1. Turn rate: a bank of atan(V rate / g), at most `MOST_BANK_RAD`, led there at `BANK_RATE_RPS`; the
   aileron by the bank's error and the roll rate. What gusts turn it off its course is turned back.
2. Climb: the pitch by the error of the rate of climb and its integral; the elevator by the pitch's
   error, its integral and the pitch rate.
3. Speed: the throttle by its error and integral. It is that through the air as the wind moves it:
   who holds the airspeed in every gust is carried by all of them.
4. Slip: the rudder against the sideways acceleration and the yaw rate beyond that of the turn.

Control surfaces have the limits of JSBSim's model.

The yaw that it tells is where it flies through the air, not where the nose points: the direction of
its velocity over ground less the wind, which it knows as autopilots do, from airspeed and heading
over `WIND_S`. A gust turns the nose at once and the way hardly, so that who predicted along the
nose would be off by as much of every way as the gust is of the airspeed.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from clearway.base.frames import FloatArray
from clearway.sim.plants.air import Air
from clearway.sim.plants.jsbsim_model import FT, JsbsimModel
from clearway.vehicle.automaton import Movement

RATE_HZ = 60
GRAVITY_MPS2 = 9.81
MOST_BANK_RAD, BANK_RATE_RPS = np.radians(35.0), np.radians(20.0)
MOST_PITCH_RAD = np.radians(12.0)
COURSE_PER_S = 0.25
"""Turn rate by which the course is led back, per error."""
SETTLE_S = 20.0
WIND_S = 120.0
"""Over which the wind is made out."""


class C172Plant:
    """JSBSim's c172x, held by plain loops of bank, climb, speed and slip."""

    def __init__(self, start: FloatArray, speed_mps: float, air: Air) -> None:
        self._air = air
        self._model = JsbsimModel("c172x", RATE_HZ)
        model, fdm = self._model, self._model.fdm
        model.set_wind(air.wind_mps)
        model.start(np.asarray(start, dtype=np.float64), max(speed_mps, 30.0))
        fdm["propulsion/set-running"] = -1
        fdm["fcs/mixture-cmd-norm"] = 0.87
        fdm["fcs/throttle-cmd-norm"] = 0.7
        fdm["simulation/do_simple_trim"] = 0
        self._speed, self._climb, self._rate = max(speed_mps, 30.0), 0.0, 0.0
        self._bank, self._led = 0.0, 0.0
        self._course = float(start[5])
        self._pitch_sum = fdm["attitude/theta-rad"]
        self._throttle_sum = fdm["fcs/throttle-cmd-norm"]
        self._elevator_sum = 0.0
        self._late_s = 0.0
        self._wind_mps = np.array(air.wind_mps[:2], dtype=np.float64)
        for _ in range(round(SETTLE_S * RATE_HZ)):
            self._held(air.wind_mps)
        model.place_at(start)

    def begin(self, movement: Movement) -> None:
        self._course = float(self.state[5])
        self._speed, self._climb = movement.speed_mps, movement.climb_mps or 0.0
        self._rate = movement.yaw_rate_rps

    def step(self, duration_s: float) -> None:
        place, fdm = self._model.state, self._model.fdm
        flow = fdm["velocities/vt-fps"] * FT
        air = self._air.step(duration_s, flow, float(place[2]), float(place[5]))
        self._late_s += duration_s
        while self._late_s > 0.5 / RATE_HZ:
            self._held(air)
            self._late_s -= 1.0 / RATE_HZ

    def _held(self, air: FloatArray) -> None:
        model, fdm, dt = self._model, self._model.fdm, 1.0 / RATE_HZ
        model.set_wind(air)
        flow = fdm["velocities/vt-fps"] * FT
        phi, theta = fdm["attitude/phi-rad"], fdm["attitude/theta-rad"]
        p, q, r = (fdm[f"velocities/{axis}-rad_sec"] for axis in "pqr")
        through = model.velocity_mps[:2] - self._wind_mps
        # Positive bank is to the right, turn rates are to the left.
        off = self._course - float(np.arctan2(through[1], through[0]))
        off = (off + np.pi) % (2.0 * np.pi) - np.pi
        bank = -np.arctan(flow * (self._rate + COURSE_PER_S * off) / GRAVITY_MPS2)
        bank = np.clip(bank, -MOST_BANK_RAD, MOST_BANK_RAD)
        self._bank += np.clip(bank - self._bank, -BANK_RATE_RPS * dt, BANK_RATE_RPS * dt)
        self._led += np.clip(self._turn_bank() - self._led, -BANK_RATE_RPS * dt, BANK_RATE_RPS * dt)
        self._course -= GRAVITY_MPS2 * float(np.tan(self._led)) / self._speed * dt
        fdm["fcs/aileron-cmd-norm"] = np.clip(2.5 * (self._bank - phi) - 0.6 * p, -1.0, 1.0)
        climb_off = self._climb - model.velocity_mps[2]
        limit = MOST_PITCH_RAD
        self._pitch_sum = np.clip(self._pitch_sum + 0.008 * climb_off * dt, -limit, limit)
        pitch = np.clip(self._pitch_sum + 0.02 * climb_off, -limit, limit)
        pitch_off = pitch - theta
        self._elevator_sum = np.clip(self._elevator_sum + 1.5 * pitch_off * dt, -0.5, 0.5)
        pull = 4.0 * pitch_off + self._elevator_sum - 1.2 * (q - r * np.sin(phi))
        fdm["fcs/elevator-cmd-norm"] = np.clip(-pull, -1.0, 1.0)
        speed_off = self._speed - float(np.hypot(np.hypot(*through), model.velocity_mps[2]))
        self._throttle_sum = np.clip(self._throttle_sum + 0.02 * speed_off * dt, 0.0, 1.0)
        fdm["fcs/throttle-cmd-norm"] = np.clip(self._throttle_sum + 0.1 * speed_off, 0.0, 1.0)
        turn = GRAVITY_MPS2 / max(flow, 20.0) * np.sin(phi) * np.cos(theta)
        slip = fdm["aero/beta-rad"]
        fdm["fcs/rudder-cmd-norm"] = np.clip(-1.5 * slip + 0.8 * (r - turn), -1.0, 1.0)
        fdm.run()
        yaw = float(model.attitude_rad[2])
        carried = model.velocity_mps[:2] - flow * np.array([np.cos(yaw), np.sin(yaw)])
        self._wind_mps += dt / WIND_S * (carried - self._wind_mps)

    def _turn_bank(self) -> float:
        """The bank that the turn alone takes."""
        return float(-np.arctan(self._speed * self._rate / GRAVITY_MPS2))

    @property
    def state(self) -> FloatArray:
        state = self._model.state
        x_mps, y_mps = self._model.velocity_mps[:2] - self._wind_mps
        off = float(np.arctan2(y_mps, x_mps)) - state[5]
        state[5] += (off + np.pi) % (2.0 * np.pi) - np.pi
        return state

    @property
    def outputs(self) -> Mapping[str, float]:
        """Airspeed, rate of climb, throttle."""
        fdm = self._model.fdm
        return {
            "airspeed_mps": fdm["velocities/vt-fps"] * FT,
            "climb_mps": -fdm["velocities/v-down-fps"] * FT,
            "throttle": fdm["fcs/throttle-cmd-norm"],
        }
