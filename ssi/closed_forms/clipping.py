"""Whole conics cut down to the parameter ranges of two surfaces, split at branch points, with their parameters.

Every edge of a range lies in a plane, so the ends are roots of linear, quadratic or trigonometric equations. Between
neighbouring roots the conic is wholly inside or wholly outside; its middle tells which, with the tolerance as slack.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.ssi.closed_forms.conic import TURN, Conic
from patchwright.ssi.closed_forms.inversion import Analytic, edges, inside, inverted, on_edge, poles
from patchwright.ssi.closed_forms.parameter_fit import parameters
from patchwright.ssi.intersection import Contact, ContactKind, CurveKind, IntersectionCurve

EPS = float(np.finfo(np.float64).eps)
FIT_SHARE = 2e-13  # of the size: what a uv fit aims at, a fifth of the 1e-12 that is promised
PROBES = 65  # samples that tell how far an arc is off its surfaces
DENSER = 10  # residuals are measured on this many times the samples of the fit


def clipped(
    conic: Conic,
    kind: CurveKind,
    a: Analytic,
    b: Analytic,
    tolerance: float,
    branches: tuple[Array, ...] = (),
) -> tuple[list[IntersectionCurve], list[Array]]:
    """The pieces of a conic inside both surfaces' ranges, and points where it only touches them."""
    splits = _splits(conic, branches, tolerance)
    round_off = 256.0 * EPS * float(np.abs(conic.c).max() + np.abs(conic.a).max() + np.abs(conic.b).max())
    cuts = _merged(conic, splits, [t for s in (a, b) for t in _cuts(conic, s, tolerance)], round_off)
    if conic.shape != "ellipse" and not cuts:
        return [], []  # it misses every edge, and a bounded surface holds no unbounded curve
    if conic.shape == "ellipse":
        if not cuts:
            return (
                ([curve_on(conic, [0.0, TURN], kind, a, b, closed=True)], [])
                if _both(conic, 1.0, a, b, tolerance)
                else ([], [])
            )
        cuts = [*cuts, cuts[0] + TURN]
    kept = [_both(conic, 0.5 * (s + t), a, b, tolerance) for s, t in itertools.pairwise(cuts)]
    specks = [_speck(conic, s, t, a, b, tolerance) for s, t in itertools.pairwise(cuts)]
    whole = kept
    kept = _without_specks(kept, specks, periodic=conic.shape == "ellipse")
    dropped = [before and not after for before, after in zip(whole, kept, strict=True)]
    middles = [0.5 * (s + t) for (s, t), gone in zip(itertools.pairwise(cuts), dropped, strict=True) if gone]
    runs = _runs(cuts, kept, splits, periodic=conic.shape == "ellipse")
    curves = []
    for run in runs:
        closed = conic.shape == "ellipse" and abs(run[-1] - run[0] - TURN) <= 1e-12
        curves.append(curve_on(conic, run, kind, a, b, closed=closed))
    used = [k or before for k, before in zip([*whole, False], [False, *whole], strict=True)]
    if conic.shape == "ellipse":
        used[0] = used[0] or used[-1]
        used, cuts = used[:-1], cuts[:-1]
    lone = [conic(t) for t in [*middles, *(t for t, u in zip(cuts, used, strict=True) if not u)]]
    return curves, [p for p in lone if bool(inside(a, p, tolerance)) and bool(inside(b, p, tolerance))]


def curve_on(
    conic: Conic, knots: list[float], kind: CurveKind, a: Analytic, b: Analytic, *, closed: bool
) -> IntersectionCurve:
    """The arc between the first and the last parameter, its parameters on both surfaces, and its measured residual."""
    curve = conic.nurbs(knots)
    size = float(np.ptp(curve.control_points, axis=0).max())
    reach = float(np.abs(curve.control_points).max())
    accuracy = max(FIT_SHARE * size, 16.0 * EPS * (reach + size))
    # a huge conic clipped to a short arc loses digits: no fit can be nearer to the surface than the arc itself
    probes = curve(np.linspace(*curve.domain, PROBES))
    accuracy = max([accuracy, *(4.0 * _off(s, probes) for s in (a, b))])
    uv_a, uv_b = parameters(a, curve, accuracy), parameters(b, curve, accuracy)
    finest = max((curve, uv_a, uv_b), key=lambda c: c.breaks.size).breaks
    steps = np.linspace(0.0, 1.0, 4 * DENSER + 1)
    samples = (finest[:-1, None] + np.diff(finest)[:, None] * steps[:-1]).ravel()
    samples = np.append(samples, finest[-1])
    on_c, on_a, on_b = curve(samples), _on(a, uv_a, samples), _on(b, uv_b, samples)
    gaps = [np.linalg.norm(p - q, axis=1).max() for p, q in ((on_c, on_a), (on_c, on_b), (on_a, on_b))]
    return IntersectionCurve(curve, uv_a, uv_b, curve(finest), kind, closed, float(max(gaps)))


def contact(point: Array, kind: ContactKind, gap: float, a: Analytic, b: Analytic) -> Contact:
    """An isolated point with its parameters on both surfaces."""
    uv = [np.clip(inverted(s, point)[0], *np.array(s.domain).T) for s in (a, b)]
    return Contact(np.asarray(point), (float(uv[0][0]), float(uv[0][1])), (float(uv[1][0]), float(uv[1][1])), kind, gap)


def _off(surface: Analytic, points: Array) -> float:
    at = np.clip(inverted(surface, points)[0], *np.array(surface.domain).T)
    return float(np.linalg.norm(surface(at[:, 0], at[:, 1]) - points, axis=1).max())


def _on(surface: Analytic, uv: NurbsCurve, s: Array) -> Array:
    at = np.clip(uv(s), *np.array(surface.domain).T)
    return surface(at[:, 0], at[:, 1])


def _both(conic: Conic, t: float, a: Analytic, b: Analytic, slack: float) -> bool:
    p = conic(t)
    return bool(inside(a, p, slack)) and bool(inside(b, p, slack))


def _cuts(conic: Conic, surface: Analytic, slack: float) -> list[float]:
    """Where the conic meets the edges of the ranges and the poles."""
    out = []
    for edge in edges(surface):
        roots = conic.crossings(edge.normal, edge.offset, slack)
        out += [t for t in roots if on_edge(surface, edge, conic(t), slack)]
    for pole in poles(surface):
        t = conic.parameter(pole)
        if float(np.linalg.norm(conic(t) - pole)) <= 256.0 * EPS * float(np.abs(pole).max() + np.abs(conic.a).max()):
            out.append(t)
    return out


def _splits(conic: Conic, branches: tuple[Array, ...], slack: float) -> list[float]:
    ts = [conic.parameter(p) for p in branches]
    on = [float(np.linalg.norm(conic(t) - p)) <= 8.0 * slack for t, p in zip(ts, branches, strict=True)]
    return [t for t, keep in zip(ts, on, strict=True) if keep]


def _merged(conic: Conic, splits: list[float], cuts: list[float], slack: float) -> list[float]:
    """Sorted parameters, those nearer than the slack made one; splits win."""
    out: list[float] = []
    turn = TURN if conic.shape == "ellipse" else math.inf
    for t in [*splits, *cuts]:
        apart = [abs(t - s) if math.isinf(turn) else abs((t - s + math.pi) % turn - math.pi) for s in out]
        if not apart or min(apart) * conic.speed(t) > slack:
            out.append(t)
    return sorted(out)


def _speck(conic: Conic, s: float, t: float, a: Analytic, b: Analytic, tolerance: float) -> bool:
    """Shorter than the tolerance, or never deeper inside the ranges than it: an arc that touches an edge from outside.

    An arc of length l and curvature radius r reaches l^2 / (8 r) past its chord.
    """
    length = 0.5 * (t - s) * (conic.speed(s) + conic.speed(t))
    if length <= 2.0 * tolerance:
        return True
    radius = max(float(np.linalg.norm(conic.a)), float(np.linalg.norm(conic.b)))
    shallow = length * length <= 8.0 * radius * tolerance and conic.shape != "line"
    return shallow and not _both(conic, 0.5 * (s + t), a, b, -tolerance)


def _without_specks(kept: list[bool], specks: list[bool], *, periodic: bool) -> list[bool]:
    """Kept intervals, but no specks between two that are not kept: a point, not a curve."""
    n = len(kept)

    def neighbour(i: int) -> bool:
        return kept[i % n] if periodic or 0 <= i < n else False

    return [
        k and not (s and not neighbour(i - 1) and not neighbour(i + 1))
        for i, (k, s) in enumerate(zip(kept, specks, strict=True))
    ]


def _runs(cuts: list[float], kept: list[bool], splits: list[float], *, periodic: bool) -> list[list[float]]:
    """Knots of each maximal chain of kept intervals that does not pass a split."""
    at_split = [min((abs(_turned(t - s, periodic)) for s in splits), default=1.0) == 0.0 for t in cuts]
    chains: list[list[float]] = []
    open_chain = False
    for i, keep in enumerate(kept):
        if not keep:
            open_chain = False
        elif open_chain and not at_split[i]:
            chains[-1].append(cuts[i + 1])
        else:
            chains.append([cuts[i], cuts[i + 1]])
            open_chain = True
    if periodic and len(chains) > 1 and kept[0] and kept[-1] and not at_split[0]:
        chains[0] = chains.pop() + [t + TURN for t in chains[0][1:]]
    return chains


def _turned(t: float, periodic: bool) -> float:
    return (t + math.pi) % TURN - math.pi if periodic else t
