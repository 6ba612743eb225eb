"""The Coons patch of four sides in a ring, tangent to the faces beside it where its edges were smooth.

Whether an edge was smooth the edges left around tell: the missing face's tangent plane in a corner holds both sides
that meet there, so an edge is smooth where the sides at its ends leave it in the tangent plane of the face beside it.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.errors import GeometryError
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface, Side
from patchwright.models.surface import Surface
from patchwright.models.topology import EdgeUse, Topology
from patchwright.repair.cad.draft import Limits
from patchwright.repair.cad.ring_judged import RingPatch, judged
from patchwright.repair.cad.ring_sides import Normals, SideCurve, Span, between
from patchwright.repair.cad.tangent_coons import Beside, tangent_coons, worst_angle
from patchwright.repair.patches.coons_surface import coons_surface

GRID = 15  # per direction, where a Coons patch is looked at for folds
IN = 1e-6  # of a side: how far from its ends it is looked at how the patch leaves it
MET = 0.05  # degrees: tangent planes this near to each other are one
SMOOTH = 10.0  # degrees by which a side may leave the tangent plane beside it in a corner of a smooth edge
AROUND: tuple[Side, ...] = ("v0", "u1", "v1", "u0")  # the sides of a patch as its ring runs


def coons_ring(
    topology: Topology, made: list[SideCurve], normals: Normals, limits: Limits, outward: Array | None = None
) -> RingPatch | str:
    """The patch of three or four sides, or why there is none.

    Parameters
    ----------
    made : as the ring runs, counter-clockwise as seen from outside; of three, the end of the second becomes a pole
    outward : (3,) the patch's normals are to turn towards it in the mean, if given
    """
    count = len(made)
    curves, made = [curve for curve, _ in made], list(made)
    if count == 3:
        tip = curves[1].control_points[-1]
        curves.insert(2, NurbsCurve(1, np.array([0.0, 0.0, 1.0, 1.0]), np.stack([tip, tip])))
        made.insert(2, (curves[2], []))
    corners = [curve.control_points[0] for curve in curves]
    curves = [between(c, corners[i], corners[(i + 1) % 4]) for i, c in enumerate(curves)]
    try:
        surface = coons_surface(curves[0], curves[2].reversed(), curves[3].reversed(), curves[1])
    except GeometryError as error:
        return str(error)
    surface, smooth = _with_tangents(topology, surface, [spans for _, spans in made], normals, outward)
    if _folds(surface, outward):
        return "the Coons patch of its sides folds"
    starts = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    uses = []
    for k, (_, spans) in enumerate(made):
        start, way = starts[k], starts[(k + 1) % 4] - starts[k]
        for (edge, reverse), a, b in spans:
            first, last = start + a * way, start + b * way
            if reverse:
                first, last = last, first
            t0, t1 = topology.curves[edge].domain
            uses.append(EdgeUse(edge, reverse, NurbsCurve(1, np.array([t0, t0, t1, t1]), np.stack([first, last]))))
    words = f"the Coons patch of its {count} sides{smooth}"
    patch = judged(topology, surface, (tuple(uses),), normals, words)
    if patch.residual > limits.on:
        return f"the Coons patch of its sides misses its edges by {patch.residual:.3g}"
    return patch


def _with_tangents(
    topology: Topology, coons: NurbsSurface, spans: list[list[Span]], normals: Normals, outward: Array | None
) -> tuple[NurbsSurface, str]:
    """The patch with the tangent planes beside it where its edges were smooth, and words for what it met."""
    beside = {
        side: _beside(topology, some, k, normals) for k, (side, some) in enumerate(zip(AROUND, spans, strict=True))
    }
    smooth: dict[Side, Beside] = {s: own for s, own in beside.items() if own is not None and _was_smooth(coons, s, own)}
    before = worst_angle(coons, smooth)
    if before <= MET:
        return coons, ""
    surface, after = tangent_coons(coons, smooth, MET, lambda made: not _folds(made, outward))
    if after > 0.5 * before:
        return coons, ""
    return surface, f", tangent to {len(smooth)} faces around to {after:.2g} degrees"


def _beside(topology: Topology, spans: list[Span], k: int, normals: Normals) -> Beside | None:
    """Normals along the k-th side of a ring as functions of the patch's own parameter."""
    if not spans:
        return None

    def at(t: Array) -> Array:
        share = 1.0 - t if k > 1 else t  # the ring runs against the patch there
        out = np.full((len(t), 3), np.nan)
        for (edge, reverse), a, b in spans:
            mine = (share >= a) & (share <= b)
            local = (share[mine] - a) / (b - a)
            t0, t1 = topology.curves[edge].domain
            found = normals(edge, t0 + (1.0 - local if reverse else local) * (t1 - t0))
            if found is not None:
                out[mine] = found
        return out

    return at


def _was_smooth(coons: NurbsSurface, side: Side, beside: Beside) -> bool:
    """Whether the sides at both ends of a side leave it in the tangent planes beside it."""
    k, end = (0 if side[0] == "u" else 1), int(side[1])
    low, high = coons.domain[1 - k]
    t = np.array([low, high]) + IN * (high - low) * np.array([1.0, -1.0])  # nothing leaves a pole itself
    at = np.full(2, coons.domain[k][end])
    u, v = (at, t) if k == 0 else (t, at)
    across = coons(u, v, (1, 0) if k == 0 else (0, 1))
    n = beside(t)
    size = np.linalg.norm(across, axis=1)
    if not np.isfinite(n).all() or (size <= 0.0).any():
        return False
    return bool((np.abs(np.einsum("ij,ij->i", across, n)) <= np.sin(np.radians(SMOOTH)) * size).all())


def _folds(surface: Surface, outward: Array | None) -> bool:
    """Whether the surface's normal turns away from its mean anywhere inside, vanishes there, or faces inward."""
    (u0, u1), (v0, v1) = surface.domain
    share = (np.arange(GRID) + 0.5) / GRID
    u, v = np.meshgrid(u0 + share * (u1 - u0), v0 + share * (v1 - v0), indexing="ij")
    normal = np.cross(surface(u, v, (1, 0)), surface(u, v, (0, 1))).reshape(-1, 3)
    length = np.linalg.norm(normal, axis=1)
    mean = normal.sum(axis=0)
    back = outward is not None and float(mean @ outward) <= 0.0
    return back or bool((normal @ mean <= 1e-3 * np.linalg.norm(mean) * length).any())
