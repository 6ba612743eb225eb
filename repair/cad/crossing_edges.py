"""Edges in which bodies cross, drawn anew: every point of them on both surfaces to the finest length there is.

A CAD kernel's crossing curves are splines that follow both surfaces to its own tolerance, and so is the seam along
them. Which surfaces cross and where is taken from it; the curve is found again by Newton's method on both surfaces
(`crossing_curve`), corners as the point on all surfaces around, and the edges that end there are made shorter or longer
along themselves. An edge whose surfaces touch there, or whose new curve is no better, stays.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.cad.connectivity import is_point
from patchwright.models.cad.seams import edge_uses
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.surface import Surface
from patchwright.repair.cad.draft import Draft, Limits
from patchwright.repair.cad.meeting import CROSSING, across, farthest, on_all
from patchwright.repair.cad.pcurves import below, inside
from patchwright.repair.cad.seam_curves import FINE, crossing_curve, reattached

PROBES = 33
SHARE = 0.01  # of the rungs' finest length: these edges are followed more closely
LEAST = 1e-12  # of the diagonal: round-off of coordinates


def redrawn(draft: Draft, edges: Collection[int], limits: Limits) -> Draft:
    """The draft with some shared edges drawn where the surfaces of their faces cross."""
    topology = draft.topology
    around = _faces_of(draft)
    exact = replace(limits, on=limits.fit, fit=SHARE * limits.fit)
    some = {e for e in edges if _cross(draft, e, around[e])}
    corners = {v for e in some for v in topology.ends[e].tolist()}
    near: dict[int, set[int]] = {v: set() for v in corners}
    for edge, faces in around.items():
        for vertex in topology.ends[edge].tolist():
            if vertex in near:
                near[vertex] |= set(faces)
    vertices = topology.vertices.copy()
    for vertex, met in near.items():
        around_it = [draft.surface(face) for face in sorted(met)]
        place = on_all(around_it, [], vertices[vertex], limits)
        before, after = (max(farthest(s, x[None]) for s in around_it) for x in (vertices[vertex], place))
        if after < before:
            vertices[vertex] = place
    curves, loops = list(topology.curves), [list(map(list, face)) for face in topology.loops]
    for edge in sorted(around):
        ends = vertices[topology.ends[edge]]
        surfaces = tuple(draft.surface(face) for face in around[edge])
        new = _new_curve(topology.curves[edge], ends, surfaces, edge in some, exact)
        if new is None:
            continue
        images = _images(draft, edge, around[edge], new, limits, exact)
        if images is None:
            continue
        curves[edge] = new
        for face, pcurves in images.items():
            for loop in loops[face]:
                loop[:] = [replace(use, pcurve=pcurves) if use.edge == edge else use for use in loop]
    rows = tuple(tuple(tuple(loop) for loop in face) for face in loops)
    return replace(draft, topology=replace(topology, curves=tuple(curves), vertices=vertices, loops=rows))


def _faces_of(draft: Draft) -> dict[int, tuple[int, ...]]:
    """The faces of every edge that is no point."""
    found: dict[int, list[int]] = {}
    for edge, face, _, _ in edge_uses(draft.topology).tolist():
        if not is_point(draft.topology.curves[edge]):
            found.setdefault(edge, []).append(face)
    return {edge: tuple(faces) for edge, faces in found.items()}


def _cross(draft: Draft, edge: int, faces: tuple[int, ...]) -> bool:
    """Whether an edge is between two faces whose surfaces cross all along it."""
    if len(faces) != 2 or faces[0] == faces[1]:
        return False
    curve = draft.topology.curves[edge]
    a, b = (draft.surface(face) for face in faces)
    return bool(across(a, b, curve(np.linspace(*curve.domain, PROBES))).min() >= CROSSING)


def _new_curve(
    curve: NurbsCurve, ends: Array, surfaces: tuple[Surface, ...], crosses: bool, exact: Limits
) -> NurbsCurve | None:
    """The edge's new curve; None where it stays."""
    off = float(np.linalg.norm(curve(np.array(curve.domain)) - ends, axis=1).max())
    if crosses:
        new = crossing_curve(surfaces[0], surfaces[1], curve, ends, exact)
        own = _off(curve, surfaces)
        if new is not None and _off(new, surfaces) < own:
            return new
        return curve if own <= exact.on else None  # it lies there to round-off, though its images need not
    if off <= LEAST * exact.diagonal:
        return None
    moved = reattached(curve, ends, surfaces[:1], exact)
    return None if moved is curve else moved


def _off(curve: NurbsCurve, surfaces: tuple[Surface, ...]) -> float:
    points = curve(np.linspace(*curve.domain, 4 * PROBES))
    return max(farthest(surface, points) for surface in surfaces)


def _images(
    draft: Draft, edge: int, faces: tuple[int, ...], curve: NurbsCurve, limits: Limits, exact: Limits
) -> dict[int, NurbsCurve] | None:
    """The curve's image on each face; None where one has none, or uses the edge twice."""
    out = {}
    for face in faces:
        uses = [use for loop in draft.topology.loops[face] for use in loop if use.edge == edge]
        if len(uses) != 1:
            return None
        pcurve, surface = uses[0].pcurve, draft.surface(face)
        found = below(surface, curve, FINE * exact.fit, near=pcurve(np.array([pcurve.domain[0]]))[0])
        if found.residual > limits.on or not inside(surface, found.pcurve):
            return None
        out[face] = found.pcurve
    return out
