"""CAD faces that a file holds twice: the same surface within the same edges, to round-off. One of them stays.

Two faces are copies where every point of either's border lies on the other's, and points between lie on the other's
surface. The one that shares fewer edges with other faces is dropped, of equals the later one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.analytic import Cone, Cylinder, Sphere, Torus
from patchwright.models.arrays import Array
from patchwright.models.assembly import Assembly
from patchwright.models.cad.connectivity import is_point
from patchwright.models.cad.editing import compacted
from patchwright.models.closest_point import closest_on_curve
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.surface import Surface
from patchwright.models.topology import Topology
from patchwright.repair.cad.outcome import point
from patchwright.repair.cad.pcurves import parameters, widened
from patchwright.repair.result import LedgerEntry, Rung

COINCIDENT = 1e-6  # of the diagonal: faces this near to each other are one
SAMPLES = 17  # per edge
INSIDE = 32  # points of a face's triangles compared with the other's surface, at most


def without_copies(model: Assembly) -> tuple[Assembly, tuple[LedgerEntry, ...]]:
    """The model with one face of each set of copies, and an entry for each that is gone."""
    if model.topology is None:
        return model, ()
    near = COINCIDENT * model.diagonal
    gone: dict[int, int] = {}
    for a, b in _candidates(model, near):
        if a not in gone and b not in gone and _same(model, a, b, near):
            keep, drop = (a, b) if _shared(model.topology, a) >= _shared(model.topology, b) else (b, a)
            gone[drop] = keep
    if not gone:
        return model, ()
    entries = tuple(
        LedgerEntry(
            "copy of a face dropped",
            Rung.DROP,
            (model.parts[drop].name,),
            f"it lies on {model.parts[keep].name} within the same edges to {near:.2g}",
            area=float(model.parts[drop].triangulation.areas.sum()),
            tolerance=near,
            where=point(model.parts[drop].triangulation.bounds.mean(axis=0)),
            size=model.parts[drop].triangulation.diagonal,
        )
        for drop, keep in sorted(gone.items())
    )
    left = [face for face in range(len(model.parts)) if face not in gone]
    topology = replace(
        model.topology,
        loops=tuple(model.topology.loops[face] for face in left),
        flipped=tuple(model.topology.flipped[face] for face in left),
    )
    parts = tuple(model.parts[face] for face in left)
    return replace(model, parts=parts, topology=compacted(topology), native=None), entries


def _candidates(model: Assembly, near: float) -> list[tuple[int, int]]:
    """Pairs of faces whose borders have one box."""
    from scipy.spatial import cKDTree

    boxes = []
    for face in range(len(model.parts)):
        curves = _border(model, face)
        points = (
            np.concatenate([c(np.linspace(*c.domain, SAMPLES)) for c in curves]) if curves else np.full((1, 3), np.nan)
        )
        boxes.append(np.concatenate([points.min(axis=0), points.max(axis=0)]))
    known = np.flatnonzero(np.isfinite(boxes).all(axis=1))
    if len(known) < 2:
        return []
    # samples of one border may be elsewhere on the other, so the boxes differ by more than the borders
    roughly = max(near, 1e-3 * model.diagonal)
    pairs = cKDTree(np.array(boxes)[known]).query_pairs(roughly)
    return sorted((int(known[i]), int(known[j])) for i, j in pairs)


def _same(model: Assembly, a: int, b: int, near: float) -> bool:
    one, other = _border(model, a), _border(model, b)
    if not (_lies_on(one, other, near) and _lies_on(other, one, near)):
        return False
    surface = model.parts[b].surface
    mesh = model.parts[a].triangulation
    if surface is None or not len(mesh):
        return False
    corners = mesh.vertices[:: max(1, len(mesh.vertices) // INSIDE)]
    return float(np.linalg.norm(_feet(surface, corners) - corners, axis=1).max()) <= near


def _feet(surface: Surface, points: Array) -> Array:
    """(k, 3) feet of points in any order: parameters that run round are taken back into one turn."""
    uv = parameters(surface, points)
    for k, kinds in enumerate(((Cylinder, Cone, Sphere, Torus), (Torus,))):
        if isinstance(surface, kinds):
            low = surface.domain[k][0]
            uv[:, k] = low + np.mod(uv[:, k] - low, 2.0 * np.pi)
    wide = widened(surface, uv)
    u, v = np.clip(uv, *np.array(wide.domain).T).T
    return np.asarray(wide(u, v))


def _border(model: Assembly, face: int) -> list[NurbsCurve]:
    topology = model.topology
    assert topology is not None
    edges = dict.fromkeys(use.edge for loop in topology.loops[face] for use in loop)
    return [topology.curves[edge] for edge in edges if not is_point(topology.curves[edge])]


def _lies_on(curves: list[NurbsCurve], others: list[NurbsCurve], near: float) -> bool:
    points = np.concatenate([curve(np.linspace(*curve.domain, SAMPLES)) for curve in curves])
    best: Array = np.full(len(points), np.inf)
    for other in others:
        far = best > near
        if not far.any():
            break
        best[far] = np.minimum(best[far], closest_on_curve(other, points[far]).distance)
    return bool((best <= near).all())


def _shared(topology: Topology, face: int) -> int:
    """How many of a face's edges other faces use too."""
    counts = topology.use_counts()
    return sum(int(counts[use.edge] > 1) for loop in topology.loops[face] for use in loop)
