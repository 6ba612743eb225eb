"""Rims: the loops of free edges, told apart into gaps, holes and openings.

Width does not tell: a blade's open end is narrower than many a real gap. What tells is how the surface would go on.
From each place of a rim the surface leaves straight ahead (in its own tangent plane, across the rim). Where that way
meets another stretch of rim that leaves towards it, and the surface need not fold to get there, the surface goes on
across the void: two rims that face each other so, or the two long sides of one, are a *gap*; one rim round a void that
the surface around it continues across is a *hole*. Every other rim is an *opening*: the end of a tube, whose ways ahead
never meet; two skins of a thin body that both end; the border of a sheet; a large planar end section.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.tolerance import Tolerance
from patchwright.models.triangulation import Triangulation
from patchwright.repair.mender.rim_edges import RimEdges, loop_facts, what_faces

RimKind = Literal["gap", "hole", "opening"]

MOSTLY = 0.5  # share of a rim's length that decides
SLIT = 0.15  # width to diameter: below it a rim is two long sides; a circle has 0.35 and more
SMALL = 0.1  # of the body's diagonal: a smaller void the surface goes on across is a hole even when it is planar
TINY = 0.05  # of the body's diagonal: so small a rim is a hole unless it is clearly the end of a tube
CONTINUES = 0.5  # cosine between cap and surface normals: the surface goes on across the void
CONTINUES_TINY = 0.25  # the same for a tiny rim: one triangle missing at a sharp edge
FLAT = 1e-3  # of a rim's diameter: deviation from a plane of an end section


@dataclass(frozen=True, slots=True, eq=False)
class Rim:
    """A loop of free edges.

    Parameters
    ----------
    loop : (n,) int64, its vertices along the winding of the triangles
    closed : whether the last vertex is joined to the first
    kind : "gap" (faces another rim or itself), "hole" (missing surface inside a surface) or "opening"
    partner : the index of the rim it faces, its own index for a slit or hole, None for an opening
    width : median distance across, infinite for an opening
    widest : largest distance across, infinite for an opening
    overlaps : the index of an opening rim of another component that it runs past, None when there is none
    share : share of the rim's length from which the surface goes on to another stretch of rim
    perimeter : its length
    centre : (3,) mean of its points weighted by length
    diameter : diagonal of its bounding box
    planar : largest distance of its points from their best plane
    reason : one sentence that says why it is of its kind
    triangles : (n or n - 1,) int64, the triangle at each of its edges
    """

    loop: IntArray
    closed: bool
    kind: RimKind
    partner: int | None
    overlaps: int | None
    width: float
    widest: float
    share: float
    perimeter: float
    centre: Array
    diameter: float
    planar: float
    reason: str
    triangles: IntArray


def classify_rims(
    triangulation: Triangulation, adjacency: Adjacency | None = None, tolerance: Tolerance | None = None
) -> tuple[Rim, ...]:
    """The rims of a consistently oriented triangulation, in the order of `adjacency.boundary_loops()`.

    Parameters
    ----------
    triangulation : welded and oriented as far as it goes: unmerged round-off makes every triangle a rim of its own
    adjacency : of the same triangulation, when it is at hand
    tolerance : `gap` is the distance up to which two rims coincide; default `Tolerance.of(triangulation)`
    """
    adjacency = Adjacency.of(triangulation) if adjacency is None else adjacency
    tolerance = Tolerance.of(triangulation) if tolerance is None else tolerance
    chains = adjacency.boundary_loops()
    if not len(chains):
        return ()
    loops, closed = list(chains.loops), chains.closed
    edges = _edges_of(triangulation, adjacency, loops, closed)
    label = np.asarray(adjacency.components(), dtype=np.int64)
    component = label[edges.triangle[edges.offsets[:-1]]]
    return judge_loops(edges, loops, closed, component, _diagonals(triangulation, label)[component], tolerance.gap)


def judge_loops(
    edges: RimEdges, loops: list[IntArray], closed: BoolArray, component: IntArray, body: Array, near: float
) -> tuple[Rim, ...]:
    """The rims of given edges.

    Parameters
    ----------
    edges : all loops' edges
    loops : the indices each rim is to carry
    closed : (l,) whether each loop is
    component : (l,) the connected piece of surface each loop bounds
    body : (l,) that piece's diagonal
    near : distance up to which two rims coincide
    """
    facts = loop_facts(edges)
    ahead = what_faces(edges, facts, near, 1.0)
    behind = what_faces(edges, facts, near, -1.0)
    rims = []
    for i, loop in enumerate(loops):
        partner, share, width = int(ahead.partner[i]), float(ahead.share[i]), float(ahead.width[i])
        own = edges.triangle[edges.offsets[i] : edges.offsets[i + 1]]
        sides = -1 if not closed[i] else len(own) if (own != own[0]).any() else 0
        kind, reason = _judge(
            sides, i, partner, share, width, float(facts.perimeter[i]), float(facts.diameter[i]), float(body[i]),
            float(facts.continues[i]), float(facts.planar[i]),
        )  # fmt: skip
        past = int(behind.partner[i])
        overlaps = kind == "opening" and past >= 0 and behind.share[i] >= MOSTLY and component[past] != component[i]
        widest = float(ahead.widest[i])
        if overlaps:
            width, widest = float(behind.width[i]), float(behind.widest[i])
            reason = f"it runs past rim {past} by {width:.3g}: the two surfaces overlap"
        elif kind == "opening":
            width = widest = np.inf
        elif not np.isfinite(width):
            width = widest = float(np.sqrt(facts.area[i]))
        rims.append(
            Rim(
                loop=loop,
                closed=bool(closed[i]),
                kind=kind,
                partner=None if kind == "opening" else partner if partner >= 0 else i,
                overlaps=past if overlaps else None,
                width=width,
                widest=widest,
                share=share,
                perimeter=float(facts.perimeter[i]),
                centre=facts.centre[i],
                diameter=float(facts.diameter[i]),
                planar=float(facts.planar[i]),
                reason=reason,
                triangles=own,
            )
        )
    return tuple(rims)


def _judge(
    edges: int, own: int, partner: int, share: float, width: float, perimeter: float, diameter: float, body: float,
    continues: float, planar: float,
) -> tuple[RimKind, str]:  # fmt: skip
    """Kind and reason of one rim; `edges` is 0 round a single triangle, -1 for a chain that does not close."""
    faces = share >= MOSTLY and partner >= 0
    if faces and partner != own:
        return "gap", f"{share:.0%} of it faces rim {partner} across {width:.3g} and the surface goes on across"
    if edges == 3:
        return "hole", "one triangle is missing"
    if faces and width <= SLIT * diameter:
        return (
            "gap",
            f"{share:.0%} of it faces its own other side across {width:.3g}: a slit {0.5 * perimeter:.3g} long",
        )
    if edges < 0:
        return "opening", "it ends at edges with more than two triangles: the border of a fin"
    small = diameter <= SMALL * body
    if diameter <= TINY * body and continues >= CONTINUES_TINY:
        return "hole", f"the surface around goes on across it, and its diameter is {diameter / body:.2g} of the body's"
    if continues >= CONTINUES or (faces and continues >= CONTINUES_TINY):
        if small or planar > FLAT * diameter:
            return "hole", f"the surface around goes on across it (normals agree with its cap to {continues:.2f})"
        return "opening", f"a planar rim as large as {diameter / body:.2g} of the body"
    if faces:
        return "gap", f"{share:.0%} of it faces its own other side across {width:.3g} and the surface goes on across"
    if continues <= -CONTINUES:
        return "opening", "the outer border of an open sheet"
    if planar <= FLAT * diameter:
        return "opening", f"a planar end section; only {share:.0%} of it faces another stretch of rim"
    return "opening", f"the surface does not go on across it: only {share:.0%} of it faces another stretch of rim"


def _edges_of(triangulation: Triangulation, adjacency: Adjacency, loops: list[IntArray], closed: BoolArray) -> RimEdges:
    """The rims' edges with normals and ways ahead."""
    points, triangles = triangulation.vertices, triangulation.triangles
    which, corner = np.nonzero(adjacency.free[adjacency.triangle_edges])
    tail, head = triangles[which, corner], triangles[which, (corner + 1) % 3]
    count = len(points)
    key = np.minimum(tail, head) * count + np.maximum(tail, head)
    order = np.argsort(key)
    sizes = np.array([len(loop) for loop in loops])
    flat = np.concatenate(loops)
    last = np.cumsum(sizes) - 1
    ahead = np.concatenate([flat[1:], flat[:1]])
    ahead[last] = flat[last - sizes + 1]
    real = np.ones(len(flat), dtype=np.bool_)
    real[last[~closed]] = False
    wanted = np.minimum(flat, ahead) * count + np.maximum(flat, ahead)
    at = np.searchsorted(key[order], wanted[real])
    pick = order[at]
    loop = np.repeat(np.arange(len(loops)), sizes)[real]
    offsets = np.concatenate([[0], np.cumsum(np.bincount(loop, minlength=len(loops)))]).astype(np.int64)
    owner = which[pick]
    # along the triangle's own winding, whichever way the loop runs
    p, q = points[tail[pick]], points[head[pick]]
    normal = triangulation.take(owner).normals
    along = q - p
    length = np.linalg.norm(along, axis=1)
    outward = np.cross(along, normal)
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), np.finfo(float).tiny)
    return RimEdges(offsets, loop, p, q, length, normal, outward, owner)


def _diagonals(triangulation: Triangulation, label: IntArray) -> Array:
    """The bounding box's diagonal of each component."""
    from patchwright.repair.mender._rims_kernel import boxes_of

    boxes = boxes_of(triangulation.vertices, triangulation.triangles, label, int(label.max(initial=-1)) + 1)
    return np.asarray(np.linalg.norm(boxes[:, 3:] - boxes[:, :3], axis=1))
