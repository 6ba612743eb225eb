"""Mesh–mesh intersection against trueform: two tori in generic pose, arrays in, curves out, trees included.

    pytest benchmarks/bench_mesh_mesh.py --benchmark-disable-gc -s --benchmark-columns=min,median,rounds

The ratio printed is of CPU time, best of five in one run; trueform is also timed with its trees already built. Growth:
linear in the triangles (a sieve over cells), and n log n in those near the curves.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from patchwright.models.triangulation import Triangulation
from patchwright.ssi.mesh_mesh import as_intersection, mesh_intersection

SIZES = {"2e5": (447, 224), "1e6": (1000, 500)}
LIMIT = 2.5
best: dict[tuple[str, str], float] = {}


def torus(n: int, m: int, seed: int, shift: tuple[float, float, float]) -> Triangulation:
    """2 n m triangles of a torus in a random pose."""
    u, v = np.meshgrid(np.arange(n) * (2 * np.pi / n), np.arange(m) * (2 * np.pi / m), indexing="ij")
    r = 2.0 + 0.7 * np.cos(v)
    points = np.stack([r * np.cos(u), r * np.sin(u), 0.7 * np.sin(v)], axis=-1).reshape(-1, 3)
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    i, j = (x.reshape(-1) for x in np.meshgrid(np.arange(n), np.arange(m), indexing="ij"))
    a, b = i * m + j, (i + 1) % n * m + j
    c, d = (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m
    rows = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return Triangulation(points @ turn.T + shift, rows)


@pytest.fixture(scope="module", params=list(SIZES))
def tori(request: Any) -> tuple[str, Triangulation, Triangulation]:
    n, m = SIZES[request.param]
    return request.param, torus(n, m, 1, (0, 0, 0)), torus(n, m, 2, (1.1, 0.3, 0.2))


def measure(benchmark: Any, group: str, name: str, work: Callable[[], Any]) -> Any:
    benchmark.group = group
    work()  # compile, touch memory
    shortest = np.inf
    for _ in range(5):
        start = time.process_time()
        work()
        shortest = min(shortest, time.process_time() - start)
    best[group, name] = shortest
    if name != "patchwright" and (group, "patchwright") in best:
        ratio = best[group, "patchwright"] / shortest
        print(f"\n{group}: {best[group, 'patchwright']:.3f} s of CPU, {ratio:.2f} times {name} (at most {LIMIT})")
    return benchmark.pedantic(work, rounds=3, iterations=1)


def test_patchwright(benchmark: Any, tori: tuple[str, Triangulation, Triangulation]) -> None:
    size, a, b = tori
    first = mesh_intersection(a, b)
    found = measure(benchmark, size, "patchwright", lambda: mesh_intersection(a, b))
    assert len(as_intersection(found).curves) == 2
    assert np.array_equal(first.points, found.points)


def test_trueform(benchmark: Any, tori: tuple[str, Triangulation, Triangulation]) -> None:
    trueform = pytest.importorskip("trueform")
    size, a, b = tori

    def intersect() -> Any:
        bodies = [trueform.Mesh(mesh.triangles.copy(), mesh.vertices.copy()) for mesh in (a, b)]
        return trueform.intersection_curves(*bodies)

    paths, points = measure(benchmark, size, "trueform", intersect)
    found = mesh_intersection(a, b)
    # both have every curve's first point twice
    assert len(points) == len(found.segments)
    length = sum(np.linalg.norm(np.diff(points[np.asarray(p)], axis=0), axis=1).sum() for p in paths)
    own = as_intersection(found).length
    # whether a loop's last segment is listed is the peer's choice
    assert abs(own - length) < 2.0 * own / len(points) * len(paths)


def test_trueform_with_trees_there(benchmark: Any, tori: tuple[str, Triangulation, Triangulation]) -> None:
    trueform = pytest.importorskip("trueform")
    size, a, b = tori
    bodies = [trueform.Mesh(mesh.triangles.copy(), mesh.vertices.copy()) for mesh in (a, b)]
    measure(benchmark, size, "trueform with its trees built", lambda: trueform.intersection_curves(*bodies))
