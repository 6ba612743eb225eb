"""The bridging stage of mending: which rims are filled, which are joined, which stay open."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import BoolArray
from patchwright.models.tolerance import Tolerance
from patchwright.repair.mender.bridge import Border, Bridge, borders_of, bridge, facing_pairs, inner_share
from patchwright.repair.mender.mend_decided import free_to_drop, undecided
from patchwright.repair.mender.mended import STRAY_SHARE, Action, Work
from patchwright.repair.mender.orient import orient
from patchwright.repair.mender.rims import Rim, classify_rims

STRAY = 6  # triangles: an open scrap of no more, and of next to no area, belongs to nothing
SLIVER = 10.0  # fit tolerances: a rim this narrow on average is a seam that does not match, not an opening
SHORT = 8  # edges: a gap's rim this short whose partner is gone is a hole
HOLE = 0.5  # length of the mean unit normal along a rim: above it the rim is round a hole, not round an end
ROUNDS = 4  # filling one rim may leave another that can be filled now


def bridge_gaps(work: Work, opened: BoolArray | None = None) -> None:
    """Bridge gaps and holes until no round finds any; rims mostly of the vertices `opened` are holes in any case."""
    for _ in range(ROUNDS):
        adjacency = work.adjacency()
        if not adjacency.free.any():
            return
        borders = borders_of(work.now, adjacency)
        judged = classify_rims(work.now, adjacency, work.tolerance)
        singles, pairs = _plan(borders, judged, work.tolerance)
        if opened is not None:
            paired = {k for pair in pairs for k in pair}
            fresh = np.ones(len(work.now.vertices), dtype=np.bool_)  # copies made since count as opened
            fresh[: len(opened)] = opened
            forced = {k for k, border in enumerate(borders) if fresh[border.vertices].mean() > 0.5}
            singles = sorted(set(singles) | (forced - paired))
        singles, pairs = undecided(work, borders, singles, pairs, "bridge")
        if not fill(work, borders, singles, pairs, "bridge"):
            break
    _drop_strays(work)


def _plan(
    borders: tuple[Border, ...], rims: tuple[Rim, ...], tolerance: Tolerance
) -> tuple[list[int], list[tuple[int, int]]]:
    """Which borders are filled by themselves and which are joined in pairs; the others are openings.

    A pair is joined, except where the surface goes on across each rim by itself and closing both takes less surface:
    two small holes side by side are not the ends of a tunnel.
    """
    border_of = {border.vertices.tobytes(): k for k, border in enumerate(borders)}
    partner = np.full(len(borders), -1, dtype=np.int64)
    singles, loose = [], []
    for own, rim in enumerate(rims):
        k = border_of.get(rim.loop.tobytes(), -1)
        if k < 0:
            continue
        other = -1 if rim.partner is None else border_of.get(rims[rim.partner].loop.tobytes(), -1)
        if rim.kind == "gap" and rim.partner != own and other >= 0:
            if _two_holes(borders[k], borders[other], rim.width):
                singles.append(k)
                continue
            partner[k] = other
            loose.append(k)
        elif rim.kind != "opening" or borders[k].width <= SLIVER * tolerance.fit:
            singles.append(k)
    pairs = [(k, int(partner[k])) for k in loose if partner[partner[k]] == k and k < partner[k]]
    paired = {k for pair in pairs for k in pair}
    left = [k for k in loose if k not in paired]
    if left:
        pairs += [(left[i], left[j]) for i, j in facing_pairs(tuple(borders[k] for k in left))]
        paired = {k for pair in pairs for k in pair}
    singles += [
        k for k in left if k not in paired and (len(borders[k].vertices) <= SHORT or inner_share(borders[k]) >= 0.5)
    ]
    return singles, pairs


def _two_holes(one: Border, other: Border, width: float) -> bool:
    """Whether two rims that face each other across `width` are rather two holes side by side."""
    lengths = [float(border.lengths.sum()) for border in (one, other)]
    caps = sum(0.5 * border.width * length for border, length in zip((one, other), lengths, strict=True))
    strip = 0.5 * width * sum(lengths)
    return caps < strip and min(_sameness(one), _sameness(other)) >= HOLE


def _sameness(border: Border) -> float:
    """Length of the mean unit normal along a rim: near 1 round a hole in a surface, near 0 round the end of a tube."""
    return float(np.linalg.norm(border.lengths @ border.normals) / max(border.lengths.sum(), np.finfo(float).tiny))


def fill(
    work: Work, rims: tuple[Border, ...], singles: list[int], pairs: list[tuple[int, int]], kind: str, why: str = ""
) -> tuple[Bridge, ...]:
    """Fill rims and join pairs of rims as actions of a kind; `why` replaces the reason found from the rims."""
    made = bridge(work.now, rims, singles, pairs)
    fresh = len(made.triangulation) - len(work.now)
    parents = np.concatenate([np.arange(len(work.now)), np.full(fresh, -1)])
    work.follow(made.triangulation, parents)
    for one in made.bridges:
        points = work.now.vertices[np.concatenate(one.rims)]
        size = float(np.linalg.norm(np.ptp(points, axis=0)))
        if why:
            reason = why
        elif kind == "close":
            reason = "openings are to be closed"
        elif len(one.rims) == 2:
            reason = f"two rims face each other across {one.width:.3g} with agreeing normals"
        else:
            reason = f"a hole with {len(one.rims[0])} edges inside the surface"
        work.actions.append(Action(kind, "bridge", one.where, size, 0.0, reason, len(one.triangles), area=one.area))
    if made.bridges:
        work.now = orient(work.now, work.adjacency()).triangulation
    return made.bridges


def _drop_strays(work: Work) -> None:
    """Open scraps of a few triangles that nothing could be joined to."""
    adjacency = work.adjacency()
    if not adjacency.free.any():
        return
    label = np.asarray(adjacency.components())
    area = np.bincount(label, work.now.areas)
    open_ = np.bincount(label, adjacency.free[adjacency.triangle_edges].any(axis=1)) > 0
    scrap = open_ & (np.bincount(label) <= STRAY) & (area < STRAY_SHARE * area.sum())
    scrap = free_to_drop(work, label, scrap)
    if scrap.any() and not scrap.all():
        gone = np.flatnonzero(scrap[label])
        gone = gone[np.argsort(label[gone], kind="stable")]
        for own in np.split(gone, np.flatnonzero(np.diff(label[gone])) + 1):
            work.drop("stray triangles", "a scrap of a few triangles that is joined to nothing", own)
        left = np.flatnonzero(~scrap[label])
        work.follow(work.now.take(left), left)
