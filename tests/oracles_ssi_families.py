"""The known families of hard pairs, what they share by closed form, and the judgement of what `intersect` finds.

Convention: components are sets of pieces that share ends; lengths are totals over all pieces; points are counted by
kind; overlaps by area. "right" asks for all of these, a proof that there is nothing else, and measured residuals of at
most 1e-10 of the smaller surface's size where surfaces cross and 1e-7 where they touch along a curve.

Each pair is also judged turned and shifted, 1000 times smaller and larger, with its surfaces exchanged, and in NURBS
form. Run as a script it prints the table.
"""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from oracles_closed_forms import moved as moved_analytic
from oracles_closed_forms import rotation
from oracles_ssi import contour, dome, graph, wavy
from scipy.integrate import dblquad, quad
from scipy.interpolate import BSpline
from scipy.optimize import brentq
from scipy.special import ellipe

from patchwright.models import Cone, Cylinder, NurbsSurface, Plane, Sphere, Torus
from patchwright.models.arrays import Array
from patchwright.models.knots import greville, uniform_knots
from patchwright.models.surface import Surface
from patchwright.ssi import Intersection, intersect

ORIGIN, X, Z = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
PI = math.pi
TANGENTIAL = ("tangential",)
LIMITS = {"transversal": 1e-10, "tangential": 1e-7}  # of the smaller surface's size: residuals
ELLIPSE = 4.0 * math.sqrt(2.0) * float(ellipe(0.5))  # perimeter with semi-axes 1 and sqrt 2


@dataclass(frozen=True)
class Family:
    """A pair and what it shares; `tolerance` None for the default."""

    a: Surface
    b: Surface
    components: int
    length: float | Callable[[], float]
    touches: int = 0
    branches: int = 0
    kinds: tuple[str, ...] = ("transversal",)
    area: float = 0.0
    tolerance: float | None = None
    accuracy: float = 1e-9  # of the length, relative
    ring: tuple[tuple[float, float, float], tuple[float, float, float], float] | None = None
    """Centre, axis and radius: all curves keep this distance from the axis, to 1e-3 of it. A residual alone cannot tell
    where curves of small loops and small angles are."""


def integral(speed: Callable[[float], float], low: float, high: float, cuts: tuple[float, ...] = ()) -> float:
    ends = [low, *cuts, high]
    return sum(quad(speed, p, q, epsabs=1e-13, limit=200)[0] for p, q in itertools.pairwise(ends))


def crossing_cylinders(r: float) -> float:
    """Both loops of cylinders of radii 1 and r < 1, axes crossing: x = sqrt(1 - r^2 sin^2), y = r sin, z = r cos."""

    def speed(p: float) -> float:
        return math.hypot(r, r * r * math.sin(p) * math.cos(p) / math.sqrt(1.0 - (r * math.sin(p)) ** 2))

    cuts = tuple(0.5 * PI - t for t in (0.3, 0.1, 0.03, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5))
    return 8.0 * integral(speed, 0.0, 0.5 * PI, cuts)


def hippopede() -> float:
    """Torus 2, 1 and the plane x = 1: s = 2 + cos v, y^2 = s^2 - 1, z = sin v."""

    def speed(v: float) -> float:
        s = 2.0 + math.cos(v)
        return math.hypot(s * math.sin(v) / math.sqrt(s * s - 1.0), math.cos(v))

    return 4.0 * integral(speed, 0.0, PI - 1e-7) + 4e-7 * math.sqrt(2.0)


def touching_tori() -> float:
    """Tori 2, 1 side by side, centres 4 apart: the circle they share at y = 0, and in the plane between them the curve
    s = 2 + cos v, y^2 = s^2 - 4, z = sin v (the difference of the equations is (rho_1 - rho_2)(rho_1 + rho_2 - 4))."""

    def speed(w: float) -> float:  # v = pi / 2 - w^2
        c, s = math.sin(w * w), 2.0 + math.sin(w * w)
        root = math.sqrt(s + 2.0) * (math.sqrt(c) / w if w > 0.0 else 1.0)  # sqrt(s^2 - 4) / w
        return 2.0 * math.hypot(s * math.cos(w * w) / root, w * c)

    return 2.0 * PI + 4.0 * integral(speed, 0.0, math.sqrt(0.5 * PI))


def crossing_tori() -> float:
    """Concentric tori 5, 1 about z and y meet at y = z and y = -z: x^2 = (5 + cos v)^2 - sin^2 v, y = sin v."""

    def speed(v: float) -> float:
        x = math.sqrt((5.0 + math.cos(v)) ** 2 - math.sin(v) ** 2)
        return math.hypot(math.sin(v) * (5.0 + 2.0 * math.cos(v)) / x, math.sqrt(2.0) * math.cos(v))

    return 4.0 * integral(speed, 0.0, 2.0 * PI)


def lifted_circle() -> float:
    """The circle of radius 0.3 about (0.5, 0.5) on z = 0.3 x y + 0.2 x^3."""

    def speed(t: float) -> float:
        x, y = 0.5 + 0.3 * math.cos(t), 0.5 + 0.3 * math.sin(t)
        slope = (0.3 * y + 0.6 * x * x) * -math.sin(t) + 0.3 * x * math.cos(t)
        return 0.3 * math.hypot(1.0, slope)

    return integral(speed, 0.0, 2.0 * PI)


def hyperbola(off: float) -> float:
    """Both branches of x^2 - y^2 = off in |x|, |y| <= 1/2: x = sqrt(off + y^2)."""
    end = math.sqrt(0.25 - off)

    def speed(y: float) -> float:
        return math.hypot(1.0, y / math.sqrt(off + y * y))

    return 4.0 * integral(speed, 0.0, end, (1e-3, 1e-2, 0.1))


def base(x, y):
    return 0.3 * x * y + 0.2 * x**3


def tilted(angle: float) -> NurbsSurface:
    """Crosses `base` in a circle, slopes differing by 0.6 times the angle."""
    return graph(lambda x, y: base(x, y) + angle * ((x - 0.5) ** 2 + (y - 0.5) ** 2 - 0.09))


def tube(radius: float = 1.0, axis=Z, at=ORIGIN, v=(-2.0, 2.0)) -> Cylinder:
    return Cylinder(at, axis, radius, v=v)


SECTION = uniform_knots(3, 27)
ABOUT = greville(3, SECTION)  # -1 to 1 is u = 0 to 1: trailing edge, lower side, nose, upper side, trailing edge


@cache
def section() -> BSpline:
    """(x, z) of NACA 0012 with a closed trailing edge as a cubic spline, chord 2, nose at x = -1."""
    s = 2.0 * ABOUT - 1.0
    x = s * s
    z = 0.6 * (0.2969 * np.abs(s) - 0.1260 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4) * np.sign(s)
    rows = BSpline.design_matrix(ABOUT, SECTION, 3).toarray()
    return BSpline(SECTION, np.linalg.solve(rows, np.stack((2.0 * x - 1.0, 2.0 * z), axis=1)), 3)


def wing(height: float, span: tuple[float, float]) -> NurbsSurface:
    """The section ruled along y."""
    c = section().c
    net = np.empty((len(c), 2, 3))
    for k, y in enumerate(span):
        net[:, k] = np.stack((c[:, 0], np.full(len(c), y), c[:, 1] + height), axis=1)
    return NurbsSurface((3, 1), (SECTION, np.array([0.0, 0.0, 1.0, 1.0])), net)


def fuselage() -> NurbsSurface:
    """The ellipsoid (x / 6)^2 + y^2 + z^2 = 1, poles at its nose and tail."""
    ball = Sphere(ORIGIN, 1.0, X).to_nurbs()
    return NurbsSurface(ball.degree, ball.knots, ball.control_points * (6.0, 1.0, 1.0), ball.weights)


def root_line(height: float) -> float:
    """One side of wing and fuselage: y^2 = g(u) = 1 - (x / 6)^2 - z^2 along each ruling, where that is positive."""
    at, slope = section(), section().derivative()

    def g(u: float) -> float:
        x, z = at(u)
        return float(1.0 - x * x / 36.0 - (z + height) ** 2)

    def speed(u: float) -> float:
        (x, z), (dx, dz) = at(u), slope(u)
        dg = -2.0 * (x * dx / 36.0 + (z + height) * dz)
        return math.sqrt(dx * dx + dz * dz + dg * dg / (4.0 * g(u)))

    u = np.linspace(0.0, 1.0, 2001)
    sign = np.sign([g(t) for t in u])
    folds = [brentq(g, u[i], u[i + 1], xtol=1e-15) for i in np.flatnonzero(np.diff(sign) != 0)]
    ends = [0.0, *folds, 1.0]
    total = 0.0
    for low, high in itertools.pairwise(ends):
        if g(0.5 * (low + high)) < 0.0:
            continue
        knots = [t for t in np.unique(SECTION) if low < t < high]
        for p, q in itertools.pairwise([low, *knots, high]):
            # u = p + (q - p) (3 w^2 - 2 w^3): the square roots at folds become smooth
            def smooth(w: float, p: float = p, q: float = q) -> float:
                return speed(p + (q - p) * w * w * (3.0 - 2.0 * w)) * 6.0 * (q - p) * w * (1.0 - w)

            total += quad(smooth, 0.0, 1.0, epsabs=1e-13, limit=200)[0]
    return total


def height_of_graze(depth: float) -> float:
    """The wing's height at which the lower side sinks `depth` below the belly at y = 0, measured along z."""
    u = np.linspace(0.02, 0.48, 20001)
    x, z = section()(u).T
    return float(-depth - (z + np.sqrt(1.0 - x * x / 36.0)).min())


LOW = height_of_graze(1e-4)

FLOOR = Plane(ORIGIN, Z, X, u=(0.0, 1.0), v=(0.0, 1.0))
TORUS = Torus(ORIGIN, Z, 2.0, 1.0)
BASE = graph(base, spans=2)
SUB_PATCH = dblquad(lambda y, x: math.sqrt(1.0 + (0.3 * y + 0.6 * x * x) ** 2 + 0.09 * x * x), 0.2, 0.7, 0.3, 0.6)[0]

FAMILIES = {
    "a01 equal cylinders": Family(tube(), tube(axis=X), 1, 2.0 * ELLIPSE, branches=2),
    "a02 radii 1 and 1/2": Family(tube(), tube(0.5, X), 2, crossing_cylinders(0.5)),
    "a03 radii 1 and 1 - 1e-4": Family(tube(), tube(1.0 - 1e-4, X), 2, crossing_cylinders(1.0 - 1e-4), accuracy=1e-7),
    "a03 radii 1 and 1 - 1e-6": Family(tube(), tube(1.0 - 1e-6, X), 2, crossing_cylinders(1.0 - 1e-6), accuracy=1e-7),
    "a03 radii 1 and 1 - 1e-8": Family(tube(), tube(1.0 - 1e-8, X), 2, crossing_cylinders(1.0 - 1e-8), accuracy=1e-7),
    "a04 Viviani": Family(Sphere(ORIGIN, 1.0), tube(0.5, at=(0.5, 0.0, 0.0)), 1, ELLIPSE, branches=1),
    "a05 sphere beside a cylinder": Family(Sphere(ORIGIN, 1.0), tube(at=(2.0, 0.0, 0.0)), 0, 0.0, touches=1),
    "a06 sphere in a cylinder": Family(
        Sphere(ORIGIN, 1.0), tube(), 1, 2.0 * PI, kinds=TANGENTIAL, ring=(ORIGIN, Z, 1.0)
    ),
    "a07 Villarceau": Family(
        TORUS, Plane(ORIGIN, (-0.5, 0.0, math.sqrt(0.75)), u=(-4, 4), v=(-4, 4)), 1, 8.0 * PI, branches=2
    ),
    "a08 plane on a torus": Family(TORUS, Plane(Z, Z, u=(-4, 4), v=(-4, 4)), 1, 4.0 * PI, kinds=TANGENTIAL),
    "a09 plane inside a torus": Family(TORUS, Plane(X, X, u=(-4, 4), v=(-4, 4)), 1, hippopede(), branches=1),
    "a10 tori side by side": Family(
        TORUS, Torus((4.0, 0.0, 0.0), Z, 2.0, 1.0), 1, touching_tori(), branches=2, kinds=(*TANGENTIAL, "transversal")
    ),
    "a11 tori across": Family(
        Torus(ORIGIN, Z, 5.0, 1.0), Torus(ORIGIN, (0, 1, 0), 5.0, 1.0), 2, crossing_tori(), branches=4
    ),
    "a12 apex on a pole": Family(  # rho = 1.5 (10 - z) meets rho^2 + z^2 = 100 at z = 50 / 13
        Cone(ORIGIN, Z, math.atan(-1.5), 15.0, v=(0, 10)), Sphere(ORIGIN, 10.0), 1, 2.0 * PI * 120.0 / 13.0, touches=1
    ),
    "a13 plane along a ruling": Family(
        Plane(ORIGIN, (1, 0, 1), u=(-4, 4), v=(-4, 4)), Cone(ORIGIN, Z, 0.25 * PI, v=(0, 2)), 1, 2.0 * math.sqrt(2.0),
        kinds=TANGENTIAL,
    ),
    "a13 along both nappes": Family(
        Plane(ORIGIN, (1, 0, 1), u=(-4, 4), v=(-4, 4)), Cone(ORIGIN, Z, 0.25 * PI, v=(-2, 2)), 1, 4.0 * math.sqrt(2.0),
        kinds=TANGENTIAL,
    ),
    "a14 tangent cylinders": Family(tube(), tube(at=(2.0, 0.0, 0.0), v=(-1.0, 3.0)), 1, 3.0, kinds=TANGENTIAL),
    "a15 coincident bands": Family(tube(v=(-2.0, 1.0)), tube(v=(-1.0, 2.0)), 0, 0.0, area=4.0 * PI),
    "a16 circle of radius 1e-4": Family(  # a radius of 1e-4 comes from a depth of 1e-8, known to round-off of 1
        Sphere(ORIGIN, 1.0), Sphere((2.0 * math.sqrt(1.0 - 1e-8), 0, 0), 1.0), 1, 2e-4 * PI, accuracy=1e-6,
        ring=(ORIGIN, X, 1e-4),
    ),
    "a17 circles 2.8e-4 apart": Family(tube(), Sphere(ORIGIN, 1.0 + 1e-8), 2, 4.0 * PI, ring=(ORIGIN, Z, 1.0)),
    **{
        f"n02 dome {depth:g}": Family(
            dome(depth, (0.37, 0.412)), FLOOR, 1, 2.0 * PI * math.sqrt(depth / 4.5), tolerance=1e-3 * depth,
            accuracy=1e-3 if depth < 1e-8 else 1e-6, ring=((0.37, 0.412, 0.0), Z, math.sqrt(depth / 4.5)),
        )
        for depth in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10)
    },
    "n03 dome touches": Family(dome(0.0, (0.37, 0.412)), FLOOR, 0, 0.0, touches=1),
    "n04 tangent line": Family(graph(lambda x, y: (x - 0.4) ** 2 * (1.0 + y)), FLOOR, 1, 1.0, kinds=TANGENTIAL),
    "n05 tangent circle": Family(
        graph(lambda x, y: ((x - 0.5) ** 2 + (y - 0.5) ** 2 - 0.09) ** 2, degree=(4, 4)), FLOOR, 1, 0.6 * PI,
        kinds=TANGENTIAL, accuracy=1e-7, ring=((0.5, 0.5, 0.0), Z, 0.3),
    ),
    "n06 saddle": Family(
        graph(lambda x, y: (x - 0.5) ** 2 - (y - 0.5) ** 2), FLOOR, 1, 2.0 * math.sqrt(2.0), branches=1
    ),
    "n07 monkey saddle": Family(
        graph(lambda x, y: (x - 0.5) ** 3 - 3.0 * (x - 0.5) * (y - 0.5) ** 2), FLOOR, 1, 1.0 + 4.0 / math.sqrt(3.0),
        branches=1, accuracy=1e-6,
    ),
    "n08 saddle missed by 1e-6": Family(
        graph(lambda x, y: (x - 0.5) ** 2 - (y - 0.5) ** 2 - 1e-6), FLOOR, 2, hyperbola(1e-6), accuracy=1e-7
    ),
    **{
        f"n09 angle {0.6 * e:g}": Family(
            tilted(e), BASE, 1, lifted_circle(), accuracy=1e-3 if e < 1e-4 else 1e-8, ring=((0.5, 0.5, 0.0), Z, 0.3)
        )
        for e in (1e-2, 1e-4, 1e-6)
    },
    **{
        f"n01 {loops} loops": Family(
            *wavy(k), loops, lambda k=k: contour(*wavy(k))[2], accuracy=1e-4
        )
        for k, loops in ((5, 13), (7, 25), (10, 50), (14, 98))
    },
    "n10 own sub-patch": Family(BASE, BASE.restricted((0.2, 0.7), (0.3, 0.6)), 0, 0.0, area=SUB_PATCH),
    "n11 wing through a fuselage": Family(wing(0.0, (0.2, 2.0)), fuselage(), 1, root_line(0.0)),
    "n12 low wing grazes the belly": Family(
        wing(LOW, (-2.0, 2.0)), fuselage(), 1, 2.0 * root_line(LOW), accuracy=1e-8
    ),
}  # fmt: skip


def as_nurbs(family: Family) -> bool:
    """Whether the NURBS form is another pair."""
    return not (isinstance(family.a, NurbsSurface) and isinstance(family.b, NurbsSurface))


CASES = [(name, form) for name, f in FAMILIES.items() for form in ("given", "nurbs") if form == "given" or as_nurbs(f)]


def size_of(surface: Surface) -> float:
    return float(np.linalg.norm(np.ptp(surface.to_nurbs().control_points.reshape(-1, 3), axis=0)))


def components(found: Intersection, size: float) -> int:
    """Sets of curves chained by common ends."""
    ends = [c.curve(np.array(c.curve.domain)) for c in found.curves]
    parent = list(range(len(ends)))

    def root(i: int) -> int:
        while parent[i] != i:
            i = parent[i]
        return i

    for i, p in enumerate(ends):
        for j, q in enumerate(ends[:i]):
            if np.linalg.norm(p[:, None] - q, axis=2).min() <= 1e-8 * size:
                parent[root(i)] = root(j)
    return len({root(i) for i in parent})


def measured(found: Intersection, surfaces: tuple[Surface, Surface]) -> float:
    """The largest distance of curves and surfaces at their parameters, on samples that no fit knew."""
    worst = 0.0
    for c in found.curves:
        t = np.linspace(*c.curve.domain, 1009)
        for uv, surface in zip((c.uv_a, c.uv_b), surfaces, strict=True):
            assert uv is not None
            low, high = np.array(surface.domain).T
            w = uv(t)
            assert (np.maximum(low - w, w - high) <= 1e-9 * (high - low)).all()
            w = np.clip(w, low, high)
            worst = max(worst, float(np.linalg.norm(surface(w[:, 0], w[:, 1]) - c.curve(t), axis=1).max()))
    return worst


def verdict(found: Intersection, family: Family, pair: tuple[Surface, Surface], move: Motion) -> str:
    """ "right", "unresolved: reasons", "coarse: residual" (all right but that, and it says so) or "wrong: what"."""
    if not found.complete:
        return "unresolved: " + "; ".join(sorted({u.reason for u in found.unresolved}))
    size = min(size_of(s) for s in pair)
    faults = []
    parts, kinds = components(found, size), [p.kind for p in found.points]
    if parts != family.components:
        faults.append(f"{parts} components for {family.components}")
    wanted = family.length() if callable(family.length) else family.length
    length = found.length / move.scale
    if abs(length - wanted) > family.accuracy * wanted:
        faults.append(f"length {length!r} for {wanted!r}")
    for kind, count in (("touch", family.touches), ("branch", family.branches)):
        if kinds.count(kind) != count:
            faults.append(f"{kinds.count(kind)} {kind} points for {count}")
    area = sum(o.area for o in found.overlaps) / move.scale**2
    if abs(area - family.area) > 1e-9 * family.area:
        faults.append(f"area {area!r} for {family.area!r}")
    if found.curves and {c.kind for c in found.curves} != set(family.kinds):
        faults.append("other kinds of curves")
    if family.ring is not None:
        centre, axis, radius = family.ring
        arms = np.concatenate([c.curve(np.linspace(*c.curve.domain, 101)) for c in found.curves])
        arms = move.back(arms) - centre
        far = np.linalg.norm(arms - (arms @ axis)[:, None] * axis, axis=1)
        if np.abs(far - radius).max() > 1e-3 * radius:
            faults.append(f"radii from {far.min():.6g} to {far.max():.6g} for {radius:.6g}")
    worst = measured(found, pair)
    if worst > max(2.0 * found.residual, 1e-14 * size):
        faults.append(f"residual {worst:.1e} for {found.residual:.1e}")
    if faults:
        return "wrong: " + "; ".join(faults)
    coarse = [c.residual / size for c in found.curves if c.residual > LIMITS[c.kind] * size]
    return f"coarse: residual {max(coarse):.1e} of the size" if coarse else "right"


@dataclass(frozen=True)
class Variant:
    """The pair elsewhere: turned and shifted at random, scaled, exchanged."""

    turned: bool = False
    scale: float = 1.0
    swapped: bool = False


VARIANTS = {
    "plain": Variant(),
    "turned": Variant(turned=True),
    "small": Variant(scale=1e-3),
    "large": Variant(scale=1e3),
    "swapped": Variant(swapped=True),
    "all": Variant(turned=True, scale=1e3, swapped=True),
}


@dataclass(frozen=True)
class Motion:
    """x -> scale R x + shift."""

    R: Array
    shift: Array
    scale: float

    @classmethod
    def of(cls, variant: Variant, seed: int) -> Motion:
        rng = np.random.default_rng(seed)
        if not variant.turned:
            return cls(np.eye(3), np.zeros(3), variant.scale)
        return cls(rotation(rng), variant.scale * rng.uniform(-5.0, 5.0, 3), variant.scale)

    def __call__(self, surface: Surface) -> Surface:
        if not isinstance(surface, NurbsSurface):
            return moved_analytic(surface, self.R, self.shift, self.scale)
        net = self.scale * surface.control_points @ self.R.T + self.shift
        return NurbsSurface(surface.degree, surface.knots, net, surface.weights)

    def back(self, points: Array) -> Array:
        return (points - self.shift) @ self.R / self.scale


def judged(name: str, form: str, variant: str) -> tuple[str, float, float]:
    """The verdict, CPU seconds and the largest residual over the size of a family in one form and variant."""
    family, how = FAMILIES[name], VARIANTS[variant]
    move = Motion.of(how, len(name))
    pair = (move(family.a), move(family.b))
    if form == "nurbs":
        pair = (pair[0].to_nurbs(), pair[1].to_nurbs())
    if how.swapped:
        pair = pair[::-1]
    begin = time.process_time()
    found = intersect(*pair, tolerance=None if family.tolerance is None else family.tolerance * how.scale)
    spent = time.process_time() - begin
    return verdict(found, family, pair, move), spent, found.residual / min(size_of(s) for s in pair)


if __name__ == "__main__":
    counts = dict.fromkeys(VARIANTS, 0)
    for case in CASES:
        for label in VARIANTS:
            text, seconds, residual = judged(*case, label)
            counts[label] += text == "right"
            print(f"{case[0]:32}{case[1]:7}{label:9}{seconds:6.2f} s {residual:9.1e}  {text}", flush=True)  # noqa: T201
    for label, count in counts.items():
        print(f"{label:9}{count:4} of {len(CASES)} right")  # noqa: T201
