"""Sheets that run past each other: trimmed where they cross, or cut back in the middle of the overlap for a bridge.

Two rims overlap when each lies on the other's surface, behind it (`Rim.overlaps`). Where the two sheets cross, what
lies between the crossing and the rims goes, and nothing has to be invented. Where they do not (one lies above the
other) or what is left would not close, both are cut back to the middle of the overlap: a narrow gap, bridged later.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.errors import GeometryError
from patchwright.models.level_cut import level_cut
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation
from patchwright.repair.mender.mended import Action, Work, middle
from patchwright.repair.mender.rims import Rim, classify_rims
from patchwright.repair.mender.weld import weld

FLANGE = 1.5  # times width by length of the overlaps: what is trimmed has no more area
BACK = 0.05  # of an overlap's width: each sheet is cut back so far past the middle at least
STEPS = 20  # points of a rim within each width of its overlap: its distance is right to 1e-3 of the width


@dataclass(frozen=True, slots=True, eq=False)
class _Overlap:
    """Rims that overlap, and (m,) which triangles belong to their sheets."""

    rims: list[Rim]
    sheets: BoolArray
    label: IntArray  # (m,) the sheet of every triangle

    def key(self, points: Array) -> bytes:
        return points[self.rims[0].loop].tobytes()


def trim_overlaps(work: Work) -> None:
    """Trim every group of sheets whose rims overlap, or cut them back; what allows neither stays as it is."""
    tried: set[bytes] = set()
    while True:
        fresh = [group for group in _overlaps(work) if group.key(work.now.vertices) not in tried]
        if not fresh:
            return
        tried.add(fresh[0].key(work.now.vertices))
        if not _trim(work, fresh[0]):
            _cut_back(work, fresh[0])


def _overlaps(work: Work) -> list[_Overlap]:
    """Groups of sheets that hang together by rims that overlap each other."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    adjacency = work.adjacency()
    if not adjacency.free.any():
        return []
    rims = classify_rims(work.now, adjacency, work.tolerance)
    past = [rim for rim in rims if rim.overlaps is not None and rims[rim.overlaps].overlaps is not None]
    if not past:
        return []
    label = np.asarray(adjacency.components())
    one = np.array([label[rim.triangles[0]] for rim in past])
    other = np.array([label[rims[rim.overlaps].triangles[0]] for rim in past if rim.overlaps is not None])
    count = int(label.max()) + 1
    graph = coo_array((np.ones(len(past)), (one, other)), shape=(count, count))
    group = connected_components(graph, directed=False)[1]
    return [
        _Overlap([rim for rim, sheet in zip(past, one, strict=True) if group[sheet] == g], group[label] == g, label)
        for g in dict.fromkeys(group[one].tolist())
    ]


def _trim(work: Work, overlap: _Overlap) -> bool:
    """Cut the sheets along their crossing and drop what ends in one of the rims; whether that joined them."""
    from patchwright.ssi.cut_triangles import cut_triangles
    from patchwright.ssi.mesh_mesh import mesh_intersection
    from patchwright.ssi.outer_hull import regions

    own = np.flatnonzero(overlap.sheets)
    welded = weld(work.now.take(own), 0.0)
    try:
        found = mesh_intersection(welded.triangulation)
        pieces = cut_triangles(welded.triangulation, found)
    except GeometryError:
        return False
    if not len(pieces.seams):
        return False
    cut = Triangulation(pieces.vertices, pieces.triangles)
    adjacency = Adjacency.of(cut)
    past = np.zeros(len(cut.vertices), dtype=np.bool_)
    past[welded.clusters[np.concatenate([rim.loop for rim in overlap.rims])]] = True
    ends = _along(adjacency, past)
    region = regions(pieces)
    flange = np.zeros(int(region.max()) + 1, dtype=np.bool_)
    flange[region[ends[adjacency.triangle_edges].any(axis=1)]] = True
    keep = ~flange[region]
    allowed = FLANGE * sum(rim.perimeter * rim.widest for rim in overlap.rims)
    if not keep.any() or cut.areas[~keep].sum() > allowed:
        return False
    rest = cut.take(keep)
    after = Adjacency.of(rest)
    opened = after.free & ~np.isin(_codes(after, cut), _codes(adjacency, cut)[adjacency.free])
    if opened.any() or (after.use_count > 2).any() or after.inconsistent.any():
        return False
    parents = own[pieces.parents]
    gone = cut.take(~keep)
    reason = f"{len(overlap.rims)} rims run past each other; trimmed where their surfaces cross"
    work.drop("overlapping rims", reason, np.unique(parents[~keep]), area=float(gone.areas.sum()))
    work.actions.append(Action("trim", "re-trim", middle(gone), gone.diagonal, 0.0, reason, len(gone)))
    _replace(work, own, cut.vertices, pieces.triangles[keep], parents[keep], ~pieces.whole[keep])
    return True


def _codes(adjacency: Adjacency, triangulation: Triangulation) -> IntArray:
    """(e,) one number per edge."""
    return np.asarray(adjacency.edges.min(axis=1) * len(triangulation.vertices) + adjacency.edges.max(axis=1))


def _along(adjacency: Adjacency, past: BoolArray) -> BoolArray:
    """(e,) free edges on the rims that hold one of the vertices `past`."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    edges = adjacency.edges[adjacency.free]
    count = len(past)
    graph = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))
    rim = connected_components(graph, directed=False)[1]
    wanted = np.zeros(count, dtype=np.bool_)
    wanted[rim[past]] = True
    result = np.zeros(len(adjacency.edges), dtype=np.bool_)
    result[adjacency.free] = wanted[rim[edges[:, 0]]]
    return result


def _replace(
    work: Work, own: IntArray, vertices: Array, triangles: IntArray, parents: IntArray, cut: BoolArray
) -> None:
    """Put pieces of the triangles `own` in their place."""
    others = np.setdiff1d(np.arange(len(work.now)), own)
    parent = np.concatenate([others, parents])
    order = np.argsort(parent, kind="stable")
    rows = np.concatenate([work.now.triangles[others], triangles + len(work.now.vertices)])[order]
    cuts = np.concatenate([np.zeros(len(others), dtype=np.bool_), cut])[order]
    parent = parent[order]
    tags = None if work.now.tags is None else work.now.tags[parent]
    points = np.concatenate([work.now.vertices, vertices])
    work.follow(replace(work.now, vertices=points, triangles=rows, uv=None, tags=tags), parent, cuts)


def _cut_back(work: Work, overlap: _Overlap) -> None:
    """Cut the sheets back so far that their rims face each other across a narrow gap; undone where they do not."""
    before = work.mark()
    body = work.now
    height = np.full(len(body.vertices), np.inf)
    for rim in overlap.rims:
        sheet = overlap.label == overlap.label[rim.triangles[0]]
        rest = Tree.of(body.take(overlap.sheets & ~sheet))
        above = float(rest.closest(body.vertices[rim.loop]).distance.max())
        back = 0.5 * rim.widest + min(0.5 * rim.widest, max(BACK * rim.widest, above))
        own = np.unique(body.triangles[sheet])
        height[own] = np.minimum(height[own], _distance(body.vertices[own], body.vertices[rim.loop], rim.widest) - back)
    height[~np.isfinite(height)] = 1.0
    step = level_cut(body, height, overlap.sheets)
    keep = ~(overlap.sheets[step.origin] & (step.side < 0))
    area = float(step.triangulation.areas[~keep].sum())
    allowed = FLANGE * sum(rim.perimeter * rim.widest for rim in overlap.rims)
    reason = f"{len(overlap.rims)} rims run past each other by up to {max(rim.widest for rim in overlap.rims):.3g}"
    gone = step.triangulation.take(~keep)
    work.drop("overlapping rims", reason, np.unique(step.origin[~keep]), area=area)
    work.actions.append(
        Action("trim", "re-trim", middle(gone), gone.diagonal, 0.0, f"{reason}; cut back to the middle", len(gone))
    )
    whole = np.bincount(step.origin, minlength=len(body))[step.origin] == 1
    order = np.argsort(step.origin[keep], kind="stable")
    left = np.flatnonzero(keep)[order]
    work.follow(step.triangulation.take(left), step.origin[left], ~whole[left])
    adjacency = work.adjacency()
    rims = classify_rims(work.now, adjacency, work.tolerance)
    fresh = [rim for rim in rims if (rim.loop >= len(body.vertices)).any()]
    if area > allowed or len(fresh) != len(overlap.rims) or any(rim.kind != "gap" for rim in fresh):
        work.back(before)


def _distance(points: Array, loop: Array, width: float) -> Array:
    """(n,) distance of points to a closed polyline, right to 1e-3 of `width` near it."""
    from scipy.spatial import cKDTree

    ahead = np.roll(loop, -1, axis=0) - loop
    parts = np.maximum(1, np.ceil(STEPS * np.linalg.norm(ahead, axis=1) / width)).astype(np.int64)
    at = np.repeat(np.arange(len(loop)), parts)
    share = (np.arange(len(at)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[at]
    return np.asarray(cKDTree(loop[at] + share[:, None] * ahead[at]).query(points)[0])
