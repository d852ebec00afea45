"""A quadrotor with six degrees of freedom: rigid body, four rotors with lag, drag, and its loops.

Forces in the body frame (x ahead, y left, z up), of the airspeed u there and rotor speeds W_i:
thrust k_eta W_i^2 + k_h (u_ix^2 + u_iy^2), with the airspeed u_i that the rotor meets; rotor drag
-W_i diag(k_d, k_d, k_z) u_i; parasitic drag -|u| diag(c_x, c_y, c_z) u. The rotors turn the body by
their torque -+ k_m W_i^2. Rotor speeds follow commands by a first-order lag, within limits. The
body moves by the equations of Newton and Euler, stepped 500 times a second by the classical
Runge-Kutta method. The form is that of Folk, Paulos and Kumar (RotorPy, 2023), whose
implementation tests hold this one against.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from clearway.base.arrays import Floats, Floats2
from clearway.base.compiled import compiled

GRAVITY_MPS2 = 9.81


class Airframe(NamedTuple):
    """What a quadrotor is made of; the defaults are the AscTec Hummingbird's, as published."""

    mass_kg: float = 0.5
    inertia_kgm2: tuple[float, float, float] = (3.65e-3, 3.68e-3, 7.03e-3)
    arm_m: float = 0.17
    """From the centre to each rotor, in an X."""
    k_eta: float = 5.57e-6
    """Thrust, N/(rad/s)^2."""
    k_m: float = 1.36e-7
    """Torque, Nm/(rad/s)^2."""
    k_d: float = 1.19e-4
    """Rotor drag in its plane, kg/rad."""
    k_z: float = 2.32e-4
    """And across it, by the inflow, kg/rad."""
    k_h: float = 3.39e-3
    """Translational lift, kg/m."""
    drag_kgpm: tuple[float, float, float] = (0.5e-2, 0.5e-2, 1e-2)
    """Parasitic drag along each body axis."""
    motor_lag_s: float = 0.005
    slowest_rps: float = 0.0
    fastest_rps: float = 1500.0

    @property
    def hover_rps(self) -> float:
        """Rotor speed that carries the weight."""
        return float(np.sqrt(self.mass_kg * GRAVITY_MPS2 / (4.0 * self.k_eta)))


ROTOR_SIDES = np.array([[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0], [-1.0, 1.0, -1.0]])
"""[4, 3] per rotor: ahead, to the left, and how its torque turns the body; a diagonal each."""


@compiled
def rotate_by_quaternion(q: Floats) -> Floats2:
    """[3, 3] world from body, of a unit quaternion w, x, y, z."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    r = np.empty((3, 3))
    r[0, 0] = 1.0 - 2.0 * (y * y + z * z)
    r[0, 1] = 2.0 * (x * y - w * z)
    r[0, 2] = 2.0 * (x * z + w * y)
    r[1, 0] = 2.0 * (x * y + w * z)
    r[1, 1] = 1.0 - 2.0 * (x * x + z * z)
    r[1, 2] = 2.0 * (y * z - w * x)
    r[2, 0] = 2.0 * (x * z - w * y)
    r[2, 1] = 2.0 * (y * z + w * x)
    r[2, 2] = 1.0 - 2.0 * (x * x + y * y)
    return r


@compiled
def derivative(x: Floats, rotors: Floats, air: Floats, sides: Floats2, frame: Airframe) -> Floats:
    """[13] of place, velocity (world), quaternion, rates (body), for rotor speeds [4]."""
    r = rotate_by_quaternion(x[6:10])
    rates = x[10:13]
    u = np.zeros(3)
    for i in range(3):
        for j in range(3):
            u[i] += r[j, i] * (x[3 + j] - air[j])
    reach = frame.arm_m * np.sqrt(0.5)
    force, moment = np.zeros(3), np.zeros(3)
    for k in range(4):
        px, py = reach * sides[k, 0], reach * sides[k, 1]
        ux = u[0] - rates[2] * py
        uy = u[1] + rates[2] * px
        uz = u[2] + rates[0] * py - rates[1] * px
        speed = rotors[k]
        fx = -speed * frame.k_d * ux
        fy = -speed * frame.k_d * uy
        fz = frame.k_eta * speed * speed + frame.k_h * (ux * ux + uy * uy) - speed * frame.k_z * uz
        force[0] += fx
        force[1] += fy
        force[2] += fz
        moment[0] += py * fz
        moment[1] -= px * fz
        moment[2] += px * fy - py * fx + sides[k, 2] * frame.k_m * speed * speed
    flow = np.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
    for i in range(3):
        force[i] -= flow * frame.drag_kgpm[i] * u[i]
    dx = np.empty(13)
    for i in range(3):
        dx[i] = x[3 + i]
        pull = r[i, 0] * force[0] + r[i, 1] * force[1] + r[i, 2] * force[2]
        dx[3 + i] = pull / frame.mass_kg
    dx[5] -= GRAVITY_MPS2
    w, a, b, c = x[6], x[7], x[8], x[9]
    p, q, s = rates[0], rates[1], rates[2]
    dx[6] = 0.5 * (-a * p - b * q - c * s)
    dx[7] = 0.5 * (w * p + b * s - c * q)
    dx[8] = 0.5 * (w * q + c * p - a * s)
    dx[9] = 0.5 * (w * s + a * q - b * p)
    ix, iy, iz = frame.inertia_kgm2
    dx[10] = (moment[0] - (iz - iy) * q * s) / ix
    dx[11] = (moment[1] - (ix - iz) * s * p) / iy
    dx[12] = (moment[2] - (iy - ix) * p * q) / iz
    return dx


@compiled
def step_quadrotor(
    x: Floats,
    rotors: Floats,
    asked_rps: Floats,
    air: Floats,
    sides: Floats2,
    frame: Airframe,
    step_s: float,
) -> tuple[Floats, Floats]:
    """State [13] and rotor speeds [4] a short step later; rotors are held at their mean in it."""
    keeps = np.exp(-step_s / frame.motor_lag_s)
    mean = frame.motor_lag_s / step_s * (1.0 - keeps)
    after, within = np.empty(4), np.empty(4)
    for k in range(4):
        asked = min(max(asked_rps[k], frame.slowest_rps), frame.fastest_rps)
        after[k] = asked + keeps * (rotors[k] - asked)
        within[k] = asked + mean * (rotors[k] - asked)
    k1 = derivative(x, within, air, sides, frame)
    k2 = derivative(x + 0.5 * step_s * k1, within, air, sides, frame)
    k3 = derivative(x + 0.5 * step_s * k2, within, air, sides, frame)
    k4 = derivative(x + step_s * k3, within, air, sides, frame)
    end = x + step_s / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    norm = np.sqrt(end[6] ** 2 + end[7] ** 2 + end[8] ** 2 + end[9] ** 2)
    end[6:10] /= norm
    return end, after
