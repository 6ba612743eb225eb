"""Notches at symmetry planes: triangles missing at a half model's border leave it off the plane; they are filled to it.

A rim in a symmetry plane is planned to stay open, and a triangle missing beside it is part of that rim: no hole of its
own. Where such a rim leaves the plane and comes back nearby, the surface between is put back, its new edge in the
plane.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import IntArray
from patchwright.repair.bridge import Border, borders_of
from patchwright.repair.mend_decided import undecided
from patchwright.repair.mend_gaps import fill
from patchwright.repair.mended import Work

IN_PLANE = 0.5  # share of a rim's length in the plane: it is the model's border there
SMALL = 0.05  # of the model's diagonal: a notch that is wider is meant


def fill_notches(work: Work) -> None:
    """Fill the small notches of the rims that lie in a symmetry plane."""
    planes = work.decisions.surroundings.planes if work.decisions is not None else ()
    for plane in planes:
        adjacency = work.adjacency()
        if not adjacency.free.any():
            return
        notches = [
            notch
            for border in borders_of(work.now, adjacency)
            for notch in _notches(border, plane.axis, plane.value, work.tolerance.gap)
            if notch.size <= SMALL * work.now.diagonal
        ]
        rims = tuple(notches)
        singles, _ = undecided(work, rims, list(range(len(rims))), [], "bridge")
        fill(work, rims, singles, [], "bridge", f"the border leaves the symmetry plane {plane.name}: a notch")


def _notches(border: Border, axis: int, value: float, near: float) -> list[Border]:
    """The stretches of a rim from where it leaves a plane to where it is back, each as a rim of its own."""
    off = np.abs(border.points[:, axis] - value) > near
    inside = ~(off | np.roll(off, -1))
    lengths = border.lengths
    if not off.any() or lengths[inside].sum() < IN_PLANE * lengths.sum():
        return []
    first = np.flatnonzero(off & ~np.roll(off, 1))
    count = len(off)
    notches = []
    for start in first:
        ahead = (start + np.arange(count)) % count
        run = int(np.argmin(off[ahead]))  # the first vertex back in the plane
        if run:
            notches.append(_stretch(border, (start - 1 + np.arange(run + 2)) % count))
    return notches


def _stretch(border: Border, some: IntArray) -> Border:
    """Some consecutive vertices of a rim as a closed one; beyond its last edge there is no surface to go on from."""
    normals = border.normals[some].copy()
    normals[-1] = 0.0
    return Border(border.vertices[some], border.points[some], normals, border.outward[some], border.triangles[some])
