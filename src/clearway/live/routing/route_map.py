"""What a way may lead through: coarse cells that are kept while the flight goes on.

Returns and voxels of free space are forgotten behind the vehicle. What they showed of walls must
not be, or the way back leads through them. Each cell knows how near something stands, whether it
was seen, and how much was flown for a way through it that came to nothing.
"""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from clearway.avoidance.clear.hazards import PointHazards
from clearway.base.arrays import BoolArray, IntArray
from clearway.base.compiled import read_only
from clearway.base.frames import FloatArray
from clearway.live.routing.cell_marking import add_ball, leaves_no_room, mark_seen, renew_nearest
from clearway.live.routing.distance_field import HALF_DIAGONAL
from clearway.live.routing.nearest_balls import mark_balls
from clearway.obstacles.obstacle_map import ObstacleMap
from clearway.sensors.observed.seen_space import SeenSpace
from clearway.vehicle.automaton import MovementAutomaton

Number = TypeVar("Number", np.float64, np.bool_)

FINE, COARSE = 4, 8
"""Voxels of free space along a cell: for vehicles that turn in little room, and for others."""
SHAPE, WIDEST = (64, 64, 16), (128, 128, 16)
"""Cells along each axis, the vehicle about their middle; and where these would leave behind what
stands, which forgotten is flown into again if it was a street that is closed."""
OF_TURN = 0.6
"""A coarse cell is at most this share of the turning radius wide."""
SEES_BEHIND = 3.5
"""Turning radii to which sensors see where cells are fine all the same: from before a gap too
narrow for coarse ones, room to turn is seen behind it."""
ROLL_WITHIN = 8
"""Cells move along once the vehicle is off their middle by this part of their number."""
UNOBSERVED_COST = 2.0
"""Price of a metre that nobody has seen."""
NO_ROOM_TO_TURN, HARDLY_ROOM = 3.0, 9.0
"""Price of a metre with no room beside the margin to turn, and with none to turn half as wide."""
NARROW = (1.25, 1.5)
"""The same prices where the mission allows narrow places."""
TALL, TALL_FINE = 100.0, 200.0
"""Price of a metre that nobody has seen above or below what stands, for who turns in much room and
for others: most of it stands on."""
MOST_FINE = 60.0
"""Price of a metre at most for others, when a way is looked for: who can stop may look, but not for
longer than it takes to fly back out of a room."""
IN_VAIN_VOXELS = 12
"""About a place that a way came no nearer to, those within so many cost more, at least."""
IN_VAIN = 1.0
"""Added to a metre's price for every time that a way there came no nearer to it."""
MOST_ROOM = 2.0
"""Cells about a place beyond which more room says nothing of which side of a wall it is on."""
SPENT = 3.0
"""Cells about a place that was tried, for which that holds."""
NEARER = 0.5
"""Share of what was flown that a way must come nearer to the place that it hangs on."""


def turning_room_m(automaton: MovementAutomaton) -> float:
    """Room that a turn takes; 0 where the vehicle can stop, or turns nowhere."""
    room = automaton.room_to_turn_m
    return room if np.isfinite(room) else 0.0


class Cells(NamedTuple):
    """Space about the vehicle as cells with prices."""

    low_m: FloatArray
    """[3] lowest corner."""
    width_m: float
    price: FloatArray
    """[nx, ny, nz] of a metre, at least 1; inf where no way leads."""
    in_vain: FloatArray
    """[nx, ny, nz] the part of it for ways that came to nothing."""
    nearest_m: FloatArray
    """[nx, ny, nz] from the cell's centre to what stands nearest, as far as it matters."""
    most: float = np.inf
    """A metre costs no more than that, when a way is looked for."""

    def cell_of(self, place_m: FloatArray) -> FloatArray:
        """[..., 3] number of the cell that a place lies in."""
        return np.floor((place_m - self.low_m) / self.width_m)


class RouteMap:
    """Cells about the vehicle that move along with it.

    voxel_m: of the free space that it is told of. margin_m, turning_radius_m: of the vehicle; 0
    for one that turns on the spot. obstacle_map: what is known before. narrow: whether what leaves
    no room to turn may be flown through. sees_m: how far sensors see, where that is known. finer:
    cells are small whatever room a turn takes: coarse ones have no gap where narrow ones are.
    heights_m: between which ways lead; of rules.
    """

    def __init__(
        self,
        voxel_m: float,
        margin_m: float,
        turning_radius_m: float,
        obstacle_map: ObstacleMap | None = None,
        *,
        narrow: bool = False,
        sees_m: float = 0.0,
        finer: bool = False,
        heights_m: tuple[float, float] = (-np.inf, np.inf),
    ) -> None:
        self._no_room, self._hardly_room = NARROW if narrow else (NO_ROOM_TO_TURN, HARDLY_ROOM)
        coarse = COARSE * voxel_m <= OF_TURN * turning_radius_m
        coarse &= sees_m < SEES_BEHIND * turning_radius_m
        self._turns_wide = coarse
        self._per_cell = COARSE if coarse and not finer else FINE
        self.width_m = float(self._per_cell * voxel_m)
        # No gap between cells leads through a wall, however thin.
        self._barred_m = max(margin_m, HALF_DIAGONAL * self.width_m)
        self.rooms_m = (margin_m + 0.5 * turning_radius_m, margin_m + turning_radius_m)
        self._matters_m = max(self.rooms_m[1] + self.width_m, MOST_ROOM * self.width_m)
        self._turning_radius_m = turning_radius_m
        self._obstacle_map = obstacle_map
        self._heights_m = heights_m
        self._low: IntArray | None = None
        self._shape = SHAPE
        self._nearest: FloatArray = np.full(self._shape, np.inf)
        self._mapped: FloatArray = np.full(self._shape, np.inf)
        self._seen: BoolArray = np.zeros(self._shape, dtype=np.bool_)
        self._in_vain: FloatArray = np.zeros(self._shape)
        self._aim: FloatArray | None = None

    # --- what was seen --------------------------------------------------------------------

    def take(
        self, seen: SeenSpace, remembered: PointHazards, position_m: FloatArray, reach_m: float
    ) -> None:
        """Take in what is known now; within a distance of the vehicle nothing of it is missing."""
        low = self._follow(position_m)
        fresh = np.full(self._shape, np.inf)
        mark_balls(
            fresh,
            read_only(remembered.position_m),
            read_only(remembered.radius_m),
            np.asarray(low * self.width_m, dtype=np.float64),
            self.width_m,
            self._matters_m,
        )
        ticks = [
            (low[axis] + np.arange(count) + 0.5) * self.width_m - position_m[axis]
            for axis, count in enumerate(self._shape)
        ]
        within_m = max(reach_m - self.rooms_m[1] - self.width_m, 0.0)
        x2, y2, z2 = (tick**2 for tick in ticks)
        renew_nearest(self._nearest, fresh, (x2, y2, z2), within_m**2)
        mark_seen(self._seen, seen.free, seen.low, low, self._per_cell)
        inside = [
            (lowest <= tick + place) & (tick + place <= highest)
            for tick, place, lowest, highest in zip(
                ticks, position_m, *seen.complete_m, strict=True
            )
        ]
        if all(along.any() for along in inside):
            self._seen |= inside[0][:, None, None] & inside[1][:, None] & inside[2]

    def _follow(self, position_m: FloatArray) -> IntArray:
        """[3] number of the lowest cell, moved along where the vehicle has left the middle."""
        middle = np.floor(position_m / self.width_m).astype(np.int64)
        wanted: IntArray = middle - np.array(self._shape) // 2
        if self._low is None:
            self._low = wanted
            self._mapped = self._of_map(wanted)
            return wanted
        by = wanted - self._low
        if np.any(np.abs(by) > np.array(self._shape) // ROLL_WITHIN):
            if self._leaves_behind(by):
                self._shape = WIDEST
                wanted = middle - np.array(self._shape) // 2
                by = wanted - self._low
            self._nearest = _moved(self._nearest, by, self._shape, np.inf)
            self._seen = _moved(self._seen, by, self._shape, False)
            self._in_vain = _moved(self._in_vain, by, self._shape, 0.0)
            self._mapped = self._of_map(wanted)
            self._low = wanted
        return self._low

    def _leaves_behind(self, by: IntArray) -> bool:
        """Whether cells moved aside by so many would no longer hold something that stands."""
        stands = self._nearest < self._barred_m
        kept = _moved(stands, by * (1, 1, 0), self._shape, False)
        return int(np.count_nonzero(kept)) < int(np.count_nonzero(stands))

    def _of_map(self, low: IntArray) -> FloatArray:
        """Distance of cells' centres to what the map shows."""
        if self._obstacle_map is None or not len(self._obstacle_map):
            return np.full(self._shape, np.inf)
        shape = self._shape
        ticks = [(low[axis] + np.arange(n) + 0.5) * self.width_m for axis, n in enumerate(shape)]
        centers = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, 3)
        return self._obstacle_map.distance_m(centers, self._matters_m).reshape(shape)

    # --- what came to nothing -------------------------------------------------------------

    def aim(self, way_m: FloatArray) -> None:
        """Note places [n, 3] along the way flown now, up to the one that it hangs on."""
        self._aim = way_m

    def came_nearer(self, position_m: FloatArray, flown_m: float) -> bool:
        """Whether what was flown led along the way aimed at; else the end of that costs more."""
        way = self._aim
        if way is None or self._low is None:
            return True
        steps = np.linalg.norm(np.diff(way, axis=0), axis=1)
        left = np.append(np.cumsum(steps[::-1])[::-1], 0.0)
        off = np.linalg.norm(way - position_m, axis=1)
        at = int(np.argmin(off))
        if left[0] - left[at] - off[at] >= NEARER * flown_m:
            return True
        cell = np.floor(way[-1] / self.width_m).astype(np.int64) - self._low
        reach = max(self.rooms_m[1] / self.width_m, IN_VAIN_VOXELS / self._per_cell)
        # Who turns in little room climbs in it too: to such another height is another way.
        height = int(cell[2])
        heights = self._alike(cell, reach) if self._turns_wide else (height, height)
        add_ball(self._in_vain, cell, reach, *heights, IN_VAIN)
        return False

    def _alike(self, cell: IntArray, reach: float) -> tuple[int, int]:
        """Lowest and highest layer that differ in nothing from that of a cell, as far as was seen:
        what stands about it goes on above and below until a layer is seen to be free of it.

        Who comes back at another height sees anew what was seen already, of the same gap.
        """
        far = int(np.ceil(reach))
        about = tuple(slice(max(0, at - far), max(0, at + far + 1)) for at in cell[:2].tolist())
        stands = np.minimum(self._nearest, self._mapped)[about] < self._barred_m
        free = self._seen[about].any(axis=(0, 1)) & ~stands.any(axis=(0, 1))
        layers = len(free)
        low = high = min(max(int(cell[2]), 0), layers - 1)
        if free[low]:
            return low, high
        while low > 0 and not free[low - 1]:
            low -= 1
        while high < layers - 1 and not free[high + 1]:
            high += 1
        return low, high

    def spend(self, place_m: FloatArray) -> None:
        """What begins at a place [3] has been tried: it costs more about there from now on."""
        if self._low is not None:
            cell = np.floor(place_m / self.width_m).astype(np.int64) - self._low
            add_ball(self._in_vain, cell, SPENT, int(cell[2]), int(cell[2]), IN_VAIN)

    def try_all_again(self) -> None:
        """Forget what came to nothing: who flies otherwise from now on may come through there."""
        self._in_vain[...] = 0.0

    # --- prices ---------------------------------------------------------------------------

    def cells(self) -> Cells:
        """What a way costs; raises RuntimeError before anything was taken in."""
        if self._low is None:
            raise RuntimeError("route map: nothing was taken in")
        nearest = np.minimum(self._nearest, self._mapped)
        price = np.where(self._seen, 1.0, UNOBSERVED_COST)
        barred = nearest < self._barred_m
        stands = np.any(barred, axis=2, keepdims=True)
        price[~self._seen & stands] = TALL if self._turns_wide else TALL_FINE
        if self._turning_radius_m > 0.0:
            radii = (0.5 * self._turning_radius_m, self._turning_radius_m)
            hardly, none = (
                leaves_no_room(nearest, self._barred_m, room, radius, self.width_m)
                for room, radius in zip(self.rooms_m, radii, strict=True)
            )
            price[none] *= self._no_room
            price[hardly] *= self._hardly_room / self._no_room
        price += self._in_vain
        price[barred] = np.inf
        floor_m, (lowest, highest) = self.width_m * self._low[2], self._heights_m
        layers = floor_m + self.width_m * np.arange(price.shape[2])
        price[:, :, (layers + self.width_m < lowest) | (layers > highest)] = np.inf
        return Cells(
            np.asarray(self._low * self.width_m, dtype=np.float64),
            self.width_m,
            price,
            self._in_vain,
            nearest,
            np.inf if self._turns_wide else MOST_FINE,
        )


def _moved(
    values: npt.NDArray[Number], by: IntArray, shape: tuple[int, int, int], fill: float
) -> npt.NDArray[Number]:
    """[*shape] values of cells whose lowest is another by so many; fill where they are new."""
    moved = np.full(shape, fill, dtype=values.dtype)
    to, of = [], []
    for shift, count, before in zip(by.tolist(), shape, values.shape, strict=True):
        first, last = max(-shift, 0), max(min(count, before - shift), 0)
        to.append(slice(first, max(first, last)))
        of.append(slice(first + shift, max(first, last) + shift))
    moved[tuple(to)] = values[tuple(of)]
    return moved
