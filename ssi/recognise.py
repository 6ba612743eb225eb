"""`recognise`: a NURBS surface that is a piece of a plane, cylinder, cone, sphere or torus.

Least-squares fits to samples of points and normals, the simplest surface first: a plane holds the control points; a
sphere solves |P|^2 = 2 c . P + k; a cylinder's normals are square to the axis; a cone's make one angle with it and its
tangent planes meet in the apex; a torus' normal lines all meet the axis, linear in the axis' Pluecker coordinates
(H. Pottmann and J. Wallner, Computational Line Geometry, 2001, section 4.2). What was found counts only if it is within
the tolerance of the NURBS surface everywhere: a plane by the hull of the control points, the quadrics by the Bernstein
coefficients of their implicit equation along the surface, a torus on samples.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from patchwright.models import Cone, Cylinder, NurbsSurface, Plane, Sphere, Torus
from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.knots import between
from patchwright.models.surface import Surface
from patchwright.ssi.closed_forms.inversion import TURN, Analytic, inverted, place, side

Finder = Callable[[Array, Array, Array, float], Analytic | None]
SAMPLES = 7  # per span and direction of the fit; the check uses four times as many
EPS = float(np.finfo(np.float64).eps)


@dataclass(frozen=True, slots=True, eq=False)
class Recognised:
    """An analytic surface that is a NURBS surface.

    Parameters
    ----------
    surface : bounded to the extent of the NURBS surface
    native : the NURBS surface
    deviation : largest distance of the NURBS surface from the unbounded analytic one; a bound where `proved`
    proved : whether `deviation` is a bound from control points and not the largest of samples
    fills : whether the NURBS surface fills the analytic one's ranges; otherwise what is found on `surface` has to be
        trimmed by the NURBS surface's own edges
    """

    surface: Analytic
    native: NurbsSurface
    deviation: float
    proved: bool
    fills: bool

    def to_native(self, points: npt.ArrayLike) -> Array:
        """(k, 2) parameters of the NURBS surface at (k, 3) points of it."""
        feet = self.native.closest(points)
        return np.stack((feet.u, feet.v), axis=1)


def recognise(surface: Surface, tolerance: float) -> Recognised | None:
    """The plane, cylinder, cone, sphere or torus that a NURBS surface is within `tolerance`, or None.

    Raises
    ------
    ParameterError : a tolerance that is not positive.
    """
    if not (math.isfinite(tolerance) and tolerance > 0.0):
        raise ParameterError(f"the tolerance must be a positive length, got {tolerance}")
    if not isinstance(surface, NurbsSurface):
        return None
    flat = _plane(surface, tolerance)
    if flat is not None:
        return flat
    us, vs = (between(ts, SAMPLES) for ts in surface.breaks)
    points = surface.grid(us, vs).reshape(-1, 3)
    along_u, along_v = (surface.grid(us, vs, nu).reshape(-1, 3) for nu in ((1, 0), (0, 1)))
    normals = np.cross(along_u, along_v)
    lengths = np.linalg.norm(normals, axis=1)
    good = lengths > math.sqrt(EPS) * lengths.max()
    points, normals = points[good], normals[good] / lengths[good, None]
    middle, size = points.mean(axis=0), float(np.ptp(points, axis=0).max())
    scaled = (points - middle) / size
    finders: tuple[Finder, ...] = (_sphere, _cylinder, _cone, _torus)
    for find in finders:
        found = find(scaled, normals, middle, size)
        if found is None or _distance(found, points).max() > tolerance:
            continue
        out = _checked(surface, found, tolerance)
        if out is not None:
            return out
    return None


def _plane(surface: NurbsSurface, tolerance: float) -> Recognised | None:
    net = surface.control_points.reshape(-1, 3)
    middle = net.mean(axis=0)
    normal = np.linalg.svd(net - middle, full_matrices=False)[2][2]
    deviation = float(np.abs((net - middle) @ normal).max())
    if deviation > tolerance:
        return None
    edge = surface.control_points[-1, 0] - surface.control_points[0, 0]
    edge = edge if np.linalg.norm(edge) > tolerance else surface.control_points[-1, -1] - surface.control_points[0, -1]
    xdir = edge if np.linalg.norm(edge - (edge @ normal) * normal) > tolerance else None
    plane = Plane(middle, normal, xdir)
    uv = inverted(plane, _grid(surface))[0].reshape(-1, 2)
    (u0, v0), (u1, v1) = uv.min(axis=0), uv.max(axis=0)
    if not (u1 - u0 > tolerance and v1 - v0 > tolerance):
        return None
    plane = Plane(middle, normal, xdir, (u0, u1), (v0, v1))
    return Recognised(plane, surface, deviation, True, _fills(surface, plane, tolerance))


def _sphere(p: Array, n: Array, middle: Array, size: float) -> Analytic | None:
    rows = np.concatenate((2.0 * p, np.ones((p.shape[0], 1))), axis=1)
    c = np.linalg.lstsq(rows, (p * p).sum(axis=1), rcond=None)[0]
    square = float(c[3] + c[:3] @ c[:3])
    return Sphere(middle + size * c[:3], size * math.sqrt(square)) if square > 0.0 else None


def _cylinder(p: Array, n: Array, middle: Array, size: float) -> Analytic | None:
    axis = np.linalg.svd(n, full_matrices=False)[2][2]
    trial = Plane(np.zeros(3), axis)
    flat = np.stack((p @ trial.xdir, p @ trial.ydir), axis=1)
    center, radius = _circle(flat)
    if radius is None:
        return None
    return Cylinder(middle + size * (center[0] * trial.xdir + center[1] * trial.ydir), axis, size * radius)


def _cone(p: Array, n: Array, middle: Array, size: float) -> Analytic | None:
    axis = np.linalg.svd(n - n.mean(axis=0), full_matrices=False)[2][2]
    sine = float((n @ axis).mean())
    if not 1e-9 < abs(sine) < 1.0 - 1e-9:  # a cylinder or a plane to round-off of the normals
        return None
    apex = np.linalg.lstsq(n, (n * p).sum(axis=1), rcond=None)[0]
    if float((p - apex).mean(axis=0) @ axis) < 0.0:
        axis = -axis
    return Cone(middle + size * apex, axis, math.asin(abs(sine)))


def _torus(p: Array, n: Array, middle: Array, size: float) -> Analytic | None:
    null = np.linalg.svd(np.concatenate((np.cross(p, n), n), axis=1), full_matrices=False)[2][5]
    d, m = null[:3], null[3:]
    length = float(np.linalg.norm(d))
    if length < math.sqrt(EPS):
        return None
    z = d / length
    foot = np.cross(z, m / length)
    w = p - foot
    up = w @ z
    rho = np.linalg.norm(w - up[:, None] * z, axis=1)
    center, radius = _circle(np.stack((rho, up), axis=1))
    if radius is None or center[0] <= 0.0:
        return None
    return Torus(middle + size * (foot + center[1] * z), z, size * float(center[0]), size * radius)


def _circle(flat: Array) -> tuple[Array, float | None]:
    rows = np.concatenate((2.0 * flat, np.ones((flat.shape[0], 1))), axis=1)
    c, _, rank, _ = np.linalg.lstsq(rows, (flat * flat).sum(axis=1), rcond=None)
    square = float(c[2] + c[:2] @ c[:2])
    return c[:2], math.sqrt(square) if rank == 3 and square > 0.0 else None


def _distance(surface: Analytic, points: Array) -> Array:
    """Distances from the unbounded surface."""
    origin, frame = place(surface)
    x, y, z = ((points - origin) @ frame.T).T
    rho = np.hypot(x, y)
    if isinstance(surface, Plane):
        off = z
    elif isinstance(surface, Cylinder):
        off = rho - surface.radius
    elif isinstance(surface, Sphere):
        off = np.hypot(rho, z) - surface.radius
    elif isinstance(surface, Cone):
        up = z + surface.ref_radius / math.tan(surface.half_angle)
        off = rho * math.cos(surface.half_angle) - np.abs(up * math.sin(surface.half_angle))
    else:
        s = side(surface, rho, z)
        off = np.hypot(s * rho - surface.major_radius, z) - surface.minor_radius
    return np.asarray(np.abs(off))


def _checked(native: NurbsSurface, found: Analytic, tolerance: float) -> Recognised | None:
    us, vs = (np.append(between(ts, 4 * SAMPLES), ts) for ts in native.breaks)
    deviation = float(_distance(found, native.grid(us, vs).reshape(-1, 3)).max())
    if deviation > tolerance:
        return None
    bound = _bernstein_bound(native, found)
    proved = bound is not None and bound <= tolerance
    candidates = []
    for trial in _placed(native, found):
        bounded = _ranged(native, trial, tolerance)
        if bounded is None:
            continue
        candidates.append(bounded)
        if _fills(native, bounded, tolerance):
            return Recognised(bounded, native, bound if proved and bound is not None else deviation, proved, True)
    if not candidates:
        return None
    return Recognised(candidates[0], native, bound if proved and bound is not None else deviation, proved, False)


def _bernstein_bound(native: NurbsSurface, found: Analytic) -> float | None:
    """A bound of the distance from the Bernstein coefficients of f(w P) / w^2, f the quadric's equation, else None.

    Cylinder and sphere: f = rho^2 - r^2 and |rho - r| <= |f| / r. Cone: f is a product of the distances from the two
    rulings of the half plane, the farther of which is at least |rho| cos t.
    """
    if isinstance(found, Plane | Torus):
        return None
    origin, frame = place(found)
    if isinstance(found, Cone):
        origin = found.apex
    form = np.diag((1.0, 1.0, 1.0 if isinstance(found, Sphere) else 0.0))
    if isinstance(found, Cone):
        c, s = math.cos(found.half_angle), math.sin(found.half_angle)
        form = np.diag((c * c, c * c, -s * s))
    worst = 0.0
    for u0, u1, v0, v1 in _spans(native):
        patch = native.restricted((u0, u1), (v0, v1))
        w = np.ones(patch.control_points.shape[:2]) if patch.weights is None else patch.weights
        local = (patch.control_points - origin) @ frame.T
        net = np.concatenate((local * w[..., None], w[..., None]), axis=2)
        p, q = patch.degree
        rows = np.array([[math.comb(p, i) * math.comb(q, j) for j in range(q + 1)] for i in range(p + 1)], dtype=float)
        total = np.zeros((2 * p + 1, 2 * q + 1))
        square = [*form.diagonal().tolist(), 0.0 if isinstance(found, Cone) else -(found.radius**2)]
        for k in range(4):
            scaled = net[..., k] * rows
            for i in range(p + 1):
                for j in range(q + 1):
                    total[i : i + p + 1, j : j + q + 1] += square[k] * scaled[i, j] * scaled
        down = np.array(
            [[math.comb(2 * p, i) * math.comb(2 * q, j) for j in range(2 * q + 1)] for i in range(2 * p + 1)],
            dtype=float,
        )
        top = float(np.abs(total / down).max()) / float(w.min()) ** 2
        if isinstance(found, Cone):
            # near the apex the two rulings merge: distance^2 <= |f|, elsewhere distance <= |f| / (rho cos t), and rho
            # is at least the hull's extent in any direction across the axis
            ring = local[..., :2].reshape(-1, 2)
            toward = ring.mean(axis=0) / max(float(np.linalg.norm(ring.mean(axis=0))), EPS)
            far = float((ring @ toward).min()) * math.cos(found.half_angle)
            worst = max(worst, min(math.sqrt(top), top / far) if far > 0.0 else math.sqrt(top))
        else:
            worst = max(worst, top / found.radius)
    return worst


def _spans(native: NurbsSurface) -> list[tuple[float, float, float, float]]:
    us, vs = native.breaks
    return [
        (float(u0), float(u1), float(v0), float(v1))
        for u0, u1 in itertools.pairwise(us)
        for v0, v1 in itertools.pairwise(vs)
    ]


def _placed(native: NurbsSurface, found: Analytic) -> list[Analytic]:
    """The same unbounded surface; a sphere with the axes its iso-curves suggest."""
    if not isinstance(found, Sphere):
        return [found]
    (u0, u1), (v0, v1) = native.domain
    out: list[Analytic] = []
    for rows in (
        native(np.linspace(u0, u1, 17), 0.5 * (v0 + v1)),
        native(0.5 * (u0 + u1), np.linspace(v0, v1, 17)),
    ):
        normal = np.linalg.svd(rows - rows.mean(axis=0), full_matrices=False)[2][2]
        out.append(Sphere(found.center, found.radius, normal))
    return out


def _grid(native: NurbsSurface) -> Array:
    us, vs = (np.unique(np.concatenate((between(ts, 2 * SAMPLES), ts))) for ts in native.breaks)
    return native.grid(us, vs)


def _ranged(native: NurbsSurface, found: Analytic, tolerance: float) -> Analytic | None:
    """The surface with the ranges the NURBS surface covers."""
    points = _grid(native)
    origin, frame = place(found)
    x, y, z = np.moveaxis((points - origin) @ frame.T, -1, 0)
    rho = np.hypot(x, y)
    size = float(np.ptp(points.reshape(-1, 3), axis=0).max())
    s = side(found, rho, z)
    u = _unwrapped(np.where(rho > max(64.0 * EPS * size, 8.0 * tolerance), np.arctan2(s * y, s * x), np.nan))
    u_range = _angles(u, 8.0 * tolerance / float(rho.max()))
    if u_range is None:
        return None
    if isinstance(found, Cylinder):
        return Cylinder(found.origin, found.axis, found.radius, found.xdir, u_range, (float(z.min()), float(z.max())))
    if isinstance(found, Cone):
        v = (float(z.min()), float(z.max()))
        return Cone(found.origin, found.axis, found.half_angle, found.ref_radius, found.xdir, u_range, v)
    if isinstance(found, Sphere):
        lat = np.arctan2(z, rho)
        return Sphere(found.center, found.radius, found.axis, found.xdir, u_range, (float(lat.min()), float(lat.max())))
    assert isinstance(found, Torus)
    v_range = _angles(_unwrapped(np.arctan2(z, s * rho - found.major_radius)), 8.0 * tolerance / found.minor_radius)
    if v_range is None:
        return None
    return Torus(found.center, found.axis, found.major_radius, found.minor_radius, found.xdir, u_range, v_range)


def _unwrapped(angles: Array) -> Array:
    """Continuous angles over a grid; NaN (a pole) takes the neighbours' values."""
    a = angles.copy()
    for axis in (0, 1):
        a = np.moveaxis(a, axis, 0)
        lost = np.isnan(a).all(axis=1)
        for i in np.flatnonzero(lost):
            near = np.flatnonzero(~lost)
            if near.size:
                a[i] = a[near[np.argmin(np.abs(near - i))]]
        a = np.moveaxis(a, 0, axis)
    a = np.where(np.isnan(a), np.nanmean(angles) if np.isfinite(angles).any() else 0.0, a)
    a = np.unwrap(a, axis=1)
    return np.asarray(a + (np.unwrap(a[:, :1], axis=0) - a[:, :1]))


def _angles(values: Array, slack: float) -> tuple[float, float] | None:
    """The range of angles, a whole turn if it is one within the slack; None beyond a turn."""
    low, high = float(values.min()), float(values.max())
    turns = TURN * math.floor(low / TURN + 1e-12)
    low, high = low - turns, high - turns
    if abs(high - low - TURN) <= slack:
        return low, low + TURN
    return (low, high) if 0.0 < high - low < TURN else None


def _fills(native: NurbsSurface, surface: Analytic, tolerance: float) -> bool:
    """Whether every edge of the NURBS surface runs along an edge (seam, pole) of the ranges."""
    points = _grid(native)
    origin, frame = place(surface)
    for rim in (points[0], points[-1], points[:, 0], points[:, -1]):
        uv = inverted(surface, rim)[0]
        x, y, _ = ((rim - origin) @ frame.T).T
        scales = [np.ones(rim.shape[0])] * 2
        if not isinstance(surface, Plane):
            scales = [np.hypot(x, y), np.ones(rim.shape[0])]
            if isinstance(surface, Sphere | Torus):
                scales[1] = scales[1] * (surface.radius if isinstance(surface, Sphere) else surface.minor_radius)
        off = []
        for which in (0, 1):
            for end in surface.domain[which]:
                gap = np.abs(uv[:, which] - end)
                if isinstance(surface, Torus) or (which == 0 and not isinstance(surface, Plane)):
                    gap = np.minimum(gap, np.abs(gap - TURN))
                off.append(float((gap * scales[which]).max()))
        if min(off) > 8.0 * tolerance:
            return False
    return True
