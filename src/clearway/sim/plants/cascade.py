"""Loops that hold a movement of a quadrotor: speed, then tilt, then rates, as autopilots have them.

1. The speed along the heading, the rate of climb and the heading are led to what the movement asks
   for: speeds by at most `most_mps2`, the heading by its rate.
2. The velocity's error asks for an acceleration, in proportion and by its integral, beside what a
   turn needs; tilt stays within `most_tilt_rad`.
3. Thrust points along it: errors of the attitude and of the rates ask for moments.
4. Thrust and moments are shared among the rotors.

The loops know what the own sensors measure: velocity, attitude and rates, each with its noise.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled
from clearway.sim.plants.led import LedGains, lead_acceleration, lead_sum
from clearway.sim.plants.quadrotor import (
    GRAVITY_MPS2,
    Airframe,
    rotate_by_quaternion,
    step_quadrotor,
)


class Gains(NamedTuple):
    """Of the loops, all per second or per second squared."""

    velocity: float = 7.0
    velocity_sum: float = 2.5
    """As the position's error asks for it: what led ahead of the vehicle is caught up with."""
    drag_per_s: float = 0.45
    """Deceleration by drag per speed, as known of the airframe: leant into before it is felt."""
    attitude: float = 300.0
    rates: float = 32.0
    turn: float = 60.0
    """Of attitude about the vertical, which rotors turn weakly."""
    turn_rate: float = 16.0
    most_mps2: float = 5.0
    most_sum_mps2: float = 4.0
    most_tilt_rad: float = 0.7


class Led(NamedTuple):
    """What the loops are led by, as it changes: speed ahead, climb, heading; integral [3]."""

    speed_mps: float
    climb_mps: float
    yaw_rad: float
    sum_mps: Floats


@compiled
def compute_wanted_acceleration(
    velocity: Floats, led: Led, rate_rps: float, ahead_mps2: float, gains: Gains
) -> Floats:
    """[3] world frame, without gravity; tilt not limited yet."""
    cosine, sine = np.cos(led.yaw_rad), np.sin(led.yaw_rad)
    asked = np.array([led.speed_mps * cosine, led.speed_mps * sine, led.climb_mps])
    across = led.speed_mps * rate_rps
    wanted = np.array(
        [ahead_mps2 * cosine - across * sine, ahead_mps2 * sine + across * cosine, 0.0]
    )
    for i in range(3):
        wanted[i] += gains.velocity * (asked[i] - velocity[i]) + led.sum_mps[i]
        wanted[i] += gains.drag_per_s * asked[i] * (i < 2)
    return wanted


@compiled
def lead_on(
    led: Led,
    velocity: Floats,
    speed_mps: float,
    climb_mps: float,
    rate_rps: float,
    step_s: float,
    gains: Gains,
) -> tuple[Led, float]:
    """What leads a step later, and the acceleration ahead in it."""
    most = gains.most_mps2 * step_s
    faster = min(max(speed_mps - led.speed_mps, -most), most)
    higher = min(max(climb_mps - led.climb_mps, -most), most)
    yaw = led.yaw_rad + rate_rps * step_s
    speed, climb = led.speed_mps + faster, led.climb_mps + higher
    asked = np.array([speed * np.cos(yaw), speed * np.sin(yaw), climb])
    total = led.sum_mps.copy()
    for i in range(3):
        total[i] += gains.velocity_sum * (asked[i] - velocity[i]) * step_s
        total[i] = min(max(total[i], -gains.most_sum_mps2), gains.most_sum_mps2)
    return Led(speed, climb, yaw, total), faster / step_s


@compiled
def thrust_wanted(acceleration: Floats, gains: Gains) -> Floats:
    """[3] thrust per mass, world frame, tilted no more than the limit."""
    up = max(acceleration[2] + GRAVITY_MPS2, 0.2 * GRAVITY_MPS2)
    level = np.sqrt(acceleration[0] ** 2 + acceleration[1] ** 2)
    most = up * np.tan(gains.most_tilt_rad)
    share = 1.0 if level <= most else most / level
    return np.array([acceleration[0] * share, acceleration[1] * share, up])


@compiled
def rotor_speeds(
    thrust: Floats,
    yaw: float,
    rate_rps: float,
    r: Floats2,
    rates: Floats,
    sides: Floats2,
    frame: Airframe,
    gains: Gains,
) -> Floats:
    """[4] rotor speeds that turn the body's z along the thrust wanted, and give it."""
    norm = np.sqrt(thrust[0] ** 2 + thrust[1] ** 2 + thrust[2] ** 2)
    z = thrust / norm
    # The nose, seen from above, points where the heading does, however the body is tilted.
    x = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    x[2] = -(x[0] * z[0] + x[1] * z[1]) / z[2]
    x /= np.sqrt(1.0 + x[2] ** 2)
    y = np.array([z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]])
    off = np.zeros((3, 3))  # Wanted from actual, less its transpose: twice the error, as a matrix.
    for i in range(3):
        for j in range(3):
            for k in range(3):
                w = (x[k], y[k], z[k])
                off[i, j] += w[i] * r[k, j] - r[k, i] * w[j]
    error = (0.5 * off[2, 1], 0.5 * off[0, 2], 0.5 * off[1, 0])
    lift = frame.mass_kg * (thrust[0] * r[0, 2] + thrust[1] * r[1, 2] + thrust[2] * r[2, 2])
    turn = (r[2, 0] * rate_rps, r[2, 1] * rate_rps, r[2, 2] * rate_rps)
    ix, iy, iz = frame.inertia_kgm2
    roll = ix * (-gains.attitude * error[0] - gains.rates * (rates[0] - turn[0]))
    pitch = iy * (-gains.attitude * error[1] - gains.rates * (rates[1] - turn[1]))
    about = iz * (-gains.turn * error[2] - gains.turn_rate * (rates[2] - turn[2]))
    reach = frame.arm_m * np.sqrt(0.5)
    asked = np.empty(4)
    for k in range(4):
        share = 0.25 * (lift + sides[k, 1] * roll / reach - sides[k, 0] * pitch / reach)
        share += 0.25 * sides[k, 2] * about * frame.k_eta / frame.k_m
        asked[k] = np.sqrt(max(share, 0.0) / frame.k_eta)
    return asked


@compiled
def estimate_rotation(x: Floats, noise: Floats) -> Floats2:
    """[3, 3] world from body, as the vehicle's own sensors tell it."""
    r = rotate_by_quaternion(x[6:10])
    tilt = noise[3:6]
    seen = r.copy()
    for j in range(3):
        seen[0, j] += tilt[1] * r[2, j] - tilt[2] * r[1, j]
        seen[1, j] += tilt[2] * r[0, j] - tilt[0] * r[2, j]
        seen[2, j] += tilt[0] * r[1, j] - tilt[1] * r[0, j]
    return seen


@compiled
def fly_held(
    x: Floats,
    rotors: Floats,
    led: Led,
    held: tuple[float, float, float],
    air: Floats,
    noise: Floats,
    sides: Floats2,
    frame: Airframe,
    gains: Gains,
    steps: int,
    step_s: float,
) -> tuple[Floats, Floats, Led]:
    """State, rotors and what leads after steps; held: speed ahead, climb, turn rate.

    noise: [9] of velocity, attitude (as an angle about each world axis) and rates.
    """
    for _ in range(steps):
        velocity = x[3:6] + noise[:3]
        led, ahead = lead_on(led, velocity, held[0], held[1], held[2], step_s, gains)
        wanted = compute_wanted_acceleration(velocity, led, held[2], ahead, gains)
        seen = estimate_rotation(x, noise)
        asked = rotor_speeds(
            thrust_wanted(wanted, gains),
            led.yaw_rad,
            held[2],
            seen,
            x[10:13] + noise[6:9],
            sides,
            frame,
            gains,
        )
        x, rotors = step_quadrotor(x, rotors, asked, air, sides, frame, step_s)
    return x, rotors, led


@compiled
def fly_led(
    x: Floats,
    rotors: Floats,
    total: Floats,
    rows: tuple[Floats, Floats],
    air: Floats,
    noise: Floats,
    sides: Floats2,
    frame: Airframe,
    gains: Gains,
    led: LedGains,
    steps: int,
    step_s: float,
) -> tuple[Floats, Floats, Floats]:
    """State, rotors and the position's sum after steps; rows: [11] a reference at both ends.

    noise: as of `fly_held`.
    """
    for n in range(steps):
        asked = rows[0] + (n + 0.5) / steps * (rows[1] - rows[0])
        velocity = x[3:6] + noise[:3]
        wanted = lead_acceleration(x[0:3], velocity, asked, total, led)
        total = lead_sum(x[0:3], asked, total, step_s, led)
        speeds = rotor_speeds(
            thrust_wanted(wanted, gains),
            asked[9],
            asked[10],
            estimate_rotation(x, noise),
            x[10:13] + noise[6:9],
            sides,
            frame,
            gains,
        )
        x, rotors = step_quadrotor(x, rotors, speeds, air, sides, frame, step_s)
    return x, rotors, total
