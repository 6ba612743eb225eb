"""Lines, ellipses, parabolas and branches of hyperbolas in space, with exact NURBS arcs.

The rational quadratic through two points of a conic with the middle weight w: ellipse w = cos h, hyperbola w = cosh h,
parabola w = 1, h half the parameter's range; at knots the NURBS parameter is the conic's own, between them it is not.
Reference: Piegl and Tiller, The NURBS Book, 2nd ed. 1997, chapter 7.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array
from patchwright.models.nurbs_curve import NurbsCurve

TURN = 2.0 * math.pi
QUARTER = 0.5 * math.pi  # longest piece of an ellipse: its middle weight stays above 0.7
STRETCH = 1.0  # longest piece of a hyperbola: its middle weight stays below 1.13

Shape = Literal["line", "ellipse", "parabola", "hyperbola"]


@dataclass(frozen=True, slots=True, eq=False)
class Conic:
    """line: c + t a; ellipse: c + cos t a + sin t b; parabola: c + t a + t^2 b; hyperbola: c + cosh t a + sinh t b.

    `a` of a line is a unit vector; the axes of an ellipse are square to each other.
    """

    shape: Shape
    c: Array
    a: Array
    b: Array

    def __call__(self, t: npt.ArrayLike) -> Array:
        """(..., 3) points."""
        ts = np.asarray(t, dtype=np.float64)[..., None]
        f, g = _basis(self.shape, ts)
        return np.asarray(self.c + f * self.a + g * self.b)

    def speed(self, t: float) -> float:
        """Length per parameter at t."""
        if self.shape == "line":
            d = self.a
        elif self.shape == "parabola":
            d = self.a + 2.0 * t * self.b
        elif self.shape == "ellipse":
            d = math.cos(t) * self.b - math.sin(t) * self.a
        else:
            d = math.sinh(t) * self.a + math.cosh(t) * self.b
        return float(np.linalg.norm(d))

    def crossings(self, normal: Array, offset: float, slack: float) -> list[float]:
        """Parameters where normal . P = offset; a miss by at most `slack` (a length) counts as touching.

        Empty when the whole conic runs within `slack` of the plane, or parallel to it.
        """
        e, f, g = offset - float(normal @ self.c), float(normal @ self.a), float(normal @ self.b)
        if self.shape == "line":
            # a direction this square to the normal never gets anywhere at float64's resolution
            return [e / f] if abs(f) > 4.0 * np.finfo(np.float64).eps else []
        if self.shape == "ellipse":
            most = math.hypot(f, g)
            if most <= slack or abs(e) > most + slack:
                return []
            middle, half = math.atan2(g, f), math.acos(max(-1.0, min(1.0, e / most)))
            return sorted({(middle - half) % TURN, (middle + half) % TURN})
        if self.shape == "parabola":
            return _quadratic(g, f, -e, slack)
        roots = _quadratic(0.5 * (f + g), -e, 0.5 * (f - g), slack)  # in exp t
        return sorted(math.log(y) for y in roots if y > 0.0)

    def parameter(self, p: Array) -> float:
        """The parameter of a point on (or near) the conic."""
        w = np.asarray(p) - self.c
        aa, bb, ab = float(self.a @ self.a), float(self.b @ self.b), float(self.a @ self.b)
        if self.shape == "line":
            return float(w @ self.a) / aa
        det = aa * bb - ab * ab
        f = (bb * float(w @ self.a) - ab * float(w @ self.b)) / det
        g = (aa * float(w @ self.b) - ab * float(w @ self.a)) / det
        if self.shape == "ellipse":
            return math.atan2(g, f) % TURN
        return f if self.shape == "parabola" else math.asinh(g)

    def nurbs(self, knots: list[float]) -> NurbsCurve:
        """The exact arc between the first and last of increasing parameters; each is a knot, more are added."""
        if self.shape == "line":
            ends = np.array([knots[0], knots[-1]])
            return NurbsCurve(1, np.repeat(ends, 2), self(ends))
        longest = {"ellipse": QUARTER, "hyperbola": STRETCH, "parabola": math.inf}[self.shape]
        ts = [knots[0]]
        for low, high in itertools.pairwise(knots):
            pieces = max(1, math.ceil((high - low) / longest * (1.0 - 1e-12)))
            ts.extend(np.linspace(low, high, pieces + 1)[1:].tolist())
        t = np.array(ts)
        middle, half = 0.5 * (t[1:] + t[:-1]), 0.5 * (t[1:] - t[:-1])
        if self.shape == "parabola":
            w = np.ones_like(half)
            shoulder = self.c + middle[:, None] * self.a + (t[1:] * t[:-1])[:, None] * self.b
        else:
            w = np.cos(half) if self.shape == "ellipse" else np.cosh(half)
            f, g = _basis(self.shape, middle[:, None])
            shoulder = self.c + (f * self.a + g * self.b) / w[:, None]
        points, weights = np.empty((2 * t.size - 1, 3)), np.ones(2 * t.size - 1)
        points[0::2], points[1::2], weights[1::2] = self(t), shoulder, w
        if self.shape == "ellipse" and abs(t[-1] - t[0] - TURN) <= 1e-14 * TURN:
            points[-1] = points[0]
        U = np.concatenate(([t[0]], np.repeat(t, 2), [t[-1]]))
        return NurbsCurve(2, U, points, None if self.shape == "parabola" else weights)


def line(point: Array, direction: Array) -> Conic:
    """The line through a point."""
    d = np.asarray(direction, dtype=np.float64)
    return Conic("line", np.asarray(point, dtype=np.float64), d / np.linalg.norm(d), np.zeros(3))


def circle(center: Array, axis: Array, radius: float) -> Conic:
    """The circle round an axis, from a direction that depends on the axis alone."""
    x = np.eye(3)[int(np.argmin(np.abs(axis)))]
    x = x - (x @ axis) * axis
    x /= np.linalg.norm(x)
    return Conic("ellipse", np.asarray(center), radius * x, radius * np.cross(axis, x))


def _basis(shape: Shape, t: Array) -> tuple[Array, Array]:
    if shape == "line":
        return t, np.zeros_like(t)
    if shape == "parabola":
        return t, t * t
    return (np.cos(t), np.sin(t)) if shape == "ellipse" else (np.cosh(t), np.sinh(t))


def _quadratic(a: float, b: float, c: float, slack: float) -> list[float]:
    """Real roots of a t^2 + b t + c without cancellation; a minimum within `slack` of 0 is a root."""
    if a == 0.0:
        return [-c / b] if b != 0.0 else []
    discriminant = b * b - 4.0 * a * c
    if discriminant < 0.0:
        return [-0.5 * b / a] if -0.25 * discriminant / abs(a) <= slack else []
    q = -0.5 * (b + math.copysign(math.sqrt(discriminant), b))
    roots = {q / a} | ({c / q} if q != 0.0 else set())
    return sorted(roots)
