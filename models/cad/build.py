"""Kernel faces, edges and vertices out of a `Topology`: shared edges with the exact 3-D curve and pcurves given.

Nothing is fitted, projected or re-parametrised, and no tolerance is inflated: an edge gets the measured deviation of
its pcurves from its 3-D curve, at least the kernel's own resolution.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.assembly import Assembly
from patchwright.models.cad import kernel
from patchwright.models.cad.connectivity import is_point
from patchwright.models.cad.convert_curve import curve_to_kernel
from patchwright.models.cad.convert_surface import surface_to_kernel
from patchwright.models.errors import EngineError
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.surface import Surface
from patchwright.models.topology import EdgeUse, Topology

RESOLUTION = 1e-7  # the kernel's smallest tolerance (Precision::Confusion)


def build_faces(assembly: Assembly, deviation: Array, surfaces: dict[int, tuple[Any, float]]) -> list[Any]:
    """One kernel face per part, sharing edges as the topology says, oriented outward.

    Parameters
    ----------
    deviation : (e,) measured distance of each edge's 3-D curve from its faces
    surfaces : the kernel's own surface and v factor of parts that keep theirs, by part
    """
    topology = assembly.topology
    if topology is None:
        raise EngineError("faces were asked to share edges, but the assembly has no topology")
    edges = _edges(topology, np.maximum(deviation, RESOLUTION))
    builder = kernel.BRep_Builder()
    faces = []
    for i, part in enumerate(assembly.parts):
        if part.surface is None:
            raise EngineError(f"part {part.name!r} has no surface")
        surface, v_factor = surfaces[i] if i in surfaces else surface_to_kernel(part.surface)
        loops = topology.loops[i]
        if not loops:
            faces.append(natural_face(part.surface, surface, v_factor))
            continue
        face = kernel.TopoDS_Face()
        builder.MakeFace(face, surface, RESOLUTION)
        _give_pcurves(builder, edges, loops, face, v_factor, deviation)
        for loop in loops:
            wire = kernel.TopoDS_Wire()
            builder.MakeWire(wire)
            for use in loop if v_factor > 0.0 else loop[::-1]:
                backwards = use.reversed != (v_factor < 0.0)
                builder.Add(wire, edges[use.edge].Oriented(kernel.REVERSED if backwards else kernel.FORWARD))
            wire.Closed(True)
            builder.Add(face, wire)
        against = topology.flipped[i] != (v_factor < 0.0)
        faces.append(kernel.as_face(face.Oriented(kernel.REVERSED if against else kernel.FORWARD)))
    return faces


def natural_face(surface: Surface, native: Any, v_factor: float) -> Any:
    """A face of its own on the surface's whole domain.

    Raises
    ------
    EngineError : the domain is infinite or the kernel refuses it.
    """
    (u0, u1), (v0, v1) = surface.domain
    low, high = sorted((v0 * v_factor, v1 * v_factor))
    if not np.isfinite([u0, u1, v0, v1]).all():
        raise EngineError(f"an unbounded {type(surface).__name__} cannot be a face: give it ranges of u and v")
    made = kernel.BRepBuilderAPI_MakeFace(native, u0, u1, low, high, RESOLUTION)
    if not made.IsDone():
        raise EngineError(f"the CAD kernel refuses a face on u {u0:.6g}..{u1:.6g}, v {low:.6g}..{high:.6g}")
    return made.Face()


def _edges(topology: Topology, tolerances: Array) -> list[Any]:
    builder = kernel.BRep_Builder()
    reach = np.full(len(topology.vertices), RESOLUTION)
    for number, curve in enumerate(topology.curves):
        for vertex, at in zip(topology.ends[number], (0, -1), strict=True):
            off = float(np.linalg.norm(curve.control_points[at] - topology.vertices[vertex]))
            reach[vertex] = max(reach[vertex], off + tolerances[number])  # a pcurve's end may be as far again
    vertices = []
    for point, tolerance in zip(topology.vertices.tolist(), reach.tolist(), strict=True):
        vertex = kernel.TopoDS_Vertex()
        builder.MakeVertex(vertex, kernel.gp_Pnt(*point), tolerance)
        vertices.append(vertex)
    edges = []
    for curve, (a, b), tolerance in zip(topology.curves, topology.ends.tolist(), tolerances.tolist(), strict=True):
        edge = kernel.TopoDS_Edge()
        if is_point(curve):
            builder.MakeEdge(edge)
            builder.Degenerated(edge, True)
            builder.UpdateEdge(edge, tolerance)
        else:
            builder.MakeEdge(edge, curve_to_kernel(curve), tolerance)
        builder.Add(edge, vertices[a].Oriented(kernel.FORWARD))
        builder.Add(edge, vertices[b].Oriented(kernel.REVERSED))
        builder.Range(edge, *curve.domain)
        edges.append(edge)
    return edges


def _give_pcurves(
    builder: Any, edges: list[Any], loops: tuple[tuple[EdgeUse, ...], ...], face: Any, v_factor: float, deviation: Array
) -> None:
    uses: dict[int, list[EdgeUse]] = {}
    for loop in loops:
        for use in loop:
            uses.setdefault(use.edge, []).append(use)
    for number, both in uses.items():
        edge, tolerance = edges[number], max(float(deviation[number]), RESOLUTION)
        flat = [curve_to_kernel(_stretched(use.pcurve, v_factor)) for use in both[:2]]
        if len(flat) == 2:  # a seam: the first pcurve belongs to the forward use
            backwards = both[0].reversed != (v_factor < 0.0)
            forward, reverse = (flat[1], flat[0]) if backwards else (flat[0], flat[1])
            builder.UpdateEdge(edge, forward, reverse, face, tolerance)
        else:
            builder.UpdateEdge(edge, flat[0], face, tolerance)
        builder.Range(edge, face, *both[0].pcurve.domain)
        builder.SameRange(edge, True)
        builder.SameParameter(edge, True)


def _stretched(pcurve: NurbsCurve, v_factor: float) -> NurbsCurve:
    if v_factor == 1.0:
        return pcurve
    return NurbsCurve(pcurve.degree, pcurve.knots, pcurve.control_points * np.array([1.0, v_factor]), pcurve.weights)
