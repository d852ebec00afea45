"""How sure the autopilot is of its own position and attitude, by whichever message tells it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

from clearway.mavlink import dialect as known
from clearway.mavlink.dialect import Message

LOCAL_DIAGONAL = (0, 9, 17)
"""Of x, y, z in the upper triangle of LOCAL_POSITION_NED_COV's nine by nine."""
PLACE_DIAGONAL = (0, 6, 11)
"""Of x, y, z in ODOMETRY's six by six."""
TURN_DIAGONAL = (15, 18, 20)
"""Of roll, pitch, yaw in ODOMETRY's six by six."""
HEALTHY_RATIO = 0.5
"""ArduPilot's EKF warns from here on."""
INNOVATION_M = 2.5
"""What a ratio of 1 stands for: its gate is five deviations, of half a metre for GPS."""
LARGEST_M = 1e4
LARGEST_RAD = math.pi
DOUBTED = "position: doubted by the autopilot's estimator"
NOT_TOLD = "accuracy: not told, or no number"


class StatedAccuracy:
    """Standard deviations by the latest message of each kind; never below those of the settings.

    What is told once holds until the same kind of message tells something else: a link that falls
    silent makes nothing surer.
    """

    def __init__(self, position_std_m: float, counts: Counter[str]) -> None:
        self._least_m = position_std_m
        self._counts = counts
        self._position_m: dict[int, float] = {}
        self._attitude_rad: dict[int, float] = {}

    @property
    def position_std_m(self) -> float:
        """Along the least certain axis."""
        return max(self._least_m, *self._position_m.values(), 0.0)

    @property
    def attitude_std_rad(self) -> float:
        """About the least certain axis."""
        return max(self._attitude_rad.values(), default=0.0)

    def take(self, message: Message, number: int) -> None:
        """LOCAL_POSITION_NED_COV, ODOMETRY, ESTIMATOR_STATUS or EKF_STATUS_REPORT."""
        if number == known.LOCAL_POSITION_NED_COV:
            self._take_place(number, _deviation(message.covariance, LOCAL_DIAGONAL))
        elif number == known.ODOMETRY:
            self._take_place(number, _deviation(message.pose_covariance, PLACE_DIAGONAL))
            turn = _deviation(message.pose_covariance, TURN_DIAGONAL)
            if turn is not None:
                self._attitude_rad[number] = min(turn, LARGEST_RAD)
        elif number == known.ESTIMATOR_STATUS:
            told = (message.pos_horiz_accuracy, message.pos_vert_accuracy)
            self._take_place(number, _worst(told))
        else:
            self._take_place(number, self._by_ratio(message))

    def _take_place(self, number: int, std_m: float | None) -> None:
        if std_m is None:
            self._counts[NOT_TOLD] += 1
        else:
            self._position_m[number] = min(std_m, LARGEST_M)

    def _by_ratio(self, message: Message) -> float | None:
        """Of innovations over their gates; nothing while they are healthy."""
        ratio = _worst((message.pos_horiz_variance, message.pos_vert_variance))
        if ratio is None or ratio <= HEALTHY_RATIO:
            return None if ratio is None else 0.0
        self._counts[DOUBTED] += 1
        return ratio * INNOVATION_M


def _deviation(covariance: Sequence[float], diagonal: Sequence[int]) -> float | None:
    """The largest standard deviation; None where it is unknown (NaN first, or all 0)."""
    variances = [float(covariance[at]) for at in diagonal]
    if math.isnan(float(covariance[0])) or not any(variances):
        return None
    worst = _worst(variances)
    return None if worst is None else math.sqrt(worst)


def _worst(values: Sequence[float]) -> float | None:
    """The largest of numbers >= 0; None where one is not."""
    return max(values) if all(0.0 <= value < math.inf for value in values) else None
