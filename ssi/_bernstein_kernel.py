"""Kernels on Bernstein polynomials over a unit square: values, ranges of derivatives, roots, and Bezier nets halved."""
# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import math

from patchwright.models._compile_kernel import inner
from patchwright.models.arrays import Array


@inner
def values(net: Array, plane: Array, flip: int, out: Array) -> None:
    """Bernstein coefficients of the plane's equation over a net, times the weight; `flip` 1 exchanges u and v."""
    for i in range(net.shape[0]):
        for j in range(net.shape[1]):
            c = plane[0] * net[i, j, 0] + plane[1] * net[i, j, 1] + plane[2] * net[i, j, 2] + plane[3] * net[i, j, 3]
            if flip == 1:
                out[j, i] = c
            else:
                out[i, j] = c


@inner
def slopes(c: Array, axis: int, out: Array) -> None:
    """Least and largest coefficient of the derivative along an axis."""
    n = c.shape[0]
    m = c.shape[1]
    low = math.inf
    high = -math.inf
    if axis == 0:
        for i in range(n - 1):
            for j in range(m):
                d = (n - 1) * (c[i + 1, j] - c[i, j])
                low = min(low, d)
                high = max(high, d)
    else:
        for i in range(n):
            for j in range(m - 1):
                d = (m - 1) * (c[i, j + 1] - c[i, j])
                low = min(low, d)
                high = max(high, d)
    out[0] = low
    out[1] = high


@inner
def steepness(g: Array, eps: float) -> float:
    """Least slope over the largest where both have one sign, but for round-off; 0 where not."""
    low = g[0]
    high = g[1]
    if low >= -eps and high > 4.0 * eps:
        return max(low, eps) / high
    if high <= eps and low < -4.0 * eps:
        return min(high, -eps) / low
    return 0.0


@inner
def product(a: float, b: float, c: float, d: float, out: Array) -> None:
    """Ends of the interval [a, b] times [c, d]."""
    out[0] = min(min(a * c, a * d), min(b * c, b * d))
    out[1] = max(max(a * c, a * d), max(b * c, b * d))


@inner
def bends(c: Array, out: Array) -> None:
    """Ranges of the second derivatives: uu, uv, vv."""
    n = c.shape[0]
    m = c.shape[1]
    for k in range(3):
        out[2 * k] = math.inf
        out[2 * k + 1] = -math.inf
    for i in range(n):
        for j in range(m):
            if i < n - 2:
                d = (n - 1) * (n - 2) * (c[i + 2, j] - 2.0 * c[i + 1, j] + c[i, j])
                out[0] = min(out[0], d)
                out[1] = max(out[1], d)
            if i < n - 1 and j < m - 1:
                d = (n - 1) * (m - 1) * (c[i + 1, j + 1] - c[i + 1, j] - c[i, j + 1] + c[i, j])
                out[2] = min(out[2], d)
                out[3] = max(out[3], d)
            if j < m - 2:
                d = (m - 1) * (m - 2) * (c[i, j + 2] - 2.0 * c[i, j + 1] + c[i, j])
                out[4] = min(out[4], d)
                out[5] = max(out[5], d)


@inner
def basis(count: int, t: float, b: Array) -> None:
    """Bernstein polynomials of degree count - 1 at t."""
    b[0] = 1.0
    for k in range(1, count):
        saved = 0.0
        for i in range(k):
            left = b[i]
            b[i] = saved + (1.0 - t) * left
            saved = t * left
        b[k] = saved


@inner
def along(c: Array, count: int, s: float, b: Array) -> float:
    """A polynomial of `count` coefficients at s."""
    basis(count, s, b)
    value = 0.0
    for i in range(count):
        value += b[i] * c[i]
    return value


@inner
def root(c: Array, count: int, b: Array) -> float:
    """Where a polynomial that changes sign once on [0, 1] does: regula falsi kept within a bracket, and bisection."""
    low = 0.0
    high = 1.0
    f = c[0]
    g = c[count - 1]
    if f == 0.0:
        return 0.0
    if g == 0.0:
        return 1.0
    side = 0
    for step in range(100):
        t = (low * g - high * f) / (g - f)
        if step % 4 == 3 or not low < t < high:
            t = 0.5 * (low + high)
            side = 0
        if t <= low or t >= high:
            break
        value = along(c, count, t, b)
        if value == 0.0:
            return t
        if (value > 0.0) == (g > 0.0):
            high = t
            g = value
            if side == 1:
                f *= 0.5
            side = 1
        else:
            low = t
            f = value
            if side == -1:
                g *= 0.5
            side = -1
        if high - low < 1e-16:
            break
    return 0.5 * (low + high)


@inner
def at(C: Array, t: float, s: float, line: Array, b: Array) -> float:
    """A polynomial at (t, s)."""
    n = C.shape[0]
    m = C.shape[1]
    basis(n, t, b)
    for j in range(m):
        x = 0.0
        for i in range(n):
            x += b[i] * C[i, j]
        line[j] = x
    return along(line, m, s, b)


@inner
def local(C: Array, u: float, v: float, out: Array, b: Array, rows: Array) -> None:
    """Value, first and second derivatives (., u, v, uu, uv, vv) of a polynomial of degree 2 or more in both."""
    n = C.shape[0]
    m = C.shape[1]
    for r in range(3):
        basis(n - r, u, b)
        for j in range(m):
            x = 0.0
            for i in range(n - r):
                if r == 0:
                    c = C[i, j]
                elif r == 1:
                    c = (n - 1) * (C[i + 1, j] - C[i, j])
                else:
                    c = (n - 1) * (n - 2) * (C[i + 2, j] - 2.0 * C[i + 1, j] + C[i, j])
                x += b[i] * c
            rows[r, j] = x
    for k in range(6):
        r = 0 if k == 0 or k == 2 or k == 5 else (2 if k == 3 else 1)
        s = 2 if k == 5 else (1 if k == 2 or k == 4 else 0)
        basis(m - s, v, b)
        x = 0.0
        for j in range(m - s):
            if s == 0:
                c = rows[r, j]
            elif s == 1:
                c = (m - 1) * (rows[r, j + 1] - rows[r, j])
            else:
                c = (m - 1) * (m - 2) * (rows[r, j + 2] - 2.0 * rows[r, j + 1] + rows[r, j])
            x += b[j] * c
        out[k] = x


@inner
def place(net: Array, u: float, v: float, x: Array, b: Array, d: Array) -> None:
    """(x, y, z, weight) at (u, v)."""
    basis(net.shape[0], u, b)
    basis(net.shape[1], v, d)
    for c in range(4):
        x[c] = 0.0
    for i in range(net.shape[0]):
        for j in range(net.shape[1]):
            for c in range(4):
                x[c] += b[i] * d[j] * net[i, j, c]
    for c in range(3):
        x[c] /= x[3]


@inner
def reach(net: Array, axis: int) -> float:
    """Longest row of the net along an axis."""
    n = net.shape[0] if axis == 0 else net.shape[1]
    longest = 0.0
    for j in range(net.shape[0] + net.shape[1] - n):
        total = 0.0
        for i in range(n - 1):
            d = 0.0
            for c in range(3):
                if axis == 0:
                    x = net[i + 1, j, c] / net[i + 1, j, 3] - net[i, j, c] / net[i, j, 3]
                else:
                    x = net[j, i + 1, c] / net[j, i + 1, 3] - net[j, i, c] / net[j, i, 3]
                d += x * x
            total += math.sqrt(d)
        longest = max(longest, total)
    return longest


@inner
def copied(net: Array, out: Array) -> None:
    """`net` in `out`."""
    for i in range(net.shape[0]):
        for j in range(net.shape[1]):
            for c in range(4):
                out[i, j, c] = net[i, j, c]


@inner
def halve(net: Array, right: Array, axis: int) -> None:
    """De Casteljau at 1/2: `net` becomes the first half."""
    P = net.shape[0]
    Q = net.shape[1]
    copied(net, right)
    if axis == 0:
        for j in range(Q):
            for c in range(4):
                for r in range(1, P):
                    for i in range(P - r):
                        right[i, j, c] = 0.5 * (right[i, j, c] + right[i + 1, j, c])
                    net[r, j, c] = right[0, j, c]
    else:
        for i in range(P):
            for c in range(4):
                for r in range(1, Q):
                    for j in range(Q - r):
                        right[i, j, c] = 0.5 * (right[i, j, c] + right[i, j + 1, c])
                    net[i, r, c] = right[i, 0, c]
