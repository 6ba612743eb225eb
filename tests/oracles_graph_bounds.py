"""Bounds of a graph's second and third derivatives beside derivatives at random places of it.

The functions under test are called by kernels only; run as a script with NUMBA_DISABLE_JIT=1 they are plain Python.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.ssi._graph_kernel import foot, graph_bounds, third_graph_bounds

EYE, ZERO = np.eye(3), np.zeros(3)
STEP = 1e-3


def net_of(rng: np.random.Generator, degree: tuple[int, int], rational: bool, size: float) -> Array:
    """A net near the graph of a smooth function over a square of a size, with skewed, bent parameters."""
    u, v = (np.arange(d + 1) / d for d in degree)
    x, y = (size * g for g in np.meshgrid(u, v, indexing="ij"))
    bent = 0.1 * np.sin(3.0 * x + 2.0 * y)
    points = np.stack((x + 0.2 * y + bent, y - 0.1 * x - bent, 0.3 * x - 0.2 * y + np.sin(2.0 * x - 3.0 * y)), axis=-1)
    points += size**3 * rng.uniform(-0.05, 0.05, points.shape)
    w = 1.0 + rational * (0.2 * np.sin(2.0 * x + y) + size**3 * rng.uniform(-0.05, 0.05, x.shape))
    return np.concatenate((points * w[..., None], w[..., None]), axis=-1)


def bounds(net: Array, rational: bool) -> tuple[Array, Array] | None:
    """(3, 2) and (4, 2) the intervals of second and third derivatives, None where it is no graph."""
    D, S, G, K = np.empty((9, 4, 2)), np.empty((3, 2)), np.empty((9, 3, 2)), np.empty((2, 2))
    E, H, T = np.empty((6, 2)), np.empty((3, 2)), np.empty((4, 2))
    if not graph_bounds(net, rational, D, S, G, K, E, H):
        return None
    third_graph_bounds(net, rational, D, S, G, K, E, H, T)
    return H, T


def second(net: Array, x: float, y: float, w: Array) -> Array:
    """(3,) z_xx, z_xy, z_yy at (x, y), the parameters found from w."""
    most = max(net.shape) + 1
    g = np.empty(6)
    everywhere = np.array([-1.0, 2.0, -1.0, 2.0])
    scratch = (np.empty((3, most)), np.empty((3, most)), np.empty((6, 4)), np.empty((6, 3)))
    assert foot(net, w.copy(), 0, x, y, EYE, ZERO, everywhere, *scratch, g)
    return g[3:]


def derivatives(net: Array, uv: Array, size: float) -> tuple[Array, Array]:
    """(3,) the second and (4,) the third derivatives at parameters, these by central differences."""
    p, q = net.shape[0] - 1, net.shape[1] - 1
    bu = np.array(
        [np.prod([(p - k) / (k + 1) for k in range(i)]) * uv[0] ** i * (1 - uv[0]) ** (p - i) for i in range(p + 1)]
    )
    bv = np.array(
        [np.prod([(q - k) / (k + 1) for k in range(i)]) * uv[1] ** i * (1 - uv[1]) ** (q - i) for i in range(q + 1)]
    )
    h = np.einsum("i,j,ijc->c", bu, bv, net)
    x, y = h[:2] / h[3]
    d = STEP * size
    along = (second(net, x + d, y, uv) - second(net, x - d, y, uv)) / (2.0 * d)
    across = (second(net, x, y + d, uv) - second(net, x, y - d, uv)) / (2.0 * d)
    return second(net, x, y, uv), np.array([*along, across[2]])


def checked(degree: tuple[int, int], rational: bool) -> None:
    """Bounds hold at random places, and narrow in proportion to the size of the patch."""
    widths = []
    for size in (0.1, 0.05, 0.025):
        rng = np.random.default_rng(7)
        net = net_of(rng, degree, rational, size)
        found = bounds(net, rational)
        assert found is not None
        for uv in rng.uniform(0.05, 0.95, (20, 2)):
            for interval, value, slack in zip(found, derivatives(net, uv, size), (1e-8, 1e-3), strict=True):
                assert (value >= interval[:, 0] - slack).all(), (value, interval)
                assert (value <= interval[:, 1] + slack).all(), (value, interval)
        widths.append(float(np.diff(found[0], axis=1).max()))
    assert widths[0] / widths[1] > 1.6, widths
    assert widths[1] / widths[2] > 1.6, widths


if __name__ == "__main__":
    for degree in ((3, 3), (2, 2), (4, 1)):
        for rational in (False, True):
            checked(degree, rational)
