"""What the mender leaves as it is: rims and scraps that the domain or a reviewed plan decided upon."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import BoolArray, IntArray
from patchwright.repair.decisions import Candidate
from patchwright.repair.mender.bridge import Border
from patchwright.repair.mender.mended import LEFT_OUT, Action, Work


def undecided(
    work: Work, rims: tuple[Border, ...], singles: list[int], pairs: list[tuple[int, int]], kind: str
) -> tuple[list[int], list[tuple[int, int]]]:
    """The rims to fill and the pairs to join without those that stay open; what stays is written down once."""
    groups = [*((k,) for k in singles), *pairs]
    if work.decisions is None or not groups:
        return singles, pairs
    candidates = [_candidate(work, [rims[k] for k in group], kind) for group in groups]
    left = []
    for group, candidate, why in zip(groups, candidates, work.decisions.against(candidates), strict=True):
        if why:
            _note(work, candidate, why)
        else:
            left.append(group)
    return [group[0] for group in left if len(group) == 1], [(g[0], g[1]) for g in left if len(g) == 2]


def free_to_drop(work: Work, label: IntArray, scrap: BoolArray) -> BoolArray:
    """(c,) which of the components marked as scrap may go."""
    index = np.flatnonzero(scrap)
    if work.decisions is None or not len(index):
        return scrap
    corners = work.now.corners
    candidates = [
        Candidate("stray triangles", corners[label == k].reshape(-1, 3), work.names(work.source[label == k]))
        for k in index
    ]
    free = scrap.copy()
    for k, candidate, why in zip(index, candidates, work.decisions.against(candidates), strict=True):
        if why:
            free[k] = False
            _note(work, candidate, why)
    return free


def _candidate(work: Work, rims: list[Border], kind: str) -> Candidate:
    triangles = work.source[np.concatenate([rim.triangles for rim in rims])]
    return Candidate(kind, np.concatenate([rim.points for rim in rims]), work.names(triangles[triangles >= 0]))


def _note(work: Work, candidate: Candidate, why: str) -> None:
    """Write down what was left as it is, once per place."""
    where, size = np.asarray(candidate.fingerprint.where), candidate.fingerprint.size
    kind = candidate.kind + LEFT_OUT
    for action in work.actions:
        if action.kind == kind and np.linalg.norm(action.where - where) <= 1e-9 * max(size, 1e-300):
            return
    work.actions.append(Action(kind, "keep", where, size, 0.0, why, len(candidate.points)))
