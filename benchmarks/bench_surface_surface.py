"""Surface–surface intersection against OCCT's `GeomAPI_IntSS`: bicubic height fields that cross in 1 to 98 loops.

    pytest benchmarks/bench_surface_surface.py --benchmark-disable-gc -s --benchmark-columns=min,median,rounds

Both are timed in turn in one process, warm, by CPU time; the ratio of the medians of five counts where OCCT finds the
whole length and is not lost otherwise (as measured: it returns part of the loops without a warning). Its tolerance is
1e-7, ours 1e-10 of the size with the proof that nothing is missed. Residuals are those of 2000 points a curve against
both height fields. Growth: linear in the loops.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from patchwright.models import NurbsSurface
from patchwright.models.knots import greville, uniform_knots
from patchwright.ssi import Intersection, intersect

LOOPS = {1: 1, 2: 2, 4: 8, 5: 13, 7: 25, 10: 50, 14: 98}  # half waves a side: loops
LIMITS = {1: 1.0, 2: 1.0}  # our time over theirs; from 8 loops on:
LIMIT = 0.5
ROUNDS = 5
PER_CURVE = 2000


def height_field(f: Callable[[np.ndarray, np.ndarray], np.ndarray], spans: int) -> NurbsSurface:
    """z = f(x, y) over the unit square, interpolated by a bicubic spline with u = x and v = y."""
    from scipy.interpolate import BSpline

    U = uniform_knots(3, spans + 3)
    u = greville(3, U)
    rows = BSpline.design_matrix(u, U, 3).toarray()
    x, y = np.meshgrid(u, u, indexing="ij")
    z = np.linalg.solve(rows, np.linalg.solve(rows, f(x, y)).T).T
    return NurbsSurface((3, 3), (U, U), np.stack((x, y, z), axis=-1))


def pair(k: int) -> tuple[NurbsSurface, NurbsSurface]:
    """Waves with k half waves a side, 4 spans each, and a gently bent sheet through them."""
    waves = height_field(lambda x, y: 0.1 * np.sin(np.pi * k * x) * np.sin(np.pi * k * y), 4 * k)
    return waves, height_field(lambda x, y: 0.03 + 0.02 * np.sin(3.0 * x + y), 3)


def occt(a: NurbsSurface, b: NurbsSurface) -> Callable[[], Any]:
    """The call to time."""
    pytest.importorskip("OCP")
    from OCP.GeomAPI import GeomAPI_IntSS

    from patchwright.models.cad.convert_surface import surface_to_kernel

    one, other = surface_to_kernel(a)[0], surface_to_kernel(b)[0]
    return lambda: GeomAPI_IntSS(one, other, 1e-7)


def occt_points(found: Any) -> list[np.ndarray]:
    """(PER_CURVE, 3) points of each of its curves."""
    out = []
    for i in range(1, found.NbLines() + 1):
        line = found.Line(i)
        t = np.linspace(line.FirstParameter(), line.LastParameter(), PER_CURVE)
        out.append(np.array([[p.X(), p.Y(), p.Z()] for p in (line.Value(float(x)) for x in t)]))
    return out


def own_points(found: Intersection) -> list[np.ndarray]:
    return [c.curve(np.linspace(*c.curve.domain, PER_CURVE)) for c in found.curves]


def length(curves: list[np.ndarray]) -> float:
    return float(sum(np.linalg.norm(np.diff(p, axis=0), axis=1).sum() for p in curves))


def residual(curves: list[np.ndarray], fields: tuple[NurbsSurface, NurbsSurface]) -> float:
    """Largest height above or below either field."""
    p = np.concatenate(curves)
    x, y = np.clip(p[:, :2], 0.0, 1.0).T
    return float(max(np.abs(field(x, y)[:, 2] - p[:, 2]).max() for field in fields))


def cpu(work: Callable[[], Any]) -> float:
    start = time.process_time()
    work()
    return time.process_time() - start


def compared(k: int) -> tuple[float, float, str]:
    """Both medians and a line that tells what was found."""
    fields = pair(k)
    theirs, ours = occt(*fields), lambda: intersect(*fields)
    found, other = ours(), theirs()
    assert found.complete
    assert len(found.curves) == LOOPS[k]
    times = [(cpu(ours), cpu(theirs)) for _ in range(ROUNDS)]
    own, peer = (statistics.median(t) for t in zip(*times, strict=True))
    mine, his = own_points(found), occt_points(other)
    share = length(his) / length(mine) if his else 0.0
    missed = "" if abs(share - 1.0) < 1e-4 else f"  OCCT finds {share:.1%} of the length"
    far = residual(his, fields) if his else np.nan
    line = (
        f"{LOOPS[k]:3d} loops: {own:.3f} s, OCCT {peer:.3f} s, ratio {own / peer:.2f}; "
        f"residual {residual(mine, fields):.1e}, OCCT {far:.1e}{missed}"
    )
    return own, peer, line


@pytest.mark.parametrize("k", LOOPS)
def test_loops(benchmark: Any, k: int) -> None:
    own, peer, line = compared(k)
    print(f"\n{line} (at most {LIMITS.get(k, LIMIT)})")
    fields = pair(k)
    benchmark.group = f"{LOOPS[k]} loops"
    benchmark.pedantic(lambda: intersect(*fields), rounds=3, iterations=1)
    benchmark.extra_info["ratio to OCCT"] = own / peer


if __name__ == "__main__":
    for k in LOOPS:
        print(compared(k)[2], flush=True)
