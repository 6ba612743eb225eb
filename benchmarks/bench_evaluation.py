"""NURBS evaluation beside scipy, splinepy, splipy, OCP and a plain C loop, in one run on one thread:

    python benchmarks/bench_evaluation.py [points]

The surface is the rational bicubic one of 20 x 20 control points; 1e6 scattered points and a grid of 1000 x 1000.
"points", "+ first" and "+ second" are S; S, S_u, S_v; and those with S_uu, S_uv, S_vv. Every row states process CPU
time, best of a few repeats, over that of the C loop; a * marks a peer that was given fewer points, its time scaled; nan
one that fails. Every answer is checked against ours. Peers that are not installed are left out.

C is the textbook algorithm (A2.1, A2.3, A4.4) by gcc -O3 -march=native, span by bisection; the grid's C does the basis
functions once for each line. scipy evaluates homogeneous sums, one call for each derivative, and the quotient is the
caller's, as here. "By hand" on grids are BSpline along one axis and then the other, and its basis functions as full
matrices with BLAS: what a careful numpy user would write. OCP takes a call for each point, so that its time is mostly
Python's. The last lines tell how many times ours the fastest time is.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from itertools import product
from pathlib import Path

import numpy as np

from patchwright.models import NurbsSurface
from patchwright.models.knots import uniform_knots

STAGES = ("points", "+ first", "+ second")
ORDERS = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]
WANTED = (ORDERS[:1], ORDERS[:3], ORDERS)
SIDE = 1000
FEW = 20_000
Work = Callable[[int], list[np.ndarray]]  # stage -> the derivatives of WANTED[stage], each (..., 3)

C_SOURCE = r"""
static int span(const double *U, int n, double u) {
    int low = 3, high = n;
    if (u >= U[n]) { for (low = n - 1; U[low] == U[low + 1]; low--) {} return low; }
    while (high - low > 1) { int half = (low + high) / 2; if (U[half] <= u) low = half; else high = half; }
    return low;
}
/* N[r][j] = derivative r of the four cubics of span i at u */
static void basis(const double *U, int i, double u, int order, double N[3][4]) {
    double b[4][4] = {{1.0}}, *L = b[1], *Q = b[2], *C = b[3];
    for (int p = 1; p <= 3; p++) {
        double saved = 0.0;
        for (int j = 0; j < p; j++) {
            double t = b[p - 1][j] / (U[i + 1 + j] - U[i + 1 + j - p]);
            b[p][j] = saved + (U[i + 1 + j] - u) * t;
            saved = (u - U[i + 1 + j - p]) * t;
        }
        b[p][p] = saved;
    }
    for (int j = 0; j < 4; j++) N[0][j] = C[j];
    if (order < 1) return;
    double d[3], e[2], s;
    for (int j = 0; j < 3; j++) d[j] = 3.0 / (U[i + 1 + j] - U[i - 2 + j]);
    s = 0.0;
    for (int j = 0; j < 3; j++) { N[1][j] = s - d[j] * Q[j]; s = d[j] * Q[j]; }
    N[1][3] = s;
    if (order < 2) return;
    for (int j = 0; j < 2; j++) e[j] = 2.0 / (U[i + 1 + j] - U[i - 1 + j]);
    double q[3] = {-e[0] * L[0], e[0] * L[0] - e[1] * L[1], e[1] * L[1]};
    s = 0.0;
    for (int j = 0; j < 3; j++) { N[2][j] = s - d[j] * q[j]; s = d[j] * q[j]; }
    N[2][3] = s;
}
static void quotient(double h[6][4], int order, double *out) {
    double w = 1.0 / h[0][3];
    for (int x = 0; x < 3; x++) {
        double S = h[0][x] * w, Su, Sv;
        out[x] = S;
        if (order < 1) continue;
        out[3 + x] = Su = (h[1][x] - h[1][3] * S) * w;
        out[6 + x] = Sv = (h[2][x] - h[2][3] * S) * w;
        if (order < 2) continue;
        out[9 + x] = (h[3][x] - 2.0 * h[1][3] * Su - h[3][3] * S) * w;
        out[12 + x] = (h[4][x] - h[1][3] * Sv - h[2][3] * Su - h[4][3] * S) * w;
        out[15 + x] = (h[5][x] - 2.0 * h[2][3] * Sv - h[5][3] * S) * w;
    }
}
static const int E[6] = {0, 1, 0, 2, 1, 0}, F[6] = {0, 0, 1, 0, 1, 2}, COUNT[3] = {1, 3, 6};
static inline void scatter(const double *U, const double *V, const double *net, int n, int m, const double *u,
                           const double *v, long count, const int order, double *out) {
    for (long k = 0; k < count; k++) {
        int i = span(U, n, u[k]), j = span(V, m, v[k]);
        double a[3][4], b[3][4], h[6][4] = {{0}};
        basis(U, i, u[k], order, a); basis(V, j, v[k], order, b);
        for (int r = 0; r < 4; r++) {
            double t[3][4] = {{0}};
            for (int s = 0; s < 4; s++) {
                const double *P = net + ((i - 3 + r) * m + j - 3 + s) * 4;
                for (int f = 0; f <= order; f++) for (int x = 0; x < 4; x++) t[f][x] += b[f][s] * P[x];
            }
            for (int c = 0; c < COUNT[order]; c++) for (int x = 0; x < 4; x++) h[c][x] += a[E[c]][r] * t[F[c]][x];
        }
        quotient(h, order, out + 3 * COUNT[order] * k);
    }
}
void scattered(const double *U, const double *V, const double *net, int n, int m, const double *u, const double *v,
               long count, int order, double *out) {
    if (order == 0) scatter(U, V, net, n, m, u, v, count, 0, out);
    else if (order == 1) scatter(U, V, net, n, m, u, v, count, 1, out);
    else scatter(U, V, net, n, m, u, v, count, 2, out);
}
void grid(const double *U, const double *V, const double *net, int n, int m, const double *u, const double *v,
          long k, long l, int order, double *room, int *spans, double *rows, double *out) {
    for (long j = 0; j < l; j++) {
        spans[j] = span(V, m, v[j]); basis(V, spans[j], v[j], order, (double (*)[4])(rows + 12 * j));
    }
    for (long i = 0; i < k; i++) {
        int s = span(U, n, u[i]); double a[3][4]; basis(U, s, u[i], order, a);
        for (int e = 0; e <= order; e++) for (int c = 0; c < 4 * m; c++) {
            double t = 0.0;
            for (int r = 0; r < 4; r++) t += a[e][r] * net[(s - 3 + r) * 4 * m + c];
            room[e * 4 * m + c] = t;
        }
        for (long j = 0; j < l; j++) {
            double h[6][4] = {{0}}; const double *b = rows + 12 * j;
            for (int c = 0; c < COUNT[order]; c++) for (int q = 0; q < 4; q++) for (int x = 0; x < 4; x++)
                h[c][x] += b[4 * F[c] + q] * room[E[c] * 4 * m + 4 * (spans[j] - 3 + q) + x];
            quotient(h, order, out + 3 * COUNT[order] * (i * l + j));
        }
    }
}
"""


def sample_surface() -> NurbsSurface:
    rng = np.random.default_rng(0)
    U = uniform_knots(3, 20)
    return NurbsSurface((3, 3), (U, U), rng.normal(size=(20, 20, 3)), rng.uniform(0.5, 2.0, (20, 20)))


def quotients(sums: dict[tuple[int, int], np.ndarray]) -> list[np.ndarray]:
    """Derivatives of the quotient from homogeneous ones, in the order of ORDERS."""
    w = {nu: h[..., 3:] for nu, h in sums.items()}
    out = {(0, 0): sums[0, 0][..., :3] / w[0, 0]}
    for nu in list(sums)[1:]:
        value = sums[nu][..., :3].copy()
        for e, f in product(range(nu[0] + 1), range(nu[1] + 1)):
            if e + f:
                twice = 2.0 if max(nu) == 2 and e + f == 1 else 1.0
                value -= twice * w[e, f] * out[nu[0] - e, nu[1] - f]
        out[nu] = value / w[0, 0]
    return list(out.values())


def ours_scattered(S: NurbsSurface, u: np.ndarray, v: np.ndarray) -> Work:
    def work(stage: int) -> list[np.ndarray]:
        if stage == 0:
            return [S(u, v)]
        return list(np.moveaxis(S.jet(u, v, stage), -2, 0))

    return work


def scipy_scattered(S: NurbsSurface, u: np.ndarray, v: np.ndarray) -> Work:
    from scipy.interpolate import NdBSpline

    spline, at = NdBSpline(S.knots, S.homogeneous, 3), np.stack((u, v), axis=-1)
    return lambda stage: quotients({nu: spline(at, nu=nu) for nu in WANTED[stage]})


def splinepy_scattered(S: NurbsSurface, u: np.ndarray, v: np.ndarray) -> Work:
    import splinepy

    spline = splinepy.NURBS(
        degrees=[3, 3],
        knot_vectors=list(S.knots),
        control_points=S.control_points.swapaxes(0, 1).reshape(-1, 3),  # the first parameter runs fastest
        weights=S.weights.T.reshape(-1, 1),
    )
    at = np.ascontiguousarray(np.stack((u, v), axis=-1))
    return lambda stage: [spline.derivative(at, list(nu)) if any(nu) else spline.evaluate(at) for nu in WANTED[stage]]


def splipy_surface(S: NurbsSurface):
    import splipy

    bases = [splipy.BSplineBasis(4, U) for U in S.knots]
    return splipy.Surface(*bases, S.homogeneous.transpose(1, 0, 2).reshape(-1, 4), rational=True)


def splipy_scattered(S: NurbsSurface, u: np.ndarray, v: np.ndarray) -> Work:
    shape = splipy_surface(S)
    return lambda stage: [
        shape.derivative(u, v, d=nu, tensor=False) if any(nu) else shape(u, v, tensor=False) for nu in WANTED[stage]
    ]


def occ_scattered(S: NurbsSurface, u: np.ndarray, v: np.ndarray) -> Work:
    """One call for each point, which gives all derivatives up to the stage."""
    from OCP.gp import gp_Pnt, gp_Vec

    from patchwright.models.cad.convert_surface import surface_to_kernel

    shape, at = surface_to_kernel(S)[0], np.stack((u, v), axis=-1).tolist()
    point, vectors = gp_Pnt(), [gp_Vec() for _ in range(5)]
    d_u, d_v, d_uu, d_vv, d_uv = vectors
    order = (point, d_u, d_v, d_uu, d_uv, d_vv)

    def work(stage: int) -> list[np.ndarray]:
        call = (
            lambda a, b: shape.D0(a, b, point),
            lambda a, b: shape.D1(a, b, point, d_u, d_v),
            lambda a, b: shape.D2(a, b, point, d_u, d_v, d_uu, d_vv, d_uv),
        )[stage]
        out = np.empty((len(at), len(WANTED[stage]), 3))
        for k, (a, b) in enumerate(at):
            call(a, b)
            for c in range(len(WANTED[stage])):
                x = order[c]
                out[k, c] = x.X(), x.Y(), x.Z()
        return list(out.swapaxes(0, 1))

    return work


def c_library(folder: Path) -> ctypes.CDLL:
    compiler = shutil.which("gcc")
    if compiler is None:
        raise ImportError("no C compiler")
    source, library = folder / "surface.c", folder / "surface.so"
    source.write_text(C_SOURCE)
    flags = ["-O3", "-march=native", "-shared", "-fPIC", "-o", str(library)]
    subprocess.run([compiler, *flags, str(source)], check=True)
    return ctypes.CDLL(str(library))


def address(x: np.ndarray) -> ctypes.c_void_p:
    return ctypes.c_void_p(x.ctypes.data)


def c_scattered(S: NurbsSurface, u: np.ndarray, v: np.ndarray, folder: Path) -> Work:
    function, (U, V), net = c_library(folder).scattered, S.knots, S.homogeneous

    def work(stage: int) -> list[np.ndarray]:
        out = np.empty((len(u), len(WANTED[stage]), 3))
        size = (ctypes.c_int(20), ctypes.c_int(20), address(u), address(v), ctypes.c_long(len(u)), ctypes.c_int(stage))
        function(address(U), address(V), address(net), *size, address(out))
        return list(out.swapaxes(0, 1))

    return work


def c_grid(S: NurbsSurface, u: np.ndarray, v: np.ndarray, folder: Path) -> Work:
    function, (U, V), net = c_library(folder).grid, S.knots, S.homogeneous
    spans, rows, room = np.empty(len(v), dtype=np.int32), np.empty((len(v), 12)), np.empty((3, 80))

    def work(stage: int) -> list[np.ndarray]:
        out = np.empty((len(u), len(v), len(WANTED[stage]), 3))
        size = (ctypes.c_int(20), ctypes.c_int(20), address(u), address(v), ctypes.c_long(len(u)))
        rest = (ctypes.c_long(len(v)), ctypes.c_int(stage), address(room), address(spans), address(rows), address(out))
        function(address(U), address(V), address(net), *size, *rest)
        return list(np.moveaxis(out, 2, 0))

    return work


def ours_grid(S: NurbsSurface, u: np.ndarray, v: np.ndarray) -> Work:
    def work(stage: int) -> list[np.ndarray]:
        if stage == 0:
            return [S.grid(u, v)]
        return list(np.moveaxis(S.grid_jet(u, v, stage), -2, 0))

    return work


def scipy_points_grid(S: NurbsSurface, u: np.ndarray, v: np.ndarray) -> Work:
    a, b = np.meshgrid(u, v, indexing="ij")
    return scipy_scattered(S, a, b)


def scipy_grid(S: NurbsSurface, u: np.ndarray, v: np.ndarray) -> Work:
    from scipy.interpolate import BSpline

    along_u = BSpline(S.knots[0], S.homogeneous, 3)

    def work(stage: int) -> list[np.ndarray]:
        lines = [BSpline(S.knots[1], along_u(u, e).swapaxes(0, 1).copy(), 3) for e in range(stage + 1)]
        return quotients({(e, f): lines[e](v, f).swapaxes(0, 1) for e, f in WANTED[stage]})

    return work


def dense_grid(S: NurbsSurface, u: np.ndarray, v: np.ndarray) -> Work:
    """scipy's basis functions as full matrices, and BLAS: what a careful numpy user writes."""
    from scipy.interpolate import BSpline

    def basis(U: np.ndarray, t: np.ndarray, order: int) -> np.ndarray:
        return np.asarray(BSpline(U, np.eye(len(U) - 4), 3)(t, order))

    def work(stage: int) -> list[np.ndarray]:
        a, b = ([basis(U, t, e) for e in range(stage + 1)] for U, t in zip(S.knots, (u, v), strict=True))
        lines = [np.tensordot(x, S.homogeneous, 1) for x in a]
        return quotients({(e, f): np.matmul(b[f], lines[e]) for e, f in WANTED[stage]})

    return work


def splipy_grid(S: NurbsSurface, u: np.ndarray, v: np.ndarray) -> Work:
    shape = splipy_surface(S)
    return lambda stage: [shape.derivative(u, v, d=nu) if any(nu) else shape(u, v) for nu in WANTED[stage]]


def splinepy_grid(S: NurbsSurface, u: np.ndarray, v: np.ndarray) -> Work:
    a, b = np.meshgrid(u, v, indexing="ij")
    work = splinepy_scattered(S, a.ravel(), b.ravel())
    return lambda stage: [x.reshape(len(u), len(v), 3) for x in work(stage)]


def cpu(work: Callable[[], object], least: float = 0.3, most: int = 5) -> float:
    """Seconds of process CPU time, the least of some repeats."""
    times: list[float] = []
    while len(times) < most and (len(times) < 2 or sum(times) < least):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


def table(title: str, ours: Work, peers: Iterator[tuple[str, Callable[[], Work], float]]) -> None:
    """Print the times, scaled, over those of the first peer, which is C; and how often ours the best other's is."""
    truth = [ours(stage) for stage in range(3)]  # compiled and warm from here
    times = {"patchwright": [cpu(lambda k=k: ours(k)) for k in range(3)]}
    for name, make, scale in peers:
        try:
            work = make()
        except ImportError as reason:
            print(f"({name} left out: {reason})")
            continue
        row = []
        for stage in range(3):
            try:
                found = work(stage)
            except IndexError:  # splipy's rational derivatives of second order
                row.append(np.nan)
                continue
            for nu, mine, theirs in zip(WANTED[stage], truth[stage], found, strict=True):
                mine = mine[: len(theirs), : theirs.shape[1]]
                worst = np.abs(mine - theirs).max() / np.abs(mine).max()
                assert worst < 1e-9, f"{name} disagrees in derivative {nu} by {worst:.1e}"
            row.append(scale * cpu(lambda k=stage, work=work: work(k), most=5 if scale == 1.0 else 2))
        times[name + ("" if scale == 1.0 else " *")] = row
    c = times.pop("C")
    print(f"\n{title}: over C, {', '.join(f'{1e3 * t:.1f} ms' for t in c)}")
    print(f"{'':<22}" + "".join(f"{s:>11}" for s in STAGES))
    for name, row in times.items():
        print(f"{name:<22}" + "".join(f"{t / b:>11.2f}" for t, b in zip(row, c, strict=True)))
    mine = np.array(times.pop("patchwright"))
    for label, rows in (
        ("best library over ours", [row for name, row in times.items() if "hand" not in name]),
        ("best by hand over ours", [row for name, row in times.items() if "hand" in name]),
    ):
        if rows:
            print(f"{label:<22}" + "".join(f"{t:>11.2f}" for t in np.nanmin(rows, axis=0) / mine))


def main(count: int = 1_000_000) -> None:
    S, (u, v) = sample_surface(), np.random.default_rng(1).random((2, count))
    u, v = u.copy(), v.copy()
    few = min(FEW, count)
    a, b, rest = u[:few].copy(), v[:few].copy(), count / few
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        peers = [
            ("C", lambda: c_scattered(S, u, v, folder), 1.0),
            ("scipy NdBSpline", lambda: scipy_scattered(S, u, v), 1.0),
            ("splinepy", lambda: splinepy_scattered(S, a, b), rest),
            ("splipy", lambda: splipy_scattered(S, a[:5000], b[:5000]), count / 5000),
            ("OCP", lambda: occ_scattered(S, a, b), rest),
        ]
        table(f"{count} scattered points", ours_scattered(S, u, v), iter(peers))
        t = np.linspace(0.0, 1.0, SIDE)
        short = t[:20].copy()
        peers = [
            ("C", lambda: c_grid(S, t, t, folder), 1.0),
            ("scipy NdBSpline", lambda: scipy_points_grid(S, t, t), 1.0),
            ("BSpline twice by hand", lambda: scipy_grid(S, t, t), 1.0),
            ("dense BLAS by hand", lambda: dense_grid(S, t, t), 1.0),
            ("splipy", lambda: splipy_grid(S, t, t), 1.0),
            ("splinepy", lambda: splinepy_grid(S, short, t), SIDE / 20),
        ]
        table(f"grid of {SIDE} x {SIDE}", ours_grid(S, t, t), iter(peers))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
