"""From a point on a tessellation to the surface it stands for: Newton's method on one parametric surface.

Source: Hamann, Jean, Razdan, section 3 (HJR 8-10): a hit on a triangle of a parametric face goes over the barycentric
(u, v) to the surface. The paper stops at S(u, v), which lies beside the ray; here (u, v, t) are solved so that the
point lies on the surface *and* on the ray. All points of one surface go together, each with its own outcome.

Limits: the surface's whole domain counts, not its trimming loops; where the surface has no tangent plane (a pole) the
step is singular and the point stalls.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.surface import Surface

STEPS = 24  # Newton steps, halvings included; from a tessellation's own corners three or four are usual
CLOSED = 1e-9  # of the surface's extent: a direction whose ends are nearer than this runs on across its seam


class Outcome(IntEnum):
    """How the search of one point ended."""

    CONVERGED = 0
    LEFT_DOMAIN = 1
    STALLED = 2
    STRAYED = 3
    NO_SURFACE = 4

    @property
    def sentence(self) -> str:
        """The reason in words."""
        return (
            "lies on the true surface",
            "lies where the true surface ends",
            f"did not settle in {STEPS} steps",
            "settled farther from the triangle than the triangle is long",
            "the triangle comes from no surface",
        )[self.value]


@dataclass(frozen=True, slots=True, eq=False)
class OnSurface:
    """(n, 3) points on the surface, (n, 2) parameters, (n,) place t on the segment (zero for feet), (n,) `Outcome`."""

    points: Array
    uv: Array
    t: Array
    status: IntArray


@dataclass(frozen=True, slots=True, eq=False)
class Bounds:
    """The box (u, v) stays in: `low`, `high` (2,), and which directions are `closed` (2,) and run across their seam."""

    low: Array
    high: Array
    closed: BoolArray

    @classmethod
    def of(cls, surface: Surface, uv: Array) -> Bounds:
        """The domain; a direction is closed where its ends meet all along the parameters in use, `uv` (k, 2)."""
        low, high = np.array(surface.domain, dtype=np.float64).T
        closed = np.zeros(2, dtype=bool)
        some = np.clip(np.linspace(uv.min(axis=0), uv.max(axis=0), 5), low, high)
        size = float(np.ptp(surface(some[:, 0], some[:, 1]), axis=0).max())
        for k in (0, 1):
            if np.isfinite([low[k], high[k]]).all():
                ends = []
                for at in (low[k], high[k]):
                    row = some.copy()
                    row[:, k] = at
                    ends.append(surface(row[:, 0], row[:, 1]))
                size = max(size, float(np.ptp(np.concatenate(ends), axis=0).max()))
                closed[k] = bool(np.linalg.norm(ends[0] - ends[1], axis=1).max() <= CLOSED * size)
        return cls(low, high, closed)

    def kept(self, uv: Array) -> Array:
        """`uv` brought back into the box: round a closed direction, to the border of any other."""
        out = uv.copy()
        for k in np.flatnonzero(self.closed):
            width = self.high[k] - self.low[k]
            out[:, k] = self.low[k] + np.mod(out[:, k] - self.low[k], width)
        return np.asarray(np.clip(out, self.low, self.high))

    def outward(self, uv: Array, step: Array) -> BoolArray:
        """(n, 2) in which directions the step leads out of the box from its border."""
        out = ((uv <= self.low) & (step < 0.0)) | ((uv >= self.high) & (step > 0.0))
        return np.asarray(out & ~self.closed)


def on_segments(
    surface: Surface,
    uv: Array,
    t: Array,
    a: Array,
    b: Array,
    accuracy: float,
    bounds: Bounds | None = None,
    steps: int = STEPS,
) -> OnSurface:
    """Where the segments' lines meet the surface: S(u, v) = (1 - t) a + t b, from starts nearby.

    Parameters
    ----------
    uv, t : (n, 2) and (n,) the starts
    a, b : (n, 3) ends of the segments (HJR 6)
    accuracy : a point has converged when |S - ((1 - t) a + t b)| is below it; a length, raised to round-off
    bounds : of the surface, when they are known already
    steps : most steps taken

    Returns
    -------
    OnSurface; where a point did not converge, the nearest that was reached.
    """
    box = bounds or Bounds.of(surface, uv)
    along = b - a
    uv, t = box.kept(uv), t.astype(np.float64)
    status = np.full(len(uv), int(Outcome.STALLED))
    points = np.asarray(surface(uv[:, 0], uv[:, 1]))
    rest = points - a - t[:, None] * along
    size = np.linalg.norm(rest, axis=1)
    enough = np.maximum(accuracy, _round_off(a, b))
    on = np.arange(len(uv))
    left = np.zeros(len(uv), dtype=bool)
    step = np.zeros((len(uv), 3))
    fresh = np.ones(len(uv), dtype=bool)  # the step is to be computed anew, not to be halved
    for _ in range(steps):
        on = on[size[on] > enough[on]]
        if not len(on):
            break
        new = on[fresh[on]]
        if len(new):
            Su, Sv = surface(uv[new, 0], uv[new, 1], (1, 0)), surface(uv[new, 0], uv[new, 1], (0, 1))
            step[new] = _solved(Su, Sv, -along[new], -rest[new])
            left[new] = box.outward(uv[new], step[new, :2]).any(axis=1)
        trial_uv = box.kept(uv[on] + step[on, :2])
        trial_t = t[on] + step[on, 2]
        trial = np.asarray(surface(trial_uv[:, 0], trial_uv[:, 1]))
        off = trial - a[on] - trial_t[:, None] * along[on]
        length = np.linalg.norm(off, axis=1)
        better = length < size[on]
        won = on[better]
        uv[won], t[won], points[won] = trial_uv[better], trial_t[better], trial[better]
        rest[won], size[won] = off[better], length[better]
        fresh[on] = better
        step[on[~better]] *= 0.5
    status[on[left[on]]] = int(Outcome.LEFT_DOMAIN)
    status[size <= enough] = int(Outcome.CONVERGED)
    return OnSurface(points, uv, t, status)


def feet(surface: Surface, uv: Array, queries: Array, accuracy: float, bounds: Bounds | None = None) -> OnSurface:
    """The feet of points on the surface, from starts nearby, by damped Gauss-Newton steps.

    The rate is distance times curvature: a few steps for what lies near the surface. `queries` (n, 3); a foot is
    settled when its next step is shorter than `accuracy`: CONVERGED where it is square below its point, LEFT_DOMAIN
    where it is the nearest place of the border and square steps would lead out.
    """
    box = bounds or Bounds.of(surface, uv)
    uv = box.kept(uv)
    status = np.full(len(uv), int(Outcome.STALLED))
    points = np.asarray(surface(uv[:, 0], uv[:, 1]))
    size = np.linalg.norm(points - queries, axis=1)
    enough = np.maximum(accuracy, _round_off(queries, points))
    on, share = np.arange(len(uv)), np.ones(len(uv))
    for _ in range(STEPS):
        Su, Sv = surface(uv[on, 0], uv[on, 1], (1, 0)), surface(uv[on, 0], uv[on, 1], (0, 1))
        away = queries[on] - points[on]
        square, move = _square_step(Su, Sv, away)
        out = box.outward(uv[on], square)
        for k, other in ((0, Sv), (1, Su)):  # at a border: slide along it
            slide = np.einsum("ij,ij->i", away, other)
            speed = np.linalg.norm(other, axis=1)
            alone = np.divide(slide, speed**2, out=np.zeros_like(slide), where=speed > 0.0)
            stuck = out[:, k]
            square[stuck, k], square[stuck, 1 - k] = 0.0, np.where(out[:, 1 - k], 0.0, alone)[stuck]
        again = box.outward(uv[on], square)
        square[again] = 0.0
        move = np.where(out.any(axis=1), np.linalg.norm(square[:, :1] * Su + square[:, 1:] * Sv, axis=1), move)
        settled = move <= enough[on]
        ended = np.where(out.any(axis=1), int(Outcome.LEFT_DOMAIN), int(Outcome.CONVERGED))
        status[on[settled]] = ended[settled]
        on, square = on[~settled], square[~settled]
        if not len(on):
            break
        trial_uv = box.kept(uv[on] + share[on, None] * square)
        trial = np.asarray(surface(trial_uv[:, 0], trial_uv[:, 1]))
        length = np.linalg.norm(trial - queries[on], axis=1)
        better = (
            length <= size[on] + enough[on]
        )  # near the foot the distance is flat: round-off must not stop the steps
        won = on[better]
        uv[won], points[won], size[won] = trial_uv[better], trial[better], length[better]
        share[on] = np.where(better, 1.0, 0.5 * share[on])
    return OnSurface(points, uv, np.zeros(len(uv)), status)


def _square_step(Su: Array, Sv: Array, away: Array) -> tuple[Array, Array]:
    """(n, 2) the step towards the foot in the tangent plane, and (n,) its length; zero where there is no plane."""
    E, F, G = (np.einsum("ij,ij->i", x, y) for x, y in ((Su, Su), (Su, Sv), (Sv, Sv)))
    f, g = np.einsum("ij,ij->i", away, Su), np.einsum("ij,ij->i", away, Sv)
    det = E * G - F * F
    sound = det > 8.0 * np.finfo(np.float64).eps * E * G
    safe = np.where(sound, det, 1.0)
    step = np.where(sound, [(G * f - F * g) / safe, (E * g - F * f) / safe], 0.0).T
    length = np.linalg.norm(step[:, :1] * Su + step[:, 1:] * Sv, axis=1)
    return step, np.where(sound, length, np.inf)


def _solved(x: Array, y: Array, z: Array, right: Array) -> Array:
    """(n, 3) solutions of [x y z] s = right by Cramer's rule; zero where the three are dependent to round-off."""
    yz = np.cross(y, z)
    det = np.einsum("ij,ij->i", x, yz)
    scale = np.linalg.norm(x, axis=1) * np.linalg.norm(y, axis=1) * np.linalg.norm(z, axis=1)
    sound = np.abs(det) > 8.0 * np.finfo(np.float64).eps * scale
    top = np.stack(
        [
            np.einsum("ij,ij->i", right, yz),
            np.einsum("ij,ij->i", x, np.cross(right, z)),
            np.einsum("ij,ij->i", x, np.cross(y, right)),
        ],
        axis=1,
    )
    return np.asarray(np.divide(top, det[:, None], out=np.zeros_like(top), where=sound[:, None]))


def _round_off(a: Array, b: Array) -> Array:
    """(n,) what the coordinates' own last digits allow."""
    return np.asarray(16.0 * np.finfo(np.float64).eps * np.maximum(np.abs(a), np.abs(b)).max(axis=1, initial=0.0))
