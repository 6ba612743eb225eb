"""Intersection of a triangulation with a surface: every arc, every point of touch, and boxes where doubt remains.

Method. The surface falls into Bezier pieces; they are halved until every pair of a box and a triangle is excluded or
explained (`_triangle_box_kernel`): so existence and completeness come from bounds, not from samples. Arcs are joined
end to end (`mesh_surface_arcs`) and become cubics in the planes of the triangles (`plane_cubics`), which are measured
against their triangles and the surface: one that is off either leaves the answer incomplete. A plane is a mesh of
two triangles and goes to the exact predicates (`mesh_plane`).

Limits. Where the surface coincides with a triangle or touches it along a curve, and where it holds an edge of the mesh
and is curved across it, boxes are handed back as unresolved. The parameters of a curve that crosses a seam jump there,
at a knot of multiplicity 4.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.analytic import Plane
from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.errors import ParameterError
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.surface import Surface
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation
from patchwright.ssi.bezier_pieces import BezierPieces, Frame
from patchwright.ssi.intersection import Box, Contact, Intersection, IntersectionCurve, Unresolved
from patchwright.ssi.mesh_plane import intersect_mesh_plane
from patchwright.ssi.mesh_surface_arcs import Arcs, joined, loose_ends, places
from patchwright.ssi.plane_cubics import on_surface
from patchwright.ssi.triangle_planes import from_triangles, planes

BUDGET = 4_000_000  # pairs of a box and a triangle judged, one to three microseconds each
BUDGET_EACH = 32  # and this many more for each triangle beside a piece
SMALL = 1e-7  # of the size: boxes are not halved below
REACH = 1e-9  # of the size: ends of arcs nearer than this are one
MOST = 64  # unresolved boxes listed one by one
REASONS = {
    "COINCIDENT": "the surface lies in a triangle of the mesh or touches it along a curve",
    "LEFT": "boxes at the least size are neither excluded nor explained",
    "BUDGET": "the work budget is spent",
}


def intersect_mesh_surface(mesh: Triangulation, surface: Surface, tolerance: float | None = None) -> Intersection:
    """Curves and contacts of a mesh (the first) with a bounded surface (the second).

    Parameters
    ----------
    tolerance : the curves are this near the surface, length; default 1e-10 of the smaller of the two sizes. A surface
        that comes this near a triangle without crossing it touches it. Arcs are joined across ten times that (1e-9 of
        the size at least): residuals count it, and a larger one leaves the answer incomplete.

    Raises
    ------
    ParameterError : an unbounded surface, a tolerance that is not positive.
    """
    if not np.isfinite(surface.domain).all():
        raise ParameterError(f"only a bounded surface can meet a mesh, its domain is {surface.domain}")
    nurbs = surface.to_nurbs()
    frame = _frame(mesh, nurbs)
    tolerance = 1e-10 * frame.size if tolerance is None else tolerance
    if not tolerance > 0.0:
        raise ParameterError(f"the tolerance must be a positive length, got {tolerance}")
    if isinstance(surface, Plane):
        return intersect_mesh_plane(mesh, surface)
    pieces = BezierPieces.of(nurbs, frame)
    rows = _findings(mesh, pieces, frame, tolerance / frame.size)
    reach = max(REACH * frame.size, 10.0 * tolerance)
    arcs = Arcs.of(rows, mesh, surface, pieces)
    chains, points = joined(arcs, reach)
    curves = on_surface(mesh, surface, chains, tolerance)
    unresolved = _unresolved(rows, mesh, surface, pieces, curves)
    unresolved += [_astray(mesh, surface, c) for c in curves if not c.residual <= reach]
    unresolved += [
        Unresolved(((float(t), float(t + 1)), (0.0, 0.0)), box, "a curve ends inside both")
        for t, box in loose_ends(arcs, chains, mesh, surface)
    ]
    near = Arcs.touches(rows, mesh, surface, pieces, points, arcs)
    return Intersection(curves, _contacts(near, mesh, curves, reach, tolerance), (), tuple(unresolved))


def _frame(mesh: Triangulation, nurbs: NurbsSurface) -> Frame:
    """The middle of the common part of the boxes and the smaller diagonal."""
    net = nurbs.control_points.reshape(-1, 3)
    low = np.maximum(net.min(axis=0), mesh.bounds[0])
    high = np.minimum(net.max(axis=0), mesh.bounds[1])
    size = min(float(np.linalg.norm(np.ptp(net, axis=0))), mesh.diagonal)
    return Frame(0.5 * (low + high), size or 1.0)


def _findings(mesh: Triangulation, pieces: BezierPieces, frame: Frame, tol: float) -> Array:
    """The kernel's rows for all triangles with an area whose boxes meet those of pieces."""
    from patchwright.ssi import _mesh_surface_kernel as kernel

    control = pieces.nets[..., :3] / pieces.nets[..., 3:]
    low, high = control.min(axis=(1, 2)) - tol, control.max(axis=(1, 2)) + tol
    boxes = np.stack([low, high, low], axis=1).reshape(-1, 3)
    scaled = Triangulation((mesh.vertices - frame.origin) / frame.size, mesh.triangles)
    pairs = Tree.of(Triangulation(boxes, np.arange(len(boxes)).reshape(-1, 3))).pairs(Tree.of(scaled))
    pairs = pairs[scaled.areas[pairs[:, 1]] > 0.0]
    first = np.searchsorted(pairs[:, 0], np.arange(len(control) + 1))
    used, candidates = np.unique(pairs[:, 1], return_inverse=True)
    corners = scaled.corners[used]
    spread = np.stack([corners.min(axis=1), corners.max(axis=1)], axis=1)
    eps = 4.0 * np.finfo(np.float64).eps * (1.0 + float(np.abs(spread).max(initial=0.0)))
    tol = max(tol, 8.0 * eps)
    rows, _ = kernel.meet(
        pieces.nets, _goes_on(pieces, eps), first, candidates.reshape(-1), planes(corners), spread,
        tol, eps, max(SMALL, 4.0 * tol), BUDGET + BUDGET_EACH * len(pairs),
    )  # fmt: skip
    rows[:, 1] = used[rows[:, 1].astype(np.int64)] if len(rows) else 0
    return np.asarray(rows)


def _goes_on(pieces: BezierPieces, eps: float) -> BoolArray:
    """(k, 2) whether there is surface beyond the far borders of pieces: another piece, or the first across a seam."""
    net = (pieces.nets[..., :3] / pieces.nets[..., 3:]).reshape(*pieces.shape, *pieces.nets.shape[1:3], 3)
    out = np.ones((*pieces.shape, 2), dtype=np.bool_)
    out[-1, :, 0] = np.abs(net[-1, :, -1] - net[0, :, 0]).max() <= 16.0 * eps
    out[:, -1, 1] = np.abs(net[:, -1, :, -1] - net[:, 0, :, 0]).max() <= 16.0 * eps
    return out.reshape(-1, 2)


def _unresolved(
    rows: Array, mesh: Triangulation, surface: Surface, pieces: BezierPieces, curves: tuple[IntersectionCurve, ...]
) -> list[Unresolved]:
    """The boxes handed back, each with its triangle; those along curves of touch are explained."""
    from patchwright.ssi import _triangle_box_kernel as kernel

    out: list[Unresolved] = []
    touch = [c for c in curves if c.kind == "tangential"]
    for name, why in REASONS.items():
        some = rows[rows[:, 0] == getattr(kernel, name)]
        if name == "COINCIDENT" and touch and len(some):
            some = some[~_beside(some, surface, pieces, touch)]
        for row in some[:MOST]:
            t = int(row[1])
            out.append(Unresolved(((float(t), float(t + 1)), (0.0, 0.0)), _box(row, surface, pieces), why))
        if len(some) > MOST:
            whole = ((0.0, float(len(mesh))), (0.0, 0.0))
            out.append(Unresolved(whole, surface.domain, f"{why}: and {len(some) - MOST} more boxes"))
    return out


def _astray(mesh: Triangulation, surface: Surface, curve: IntersectionCurve) -> Unresolved:
    """Where a curve runs on the surface that was measured to leave the surface or its triangles."""
    box = surface.domain if curve.uv_b is None else _around(curve.uv_b.control_points, surface)
    why = f"a curve was measured {curve.residual:.1e} off the mesh or the surface: do not trust it"
    return Unresolved(((0.0, float(len(mesh))), (0.0, 0.0)), box, why)


def _around(uv: Array, surface: Surface) -> Box:
    """The least box of the domain around parameters (n, 2)."""
    low, high = np.array(surface.domain).T
    (u0, v0), (u1, v1) = np.clip([uv.min(axis=0), uv.max(axis=0)], low, high).tolist()
    return (u0, u1), (v0, v1)


def _beside(rows: Array, surface: Surface, pieces: BezierPieces, curves: list[IntersectionCurve]) -> BoolArray:
    """Boxes all of whose corners are nearer to a curve of touch than twice their own size across it."""
    piece = rows[:, 2].astype(np.int64)
    corners = np.stack([rows[:, 4:8][:, [i, 2 + j]] for i in (0, 1) for j in (0, 1)], axis=1)
    uv = Arcs.parameters(surface, pieces, np.repeat(piece, 4), corners.reshape(-1, 2))
    points = np.asarray(surface(uv[:, 0], uv[:, 1]))
    far = np.min([c.curve.closest(points).distance for c in curves], axis=0).reshape(-1, 4)
    side = points.reshape(-1, 4, 3)
    size = np.minimum(np.linalg.norm(side[:, 1] - side[:, 0], axis=1), np.linalg.norm(side[:, 2] - side[:, 0], axis=1))
    return np.asarray(far.max(axis=1) <= 2.0 * size)


def _box(row: Array, surface: Surface, pieces: BezierPieces) -> Box:
    """The box of a finding in the surface's own parameters."""
    corners = Arcs.parameters(surface, pieces, row[[2, 2]].astype(np.int64), row[4:8].reshape(2, 2).T)
    (u0, v0), (u1, v1) = corners.tolist()
    return (u0, u1), (v0, v1)


def _contacts(
    near: tuple[IntArray, Array, Array],
    mesh: Triangulation,
    curves: tuple[IntersectionCurve, ...],
    reach: float,
    tolerance: float,
) -> tuple[Contact, ...]:
    """Points of touch among triangles, parameters and points, each place once, without those on curves."""
    triangle, uv, points = near
    gap = from_triangles(points, mesh.corners[triangle])
    off = gap <= 2.0 * tolerance
    for c in curves:
        off[off] = c.curve.closest(points[off]).distance > 10.0 * reach
    uv, points, gap = uv[off], points[off], gap[off]
    place = places(points, 100.0 * reach)[0]
    out: list[Contact] = []
    for k in range(int(place.max(initial=-1)) + 1):
        some = np.flatnonzero(place == k)
        i = some[np.argmin(gap[some])]
        out.append(Contact(points[i], None, (float(uv[i, 0]), float(uv[i, 1])), "touch", float(gap[i])))
    return tuple(out)
