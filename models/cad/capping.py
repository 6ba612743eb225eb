"""Planar openings of a sewn CAD model closed by trimmed planes that share the openings' free edges.

A cap's border is the edges themselves: their curves, mapped linearly into the plane, are its exact pcurves, so nothing
is fitted and the faces around stay as they are. Loops that lie in one plane, one inside the other and run the opposite
way, are one cap with a hole. Loops that are not planar are the caller's to refuse.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from patchwright.models.analytic import Plane
from patchwright.models.arrays import Array
from patchwright.models.assembly import Assembly, Part
from patchwright.models.cad.connectivity import is_point
from patchwright.models.cad.rebuild import NOTHING, rebuilt
from patchwright.models.cad.seams import edge_uses
from patchwright.models.cad.sewing import surface_difference
from patchwright.models.errors import GeometryError, ParameterError
from patchwright.models.knots import divided
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.topology import EdgeUse, Topology

PROBES = 16  # points per span of an edge where its flatness is measured


@dataclass(frozen=True, slots=True, eq=False)
class FreeLoop:
    """A ring of free edges, run the way a cap over it runs.

    `steps` holds (edge, reversed) pairs; `closed` is False for a chain whose ends do not meet in one vertex, or that
    meets other chains on its way; `faces` lie along it. `points` (k, 3) run along it; `centre`, unit `normal` and
    `flatness` (the points' largest distance) are of its least-squares plane, the normal facing out of the body.
    """

    steps: tuple[tuple[int, bool], ...]
    closed: bool
    faces: tuple[int, ...]
    points: Array
    centre: Array
    normal: Array
    flatness: float

    @property
    def diagonal(self) -> float:
        """Of the box around it."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))


@dataclass(frozen=True, slots=True, eq=False)
class Capped:
    """The assembly with its caps as further parts, in order after the old ones, and the evidence.

    `caps` are the new parts; `around` the faces that border each; `surface_change` (n,) as in `SewnResult`.
    """

    assembly: Assembly
    caps: tuple[int, ...]
    around: tuple[tuple[int, ...], ...]
    surface_change: Array


def free_loops(assembly: Assembly) -> tuple[FreeLoop, ...]:
    """The rings and chains of edges that one face uses once, poles left out.

    Raises
    ------
    ParameterError : the assembly has no topology.
    """
    topology = assembly.topology
    if topology is None:
        raise ParameterError("openings of CAD faces can only be closed where faces share edges; sew the model first")
    counts = topology.use_counts()
    tails: dict[int, list[tuple[int, int, bool, int]]] = {}
    for edge, face, loop, place in edge_uses(topology).tolist():
        if counts[edge] != 1 or is_point(topology.curves[edge]):
            continue
        forward = topology.loops[face][loop][place].reversed == topology.flipped[face]  # the face runs along the curve
        first, last = topology.ends[edge].tolist()
        tail, head = (last, first) if forward else (first, last)  # the cap runs against it
        tails.setdefault(tail, []).append((head, edge, forward, face))
    branching = {vertex for vertex, out in tails.items() if len(out) > 1}
    heads = {head for out in tails.values() for head, _, _, _ in out}
    found = []
    for start in sorted(tails, key=lambda vertex: vertex in heads):  # open chains from their beginning
        while tails.get(start):
            at, steps, faces, clean = start, [], [], start not in branching
            while tails.get(at):
                at, edge, reverse, face = tails[at].pop()
                steps.append((edge, reverse))
                faces.append(face)
                if at == start:
                    break
                clean &= at not in branching
            found.append(_loop(topology, steps, clean and at == start, faces))
    return tuple(found)


def cap(assembly: Assembly, loops: tuple[FreeLoop, ...], flat: float, *, time_limit: float | None = None) -> Capped:
    """One plane over each loop, or over a loop and those inside it.

    Parameters
    ----------
    loops : of `free_loops`
    flat : the farthest a loop may be from its plane, model length unit

    Raises
    ------
    ParameterError : no topology. GeometryError : a loop that is not closed or not planar. EngineError : the kernel
    failed.
    """
    topology = assembly.topology
    if topology is None:
        raise ParameterError("openings of CAD faces can only be closed where faces share edges; sew the model first")
    for loop in loops:
        if why := reason_against(loop, flat):
            raise GeometryError(why)
    groups = _nested(loops, flat)
    parts, new_loops, around = list(assembly.parts), list(topology.loops), []
    for number, group in enumerate(groups):
        plane, uses = _face(topology, [loops[i] for i in group])
        faces = tuple(dict.fromkeys(face for i in group for face in loops[i].faces))
        parts.append(Part(_name(assembly, number), NOTHING, plane, body=assembly.parts[faces[0]].body))
        new_loops.append(uses)
        around.append(faces)
    caps = tuple(range(len(assembly.parts), len(parts)))
    wider = replace(topology, loops=tuple(new_loops), flipped=(*topology.flipped, *(False for _ in caps)))
    made = rebuilt(assembly, tuple(parts), wider, time_limit=time_limit)
    change = np.array(
        [surface_difference(a.surface, b.surface) for a, b in zip(assembly.parts, made.parts, strict=False)]
    )
    return Capped(made, caps, tuple(around), change)


def reason_against(loop: FreeLoop, flat: float) -> str:
    """Why no plane can close the loop, "" when one can."""
    if not loop.closed:
        return "its free edges do not form one closed ring of shared corners, so no plane can be trimmed by it"
    if loop.flatness > flat:
        return (
            f"its rim is not planar: it leaves its plane by {loop.flatness:.3g}, more than {flat:.3g}; only planar "
            f"openings are capped"
        )
    return ""


def _loop(topology: Topology, steps: list[tuple[int, bool]], closed: bool, faces: list[int]) -> FreeLoop:
    points = np.concatenate([_along(topology.curves[edge], reverse)[:-1] for edge, reverse in steps])
    centre = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - centre, full_matrices=False)
    normal = axes[2]
    if _turning(points, normal) < 0.0:
        normal = -normal
    flatness = float(np.abs((points - centre) @ normal).max())
    return FreeLoop(tuple(steps), closed, tuple(dict.fromkeys(faces)), points, centre, normal, flatness)


def _along(curve: NurbsCurve, reverse: bool) -> Array:
    """(k, 3) points on the curve, both ends included."""
    t = divided(curve.breaks, PROBES)
    return curve(t[::-1] if reverse else t)


def _turning(points: Array, normal: Array) -> float:
    """Area the ring encloses, seen against the normal: positive when it runs counter-clockwise."""
    local = points - points.mean(axis=0)
    return float(0.5 * np.cross(local, np.roll(local, -1, axis=0)).sum(axis=0) @ normal)


def _nested(loops: tuple[FreeLoop, ...], flat: float) -> list[list[int]]:
    """Groups of loop numbers, each an outer loop followed by its holes: in its plane, run against it, inside it."""
    outer_of: dict[int, int] = {}
    for i, hole in enumerate(loops):
        best = np.inf
        for j, outer in enumerate(loops):
            size = _turning(outer.points, outer.normal)
            apart = np.abs((hole.points - outer.centre) @ outer.normal).max()
            against = _turning(hole.points, outer.normal) < 0.0
            if i != j and against and apart <= 2.0 * flat and size < best and _is_inside(hole.points[0], outer):
                outer_of[i], best = j, size
    groups = {i: [i] for i in range(len(loops)) if i not in outer_of}
    for hole_number, outer_number in outer_of.items():
        groups.setdefault(outer_number, [outer_number]).append(hole_number)
    return list(groups.values())


def _is_inside(point: Array, loop: FreeLoop) -> bool:
    """Whether a point of the loop's plane lies inside it (crossings of a ray)."""
    x = np.linalg.svd(loop.normal[None])[2][1]
    flat = (loop.points - point) @ np.stack([x, np.cross(loop.normal, x)], axis=1)
    a, b = flat, np.roll(flat, -1, axis=0)
    crosses = (a[:, 1] > 0.0) != (b[:, 1] > 0.0)
    rise = np.where(crosses, b[:, 1] - a[:, 1], 1.0)
    return bool((crosses & (a[:, 0] - a[:, 1] * (b[:, 0] - a[:, 0]) / rise > 0.0)).sum() % 2)


def _face(topology: Topology, loops: list[FreeLoop]) -> tuple[Plane, tuple[tuple[EdgeUse, ...], ...]]:
    """The plane of the first loop, as wide as the edges' control points, and the uses of all loops' edges on it."""
    centre, normal = loops[0].centre, loops[0].normal
    endless = Plane(centre, normal)
    axes = np.stack([endless.xdir, endless.ydir], axis=1)
    uses, corners = [], []
    for loop in loops:
        own = []
        for edge, reverse in loop.steps:
            curve = topology.curves[edge]
            flat = (curve.control_points - centre) @ axes
            corners.append(flat)
            own.append(EdgeUse(edge, reverse, NurbsCurve(curve.degree, curve.knots, flat, curve.weights)))
        uses.append(tuple(own))
    every = np.concatenate(corners)
    (u0, v0), (u1, v1) = every.min(axis=0).tolist(), every.max(axis=0).tolist()
    return Plane(centre, normal, endless.xdir, u=(u0, u1), v=(v0, v1)), tuple(uses)


def _name(assembly: Assembly, number: int) -> str:
    """A name no part has yet."""
    name, taken = f"cap-{number + 1}", set(assembly.names)
    while name in taken:
        name += "-new"
    return name
