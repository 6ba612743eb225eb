"""One patch over a dirty geometry, from four boundary curves: the paper's method, whole.

Source: Hamann, Jean, Razdan, section 3 (HJR 4-17): Coons patch, projection both ways along its normals, artificial
points where nothing was found, bicubic approximant, error, refinement. Departures: a default of C2 least squares with
few knots beside the paper's C1 form; grid lines are added only where the error asks for them; the offset distance is
the smallest that finds what the paper's finds; the thin-skin rule (`projection`).

Limits: one patch; its boundary is as the four sides run, also over gaps. A network with smooth joins is `repair`'s.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.assembly import Assembly
from patchwright.models.curvature_jump import curvature_jump
from patchwright.models.errors import ParameterError
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.triangulation import Triangulation
from patchwright.repair.ground.true_surface import Outcome
from patchwright.repair.patches.approximant import TWISTS, bicubic_approximant
from patchwright.repair.patches.coons import offset_distance
from patchwright.repair.patches.filling import METHODS, FillStatus, fill
from patchwright.repair.patches.misfit import Misfit, misfit
from patchwright.repair.patches.patch_ground import PatchGround
from patchwright.repair.patches.patch_sides import Sides
from patchwright.repair.patches.probes import SIDE, Probes
from patchwright.repair.patches.projection import Ground, project
from patchwright.repair.patches.tensor_fit import tensor_fit

FORMS = ("c2", "c1")
HITS = ("nearest", "outermost")
FIRST = 4  # cells a side to begin with
PER_CELL = 4  # samples of the C2 form in every cell of its knots
HALVINGS = 6  # of the offset distance, at most
Progress = Callable[[str, float], None]


class Status(Enum):
    """Why refinement ended."""

    WITHIN = "within the tolerance"
    MOST = "not within the tolerance: the most cells allowed were reached"
    STUCK = "not within the tolerance: more cells no longer bring the error down"
    NOTHING = "no surface was found under the patch: it is the Coons patch itself"


@dataclass(frozen=True, slots=True, eq=False)
class LocalPatch:
    """An approximant and what it rests on.

    Parameters
    ----------
    surface : bicubic, u along south and north
    sides : the four boundary curves
    points : (m + 1, n + 1, 3) what it approximates: points of the geometry, and artificial ones
    found : (m + 1, n + 1) which are the geometry's; the border counts as given where the sides run
    parameters : u (m + 1,) and v (n + 1,) of the points on the surface
    misfit : the samples between the points
    offset : half the length of the probes (HJR 6), and `reach` the largest height a point was found at
    fill : how the artificial points came about
    outcomes : (5,) how many of the points found ended in each `Outcome`
    status, rounds : why refinement ended, after how many rounds
    tolerance : a length
    """

    surface: NurbsSurface
    sides: Sides
    points: Array
    found: BoolArray
    parameters: tuple[Array, Array]
    misfit: Misfit
    offset: float
    reach: float
    fill: FillStatus
    outcomes: IntArray
    status: Status
    rounds: int
    tolerance: float

    @property
    def invented_cells(self) -> BoolArray:
        """(m, n) the cells with a corner that is artificial."""
        f = self.found
        return np.asarray(~(f[1:, 1:] & f[:-1, 1:] & f[1:, :-1] & f[:-1, :-1]))

    @property
    def invented(self) -> float:
        """Share of the area that rests on artificial points."""
        P = self.points
        area = np.linalg.norm(np.cross(P[1:, 1:] - P[:-1, :-1], P[:-1, 1:] - P[1:, :-1]), axis=2)
        return float(area[self.invented_cells].sum() / max(area.sum(), 1e-300))

    @property
    def control_points(self) -> int:
        """How many control points the surface has."""
        return int(np.prod(self.surface.control_points.shape[:2]))

    @property
    def curvature_jump(self) -> float:
        """The largest jump of normal curvature across a knot line, 1 / length."""
        return curvature_jump(self.surface)


@dataclass(frozen=True, slots=True, eq=False)
class _Grid:
    points: Array
    found: BoolArray
    reach: float
    fill: FillStatus
    outcomes: IntArray


def approximate(
    sides: Sides,
    geometry: Assembly | Triangulation | PatchGround,
    tolerance: float,
    *,
    form: str = "c2",
    twist: str = "adini",
    filling: str = "smooth",
    parameters: str = "chord",
    offset: float | None = None,
    hits: str = "nearest",
    angle: float | None = None,
    refinement: str = "local",
    most: int = 64,
    progress: Progress | None = None,
) -> LocalPatch:
    """A bicubic patch between four sides that follows a geometry with gaps, overlaps and crossings.

    Parameters
    ----------
    geometry : a model, or one prepared for many patches by `PatchGround.of`
    tolerance : largest distance of the samples e, f, g (HJR 17) from the geometry, model unit
    form : "c2", least squares on as few knots as the tolerance allows, or "c1", the paper's (HJR 14-16)
    twist : of the C1 form: "zero" (HJR 16), "adini", "bessel"
    filling : "smooth" or "hardy" (HJR 11-13)
    parameters : "chord", chord shares averaged over the rows, or "uniform" (HJR 15)
    offset : half the probes' length (HJR 6); None: the smallest halving of an eighth of the perimeter (HJR 7) that
        finds no fewer points
    hits : of several sheets under a point take the "nearest" (HJR) or the "outermost"; over crossing sheets the first
        jumps from sheet to sheet, the second follows the outer hull
    angle : largest angle between the patch's normals and the triangles', degrees; None: not asked for
    refinement : "local", grid lines only where the error asks for them, or "uniform", M and N doubled as in the paper
    most : the largest number of cells along a side

    Raises
    ------
    ParameterError : an option that does not exist, a length that is not positive, a geometry without triangles.
    """
    _checked(form, twist, filling, parameters, refinement, hits, tolerance, offset, most)
    say = progress or (lambda label, share: None)
    say("preparing the geometry", 0.0)
    prepared = geometry if isinstance(geometry, PatchGround) else PatchGround.of(geometry)
    ground, sign = prepared.under(sides, offset)
    outermost = hits == "outermost"
    if offset is None:
        probes = _chosen(sides, ground, sign, outermost)
    else:
        shares = np.linspace(0.0, 1.0, SIDE)
        probes = Probes.of(sides.coons(shares, shares), offset, sign)
    u, v = np.linspace(0.0, 1.0, FIRST + 1), np.linspace(0.0, 1.0, FIRST + 1)
    best: LocalPatch | None = None
    rounds, stale = 0, 0
    while True:
        rounds += 1
        say(f"round {rounds}: {len(u) - 1} x {len(v) - 1} cells", min(0.1 + 0.1 * rounds, 0.9))
        made = _round(
            sides, ground, sign, probes, (u, v), (form, twist, filling, parameters), outermost, tolerance, rounds
        )
        gain = best is None or made.misfit.largest < 0.9 * best.misfit.largest
        stale = 0 if gain else stale + 1
        if best is None or made.misfit.largest < best.misfit.largest:
            best = made
        if made.status is Status.NOTHING:
            return made
        in_u, in_v = made.misfit.crowded(tolerance, angle)
        if not (in_u.any() or in_v.any()):
            return made
        if refinement == "uniform":
            in_u, in_v = np.ones_like(in_u), np.ones_like(in_v)
        if stale == 3:
            return _ended(best, Status.STUCK, rounds)
        finer = _split(u, in_u, most), _split(v, in_v, most)
        if len(finer[0]) == len(u) and len(finer[1]) == len(v):
            return _ended(best, Status.MOST, rounds)
        u, v = finer


def _checked(
    form: str,
    twist: str,
    filling: str,
    parameters: str,
    refinement: str,
    hits: str,
    tolerance: float,
    offset: float | None,
    most: int,
) -> None:
    for name, given, known in (
        ("form", form, FORMS),
        ("twist", twist, tuple(sorted(TWISTS))),
        ("filling", filling, tuple(sorted(METHODS))),
        ("parameters", parameters, ("chord", "uniform")),
        ("refinement", refinement, ("local", "uniform")),
        ("hits", hits, HITS),
    ):
        if given not in known:
            raise ParameterError(f"unknown {name} {given!r}; known are {', '.join(known)}")
    for name, length in (("tolerance", tolerance), ("offset", offset)):
        if length is not None and not (np.isfinite(length) and length > 0.0):
            raise ParameterError(f"the {name} must be a positive length, got {length}")
    if most < FIRST:
        raise ParameterError(f"a patch needs at least {FIRST} cells along a side, got {most}")


def _ended(patch: LocalPatch, status: Status, rounds: int) -> LocalPatch:
    return replace(patch, status=status, rounds=rounds)


def _chosen(sides: Sides, ground: Ground, sign: int, outermost: bool) -> Probes:
    """Probes of the smallest halving of HJR 7 that loses none of the points HJR 7 finds.

    Where the outermost sheet is wanted, one that reaches less far may have missed it: then too no smaller one is taken.
    """
    shares = np.linspace(0.0, 1.0, SIDE)
    coons = sides.coons(shares, shares)
    points = coons[1:-1, 1:-1].reshape(-1, 3)

    def found(probes: Probes) -> tuple[int, float]:
        directions, distance = probes.directions[1:-1, 1:-1].reshape(-1, 3), probes.distance
        hits = project(points, directions, np.full(len(points), distance), ground, outermost=outermost)
        return int(hits.hit.sum()), float((np.abs(2.0 * hits.t - 1.0) * distance)[hits.hit].max(initial=0.0))

    best = Probes.of(coons, float(offset_distance(coons)), sign)
    most, reach = found(best)
    for _ in range(HALVINGS):
        shorter = Probes.of(coons, 0.5 * best.distance, sign)
        count, farthest = found(shorter)
        if count < most or (outermost and farthest < 0.9 * reach):
            break
        best, most, reach = shorter, count, farthest
    return best


def _round(
    sides: Sides,
    ground: Ground,
    sign: int,
    probes: Probes,
    breaks: tuple[Array, Array],
    options: tuple[str, str, str, str],
    outermost: bool,
    tolerance: float,
    rounds: int,
) -> LocalPatch:
    form, twist, filling, parameters = options
    u, v = breaks if form == "c1" else (_dense(breaks[0]), _dense(breaks[1]))
    grid = _sampled(sides, u, v, ground, probes, filling, outermost)
    a, b = (u, v) if parameters == "uniform" else (_chord(grid.points, 0, u), _chord(grid.points, 1, v))
    if form == "c1":
        surface = bicubic_approximant(grid.points, u=a, v=b, twist=twist)
    else:
        surface = tensor_fit(grid.points, a, b, a[::PER_CELL], b[::PER_CELL], grid.found)
    fit = misfit(surface, a, b, grid.found, ground, sign)
    status = Status.NOTHING if grid.fill is FillStatus.NONE_FOUND else Status.WITHIN
    return LocalPatch(
        surface, sides, grid.points, grid.found, (a, b), fit, probes.distance, grid.reach, grid.fill, grid.outcomes,
        status, rounds, tolerance,
    )  # fmt: skip


def _sampled(sides: Sides, u: Array, v: Array, ground: Ground, probes: Probes, filling: str, outermost: bool) -> _Grid:
    """The points of the geometry over the Coons grid, with artificial ones where there are none (HJR 4-13)."""
    coons = sides.coons(u, v)
    normal, offset = probes.at(u, v), probes.distance
    inner = np.zeros(coons.shape[:2], dtype=bool)
    inner[1:-1, 1:-1] = True
    distance = np.full(int(inner.sum()), offset)
    hits = project(coons[inner], normal[inner], distance, ground, outermost=outermost)
    height = np.zeros(coons.shape[:2])
    height[inner] = (1.0 - 2.0 * hits.t) * offset
    found = ~inner
    found[inner] = hits.hit
    reach = float(np.abs(height[found]).max(initial=0.0))
    if not hits.hit.any():
        status = FillStatus.NONE_FOUND
        height[:] = 0.0
    else:
        height, status = fill(height, found, method=filling, noise=scatter(height, found))
    points = coons + height[..., None] * normal  # HJR 10 and 13
    outcomes = np.bincount(hits.outcome[hits.hit], minlength=len(Outcome))
    # where a side runs over a gap nothing is known either: its points count as the ones beside them do
    beside = np.pad(found[1:-1, 1:-1], 1, mode="edge")
    return _Grid(points, beside, reach, status, outcomes)


def scatter(height: Array, found: BoolArray) -> float:
    """The noise of heights on a grid: the median fourth difference along the rows, which a smooth surface has not."""
    whole = np.logical_and.reduce([found[k : found.shape[0] - 4 + k] for k in range(5)]) if len(found) > 4 else None
    if whole is None or whole.sum() < 20:
        return 0.0
    return float(np.median(np.abs(np.diff(height, n=4, axis=0)[whole])) / (0.6745 * np.sqrt(70.0)))


def _chord(points: Array, axis: int, given: Array) -> Array:
    """Parameters along an axis: chord shares averaged over the rows, rows without length left out."""
    step = np.linalg.norm(np.diff(points, axis=axis), axis=2)
    step = step if axis == 0 else step.T
    total = step.sum(axis=0)
    used = total > 1e-9 * total.max(initial=0.0)
    share = (step[:, used] / total[used]).mean(axis=1)
    out = np.concatenate([[0.0], np.cumsum(share)])
    out[-1] = 1.0
    return out if (np.diff(out) > 0.0).all() else given


def _dense(breaks: Array) -> Array:
    """`PER_CELL` equal steps in every interval."""
    steps = np.arange(PER_CELL) / PER_CELL
    return np.append((breaks[:-1, None] + np.diff(breaks)[:, None] * steps).reshape(-1), breaks[-1])


def _split(breaks: Array, which: BoolArray, most: int) -> Array:
    """The intervals asked for cut in two, the widest first, up to `most` intervals."""
    if len(which) != len(breaks) - 1:
        which = np.asarray(which.reshape(len(breaks) - 1, -1).any(axis=1))
    cut = np.flatnonzero(which)
    room = most - (len(breaks) - 1)
    cut = cut[np.argsort(-np.diff(breaks)[cut], kind="stable")][: max(room, 0)]
    return np.sort(np.concatenate([breaks, 0.5 * (breaks[cut] + breaks[cut + 1])]))
