"""The first stages of mending: weld copies, drop doubles, make seams conform, orient; nothing is invented."""

from __future__ import annotations

import numpy as np

from patchwright.repair.mender.clean import drop_collapsed, drop_duplicates, drop_hanging_flats, split_non_manifold
from patchwright.repair.mender.conform import conform
from patchwright.repair.mender.mended import Action, Problem, Work, middle
from patchwright.repair.mender.near_copies import near_copies
from patchwright.repair.mender.orient import orient
from patchwright.repair.mender.weld import (
    Copies,
    contract_short,
    reach_of,
    scatter_beyond,
    weld,
    weld_distance,
    weld_shown,
)

SHATTERED = 0.5  # of the triangles alone: there is no surface whose gaps could be bridged


def weld_copies(work: Work) -> None:
    copies = Copies.of(work.now, reach_of(work.tolerance))
    distance, reason = weld_distance(work.now, work.tolerance, copies)
    work.now, doubled = near_copies(work.now, distance)
    if len(doubled):
        copies = Copies.of(work.now, reach_of(work.tolerance))
    welded, apart = weld_shown(work.now, distance, copies, work.tolerance)
    del copies
    work.noise, work.distance = welded.noise, distance
    work.now = welded.triangulation
    if welded.merged:
        work.actions.append(
            Action(
                "weld", "weld", middle(work.now), work.now.diagonal, distance, reason, welded.merged,
                welded.largest_move,
            )
        )  # fmt: skip

    if apart is not None:
        _tell_scatter(work, apart)
    elif distance > work.tolerance.gap:
        _below_noise(work, distance)
    else:
        adjacency = work.adjacency()
        alone = int(np.count_nonzero(adjacency.free[adjacency.triangle_edges].all(axis=1)))
        beyond = scatter_beyond(work.now, work.tolerance) if alone >= SHATTERED * len(work.now) else None
        if beyond is not None:
            _tell_scatter(work, beyond)


def _tell_scatter(work: Work, distance: float) -> None:
    """A surface in pieces, because copies of points lie farther apart than the tolerance allows, is not mended."""
    digits = 10.0 ** (np.floor(np.log10(distance)) - 1.0)
    enough = float(np.ceil(0.52 * distance / digits) * digits)
    work.problems.append(
        Problem(
            "scatter",
            middle(work.now),
            work.now.diagonal,
            f"the surface is in pieces of a few triangles: the copies of a point lie up to {distance:.3g} apart, and "
            f"welding them would move corners farther than the fit tolerance {work.tolerance.fit:.3g}; a tolerance of "
            f"{enough:.3g} allows it",
        )
    )


def _below_noise(work: Work, distance: float) -> None:
    """Data with scatter: edges shorter than the scatter cannot be told apart; they go, and what hangs on them."""
    from patchwright.repair.mender._clean_kernel import triangle_heights

    for _ in range(3):
        short = contract_short(work.now, distance)
        if not short.merged:
            break
        work.now = short.triangulation
        cleaned = drop_collapsed(work.now)
        work.drop("triangles smaller than the noise", f"an edge is shorter than {distance:.3g}", cleaned.removed)
        work.follow(cleaned.triangulation, cleaned.parents)
        work.now = weld(work.now, distance).triangulation
    _undouble(work)
    adjacency = work.adjacency()
    height = triangle_heights(work.now.vertices, work.now.triangles)
    crowded = adjacency.non_manifold[adjacency.triangle_edges].any(axis=1) & (height < 2.0 * distance)
    if crowded.any():
        gone = np.flatnonzero(crowded)
        work.drop("triangles smaller than the noise", "more than two of them meet at an edge", gone)
        left = np.flatnonzero(~crowded)
        work.follow(work.now.take(left), left)


def clean(work: Work) -> None:
    cleaned = drop_collapsed(work.now)
    work.drop("collapsed triangles", "two of their corners are one point", cleaned.removed)
    work.follow(cleaned.triangulation, cleaned.parents)
    _undouble(work)
    cleaned = drop_hanging_flats(work.now, work.tolerance.gap)
    work.drop("flat triangles", "without area, hanging on an edge of two others", cleaned.removed)
    work.follow(cleaned.triangulation, cleaned.parents)


def _undouble(work: Work) -> None:
    cleaned = drop_duplicates(work.now)
    work.drop("doubled triangles", "the same three corners as another triangle", cleaned.removed)
    work.follow(cleaned.triangulation, cleaned.parents)


def conform_seams(work: Work) -> None:
    if not work.adjacency().free.any():
        return
    distance = work.tolerance.fit
    first = weld(work.now, distance)
    conformed = conform(first.triangulation, distance)
    if not (first.merged or conformed.inserted):
        return
    if first.merged:
        reason = f"rim vertices that meet within the fit tolerance ({distance:.3g}); what is farther apart is a gap"
        work.actions.append(
            Action(
                "weld", "weld", middle(work.now), work.now.diagonal, distance, reason, first.merged,
                first.largest_move,
            )
        )  # fmt: skip
    work.now = first.triangulation
    work.follow(conformed.triangulation, conformed.parents, conformed.cut)
    if conformed.inserted:
        reason = "rim vertices that lie on another free edge split it"
        work.actions.append(
            Action(
                "conform", "weld", middle(work.now), work.now.diagonal, distance, reason, conformed.inserted,
                conformed.largest_bend,
            )
        )  # fmt: skip
    clean(work)


def orient_bodies(work: Work) -> None:
    before = len(work.now.vertices)
    work.now = split_non_manifold(work.now, work.adjacency(), vertices=False)
    if len(work.now.vertices) > before:
        reason = "edges with more than two triangles: those that enclose material stay joined"
        work.actions.append(
            Action(
                "split", "weld", middle(work.now), work.now.diagonal, 0.0, reason, len(work.now.vertices) - before
            )
        )  # fmt: skip
    oriented = orient(work.now, work.adjacency())
    if oriented.flipped.any():
        some = work.now.take(oriented.flipped)
        reason = "triangles run against their neighbours, or the body faced inward"
        work.actions.append(
            Action("orient", "keep", middle(some), some.diagonal, 0.0, reason, int(oriented.flipped.sum()))
        )
    work.now = oriented.triangulation
