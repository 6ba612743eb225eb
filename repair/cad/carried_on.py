"""NURBS faces carried on beyond their natural sides, so that they reach the neighbours they fall short of.

A NURBS ends where its knots end: a face that was cut back along a natural side of its surface neither touches nor
crosses its neighbours any more. The end spans' own polynomials, evaluated farther out (`models.extension`), are the
same surface; on it seams are looked for as on any other (`seam_join`). Only what the new trims need stays of that, and
nothing where no seam was found: then the face has the surface it had.

Limits: weights must not vanish farther out; what was a spline approximation of another shape strays from that shape.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from patchwright.models.boundary_strip import SIDES
from patchwright.models.cad.connectivity import is_point
from patchwright.models.cad.editing import with_loops
from patchwright.models.errors import GeometryError
from patchwright.models.extension import surface_on
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.surface import Surface
from patchwright.repair.cad.draft import Change, Draft, Limits
from patchwright.repair.cad.pcurves import BEYOND, within
from patchwright.repair.cad.seam_join import COARSE, FINE, join_seams
from patchwright.repair.cad.strip import speed_across
from patchwright.repair.decisions import CARRIED
from patchwright.repair.result import Rung

ROOM = 2.0  # times the reach: how far a surface is carried on where its parameter lines run straight across
DENSE = 33  # points of a free edge that stand for it
PROBES = 9  # per free edge
MOST = 0.25  # of a surface's range: what is carried on farther has little to do with it


def join_carried_on(
    draft: Draft, limits: Limits, shares: tuple[float, ...] = (FINE[-1], *COARSE), loose: Collection[int] = ()
) -> tuple[Draft, tuple[Change, ...]]:
    """Every seam that faces make once their surfaces are carried on, at each share of the diagonal in turn."""
    changes: list[Change] = []
    for share in shares:
        if limits.expired:
            break
        longer = _longer(draft, share * limits.diagonal)
        if not longer:
            continue
        wide, joined = join_seams(
            draft.with_surfaces(longer, draft.topology, same=False), limits, (share,), loose=loose
        )
        if not joined:
            continue
        touched = {face for change in joined for face in change.faces}
        draft, carried = _no_longer_than_needed(draft, wide, longer, touched, limits)
        changes += [*carried, *joined]
    return draft, tuple(changes)


def _longer(draft: Draft, reach: float) -> dict[int, Surface]:
    """The surfaces of faces with free edges beside others' and along natural sides, or nearly so, carried on there."""
    owner = draft.owners()
    beside = _beside(draft, owner, reach)
    out: dict[int, Surface] = {}
    for face in sorted({owner[edge] for edge in beside}):
        surface = draft.parts[face].surface
        if not isinstance(surface, NurbsSurface):
            continue
        free = [use for loop in draft.topology.loops[face] for use in loop if use.edge in beside]
        uv = [use.pcurve(np.linspace(*use.pcurve.domain, PROBES)) for use in free]
        box = np.array(surface.domain)
        for side in SIDES:
            k, end = (0 if side[0] == "u" else 1), int(side[1])
            low, high = surface.domain[k]
            room = min(ROOM * reach / speed_across(surface, side), MOST * (high - low))
            if any(np.abs(some[:, k] - (low, high)[end]).max() <= room for some in uv):
                box[k, end] += room if end else -room
        if (box != np.array(surface.domain)).any():
            try:
                out[face] = surface_on(surface, (box[0, 0], box[0, 1]), (box[1, 0], box[1, 1]))
            except GeometryError:
                continue
    return out


def _beside(draft: Draft, owner: dict[int, int], reach: float) -> set[int]:
    """The free edges that come within reach of another face's, as far as points along them tell."""
    from scipy.spatial import cKDTree

    edges = sorted(edge for edge in owner if not is_point(draft.topology.curves[edge]))
    if not edges:
        return set()
    points = np.stack([c(np.linspace(*c.domain, DENSE)) for c in (draft.topology.curves[edge] for edge in edges)])
    face = np.repeat([owner[edge] for edge in edges], DENSE)
    step = np.linalg.norm(np.diff(points, axis=1), axis=2).max(axis=1)
    tree = cKDTree(points.reshape(-1, 3))
    out = set()
    for k, edge in enumerate(edges):
        near = tree.query_ball_point(points[k], reach + step[k])
        if any((face[found] != owner[edge]).any() for found in near):
            out.add(edge)
    return out


def _no_longer_than_needed(
    draft: Draft, wide: Draft, longer: dict[int, Surface], touched: set[int], limits: Limits
) -> tuple[Draft, tuple[Change, ...]]:
    """The joined draft with surfaces as far as their trims reach, and which of them are longer than before."""
    parts = list(wide.parts)
    changes, loops = [], {}
    for face, surface in longer.items():
        old = draft.surface(face)
        assert isinstance(surface, NurbsSurface)
        assert isinstance(old, NurbsSurface)
        own = np.array(old.domain)
        points = np.concatenate([use.pcurve.control_points for loop in wide.topology.loops[face] for use in loop])
        box = np.stack([np.minimum(own[:, 0], points.min(axis=0)), np.maximum(own[:, 1], points.max(axis=0))], axis=1)
        same = np.abs(box - own) <= BEYOND * np.ptp(own, axis=1, keepdims=True)
        box = np.where(same, own, box)
        if face not in touched or same.all():
            parts[face] = draft.parts[face]
            loops[face] = tuple(
                tuple(replace(use, pcurve=within(old, use.pcurve)) for use in loop)
                for loop in wide.topology.loops[face]
            )
            continue
        full = np.array(surface.domain)
        box = np.stack([np.maximum(box[:, 0], full[:, 0]), np.minimum(box[:, 1], full[:, 1])], axis=1)
        kept = surface.restricted((box[0, 0], box[0, 1]), (box[1, 0], box[1, 1]))
        parts[face] = replace(wide.parts[face], surface=kept)
        changes.append(_change(draft, face, old, kept, limits))
    return Draft(replace(wide.assembly, parts=tuple(parts)), with_loops(wide.topology, loops)), tuple(changes)


def _change(draft: Draft, face: int, old: NurbsSurface, new: NurbsSurface, limits: Limits) -> Change:
    move = 0.0
    for side in SIDES:
        k, end = (0 if side[0] == "u" else 1), int(side[1])
        if old.domain[k][end] != new.domain[k][end]:
            share = np.linspace(0.0, 1.0, 17)
            ends = [s.domain[1 - k][0] + share * (s.domain[1 - k][1] - s.domain[1 - k][0]) for s in (old, old)]
            uv = [np.full(17, s.domain[k][end]) for s in (old, new)]
            a, b = ((x, y) if k == 0 else (y, x) for x, y in zip(uv, ends, strict=True))
            move = max(move, float(np.linalg.norm(new(*a) - new(*b), axis=1).max()))
    return Change(
        CARRIED,
        Rung.CUT,
        (face,),
        f"it ended short of them; its end spans' own polynomials go on by up to {move:.3g}",
        limits.on,
        move,
        draft.middle(face),
    )
