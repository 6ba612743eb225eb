"""Replace a face: a new surface through the edges a face has, where no trims on its own surface make it valid.

Its edges, and so its neighbours, stay as they are. What lies within the tolerance of the old surface stands for it;
what does not, or cannot be compared because the old surface is of no use, is invented and called so.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array, BoolArray
from patchwright.models.cad.connectivity import is_point
from patchwright.models.cad.editing import with_loops
from patchwright.models.surface import Surface
from patchwright.models.topology import EdgeUse, Topology
from patchwright.repair.cad.draft import Attempt, Change, Draft, Limits
from patchwright.repair.cad.loop_shape import polygon, signed_area
from patchwright.repair.cad.pcurves import parameters, widened
from patchwright.repair.cad.retrace import over_poles
from patchwright.repair.cad.ring_judged import RingPatch
from patchwright.repair.cad.ring_patch import ring_patch
from patchwright.repair.cad.ring_sides import Normals, Steps
from patchwright.repair.result import Rung

GRID = 24  # per direction of the new surface's box, for its distance from the old one
WHAT = "face replaced"


def new_faces(
    draft: Draft, limits: Limits, faces: Collection[int]
) -> tuple[Draft, tuple[Change, ...], tuple[Attempt, ...]]:
    """The draft with new surfaces for `faces` as far as their edges allow, and why not where they do not."""
    changes, failed = [], []
    for face in sorted(faces):
        if limits.expired:
            break
        rings = _rings(draft, face)
        made = ring_patch(draft.topology, rings, rim_normals(draft, {face}), limits) if rings else "it has no edges"
        where = draft.middle(face)
        if isinstance(made, str):
            failed.append(Attempt(WHAT, (face,), made, where))
            continue
        off = _distance(draft.surface(face), made, limits)
        stands = off is not None and off <= limits.loose
        words = f"no trims on its own surface are valid; the new surface is {made.how}"
        if off is None:
            words += "; the old one is of no use for comparison"
        else:
            words += f", at most {off:.3g} from the old one"
        if np.isfinite(made.angle):
            words += f", and meets the faces around at {made.angle:.3g} degrees in the mean"
        draft = with_patch(draft, face, made, limits)
        rung = Rung.RESURFACE if stands else Rung.BRIDGE
        what = WHAT if stands else f"{WHAT}, invented"
        move = float("nan") if off is None else off
        changes.append(Change(what, rung, (face,), words, limits.on, move, where))
    return draft, tuple(changes), tuple(failed)


def with_patch(draft: Draft, face: int, patch: RingPatch, limits: Limits) -> Draft:
    """The draft with a patch for a face's surface and loops; its normal faces out of the body."""
    topology, loops = over_poles(draft.topology, patch.surface, patch.loops, limits)
    flipped = tuple(False if i == face else flip for i, flip in enumerate(topology.flipped))
    topology = replace(with_loops(topology, {face: loops}), flipped=flipped)
    return draft.with_surfaces({face: patch.surface}, topology, same=False)


def rim_normals(draft: Draft, without: Collection[int]) -> Normals:
    """Outward normals of the faces beside an edge, those of `without` left out."""
    beside: dict[int, tuple[int, EdgeUse]] = {}
    for face, loops in enumerate(draft.topology.loops):
        if face not in without:
            for loop in loops:
                for use in loop:
                    beside.setdefault(use.edge, (face, use))

    def normals(edge: int, t: Array) -> Array | None:
        if edge not in beside:
            return None
        face, use = beside[edge]
        surface = draft.surface(face)
        low, high = np.array(surface.domain).T
        u, v = np.clip(use.pcurve(t), low, high).T
        normal = np.cross(surface(u, v, (1, 0)), surface(u, v, (0, 1)))
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        if (length <= 0.0).any():
            return None
        return np.asarray(normal / length * (-1.0 if draft.topology.flipped[face] else 1.0))

    return normals


def _rings(draft: Draft, face: int) -> tuple[Steps, ...]:
    """The face's loops as rings that run counter-clockwise as seen from outside, the largest first; poles left out."""
    topology = draft.topology
    rings = []
    for loop in topology.loops[face]:
        steps = [(use.edge, use.reversed) for use in loop if not is_point(topology.curves[use.edge])]
        if topology.flipped[face]:
            steps = [(edge, not reverse) for edge, reverse in reversed(steps)]
        if steps and _is_ring(topology, steps):
            rings.append((abs(signed_area(polygon(loop))), tuple(steps)))
    return tuple(ring for _, ring in sorted(rings, key=lambda item: -item[0]))


def _is_ring(topology: Topology, steps: list[tuple[int, bool]]) -> bool:
    """Whether every step begins where the last ends."""
    ends = [topology.ends[edge][::-1] if reverse else topology.ends[edge] for edge, reverse in steps]
    return all(int(ends[k - 1][1]) == int(ends[k][0]) for k in range(len(ends)))


def _distance(old: Surface, patch: RingPatch, limits: Limits) -> float | None:
    """The largest distance of the patch from the old surface, inside its loops; None where the old one is of no use."""
    corners = np.concatenate([polygon(loop) for loop in patch.loops])
    low, high = corners.min(axis=0), corners.max(axis=0)
    share = (np.arange(GRID) + 0.5) / GRID
    u, v = (a.ravel() for a in np.meshgrid(*(low[k] + share * (high[k] - low[k]) for k in (0, 1)), indexing="ij"))
    inside = np.zeros(len(u), dtype=np.bool_)
    for loop in patch.loops:
        inside ^= _within(np.stack([u, v], axis=1), polygon(loop))
    if not inside.any():
        return None
    points = patch.surface(u[inside], v[inside])
    uv = parameters(old, points)
    if not np.isfinite(uv).all():
        return None
    wide = widened(old, uv)
    bottom, top = np.array(wide.domain).T
    feet = wide(*np.clip(uv, bottom, top).T)
    off = float(np.linalg.norm(feet - points, axis=1).max())
    return off if off <= limits.reach else None


def _within(points: Array, ring: Array) -> BoolArray:
    """(k,) whether points lie inside a polygon, by the crossings of a ray."""
    a, b = ring[None], np.roll(ring, -1, axis=0)[None]
    x, y = points[:, :1], points[:, 1:]
    crosses = (a[..., 1] > y) != (b[..., 1] > y)
    rise = np.where(crosses, b[..., 1] - a[..., 1], 1.0)
    right = a[..., 0] + (y - a[..., 1]) * (b[..., 0] - a[..., 0]) / rise > x
    return np.asarray((crosses & right).sum(axis=1) % 2 == 1)
