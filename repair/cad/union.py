"""Closed CAD bodies that run into each other become one: their faces cut where they cross, what lies inside dropped.

The CAD kernel makes the union and this module proves it, on tessellations, with all lengths against their sag: every
face of the result is a piece of one that came, on the same surface; nothing of it lies inside another body (winding
number); and everything of the bodies that lies outside the others is there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.assembly import Assembly
from patchwright.models.cad.seams import measure_seams
from patchwright.models.cad.sewing import surface_difference
from patchwright.models.cad.status import brep_status
from patchwright.models.cad.uniting import United, unite
from patchwright.models.errors import EngineError
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation
from patchwright.repair.cad.bodies import closed_bodies, inside, shell_of
from patchwright.repair.cad.crossing_edges import redrawn
from patchwright.repair.cad.deadline import Deadline
from patchwright.repair.cad.draft import Draft, Limits
from patchwright.repair.cad.face_steps import built, free_edges, widest
from patchwright.repair.cad.outcome import point
from patchwright.repair.cad.sag import sags
from patchwright.repair.deviation import sample_area
from patchwright.repair.diagnosis import Diagnosis
from patchwright.repair.result import Face, LedgerEntry, Rung

UNCHANGED = 1e-12  # of the diagonal: a kept surface's numbers may differ by round-off only
SAMPLES = 4_000  # points per body at which a union is proved
SAG = 3.0  # times how far tessellations stray: nearer to a surface a point tells nothing
WHOLE = 0.999  # share of a face's area: a piece that keeps so much is the face
MANY = 40  # bodies united in one go


@dataclass(frozen=True, slots=True, eq=False)
class Union:
    """A model whose overlapping bodies are one, and what was done; `made` is False where they are as they came.

    `cut` are the faces that were cut, `origin` (f,) is the face each one was before, `shells` are the bodies that were
    united and `depth` how near to one its triangles tell nothing.
    """

    model: Assembly
    origin: IntArray
    cut: frozenset[int] = frozenset()
    entries: tuple[LedgerEntry, ...] = ()
    made: bool = False
    shells: tuple[Triangulation, ...] = ()
    depth: float = 0.0

    def hidden(self, points: Array) -> BoolArray:
        """(n,) points inside a body that was united: the surface there is gone."""
        return _enclosed(points, self.shells, -1, self.depth)

    def labelled(self, faces: tuple[Face, ...], before: tuple[Face, ...] = ()) -> tuple[Face, ...]:
        """The faces, the kept ones among them with the rung that cut them, or that they had `before`."""
        if not self.made:
            return faces
        out = []
        for i, face in enumerate(faces):
            if face.rung in (Rung.KEEP, Rung.WELD) and i < len(self.origin):
                earlier = before[self.origin[i]].rung if before else face.rung
                face = replace(face, rung=Rung.CUT if i in self.cut else earlier)
            out.append(face)
        return tuple(out)


def united(model: Assembly, diagnosis: Diagnosis, deadline: Deadline) -> Union:
    """The model with the closed bodies united that diagnosis found to overlap; as it came where that is not proved."""
    bodies = _overlapping(model, diagnosis)
    same = np.arange(len(model.parts))
    if len(bodies) < 2 or deadline.passed:
        return Union(model, same)
    places = tuple(sorted({name for body in bodies for name in (model.parts[i].name for i in body)}))
    if len(bodies) > MANY:
        return Union(model, same, entries=(_left(model, bodies, places, f"more than {MANY} bodies"),))
    try:
        made = unite(model, bodies, time_limit=deadline.left(deadline.limit))
        wrong = _refuted(model, bodies, made)
    except EngineError as error:
        wrong = str(error)
    if wrong:
        return Union(model, same, entries=(_left(model, bodies, places, wrong),))
    return _told(model, bodies, _exact(made, bodies, deadline), places)


def _exact(made: United, bodies: list[list[int]], deadline: Deadline) -> United:
    """The union with the edges in which its bodies cross drawn anew, where that holds and narrows the seams."""
    model = made.assembly
    body = np.full(int(made.origin.max()) + 1, -1)
    for number, faces in enumerate(bodies):
        body[[face for face in faces if face < len(body)]] = number
    own = body[made.origin]
    seams = measure_seams(model)
    across = {s.edge for s in seams if own[s.faces[0]] != own[s.faces[1]] and min(own[list(s.faces)]) >= 0}
    if not across or model.topology is None or deadline.passed:
        return made
    limits = Limits.of(model.diagonal, deadline.left(deadline.limit))
    better = built(model, redrawn(Draft(model, model.topology), across, limits), limits)
    if better is None or better.topology is None or len(better.parts) != len(model.parts):
        return made
    sound = free_edges(better) <= free_edges(model) and not set(brep_status(better).invalid)
    if not sound or widest(better) > max(s.gap for s in seams):
        return made
    pairs = zip(model.parts, better.parts, strict=True)
    change = max(surface_difference(a.surface, b.surface) for a, b in pairs)
    return made if change > UNCHANGED * max(model.diagonal, 1.0) else replace(made, assembly=better)


def _overlapping(model: Assembly, diagnosis: Diagnosis) -> list[list[int]]:
    """The closed bodies with faces in a defect of overlapping bodies."""
    named = {name for d in diagnosis.of("overlap") if d.severity == "error" for name in d.parts}
    return [body for body in closed_bodies(model) if named & {model.parts[i].name for i in body}]


def _refuted(model: Assembly, bodies: list[list[int]], made: United) -> str:
    """Why a union is none; empty where it is proved."""
    if made.surface_change.max(initial=0.0) > UNCHANGED * max(model.diagonal, 1.0):
        return "the kernel changed a surface"
    if free_edges(made.assembly) > free_edges(model):
        return "the union is not closed"
    if set(brep_status(made.assembly).invalid):
        return "the union holds invalid faces"
    shells = [shell_of(model, body) for body in bodies]
    result = Tree.of(made.assembly.triangulation)
    of_body = np.full(len(model.parts), -1)
    for number, body in enumerate(bodies):
        of_body[body] = number
    depth = _depth(model, made)
    for number, shell in enumerate(shells):
        kept = np.flatnonzero(of_body[made.origin] == number).tolist()
        if kept:
            points, _ = sample_area(shell_of(made.assembly, kept), SAMPLES)
            wrong = _enclosed(points, shells, number, depth)
            if wrong.any():
                return f"{wrong.mean():.1%} of what the kernel kept of body {number + 1} lies inside another body"
        points, _ = sample_area(shell, SAMPLES)
        lost = ~_enclosed(points, shells, number, -depth) & (result.closest(points).distance > depth)
        if lost.any():
            return f"{lost.mean():.1%} of body {number + 1} lies outside the others and is gone"
    return ""


def _depth(model: Assembly, made: United) -> float:
    """Nearer to a tessellation than this a point is on it, as far as can be told."""
    return float(SAG * max(1e-9 * model.diagonal, sags(model, 100.0).max(), sags(made.assembly, 100.0).max()))


def _enclosed(points: Array, shells: Sequence[Triangulation], number: int, depth: float) -> BoolArray:
    """Which points of a body lie inside another one, deeper than `depth`, or, where it is negative, or so near."""
    out = np.zeros(len(points), dtype=bool)
    for other, shell in enumerate(shells):
        if other != number:
            out |= inside(shell, Tree.of(shell), points, depth)
    return out


def _told(model: Assembly, bodies: list[list[int]], made: United, names: tuple[str, ...]) -> Union:
    """The union with its entries: what was cut, what lies inside and is gone."""
    before, after = _areas(model), _areas(made.assembly)
    share = np.divide(after, before[made.origin], out=np.ones(len(after)), where=before[made.origin] > 0.0)
    own = np.isin(made.origin, [i for body in bodies for i in body])
    cut = frozenset(np.flatnonzero(own & (share < WHOLE)).tolist())
    gone = sorted({i for body in bodies for i in body} - set(made.origin.tolist()))
    where, size = _place(model, bodies)
    entries = [
        LedgerEntry(
            "bodies united", Rung.CUT, names,
            f"{len(bodies)} closed bodies run into each other; their faces are cut where their surfaces cross",
            count=len(cut), area=float(after[sorted(cut)].sum()), where=where, size=size,
        )
    ]  # fmt: skip
    inside = float(before[np.concatenate(bodies)].sum() - after[own].sum())
    entries.append(
        LedgerEntry(
            "surface inside other bodies dropped", Rung.DROP, tuple(model.parts[i].name for i in gone),
            f"no flow reaches it; {len(gone)} whole faces among it", count=len(gone), area=inside, where=where,
            size=size,
        )
    )  # fmt: skip
    shells = tuple(shell_of(model, body) for body in bodies)
    return Union(made.assembly, made.origin, cut, tuple(entries), True, shells, _depth(model, made))


def _left(model: Assembly, bodies: list[list[int]], names: tuple[str, ...], why: str) -> LedgerEntry:
    where, size = _place(model, bodies)
    reason = f"{len(bodies)} closed bodies run into each other and are left as they are: {why}"
    return LedgerEntry("bodies not united", Rung.KEEP, names, reason, count=len(bodies), where=where, size=size)


def _place(model: Assembly, bodies: list[list[int]]) -> tuple[tuple[float, float, float], float]:
    corners = np.concatenate([model.parts[i].triangulation.vertices for body in bodies for i in body])
    low, high = corners.min(axis=0), corners.max(axis=0)
    return point((low + high) / 2), float(np.linalg.norm(high - low))


def _areas(model: Assembly) -> Array:
    return np.array([part.triangulation.areas.sum() for part in model.parts])
