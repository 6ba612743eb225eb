"""NURBS evaluation beside scipy's NdBSpline, OCP and a dense matrix product; run: pytest
benchmarks/bench_evaluation.py --benchmark-only.

The surface is the rational bicubic one of 20 x 20 control points. scipy evaluates the four homogeneous sums and
leaves the quotient to the caller, so that it needs (a + 1)(b + 1) calls for a derivative of order (a, b); that is
what is timed here.
"""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from patchwright.models import NurbsSurface
from patchwright.models.knots import uniform_knots

pytest.importorskip("pytest_benchmark")
COUNT = 1_000_000
SIDE = 1000
ORDERS = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1)]


@pytest.fixture(scope="module")
def surface() -> NurbsSurface:
    rng = np.random.default_rng(0)
    U = uniform_knots(3, 20)
    return NurbsSurface((3, 3), (U, U), rng.normal(size=(20, 20, 3)), rng.uniform(0.5, 2.0, (20, 20)))


@pytest.fixture(scope="module")
def uv():
    return np.random.default_rng(1).random((2, COUNT))


def quotient(sums, nu):
    """Derivative of the quotient of orders up to 2 in all, from homogeneous derivatives."""
    from math import comb

    out = {}
    for a, b in product(range(nu[0] + 1), range(nu[1] + 1)):
        value = sums[a, b][..., :3]
        for e, f in product(range(a + 1), range(b + 1)):
            if e + f:
                value = value - comb(a, e) * comb(b, f) * sums[e, f][..., 3:] * out[a - e, b - f]
        out[a, b] = value / sums[0, 0][..., 3:]
    return out[nu]


@pytest.mark.parametrize("nu", ORDERS)
@pytest.mark.benchmark(group="scattered 1e6", warmup=True, warmup_iterations=1)
def test_scattered_patchwright(benchmark, surface, uv, nu):
    benchmark.pedantic(surface, (*uv, nu), rounds=3, warmup_rounds=1)


@pytest.mark.parametrize("nu", ORDERS)
@pytest.mark.benchmark(group="scattered 1e6")
def test_scattered_scipy(benchmark, surface, uv, nu):
    from scipy.interpolate import NdBSpline

    spline = NdBSpline(surface.knots, surface.homogeneous, 3)
    at = np.stack(uv, axis=-1)

    def run():
        orders = product(range(nu[0] + 1), range(nu[1] + 1))
        return quotient({o: spline(at, nu=o) for o in orders}, nu)

    want = benchmark.pedantic(run, rounds=2)
    np.testing.assert_allclose(surface(*uv, nu), want, rtol=1e-7, atol=1e-8 * np.abs(want).max())


def occ(surface):
    """The same surface in the CAD kernel (OCP 8)."""
    collections = pytest.importorskip("OCP.collections")
    from OCP.Geom import Geom_BSplineSurface
    from OCP.gp import gp_Pnt

    n, m = surface.control_points.shape[:2]
    poles, weights = collections.Array2_gp_Pnt(1, n, 1, m), collections.Array2_double(1, n, 1, m)
    for i, j in product(range(n), range(m)):
        poles.SetValue(i + 1, j + 1, gp_Pnt(*map(float, surface.control_points[i, j])))
        weights.SetValue(i + 1, j + 1, float(surface.weights[i, j]))
    values, counts = np.unique(surface.knots[0], return_counts=True)
    knots, multiplicities = collections.Array1_double(1, len(values)), collections.Array1_int(1, len(values))
    for k, (x, c) in enumerate(zip(values, counts, strict=True), 1):
        knots.SetValue(k, float(x))
        multiplicities.SetValue(k, int(c))
    return Geom_BSplineSurface(poles, weights, knots, knots, multiplicities, multiplicities, 3, 3)


@pytest.mark.benchmark(group="scattered 1e4, one call a point")
def test_scattered_occ(benchmark, surface, uv):
    shape = occ(surface)
    few = uv[:, :10_000].T.tolist()
    got = benchmark.pedantic(lambda: [shape.Value(u, v) for u, v in few], rounds=2)
    last = got[-1]
    np.testing.assert_allclose(surface(*few[-1]), [last.X(), last.Y(), last.Z()], atol=1e-13)


@pytest.mark.parametrize("nu", ORDERS)
@pytest.mark.benchmark(group="grid 1000 x 1000")
def test_grid_patchwright(benchmark, surface, nu):
    t = np.linspace(0, 1, SIDE)
    benchmark.pedantic(surface.grid, (t, t, nu), rounds=3, warmup_rounds=1)


@pytest.mark.benchmark(group="grid 1000 x 1000")
def test_grid_dense_product(benchmark, surface):
    """scipy's design matrices as dense arrays and BLAS: what a careful numpy user writes."""
    from scipy.interpolate import BSpline

    t = np.linspace(0, 1, SIDE)

    def run():
        basis = BSpline.design_matrix(t, surface.knots[0], 3).toarray()
        sums = np.einsum("ki,ijx->kjx", basis, surface.homogeneous, optimize=True)
        total = np.matmul(basis, sums)
        return total[..., :3] / total[..., 3:]

    want = benchmark.pedantic(run, rounds=3, warmup_rounds=1)
    np.testing.assert_allclose(surface.grid(t, t), want, atol=1e-12)


@pytest.mark.benchmark(group="grid 1000 x 1000")
def test_grid_scipy(benchmark, surface):
    from scipy.interpolate import NdBSpline

    spline = NdBSpline(surface.knots, surface.homogeneous, 3)
    t = np.linspace(0, 1, SIDE)
    at = np.stack(np.meshgrid(t, t, indexing="ij"), axis=-1)

    def run():
        total = spline(at)
        return total[..., :3] / total[..., 3:]

    benchmark.pedantic(run, rounds=2)
