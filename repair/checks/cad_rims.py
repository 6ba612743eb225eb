"""Free edges of CAD faces: seams that were never sewn, gaps, openings, and how many remain at which tolerance."""

from __future__ import annotations

from typing import Any

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.cad.connectivity import components
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.topology import EdgeUse, Topology
from patchwright.repair.checks.cad_loose import loose_beside
from patchwright.repair.checks.cad_rims_sorted import beside, cut_outs
from patchwright.repair.checks.edges import SHARES, reading
from patchwright.repair.checks.examination import Examination, box_of
from patchwright.repair.checks.regions import plural
from patchwright.repair.checks.registry import Finding, check
from patchwright.repair.checks.rims import describe, most_of_each, rim_groups
from patchwright.repair.diagnosis import Defect, Severity
from patchwright.repair.mender.rim_edges import RimEdges
from patchwright.repair.mender.rims import Rim, judge_loops

CHORDS = 16  # per free edge, at least
PER_SPAN, MOST_CHORDS = 8, 256  # chords per span of its curve, and at most
TINY = 4.0  # of the round-off tolerance: a shorter edge lies near its neighbours by being short
REACH = 0.05  # of the diagonal: edges farther apart do not run along each other
PROBES = 17  # per free edge where its distance from the others is asked


@check("cad-rims", looks="cad", kinds=("open-edge", "gap", "opening", "overlap"))
def cad_rims(exam: Examination) -> Finding:
    """Free edges that coincide with others were never sewn; what is left is judged like the rims of a triangulation."""
    topology = exam.assembly.topology
    if topology is None:
        return Finding()
    uses = _free_uses(exam, topology)
    free = np.array([use.edge for _, use in uses], dtype=np.int64)
    reach = free_edge_reach(topology, free)
    sewn = (reach <= exam.tolerance.gap) & (_sizes(topology, free) > TINY * exam.tolerance.gap)
    left = [use for use, near in zip(uses, sewn, strict=True) if not near]
    chains = _chains(exam, topology, left)
    limits = np.array(SHARES) * exam.diagonal
    curve: list[dict[str, float | int]] = [
        {"share": share, "distance": float(limit), "free_edges": int(np.count_nonzero(reach > limit))}
        for share, limit in zip(SHARES, limits, strict=True)
    ]
    figures: dict[str, Any] = {
        "free_edges_by_tolerance": curve,
        "free_edge_reading": reading(curve),
        "open_edges_after_sewing": len(left),
        "rims": len(chains),
    }
    defects = _unsewn(
        exam, topology, [use for use, near in zip(uses, sewn, strict=True) if near], float(reach[sewn].max(initial=0.0))
    )
    rims: tuple[Rim, ...] = ()
    if chains:
        edges = _rim_edges(exam, topology, chains)
        component, body = _components(exam, topology, chains)
        loops = [np.arange(edges.offsets[i], edges.offsets[i + 1]) for i in range(len(chains))]
        # a chain that touches sewn edges at both ends bounds a void all the same
        closed = np.ones(len(chains), dtype=np.bool_)
        rims = beside(edges, judge_loops(edges, loops, closed, component, body, exam.tolerance.gap))
        rims = cut_outs(rims, [_is_inner_loop(topology, chain) for chain in chains], component)
        defects += [_defect(exam, rims, chains, group, edges) for group in rim_groups(rims)]
        told = {use.edge for rim, chain in zip(rims, chains, strict=True) if rim.kind != "opening" for _, use in chain}
        defects += _loose_pieces(exam, topology, left, told)
    for kind, word in (("gap", "gaps"), ("hole", "holes"), ("opening", "openings")):
        figures[word] = sum(rim.kind == kind for rim in rims)
    return Finding(tuple(most_of_each(exam, defects)), figures)


def _is_inner_loop(topology: Topology, chain: Chain) -> bool:
    """Whether a chain of free edges is a whole loop of one face, and not its outer one."""
    faces, edges = {face for face, _ in chain}, {use.edge for _, use in chain}
    if len(faces) != 1:
        return False
    return any({use.edge for use in loop} == edges for loop in topology.loops[faces.pop()][1:])


Use = tuple[int, EdgeUse]  # face and edge use
Chain = list[Use]


def _free_uses(exam: Examination, topology: Topology) -> list[Use]:
    """The uses of edges that one face uses once; poles left out."""
    counts = topology.use_counts()
    least = 1e-3 * exam.tolerance.gap
    return [
        (face, use)
        for face, loops in enumerate(topology.loops)
        for loop in loops
        for use in loop
        if counts[use.edge] == 1 and np.ptp(topology.curves[use.edge].control_points, axis=0).max() > least
    ]


def _sizes(topology: Topology, edges: IntArray) -> Array:
    """(k,) the diagonal of the box round each edge."""
    boxes = [np.ptp(topology.curves[int(i)].control_points, axis=0) for i in edges]
    return np.asarray(np.linalg.norm(np.array(boxes).reshape(-1, 3), axis=1))


def _chains(exam: Examination, topology: Topology, uses: list[Use]) -> list[Chain]:
    """Free edges head to tail, along the winding of the faces' outward sides; vertices within the tolerance are one."""
    same = _same_vertices(topology.vertices, exam.tolerance.gap)
    tails: dict[int, list[tuple[int, Use]]] = {}
    for face, use in uses:
        first, last = same[topology.ends[use.edge]]
        tail, head = (last, first) if use.reversed != topology.flipped[face] else (first, last)
        tails.setdefault(int(tail), []).append((int(head), (face, use)))
    chains: list[Chain] = []
    # chains that nothing leads to first, so that they are not cut in two
    heads = {head for some in tails.values() for head, _ in some}
    for start in sorted(tails, key=lambda vertex: vertex in heads):
        while tails.get(start):
            chain: Chain = []
            at = start
            while tails.get(at):
                at, step = tails[at].pop()
                chain.append(step)
                if at == start:
                    break
            chains.append(chain)
    return chains


def _same_vertices(points: Array, distance: float) -> IntArray:
    """(n,) label of the vertices, equal where chains of them lie within a distance."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    pairs = cKDTree(points).query_pairs(distance, output_type="ndarray")
    shape = (len(points), len(points))
    graph = coo_array((np.ones(len(pairs), dtype=np.int8), (pairs[:, 0], pairs[:, 1])), shape=shape)
    return connected_components(graph, directed=False)[1].astype(np.int64)


def _rim_edges(exam: Examination, topology: Topology, chains: list[Chain]) -> RimEdges:
    """Chords along the free edges, with the surfaces' normals at their middles."""
    starts, ends, normals, sizes = [], [], [], []
    owner: list[IntArray] = []
    for chain in chains:
        before = sum(len(some) for some in owner)
        for face, use in chain:
            curve, pcurve = topology.curves[use.edge], use.pcurve
            count = int(np.clip(PER_SPAN * (len(curve.breaks) - 1), CHORDS, MOST_CHORDS))
            share = np.linspace(0.0, 1.0, count + 1)
            middle = 0.5 * (share[1:] + share[:-1])
            t0, t1 = curve.domain
            points = curve(t0 + share * (t1 - t0))
            u, v = pcurve(t0 + middle * (t1 - t0)).T
            surface = exam.assembly.parts[face].surface
            assert surface is not None
            (u0, u1), (v0, v1) = surface.domain
            u, v = np.clip(u, u0, u1), np.clip(v, v0, v1)
            normal = np.cross(surface(u, v, (1, 0)), surface(u, v, (0, 1)))
            if topology.flipped[face]:
                normal = -normal
            if use.reversed != topology.flipped[face]:
                points, normal = points[::-1], normal[::-1]
            starts.append(points[:-1])
            ends.append(points[1:])
            normals.append(normal)
            owner.append(np.full(count, face))
        sizes.append(sum(len(some) for some in owner) - before)
    start, end, normal = np.concatenate(starts), np.concatenate(ends), np.concatenate(normals)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    outward = np.cross(end - start, normal)
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), np.finfo(float).tiny)
    length = np.linalg.norm(end - start, axis=1)
    offsets = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    loop = np.repeat(np.arange(len(chains)), sizes)
    return RimEdges(offsets, loop, start, end, length, normal, outward, np.concatenate(owner))


def _components(exam: Examination, topology: Topology, chains: list[Chain]) -> tuple[IntArray, Array]:
    """Label and diagonal of the sewn piece each chain bounds."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    faces = len(topology.loops)
    pairs = [(face, faces + use.edge) for face, loops in enumerate(topology.loops) for loop in loops for use in loop]
    i, j = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    size = faces + len(topology.curves)
    _, label = connected_components(coo_array((np.ones(len(i)), (i, j)), shape=(size, size)), directed=False)
    bounds = np.array([part.triangulation.bounds for part in exam.assembly.parts])
    diagonal = np.zeros(size)
    for k in np.unique(label[:faces]):
        own = bounds[label[:faces] == k]
        diagonal[k] = np.linalg.norm(own[:, 1].max(axis=0) - own[:, 0].min(axis=0))
    component = label[np.array([chain[0][0] for chain in chains])]
    return component, diagonal[component]


def _defect(exam: Examination, rims: tuple[Rim, ...], chains: list[Chain], group: list[int], edges: RimEdges) -> Defect:
    some = [rims[i] for i in group]
    centre = np.average([rim.centre for rim in some], axis=0, weights=[rim.perimeter for rim in some])
    faces = sorted({face for i in group for face, _ in chains[i]})
    parts = tuple(dict.fromkeys(exam.assembly.parts[face].name for face in faces))
    count = sum(len(chains[i]) for i in group)
    points = np.concatenate([edges.start[rim.loop] for rim in some])
    kind, severity, size, message = describe(exam, some, points, parts)
    return Defect(kind, severity, centre, size, parts, count, message, box_of(points))


def _loose_pieces(exam: Examination, topology: Topology, left: list[Use], told: set[int]) -> list[Defect]:
    """A gap for each piece whose edges run along another's, where no rim tells of it."""
    piece = np.zeros(len(topology.loops), dtype=np.int64)
    for number, faces in enumerate(components(topology)):
        piece[faces] = number
    out = []
    for one in loose_beside(topology, left, piece, REACH * exam.diagonal):
        if told & set(one.edges):
            continue
        parts = tuple(dict.fromkeys(exam.assembly.parts[face].name for face in one.faces))
        severity: Severity = "error"
        message = (
            f"a loose piece whose edges run along others over {exam.length(one.length)}, {exam.length(one.width)} "
            f"away in the median and at most {one.widest:.3g}"
        )
        if kept := exam.surroundings.keeps_gaps(parts):
            severity, message = "info", f"{message}; {kept}"
        where, box = one.points.mean(axis=0), box_of(one.points)
        out.append(Defect("gap", severity, where, one.width, parts, len(one.edges), message, box))
    return out


def _unsewn(exam: Examination, topology: Topology, uses: list[Use], widest: float) -> list[Defect]:
    """One defect for all edges that coincide with others but were never sewn to them."""
    if not uses:
        return []
    share = np.linspace(0.0, 1.0, 5)
    curves = [topology.curves[use.edge] for _, use in uses]
    points = np.stack([curve(curve.domain[0] + share * (curve.domain[1] - curve.domain[0])) for curve in curves])
    box = box_of(points)
    parts = tuple(dict.fromkeys(exam.assembly.parts[face].name for face, _ in uses))
    message = f"faces are not sewn: {plural(len(uses), 'free edge')} lie within {exam.length(widest)} of another"
    size = float(np.linalg.norm(box[1] - box[0]))
    return [Defect("open-edge", "error", points.mean(axis=(0, 1)), size, parts, len(uses), message, box)]


def free_edge_reach(topology: Topology, free: IntArray) -> Array:
    """(k,) the largest distance from each of some edges to the nearest other of them, on the true curves.

    What sewing at that distance would close; it does not ask for equal ends, so an edge may lie on two others.
    """
    from patchwright.repair.mender._rims_kernel import nearest_other

    if not len(free):
        return np.zeros(0)
    share = np.linspace(0.0, 1.0, CHORDS + 1)
    curves = [topology.curves[int(i)] for i in free]
    low = np.array([curve.domain[0] for curve in curves])
    high = np.array([curve.domain[1] for curve in curves])
    dense = np.stack([curve(a + share * (b - a)) for curve, a, b in zip(curves, low, high, strict=True)])
    probe = dense[:, :: CHORDS // (PROBES - 1)]
    count, per = probe.shape[:2]
    owner = np.repeat(np.arange(count), per)
    points = np.ascontiguousarray(probe.reshape(-1, 3))
    of = np.repeat(np.arange(count), CHORDS)
    start, end = (np.ascontiguousarray(some.reshape(-1, 3)) for some in (dense[:, :-1], dense[:, 1:]))
    chord, place, best = nearest_other(points, owner, start, end, of)
    found = chord >= 0
    other = np.where(found, of[chord], -1)
    for target in np.unique(other[found]):
        own = np.flatnonzero(other == target)
        first = low[target] + (chord[own] % CHORDS + place[own]) / CHORDS * (high[target] - low[target])
        best[own] = _distance(curves[target], points[own], first, low[target], high[target])
    return np.asarray(best.reshape(count, per).max(axis=1))


def _distance(curve: NurbsCurve, points: Array, t: Array, low: float, high: float) -> Array:
    """Distance of points from a curve, starting at parameters nearby (Gauss-Newton, clamped to the curve)."""
    away = curve(t) - points
    best = np.linalg.norm(away, axis=1)
    for _ in range(8):
        slope = curve(t, 1)
        square = np.maximum(np.einsum("ij,ij->i", slope, slope), np.finfo(float).tiny)
        moved = np.clip(t - np.einsum("ij,ij->i", away, slope) / square, low, high)
        settled = np.abs(moved - t).max() <= 1e-13 * (high - low)
        t = moved
        away = curve(t) - points
        best = np.minimum(best, np.linalg.norm(away, axis=1))
        if settled:
            break
    return np.asarray(best)
