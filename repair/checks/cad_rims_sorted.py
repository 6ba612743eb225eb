"""Free rims of CAD faces judged once more by what only CAD tells: which loop of which face they are, and true corners.

Two rims that run beside each other all along, one of them with faces that lead towards the other, are a gap between
faces though the other's surface leads elsewhere: a lid lifted off its walls. A whole inner loop of one face is a
cut-out: the surface goes on below it, and somebody trimmed it; in a body that has no other border it is where a face is
missing.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.repair.mender.rim_edges import RimEdges
from patchwright.repair.mender.rims import Rim

BESIDE = 0.1  # of the smaller rim's diameter: rims nearer than this all along run beside each other
TOWARDS = 0.5  # cosine between the way a face leaves its rim and the way to the other rim
MOSTLY = 0.5  # share of a rim's length that decides


def beside(edges: RimEdges, rims: tuple[Rim, ...]) -> tuple[Rim, ...]:
    """The rims with openings that run beside each other all along called gaps."""
    from scipy.spatial import cKDTree

    open_ = [i for i, rim in enumerate(rims) if rim.kind == "opening" and rim.overlaps is None]
    middles = [0.5 * (edges.start[_of(edges, i)] + edges.end[_of(edges, i)]) for i in open_]
    trees = [cKDTree(points) for points in middles]
    best: dict[int, tuple[float, float, int]] = {}
    for a, i in enumerate(open_):
        for b in range(a + 1, len(open_)):
            j = open_[b]
            reach = BESIDE * min(rims[i].diameter, rims[j].diameter)
            if np.linalg.norm(rims[i].centre - rims[j].centre) > max(rims[i].diameter, rims[j].diameter):
                continue
            far, near = map(np.asarray, trees[b].query(middles[a]))
            back, other = map(np.asarray, trees[a].query(middles[b]))
            widest = float(max(far.max(), back.max()))
            if widest > reach or widest == 0.0:
                continue
            leads = (
                _towards(edges, i, middles[b][near] - middles[a]),
                _towards(edges, j, middles[a][other] - middles[b]),
            )
            if max(leads) < MOSTLY:
                continue
            for one, two, width in ((i, j, far), (j, i, back)):
                if one not in best or widest < best[one][1]:
                    best[one] = float(np.median(width)), widest, two
    out = list(rims)
    for i, (median, widest, j) in best.items():
        if best[j][2] == i:
            reason = f"it runs beside rim {j} all along, and the faces of one lead towards the other"
            out[i] = replace(rims[i], kind="gap", partner=j, width=median, widest=widest, reason=reason)
    return tuple(out)


def _of(edges: RimEdges, i: int) -> slice:
    return slice(int(edges.offsets[i]), int(edges.offsets[i + 1]))


def _towards(edges: RimEdges, i: int, way: Array) -> float:
    """The share of a rim's length from which its faces lead along `way` (n, 3)."""
    size = np.linalg.norm(way, axis=1)
    along = np.einsum("ij,ij->i", edges.outward[_of(edges, i)], way)
    length = edges.length[_of(edges, i)]
    return float(length[along >= TOWARDS * size].sum() / max(float(length.sum()), np.finfo(float).tiny))


def cut_outs(rims: tuple[Rim, ...], inner: list[bool], component: IntArray) -> tuple[Rim, ...]:
    """The rims with the holes that are cut out of one face called openings.

    Parameters
    ----------
    inner : per rim, whether it is a whole inner loop of one face
    component : (l,) the connected piece of surface each rim bounds
    """
    border = {int(component[i]) for i, rim in enumerate(rims) if rim.kind == "opening" and not inner[i]}
    out = []
    for i, rim in enumerate(rims):
        alone = rim.kind == "hole" or (rim.kind == "gap" and rim.partner == i)
        if alone and inner[i] and int(component[i]) in border:
            reason = "an inner loop of one face, cut out of an open sheet"
            rim = replace(rim, kind="opening", partner=None, width=np.inf, widest=np.inf, reason=reason)
        out.append(rim)
    return tuple(out)
