"""Mending: a closed (or deliberately open), oriented, 2-manifold, tagged triangulation out of a dirty one.

The stages, each of which changes as little as it can and writes down what it did: weld the copies of a point within the
distance the data shows, drop collapsed and doubled triangles, make patch seams conform, take apart what too many
triangles share, orient, trim sheets that run past each other, bridge gaps and holes, unite bodies that overlap, wrap
the bodies that are beyond all that. Corners of kept triangles move by welding only. What cannot be mended is a
`Problem` with its place, never an exception.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np

from patchwright.models.arrays import Array, frozen
from patchwright.models.errors import ParameterError
from patchwright.models.tolerance import Tolerance
from patchwright.models.triangulation import Triangulation
from patchwright.repair.decisions import Decisions
from patchwright.repair.mender.mend_cure import cure
from patchwright.repair.mender.mend_gaps import bridge_gaps
from patchwright.repair.mender.mend_notches import fill_notches
from patchwright.repair.mender.mend_openings import unite_as_decided
from patchwright.repair.mender.mend_overlaps import trim_overlaps
from patchwright.repair.mender.mend_seams import clean, conform_seams, orient_bodies, weld_copies
from patchwright.repair.mender.mend_wrap import wrap_bad
from patchwright.repair.mender.mended import BRIDGED, CUT, KEPT, Action, Dropped, Mended, Problem, Work, middle

Progress = Callable[[str, float], None]

__all__ = ["BRIDGED", "CUT", "KEPT", "Action", "Dropped", "Mended", "Problem", "mend"]


def mend(
    triangulation: Triangulation,
    tolerance: Tolerance,
    *,
    openings: Literal["keep", "close"] = "keep",
    decisions: Decisions | None = None,
    progress: Progress | None = None,
) -> Mended:
    """Mend a triangulation; `progress(stage, share done)` is called as the stages go by.

    `decisions` name the gaps, openings and scraps that stay as they are.

    Raises
    ------
    ParameterError : `openings` is neither "keep" nor "close".
    """
    if openings not in ("keep", "close"):
        raise ParameterError(f"openings must be 'keep' or 'close', got {openings!r}")
    tell = progress if progress is not None else _silent
    count = len(triangulation)
    bare = replace(triangulation, uv=None)
    nothing = np.zeros(count, dtype=np.int64)
    work = Work(triangulation, bare, np.arange(count), nothing, tolerance, decisions=decisions)
    if not count:
        work.problems.append(Problem("empty", np.zeros(3), 0.0, "there are no triangles to mend"))
        return _result(work, ())
    stages: tuple[tuple[str, Callable[[Work], None]], ...] = (
        ("weld", weld_copies),
        ("clean", clean),
        ("conform", conform_seams),
        ("orient", orient_bodies),
        ("trim", trim_overlaps),
    )
    for at, (name, stage) in enumerate(stages):
        tell(name, 0.08 * at)
        stage(work)
        if work.problems:  # the data cannot be mended within the tolerance
            return _result(work, ())
    tell("bridge", 0.4)
    bridge_gaps(work)
    fill_notches(work)
    tell("cure", 0.6)
    cure(work)
    tell("unite", 0.7)
    kept = unite_as_decided(work, openings)
    tell("cure", 0.85)
    cure(work)
    tell("wrap", 0.88)
    kept = wrap_bad(work, kept)
    tell("verify", 0.9)
    _verify(work)
    result = _result(work, kept)
    tell("done", 1.0)
    return result


def _silent(stage: str, share: float) -> None:
    """No progress wanted."""


def _verify(work: Work) -> None:
    """What is still wrong becomes a problem with its place."""
    adjacency = work.adjacency()
    for kind, wrong, message in (
        ("non-manifold-edge", adjacency.use_count > 2, "edges are used by more than two triangles"),
        ("flipped", adjacency.inconsistent, "edges are run the same way by both triangles"),
    ):
        if wrong.any():
            points = work.now.vertices[adjacency.edges[wrong]].reshape(-1, 3)
            size = float(np.linalg.norm(np.ptp(points, axis=0)))
            work.problems.append(Problem(kind, points.mean(axis=0), size, f"{int(wrong.sum())} {message}"))
    pairs = work.crossings()
    if len(pairs):
        some = work.now.take(np.unique(pairs))
        message = f"{len(some)} triangles still pass through each other"
        work.problems.append(Problem("self-intersection", middle(some), some.diagonal, message))


def _result(work: Work, kept: tuple[Array, ...]) -> Mended:
    work.now = work.now.compact()
    closed = bool(len(work.now)) and bool((work.adjacency().use_count == 2).all())
    return Mended(
        work.now,
        frozen(work.origin, np.int64),
        frozen(work.source, np.int64),
        tuple(work.actions),
        tuple(work.dropped),
        kept,
        closed,
        work.noise,
        tuple(work.problems),
    )
