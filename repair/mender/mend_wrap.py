"""The rung before refusal: bodies that could not be mended are wrapped, one by one; all others stay as they are.

What is beyond mending is whole components: those that cannot be oriented, that more than two triangles share an edge
of, that still pass through each other. The wrap lies within half the fit tolerance of what it is drawn onto; where it
does not (edges rounded, gaps closed) its surface counts as invented. It is united with the bodies that were good.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.arrays import Array, BoolArray
from patchwright.models.errors import ParameterError
from patchwright.models.tree import Tree
from patchwright.models.triangulation import Triangulation, concatenate
from patchwright.repair.mender.mend_union import unite
from patchwright.repair.mender.mended import BRIDGED, CUT, Action, Work, middle
from patchwright.repair.mender.wrap import wrap

CELLS = 100.0  # of the wrap per diagonal of what is wrapped
NEAR = 0.5  # of the fit tolerance: how far the wrap stays from what it is drawn onto


def wrap_bad(work: Work, kept: tuple[Array, ...]) -> tuple[Array, ...]:
    """Wrap the components that are beyond mending; undone where that does not help. Returns the openings then kept."""
    bad = _beyond(work)
    if not bad.any():
        return kept
    before, problems = work.mark(), list(work.problems)
    if not _replace(work, bad):
        return kept
    work.problems[:] = [problem for problem in problems if problem.kind != "union"]
    openings = unite(work, "keep")
    failed = len(work.problems) > sum(problem.kind != "union" for problem in problems)
    if failed or _beyond(work).any() or len(work.crossings()):
        work.back(before)
        work.problems[:] = problems
        return kept
    return openings


def _beyond(work: Work) -> BoolArray:
    """(m,) triangles of components with edges used too often or run one way twice, or that pass through themselves.

    Open ones that pass through any other are among them; closed ones that do so can be united.
    """
    adjacency = work.adjacency()
    label = np.asarray(adjacency.components())
    wrong = (adjacency.use_count > 2) | adjacency.inconsistent
    bad, open_ = np.zeros((2, int(label.max(initial=-1)) + 1), dtype=np.bool_)
    bad[label[wrong[adjacency.triangle_edges].any(axis=1)]] = True
    open_[label[adjacency.free[adjacency.triangle_edges].any(axis=1)]] = True
    pairs = label[work.crossings()]
    bad[pairs[pairs[:, 0] == pairs[:, 1]]] = True
    crossed = pairs[open_[pairs].any(axis=1)]
    bad[crossed[open_[crossed]]] = True
    return np.asarray(bad[label])


def _replace(work: Work, bad: BoolArray) -> bool:
    """Put a wrap of the triangles `bad` in their place; whether one could be made."""
    region = np.flatnonzero(bad)
    some = work.now.take(region).compact()
    cell = some.diagonal / CELLS
    try:
        made = wrap(some, cell, leave=NEAR * work.tolerance.fit)
    except ParameterError:
        return False
    body = made.triangulation
    away = Tree.of(some).closest(body.corners.mean(axis=1)).distance
    near = away <= work.tolerance.fit
    rest = np.flatnonzero(~bad)
    nearest = work.source[region[made.nearest]]
    area = float(body.areas[~near].sum())
    work.drop("what could not be mended", "it is replaced by its wrap", region)
    work.actions.append(
        Action(
            "wrap", "resurface", middle(some), some.diagonal, cell,
            f"{len(region)} triangles cannot be mended; wrapped in cells of {cell:.3g}: sharper edges are rounded, "
            f"gaps narrower than {2.0 * cell:.3g} closed; {area / float(body.areas.sum()):.0%} of it is invented",
            len(body), float(away.max()), area,
        )
    )  # fmt: skip
    source = np.concatenate([work.source[rest], np.where(near, nearest, -1)])
    origin = np.concatenate([work.origin[rest], np.where(near & (nearest >= 0), CUT, BRIDGED)])
    work.now = _together(work.now.take(rest).compact(), body)
    work.source, work.origin = source, origin
    return True


def _together(one: Triangulation, other: Triangulation) -> Triangulation:
    """Both in one, tags as they are; they number the same names."""
    both = concatenate([replace(part, tags=None, tag_names=(), uv=None) for part in (one, other)])
    if one.tags is None or other.tags is None:
        return both
    return replace(both, tags=np.concatenate([one.tags, other.tags]), tag_names=one.tag_names)
