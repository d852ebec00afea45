"""How far a flight strays from its prediction, by how much it may, and how it is corrected."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from clearway.base.errors import ClearwayError
from clearway.base.frames import FloatArray, measure_length, wrap_angle
from clearway.vehicle.automaton import Movement, MovementAutomaton

MARGIN_SHARE = 1.0 / 12.0
"""Share of the safety margin that prediction errors may use up (4.2.2)."""


@dataclass(frozen=True)
class PredictionError:
    """Deviation of a state from its prediction (4.11), its two parts apart."""

    position_m: float
    """Distance of the positions."""
    angle_rad: float
    """Length of the difference in pitch and yaw."""
    angle_weight_m: float
    """What an angle counts: (4.11) as printed adds metres and radians."""

    @property
    def total_m(self) -> float:
        """e_d of (4.11) in metres."""
        return self.position_m + self.angle_weight_m * self.angle_rad


def prediction_error(
    state: npt.ArrayLike, predicted: npt.ArrayLike, angle_weight_m: float
) -> PredictionError:
    """e_d of (4.11) between states [6]; the turning radius is the usual weight of the angles.

    An angle off by a for the length of a turning radius r displaces by about r a.
    """
    difference = np.asarray(state, dtype=np.float64) - np.asarray(predicted, dtype=np.float64)
    angles = wrap_angle(difference[4:])
    return PredictionError(measure_length(difference[:3]), measure_length(angles), angle_weight_m)


def needs_correction(
    error: PredictionError, safety_margin_m: float, share: float = MARGIN_SHARE
) -> bool:
    """Whether an error takes more than its share of the safety margin (4.2.2)."""
    return error.total_m > share * safety_margin_m


def correct_movement(
    automaton: MovementAutomaton,
    movement: Movement,
    state: npt.ArrayLike,
    predicted: npt.ArrayLike,
    rate_limit_rps: float | None = None,
) -> Movement:
    """The movement with its turn rates changed so that its end has the predicted attitude again.

    That is (4.9): the input for the state that is expected.

    state, predicted: [6] at the movement's start, where alone movements may be exchanged (4.12).
    Rates stay within +-`rate_limit_rps` (default: the fastest turn of the automaton, and half
    of that more, so that a full turn can be corrected too), and pitch within the automaton's
    limit or on the way back to it. Position is left to the next decision.
    """
    limit = rate_limit_rps
    if limit is None:
        limit = 1.5 * max(m.turn_rate_rps for m in automaton.movements)
    off = wrap_angle(np.asarray(predicted)[4:] - np.asarray(state)[4:]) / movement.duration_s
    pitch_rate = float(np.clip(movement.pitch_rate_rps + off[0], -limit, limit))
    yaw_rate = float(np.clip(movement.yaw_rate_rps + off[1], -limit, limit))
    if automaton.pitch_limit_rad is not None:
        start, bound = float(np.asarray(state)[4]), automaton.pitch_limit_rad
        end = start + pitch_rate * movement.duration_s
        nearest = float(np.clip(end, min(-bound, start), max(bound, start)))
        pitch_rate = (nearest - start) / movement.duration_s
    return replace(movement, pitch_rate_rps=pitch_rate, yaw_rate_rps=yaw_rate)


@dataclass(frozen=True)
class NoiseBounds:
    """Bounds of state noise w and input noise v of (3.20), for the plane model (4.4).

    Raises ClearwayError unless every bound is a number >= 0.
    """

    pitch_rad: float = 0.0
    """w: error of the pitch that the vehicle flies with."""
    yaw_rad: float = 0.0
    speed_mps: float = 0.0
    """v: error of the speed input."""
    pitch_rate_rps: float = 0.0
    yaw_rate_rps: float = 0.0
    drift_mps: float = 0.0
    """Speed of the air or of anything else that carries the vehicle."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not 0.0 <= value < np.inf:
                raise ClearwayError(f"noise bound {name}: {value} is not a number >= 0")


def deviation_rate(
    noise: NoiseBounds, speed_mps: float, horizon_s: float, angle_weight_m: float = 0.0
) -> float:
    """rho of (3.27): (4.11) grows by at most rho per second over the horizon.

    What state noise adds is (3.23), what input noise adds over the movements (3.25), (3.26).

    Derivation, for true x' = g(x + w) + h(u + v) and predicted x' = g(x) + h(u) from one start:
    pitch and yaw deviate by at most their rate noise times the time, |db| <= v_b t and
    |dg| <= v_g t. The direction of flight is a point on the unit sphere, and two points whose
    pitch and yaw differ by (b, g) lie at most hypot(b, g) apart, since the metric of the sphere
    is db^2 + cos^2(b) dg^2; nor can they lie further apart than 2. With the attitude noise added,
    velocities differ by at most
        |v_s| + drift + speed * min(2, hypot(w_b + v_b t, w_g + v_g t)),
    which grows with t, so its value at the horizon bounds it throughout. Each weighed angle adds
    its rate noise. Unlike (3.22), g does not drop out: that would need it to be linear.
    """
    turned = np.hypot(
        noise.pitch_rad + noise.pitch_rate_rps * horizon_s,
        noise.yaw_rad + noise.yaw_rate_rps * horizon_s,
    )
    sideways = speed_mps * min(2.0, float(turned))
    angles = angle_weight_m * float(np.hypot(noise.pitch_rate_rps, noise.yaw_rate_rps))
    return noise.speed_mps + noise.drift_mps + sideways + angles


def deviation_bound_m(
    noise: NoiseBounds,
    speed_mps: float,
    times_s: npt.ArrayLike,
    angle_weight_m: float = 0.0,
) -> FloatArray:
    """Largest deviation (3.28) at times [n] after the start of a prediction: rho (t - t0).

    It is the radius of the ball (3.16) of def. 13.

    rho is taken for each time as its own horizon, which is the tightest that (3.28) gives.
    """
    times = np.atleast_1d(np.asarray(times_s, dtype=np.float64))
    rates = [deviation_rate(noise, speed_mps, float(t), angle_weight_m) for t in times]
    return np.array(rates) * times
