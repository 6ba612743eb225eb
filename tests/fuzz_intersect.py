"""Random pairs of surfaces through `intersect`: no crash, no hang, no NaN, and the answer judged where that is easy.

    python tests/fuzz_intersect.py --pairs 10000 --seed 0

Each pair is solved in a child process; one that takes longer than the limit or dies is counted and the child replaced.
Judged: every number finite; every curve within its residual of both surfaces, by its parameters, by the surface's
equation where it has one, and by the distance from a mesh; no errors but `GeometryError`; and, where one surface has an
equation and the answer is complete, that curves lie near every place where the equation changes sign strongly along a
grid on the other surface or along a lattice on each triangle of a mesh.
"""

from __future__ import annotations

import argparse
import multiprocessing
import multiprocessing.connection
import signal
import time
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from patchwright.models import Cone, Cylinder, GeometryError, NurbsSurface, Plane, Sphere, Torus, Triangulation
from patchwright.models.knots import greville, uniform_knots
from patchwright.models.tree import Tree
from patchwright.ssi import Intersection, intersect

LIMIT = 30.0  # seconds of its own time for a pair
PATIENCE = 600.0  # seconds on the clock, for a process that waits
TOLD = 100  # pairs between two lines of progress
GRID = 41  # places a side at which the oracle asks
KINDS = ("plane", "cylinder", "cone", "sphere", "torus", "graph", "rational", "kinked", "closed", "mesh")
Thing = Any


@dataclass(frozen=True)
class Result:
    """`state` is "right", "incomplete" (it said so) or "refused" (a sentence), else a fault; `what` tells more."""

    kinds: str
    state: str
    what: str
    seconds: float


def pair(seed: int, index: int) -> tuple[str, Thing, Thing]:
    """Kinds and surfaces of pair `index`; one in three is specially placed: concentric, parallel, touching or equal."""
    rng = np.random.default_rng((seed, index))
    first, second = (KINDS[k] for k in rng.integers(len(KINDS), size=2))
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    frame[:, 0] *= np.linalg.det(frame)
    size, origin = 10.0 ** rng.uniform(-3.0, 3.0), rng.normal(size=3)
    special = index % 3 == 0
    a = _made(first, rng, np.zeros(3), np.eye(3))
    if special:
        off = rng.choice([0.0, 1e-12, 1e-9, 1e-6, 1.0]) * rng.choice([0.0, 0.5, 1.0, 2.0])
        turn = np.eye(3) if rng.random() < 0.6 else frame
        b = _made(second, rng, off * np.eye(3)[rng.integers(3)], turn, plain=True)
    else:
        b = _made(second, rng, 0.5 * rng.normal(size=3), np.linalg.qr(rng.normal(size=(3, 3)))[0])
    return f"{first}-{second}", _moved(a, frame, origin, size), _moved(b, frame, origin, size)


def _made(kind: str, rng: np.random.Generator, at: np.ndarray, axes: np.ndarray, *, plain: bool = False) -> Thing:
    """One surface of about unit size; `plain` asks for round numbers, which make special positions likely."""
    r = float(rng.choice([0.5, 1.0])) if plain else float(rng.uniform(0.2, 1.2))
    x, z = axes[:, 0], axes[:, 2]
    if kind == "plane":
        return Plane(at, z, x, (-1.5, 1.5), (-1.5, 1.5))
    if kind == "cylinder":
        return Cylinder(at, z, r, x, v=(-1.5, 1.5))
    if kind == "cone":
        return Cone(at, z, 0.25 * np.pi if plain else float(rng.uniform(0.1, 1.2)), r, x, v=(-r, 1.0))
    if kind == "sphere":
        return Sphere(at, r, z, x)
    if kind == "torus":
        return Torus(at, z, 1.0, 0.5 if plain else float(rng.uniform(0.1, 0.9)), x)
    if kind == "mesh":
        return _mesh(at, axes, r)
    surface = _closed(rng) if kind == "closed" else _graph(rng, kind)
    return NurbsSurface(surface.degree, surface.knots, at + surface.control_points @ axes.T, surface.weights)


def _graph(rng: np.random.Generator, kind: str) -> NurbsSurface:
    """A height field over a square: smooth, rational, or with a knot of full multiplicity."""
    p, q = (int(k) for k in rng.integers(1, 5, size=2))
    U, V = uniform_knots(p, p + int(rng.integers(1, 5))), uniform_knots(q, q + int(rng.integers(1, 5)))
    if kind == "kinked":
        p, U = 3, np.array([0, 0, 0, 0, 0.4, 0.4, 0.4, 1, 1, 1, 1], dtype=float)
    x, y = np.meshgrid(2.0 * greville(p, U) - 1.0, 2.0 * greville(q, V) - 1.0, indexing="ij")
    z = rng.uniform(0.0, 0.6) * rng.normal(size=x.shape)
    weights = rng.uniform(0.5, 2.0, size=x.shape) if kind == "rational" else None
    return NurbsSurface((p, q), (U, V), np.stack((x, y, z), axis=-1), weights)


def _closed(rng: np.random.Generator) -> NurbsSurface:
    """A body of revolution with poles: a sphere's NURBS form, bent."""
    ball = Sphere(np.zeros(3), float(rng.uniform(0.4, 1.0))).to_nurbs()
    bent = ball.control_points * (1.0 + 0.2 * rng.normal(size=3)) + 0.1 * np.sin(3.0 * ball.control_points[..., ::-1])
    return NurbsSurface(ball.degree, ball.knots, bent, ball.weights)


def _mesh(at: np.ndarray, axes: np.ndarray, r: float) -> Triangulation:
    """An octahedron refined three times, on a sphere."""
    points = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float)
    rows = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    for _ in range(3):
        edges = np.sort(np.concatenate([rows[:, [0, 1]], rows[:, [1, 2]], rows[:, [2, 0]]]), axis=1)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        middle = points[unique].mean(axis=1)
        middle /= np.linalg.norm(middle, axis=1)[:, None]
        m = len(points) + inverse.reshape(3, -1).T
        points = np.concatenate([points, middle])
        rows = np.concatenate(
            [
                np.stack([rows[:, 0], m[:, 0], m[:, 2]], axis=1),
                np.stack([rows[:, 1], m[:, 1], m[:, 0]], axis=1),
                np.stack([rows[:, 2], m[:, 2], m[:, 1]], axis=1),
                m,
            ]
        )
    return Triangulation(at + r * points @ axes.T, rows)


def _moved(thing: Thing, frame: np.ndarray, origin: np.ndarray, size: float) -> Thing:
    """The thing turned, scaled and shifted."""

    def place(p: np.ndarray) -> np.ndarray:
        return np.asarray(origin + size * (np.asarray(p) @ frame.T))

    if isinstance(thing, Triangulation):
        return Triangulation(place(thing.vertices), thing.triangles)
    if isinstance(thing, NurbsSurface):
        return NurbsSurface(thing.degree, thing.knots, place(thing.control_points), thing.weights)
    x = frame @ thing.xdir
    if isinstance(thing, Plane):
        u, v = (tuple(size * t for t in r) for r in (thing.u, thing.v))
        return Plane(place(thing.origin), frame @ thing.normal, x, u, v)
    z = frame @ thing.axis
    if isinstance(thing, Sphere):
        return Sphere(place(thing.center), size * thing.radius, z, x)
    if isinstance(thing, Torus):
        return Torus(place(thing.center), z, size * thing.major_radius, size * thing.minor_radius, x)
    v = (size * thing.v[0], size * thing.v[1])
    if isinstance(thing, Cylinder):
        return Cylinder(place(thing.origin), z, size * thing.radius, x, v=v)
    return Cone(place(thing.origin), z, thing.half_angle, size * thing.ref_radius, x, v=v)


def judged(a: Thing, b: Thing, found: Intersection) -> str:
    """ "" or what is wrong."""
    size = max(_extent(a), _extent(b))
    for curve in found.curves:
        points = curve.curve(np.linspace(*curve.curve.domain, 201))
        if not (np.isfinite(points).all() and np.isfinite(curve.residual)):
            return "a curve is not finite"
        for uv, thing in ((curve.uv_a, a), (curve.uv_b, b)):
            allowed = max(4.0 * curve.residual, 1e-12 * (size + np.abs(points).max()))
            off = _off(thing, points)
            if not off <= allowed:
                return f"a curve is {off / size:.1e} of the size off a {type(thing).__name__}"
            if uv is None:
                continue
            w = np.clip(uv(np.linspace(*uv.domain, 201)), *np.array(thing.domain).T)
            far = float(np.linalg.norm(thing(w[:, 0], w[:, 1]) - points, axis=1).max())
            if not far <= allowed:
                return f"a curve is {far / size:.1e} of the size off a surface and says {curve.residual / size:.1e}"
    if any(not np.isfinite(p.point).all() for p in found.points):
        return "a point is not finite"
    if not found.complete:
        return ""
    for one, other in ((a, b), (b, a)):
        missed = _missed(one, other, found, size)
        if missed:
            return missed
    return ""


def _off(thing: Thing, points: np.ndarray) -> float:
    """Largest distance of points from an analytic surface without its ranges, or from a mesh; 0 for others."""
    if isinstance(thing, Triangulation):
        return float(Tree.of(thing).closest(points).distance.max())
    if isinstance(thing, Plane | Sphere | Torus | Cylinder):
        return float(np.abs(_equation(thing, points, 0.0)[0]).max())
    return 0.0


def _missed(one: Thing, other: Thing, found: Intersection, size: float) -> str:
    """Whether a place on `other` at which the equation of `one` changes sign is far from every curve."""
    if not isinstance(one, Plane | Sphere | Torus | Cylinder) or found.overlaps:
        return ""
    middle, reach = (_lattice_across if isinstance(other, Triangulation) else _cells_across)(one, other, size)
    if not len(middle):
        return ""
    cloud = [c.curve(np.linspace(*c.curve.domain, 801)) for c in found.curves] + [
        np.array([p.point for p in found.points]).reshape(-1, 3)
    ]
    places = np.concatenate(cloud)
    if not len(places):
        return f"nothing found, the equation changes sign in {len(middle)} places"
    far = cKDTree(places).query(middle)[0] - reach
    return (
        f"a place where the equation changes sign is {far.max() / size:.1e} off every curve" if far.max() > 0.0 else ""
    )


def _lattice_across(one: Thing, mesh: Triangulation, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Middles of lines of a lattice on each triangle along which the equation of `one` changes sign, and how far a
    curve may be."""
    n = 6
    corner = np.array([(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)])
    lines = np.argwhere(np.triu(np.abs(corner[:, None] - corner[None]).sum(axis=2) == 2))
    points = np.einsum("pk,mkd->mpd", corner / n, mesh.corners)
    ends = points[:, lines].reshape(-1, 2, 3)
    height, within = _equation(one, ends, size)
    across = (height[:, 0] * height[:, 1] < 0.0) & (np.abs(height).min(axis=1) > 1e-7 * size) & within.all(axis=1)
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    return ends[across].mean(axis=1), length[across] + 0.02 * size


def _cells_across(one: Thing, other: Thing, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Middles of cells of a grid on `other` in which the equation of `one` changes sign, and how far a curve may be."""
    (u0, u1), (v0, v1) = other.domain
    u, v = np.meshgrid(np.linspace(u0, u1, GRID), np.linspace(v0, v1, GRID), indexing="ij")
    points = other(u.ravel(), v.ravel()).reshape(GRID, GRID, 3)
    height, within = _equation(one, points, size)
    corner = [points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]]
    cell = np.max([np.linalg.norm(c - corner[0], axis=-1) for c in corner[1:]], axis=0)
    signs = [np.sign(h) for h in (height[:-1, :-1], height[1:, :-1], height[1:, 1:], height[:-1, 1:])]
    clear = np.min([np.abs(h) for h in (height[:-1, :-1], height[1:, :-1], height[1:, 1:], height[:-1, 1:])], axis=0)
    inner = within[:-1, :-1] & within[1:, :-1] & within[1:, 1:] & within[:-1, 1:]
    changes = (np.max(signs, axis=0) > 0) & (np.min(signs, axis=0) < 0) & inner & (clear > 1e-7 * size)
    return np.mean(corner, axis=0)[changes], 1.5 * cell[changes] + 0.02 * size


def _equation(one: Thing, points: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Signed distance to a surface, and where its foot lies well inside the ranges."""
    local = points - (one.center if isinstance(one, Sphere | Torus) else one.origin)
    if isinstance(one, Sphere):
        return np.linalg.norm(local, axis=-1) - one.radius, np.ones(points.shape[:-1], dtype=bool)
    z = one.normal if isinstance(one, Plane) else one.axis
    up = local @ z
    if isinstance(one, Plane):
        x, y = local @ one.xdir, local @ one.ydir
        margin = 0.05 * size
        inside = (x > one.u[0] + margin) & (x < one.u[1] - margin) & (y > one.v[0] + margin) & (y < one.v[1] - margin)
        return up, inside
    rho = np.linalg.norm(local - up[..., None] * z, axis=-1)
    if isinstance(one, Cylinder):
        return rho - one.radius, (up > one.v[0] + 0.05 * size) & (up < one.v[1] - 0.05 * size)
    return np.hypot(rho - one.major_radius, up) - one.minor_radius, np.ones(points.shape[:-1], dtype=bool)


def _extent(thing: Thing) -> float:
    points = thing.vertices if isinstance(thing, Triangulation) else thing.to_nurbs().control_points.reshape(-1, 3)
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def solved(seed: int, index: int) -> Result:
    """One pair, here."""
    kinds, a, b = pair(seed, index)
    begin = time.process_time()
    try:
        found = intersect(a, b)
    except GeometryError as error:
        return Result(kinds, "refused", str(error), time.process_time() - begin)
    except Exception as error:  # noqa: BLE001
        return Result(kinds, "crash", repr(error)[:200], time.process_time() - begin)
    seconds = time.process_time() - begin
    wrong = judged(a, b, found)
    if wrong:
        return Result(kinds, "wrong", wrong, seconds)
    if not found.complete:
        return Result(kinds, "incomplete", found.unresolved[0].reason, seconds)
    return Result(kinds, "right", "", seconds)


def _child(seed: int, link: multiprocessing.connection.Connection) -> None:
    """Say that everything is compiled, then solve what is asked."""
    for first, second in ((0, 5), (9, 3)):
        rng = np.random.default_rng(0)
        intersect(*(_made(KINDS[k], rng, np.zeros(3), np.eye(3)) for k in (first, second)))
    link.send(None)
    while True:
        index = link.recv()
        signal.setitimer(signal.ITIMER_VIRTUAL, LIMIT)  # of this process' own time; its end ends the process
        link.send(solved(seed, index))


class _Child:
    """A process that solves pairs, replaced when it hangs or dies."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self.start()

    def start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.link, far = context.Pipe()
        self.process = context.Process(target=_child, args=(self.seed, far), daemon=True)
        self.process.start()
        far.close()
        self.link.recv()

    def solve(self, index: int) -> Result:
        self.link.send(index)
        if self.link.poll(PATIENCE):
            try:
                answer: Result = self.link.recv()
                return answer
            except EOFError:
                self.process.join()
                state = "hang" if self.process.exitcode == -signal.SIGVTALRM else "crash"
        else:
            state = "hang"
        self.process.kill()
        kinds = pair(self.seed, index)[0]
        self.start()
        return Result(kinds, state, "the process died" if state == "crash" else f"over {LIMIT:g} s", LIMIT)


def main() -> None:
    options = argparse.ArgumentParser()
    options.add_argument("--pairs", type=int, default=10000)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--start", type=int, default=0)
    options.add_argument("--kind", help="only pairs with this kind of surface")
    options = options.parse_args()
    child, states, slow = _Child(options.seed), Counter[str](), 0.0
    kinds: Counter[tuple[str, str]] = Counter()
    for index in range(options.start, options.start + options.pairs):
        if options.kind and options.kind not in pair(options.seed, index)[0].split("-"):
            continue
        got = child.solve(index)
        states[got.state] += 1
        kinds[got.kinds, got.state] += 1
        slow = max(slow, got.seconds)
        if got.state in ("crash", "hang", "wrong"):
            print(f"{index}: {got.kinds}: {got.state}: {got.what} ({got.seconds:.1f} s)", flush=True)  # noqa: T201
        if states.total() % TOLD == 0:
            print(f"{states.total()} pairs up to {index}: {dict(states)}", flush=True)  # noqa: T201
    print(dict(states), f"slowest {slow:.1f} s")  # noqa: T201
    for (which, state), count in sorted(kinds.items()):
        if state not in ("right", "refused"):
            print(f"{which:24}{state:12}{count}")  # noqa: T201


if __name__ == "__main__":
    main()
