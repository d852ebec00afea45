"""Any way over cells: quick to find, for it asks for no price.

Every cell is looked at once. A search for the cheapest way takes ten times as long to find out that
there is none.
"""

from __future__ import annotations

import numpy as np

from clearway.base.arrays import Floats, Floats2, Floats3, Ints3
from clearway.base.compiled import compiled


@compiled
def any_way(
    price: Floats3, nearest: Floats3, start: Floats, goal: Floats, ends_beside: int
) -> Floats2:
    """[n, 3] the way of fewest cells from one to another, both ends included, by the rules of
    `seen_route`; none where no way leads.

    price: [nx, ny, nz] inf where nothing leads; nearest: [nx, ny, nz] in cells, to what stands.
    ends_beside: cells from a goal that is barred at which a way to it ends.
    """
    nx, ny, nz = price.shape
    came = np.full((nx, ny, nz), -2, dtype=np.int64)
    ga, gb, gc = int(goal[0]), int(goal[1]), int(goal[2])
    beyond = ga < 0 or gb < 0 or ga >= nx or gb >= ny
    short = ends_beside if not beyond and price[ga, gb, gc] == np.inf else 0
    waiting = np.empty(nx * ny * nz, dtype=np.int64)
    a, b, c, looked, count = int(start[0]), int(start[1]), int(start[2]), 0, 1
    waiting[0] = (a * ny + b) * nz + c
    came[a, b, c] = -1
    while looked < count:
        here = waiting[looked]
        looked += 1
        c = here % nz
        b = (here // nz) % ny
        a = here // (nz * ny)
        if max(abs(a - ga), abs(b - gb), abs(c - gc)) <= short:
            return _back(came, here)
        if beyond and (a == 0 or b == 0 or a == nx - 1 or b == ny - 1):
            return _back(came, here)
        begins_barred = price[a, b, c] == np.inf
        for u in range(max(a - 1, 0), min(a + 2, nx)):
            for v in range(max(b - 1, 0), min(b + 2, ny)):
                for w in range(max(c - 1, 0), min(c + 2, nz)):
                    if came[u, v, w] > -2 or (price[u, v, w] == np.inf and not begins_barred):
                        continue
                    apart = np.sqrt(float((u - a) ** 2 + (v - b) ** 2 + (w - c) ** 2))
                    if begins_barred and nearest[u, v, w] + nearest[a, b, c] <= apart:
                        continue
                    came[u, v, w] = here
                    waiting[count] = (u * ny + v) * nz + w
                    count += 1
    return np.zeros((0, 3))


@compiled
def _back(came: Ints3, end: int) -> Floats2:
    """[n, 3] the cells that led to one, from the first on."""
    _, ny, nz = came.shape
    count, at = 0, end
    while at >= 0:
        count += 1
        at = came[at // (nz * ny), (at // nz) % ny, at % nz]
    way, at = np.empty((count, 3)), end
    for n in range(count - 1, -1, -1):
        way[n, 0], way[n, 1], way[n, 2] = at // (nz * ny), (at // nz) % ny, at % nz
        at = came[at // (nz * ny), (at // nz) % ny, at % nz]
    return way
