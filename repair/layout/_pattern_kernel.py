"""Kernels of `regular`: quads only for a disc with k convex corners and given numbers of edges, few irregular vertices.

Three patterns. A *grid* fills four sides whose opposite ones agree. A *star* has one vertex of k edges, whose legs run
to the middles of the sides: leg i and leg i - 2 make up side i - 1, which fixes all legs for k = 3, 5, 6 (the blocks of
midpoint subdivision, Tam and Armstrong, Adv. Eng. Software 13, 1991). A *cut* parts the disc by a path between two of
its sides and puts a star on either side of it: k = 2 into 3 + 3, 4 into 3 + 5, 6 into 5 + 5 (some of the patterns of
Takayama, Panozzo, Sorkine-Hornung, Computer Graphics Forum 33(5), 2014, found here by trying all paths).

A disc is a loop of vertices, counter-clockwise; `corner` (k,) are the rows of its corners, the first one row 0.
"""

# mypy: disable-error-code="untyped-decorator,no-any-return,return-value"

from __future__ import annotations

import numpy as np

from patchwright.models._compile_kernel import inner, kernel
from patchwright.models.arrays import IntArray

MOST_SIDES = 6
GRID, STAR, CUT = 0, 1, 2


@inner
def star_legs(side: IntArray, k: int, leg: IntArray) -> int:
    """The legs (k,) of a star for sides (k,), and the shortest of them; not above 0 where there is no star."""
    shortest = 1 << 30
    if k == 3 or k == 5:
        for i in range(k):
            total = 0
            for j in range(k):
                total += side[(i + 1 + 2 * j) % k] * (1 - 2 * (j % 2))
            if total % 2 != 0:
                return 0
            leg[i] = total // 2
            shortest = min(shortest, leg[i])
        return shortest
    if k == 6:
        for i in range(6):
            total = side[(i + 1) % 6] + side[(i + 5) % 6] - side[(i + 3) % 6]
            if total % 2 != 0:
                return 0
            leg[i] = total // 2
            shortest = min(shortest, leg[i])
        return shortest
    return 0


@inner
def cut_legs(
    side: IntArray, k: int, i: int, a: int, j: int, b: int, path: int, part: IntArray, leg: IntArray
) -> tuple[int, int]:
    """Shortest and longest leg of the two stars left of and right of a path; not above 0 where there is none.

    The path of `path` edges joins the points `a` edges along side i and `b` edges along side j.
    """
    first = (j - i) % k
    part[0] = side[i] - a
    for n in range(1, first):
        part[n] = side[(i + n) % k]
    part[first] = b
    part[first + 1] = path
    least = star_legs(part, first + 2, leg)
    most = 0
    if least <= 0:
        return 0, 0
    for n in range(first + 2):
        most = max(most, leg[n])
    second = k - first
    part[0] = side[j] - b
    for n in range(1, second):
        part[n] = side[(j + n) % k]
    part[second] = a
    part[second + 1] = path
    least = min(least, star_legs(part, second + 2, leg))
    for n in range(second + 2):
        most = max(most, leg[n])
    return least, most


@kernel
def patterns(side: IntArray, k: int, found: IntArray) -> int:
    """All patterns worth trying for sides (k,), best first; how many rows of `found` (8, 6) were filled.

    A row is: kind, side i, its edge a, side j, its edge b, edges of the path; zeros where they mean nothing.
    """
    leg, part = np.empty(MOST_SIDES + 2, dtype=np.int64), np.empty(MOST_SIDES + 2, dtype=np.int64)
    found[:] = 0
    count = 0
    if k == 4 and side[0] == side[2] and side[1] == side[3]:
        found[0, 0] = GRID
        return 1
    if k != 4 and star_legs(side, k, leg) > 0:
        found[0, 0] = STAR
        count = 1
        if k != 6:
            return 1
    if k != 2 and k != 4 and k != 6:
        return count
    step = 3 if k == 6 else 1
    value = np.zeros(8, dtype=np.int64)
    for i in range(4 if k == 4 else k // 2):
        j = (i + step) % k
        best = 0
        for a in range(1, side[i]):
            for b in range(1, side[j]):
                # the path's parity is that of the sides left of it
                total = side[i] - a + b
                for n in range(1, step):
                    total += side[(i + n) % k]
                for path in range(2 - total % 2, total, 2):
                    least, most = cut_legs(side, k, i, a, j, b, path, part, leg)
                    if least > 0 and 64 * least + 63 - min(most, 63) > best:
                        best = 64 * least + 63 - min(most, 63)
                        found[count, 0] = CUT
                        found[count, 1], found[count, 2], found[count, 3] = i, a, j
                        found[count, 4], found[count, 5] = b, path
        if best > 0:
            value[count] = best
            at = count
            while at > 0 and found[at - 1, 0] == CUT and value[at - 1] < value[at]:
                value[at - 1], value[at] = value[at], value[at - 1]
                for n in range(6):
                    found[at - 1, n], found[at, n] = found[at, n], found[at - 1, n]
                at -= 1
            count += 1
    return count


@inner
def defect(kind: int, k: int) -> int:
    """How far the inner vertices of a pattern are from four edges each, summed."""
    if kind == GRID:
        return 0
    return 2 if kind == CUT or k == 6 else 1


@inner
def fill_grid(loop: IntArray, count: int, corner: IntArray, quads: IntArray, q: int, v: int) -> tuple[int, int]:
    """Append a grid between four sides; new vertices are numbered from `v` on. The next quad and vertex."""
    m, n = corner[1], corner[2] - corner[1]
    for a in range(m):
        for b in range(n):
            for c in range(4):
                i, j = a + (1 if c == 1 or c == 2 else 0), b + (1 if c >= 2 else 0)
                if j == 0:
                    quads[q, c] = loop[i]
                elif i == m:
                    quads[q, c] = loop[m + j]
                elif j == n:
                    quads[q, c] = loop[2 * m + n - i]
                elif i == 0:
                    quads[q, c] = loop[count - j]
                else:
                    quads[q, c] = v + (i - 1) * (n - 1) + j - 1
            q += 1
    return q, v + (m - 1) * (n - 1)


@inner
def fill_star(
    loop: IntArray, count: int, corner: IntArray, k: int, leg: IntArray, quads: IntArray, q: int, v: int
) -> tuple[int, int]:
    """Append a star; as `fill_grid`."""
    centre = v
    spokes = v + 1
    total = 0
    for i in range(k):
        total += leg[i] - 1
    v = spokes + total
    own = spokes
    for i in range(k):
        # the rectangle at corner i lies between side i, side i - 1 and the legs i and i - 1
        m, n = leg[(i + k - 1) % k], leg[i]
        before = own - (m - 1) if i > 0 else spokes + total - (m - 1)
        for a in range(m):
            for b in range(n):
                for c in range(4):
                    x, y = a + (1 if c == 1 or c == 2 else 0), b + (1 if c >= 2 else 0)
                    if y == 0:
                        quads[q, c] = loop[(corner[i] + x) % count]
                    elif x == 0:
                        quads[q, c] = loop[(corner[i] - y) % count]
                    elif x == m and y == n:
                        quads[q, c] = centre
                    elif x == m:
                        quads[q, c] = own + y - 1
                    elif y == n:
                        quads[q, c] = before + x - 1
                    else:
                        quads[q, c] = v + (x - 1) * (n - 1) + y - 1
                q += 1
        v += (m - 1) * (n - 1)
        own += n - 1
    return q, v


@kernel
def fill(count: int, corner: IntArray, k: int, row: IntArray, quads: IntArray) -> tuple[int, int]:
    """Write the quads of a pattern, a row of `patterns`; how many quads and how many vertices there are.

    The loop's vertices are 0 to count - 1, new ones follow.
    """
    loop = np.arange(count)
    side = np.empty(MOST_SIDES + 2, dtype=np.int64)
    leg = np.empty(MOST_SIDES + 2, dtype=np.int64)
    for i in range(k):
        side[i] = (corner[i + 1] if i + 1 < k else count) - corner[i]
    if row[0] == GRID:
        return fill_grid(loop, count, corner, quads, np.int64(0), np.int64(count))
    if row[0] == STAR:
        star_legs(side, k, leg)
        return fill_star(loop, count, corner, k, leg, quads, np.int64(0), np.int64(count))
    q, v = np.int64(0), np.int64(count)
    path = row[5]
    own = np.empty(count + path + 1, dtype=np.int64)
    own_corner = np.empty(MOST_SIDES + 2, dtype=np.int64)
    inner_path = v
    v += path - 1
    for part in range(2):
        i, a, j, b = (row[1], row[2], row[3], row[4]) if part == 0 else (row[3], row[4], row[1], row[2])
        first = (j - i) % k
        start, stop = corner[i] + a, corner[j] + b
        if stop <= start:
            stop += count
        n = stop - start
        for x in range(n + 1):
            own[x] = loop[(start + x) % count]
        for x in range(path - 1):  # the path runs from the point on row[1] to the one on row[3]
            own[n + 1 + x] = inner_path + (path - 2 - x if part == 0 else x)
        own_corner[0] = 0
        for x in range(first):
            own_corner[1 + x] = (corner[(i + 1 + x) % k] - start) % count
        own_corner[first + 1] = n
        sides = first + 2
        size = n + path
        for x in range(sides):
            side[x] = (own_corner[x + 1] if x + 1 < sides else size) - own_corner[x]
        star_legs(side, sides, leg)
        q, v = fill_star(own, size, own_corner, sides, leg, quads, q, v)
    return q, v
