"""Surfaces that coincide: the common region of their parameter ranges and the curves that bound it.

On one cylinder, cone, sphere (poles aligned) or torus both ranges are rectangles in the same angles, shifted and
perhaps mirrored; on one plane they are rectangles turned against each other.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from patchwright.models import Cone, Cylinder, Plane, Sphere, Torus
from patchwright.models.arrays import Array
from patchwright.ssi.closed_forms.clipping import clipped, contact, curve_on
from patchwright.ssi.closed_forms.conic import Conic, circle, line
from patchwright.ssi.closed_forms.inversion import TURN, Analytic, Turned, full, inverted, place
from patchwright.ssi.intersection import Contact, Intersection, IntersectionCurve, Overlap

Span = tuple[float, float]


def coincident(a: Analytic, b: Analytic, tolerance: float) -> Intersection | None:
    """The overlap of two pieces of one surface; None for spheres whose poles differ."""
    if isinstance(a, Plane):
        assert isinstance(b, Plane)
        return _planes(a, b, tolerance)
    if isinstance(b, Plane) or type(a) is not type(b):
        return None
    if isinstance(a, Sphere) and float(np.linalg.norm(np.cross(a.axis, b.axis))) * a.radius > tolerance:
        if _whole(b):
            return _of_regions(a, b, [(a.u, a.v)], tolerance)
        if not _whole(a):
            return None
        swapped = _of_regions(b, a, [b.domain], tolerance)
        return None if swapped is None else _swapped(swapped)
    us, vs = _moved(a, b, 0), _moved(a, b, 1)
    rho = _widest(a)
    across = a.minor_radius if isinstance(a, Torus) else a.radius if isinstance(a, Sphere) else None
    u_spans = _common(a.u, us, tolerance / rho, turning=True)
    if across is None:
        v_spans = _common(a.v, vs, tolerance, turning=False)
    else:
        v_spans = _common(a.v, vs, tolerance / across, turning=isinstance(a, Torus))
    return _of_regions(a, b, list(itertools.product(u_spans, v_spans)), tolerance)


def _swapped(found: Intersection) -> Intersection:
    def turn(c: IntersectionCurve) -> IntersectionCurve:
        return IntersectionCurve(c.curve, c.uv_b, c.uv_a, c.points, c.kind, c.closed, c.residual)

    overlaps = tuple(Overlap(tuple(turn(c) for c in o.boundary), o.area) for o in found.overlaps)
    points = tuple(Contact(p.point, p.uv_b, p.uv_a, p.kind, p.gap) for p in found.points)
    return Intersection(tuple(turn(c) for c in found.curves), points, overlaps)


def _whole(sphere: Analytic) -> bool:
    return isinstance(sphere, Sphere) and full(*sphere.u) and sphere.v[1] - sphere.v[0] >= math.pi * (1.0 - 1e-13)


def _moved(a: Turned, b: Turned, which: int) -> Span:
    """b's range of u or v in a's parameter: a shift, mirrored where the axes are opposite (or u and v turn)."""
    mirrored = float(a.axis @ b.axis) < 0.0
    low, high = b.domain[which]
    far = max(b.v, key=lambda t: abs(float(b.radius(t)))) if isinstance(b, Cone) else 0.5 * sum(b.v)  # not the apex
    middle = b(0.5 * sum(b.u), far if which == 0 else 0.5 * sum(b.v))
    at = float(inverted(a, middle)[0][which])
    if which == 1 and isinstance(b, Sphere):
        return (-high, -low) if mirrored else (low, high)
    half = 0.5 * (high - low)
    return at - half, at + half


def _widest(surface: Turned) -> float:
    if isinstance(surface, Torus):
        return surface.major_radius + surface.minor_radius
    return max(abs(float(surface.radius(v))) for v in surface.v) if isinstance(surface, Cone) else surface.radius


def _common(a: Span, b: Span, slack: float, *, turning: bool) -> list[Span]:
    """Common parts of two ranges, those no longer than the slack included; whole turns absorb the other."""
    if turning and full(*a):
        return [a if full(*b) else b]
    if turning and full(*b):
        return [a]
    out = []
    for k in (-2, -1, 0, 1, 2) if turning else (0,):
        low, high = max(a[0], b[0] + k * TURN), min(a[1], b[1] + k * TURN)
        if high >= low - slack:
            out.append((low, max(high, low)))
    return out


def _of_regions(a: Turned, b: Turned, regions: list[tuple[Span, Span]], tol: float) -> Intersection | None:
    overlaps: list[Overlap] = []
    curves: list[IntersectionCurve] = []
    points: list[Contact] = []
    for u, v in regions:
        thin = [(u[1] - u[0]) * _widest(a) <= tol, (v[1] - v[0]) * _depth(a) <= tol]
        if all(thin):
            points.append(contact(_point(a, u[0], v[0]), "touch", 0.0, a, b))
            continue
        found: list[IntersectionCurve] = []
        sides = _sides(a, u, v, thin)
        for conic in sides:
            pieces, _ = clipped(conic, "tangential" if any(thin) else "overlap-boundary", a, b, tol)
            found += [c for c in pieces if _in_region(a, c, u, v, tol)]
        if any(thin):
            curves += found
        else:
            overlaps.append(Overlap(tuple(found), _area(a, u, v)))
    return Intersection(tuple(curves), tuple(points), tuple(overlaps))


def _depth(a: Turned) -> float:
    return a.minor_radius if isinstance(a, Torus) else a.radius if isinstance(a, Sphere) else 1.0


def _point(a: Turned, u: float, v: float) -> Array:
    """The surface continued over its ranges."""
    origin, (x, y, z) = place(a)
    rho, up = _ring(a, v)
    return np.asarray(origin + rho * (math.cos(u) * x + math.sin(u) * y) + up * z)


def _ring(a: Turned, v: float) -> tuple[float, float]:
    if isinstance(a, Cylinder):
        return a.radius, v
    if isinstance(a, Cone):
        return float(a.radius(v)), v
    if isinstance(a, Sphere):
        return a.radius * math.cos(v), a.radius * math.sin(v)
    return a.major_radius + a.minor_radius * math.cos(v), a.minor_radius * math.sin(v)


def _sides(a: Turned, u: Span, v: Span, thin: list[bool]) -> list[Conic]:
    """The conics along the edges of a region: circles of constant v, meridians of constant u."""
    origin, (x, y, z) = place(a)
    out = []
    if not (isinstance(a, Torus) and full(*v)):
        for value in v[:1] if thin[1] else v:
            rho, up = _ring(a, value)
            if abs(rho) > 1e-14 * _widest(a) and not thin[0]:
                out.append(circle(origin + up * z, z, abs(rho)))
    if not full(*u):
        for value in u[:1] if thin[0] else u:
            d = math.cos(value) * x + math.sin(value) * y
            if thin[1]:
                continue
            if isinstance(a, Cylinder | Cone):
                low, high = (_point(a, value, t) for t in v)
                out.append(line(low, high - low))
            elif isinstance(a, Sphere):
                out.append(circle(origin, np.cross(z, d), a.radius))
            else:
                out.append(circle(origin + a.major_radius * d, np.cross(z, d), a.minor_radius))
    return out


def _in_region(a: Turned, piece: IntersectionCurve, u: Span, v: Span, tol: float) -> bool:
    t0, t1 = piece.curve.domain
    at = inverted(a, piece.curve(t0 + 0.375 * (t1 - t0)))[0]  # a ruling's middle may be the apex
    rho, slack = _widest(a), tol / _depth(a)
    du = (float(at[0]) - u[0] + tol / rho) % TURN
    dv = (float(at[1]) - v[0] + slack) % TURN if isinstance(a, Torus) else float(at[1]) - v[0] + slack
    return du <= u[1] - u[0] + 2.0 * tol / rho and -1e-15 <= dv <= v[1] - v[0] + 2.0 * slack


def _area(a: Turned, u: Span, v: Span) -> float:
    du, dv = u[1] - u[0], v[1] - v[0]
    if isinstance(a, Cylinder):
        return a.radius * du * dv
    if isinstance(a, Cone):
        tip = float((a.apex - a.origin) @ a.axis)
        signed = [abs(t - tip) * (t - tip) for t in v]  # the integral of 2 |v - tip|
        return du * 0.5 * (signed[1] - signed[0]) * abs(math.tan(a.half_angle)) / math.cos(a.half_angle)
    if isinstance(a, Sphere):
        return a.radius**2 * du * (math.sin(v[1]) - math.sin(v[0]))
    return a.minor_radius * du * (a.major_radius * dv + a.minor_radius * (math.sin(v[1]) - math.sin(v[0])))


def _planes(a: Plane, b: Plane, tol: float) -> Intersection:
    segments: list[IntersectionCurve] = []
    lone: list[Array] = []
    for one in (a, b):
        corners = _corners(one)
        for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            conic = line(p, q - p)
            pieces, points = clipped(conic, "overlap-boundary", a, b, tol)
            segments += [c for c in pieces if not any(_same(c, s, tol) for s in segments)]
            lone += points
    polygon = _clip_polygon(_flat(a, _corners(a)), _flat(a, _corners(b)))
    x, y = polygon.T if polygon.size else (np.zeros(1), np.zeros(1))
    area = 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
    if not segments:
        at = lone[:1]
        return Intersection(points=tuple(contact(p, "touch", 0.0, a, b) for p in at))
    longest = max(float(np.linalg.norm(np.diff(s.curve.control_points, axis=0))) for s in segments)
    if area <= 2.0 * tol * longest:
        s = max(segments, key=lambda c: c.curve.length())
        ends = [float(t) for t in s.curve.domain]
        p, q = s.curve.control_points
        return Intersection((curve_on(line(p, q - p), [0.0, ends[1] - ends[0]], "tangential", a, b, closed=False),))
    return Intersection(overlaps=(Overlap(tuple(segments), area),))


def _corners(plane: Plane) -> Array:
    (u0, u1), (v0, v1) = plane.domain
    return plane(np.array([u0, u1, u1, u0]), np.array([v0, v0, v1, v1]))


def _flat(plane: Plane, points: Array) -> Array:
    origin, frame = place(plane)
    return np.asarray((points - origin) @ frame[:2].T)


def _same(one: IntersectionCurve, other: IntersectionCurve, tol: float) -> bool:
    p, q = one.curve.control_points, other.curve.control_points
    return min(float(np.abs(p - q).max()), float(np.abs(p[::-1] - q).max())) <= 4.0 * tol


def _clip_polygon(subject: Array, window: Array) -> Array:
    """Sutherland and Hodgman: the part of a convex polygon inside another, both (n, 2)."""
    x, y = window.T
    if float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) < 0.0:
        window = window[::-1]
    points = subject
    for p, q in zip(window, np.roll(window, -1, axis=0), strict=True):
        if not points.size:
            break
        edge = q - p
        side = edge[0] * (points[:, 1] - p[1]) - edge[1] * (points[:, 0] - p[0])
        out = []
        for i in range(points.shape[0]):
            j = (i + 1) % points.shape[0]
            if side[i] >= 0.0:
                out.append(points[i])
            if side[i] * side[j] < 0.0:
                out.append(points[i] + side[i] / (side[i] - side[j]) * (points[j] - points[i]))
        points = np.array(out).reshape(-1, 2)
    return points
