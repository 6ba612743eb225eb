"""A NURBS surface whose borders are moved onto given curves by changing control points near them only.

Knots are inserted beside the border, so that the change has died out within a given depth; beyond it the surface is the
old one to round-off. The rows of the strip follow the surface's own continuation: the border's displacement is first
written as a step in (u, v) on the surface carried on beyond its sides, which fades over the rows as (1 - x)^2 (1 + 2 x)
of their Greville abscissae, level at both ends; what the step leaves over fades the same way in space. Where two
borders meet, both are joined as in a Coons patch: the sum less the corner's part. Weights stay.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models import knots as knot_tools
from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.extension import surface_on
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface, Side

STEPS = 4  # spans the strip is divided into
SIDES: tuple[Side, ...] = ("u0", "u1", "v0", "v1")
ROOM = 2.0  # of the largest displacement: how far the surface is carried on to follow it
GAUSS_NEWTON = 6  # steps to the parameters a displacement leads to
SAME = 1e-9  # of the domain: knots nearer to each other are one
NEAR = 0.02  # of the strip: a knot this near stands for one the strip wants
WIDEST = 0.45  # of the domain: strips from opposite borders must not meet


@dataclass(frozen=True, slots=True, eq=False)
class Border:
    """Where a border goes: `target` has the border's domain and degree, and `depth` is the strip's, in parameters."""

    target: NurbsCurve
    depth: float


def with_borders(surface: NurbsSurface, borders: dict[Side, Border]) -> NurbsSurface:
    """The surface with some borders moved onto their targets.

    A target is followed exactly where its knots are in the surface's (they are inserted) and its weights are the
    border's; `border_space` makes such targets.

    Raises
    ------
    ParameterError : a target of another degree or domain, or targets that do not meet in a corner they share.
    """
    clamped = surface.clamped()
    for side, border in borders.items():
        along = 1 if side[0] == "u" else 0
        if border.target.degree != clamped.degree[along]:
            raise ParameterError(f"the target of {side} has degree {border.target.degree}, not {clamped.degree[along]}")
        if not np.allclose(border.target.domain, clamped.domain[along], rtol=1e-12, atol=0.0):
            raise ParameterError(f"the target of {side} runs over {border.target.domain}, not {clamped.domain[along]}")
        new = _new_knots(clamped, along, border.target.knots)
        clamped = clamped.insert_knots(vs=new) if along else clamped.insert_knots(us=new)
    for side, border in borders.items():
        across = 0 if side[0] == "u" else 1
        new = _strip_knots(clamped, across, int(side[1]), border.depth)
        clamped = clamped.insert_knots(us=new) if across == 0 else clamped.insert_knots(vs=new)
    return _moved(clamped, borders)


def border_space(surface: NurbsSurface, side: Side, extra: Array) -> NurbsCurve:
    """The border of a side with the knots `extra` inserted where they are missing: the space its targets live in."""
    border = surface.clamped().boundary(side)
    return border.insert_knots(_lacking(border.degree, border.knots, extra, border.domain))


def border_below(surface: NurbsSurface, side: Side, pcurve: NurbsCurve) -> NurbsCurve | None:
    """The border of a side below a straight pcurve (degree 1, two points) along it, in the pcurve's parameter.

    None where the pcurve stands still.
    """
    along = 1 if side[0] == "u" else 0
    whole = surface.clamped().boundary(side)
    a, b = (float(np.clip(x, *whole.domain)) for x in pcurve.control_points[:, along])
    if a == b:
        return None
    part = whole.restricted(min(a, b), max(a, b))
    part = part.reversed() if a > b else part
    (s0, s1), (t0, t1) = part.domain, pcurve.domain
    knots = t0 + (part.knots - s0) * ((t1 - t0) / (s1 - s0))
    knots[: part.degree + 1], knots[-part.degree - 1 :] = t0, t1
    return NurbsCurve(part.degree, knots, part.control_points, part.weights)


def through(space: NurbsCurve, places: Array) -> NurbsCurve:
    """The curve with the knots and weights of `space` through places (n, 3) at its Greville abscissae."""
    from scipy.interpolate import BSpline

    sites = knot_tools.greville(space.degree, space.knots)
    basis = BSpline.design_matrix(sites, space.knots, space.degree).toarray()
    weights = np.ones(len(sites)) if space.weights is None else np.asarray(space.weights)
    right = places * (basis @ weights)[:, None]
    points = np.linalg.solve(basis, right) / weights[:, None]
    points[0], points[-1] = places[0], places[-1]
    return NurbsCurve(space.degree, space.knots, points, space.weights)


def _lacking(degree: int, own: Array, wanted: Array, domain: tuple[float, float]) -> Array:
    """The inner knots of `wanted` that `own` has not, or has fewer times."""
    if not len(wanted):
        return np.zeros(0)
    values, counts = knot_tools.distinct(np.asarray(wanted))
    inner = (values > domain[0]) & (values < domain[1])
    out = []
    for value, count in zip(values[inner], np.minimum(counts[inner], degree), strict=True):
        have = int(np.count_nonzero(np.abs(own - value) <= SAME * (domain[1] - domain[0])))
        out += [value] * max(0, int(count) - have)
    return np.array(out)


def _new_knots(surface: NurbsSurface, along: int, wanted: Array) -> Array:
    return _lacking(surface.degree[along], surface.knots[along], wanted, surface.domain[along])


def _strip_knots(surface: NurbsSurface, across: int, end: int, depth: float) -> Array:
    low, high = surface.domain[across]
    depth = min(depth, WIDEST * (high - low))
    steps = depth * np.arange(1, STEPS + 1) / STEPS
    values = high - steps if end else low + steps
    own = surface.knots[across]
    near = np.abs(values[:, None] - own[None]).min(axis=1) < NEAR * depth
    return np.asarray(values[~near])


def _fading(surface: NurbsSurface, side: Side, depth: float) -> Array:
    """(rows,) the share of the border's displacement each row of control points takes."""
    across, end = (0 if side[0] == "u" else 1), int(side[1])
    p, U = surface.degree[across], surface.knots[across]
    low, high = surface.domain[across]
    depth = min(depth, WIDEST * (high - low))
    g = knot_tools.greville(p, U)
    count = len(g)
    reach = U[p + 1 : p + 1 + count] - low if end == 0 else high - U[:count]  # where each row's influence ends
    away = g - low if end == 0 else high - g
    inside = reach <= depth * (1.0 + 1e-9)
    if not inside.any():
        inside[0 if end == 0 else -1] = True
    nearest_fixed = away[~inside].min(initial=depth)
    x = np.clip(away / nearest_fixed, 0.0, 1.0)
    return np.where(inside, (1.0 - x) ** 2 * (1.0 + 2.0 * x), 0.0)


def _moved(surface: NurbsSurface, borders: dict[Side, Border]) -> NurbsSurface:
    fade = {side: _fading(surface, side, border.depth) for side, border in borders.items()}
    targets: dict[Side, Array] = {}
    for side, border in borders.items():
        own = surface.boundary(side)
        lacking = _lacking(own.degree, border.target.knots, own.knots, own.domain)
        targets[side] = border.target.insert_knots(lacking).control_points
    gone = {side: target - surface.boundary(side).control_points for side, target in targets.items()}
    _check_corners(gone, float(np.abs(surface.control_points).max()))
    step = _along_surface(surface, gone, fade)
    left = {side: gone[side] - _row(step, side) for side in gone}
    points = surface.control_points + step + _blended(left, fade, surface.control_points.shape)
    for side, target in targets.items():  # bit for bit
        at = -int(side[1])
        if side[0] == "u":
            points[at] = target
        else:
            points[:, at] = target
    return NurbsSurface(surface.degree, surface.knots, points, surface.weights)


def _row(net: Array, side: Side) -> Array:
    """The outer row of a net at a side."""
    return np.asarray(net[-int(side[1])] if side[0] == "u" else net[:, -int(side[1])])


def _check_corners(gone: dict[Side, Array], size: float) -> None:
    for u in (s for s in gone if s[0] == "u"):
        for v in (s for s in gone if s[0] == "v"):
            if np.abs(gone[u][-int(v[1])] - gone[v][-int(u[1])]).max() > 1e-9 * size:
                raise ParameterError(f"the targets of {u} and {v} do not meet in their corner")


def _blended(rows: dict[Side, Array], fade: dict[Side, Array], shape: tuple[int, ...]) -> Array:
    """(n, m, d) values on the borders carried inwards: the sum of the sides less the corners."""
    out = np.zeros((*shape[:2], next(iter(rows.values())).shape[1]))
    for side, row in rows.items():
        weight = fade[side]
        out += weight[:, None, None] * row[None] if side[0] == "u" else weight[None, :, None] * row[:, None]
    for u in (s for s in rows if s[0] == "u"):
        for v in (s for s in rows if s[0] == "v"):
            out -= fade[u][:, None, None] * fade[v][None, :, None] * rows[u][-int(v[1])]
    return out


def _along_surface(surface: NurbsSurface, gone: dict[Side, Array], fade: dict[Side, Array]) -> Array:
    """(n, m, 3) displacement of the net by steps on the surface's continuation; zero where that goes astray."""
    sites = [knot_tools.greville(p, U) for p, U in zip(surface.degree, surface.knots, strict=True)]
    box = np.array(surface.domain)
    largest = max(float(np.linalg.norm(move, axis=1).max()) for move in gone.values())
    us, vs = (np.linspace(low, high, 9) for low, high in box.tolist())
    slopes = [surface.grid(us, vs, nu) for nu in ((1, 0), (0, 1))]
    speeds = [max(float(np.linalg.norm(s, axis=2).min()), np.finfo(float).tiny) for s in slopes]
    room = np.minimum(ROOM * largest / np.array(speeds), 0.5 * (box[:, 1] - box[:, 0]))
    try:
        wide = surface_on(surface, tuple(box[0] + [-room[0], room[0]]), tuple(box[1] + [-room[1], room[1]]))
    except ParameterError:  # its weights vanish out there
        return np.zeros_like(surface.control_points)
    uv = np.stack(np.meshgrid(*sites, indexing="ij"), axis=-1)
    steps = {side: _step_to(wide, _row(uv, side), move, room) for side, move in gone.items()}
    inner = uv + _blended(steps, fade, surface.control_points.shape)
    inner = np.clip(inner, box[:, 0] - room, box[:, 1] + room)
    step = wide(inner[..., 0], inner[..., 1]) - wide(uv[..., 0], uv[..., 1])
    if max(float(np.linalg.norm(_row(step, side) - move, axis=1).max()) for side, move in gone.items()) > largest:
        return np.zeros_like(step)
    return np.asarray(step)


def _step_to(wide: NurbsSurface, uv: Array, move: Array, room: Array) -> Array:
    """(k, 2) steps from parameters that move the surface's points by `move` (k, 3) as nearly as it can."""
    start = wide(uv[:, 0], uv[:, 1])
    at = uv.copy()
    for _ in range(GAUSS_NEWTON):
        Su, Sv = wide(at[:, 0], at[:, 1], (1, 0)), wide(at[:, 0], at[:, 1], (0, 1))
        rows = np.stack([Su, Sv], axis=2)
        right = start + move - wide(at[:, 0], at[:, 1])
        step = np.einsum("kij,kj->ki", np.linalg.pinv(rows, rcond=1e-6), right)
        at = np.clip(at + step, uv - room, uv + room)
    return np.asarray(at - uv)
