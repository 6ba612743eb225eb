"""Thin places: two skins closer together than the fit tolerance can keep apart."""

from __future__ import annotations

import numpy as np

from patchwright.repair.checks.examination import Examination, corners_of
from patchwright.repair.checks.regions import plural, regional
from patchwright.repair.checks.registry import Finding, check

MOST = 20_000  # triangles that are probed
SKINS = 2.0  # times the fit tolerance: both skins may stray by it
OPPOSED = -0.5  # cosine: the far skin faces away


@check("thin", looks="mesh", kinds=("thin",))
def thin(exam: Examination) -> Finding:
    """Thickness of a sample of the triangles, inwards from their centres; one fact per component."""
    from patchwright.models.tree import Tree

    body = exam.oriented.triangulation
    if not len(body):
        return Finding()
    some = np.unique(np.linspace(0, len(body) - 1, MOST).astype(np.int64))
    normal = exam.normals[some]
    some, normal = some[normal.any(axis=1)], normal[normal.any(axis=1)]
    if not len(some):
        return Finding()
    centre = corners_of(body, some).mean(axis=1)
    lift = exam.tolerance.gap
    hits = Tree.of(body).first_hit(centre - lift * normal, -normal)
    hit = np.isfinite(hits.distance) & (hits.triangle >= 0)
    away = np.zeros(len(some))
    away[hit] = np.einsum("ij,ij->i", normal[hit], exam.normals[hits.triangle[hit]])
    hit &= away <= OPPOSED
    if not hit.any():
        return Finding(figures={"thinnest": None, "median_thickness": None})
    thickness = hits.distance[hit] + lift
    figures = {"thinnest": float(thickness.min()), "median_thickness": float(np.median(thickness))}
    limit = SKINS * exam.tolerance.fit
    index = some[hit][thickness < limit]

    def say(count: int, size: float) -> str:
        return f"{plural(count, 'probed triangle')} with the opposite skin closer than {exam.length(limit)}"

    own = np.unique(exam.oriented.components[index], return_inverse=True)[1].astype(np.int64)
    defects = regional(
        exam, "thin", "info", body.triangles[index], corners_of(body, index), exam.body_index[index], say, labels=own
    )
    return Finding(tuple(defects), figures)
