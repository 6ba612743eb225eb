"""The vertices, edges and loops of a kernel shape as our `Topology`, and each face's surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.cad import kernel
from patchwright.models.cad.convert_curve import curve_from_kernel, plain_curve, point_curve, sampled_curve
from patchwright.models.cad.convert_surface import surfaces_from_kernel
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.surface import Surface
from patchwright.models.topology import EdgeUse, Topology


@dataclass(frozen=True, slots=True, eq=False)
class ConvertedFaces:
    """What a shape's faces become.

    `v_scale` (f,) is the factor between the kernel's v and ours, `edge_tolerances` (e,) the kernel's own tolerances in
    mm, `lost` says per face why it has no loops ("" when nothing is lost).
    """

    surfaces: tuple[Surface, ...]
    v_scale: Array
    topology: Topology
    edge_tolerances: Array
    lost: tuple[str, ...]


def convert_faces(shape: Any, faces: list[Any]) -> ConvertedFaces:
    """Surfaces and topology of `faces`, all of them faces of `shape`."""
    edges, vertices = _indexed(shape, kernel.EDGE), _indexed(shape, kernel.VERTEX)
    points = [kernel.BRep_Tool.Pnt_s(kernel.as_vertex(vertices.FindKey(i))) for i in range(1, vertices.Size() + 1)]
    corners: list[tuple[float, float, float]] = [(p.X(), p.Y(), p.Z()) for p in points]
    curves: list[NurbsCurve] = []
    ends: list[tuple[int, int]] = []
    ranges: list[tuple[float, float]] = []
    tolerances: list[float] = []
    for i in range(1, edges.Size() + 1):
        edge = kernel.as_edge(edges.FindKey(i).Oriented(kernel.FORWARD))
        curve, bounds = _edge_curve(edge)
        pair = []
        for vertex, share in ((kernel.TopExp.FirstVertex_s(edge), 0), (kernel.TopExp.LastVertex_s(edge), -1)):
            if vertex.IsNull():
                at = (0.0, 0.0, 0.0) if curve is None else tuple(curve.control_points[share].tolist())
                corners.append(at)
                pair.append(len(corners) - 1)
            else:
                pair.append(vertices.FindIndex(vertex) - 1)
        curves.append(point_curve(np.array(corners[pair[0]]), *bounds) if curve is None else curve)
        ends.append((pair[0], pair[1]))
        ranges.append(bounds)
        tolerances.append(kernel.BRep_Tool.Tolerance_s(edge))
    surfaces, scales, loops, flipped, lost = [], [], [], [], []
    forwards = [kernel.as_face(face.Oriented(kernel.FORWARD)) for face in faces]
    boxes = [kernel.BRepTools.UVBounds_s(face) for face in forwards]
    converted = surfaces_from_kernel([kernel.BRep_Tool.Surface_s(face) for face in forwards], boxes)
    for face, forward, (surface, scale) in zip(faces, forwards, converted, strict=True):
        found, reason = _face_loops(forward, edges, ranges, scale, surface)
        surfaces.append(surface)
        scales.append(scale)
        loops.append(found)
        flipped.append((face.Orientation() == kernel.REVERSED) != (scale < 0.0))
        lost.append(reason)
    topology = Topology(
        np.array(corners, dtype=np.float64).reshape(-1, 3), tuple(curves), np.array(ends), tuple(loops), tuple(flipped)
    )
    return ConvertedFaces(tuple(surfaces), np.array(scales), topology, np.array(tolerances), tuple(lost))


def trims_of(loops: tuple[tuple[EdgeUse, ...], ...]) -> tuple[tuple[NurbsCurve, ...], ...] | None:
    """The loops as chains of (u, v) curves, each running from its start to its end; None when there is no loop."""
    return (
        tuple(tuple(_backwards(use.pcurve) if use.reversed else use.pcurve for use in loop) for loop in loops) or None
    )


def _backwards(curve: NurbsCurve) -> NurbsCurve:
    if curve.weights is not None:
        return curve.reversed()
    t0, t1 = curve.domain
    knots = np.clip(t0 + t1 - curve.knots[::-1], t0, t1)
    return plain_curve(curve.degree, knots, np.ascontiguousarray(curve.control_points[::-1]))


def _indexed(shape: Any, kind: Any) -> Any:
    found = kernel.IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher()
    kernel.TopExp.MapShapes_s(shape, kind, found)
    return found


def _edge_curve(edge: Any) -> tuple[NurbsCurve | None, tuple[float, float]]:
    """The edge's own curve and range; None at a pole."""
    t0, t1 = kernel.BRep_Tool.Range_s(edge)
    if kernel.BRep_Tool.Degenerated_s(edge):
        return None, (t0, t1)
    curve = kernel.BRep_Tool.Curve_s(edge, 0.0, 0.0)
    if curve is None and kernel.BRepLib.BuildCurve3d_s(edge):
        curve = kernel.BRep_Tool.Curve_s(edge, 0.0, 0.0)
    if curve is None:  # only the faces know it: follow it on the first one's surface
        return sampled_curve(kernel.BRepAdaptor_Curve(edge), t0, t1), (t0, t1)
    return curve_from_kernel(curve, t0, t1), (t0, t1)


def _face_loops(
    face: Any, edges: Any, ranges: list[tuple[float, float]], scale: float, surface: Surface
) -> tuple[tuple[tuple[EdgeUse, ...], ...], str]:
    outer = kernel.BRepTools.OuterWire_s(face)
    wires, rest = [], kernel.TopoDS_Iterator(face)
    while rest.More():
        if rest.Value().ShapeType() == kernel.WIRE:
            wires.append(kernel.as_wire(rest.Value()))
        rest.Next()
    wires.sort(key=lambda wire: not wire.IsSame(outer))
    loops = []
    for wire in wires:
        uses = []
        for edge in _ordered_edges(wire, face):
            number = edges.FindIndex(edge) - 1
            pcurve = kernel.BRep_Tool.CurveOnSurface_s(edge, face, 0.0, 0.0)
            if pcurve is None:
                return (), f"edge {number + 1} has no curve in the face's parameters"
            flat = curve_from_kernel(pcurve, *kernel.BRep_Tool.Range_s(edge, face))
            backwards = (edge.Orientation() == kernel.REVERSED) != (scale < 0.0)
            uses.append(EdgeUse(number, backwards, _fitted(flat, ranges[number], scale, surface)))
        if uses:
            loops.append(tuple(uses[::-1] if scale < 0.0 else uses))
    return tuple(loops), ""


def _ordered_edges(wire: Any, face: Any) -> list[Any]:
    """The wire's edges head to tail; in stored order where the wire is broken."""
    stored, it = [], kernel.TopoDS_Iterator(wire)
    while it.More():
        if it.Value().ShapeType() == kernel.EDGE:
            stored.append(kernel.as_edge(it.Value()))
        it.Next()
    ordered, walk = [], kernel.BRepTools_WireExplorer(wire, face)
    while walk.More():
        ordered.append(walk.Current())
        walk.Next()
    return ordered if len(ordered) == len(stored) else stored


def _fitted(flat: NurbsCurve, bounds: tuple[float, float], scale: float, surface: Surface) -> NurbsCurve:
    """The pcurve on the edge's own range, in our v, round-off beyond the surface's domain clipped."""
    knots, points = flat.knots, flat.control_points
    t0, t1 = flat.domain
    if (t0, t1) != bounds:
        knots = np.clip(bounds[0] + (knots - t0) * ((bounds[1] - bounds[0]) / (t1 - t0)), *bounds)
    if scale != 1.0:
        points = points * np.array([1.0, scale])
    low, high = np.array(surface.domain).T
    inside = np.clip(points, low, high)
    if 0.0 < np.abs(inside - points).max() <= 1e-7 * (high - low).max():
        points = inside
    if knots is flat.knots and points is flat.control_points:
        return flat
    if flat.weights is None:
        return plain_curve(flat.degree, knots, points)
    return NurbsCurve(flat.degree, knots, points, flat.weights)
