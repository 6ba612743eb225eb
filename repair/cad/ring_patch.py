"""A new surface through given rings of edges: what replaces a face, or bridges a gap, on exactly those edges.

Candidates, the first that is exact first: the plane of the rings; for one ring with three or four corners the Coons
patch of its sides, which takes the tangent planes of the faces beside it where its edges were smooth; for any rings the
smoothest height over their plane. Among those that hold the edges within the tolerance and do not fold, the one that
meets the surfaces around at the smallest angle is taken.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.analytic import Plane
from patchwright.models.arrays import Array
from patchwright.models.knots import divided
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.topology import EdgeUse, Topology
from patchwright.repair.cad.coons_ring import coons_ring
from patchwright.repair.cad.draft import Limits
from patchwright.repair.cad.height_surface import Frame, Rim, height_surface
from patchwright.repair.cad.loop_shape import simple
from patchwright.repair.cad.ring_judged import RingPatch, crowded, judged
from patchwright.repair.cad.ring_sides import Normals, Steps, side_curve, sides

PROBES = 12  # per span of an edge
GOES_ON = 0.5  # cosine of the angle between the plane's normal and a neighbour's up to which its slope is taken over
ROOM = 0.01  # of a plane's size: how far its ranges reach beyond its rings
BETTER = 1.0  # degrees by which a later candidate must meet the surfaces around better


def ring_patch(topology: Topology, rings: tuple[Steps, ...], normals: Normals, limits: Limits) -> RingPatch | str:
    """The best surface through rings that run counter-clockwise as seen from outside, the outer one first.

    A sentence where none holds them.
    """
    points = [np.concatenate([points_along(topology, step) for step in ring]) for ring in rings]
    outward = newell(points[0])
    size = float(np.linalg.norm(np.ptp(np.concatenate(points), axis=0)))
    if np.linalg.norm(outward) <= limits.on * size:
        return "its edges enclose no area"
    frame = Frame.across(np.concatenate(points), outward)
    plane = plane_of(topology, rings, normals, limits)
    if plane is not None:
        return plane
    found: RingPatch | None = None
    reasons = []
    for make in (_coons, _height):
        made = make(topology, rings, frame, normals, limits)
        if isinstance(made, str):
            reasons.append(made)
        elif found is None or made.angle < found.angle - BETTER:
            found = made
    return found or "; ".join(reasons)


def plane_of(topology: Topology, rings: tuple[Steps, ...], normals: Normals, limits: Limits) -> RingPatch | None:
    """The plane of rings, the outer one first, that leave it by less than `limits.on`; None where they do not."""
    outer = np.concatenate([points_along(topology, step) for step in rings[0]])
    every = np.concatenate([points_along(topology, step) for ring in rings for step in ring])
    origin = every.mean(axis=0)
    _, _, axes = np.linalg.svd(every - origin, full_matrices=False)
    n = axes[2] if axes[2] @ newell(outer) > 0.0 else -axes[2]
    off = float(np.abs((every - origin) @ n).max())
    if off > limits.on:
        return None
    flat = Frame.across(every, n)
    loops = _projected(topology, rings, flat)
    low, high = _box(loops)
    room = ROOM * float((high - low).max())
    (u0, v0), (u1, v1) = (low - room).tolist(), (high + room).tolist()
    plane = Plane(flat.origin, n, flat.axes[0], u=(u0, u1), v=(v0, v1))
    return judged(topology, plane, loops, normals, f"the plane of its edges, which leave it by {off:.2g}")


def _coons(
    topology: Topology, rings: tuple[Steps, ...], frame: Frame, normals: Normals, limits: Limits
) -> RingPatch | str:
    if len(rings) > 1:
        return "it has holes, so no Coons patch fills it"
    found = sides(topology, rings[0])
    if len(found) not in (3, 4):
        return f"its ring has {len(found)} corners, so no Coons patch fills it"
    made = [side_curve(topology, side, limits) for side in found]
    return coons_ring(topology, made, normals, limits, frame.axes[2])


def _height(
    topology: Topology, rings: tuple[Steps, ...], frame: Frame, normals: Normals, limits: Limits
) -> RingPatch | str:
    loops = _projected(topology, rings, frame)
    if not simple(loops):
        return "its edges cross each other as seen along their mean normal, so no height over their plane fills it"
    points, directions, slopes = [], [], []
    for loop in loops:
        for use in loop:
            curve = topology.curves[use.edge]
            t = crowded(curve.breaks)
            local = frame.local(curve(t))
            along = frame.local(frame.origin + curve(t, 1))[:, :2]
            across = np.stack([along[:, 1], -along[:, 0]], axis=1)
            across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), np.finfo(float).tiny)
            beside = normals(use.edge, t)
            slope = np.full(len(t), np.nan)
            if beside is not None:
                n = beside @ frame.axes.T
                steep = n[:, 2] > GOES_ON
                slope[steep] = -np.einsum("ij,ij->i", n[steep, :2], across[steep]) / n[steep, 2]
            points.append(local)
            directions.append(across)
            slopes.append(slope)
    rim = Rim(np.concatenate(points), np.concatenate(directions), np.concatenate(slopes))
    surface, off = height_surface(frame, rim, 0.5 * limits.on)
    words = f"the smoothest height over the plane of its edges, which it meets to {off:.2g}"
    patch = judged(topology, surface, loops, normals, words)
    if patch.residual > limits.on:
        return f"the smoothest height over the plane of its edges misses them by {patch.residual:.3g}"
    return patch


def _projected(topology: Topology, rings: tuple[Steps, ...], frame: Frame) -> tuple[tuple[EdgeUse, ...], ...]:
    """The rings' edges in the frame's plane: their own curves, projected."""
    loops = []
    for ring in rings:
        row = []
        for edge, reverse in ring:
            curve = topology.curves[edge]
            flat = frame.local(curve.control_points)[:, :2]
            row.append(EdgeUse(edge, reverse, NurbsCurve(curve.degree, curve.knots, flat, curve.weights)))
        loops.append(tuple(row))
    return tuple(loops)


def _box(loops: tuple[tuple[EdgeUse, ...], ...]) -> tuple[Array, Array]:
    points = np.concatenate([use.pcurve.control_points for loop in loops for use in loop])
    return points.min(axis=0), points.max(axis=0)


def points_along(topology: Topology, step: tuple[int, bool]) -> Array:
    """(k, 3) points along an edge as the ring runs, without its last."""
    curve = topology.curves[step[0]]
    t = divided(curve.breaks, PROBES)
    return curve(t[::-1] if step[1] else t)[:-1]


def newell(points: Array) -> Array:
    """The area vector of a ring of points."""
    local = points - points.mean(axis=0)
    return np.asarray(0.5 * np.cross(local, np.roll(local, -1, axis=0)).sum(axis=0))
