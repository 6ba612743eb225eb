"""Kernel of `halving`: turning over vertices, one by one, at a falling temperature."""

# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

from patchwright.models._compile_kernel import filling, inner

_DOUBLET = 100.0  # cost of a halved edge between two triangles of which nothing else is halved


@inner
def mask_of(face_edges, marks, f):
    """Which sides of a face are halved, side k as bit k."""
    mask = 0
    for k in range(4):
        e = face_edges[f, k]
        if e >= 0 and marks[e]:
            mask |= 1 << k
    return mask


@inner
def is_flat(face_edges, marks, f):
    """Whether a face is a triangle with one side halved."""
    if face_edges[f, 3] >= 0:
        return False
    mask = mask_of(face_edges, marks, f)
    return mask == 1 or mask == 2 or mask == 4


@inner
def cost_of(f, face_edges, edge_faces, marks, cost):
    """Cost of a face, and of the doublets at its sides."""
    total = cost[f, mask_of(face_edges, marks, f)]
    if is_flat(face_edges, marks, f):
        for k in range(3):
            e = face_edges[f, k]
            if marks[e]:
                o = edge_faces[e, 0] + edge_faces[e, 1] - f
                if o >= 0 and is_flat(face_edges, marks, o):
                    total += _DOUBLET
    return total


@inner
def cost_round(v, face_off, faces, face_edges, edge_faces, marks, cost):
    """Costs of the faces round a vertex."""
    total = 0.0
    for i in range(face_off[v], face_off[v + 1]):
        total += cost_of(faces[i], face_edges, edge_faces, marks, cost)
    return total


@inner
def turn_over(v, edge_off, edges, marks):
    for i in range(edge_off[v], edge_off[v + 1]):
        marks[edges[i]] = not marks[edges[i]]


@filling
def anneal(order, chance, warmth, edge_off, edges, face_off, faces, face_edges, edge_faces, cost, marks):
    """Change `marks` (e,) in place and return what they cost.

    Vertices are turned over in the order of each row of `order` (s, v), at `warmth` (s,).

    `chance` (s, v) are the logarithms of even random numbers in (0, 1]: a turn that costs less than -chance * warmth is
    taken, so that with no warmth only turns that gain are.
    """
    for sweep in range(len(order)):
        for i in range(order.shape[1]):
            v = order[sweep, i]
            before = cost_round(v, face_off, faces, face_edges, edge_faces, marks, cost)
            turn_over(v, edge_off, edges, marks)
            after = cost_round(v, face_off, faces, face_edges, edge_faces, marks, cost)
            if not after - before < -chance[sweep, i] * warmth[sweep] - 1e-12:
                turn_over(v, edge_off, edges, marks)
    total = 0.0
    for f in range(len(face_edges)):
        total += cost_of(f, face_edges, edge_faces, marks, cost)
    return total
