"""What lies straight ahead of an open end: the surface of another part that it all but reaches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.repair.checks.examination import Examination, corners_of

REACH = 0.05  # of a rim's diameter: a wall farther ahead is not what the end was meant to join
MOSTLY = 0.9  # of a rim's length from which the wall is met
SAMPLES = 64  # places of a rim that are asked


@dataclass(frozen=True, slots=True, eq=False)
class Ahead:
    """Median and largest distance from a rim to the surface ahead, and the triangles (of `body`) that are met."""

    width: float
    widest: float
    triangles: IntArray


def facing_surfaces(exam: Examination) -> dict[int, Ahead]:
    """Of the openings, by their index in `exam.rims`, those that all but reach the surface of another component."""
    from patchwright.models.tree import Tree

    body = exam.oriented.triangulation
    wanted = [i for i, rim in enumerate(exam.rims) if rim.kind == "opening" and rim.closed and rim.overlaps is None]
    if not wanted or len(exam.component_closed) < 2:
        return {}
    normals = exam.normals
    start, ahead, owner = [], [], []
    for i in wanted:
        rim = exam.rims[i]
        some = np.unique(np.linspace(0, len(rim.loop) - 1, SAMPLES).astype(np.int64))
        points = body.vertices[rim.loop]
        p, q = points[some], np.roll(points, -1, axis=0)[some]
        outward = np.cross(q - p, normals[rim.triangles[some]])
        size = np.linalg.norm(outward, axis=1)
        good = size > 0.0
        start.append(0.5 * (p + q)[good])
        ahead.append(_away(outward[good] / size[good, None], start[-1], corners_of(body, rim.triangles[some[good]])))
        owner.append(np.full(int(good.sum()), i))
    origin, way, rim_of = np.concatenate(start), np.concatenate(ahead), np.concatenate(owner)
    reach = REACH * np.array([exam.rims[i].diameter for i in rim_of])
    lift = exam.tolerance.gap
    hits = Tree.of(body).first_hit(origin + lift * way, way, reach)
    own = exam.component[np.array([exam.rims[i].triangles[0] for i in rim_of])]
    met = (hits.triangle >= 0) & (exam.component[np.maximum(hits.triangle, 0)] != own)
    found = {}
    for i in wanted:
        mine = rim_of == i
        here = mine & met
        if here.sum() >= MOSTLY * mine.sum() > 0:
            distance = hits.distance[here] + lift
            triangles = np.unique(hits.triangle[here])
            found[i] = Ahead(float(np.median(distance)), float(distance.max()), triangles)
    return found


def _away(outward: Array, middle: Array, corners: Array) -> Array:
    """Directions (k, 3) turned away from the triangles (k, 3, 3) they leave."""
    back = np.einsum("ij,ij->i", corners.mean(axis=1) - middle, outward) > 0.0
    return np.where(back[:, None], -outward, outward)
