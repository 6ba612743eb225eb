"""The union of closed bodies by the CAD kernel's Boolean operation, with what became of every face.

The kernel is trusted with nothing: which faces lie where is for the caller to prove (`repair.cad.union`), and seams are
measured surface to surface like any others.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.assembly import Assembly
from patchwright.models.cad import contained
from patchwright.models.cad.seams import edge_deviation
from patchwright.models.cad.sewing import surface_difference
from patchwright.models.errors import EngineError

SECONDS, SECONDS_PER_FACE = 120.0, 2.0


@dataclass(frozen=True, slots=True, eq=False)
class United:
    """The model with some of its bodies united.

    Parameters
    ----------
    assembly : its faces, those of bodies that were left alone among them
    origin : (f,) the input face each of its faces is, or is a piece of
    surface_change : (f,) the largest difference of any defining number of its surface from that face's; infinite where
        kind or size changed
    """

    assembly: Assembly
    origin: IntArray
    surface_change: Array


def unite(assembly: Assembly, bodies: list[list[int]], *, time_limit: float | None = None) -> United:
    """The union of closed bodies, each given by its faces.

    Raises
    ------
    EngineError : the kernel failed, took too long, or made a face that belongs to no body.
    """
    limit = SECONDS + SECONDS_PER_FACE * len(assembly.parts) if time_limit is None else time_limit
    made, claims = contained.call_named(
        "patchwright.models.cad.uniting:unite_here", assembly, edge_deviation(assembly), bodies,
        time_limit=limit, what=f"uniting {len(bodies)} bodies",
    )  # fmt: skip
    origin, change = [], []
    for part, faces in zip(made.parts, claims, strict=True):
        # a piece of two faces that lie on each other is of the one whose surface it has
        apart = [surface_difference(assembly.parts[i].surface, part.surface) for i in faces]
        origin.append(faces[int(np.argmin(apart))])
        change.append(min(apart))
    names = [assembly.parts[i].name for i in origin]
    made = replace(made, parts=tuple(replace(p, name=n) for p, n in zip(made.parts, names, strict=True)))
    return United(made, np.array(origin, dtype=np.int64), np.array(change))


def unite_here(assembly: Assembly, deviation: Array, bodies: list[list[int]]) -> tuple[Assembly, list[list[int]]]:
    """`unite` in this process: the united model, and the input faces that each of its faces may be a piece of."""
    from patchwright.models.cad import kernel
    from patchwright.models.cad.connectivity import components, is_closed
    from patchwright.models.cad.names import face_index
    from patchwright.models.cad.native import faces_of
    from patchwright.models.cad.reading import assembly_of
    from patchwright.models.cad.writing import body_shape, compound, shape_of

    _, faces = shape_of(assembly, deviation)
    assert assembly.topology is not None
    groups = components(assembly.topology)
    shells = [[[faces[i] for i in group] for group in groups if group[0] in body] for body in map(set, bodies)]
    solids = [body_shape(own[0], True, voids=own[1:]) for own in shells]
    first, others = kernel.List_TopoDS_Shape(), kernel.List_TopoDS_Shape()
    first.Append(solids[0])
    for solid in solids[1:]:
        others.Append(solid)
    fuse = kernel.BRepAlgoAPI_Fuse()
    fuse.SetArguments(first)
    fuse.SetTools(others)
    fuse.Build()
    if not fuse.IsDone():
        raise EngineError(f"the CAD kernel does not unite these {len(bodies)} bodies")
    united = {i for body in bodies for i in body}
    alone = [i for i in range(len(faces)) if i not in united]
    apart = [
        body_shape([faces[i] for i in group], is_closed(assembly.topology, group))
        for group in groups
        if group[0] not in united
    ]
    shape = compound([fuse.Shape(), *apart])
    stored = face_index(faces_of(shape))
    claims: list[list[int]] = [[] for _ in range(stored.Size())]
    for i in alone:
        claims[stored.FindIndex(faces[i]) - 1].append(i)
    for i in sorted(united):
        pieces = list(fuse.Modified(faces[i]))
        if not pieces and not fuse.IsDeleted(faces[i]):
            pieces = [faces[i]]
        for piece in pieces:
            at = stored.FindIndex(piece)
            if at:
                claims[at - 1].append(i)
    strange = sum(not claim for claim in claims)
    if strange:
        raise EngineError(f"the union holds {strange} faces of no body")
    # the file's order, pieces of a face one after another
    order = sorted(range(len(claims)), key=lambda k: claims[k][0])
    kept = [kernel.as_face(stored.FindKey(k + 1)) for k in order]
    claims = [claims[k] for k in order]
    body = assembly.parts[min(united)].body
    made = assembly_of(
        shape,
        [assembly.parts[claim[0]].name for claim in claims],
        [body if claim[0] in united else assembly.parts[claim[0]].body for claim in claims],
        assembly.source,
        faces=kept,
    )
    return replace(made, unit=assembly.unit), claims
