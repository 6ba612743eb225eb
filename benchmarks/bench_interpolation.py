"""Quadratic interpolation by maxima beside the C2 cubic; run: pytest benchmarks/bench_interpolation.py
--benchmark-only. n = 12 is the paper's first case; 1000 and 8000 show that a step costs O(n)."""

from __future__ import annotations

import numpy as np
import pytest

from patchwright.models.interpolation import interpolate
from patchwright.models.interpolation.maxima_knots import maxima_knots

pytest.importorskip("pytest_benchmark")


@pytest.fixture(params=[12, 1000, 8000])
def points(request):
    return np.random.default_rng(4).normal(size=(request.param + 1, 2))


@pytest.mark.parametrize("scheme", ["quadratic-maxima", "c2-cubic-clamped", "catmull-rom", "pchip"])
@pytest.mark.benchmark(group="interpolation", warmup=True, warmup_iterations=1)
def test_interpolate(benchmark, points, scheme):
    benchmark.extra_info["n"] = len(points) - 1
    benchmark.pedantic(interpolate, (points, scheme), rounds=3, warmup_rounds=1)


@pytest.mark.benchmark(group="knots by maxima")
def test_knots(benchmark, points):
    sites = np.cumsum(np.random.default_rng(5).uniform(0.5, 1.0, len(points)))
    found = benchmark.pedantic(maxima_knots, (sites,), rounds=3, warmup_rounds=1)
    benchmark.extra_info["n"] = len(points) - 1
    benchmark.extra_info["microseconds per step and site"] = (
        1e6 * benchmark.stats.stats.min / (found.steps * len(sites))
    )
