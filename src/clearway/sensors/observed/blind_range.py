"""Beams that a sensor hears nothing of: did they go on, or end within its blind range?

What stands nearer than a sensor's least range gives no return and hides what is behind it. A beam
without return therefore shows something only where its way through the blind range was seen to be
free before, from farther off.
"""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Floats, Int16s
from clearway.base.compiled import compiled
from clearway.sensors.observed.seen_space import SeenSpace, is_free
from clearway.sensors.observed.view_shape import FARTHEST, IMAGE_COLUMNS, IMAGE_ROWS, SIN_HALF
from clearway.sensors.passing.passed_points import Sensor

BLOCK = 8
"""Pixels along each side of what is looked up at once."""
STEPS = 6
"""Balls along the way through the blind range."""


@compiled
def hide_unheard(
    image: Int16s, numbers: Floats, directions: Floats, sensor: Sensor, before: SeenSpace
) -> None:
    """Take back what pixels without return show, where their way through the blind range was not
    seen to be free before.

    image, numbers, directions: of a view and its `ViewShape`.
    """
    o, near = sensor.origin, sensor.min_range
    if is_free(before, o[0], o[1], o[2], near):
        return
    rows, columns = int(numbers[IMAGE_ROWS]), int(numbers[IMAGE_COLUMNS])
    wide = min(2.0 * BLOCK * numbers[SIN_HALF], 1.0)
    for i in range(0, rows, BLOCK):
        below = min(i + BLOCK, rows)
        row = (i + below) // 2
        for j in range(0, columns, BLOCK):
            beside = min(j + BLOCK, columns)
            if not _has_unheard(image, columns, (i, below), (j, beside)):
                continue
            column = (j + beside) // 2
            cosine = directions[2 * columns + rows + row]
            x, y = cosine * directions[column], cosine * directions[columns + column]
            if not _was_free(x, y, directions[2 * columns + row], wide, sensor, before):
                for k in range(i, below):
                    for at in range(k * columns + j, k * columns + beside):
                        if image[at] == FARTHEST:
                            image[at] = np.int16(0)
                        elif image[at] == -1 - FARTHEST:
                            image[at] = np.int16(-1)


@compiled
def _has_unheard(image: Int16s, columns: int, high: tuple[int, int], wide: tuple[int, int]) -> bool:
    """Whether any pixel of a block has no return."""
    for i in range(high[0], high[1]):
        for at in range(i * columns + wide[0], i * columns + wide[1]):
            if image[at] == FARTHEST or image[at] == -1 - FARTHEST:
                return True
    return False


@compiled
def _was_free(x: float, y: float, z: float, wide: float, sensor: Sensor, before: SeenSpace) -> bool:
    """Whether directions about one of the sensor's frame were seen to be free through its blind
    range; wide: sine of the angle to the farthest of them."""
    r, o = sensor.rotation, sensor.origin
    east = r[0, 0] * x + r[0, 1] * y + r[0, 2] * z
    north = r[1, 0] * x + r[1, 1] * y + r[1, 2] * z
    up = r[2, 0] * x + r[2, 1] * y + r[2, 2] * z
    half = 0.5 * sensor.min_range / STEPS
    for n in range(STEPS):
        away = (2 * n + 1) * half
        across = (away + half) * wide
        radius = np.sqrt(half * half + across * across)
        if not is_free(before, o[0] + away * east, o[1] + away * north, o[2] + away * up, radius):
            return False
    return True
