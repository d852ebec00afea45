"""JSBSim's Cessna 172 with plain loops: way, bank, climb, speed and slip.

0. Way: a place is led along as the movement asks for, through the air as the wind carries it, and
   the aircraft after it: ahead by speed, across by course, up by climb. So gusts do not add up.
1. Turn rate: a bank of atan(V rate / g), at most `MOST_BANK_RAD`; the aileron by the bank's error,
   its integral and the roll rate.
2. Climb: the pitch by the path's own, the error of the rate of climb and its integral; the
   elevator by the pitch's error, its integral and the pitch rate.
3. Speed: the throttle by its error and integral, and by the climb. It is that through the air as
   the wind moves it: who holds the airspeed in every gust is carried by all of them.
4. Slip: the rudder against the sideways acceleration and the yaw rate beyond that of the turn.

Control surfaces have the limits of JSBSim's model.

The yaw that it tells is the course through the air that it is led along, not where the nose points,
and not where a gust has it slip for the moment: who predicted along either would be off by as much
of every way as the gust is of the airspeed. The wind it knows as autopilots do, from airspeed and
heading over `WIND_S`.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from clearway.base.frames import FloatArray
from clearway.sim.plants.aeroplane_way import GRAVITY_MPS2, AeroplaneWay
from clearway.sim.plants.air import Air
from clearway.sim.plants.jsbsim_model import FT, JsbsimModel
from clearway.vehicle.automaton import Movement

RATE_HZ = 60
MOST_BANK_RAD = np.radians(35.0)
MOST_BACK_RAD = np.radians(12.0)
"""And the most of it that leads back."""
MOST_PITCH_RAD = np.radians(12.0)
COURSE_PER_S = 0.5
"""Turn rate by which the course is led back, per error."""
ACROSS_PER_S = 0.15
MOST_ACROSS_RAD = np.radians(15.0)
"""Speed across, per metre off the way, and the most of it as a course."""
AHEAD_PER_S = 0.1
MOST_FASTER_MPS = 4.0
UP_PER_S = 0.2
MOST_HIGHER_MPS = 1.5
"""Speed and climb beyond what is asked for, per metre off the way, and the most of them."""
AILERON = 2.5
AILERON_SUM = 0.5
AILERON_RATE = 0.6
"""By the bank's error, its integral, and the roll rate."""
PITCH = 0.01
PITCH_SUM = 0.008
"""By the climb's error and its integral, beside the path's own."""
THROTTLE = 0.25
THROTTLE_SUM = 0.02
THROTTLE_UP = 0.055
"""By the speed's error and its integral, and for the climb."""
SETTLE_S = 40.0
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
        self._aileron_sum = 0.0
        self._pitch_sum = fdm["attitude/theta-rad"]
        self._throttle_sum = fdm["fcs/throttle-cmd-norm"]
        self._elevator_sum = 0.0
        self._late_s = 0.0
        self._wind_mps = np.array(air.wind_mps[:2], dtype=np.float64)
        self._led = AeroplaneWay(np.array(model.state[:3]), float(start[5]))
        for _ in range(round(SETTLE_S * RATE_HZ)):
            self._hold(air.wind_mps)
        model.place_at(start)
        self._led.place_m = np.array(start[:3], dtype=np.float64)

    def begin(self, movement: Movement) -> None:
        self._speed, self._climb = movement.speed_mps, movement.climb_mps or 0.0
        self._rate = movement.yaw_rate_rps

    def step(self, duration_s: float) -> None:
        place, fdm = self._model.state, self._model.fdm
        flow = fdm["velocities/vt-fps"] * FT
        air = self._air.step(duration_s, flow, float(place[2]), float(place[5]))
        self._late_s += duration_s
        while self._late_s > 0.5 / RATE_HZ:
            self._hold(air)
            self._late_s -= 1.0 / RATE_HZ

    def _hold(self, air: FloatArray) -> None:
        """One step of the model, by the loops."""
        model, fdm, dt = self._model, self._model.fdm, 1.0 / RATE_HZ
        model.set_wind(air)
        bank, speed, climb = self._compute_wanted(dt)
        flow = fdm["velocities/vt-fps"] * FT
        phi, theta = fdm["attitude/phi-rad"], fdm["attitude/theta-rad"]
        p, q, r = (fdm[f"velocities/{axis}-rad_sec"] for axis in "pqr")
        bank_off = float(np.clip(bank, -MOST_BANK_RAD, MOST_BANK_RAD)) - phi
        self._aileron_sum = np.clip(self._aileron_sum + AILERON_SUM * bank_off * dt, -0.3, 0.3)
        roll = AILERON * bank_off + self._aileron_sum - AILERON_RATE * p
        fdm["fcs/aileron-cmd-norm"] = np.clip(roll, -1.0, 1.0)
        climb_off = climb - model.velocity_mps[2]
        limit = MOST_PITCH_RAD
        self._pitch_sum = np.clip(self._pitch_sum + PITCH_SUM * climb_off * dt, -limit, limit)
        pitch = np.clip(self._pitch_sum + climb / flow + PITCH * climb_off, -limit, limit)
        pitch_off = pitch - theta
        self._elevator_sum = np.clip(self._elevator_sum + 1.5 * pitch_off * dt, -0.5, 0.5)
        pull = 4.0 * pitch_off + self._elevator_sum - 1.2 * (q - r * np.sin(phi))
        fdm["fcs/elevator-cmd-norm"] = np.clip(-pull, -1.0, 1.0)
        speed_off = speed - float(np.hypot(np.hypot(*self._through), model.velocity_mps[2]))
        self._throttle_sum = np.clip(self._throttle_sum + THROTTLE_SUM * speed_off * dt, 0.0, 1.0)
        throttle = self._throttle_sum + THROTTLE * speed_off + THROTTLE_UP * climb
        fdm["fcs/throttle-cmd-norm"] = np.clip(throttle, 0.0, 1.0)
        turn = GRAVITY_MPS2 / max(flow, 20.0) * np.sin(phi) * np.cos(theta)
        slip = fdm["aero/beta-rad"]
        fdm["fcs/rudder-cmd-norm"] = np.clip(-1.5 * slip + 0.8 * (r - turn), -1.0, 1.0)
        fdm.run()
        yaw = float(model.attitude_rad[2])
        carried = model.velocity_mps[:2] - flow * np.array([np.cos(yaw), np.sin(yaw)])
        self._wind_mps += dt / WIND_S * (carried - self._wind_mps)

    def _compute_wanted(self, dt: float) -> tuple[float, float, float]:
        """Bank, speed and climb that lead back to the way; what leads goes on by a step."""
        led = self._led
        led.on(self._speed, self._climb, self._rate, self._wind_mps, dt)
        off_m = led.ahead_of(self._model.state[:3])
        ahead = np.array([np.cos(led.course_rad), np.sin(led.course_rad)])
        along = float(off_m[:2] @ ahead)
        across = float(ahead[0] * off_m[1] - ahead[1] * off_m[0])
        aside = float(np.arctan(ACROSS_PER_S * across / self._speed))
        aside = min(max(aside, -MOST_ACROSS_RAD), MOST_ACROSS_RAD)
        x_mps, y_mps = self._through
        off = led.course_rad + aside - float(np.arctan2(y_mps, x_mps))
        off = (off + np.pi) % (2.0 * np.pi) - np.pi
        faster = min(max(AHEAD_PER_S * along, -MOST_FASTER_MPS), MOST_FASTER_MPS)
        higher = min(max(UP_PER_S * float(off_m[2]), -MOST_HIGHER_MPS), MOST_HIGHER_MPS)
        # Positive bank is to the right, courses turn to the left.
        back = -float(np.arctan(self._speed * COURSE_PER_S * off / GRAVITY_MPS2))
        back = min(max(back, -MOST_BACK_RAD), MOST_BACK_RAD)
        return led.rolled_rad + back, self._speed + faster, led.climb_mps + higher

    @property
    def _through(self) -> FloatArray:
        """[2] velocity through the air as the wind moves it."""
        through: FloatArray = self._model.velocity_mps[:2] - self._wind_mps
        return through

    @property
    def state(self) -> FloatArray:
        state = self._model.state
        state[5] = self._led.course_rad
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
