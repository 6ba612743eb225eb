"""The uniting stage of mending: one outer surface out of the bodies; open ends are closed for it and opened again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.adjacency import Adjacency
from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.triangulation import CHUNK, Triangulation
from patchwright.repair.mender.bridge import borders_of
from patchwright.repair.mender.clean import split_non_manifold
from patchwright.repair.mender.mend_gaps import fill
from patchwright.repair.mender.mended import BRIDGED, STRAY_SHARE, Action, Problem, Work, known, middle
from patchwright.repair.mender.orient import orient
from patchwright.repair.mender.outer_hull import Hull, outer_hull
from patchwright.repair.mender.untangle import inner_patches, winding

SHEET = 0.4  # a body whose openings take more of its area than this is an open sheet, not a body with openings


def unite(work: Work, openings: str) -> tuple[Array, ...]:
    """Close what is open for the union, unite, and open the kept openings again."""
    borders = borders_of(work.now, work.adjacency())
    whole = len(work.now)
    if borders:
        fill(work, borders, list(range(len(borders))), [], "close")
    work.now = split_non_manifold(work.now, work.adjacency())
    oriented = orient(work.now, work.adjacency())
    work.now = oriented.triangulation
    body = oriented.components
    is_cap = np.arange(len(work.now)) >= whole
    sheet = _sheets(work, body, is_cap, openings)
    if openings == "keep":
        work.actions = [action for action in work.actions if action.kind != "close"]
    lone = np.flatnonzero(sheet[body] & ~is_cap)
    sheets = work.now.take(lone), work.source[lone], work.origin[lone]
    solid = np.flatnonzero(~sheet[body])
    work.follow(work.now.take(solid), solid)
    is_cap, body = is_cap[solid], body[solid]
    left = _drop_flat(work, body)
    is_cap, body = is_cap[left], np.unique(body[left], return_inverse=True)[1].reshape(-1)
    hull, is_cap, body = _hull(work, is_cap, body, openings)
    names = {b: work.names(known(work.source[body == b])) for b in {piece.inside for piece in hull.inside} - {-1}}
    for piece in hull.inside:
        named = ", ".join(names.get(piece.inside, ())) or "another body"
        real = piece.triangles[~is_cap[piece.triangles]]
        work.drop("inner surface", f"it lies inside {named}", real, piece.area)
    for sentence in hull.failed:
        work.problems.append(Problem("union", middle(work.now), work.now.diagonal, sentence))
    if hull.cut.any():
        bodies = int(body.max()) + 1
        reason = f"{bodies} bodies overlap" if bodies > 1 else "a body passes through itself"
        reason += " and become one surface" if bodies > 1 else " and is cut where it does"
        some = hull.triangulation.take(hull.cut)
        work.actions.append(Action("unite", "re-trim", middle(some), some.diagonal, 0.0, reason, int(hull.cut.sum())))
    work.follow(hull.triangulation, hull.parents, hull.cut)
    if openings == "keep":
        left = np.flatnonzero(~is_cap[hull.parents])
        if len(left) < len(work.now):
            work.follow(work.now.take(left), left)
    work.now = split_non_manifold(work.now, work.adjacency())
    _drop_hollows(work)
    if len(lone):
        _join_sheets(work, *sheets)
    if openings == "close" and len(lone):
        for border in borders_of(work.now, work.adjacency()):
            message = "an open sheet encloses nothing and cannot be closed"
            work.problems.append(Problem("sheet", border.points.mean(axis=0), border.size, message))
    return tuple(border.points for border in borders_of(work.now, work.adjacency()))


def _drop_hollows(work: Work) -> None:
    """Cavities bounded by nothing but auxiliary caps are no part of the model."""
    if not len(work.now):
        return
    label = np.asarray(work.adjacency().components())
    real = np.bincount(label, work.origin != BRIDGED) > 0
    left = np.flatnonzero(real[label])
    if 0 < len(left) < len(label):
        work.follow(work.now.take(left), left)


def _hull(work: Work, is_cap: BoolArray, body: IntArray, openings: str) -> tuple[Hull, BoolArray, IntArray]:
    """The outer hull of all bodies; where it cannot be told, once more without the patches inside their own body.

    A body that merely crosses a cap that goes again does not pass through itself.
    """
    pairs = work.crossings()
    pairs = pairs[body[pairs[:, 0]] == body[pairs[:, 1]]]
    if openings == "keep":
        pairs = pairs[~is_cap[pairs].any(axis=1)]
    hull = outer_hull(work.now, body, tangled=np.unique(body[pairs]))
    if not (hull.failed and len(pairs)):
        return hull, is_cap, body
    is_cap, body = _without_inner_patches(work, is_cap, body, pairs)
    return outer_hull(work.now, body), is_cap, body


def _without_inner_patches(
    work: Work, is_cap: BoolArray, body: IntArray, pairs: IntArray
) -> tuple[BoolArray, IntArray]:
    """The same where the cuts are too near each other: whole patches go, and caps close what that opens."""
    inner = inner_patches(work.now, body, pairs, 10.0 * work.tolerance.gap)
    if not inner.any():
        return is_cap, body
    before = work.mark()
    names = ", ".join(work.names(known(work.source[inner]))) or "its own body"
    real = np.flatnonzero(inner & ~is_cap)
    work.drop("inner surface", f"it lies inside {names}", real)
    left = np.flatnonzero(~inner)
    work.follow(work.now.take(left), left)
    borders = borders_of(work.now, work.adjacency())
    fill(work, borders, list(range(len(borders))), [], "cap")
    work.actions = [action for action in work.actions if action.kind != "cap"]
    oriented = orient(split_non_manifold(work.now))
    work.now = oriented.triangulation
    if work.adjacency().free.any():
        work.back(before)
        return is_cap, body
    caps = np.zeros(len(work.now), dtype=np.bool_)
    caps[: len(left)] = is_cap[left]
    return caps, oriented.components


def _sheets(work: Work, body: IntArray, is_cap: BoolArray, openings: str) -> BoolArray:
    """(b,) bodies that are open sheets: closing them would enclose nothing, or would take more cap than surface."""
    parts = int(body.max(initial=-1)) + 1
    area = np.bincount(body, work.now.areas, minlength=parts)
    cap = np.bincount(body, work.now.areas * is_cap, minlength=parts)
    thick = _thickness(work.now, body)
    capped = np.bincount(body, is_cap, minlength=parts) > 0
    sheet = capped & (thick <= np.maximum(work.tolerance.gap, 1e-6 * np.sqrt(area)))
    # what could not be closed at all
    adjacency = work.adjacency()
    sheet |= np.bincount(body, adjacency.free[adjacency.triangle_edges].any(axis=1), minlength=parts) > 0
    if openings == "keep":
        sheet |= cap > SHEET * area
    return np.asarray(sheet)


def _join_sheets(work: Work, sheets: Triangulation, source: IntArray, origin: IntArray) -> None:
    """Put the open sheets beside the united bodies; those inside them go, with a label."""
    inner = np.zeros(len(sheets), dtype=np.bool_)
    label = np.asarray(Adjacency.of(sheets).components())
    closed = len(work.now) > 0
    if closed:
        around = _around(work.now, sheets, label)
        share = np.bincount(label, sheets.areas * (around > 0.5)) / np.maximum(
            np.bincount(label, sheets.areas), np.finfo(float).tiny
        )
        inner = share[label] > 0.9
    base = len(work.now.vertices)
    tags = work.now.tags
    if tags is not None and sheets.tags is not None:
        tags = np.concatenate([tags, sheets.tags])
    count = len(work.now)
    work.now = replace(
        work.now,
        vertices=np.concatenate([work.now.vertices, sheets.vertices]),
        triangles=np.concatenate([work.now.triangles, sheets.triangles + base]),
        tags=tags,
    )
    work.source, work.origin = np.concatenate([work.source, source]), np.concatenate([work.origin, origin])
    if inner.any():
        work.drop("inner wall", "an open sheet inside the closed bodies", count + np.flatnonzero(inner))
        left = np.concatenate([np.arange(count), count + np.flatnonzero(~inner)])
        work.follow(work.now.take(left), left)


def _around(solid: Triangulation, sheets: Triangulation, label: IntArray) -> Array:
    """(m,) winding number of the solid around each sheet's largest triangles, their mean for all its triangles."""
    areas, corners, solid_corners = sheets.areas, sheets.corners, solid.corners
    result = np.zeros(len(sheets))
    for sheet in range(int(label.max()) + 1):
        own = np.flatnonzero(label == sheet)
        asked = own[np.argsort(-areas[own], kind="stable")[:3]]
        result[own] = np.mean([winding(solid_corners, corners[t].mean(axis=0)) for t in asked])
    return result


def _thickness(triangulation: Triangulation, body: IntArray) -> Array:
    """(b,) volume over half the area of each body."""
    parts = int(body.max(initial=-1)) + 1
    local, triple = triangulation.vertices - triangulation.bounds.mean(axis=0), np.empty(len(body))
    for first in range(0, len(body), CHUNK):
        a, b, c = local[triangulation.triangles[first : first + CHUNK].T]
        triple[first : first + CHUNK] = np.einsum("ij,ij->i", a, np.cross(b, c))
    six = np.bincount(body, triple, minlength=parts)
    area = np.bincount(body, triangulation.areas, minlength=parts)
    return np.asarray(np.abs(six) / 6.0 / np.maximum(0.5 * area, np.finfo(float).tiny))


def _drop_flat(work: Work, body: IntArray) -> IntArray:
    """Drop closed bodies without volume (a triangle and its back); returns the triangles that stay."""
    thick = _thickness(work.now, body)
    area = np.bincount(body, work.now.areas, minlength=len(thick))
    scrap = (thick <= work.distance) & (area < STRAY_SHARE * area.sum())
    flat = (thick <= work.tolerance.gap) | scrap
    left = np.flatnonzero(~flat[body])
    if len(left) < len(body) and len(left):
        gone = np.flatnonzero(flat[body])
        work.drop("bodies without volume", f"thinner than {max(work.tolerance.gap, work.distance):.3g}", gone)
        work.follow(work.now.take(left), left)
        return left
    return np.arange(len(body))
