"""Points where three surfaces meet: crossings of the curves that pairs of them share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.knots import divided
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation
from patchwright.ssi.intersection import Contact, IntersectionCurve

CHORDS = 8  # of each knot span of a curve
NEWTON = 20


def triple_points(curves: Sequence[IntersectionCurve], tolerance: float) -> tuple[Contact, ...]:
    """Where curves with one surface in common cross, each place once.

    Parameters
    ----------
    tolerance : length; curves nearer than this cross, and places nearer than ten times this are one
    """
    if len(curves) < 2:
        return ()
    start, end, owner, lower, upper = _chords(curves)
    margin = np.linalg.norm(end - start, axis=1)[:, None] * 0.25 + tolerance
    low, high = np.minimum(start, end) - margin, np.maximum(start, end) + margin
    boxes = np.stack([low, high, low], axis=1).reshape(-1, 3)
    pairs = Tree.of(Triangulation(boxes, np.arange(len(boxes)).reshape(-1, 3))).pairs()
    seen = np.array([sorted(c.surfaces) for c in curves])
    one, two = owner[pairs[:, 0]], owner[pairs[:, 1]]
    common = (seen[one][:, :, None] == seen[two][:, None, :]).sum(axis=(1, 2)) == 1
    pairs, one, two = pairs[common], one[common], two[common]
    out: list[Contact] = []
    for i, j in np.unique(np.stack([one, two], axis=1), axis=0).tolist():
        rows = pairs[(one == i) & (two == j)]
        middle = 0.5 * (lower + upper)
        found = _crossings(curves[i], curves[j], middle[rows[:, 0]], middle[rows[:, 1]], tolerance)
        three = tuple(sorted({*curves[i].surfaces, *curves[j].surfaces}))
        for point, gap in found:
            near = [c for c in out if c.surfaces == three and np.linalg.norm(c.point - point) < 10.0 * tolerance]
            if not near:
                out.append(Contact(point, None, None, "crossing", gap, three))
    return tuple(out)


def _chords(curves: Sequence[IntersectionCurve]) -> tuple[Array, ...]:
    """Ends, curve and parameter range of chords of all curves."""
    rows: list[tuple[Array, ...]] = []
    for k, one in enumerate(curves):
        t = divided(one.curve.breaks, CHORDS)
        p = one.curve(t)
        rows.append((p[:-1], p[1:], np.full(len(t) - 1, k), t[:-1], t[1:]))
    return tuple(np.concatenate(column) for column in zip(*rows, strict=True))


def _crossings(
    one: IntersectionCurve, other: IntersectionCurve, t: Array, s: Array, tolerance: float
) -> list[tuple[Array, float]]:
    """Nearest places of two curves from given starts, by Gauss-Newton; those nearer than the tolerance."""
    a, b = one.curve, other.curve
    for _ in range(NEWTON):
        gap = a(t) - b(s)
        da, db = a(t, nu=1), b(s, nu=1)
        aa, bb, ab = (da * da).sum(1), (db * db).sum(1), (da * db).sum(1)
        ga, gb = (da * gap).sum(1), (db * gap).sum(1)
        det = aa * bb - ab * ab
        det = np.where(det > 1e-14 * aa * bb, det, np.inf)
        t = np.clip(t - (bb * ga - ab * gb) / det, *a.domain)
        s = np.clip(s + (aa * gb - ab * ga) / det, *b.domain)
    p, q = a(t), b(s)
    gap = np.linalg.norm(p - q, axis=1)
    return [(0.5 * (p[i] + q[i]), float(gap[i])) for i in np.flatnonzero(gap <= tolerance)]
