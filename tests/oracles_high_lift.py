"""What the dirty high-lift half model is judged by: its slot, its wing-body line, its injected defects."""

from __future__ import annotations

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.samples import DirtySample
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation, concatenate
from patchwright.repair import Domain, diagnose
from patchwright.repair.result import LedgerEntry, Rung
from patchwright.ssi.mesh_mesh import mesh_intersection

DOMAIN = Domain(far_field=("farfield",), symmetry=("symmetry",))
WING = ("main", "flap")


def slot_points(parts: dict[str, Triangulation]) -> np.ndarray:
    """Points half-way between wing and flap where these are nearest, outside the fuselage."""
    flap, main = parts["flap"], Tree.of(parts["main"])
    near = main.closest(flap.vertices)
    y = flap.vertices[:, 1]
    narrow = (near.distance < 1.5 * near.distance.min()) & (y > 0.3) & (y < 1.5)
    return np.asarray(0.5 * (flap.vertices + near.points)[narrow])


def edges_between(body: Triangulation, names: tuple[str, ...], others: tuple[str, ...]) -> np.ndarray:
    """(k, 2, 3) edges with a triangle tagged with one of `names` on one side and of `others` on the other."""
    adjacency = Adjacency.of(body)
    offsets, around = adjacency.edge_triangles
    two = np.flatnonzero(adjacency.use_count == 2)
    tags = np.asarray(body.tags)[np.stack([around[offsets[two]], around[offsets[two] + 1]], axis=1)]
    one = np.isin(tags, [body.tag_names.index(n) for n in names])
    other = np.isin(tags, [body.tag_names.index(n) for n in others])
    meets = (one[:, 0] & other[:, 1]) | (one[:, 1] & other[:, 0])
    return np.asarray(body.vertices[adjacency.edges[two[meets]]])


def to_segments(points: np.ndarray, segments: np.ndarray) -> np.ndarray:
    """(n,) distance of points to the nearest of segments (k, 2, 3)."""
    best = np.full(len(points), np.inf)
    for a, b in segments:
        way = b - a
        t = np.clip((points - a) @ way / max(float(way @ way), 1e-300), 0.0, 1.0)
        np.minimum(best, np.linalg.norm(points - a - t[:, None] * way, axis=1), out=best)
    return best


def located(dirty: DirtySample) -> float:
    """Share of the injected defects that diagnosis names near their place, no farther off than their own size.

    A triangle missing beside a slit is part of the slit's rim: a gap also counts where it lies within its own size of
    a larger injected one that is itself named near its place.
    """
    found = diagnose(dirty.assembly, domain=DOMAIN)
    labels = dirty.defects
    reach = np.array([np.linalg.norm(label.box[1] - label.box[0]) + label.size for label in labels])
    named = np.zeros(len(labels), dtype=bool)
    for k, label in enumerate(labels):
        same = [d for d in found.defects if d.kind == label.kind]
        named[k] = any(np.linalg.norm(d.where - label.where) <= reach[k] and d.size <= 4.0 * reach[k] for d in same)
    gaps = np.array([label.kind == "gap" for label in labels])
    boxes = np.array([label.box for label in labels])
    joined = np.zeros(len(labels), dtype=bool)
    for k in np.flatnonzero(gaps & ~named):
        where = labels[k].where
        inside = ((where >= boxes[:, 0] - reach[k]) & (where <= boxes[:, 1] + reach[k])).all(axis=1)
        joined[k] = (inside & gaps & named & (reach > reach[k])).any()
    return float((named | joined).mean())


def false_changes(dirty: DirtySample, ledger: tuple[LedgerEntry, ...]) -> int:
    """Bridges at places where no triangle is missing."""
    boxes = np.array([label.box for label in dirty.defects if label.kind == "gap"])
    count = 0
    for entry in ledger:
        if entry.rung is Rung.BRIDGE and entry.where is not None:
            where = np.asarray(entry.where)
            slack = 1e-6 + 0.5 * (boxes[:, 1] - boxes[:, 0])
            count += not ((where >= boxes[:, 0] - slack) & (where <= boxes[:, 1] + slack)).all(axis=1).any()
    return count


def mirrored(half: Triangulation) -> Triangulation:
    """The half and its mirror image: closed, so that winding numbers are whole."""
    other = Triangulation(half.vertices * [1.0, -1.0, 1.0], half.triangles[:, ::-1])
    return concatenate([Triangulation(half.vertices, half.triangles), other])


def segments(parts: dict[str, Triangulation]) -> np.ndarray:
    """(k, 2, 3) the undamaged bodies' intersection with the fuselage."""
    found = [mesh_intersection(parts["fuselage"], parts[name]) for name in WING]
    return np.concatenate([f.points[f.segments] for f in found])
