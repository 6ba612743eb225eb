"""NURBS evaluation beside scipy's NdBSpline, splinepy, splipy, OCP, a dense matrix product and a plain C loop; run:
pytest benchmarks/bench_evaluation.py --benchmark-only. Peers that are not installed are skipped.

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
ORDERS = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]


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


@pytest.mark.parametrize("nu", [(0, 0), (1, 0), (2, 0)])
@pytest.mark.benchmark(group="scattered 1e4, one call a point")
def test_scattered_occ(benchmark, surface, uv, nu):
    """A call gives all derivatives up to the order; a point takes a call, whose cost is mostly that of Python."""
    from OCP.gp import gp_Pnt, gp_Vec

    shape = occ(surface)
    few = uv[:, :10_000].T.tolist()
    point, vectors = gp_Pnt(), [gp_Vec() for _ in range(5)]
    calls = {
        (0, 0): lambda u, v: shape.D0(u, v, point),
        (1, 0): lambda u, v: shape.D1(u, v, point, *vectors[:2]),
        (2, 0): lambda u, v: shape.D2(u, v, point, *vectors),
    }
    found = {(0, 0): point, (1, 0): vectors[0], (2, 0): vectors[2]}[nu]
    try:
        calls[nu](*few[0])
    except TypeError:
        pytest.skip("this release of OCP returns derivatives another way")

    def run():
        for u, v in few:
            calls[nu](u, v)

    benchmark.pedantic(run, rounds=2)
    want = surface(*few[-1], nu)
    np.testing.assert_allclose([found.X(), found.Y(), found.Z()], want, atol=1e-11 * max(1.0, np.abs(want).max()))


@pytest.mark.parametrize("nu", ORDERS)
@pytest.mark.benchmark(group="scattered 1e6")
def test_scattered_splinepy(benchmark, surface, uv, nu):
    splinepy = pytest.importorskip("splinepy")
    spline = splinepy.NURBS(
        degrees=[3, 3],
        knot_vectors=list(surface.knots),
        control_points=surface.control_points.swapaxes(0, 1).reshape(-1, 3),  # the first parameter runs fastest
        weights=surface.weights.T.reshape(-1, 1),
    )
    at = np.ascontiguousarray(np.stack(uv, axis=-1))
    run = (lambda: spline.evaluate(at)) if nu == (0, 0) else (lambda: spline.derivative(at, list(nu)))
    want = benchmark.pedantic(run, rounds=2)
    np.testing.assert_allclose(surface(*uv, nu), want, rtol=1e-7, atol=1e-8 * np.abs(want).max())


def splipy_surface(surface):
    splipy = pytest.importorskip("splipy")
    bases = [splipy.BSplineBasis(4, U) for U in surface.knots]
    net = surface.homogeneous.transpose(1, 0, 2).reshape(-1, 4)
    return splipy.Surface(*bases, net, rational=True)


@pytest.mark.parametrize("nu", ORDERS)
@pytest.mark.benchmark(group="scattered 1e6")
def test_scattered_splipy(benchmark, surface, uv, nu):
    shape = splipy_surface(surface)
    run = (lambda: shape(*uv, tensor=False)) if nu == (0, 0) else (lambda: shape.derivative(*uv, d=nu, tensor=False))
    want = benchmark.pedantic(run, rounds=1)
    np.testing.assert_allclose(surface(*uv, nu), want, rtol=1e-6, atol=1e-6 * np.abs(want).max())


C_LOOP = r"""
static int span(const double *U, int p, int n, double u) {
    int low = p, high = n;
    if (u >= U[n]) { for (low = n - 1; U[low] == U[low + 1]; low--) {} return low; }
    while (high - low > 1) { int half = (low + high) / 2; if (U[half] <= u) low = half; else high = half; }
    return low;
}
static void basis(const double *U, int i, double u, double *N) {
    double left[4], right[4];
    N[0] = 1.0;
    for (int j = 1; j <= 3; j++) {
        left[j] = u - U[i + 1 - j]; right[j] = U[i + j] - u;
        double saved = 0.0;
        for (int r = 0; r < j; r++) {
            double t = N[r] / (right[r + 1] + left[j - r]);
            N[r] = saved + right[r + 1] * t; saved = left[j - r] * t;
        }
        N[j] = saved;
    }
}
void points(const double *U, const double *V, const double *net, int n, int m,
            const double *u, const double *v, long count, double *out) {
    for (long k = 0; k < count; k++) {
        int i = span(U, 3, n, u[k]), j = span(V, 3, m, v[k]);
        double a[4], b[4], s[4] = {0, 0, 0, 0};
        basis(U, i, u[k], a); basis(V, j, v[k], b);
        for (int r = 0; r < 4; r++) for (int q = 0; q < 4; q++) {
            const double *P = net + ((i - 3 + r) * m + j - 3 + q) * 4; double w = a[r] * b[q];
            for (int x = 0; x < 4; x++) s[x] += w * P[x];
        }
        for (int x = 0; x < 3; x++) out[3 * k + x] = s[x] / s[3];
    }
}
"""


@pytest.mark.benchmark(group="scattered 1e6")
def test_scattered_c_loop(benchmark, surface, uv, tmp_path):
    """The textbook algorithms (A2.1, A2.2, A4.3) in plain C, gcc -O3 -march=native, on one thread."""
    import ctypes
    import shutil
    import subprocess

    compiler = shutil.which("gcc")
    if compiler is None:
        pytest.skip("no C compiler")
    source, library = tmp_path / "points.c", tmp_path / "points.so"
    source.write_text(C_LOOP)
    flags = ["-O3", "-march=native", "-shared", "-fPIC", "-o", str(library)]
    subprocess.run([compiler, *flags, str(source)], check=True)
    points = ctypes.CDLL(str(library)).points
    number, whole = ctypes.POINTER(ctypes.c_double), ctypes.c_int
    points.argtypes = [number, number, number, whole, whole, number, number, ctypes.c_long, number]
    points.restype = None
    u, v = (np.ascontiguousarray(x) for x in uv)
    out = np.empty((COUNT, 3))
    address = lambda x: x.ctypes.data_as(number)  # noqa: E731
    arguments = (*map(address, (*surface.knots, surface.homogeneous)), 20, 20, address(u), address(v), COUNT)
    benchmark.pedantic(lambda: points(*arguments, address(out)), rounds=3, warmup_rounds=1)
    np.testing.assert_allclose(surface(u, v), out, rtol=1e-9, atol=1e-11)


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


@pytest.mark.parametrize("nu", ORDERS)
@pytest.mark.benchmark(group="grid 1000 x 1000")
def test_grid_scipy(benchmark, surface, nu):
    from scipy.interpolate import NdBSpline

    spline = NdBSpline(surface.knots, surface.homogeneous, 3)
    t = np.linspace(0, 1, SIDE)
    at = np.stack(np.meshgrid(t, t, indexing="ij"), axis=-1)

    def run():
        orders = product(range(nu[0] + 1), range(nu[1] + 1))
        return quotient({o: spline(at, nu=o) for o in orders}, nu)

    want = benchmark.pedantic(run, rounds=2)
    np.testing.assert_allclose(surface.grid(t, t, nu), want, rtol=1e-7, atol=1e-8 * np.abs(want).max())


@pytest.mark.parametrize("nu", ORDERS)
@pytest.mark.benchmark(group="grid 1000 x 1000")
def test_grid_splipy(benchmark, surface, nu):
    shape = splipy_surface(surface)
    t = np.linspace(0, 1, SIDE)
    run = (lambda: shape(t, t)) if nu == (0, 0) else (lambda: shape.derivative(t, t, d=nu))
    want = benchmark.pedantic(run, rounds=1)
    np.testing.assert_allclose(surface.grid(t, t, nu), want, rtol=1e-6, atol=1e-6 * np.abs(want).max())
