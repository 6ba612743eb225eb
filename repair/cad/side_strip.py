"""Move one natural side of a NURBS face onto the faces along it, however many they are and at whatever speed they run.

Where a seam's surfaces neither cross nor touch, one of them has to change. A face whose side lies along other faces
from end to end, one or several (a T-junction), moves that side onto the nearest of them: each point of the border goes
to its foot there, after both ends have been brought to the neighbours' corners. Only a strip of `DEPTH` gap widths
changes (`models.boundary_strip`), the neighbours not at all; then the side lies on them and is trimmed and shared like
any other (`seam_join`).

Limits: all edges of the face run along natural sides of its surface, and the corners that move are its own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.boundary_strip import SIDES, Border, border_below, border_space, through, with_borders
from patchwright.models.errors import GeometryError
from patchwright.models.knots import divided, greville
from patchwright.models.nurbs_surface import NurbsSurface, Side
from patchwright.models.topology import EdgeUse
from patchwright.repair.cad.draft import Change, Draft, Limits
from patchwright.repair.cad.meeting import feet
from patchwright.repair.cad.seam_curves import EXACT, FAR, Judged, Meeting, judged, uses_of
from patchwright.repair.cad.seam_join import join_seams
from patchwright.repair.cad.seam_pieces import Piece, cut, seams
from patchwright.repair.cad.strip import DEPTH, speed_across, straight
from patchwright.repair.decisions import SIDE
from patchwright.repair.result import Rung

SHARES = (1e-5, 1e-4, 1e-3, 1e-2)  # of the diagonal: reaches at which sides are looked for, smallest first
ROUNDS = 64  # sides moved at one reach, at most
CUTS = (0, 1, 3, 7, 15, 31)  # knots put into each span of a border until it follows its target


@dataclass(frozen=True, slots=True, eq=False)
class _Moving:
    """A side of a face, the faces it goes to, where its ends go (2, 3) and how wide the gap is.

    `short` says that it lies along a part of another face's edge only.
    """

    face: int
    side: Side
    onto: tuple[int, ...]
    ends: Array
    gap: float
    short: bool


def strip_sides(draft: Draft, limits: Limits, shares: tuple[float, ...] = SHARES) -> tuple[Draft, tuple[Change, ...]]:
    """Sides moved onto their neighbours, one after the other, and joined with them."""
    changes: list[Change] = []
    for share in shares:
        for _ in range(ROUNDS):
            if limits.expired:
                break
            step = _next(draft, share * limits.diagonal, limits)
            if step is None:
                break
            moved, change = step
            # the side lies on the other face now, but not always along its edge
            draft, joined = join_seams(moved, limits, (1e-6, share))
            changes += [change, *joined]
    return draft, tuple(changes)


def _next(draft: Draft, reach: float, limits: Limits) -> tuple[Draft, Change] | None:
    whole, uses = cut(draft, reach), uses_of(draft)
    found = [judged(draft, seam, uses, limits) for seam in seams(draft, whole, reach, limits)]
    found = [one for one in found if one.meeting is not Meeting.FOLD]
    apart = {face for one in found if one.meeting is Meeting.APART for face in one.seam.faces}
    candidates = []
    for face in sorted(apart):
        for side, edges in _sides(draft, face).items():
            moving = _moving(draft, face, side, edges, whole.pieces, found, uses)
            if moving is not None:
                candidates.append(moving)
    # long sides first, which leave the several faces along them as they are, and what is nearly closed before the rest
    for moving in sorted(candidates, key=lambda one: (one.short, one.gap)):
        step = _moved(draft, moving, limits)
        if step is not None and not draft.vetoed(step[1], limits):
            return step
    return None


def _sides(draft: Draft, face: int) -> dict[Side, list[int]]:
    """The edges along each natural side of a face; empty unless all its edges are along one."""
    surface, loops = draft.parts[face].surface, draft.topology.loops[face]
    if not isinstance(surface, NurbsSurface) or len(loops) != 1:
        return {}
    out: dict[Side, list[int]] = {}
    for use in loops[0]:
        side = _along(surface, use)
        if side is None:
            return {}
        out.setdefault(side, []).append(use.edge)
    return out


def _along(surface: NurbsSurface, use: EdgeUse) -> Side | None:
    box = np.array(surface.domain)
    uv = use.pcurve(np.linspace(*use.pcurve.domain, 9))
    for side in SIDES:
        k, end = (0 if side[0] == "u" else 1), int(side[1])
        if np.abs(uv[:, k] - box[k, end]).max() <= FAR * (box[k, 1] - box[k, 0]):
            return side
    return None


def _moving(
    draft: Draft,
    face: int,
    side: Side,
    edges: list[int],
    pieces: dict[int, tuple[Piece, ...]],
    found: list[Judged],
    uses: dict[int, EdgeUse],
) -> _Moving | None:
    """How a side would move; None unless seams take all of it and one of them is apart."""
    mine = [one for one in found if any(p.edge in edges for p in _pieces_of(one, face))]
    taken = [p for one in mine for p in _pieces_of(one, face)]
    if not any(one.meeting is Meeting.APART for one in mine) or any(edge not in pieces for edge in edges):
        return None
    for edge in edges:
        for piece in pieces[edge]:
            if not any(p.edge == edge and p.t0 <= piece.t0 < p.t1 for p in taken):
                return None
    surface = draft.surface(face)
    assert isinstance(surface, NurbsSurface)
    k = 1 if side[0] == "u" else 0
    low, high = surface.domain[k]
    ends: dict[int, Array] = {}
    for one in mine:
        for piece in _pieces_of(one, face):
            for t, node in ((piece.t0, piece.start), (piece.t1, piece.end)):
                at = float(uses[piece.edge].pcurve(np.array([t]))[0, k])
                for end, value in enumerate((low, high)):
                    if abs(at - value) <= FAR * (high - low):
                        corner = _corner(draft, one, face, node)
                        if corner is not None:
                            ends[end] = corner
    onto = {other for one in mine for other in one.seam.faces if other != face}
    if len(ends) < 2 or not onto:
        return None
    gap = max(one.seam.gap for one in mine)
    facing = [p for one in mine for other in onto & set(one.seam.faces) for p in _pieces_of(one, other)]
    short = any((p.t0, p.t1) != draft.topology.curves[p.edge].domain for p in facing)
    return _Moving(face, side, tuple(sorted(onto)), np.stack([ends[0], ends[1]]), gap, short)


def _pieces_of(one: Judged, face: int) -> tuple[Piece, ...]:
    if one.seam.lead.face == face:
        return (one.seam.lead,)
    return one.seam.others if one.seam.others[0].face == face else ()


def _corner(draft: Draft, one: Judged, face: int, node: int) -> Array | None:
    """Where the other face's edge of a seam ends at a node."""
    others = one.seam.others if one.seam.lead.face == face else (one.seam.lead,)
    for piece in others:
        for t, at in ((piece.t0, piece.start), (piece.t1, piece.end)):
            if at == node:
                return np.asarray(draft.topology.curves[piece.edge](np.array([t]))[0])
    return None


def _moved(draft: Draft, moving: _Moving, limits: Limits) -> tuple[Draft, Change] | None:
    topology, old = draft.topology, draft.surface(moving.face)
    assert isinstance(old, NurbsSurface)
    try:
        surface, off = _with_side(draft, old, moving, limits)
    except (GeometryError, np.linalg.LinAlgError):
        return None
    if off > limits.on:
        return None
    curves, vertices = list(topology.curves), topology.vertices.copy()
    owner, row = draft.owners(), []
    for use in topology.loops[moving.face][0]:
        side = _along(old, use)
        assert side is not None
        line = straight(use.pcurve)
        curve = border_below(surface, side, line)
        if curve is None:  # a pole
            row.append(use)
            continue
        ends, tips = topology.ends[use.edge], curve(np.array(curve.domain))
        away = np.linalg.norm(tips - vertices[ends], axis=1)
        if owner.get(use.edge) == moving.face:
            curves[use.edge] = curve
            row.append(replace(use, pcurve=line))
        else:
            row.append(use)
            if np.linalg.norm(tips - topology.curves[use.edge](np.array(curve.domain)), axis=1).max() > limits.on:
                return None
        for vertex, tip, far in zip(ends.tolist(), tips, away, strict=True):
            if far > limits.on and not _own(draft, moving.face, vertex):
                return None
            if _own(draft, moving.face, vertex):
                vertices[vertex] = tip
    loops = list(topology.loops)
    loops[moving.face] = (tuple(row),)
    new = replace(topology, curves=tuple(curves), vertices=vertices, loops=tuple(loops))
    change = Change(
        SIDE,
        Rung.STRIP,
        (moving.face,),
        f"its border is NURBS and lies along {len(moving.onto)} face{'s' * (len(moving.onto) > 1)} from end to end "
        f"across {moving.gap:.3g}; it comes within {off:.2g}",
        limits.on,
        moving.gap,
        moving.ends.mean(axis=0),
        float(np.linalg.norm(moving.ends[1] - moving.ends[0])),
    )
    return draft.with_surfaces({moving.face: surface}, new, same=False), change


def _own(draft: Draft, face: int, vertex: int) -> bool:
    """Whether only free edges of one face end in a corner."""
    owner = draft.owners()
    used = draft.topology.use_counts() > 0
    here = np.flatnonzero((draft.topology.ends == vertex).any(axis=1) & used)
    return all(owner.get(int(edge)) == face for edge in here)


def _with_side(draft: Draft, old: NurbsSurface, moving: _Moving, limits: Limits) -> tuple[NurbsSurface, float]:
    """The surface with its side on the faces along it, and how far from them it stays."""
    k = 1 if moving.side[0] == "u" else 0
    low, high = old.domain[k]
    own = old.clamped().boundary(moving.side)
    shift = moving.ends - own(np.array([low, high]))
    others = [draft.surface(face) for face in moving.onto]

    def target(t: Array) -> Array:
        share = ((t - low) / (high - low))[:, None]
        start = own(t) + (1.0 - share) * shift[0] + share * shift[1]
        places = np.stack([feet(surface, start)[0] for surface in others])
        nearest = np.linalg.norm(places - start, axis=2).argmin(axis=0)
        out = places[nearest, np.arange(len(t))]
        out[t == low], out[t == high] = moving.ends[0], moving.ends[1]
        return np.asarray(out)

    best: tuple[NurbsSurface, float] | None = None
    depth = DEPTH * moving.gap / speed_across(old, moving.side)
    breaks = own.breaks
    for extra in CUTS:
        cuts = (breaks[:-1, None] + np.diff(breaks)[:, None] * np.arange(1, extra + 1) / (extra + 1)).ravel()
        space = border_space(old, moving.side, np.sort(cuts))
        made = through(space, target(np.clip(greville(space.degree, space.knots), low, high)))
        probes = divided(made.breaks, 5)
        off = float(np.linalg.norm(made(probes) - target(probes), axis=1).max())
        if best is None or off < best[1]:
            best = with_borders(old, {moving.side: Border(made, depth)}), off
        if off <= EXACT * limits.on:
            break
    assert best is not None
    return best
