"""Voids at symmetry planes: where a half model's border leaves the plane though the surface should not end there.

A rim in a symmetry plane is planned to stay open, and what is missing beside it is part of that rim: no hole of its
own. Where such a rim leaves the plane, there is a *stretch* off it from one point in the plane to another. A short
stretch that ends near where it began is a notch (a triangle missing at the border); one whose two sides face each other
is a slit that runs into the plane; two stretches that face each other are a slit that runs into it at both ends. They
are filled up to a new edge between points in the plane, so that the border lies in it again.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from patchwright.models.arrays import IntArray
from patchwright.repair.mender.bridge import AGREE, ASKED, FACING, Border, borders_of
from patchwright.repair.mender.mend_decided import undecided
from patchwright.repair.mender.mend_gaps import fill
from patchwright.repair.mender.mended import Work
from patchwright.repair.surroundings import SymmetryPlane

IN_PLANE = 0.5  # share of a rim's length in the plane: it is the model's border there
SMALL = 0.05  # of the model's diagonal: a notch, or the mouth of a slit, that is wider is meant
MOSTLY = 0.5  # of a stretch's length must face the other side of the slit


def fill_notches(work: Work) -> None:
    """Fill the notches and slits of the rims that reach a symmetry plane."""
    planes = work.decisions.surroundings.planes if work.decisions is not None else ()
    for plane in planes:
        adjacency = work.adjacency()
        if not adjacency.free.any():
            return
        most = SMALL * work.now.diagonal
        notches: list[Border] = []
        others: list[Border] = []
        for border in borders_of(work.now, adjacency):
            stretches, mostly = _stretches(border, plane, work.tolerance.gap)
            for one in stretches:
                (notches if mostly and one.size <= most else others).append(one)
        _fill(work, notches, f"the border leaves the symmetry plane {plane.name}: a notch")
        _fill(work, _slits(others, most), f"a slit runs into the symmetry plane {plane.name}")


def _fill(work: Work, rims: list[Border], why: str) -> None:
    singles, _ = undecided(work, tuple(rims), list(range(len(rims))), [], "bridge")
    fill(work, tuple(rims), singles, [], "bridge", why)


def _stretches(border: Border, plane: SymmetryPlane, near: float) -> tuple[list[Border], bool]:
    """The stretches of a rim from where it leaves a plane to where it is back, and whether most of it lies there.

    Each is closed by an edge in the plane; beyond that there is no surface to go on from, and its normal is zero.
    """
    off = np.abs(border.points[:, plane.axis] - plane.value) > near
    inside = ~(off | np.roll(off, -1))
    lengths = border.lengths
    if off.all():
        return [], False
    count = len(off)
    stretches = []
    for start in np.flatnonzero(off & ~np.roll(off, 1)):
        ahead = (start + np.arange(count)) % count
        run = int(np.argmin(off[ahead]))  # the first vertex back in the plane
        if run < count - 1:  # else it touches the plane in one vertex only
            stretches.append(_some(border, (start - 1 + np.arange(run + 2)) % count))
    return stretches, bool(lengths[inside].sum() >= IN_PLANE * lengths.sum())


def _some(border: Border, some: IntArray) -> Border:
    """Some consecutive vertices of a rim as a closed one."""
    normals = border.normals[some].copy()
    normals[-1] = 0.0
    return Border(border.vertices[some], border.points[some], normals, border.outward[some], border.triangles[some])


def _slits(stretches: list[Border], most: float) -> list[Border]:
    """Stretches whose sides face each other across a mouth no wider than `most`, and pairs of them, as closed rims."""
    found: list[tuple[float, list[int]]] = []
    for i, one in enumerate(stretches):
        if np.linalg.norm(one.points[-1] - one.points[0]) <= most:
            share, width = _across(one, one)
            if share >= MOSTLY:
                found.append((width, [i]))
        for j in range(i + 1, len(stretches)):
            other = stretches[j]
            mouths = [np.linalg.norm(a.points[-1] - b.points[0]) for a, b in ((one, other), (other, one))]
            if max(mouths) <= most:
                (there, width), (back, _) = _across(one, other), _across(other, one)
                if min(there, back) >= MOSTLY:
                    found.append((width, [i, j]))
    rims = []
    taken: set[int] = set()
    for _, group in sorted(found):  # narrow ones first
        if taken.isdisjoint(group):
            taken |= set(group)
            rims.append(_joined([stretches[k] for k in group]))
    return rims


def _joined(stretches: list[Border]) -> Border:
    """Stretches one after the other as one rim."""
    rim = stretches[0]
    for _, other in pairwise(stretches):
        rim = replace(
            rim,
            vertices=np.concatenate([rim.vertices, other.vertices]),
            points=np.concatenate([rim.points, other.points]),
            normals=np.concatenate([rim.normals, other.normals]),
            outward=np.concatenate([rim.outward, other.outward]),
            triangles=np.concatenate([rim.triangles, other.triangles]),
        )
    return rim


def _across(one: Border, other: Border) -> tuple[float, float]:
    """Share of a stretch's length from which the surface would go on to another (or its own other side), mean way.

    Its last edge, the one in the plane, does not count.
    """
    middles, lengths = one.middles[:-1], one.lengths[:-1]
    some = np.unique(np.linspace(0, len(middles) - 1, min(len(middles), ASKED)).astype(np.int64))
    across = other.middles[None, :-1] - middles[some, None]
    way = np.linalg.norm(across, axis=2)
    ahead = np.einsum("ijk,ik->ij", across, one.outward[some])
    met = -np.einsum("ijk,jk->ij", across, other.outward[:-1])
    agree = one.normals[some] @ other.normals[:-1].T
    faces = (ahead > FACING * way) & (met > FACING * way) & (agree > AGREE) & (way > 0.0)
    nearest = np.where(faces, way, np.inf).min(axis=1)
    weight = lengths[some]
    facing = np.isfinite(nearest)
    if not facing.any():
        return 0.0, np.inf
    return float(weight[facing].sum() / weight.sum()), float(np.average(nearest[facing], weights=weight[facing]))
