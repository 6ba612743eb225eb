"""Mending: a closed (or deliberately open), oriented, 2-manifold, tagged triangulation out of a dirty one.

The stages, each of which changes as little as it can and writes down what it did: weld the copies of a point within the
distance the data shows, drop collapsed and doubled triangles, make patch seams conform, take apart what too many
triangles share, orient, bridge gaps and holes, unite bodies that overlap. Corners of kept triangles move by welding
only. What cannot be mended is a `Problem` with its place, never an exception.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.arrays import Array, BoolArray, IntArray, frozen
from patchwright.models.errors import ParameterError
from patchwright.models.tolerance import Tolerance
from patchwright.models.triangulation import Triangulation
from patchwright.repair.bridge import Bridge, Border, bridge, facing_pairs, inner_share, borders_of
from patchwright.repair.clean import drop_collapsed, drop_duplicates, split_non_manifold
from patchwright.repair.conform import conform
from patchwright.repair.orient import orient
from patchwright.repair.crossings import crossing_pairs
from patchwright.repair.outer_hull import outer_hull
from patchwright.repair.rims import Rim, classify_rims
from patchwright.repair.weld import contract_short, weld, weld_distance

KEPT, CUT, BRIDGED = 0, 1, 2

STRAY, STRAY_SHARE = 6, 1e-4  # triangles and share of the area: an open scrap below both belongs to nothing
CURES, CURE_SHARE = 4, 0.05  # rounds of local cure, each a ring wider; never more than this share of all triangles
CROSSING = 1e-3  # of the round-off: edges that end nearer to the other triangle's plane touch it
SLIVER = 10.0  # fit tolerances: a rim this narrow on average is a seam that does not match, not an opening

Progress = Callable[[str, float], None]


@dataclass(frozen=True, slots=True, eq=False)
class Action:
    """One thing that was done.

    Parameters
    ----------
    kind : "weld", "drop", "conform", "split", "orient", "bridge", "close", "unite", "wrap"
    rung : its step on the ladder of least change
    where : (3,) middle of the place
    size : the place's extent, model length unit
    tolerance : the length the decision was made against, 0 when none was needed
    reason : one sentence
    count : triangles, edges or vertices concerned
    largest_move : the farthest anything moved
    area : surface added
    """

    kind: str
    rung: str
    where: Array
    size: float
    tolerance: float
    reason: str
    count: int
    largest_move: float = 0.0
    area: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Dropped:
    """Something that was removed: what, why, the parts concerned, area, middle, triangles of the input."""

    what: str
    why: str
    parts: tuple[str, ...]
    area: float
    where: Array
    triangles: IntArray


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """What could not be mended: kind, place, extent and a sentence."""

    kind: str
    where: Array
    size: float
    message: str


@dataclass(frozen=True, slots=True, eq=False)
class Mended:
    """The mended triangulation and the account of what was done.

    Parameters
    ----------
    triangulation : with the input's tags; bridges have their neighbours'
    origin : (m,) int64, KEPT, CUT (a piece of an input triangle) or BRIDGED (invented)
    source : (m,) int64, the input triangle each is or was cut from, -1 for invented ones
    actions, dropped, problems : what was done, removed, and left undone
    openings : (k, 3) points of each rim that was kept
    closed : every edge has two triangles
    noise : root mean square distance of the input's corners from their points, from the scatter of welded copies
    """

    triangulation: Triangulation
    origin: IntArray
    source: IntArray
    actions: tuple[Action, ...]
    dropped: tuple[Dropped, ...]
    openings: tuple[Array, ...]
    closed: bool
    noise: float
    problems: tuple[Problem, ...]


@dataclass(slots=True)
class _Work:
    """The triangulation on its way through the stages."""

    given: Triangulation
    now: Triangulation
    source: IntArray
    origin: IntArray
    tolerance: Tolerance
    actions: list[Action] = field(default_factory=list)
    dropped: list[Dropped] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)
    noise: float = 0.0
    distance: float = 0.0  # the weld distance

    def follow(self, triangulation: Triangulation, parents: IntArray, cut: BoolArray | None = None) -> None:
        """Take over a stage's result: `parents` index the triangles before it, -1 are new."""
        known = parents >= 0
        source = np.where(known, self.source[parents], -1)
        origin = np.where(known, self.origin[parents], BRIDGED)
        if cut is not None:
            origin = np.where(cut & (origin == KEPT), CUT, origin)
        self.now, self.source, self.origin = triangulation, source, origin

    def names(self, triangles: IntArray) -> tuple[str, ...]:
        """Names of the parts some triangles of the input belong to."""
        tags = self.given.tags
        if tags is None or not self.given.tag_names:
            return ()
        return tuple(self.given.tag_names[k] for k in np.unique(tags[triangles]) if 0 <= k < len(self.given.tag_names))

    def drop(self, what: str, why: str, now: IntArray, area: float | None = None) -> None:
        """Note that triangles (of the present state) go."""
        if not len(now):
            return
        some = self.now.take(now)
        source = np.unique(self.source[now])
        source = source[source >= 0]
        area = float(some.areas.sum()) if area is None else area
        self.dropped.append(Dropped(what, why, self.names(source), area, _middle(some), source))


def mend(
    triangulation: Triangulation,
    tolerance: Tolerance,
    *,
    openings: Literal["keep", "close"] = "keep",
    progress: Progress | None = None,
) -> Mended:
    """Mend a triangulation; `progress(stage, share done)` is called as the stages go by.

    Raises
    ------
    ParameterError : `openings` is neither "keep" nor "close".
    """
    if openings not in ("keep", "close"):
        raise ParameterError(f"openings must be 'keep' or 'close', got {openings!r}")
    tell = progress if progress is not None else _silent
    count = len(triangulation)
    work = _Work(
        triangulation, replace(triangulation, uv=None), np.arange(count), np.zeros(count, dtype=np.int64), tolerance
    )
    if not count:
        work.problems.append(Problem("empty", np.zeros(3), 0.0, "there are no triangles to mend"))
        return _result(work, ())
    stages: tuple[tuple[str, Callable[[_Work], None]], ...] = (
        ("weld", _weld),
        ("clean", _clean),
        ("conform", _conform),
        ("orient", _orient),
    )
    for at, (name, stage) in enumerate(stages):
        tell(name, 0.1 * at)
        stage(work)
    tell("bridge", 0.4)
    _bridge(work)
    tell("cure", 0.6)
    _cure(work)
    tell("unite", 0.7)
    kept = _unite(work, openings)
    tell("verify", 0.9)
    result = _result(work, kept)
    tell("done", 1.0)
    return result


def _silent(stage: str, share: float) -> None:
    """No progress wanted."""


def _weld(work: _Work) -> None:
    distance, reason = weld_distance(work.now, work.tolerance)
    welded = weld(work.now, distance)
    work.noise, work.distance = welded.noise, distance
    work.now = welded.triangulation
    if welded.merged:
        work.actions.append(
            Action(
                "weld", "weld", _middle(work.now), work.now.diagonal, distance, reason, welded.merged,
                welded.largest_move,
            )
        )  # fmt: skip


    if distance > work.tolerance.gap:
        _below_noise(work, distance)


def _below_noise(work: _Work, distance: float) -> None:
    """Data with scatter: edges shorter than the scatter cannot be told apart; they go, and what hangs on them."""
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
    adjacency = Adjacency.of(work.now)
    height = 2.0 * work.now.areas / np.maximum(_longest(work.now), np.finfo(float).tiny)
    crowded = adjacency.non_manifold[adjacency.triangle_edges].any(axis=1) & (height < 2.0 * distance)
    if crowded.any():
        gone = np.flatnonzero(crowded)
        work.drop("triangles smaller than the noise", "more than two of them meet at an edge", gone)
        left = np.flatnonzero(~crowded)
        work.follow(work.now.take(left), left)


def _clean(work: _Work) -> None:
    cleaned = drop_collapsed(work.now)
    work.drop("collapsed triangles", "two of their corners are one point", cleaned.removed)
    work.follow(cleaned.triangulation, cleaned.parents)
    _undouble(work)


def _undouble(work: _Work) -> None:
    cleaned = drop_duplicates(work.now)
    work.drop("doubled triangles", "the same three corners as another triangle", cleaned.removed)
    work.follow(cleaned.triangulation, cleaned.parents)


def _conform(work: _Work) -> None:
    if not Adjacency.of(work.now).free.any():
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
                "weld", "weld", _middle(work.now), work.now.diagonal, distance, reason, first.merged,
                first.largest_move,
            )
        )  # fmt: skip
    work.now = first.triangulation
    work.follow(conformed.triangulation, conformed.parents, conformed.cut)
    if conformed.inserted:
        reason = "rim vertices that lie on another free edge split it"
        work.actions.append(
            Action(
                "conform", "weld", _middle(work.now), work.now.diagonal, distance, reason, conformed.inserted,
                conformed.largest_bend,
            )
        )  # fmt: skip
    _clean(work)


def _orient(work: _Work) -> None:
    before = len(work.now.vertices)
    work.now = split_non_manifold(work.now, vertices=False)
    if len(work.now.vertices) > before:
        reason = "edges with more than two triangles: those that enclose material stay joined"
        work.actions.append(
            Action(
                "split", "weld", _middle(work.now), work.now.diagonal, 0.0, reason, len(work.now.vertices) - before
            )
        )  # fmt: skip
    oriented = orient(work.now)
    if oriented.flipped.any():
        some = work.now.take(oriented.flipped)
        reason = "triangles run against their neighbours, or the body faced inward"
        work.actions.append(
            Action("orient", "keep", _middle(some), some.diagonal, 0.0, reason, int(oriented.flipped.sum()))
        )
    work.now = oriented.triangulation


def _bridge(work: _Work) -> None:
    """Bridge gaps and holes until no round finds any."""
    for _ in range(4):
        adjacency = Adjacency.of(work.now)
        if not adjacency.free.any():
            return
        borders = borders_of(work.now, adjacency)
        judged = [rim for rim in classify_rims(work.now, adjacency, work.tolerance) if len(rim.loop) >= 3]
        singles, pairs = _plan(borders, judged, work.tolerance)
        if not _fill(work, borders, singles, pairs, "bridge"):
            break
    _drop_strays(work)


def _cure(work: _Work) -> None:
    """Take out triangles that cross others of their own body or crowd round one edge, and bridge what that opens."""
    for ring in range(CURES):
        bad = _bad(work.now, CROSSING * work.tolerance.gap)
        if not bad.any():
            return
        for _ in range(ring):
            near = np.zeros(len(work.now.vertices), dtype=np.bool_)
            near[work.now.triangles[bad]] = True
            bad = near[work.now.triangles].any(axis=1)
        if bad.mean() > CURE_SHARE:
            return
        work.drop("crossing triangles", "they pass through others of their own body, or more than two meet", np.flatnonzero(bad))
        left = np.flatnonzero(~bad)
        work.follow(work.now.take(left), left)
        work.now = orient(split_non_manifold(work.now)).triangulation
        _bridge(work)


def _bad(triangulation: Triangulation, depth: float) -> BoolArray:
    """(m,) triangles at edges used by more than two or run the same way by two, or crossing others of their component."""
    adjacency = Adjacency.of(triangulation)
    wrong = (adjacency.use_count > 2) | adjacency.inconsistent
    bad = wrong[adjacency.triangle_edges].any(axis=1)
    pairs = crossing_pairs(triangulation, depth)
    if len(pairs):
        label = np.asarray(adjacency.components())
        pairs = pairs[label[pairs[:, 0]] == label[pairs[:, 1]]]
        bad[pairs] = True
    return np.asarray(bad)


def _drop_strays(work: _Work) -> None:
    """Open scraps of a few triangles that nothing could be joined to."""
    adjacency = Adjacency.of(work.now)
    if not adjacency.free.any():
        return
    label = np.asarray(adjacency.components())
    area = np.bincount(label, work.now.areas)
    open_ = np.bincount(label, adjacency.free[adjacency.triangle_edges].any(axis=1)) > 0
    scrap = open_ & (np.bincount(label) <= STRAY) & (area < STRAY_SHARE * area.sum())
    if scrap.any() and not scrap.all():
        gone = np.flatnonzero(scrap[label])
        work.drop("stray triangles", "a scrap of a few triangles that is joined to nothing", gone)
        left = np.flatnonzero(~scrap[label])
        work.follow(work.now.take(left), left)


def _plan(
    borders: tuple[Border, ...], rims: list[Rim], tolerance: Tolerance
) -> tuple[list[int], list[tuple[int, int]]]:
    """Which borders are filled by themselves and which are joined in pairs; the others are openings."""
    place = {rim.loop.tobytes(): k for k, rim in enumerate(rims)}
    partner = np.full(len(borders), -1, dtype=np.int64)
    singles, loose = [], []
    index = {id(rim): k for k, rim in enumerate(rims)}
    for k, border in enumerate(borders):
        rim = rims[place[border.vertices.tobytes()]]
        own = index[id(rim)]
        if rim.kind == "gap" and rim.partner is not None and rim.partner != own and rim.partner < len(rims):
            partner[k] = rim.partner
            loose.append(k)
        elif rim.kind != "opening" or border.width <= SLIVER * tolerance.fit:
            singles.append(k)
    pairs = [(k, int(partner[k])) for k in loose if partner[partner[k]] == k and k < partner[k]]
    paired = {k for pair in pairs for k in pair}
    left = [k for k in loose if k not in paired]
    if left:
        pairs += [(left[i], left[j]) for i, j in facing_pairs(tuple(borders[k] for k in left))]
        paired = {k for pair in pairs for k in pair}
    singles += [k for k in left if k not in paired and (len(borders[k].vertices) <= 8 or inner_share(borders[k]) >= 0.5)]
    return singles, pairs


def _fill(
    work: _Work, rims: tuple[Border, ...], singles: list[int], pairs: list[tuple[int, int]], kind: str
) -> tuple[Bridge, ...]:
    made = bridge(work.now, rims, singles, pairs)
    fresh = len(made.triangulation) - len(work.now)
    parents = np.concatenate([np.arange(len(work.now)), np.full(fresh, -1)])
    work.follow(made.triangulation, parents)
    for one in made.bridges:
        points = work.now.vertices[np.concatenate(one.rims)]
        size = float(np.linalg.norm(np.ptp(points, axis=0)))
        if kind == "close":
            reason = "openings are to be closed"
        elif len(one.rims) == 2:
            reason = f"two rims face each other across {one.width:.3g} with agreeing normals"
        else:
            reason = f"a hole with {len(one.rims[0])} edges inside the surface"
        work.actions.append(
            Action(kind, "bridge", one.where, size, 0.0, reason, len(one.triangles), area=one.area)
        )
    if made.bridges:
        work.now = orient(work.now).triangulation
    return made.bridges


def _unite(work: _Work, openings: str) -> tuple[Array, ...]:
    """Close what is open for the union, unite, and open the kept openings again."""
    kept: tuple[Array, ...] = ()
    rims = borders_of(work.now)
    capped = len(work.now)
    if rims:
        if openings == "keep":
            kept = tuple(rim.points for rim in rims)
        _fill(work, rims, list(range(len(rims))), [], "close" if openings == "close" else "cap")
        if openings == "keep":
            work.actions = [action for action in work.actions if action.kind != "cap"]
    is_cap = np.arange(len(work.now)) >= (capped if openings == "keep" else len(work.now))
    work.now = split_non_manifold(work.now)
    oriented = orient(work.now)
    work.now = oriented.triangulation
    is_cap = is_cap[_drop_flat(work, oriented.components)]
    body = orient(work.now).components
    came = work.now.take(np.arange(len(work.now)))
    hull = outer_hull(work.now, body)
    for piece in hull.inside:
        own = piece.triangles
        into = work.names(_known(work.source[np.flatnonzero(body == piece.inside)])) if piece.inside >= 0 else ()
        named = ", ".join(into) if into else f"body {piece.inside}"
        real = own[~is_cap[own]]
        if len(real):
            work.drop("inner surface", f"it lies inside {named}", real, piece.area)
    for sentence in hull.failed:
        work.problems.append(Problem("union", _middle(came), came.diagonal, sentence))
    cap_after = is_cap[hull.parents]
    if hull.cut.any():
        reason = f"{len(np.unique(body))} bodies overlap and become one surface"
        some = hull.triangulation.take(hull.cut)
        work.actions.append(
            Action("unite", "re-trim", _middle(some), some.diagonal, 0.0, reason, int(hull.cut.sum()))
        )
    work.follow(hull.triangulation, hull.parents, hull.cut)
    if cap_after.any():
        left = np.flatnonzero(~cap_after)
        work.follow(work.now.take(left), left)
    return kept


def _drop_flat(work: _Work, body: IntArray) -> IntArray:
    """Drop closed bodies without volume (a triangle and its back); returns the triangles that stay."""
    parts = int(body.max(initial=-1)) + 1
    corners = work.now.corners
    local = corners - work.now.bounds.mean(axis=0)
    volume = np.bincount(body, np.einsum("ij,ij->i", local[:, 0], np.cross(local[:, 1], local[:, 2])), minlength=parts)
    area = np.bincount(body, work.now.areas, minlength=parts)
    thick = np.abs(volume) / 6.0 / np.maximum(0.5 * area, np.finfo(float).tiny)
    scrap = (thick <= work.distance) & (area < STRAY_SHARE * area.sum())
    flat = (thick <= work.tolerance.gap) | scrap
    left = np.flatnonzero(~flat[body])
    if len(left) < len(body) and len(left):
        gone = np.flatnonzero(flat[body])
        work.drop("bodies without volume", f"thinner than {max(work.tolerance.gap, work.distance):.3g}", gone)
        work.follow(work.now.take(left), left)
        return left
    return np.arange(len(body))


def _result(work: _Work, kept: tuple[Array, ...]) -> Mended:
    work.now = work.now.compact()
    closed = bool(len(work.now)) and bool((Adjacency.of(work.now).use_count == 2).all())
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


def _longest(triangulation: Triangulation) -> Array:
    """(m,) longest edge of each triangle."""
    corners = triangulation.corners
    return np.asarray(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1, initial=0.0))


def _known(source: IntArray) -> IntArray:
    return source[source >= 0]


def _middle(triangulation: Triangulation) -> Array:
    return np.asarray(triangulation.bounds.mean(axis=0))
