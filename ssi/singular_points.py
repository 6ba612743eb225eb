"""Points where the surfaces are tangent or a parametrisation degenerates: found, merged, left along rays."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.ssi.bezier_pieces import BezierPieces

RADIUS = 1e-3  # of the size: inside, a branch is one piece from its last node to the point
CLUSTER = 2e-3  # the same where more than two branches meet: nearer, angles of 1e-6 cost the points their digits
MOST = 64  # clusters examined for osculation
MERGE = 1e-6  # of the size: contacts nearer than this are one


@dataclass(frozen=True, slots=True, eq=False)
class Ball:
    """A singular point and the ball in which arcs are led straight to it (scaled coordinates).

    `places` are its local parameters (4,) in the pairs of pieces that hold it; `kind` is "branch", "touch",
    "osculation" (the surfaces agree to second order) or "cluster" (boxes left at the tolerance; `pole`: at one).
    """

    centre: Array
    radius: float
    kind: str
    gap: float
    places: tuple[tuple[tuple[int, int], Array], ...]
    rows: Array = field(default_factory=lambda: np.empty((0, 20)))
    pole: bool = False
    lead: Callable[[Array, Array, tuple[int, int]], tuple[Array, Array]] | None = None


def balls_of(rows: Array, tol: float, pieces: tuple[BezierPieces, BezierPieces]) -> tuple[list[Ball], list[Ball]]:
    """Branch points, touches and clusters of boxes left over, each once; and clusters where nothing is singular."""
    from patchwright.ssi._subdivision_kernel import BRANCH, SINGULAR, TANGENT, TOUCH

    codes = rows[:, 0].astype(np.int64)
    out: list[Ball] = []
    plain: list[Ball] = []
    for code, kind in ((BRANCH, "branch"), (TOUCH, "touch")):
        found = rows[codes == code]
        for group in grouped(found[:, 15:18], max(MERGE, 4.0 * tol)):
            part = found[group]
            centre = part[:, 15:18].mean(axis=0)
            if out and min(np.linalg.norm(ball.centre - centre) for ball in out) <= 2.0 * MERGE:
                continue
            places = {(int(r[1]), int(r[2])): r[11:15] for r in part}
            radius = float(min(RADIUS, 0.5 * part[:, 19].max())) if kind == "branch" else 1e-7
            out.append(Ball(centre, radius, kind, float(part[:, 18].max()), tuple(places.items())))
    tangent = rows[codes == TANGENT][:, 15:18]
    left = rows[codes == SINGULAR]
    out += _osculations(left, rows, tol, pieces)
    if left.size and out:
        far = np.array([np.linalg.norm(left[:, 15:18] - ball.centre, axis=1) - ball.radius for ball in out]).min(axis=0)
        left = left[far > 4.0 * left[:, 18]]
    if left.size and tangent.size:
        from scipy.spatial import cKDTree

        left = left[cKDTree(tangent).query(left[:, 15:18])[0] > 4.0 * left[:, 18] + 1e-4]
    if left.size:
        for group in grouped(left[:, 15:18], 4.0 * float(np.median(left[:, 18])) + 16.0 * tol):
            part = left[group]
            centre = part[:, 15:18].mean(axis=0)
            radius = float((np.linalg.norm(part[:, 15:18] - centre, axis=1) + part[:, 18]).max()) * 2.0
            places = {
                (int(r[1]), int(r[2])): np.array(
                    [0.5 * (r[3] + r[4]), 0.5 * (r[5] + r[6]), 0.5 * (r[7] + r[8]), 0.5 * (r[9] + r[10])]
                )
                for r in part
            }
            pole, point = _pole(part, pieces)
            if not pole and _steepest(places, pieces) > 1e3 * float(part[:, 18].max()):
                plain.append(Ball(centre, 0.0, "plain", 0.0, tuple(places.items()), part))
                continue
            if pole:
                centre = point
            elif np.linalg.norm(part[:, 15:18].max(axis=0) - part[:, 15:18].min(axis=0)) < 1e-2:
                radius = max(radius, CLUSTER)
            out.append(Ball(centre, radius, "cluster", 0.0, tuple(places.items()), part, pole))
    return out, plain


def _osculations(left: Array, rows: Array, tol: float, pieces: tuple[BezierPieces, BezierPieces]) -> list[Ball]:
    """Points of second-order contact next to boxes left over, each once."""
    from patchwright.ssi.osculation import osculation

    out: list[Ball] = []
    for group in grouped(left[:, 15:18], 4.0 * float(np.median(left[:, 18])) + 16.0 * tol)[:MOST] if left.size else []:
        row = left[group[np.argmax(left[group, 18])]]
        if any(np.linalg.norm(row[15:18] - ball.centre) < ball.radius for ball in out):
            continue
        i, j = int(row[1]), int(row[2])
        found = osculation(pieces[0].nets[i], pieces[1].nets[j], 0.5 * (row[3:11:2] + row[4:11:2]), tol)
        if found is not None:
            near = rows[np.linalg.norm(rows[:, 15:18] - found.point, axis=1) < 2.0 * CLUSTER]
            places = places_of(found.point, near, pieces, 1e-9)
            if places:
                out.append(Ball(found.point, CLUSTER, "osculation", found.gap, places))
    return out


def places_of(
    x: Array, rows: Array, pieces: tuple[BezierPieces, BezierPieces], reach: float
) -> tuple[tuple[tuple[int, int], Array], ...]:
    """The local parameters of a point in all pairs of pieces among findings that come as near as `reach`."""
    from patchwright.ssi._tracing_kernel import surface_jets

    feet: tuple[dict[int, Array], dict[int, Array]] = ({}, {})
    for side in (0, 1):
        for k, box in zip(rows[:, 1 + side].astype(int).tolist(), rows[:, 3 + 4 * side : 7 + 4 * side], strict=True):
            if k in feet[side]:
                continue
            w = 0.5 * (box[::2] + box[1::2])
            for _ in range(12):
                jet = surface_jets(pieces[side].nets[k], w[None].copy())[0]
                w = np.clip(w + np.linalg.lstsq(jet[1:3].T, x - jet[0], rcond=None)[0], -0.5, 1.5)
            if np.linalg.norm(jet[0] - x) < reach and ((w > -1e-7) & (w < 1.0 + 1e-7)).all():
                feet[side][k] = np.clip(w, 0.0, 1.0)
    pairs = dict.fromkeys(zip(rows[:, 1].astype(int).tolist(), rows[:, 2].astype(int).tolist(), strict=True))
    return tuple(((i, j), np.concatenate((feet[0][i], feet[1][j]))) for i, j in pairs if i in feet[0] and j in feet[1])


def _steepest(places: dict[tuple[int, int], Array], pieces: tuple[BezierPieces, BezierPieces]) -> float:
    """The least sine of the angle between the surfaces at places; 0 where a normal vanishes."""
    from patchwright.ssi._tracing_kernel import surface_jets

    sines = []
    for (i, j), w in places.items():
        n = []
        for side, k in ((0, i), (1, j)):
            jet = surface_jets(pieces[side].nets[k], w[None, 2 * side : 2 * side + 2].copy())[0]
            normal = np.cross(jet[1], jet[2])
            length = float(np.linalg.norm(normal))
            if length <= 1e-12 * float(np.linalg.norm(jet[1]) * np.linalg.norm(jet[2])) or length == 0.0:
                return 0.0
            n.append(normal / length)
        sines.append(float(np.linalg.norm(np.cross(n[0], n[1]))))
    return min(sines)


def _pole(rows: Array, pieces: tuple[BezierPieces, BezierPieces]) -> tuple[bool, Array]:
    """Whether a box touches a degenerate edge of its piece, and the point that is."""
    for row in rows:
        for side in (0, 1):
            net = pieces[side].nets[int(row[1 + side])]
            box = row[3 + 4 * side : 7 + 4 * side]
            points = net[..., :3] / net[..., 3:]
            for at_end, edge in (
                (box[0] <= 0.0, points[0]),
                (box[1] >= 1.0, points[-1]),
                (box[2] <= 0.0, points[:, 0]),
                (box[3] >= 1.0, points[:, -1]),
            ):
                if at_end and np.ptp(edge, axis=0).max() < 1e-12:
                    return True, edge[0]
    return False, rows[0, 15:18]


def grouped(points: Array, reach: float) -> list[IntArray]:
    """Indices of points that hang together within a reach; of points in one cell of an eighth of it one stands for all.

    So crowds of points, as the boxes left over at an apex are, cost no more than places do.
    """
    if not points.shape[0]:
        return []
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    cell = np.floor((points - points.min(axis=0)) / (0.125 * reach))
    _, lead, which = np.unique(cell, axis=0, return_index=True, return_inverse=True)
    pairs = cKDTree(points[lead]).query_pairs(reach, output_type="ndarray")
    n = lead.shape[0]
    graph = coo_matrix((np.ones(pairs.shape[0]), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    count, label = connected_components(graph, directed=False)
    whole = label[which.reshape(-1)]
    order = np.argsort(whole, kind="stable")
    return sorted(np.split(order, np.searchsorted(whole[order], np.arange(1, count))), key=lambda group: int(group[0]))


def ray_seeds(
    balls: list[Ball], pieces: tuple[BezierPieces, BezierPieces], tol: float
) -> Iterator[tuple[tuple[int, int], Array]]:
    """Points (k, 7) just outside the ball on the branches that leave a branch point into a pair of pieces.

    The directions are the zeros of II_a - II_b, taken with the derivatives of that very pair.
    """
    from patchwright.ssi._tracing_kernel import corrected, surface_jets

    for ball in balls:
        if ball.kind != "branch":
            continue
        for (i, j), w in ball.places:
            A, B = pieces[0].nets[i], pieces[1].nets[j]
            ja, jb = surface_jets(A, w[None, :2].copy())[0], surface_jets(B, w[None, 2:].copy())[0]
            n = np.cross(ja[1], ja[2])
            n /= np.linalg.norm(n)
            e1 = ja[1] / np.linalg.norm(ja[1])
            e2 = np.cross(n, e1)
            forms, back = [], []
            for jet in (ja, jb):
                K = np.linalg.inv(np.array([[e1 @ jet[1], e1 @ jet[2]], [e2 @ jet[1], e2 @ jet[2]]]))
                W = np.array([[n @ jet[3], n @ jet[4]], [n @ jet[4], n @ jet[5]]])
                forms.append(K.T @ W @ K)
                back.append(K)
            values, vectors = np.linalg.eigh(forms[0] - forms[1])
            if values[0] >= 0.0 or values[1] <= 0.0:
                continue
            p, q = np.sqrt(-values[0]), np.sqrt(values[1])
            starts, T = [], []
            for sx, sy in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
                d = vectors @ np.array([sx * q, sy * p]) / np.hypot(p, q)
                rate = np.concatenate((back[0] @ d, back[1] @ d))
                start = w + 1.3 * ball.radius * rate
                starts.append(start)
                T.append(d[0] * e1 + d[1] * e2)
            level = np.array([t @ ball.centre + 1.3 * ball.radius for t in T])
            jets, gaps = corrected(A, B, np.array(starts), np.array(T), level)
            x, at = jets[:, 0, :3], jets[:, 0, 3:]
            good = (gaps >= 0.0) & (np.linalg.norm(x - ball.centre, axis=1) < 3.0 * ball.radius)
            slack = 1e-9 + 4.0 * tol
            good &= ((at >= -slack) & (at <= 1.0 + slack)).all(axis=1)
            if good.any():
                yield (i, j), np.concatenate((np.clip(at[good], 0.0, 1.0), x[good]), axis=1)


def arc_to_centre(jets: Array, lengths: Array, side: int, ball: Ball, which: tuple[int, int]) -> tuple[Array, Array]:
    """The arc led on from its first (side 0) or last node to the ball's centre.

    Tangent, curvature and free parameters there are those of the arc's last piece run on; the place is the centre.
    """
    from patchwright.ssi.arcs import hermite

    if side == 0:
        turned = jets[::-1].copy()
        turned[:, 1] *= -1.0
        more, longer = arc_to_centre(turned, lengths[::-1], 1, ball, which)
        more = more[::-1].copy()
        more[:, 1] *= -1.0
        return more, longer[::-1].copy()
    if ball.lead is not None:
        return ball.lead(jets, lengths, which)
    a, b, L = jets[-2], jets[-1], float(lengths[-1])
    ahead = float((ball.centre - b[0, :3]) @ b[1, :3])
    ahead = max(ahead, 1e-3 * float(np.linalg.norm(ball.centre - b[0, :3])))
    h = 1e-2 * L
    t = 1.0 + ahead / L
    f = [hermite(a, b, L, t + k * h / L) for k in (-1, 0, 1)]
    end = np.array([f[1], (f[2] - f[0]) / (2.0 * h), (f[2] - 2.0 * f[1] + f[0]) / h**2])
    length = float(np.linalg.norm(end[1, :3]))
    end[1] /= length
    end[0, :3] = ball.centre
    for pair, w in ball.places:
        if pair == which and ball.kind in ("branch", "osculation"):
            end[0, 3:] = w
    end[0, 3:] = np.clip(end[0, 3:], 0.0, 1.0)
    chord = float(np.linalg.norm(ball.centre - b[0, :3]))
    return np.concatenate((jets, end[None])), np.append(lengths, chord)
