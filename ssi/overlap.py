"""Regions in which two surfaces coincide, with the curves that bound them and their area.

A region is made of cells certified by `coincidence`; it is bounded by the cells' sides with no certified cell beyond,
which are iso-curves of both surfaces: of the first they are exact, the other's parameters are affine along them.
"""

from __future__ import annotations

import itertools

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.ssi.coincidence import Coincidence
from patchwright.ssi.intersection import IntersectionCurve, Overlap

GAUSS = 8  # points per cell and direction of the area
ROUNDS = 6  # of halving the cells
AREA = 1e-13  # relative change of the area at which halving ends
PROBES = 10  # samples of the residual per span of the boundary
SAME = 1e-9  # of the size: sides nearer than this are one

Side = tuple[Coincidence, int, float, float, float, int]
"""A side: where, its axis of constant parameter, that parameter, the ends of the other, the region it bounds."""


def overlaps(a: NurbsSurface, b: NurbsSurface, found: list[Coincidence], size: float) -> tuple[Overlap, ...]:
    """The regions, each with all curves that bound it; sides that meet across a seam bound nothing."""
    sides: list[Side] = []
    areas: list[float] = []
    for one in found:
        labels, count = _regions(one)
        sides += [(one, axis, at, t0, t1, len(areas) + k) for axis, at, t0, t1, k in _sides(one, labels)]
        areas += [_area(one, labels == k) for k in range(count)]
    root = list(range(len(areas)))
    sides, glued = _without_seams(sides, size)
    for i, j in glued:
        root = [root[i] if r == root[j] else r for r in root]
    out = []
    for r in sorted(set(root)):
        curves = [_curve(a, b, side) for side in _chained([s for s in sides if root[s[5]] == r])]
        out.append(Overlap(tuple(curves), float(sum(x for x, k in zip(areas, root, strict=True) if k == r))))
    return tuple(out)


def _regions(found: Coincidence) -> tuple[IntArray, int]:
    """(n, m) the number of each certified cell's region, -1 elsewhere, and their count."""
    from scipy.ndimage import label

    labels, count = label(found.matched)
    return np.asarray(labels, dtype=np.int64) - 1, int(count)


def _sides(found: Coincidence, labels: IntArray) -> list[tuple[int, float, float, float, int]]:
    """Sides of cells with another region, or none, beyond: axis of the constant parameter, it, the ends, the region."""
    out = []
    for axis in (0, 1):
        grid = labels if axis == 0 else labels.T
        lines, steps = (found.a.breaks[k][found.first[0][k] :] for k in (axis, 1 - axis))
        wide = np.pad(grid, ((1, 1), (0, 0)), constant_values=-1)
        for i, j in np.argwhere(wide[1:] != wide[:-1]).tolist():
            for k in {int(wide[i, j]), int(wide[i + 1, j])} - {-1}:
                out.append((axis, float(lines[i]), float(steps[j]), float(steps[j + 1]), k))
    return out


def _without_seams(sides: list[Side], size: float) -> tuple[list[Side], list[tuple[int, int]]]:
    """The sides that are no seam: those that lie on one another have the region on both sides; and what they glue."""
    if not sides:
        return [], []
    probes = []
    for found, axis, at, t0, t1, _ in sides:
        t = np.array([t0, 0.5 * (t0 + t1), t1])
        line = np.full(3, at)
        probes.append(found.a(line, t) if axis == 0 else found.a(t, line))
    X = np.array(probes)
    gone: set[int] = set()
    glued = []
    for i, j in itertools.combinations(range(len(sides)), 2):
        turned = np.abs(X[i] - X[j][::-1]).max()
        if i not in gone and j not in gone and min(np.abs(X[i] - X[j]).max(), turned) <= SAME * size:
            gone |= {i, j}
            glued.append((sides[i][5], sides[j][5]))
    return [s for k, s in enumerate(sides) if k not in gone], glued


def _chained(sides: list[Side]) -> list[Side]:
    """Sides along one line joined end to end."""
    out: list[Side] = []
    for side in sorted(sides, key=lambda s: (id(s[0]), s[1], s[2], s[3])):
        last = out[-1] if out else None
        if last is not None and last[:3] == side[:3] and last[4] == side[3]:
            out[-1] = (*last[:4], side[4], side[5])
        else:
            out.append(side)
    return out


def _curve(a: NurbsSurface, b: NurbsSurface, side: Side) -> IntersectionCurve:
    found, axis, at, t0, t1, _ = side
    curve = a.iso_curve("v" if axis == 0 else "u", at).restricted(t0, t1)
    ends = np.array([[at, t0], [at, t1]] if axis == 0 else [[t0, at], [t1, at]])
    other = np.clip(found.change.back(ends), *np.array(b.domain).T)
    U = np.array([t0, t0, t1, t1])
    uv_a, uv_b = NurbsCurve(1, U, ends), NurbsCurve(1, U, other)
    t = np.unique(np.concatenate([np.linspace(p, q, PROBES + 1) for p, q in itertools.pairwise(curve.breaks)]))
    x = curve(t)
    on = [s(*np.clip(uv(t), *np.array(s.domain).T).T) for s, uv in ((a, uv_a), (b, uv_b))]
    pairs = ((x, on[0]), (x, on[1]), (on[0], on[1]))
    residual = max(float(np.linalg.norm(p - q, axis=1).max()) for p, q in pairs)
    closed = bool(np.linalg.norm(x[-1] - x[0]) <= SAME * float(np.ptp(x, axis=0).max()))
    return IntersectionCurve(curve, uv_a, uv_b, x, "overlap-boundary", closed, residual)


def _area(found: Coincidence, cells: Array) -> float:
    """The area of cells on a: Gauss quadrature, the cells halved until it stays."""
    i, j = np.nonzero(cells)
    us, vs = (found.a.breaks[k][found.first[0][k] :] for k in (0, 1))
    box = np.stack((us[i], us[i + 1], vs[j], vs[j + 1]), axis=1)
    x, w = np.polynomial.legendre.leggauss(GAUSS)
    last = np.inf
    for _ in range(ROUNDS):
        mid, half = 0.5 * (box[:, ::2] + box[:, 1::2]), 0.5 * (box[:, 1::2] - box[:, ::2])
        u, v = (mid[:, k, None] + half[:, k, None] * x for k in (0, 1))
        jets = found.a.derivatives(u[:, :, None], v[:, None, :], (1, 1))
        speed = np.linalg.norm(np.cross(jets[..., 1, 0, :], jets[..., 0, 1, :]), axis=-1)
        area = float(np.einsum("nij,i,j,n->", speed, w, w, half.prod(axis=1)))
        if abs(area - last) <= AREA * area:
            break
        last = area
        box = np.concatenate([_half(_half(box, 0, s), 1, t) for s in (0, 1) for t in (0, 1)])
    return area


def _half(box: Array, axis: int, side: int) -> Array:
    out = box.copy()
    out[:, 2 * axis + 1 - side] = 0.5 * (box[:, 2 * axis] + box[:, 2 * axis + 1])
    return out
