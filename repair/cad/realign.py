"""Put a displaced piece back: one rigid motion that lays its border onto the border of the hole it left.

A face (or a sewn group of faces) that was shifted or turned as a whole still has the shape of its hole; one that no
motion fits may have shrunk or grown, and a similarity is looked for when asked: a plane stays the plane it is, and only
its trims move. The motion is
found from the rims alone: differences of corners propose shifts, Gauss-Newton on the distances along the normals of
the target curves finishes (Chen and Medioni, Object modelling by registration of multiple range images, 1992, for
curves), every distance weighed down by its own size, so that stretches without a counterpart, where the neighbour was
displaced too, do not pull. It counts only when most of the border then lies on the hole's to round-off: a fit that is
merely good is no evidence. Symmetric rims leave some motions free; the smallest is taken.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from patchwright.models.analytic import Plane
from patchwright.models.arrays import Array, IntArray
from patchwright.models.cad.connectivity import components, is_point
from patchwright.models.cad.editing import Loops, with_loops
from patchwright.models.closest_point import closest_on_curve
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.rigid_motion import RigidMotion
from patchwright.models.similarity import Similarity
from patchwright.models.surface import Surface
from patchwright.models.topology import EdgeUse, Topology
from patchwright.repair.cad.draft import RIM_SHARE, Change, Draft, Limits, apart
from patchwright.repair.cad.pcurves import widened
from patchwright.repair.result import Rung

SAMPLES = 33  # per edge
THIN = 4  # every which of them takes part in the fit
PROPOSALS = 4  # shifts tried
STEPS = 16
PATIENCE = 3  # steps in a row without getting nearer before a proposal is given up
MOST = 0.6  # of a border that must fit to round-off
TWINS = 0.25  # of a border that must fit, corner on corner, where the rest lies at an opening
BENT = 0.05  # second extent to the first: less is a line, along which a piece may slide
COARSE = 4.0  # rows farther off than the median times this hardly pull
RESIZED = 0.1  # the largest change of size that is looked for
IN_PLANE = 1e-12  # of a border's size and distance from the origin: it stays in its plane
NEGLIGIBLE = 1e-9  # singular values below this share of the largest are motions that the rims leave free


@dataclass(frozen=True, slots=True, eq=False)
class _Rims:
    """Dense points of edges, and which edge each is of."""

    curves: tuple[NurbsCurve, ...]
    points: Array
    owner: IntArray
    corners: Array

    @property
    def length(self) -> float:
        """Of all edges, along their points."""
        steps = np.diff(self.points.reshape(-1, SAMPLES, 3), axis=1)
        return float(np.linalg.norm(steps, axis=2).sum())

    @classmethod
    def of(cls, draft: Draft, edges: list[int]) -> _Rims:
        curves = tuple(draft.topology.curves[e] for e in edges)
        points = np.stack([c(np.linspace(*c.domain, SAMPLES)) for c in curves])
        owner = np.repeat(np.arange(len(edges), dtype=np.int64), SAMPLES)
        return cls(curves, points.reshape(-1, 3), owner, points[:, [0, -1]].reshape(-1, 3))


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    """A motion, and the share of a border that lies on others' to the residual after it."""

    motion: Similarity
    residual: float
    share: float


def realign(draft: Draft, limits: Limits, *, sized: bool = False) -> tuple[Draft, tuple[Change, ...]]:
    """Every loose piece that one rigid motion fits into the hole it left; the largest piece stays where it is.

    `sized` allows a change of size too. Rings and rectangles of any size fit each other, so that is weak evidence where
    trims can be carried on to the neighbours instead: it is for what is left after that.
    """
    topology = draft.topology
    owner = {e: f for e, f in draft.owners().items() if not is_point(topology.curves[e])}
    groups = components(topology)
    areas = [sum(_size(draft, face) for face in group) for group in groups]
    group_of = {face: number for number, group in enumerate(groups) for face in group}
    largest = int(np.argmax(areas))
    changes: list[Change] = []
    loose = [k for k in range(len(groups)) if k != largest]
    while not limits.expired:  # a piece put back completes the holes of its neighbours
        best: tuple[float, int, list[int], _Fit] | None = None
        for number in loose:
            own = [e for e, f in owner.items() if group_of[f] == number]
            others = [e for e, f in owner.items() if group_of[f] != number]
            if not own or not others or limits.expired:
                continue
            rims, hole = _Rims.of(draft, own), _Rims.of(draft, others)
            fit = _motion(rims, hole, limits, sized)
            if fit is None and not sized:
                fit = _by_twins(draft, own, rims, hole, limits)
            # of two pieces that fit each other the one moves that has the longer border in place then
            if fit is not None and (best is None or fit.share * rims.length > best[0]):
                best = fit.share * rims.length, number, own, fit
        if best is None:
            break
        change, draft = _put_back(draft, groups[best[1]], best[2], best[3], limits)
        changes.append(change)
        loose.remove(best[1])
    return draft, tuple(changes)


def _by_twins(draft: Draft, own: list[int], rims: _Rims, hole: _Rims, limits: Limits) -> _Fit | None:
    """The motion of a piece that borders an opening as well, so that much of its border has no counterpart.

    Edges that have a twin of their own length among the hole's are enough where all of them come to lie on it, corner
    on corner, and do not run along one line.
    """
    twins = _twins(rims, hole, limits)
    if len(twins) < 2 or len(twins) == len(own):
        return None
    some = _Rims.of(draft, [own[k] for k in twins])
    spread = np.linalg.svd(some.points - some.points.mean(axis=0), compute_uv=False)
    share = some.length / rims.length
    if spread[1] < BENT * spread[0] or share < TWINS:
        return None
    fit = _motion(some, hole, limits, sized=False, most=1.0)
    if fit is None or apart(fit.motion(some.corners), hole.corners).max() > limits.on:
        return None
    return replace(fit, share=share)


def _twins(rims: _Rims, hole: _Rims, limits: Limits) -> list[int]:
    """The edges of a border with a twin: an edge of the hole as long as they are, its corners within reach of theirs.

    Each is the nearest such edge of the other.
    """
    (length, ends), (others, tips) = ((_lengths(some), some.corners.reshape(-1, 2, 3)) for some in (rims, hole))
    along, against = (np.linalg.norm(ends[:, None] - some[None], axis=3).max(axis=2) for some in (tips, tips[:, ::-1]))
    gap = np.minimum(along, against)
    gap[np.abs(length[:, None] - others[None]) > limits.on] = np.inf
    gap[gap > np.minimum(limits.reach, RIM_SHARE * length)[:, None]] = np.inf
    best = gap.argmin(axis=1)
    mutual = gap.argmin(axis=0)[best] == np.arange(len(ends))
    return np.flatnonzero(mutual & np.isfinite(gap.min(axis=1))).tolist()


def _lengths(rims: _Rims) -> Array:
    """(e,) along each edge's points: of congruent edges they are equal, whichever way the edges run."""
    steps = np.diff(rims.points.reshape(-1, SAMPLES, 3), axis=1)
    return np.asarray(np.linalg.norm(steps, axis=2).sum(axis=1))


def _put_back(draft: Draft, faces: list[int], own: list[int], fit: _Fit, limits: Limits) -> tuple[Change, Draft]:
    scale = fit.motion.scale
    draft, move = _applied(draft, faces, fit.motion)
    what = "displaced" if scale == 1.0 else "shrunk" if scale > 1.0 else "grown"
    how = "rigid motion" if scale == 1.0 else f"motion with a change of size by {scale:.6g}"
    change = Change(
        f"{what} face{'s' * (len(faces) > 1)} put back",
        Rung.REALIGN,
        tuple(faces),
        f"{fit.share:.0%} of its border lies on its neighbours' to {fit.residual:.2g} after one {how}",
        limits.on,
        move,
        _Rims.of(draft, own).points.mean(axis=0),
    )
    return change, draft


def _size(draft: Draft, face: int) -> float:
    """The diagonal of a face's border, for telling large from small."""
    edges = {use.edge for loop in draft.topology.loops[face] for use in loop}
    points = np.concatenate([draft.topology.curves[e].control_points for e in edges])
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def _motion(own: _Rims, others: _Rims, limits: Limits, sized: bool, most: float = MOST) -> _Fit | None:
    """The motion that lays a share `most` of `own` onto `others`; None where there is none or none is needed.

    `sized` allows a change of size too.
    """
    size = float(np.linalg.norm(np.ptp(own.points, axis=0)))
    reach = min(limits.reach, RIM_SHARE * size)
    centre = own.points.mean(axis=0)
    if float(np.median(apart(own.points, others.points))) > reach:
        return None
    if (_nearest(others, own.points[::THIN])[1] <= limits.on).mean() >= most:
        return None  # it is in place
    shifts = (others.corners[None] - own.corners[:, None]).reshape(-1, 3)
    shifts = shifts[np.linalg.norm(shifts, axis=1) <= reach]
    shifts = np.concatenate([np.zeros((1, 3)), shifts])
    misfit = np.array([float(np.mean(apart(own.points[::THIN] + shift, others.points))) for shift in shifts])
    done: list[Array] = []
    for k in np.argsort(misfit, kind="stable"):
        if len(done) >= PROPOSALS:
            break
        if any(np.linalg.norm(shifts[k] - other) <= 1e-3 * reach for other in done):
            continue
        done.append(shifts[k])
        start = Similarity(RigidMotion.of(np.zeros(3), centre, shifts[k]))
        motion = _fitted(own, others, start, limits, sized)
        if motion is None:
            continue
        moved = motion(own.points)
        far = _nearest(others, moved)[1]
        fits = far <= limits.on
        if fits.mean() >= most and np.linalg.norm(moved - own.points, axis=1).max() <= reach:
            return _Fit(motion, float(far[fits].max()), float(fits.mean()))
    return None


def _fitted(own: _Rims, others: _Rims, like: Similarity, limits: Limits, sized: bool) -> Similarity | None:
    """Gauss-Newton from a first motion; None where it leaves the neighbourhood."""
    best, tired = np.inf, 0
    motion, scale = like.motion, like.scale
    for _ in range(STEPS):
        at = Similarity(motion, scale)(own.points[::THIN])
        feet, far = _nearest(others, at)
        middle = float(np.median(far))
        best, tired = (middle, 0) if middle < 0.7 * best else (best, tired + 1)
        if tired > PATIENCE and best > limits.on:
            return None
        away = feet - at
        width = max(COARSE * middle, 1e-4 * limits.on)
        weight = 1.0 / (1.0 + (far / width) ** 2)
        if middle > limits.reach:
            return None
        arm = at - (motion.centre + motion.shift)
        # rows of d(at) = turn x arm + shift (+ growth * arm)
        zero = np.zeros(len(at))
        cross = np.stack(
            [
                np.stack([zero, arm[:, 2], -arm[:, 1]], axis=1),
                np.stack([-arm[:, 2], zero, arm[:, 0]], axis=1),
                np.stack([arm[:, 1], -arm[:, 0], zero], axis=1),
            ],
            axis=1,
        )
        longest = float(np.abs(arm).max())
        rows = np.concatenate([cross / longest, np.broadcast_to(np.eye(3), cross.shape)], axis=2)
        if sized:
            rows = np.concatenate([rows, arm[:, :, None] / longest], axis=2)
        across = np.eye(3) - _tangents(others, feet)
        rows, right = across @ rows * weight[:, None, None], (across @ away[..., None])[..., 0] * weight[:, None]
        found = np.linalg.lstsq(rows.reshape(-1, rows.shape[2]), right.ravel(), rcond=NEGLIGIBLE)[0]
        turn = RigidMotion.of(found[:3] / longest, np.zeros(3), np.zeros(3)).rotation
        motion = RigidMotion(turn @ motion.rotation, motion.centre, motion.shift + found[3:6])
        if sized:
            scale *= 1.0 + float(found[6]) / longest
            if abs(scale - like.scale) > RESIZED:
                return None
        if np.abs(found).max() <= 1e-5 * limits.on:
            break
    return Similarity(motion, scale)


def _nearest(rims: _Rims, points: Array) -> tuple[Array, Array]:
    """Feet of points on the nearest curves and the distances."""
    from scipy.spatial import cKDTree

    found = np.asarray(cKDTree(rims.points).query(points)[1], dtype=np.int64)
    place = rims.owner[found]
    feet = np.empty_like(points)
    for edge in np.unique(place):
        mine = place == edge
        curve = rims.curves[int(edge)]
        t0, t1 = curve.domain
        start = t0 + (t1 - t0) * (found[mine] % SAMPLES) / (SAMPLES - 1)
        feet[mine] = closest_on_curve(curve, points[mine], start=np.clip(start, t0, t1)).points
    return feet, np.linalg.norm(feet - points, axis=1)


def _tangents(rims: _Rims, feet: Array) -> Array:
    """(k, 3, 3) t t^T of the unit tangents of the sampled rims nearest to points, zero at a corner."""
    from scipy.spatial import cKDTree

    found = np.asarray(cKDTree(rims.points).query(feet)[1], dtype=np.int64)
    step = found % SAMPLES
    before, after = found - (step > 0), found + (step < SAMPLES - 1)
    along = rims.points[after] - rims.points[before]
    length = np.linalg.norm(along, axis=1, keepdims=True)
    along = np.divide(along, length, out=np.zeros_like(along), where=length > 0.0)
    return np.asarray(along[:, :, None] * along[:, None, :])


def _applied(draft: Draft, faces: list[int], motion: Similarity) -> tuple[Draft, float]:
    """The faces moved, and by how much at most; a plane that is moved into itself stays, and its trims move."""
    topology = draft.topology
    edges = sorted({use.edge for face in faces for loop in topology.loops[face] for use in loop})
    curves, vertices = list(topology.curves), topology.vertices.copy()
    for edge in edges:
        curves[edge] = motion.curve(curves[edge])
    corners = np.unique(topology.ends[edges])
    vertices[corners] = motion(topology.vertices[corners])
    surfaces: dict[int, Surface] = {}
    same: dict[int, Surface] = {}
    loops: dict[int, Loops] = {}
    for face in faces:
        old = draft.surface(face)
        if isinstance(old, Plane) and motion.scale != 1.0 and _into_itself(old, topology, face, motion):
            loops[face] = _redrawn(old, topology.loops[face], curves)
            points = np.concatenate([use.pcurve.control_points for loop in loops[face] for use in loop])
            same[face] = widened(old, points)
            continue
        surfaces[face] = motion.surface(old)
        if motion.scale != 1.0:
            loops[face] = _resized(topology.loops[face], motion.factors(old))
    move = float(np.linalg.norm(vertices[corners] - topology.vertices[corners], axis=1).max(initial=0.0))
    points = np.concatenate([topology.curves[e].control_points for e in edges])
    move = max(move, float(np.linalg.norm(motion(points) - points, axis=1).max()))
    moved = replace(with_loops(topology, loops), curves=tuple(curves), vertices=vertices)
    draft = draft.with_surfaces(surfaces, moved, same=False)
    return draft.with_surfaces(same, moved, same=True), move


def _into_itself(plane: Plane, topology: Topology, face: int, motion: Similarity) -> bool:
    """Whether the border stays in the plane to round-off."""
    points = np.concatenate([topology.curves[u.edge].control_points for loop in topology.loops[face] for u in loop])
    off = np.abs((motion(points) - plane.origin) @ plane.normal).max()
    return bool(off <= IN_PLANE * max(float(np.ptp(points, axis=0).max()), float(np.abs(points).max())))


def _redrawn(plane: Plane, loops: Loops, curves: list[NurbsCurve]) -> Loops:
    """Loops whose pcurves are the images of the edges' curves in the plane."""
    axes = np.stack([plane.xdir, plane.ydir], axis=1)

    def below(use: EdgeUse) -> EdgeUse:
        curve = curves[use.edge]
        flat = (curve.control_points - plane.origin) @ axes
        return replace(use, pcurve=NurbsCurve(curve.degree, curve.knots, flat, curve.weights))

    return tuple(tuple(below(use) for use in loop) for loop in loops)


def _resized(loops: Loops, factors: Array) -> Loops:
    """Loops with the parameters of their pcurves multiplied."""

    def times(pcurve: NurbsCurve) -> NurbsCurve:
        return NurbsCurve(pcurve.degree, pcurve.knots, pcurve.control_points * factors, pcurve.weights)

    return tuple(tuple(replace(use, pcurve=times(use.pcurve)) for use in loop) for loop in loops)
