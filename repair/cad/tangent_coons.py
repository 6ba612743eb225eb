"""A patch that keeps its sides and takes the tangent planes of the surfaces beside it.

Source: Coons 1967 for the patch of the four sides; the condition across a side is that of Faux and Pratt (tangent-plane
continuity, design notes 8): along a side with unit normals N(t) of the surface beside it, S_across(t) . N(t) = 0. That
is linear in the control points of the row next to the side. Of all corrections D = S - Coons that vanish on the sides
and meet it, the one with the least thin-plate energy is taken: with E = L L^T the energy of D's inner control points
and y = L^T d, it is the shortest least-squares solution y of the conditions, so that conditions which contradict each
other in a corner (twists that are not compatible) share what is left. Knots are put in until the angle is met. Of a
rational patch the weights stay and D is the numerator's: it vanishes on the sides, so that D_across / w is what turns.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.knots import divided
from patchwright.models.nurbs_surface import NurbsSurface, Side

CUTS = (0, 1, 3, 7)  # knots put into each span until the angle is met
MOST = 48  # control points per direction beyond which no knots are put in
PER_SPAN = 4  # conditions per span of a side
PROBES = 7  # per span of a side, where the angle is measured
NEGLIGIBLE = 1e-10  # of the largest singular value: combinations of conditions that say nothing new

Beside = Callable[[Array], Array]  # unit normals (k, 3) at parameters (k,) along a side; nan where nothing is known


def tangent_coons(
    coons: NurbsSurface, beside: dict[Side, Beside], enough: float, sound: Callable[[NurbsSurface], bool] | None = None
) -> tuple[NurbsSurface, float]:
    """The surface and the largest angle (degrees) to the tangent planes beside it.

    Parameters
    ----------
    coons : on [0, 1]^2; its sides are kept
    beside : the sides that are to be met smoothly
    enough : degrees; the coarsest knots with which all are that near are taken, or those that come nearest
    sound : which surfaces count at all, if not all do
    """
    base = coons.clamped()
    base = base.elevated(*(max(0, 3 - degree) for degree in base.degree))
    best, least = coons, worst_angle(coons, beside)
    for cuts in CUTS:
        fine = base.insert_knots(*(_between(breaks, cuts) for breaks in base.breaks)) if cuts else base
        if cuts and max(fine.control_points.shape[:2]) > MOST:
            break
        made = _solved(fine, beside)
        off = worst_angle(made, beside)
        if off < least and (sound is None or sound(made)):
            best, least = made, off
        if least <= enough:
            break
    return best, least


def worst_angle(surface: NurbsSurface, beside: dict[Side, Beside]) -> float:
    """The largest angle in degrees between the surface's tangent planes and those along the sides."""
    worst = 0.0
    for side, normals in beside.items():
        k, end = (0 if side[0] == "u" else 1), int(side[1])
        t = divided(surface.breaks[1 - k], PROBES)
        at = np.full(len(t), surface.domain[k][end])
        u, v = (at, t) if k == 0 else (t, at)
        own = np.cross(surface(u, v, (1, 0)), surface(u, v, (0, 1)))
        other = normals(t)
        size = np.linalg.norm(own, axis=1)
        known = np.isfinite(other).all(axis=1) & (size > 1e-9 * size.max(initial=0.0))
        across = np.linalg.norm(np.cross(own[known], other[known]), axis=1)
        along = np.einsum("ij,ij->i", own[known], other[known])  # a patch turned over is 180 degrees off
        worst = max(worst, float(np.degrees(np.arctan2(across, along)).max(initial=0.0)))
    return worst


def _between(breaks: Array, cuts: int) -> Array:
    """`cuts` equidistant knots inside every span."""
    share = np.arange(1, cuts + 1) / (cuts + 1)
    return np.asarray((breaks[:-1, None] + np.diff(breaks)[:, None] * share).ravel())


def _solved(surface: NurbsSurface, beside: dict[Side, Beside]) -> NurbsSurface:
    """The surface with its inner control points moved by the smoothest correction."""
    n, m = surface.control_points.shape[:2]
    rows, right = [], []
    for side, normals in beside.items():
        a, b = _conditions(surface, side, normals)
        rows.append(a.reshape(len(a), n, m, 3)[:, 1:-1, 1:-1].reshape(len(a), -1, 3))
        right.append(b)
    conditions, wanted = np.concatenate(rows), np.concatenate(right)
    lower = np.linalg.cholesky(_energy(surface))
    inner = lower.shape[0]
    # conditions on y = L^T d, coordinate by coordinate
    folded = np.linalg.solve(lower, conditions.transpose(1, 0, 2).reshape(inner, -1))
    matrix = folded.reshape(inner, len(wanted), 3).transpose(1, 0, 2).reshape(len(wanted), -1)
    y = np.linalg.lstsq(matrix, wanted, rcond=NEGLIGIBLE)[0].reshape(inner, 3)
    moved = surface.homogeneous.copy()
    moved[1:-1, 1:-1, :3] += np.linalg.solve(lower.T, y).reshape(n - 2, m - 2, 3)
    return NurbsSurface.from_homogeneous(surface.degree, surface.knots, moved, rational=surface.rational)


def _conditions(surface: NurbsSurface, side: Side, normals: Beside) -> tuple[Array, Array]:
    """Rows (c, n * m, 3) on the correction's control points, and what they are to give (c,): sines of angles."""
    k, end = (0 if side[0] == "u" else 1), int(side[1])
    t = _sites(surface.breaks[1 - k])
    at = np.array([surface.domain[k][end]])
    u, v = (np.repeat(at, len(t)), t) if k == 0 else (t, np.repeat(at, len(t)))
    across = surface(u, v, (1, 0) if k == 0 else (0, 1))
    other = normals(t)
    size = np.linalg.norm(across, axis=1)
    known = np.isfinite(other).all(axis=1) & (size > 1e-9 * size.max(initial=0.0))
    t, across, other, size = t[known], across[known], other[known], size[known]
    along = _basis(surface, 1 - k, t)
    beside = _basis(surface, k, at, 1)[0]
    products = along[:, None, :] * beside[None, :, None] if k == 0 else along[:, :, None] * beside[None, None, :]
    size_and_weight = size * _weights(surface, u, v)[known]
    rows = products.reshape(len(t), -1, 1) * (other / size_and_weight[:, None])[:, None, :]
    return rows, -np.einsum("ij,ij->i", across, other) / size


def _weights(surface: NurbsSurface, u: Array, v: Array) -> Array:
    """(k,) the weight function, 1 where there are no weights."""
    if surface.weights is None:
        return np.ones(len(u))
    return np.asarray(np.einsum("ki,kj,ij->k", _basis(surface, 0, u), _basis(surface, 1, v), surface.weights))


def _sites(breaks: Array) -> Array:
    """Gauss points of every span, and the ends of the side, where two conditions meet."""
    nodes = 0.5 * (np.polynomial.legendre.leggauss(PER_SPAN)[0] + 1.0)
    inside = (breaks[:-1, None] + np.diff(breaks)[:, None] * nodes).ravel()
    return np.concatenate([breaks[:1], inside, breaks[-1:]])


def _basis(surface: NurbsSurface, k: int, t: Array, derivative: int = 0) -> Array:
    """(len(t), n) values of the basis functions of one direction."""
    from scipy.interpolate import BSpline

    degree, knots = surface.degree[k], surface.knots[k]
    made = BSpline(knots, np.eye(len(knots) - degree - 1), degree)
    return np.asarray(made(t, nu=derivative))


def _energy(surface: NurbsSurface) -> Array:
    """The thin-plate energy of inner control points, lengths taken from the sides' mean chords."""
    net = surface.control_points
    lengths = [
        0.5 * sum(float(np.linalg.norm(np.diff(row, axis=0), axis=1).sum()) for row in rows)
        for rows in ((net[:, 0], net[:, -1]), (net[0], net[-1]))
    ]
    gram = []
    for k in (0, 1):
        breaks = surface.breaks[k]
        nodes, weights = np.polynomial.legendre.leggauss(surface.degree[k] + 1)
        t = (breaks[:-1, None] + np.diff(breaks)[:, None] * 0.5 * (nodes + 1.0)).ravel()
        w = (np.diff(breaks)[:, None] * 0.5 * weights).ravel()
        values = [_basis(surface, k, t, d)[:, 1:-1] for d in (0, 1, 2)]
        gram.append([some.T @ (w[:, None] * some) for some in values])
    a, b = (length / max(lengths) for length in lengths)
    (u0, u1, u2), (v0, v1, v2) = gram
    return np.asarray(np.kron(u2, v0) * b / a**3 + 2.0 * np.kron(u1, v1) / (a * b) + np.kron(u0, v2) * a / b**3)
