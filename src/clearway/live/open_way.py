"""Whether any way leads over cells: quick to tell, for it asks for no price.

Every cell is looked at once. A search for the cheapest way takes ten times as long to find out that
there is none.
"""

from __future__ import annotations

import numpy as np

from clearway.base.compiled import compiled
from clearway.base.frames import FloatArray


@compiled
def is_open(
    price: FloatArray, nearest: FloatArray, start: FloatArray, goal: FloatArray, ends_beside: int
) -> bool:
    """Whether a way over cells leads from one to another, by the rules of `seen_route`.

    price: [nx, ny, nz] inf where nothing leads; nearest: [nx, ny, nz] in cells, to what stands.
    ends_beside: cells from a goal that is barred at which a way to it ends.
    """
    nx, ny, nz = price.shape
    known = np.zeros((nx, ny, nz), dtype=np.bool_)
    ga, gb, gc = int(goal[0]), int(goal[1]), int(goal[2])
    beyond = ga < 0 or gb < 0 or ga >= nx or gb >= ny
    short = ends_beside if not beyond and price[ga, gb, gc] == np.inf else 0
    waiting = np.empty(nx * ny * nz, dtype=np.int64)
    a, b, c, count = int(start[0]), int(start[1]), int(start[2]), 1
    waiting[0] = (a * ny + b) * nz + c
    known[a, b, c] = True
    while count > 0:
        count -= 1
        here = waiting[count]
        c = here % nz
        b = (here // nz) % ny
        a = here // (nz * ny)
        if max(abs(a - ga), abs(b - gb), abs(c - gc)) <= short:
            return True
        if beyond and (a == 0 or b == 0 or a == nx - 1 or b == ny - 1):
            return True
        begins_barred = price[a, b, c] == np.inf
        for u in range(max(a - 1, 0), min(a + 2, nx)):
            for v in range(max(b - 1, 0), min(b + 2, ny)):
                for w in range(max(c - 1, 0), min(c + 2, nz)):
                    if known[u, v, w] or (price[u, v, w] == np.inf and not begins_barred):
                        continue
                    apart = np.sqrt(float((u - a) ** 2 + (v - b) ** 2 + (w - c) ** 2))
                    if begins_barred and nearest[u, v, w] + nearest[a, b, c] <= apart:
                        continue
                    known[u, v, w] = True
                    waiting[count] = (u * ny + v) * nz + w
                    count += 1
    return False
