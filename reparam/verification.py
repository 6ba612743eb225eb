"""How far a new surface is from the old one: closest points, both ways, and whether it folds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.closest_point import closest_on_curve, closest_on_surface
from patchwright.models.knots import between
from patchwright.models.nurbs_surface import NurbsSurface, Side
from patchwright.reparam.chart import Chart
from patchwright.reparam.neighbours import BORDER

BORDERS: tuple[Side, Side, Side, Side] = ("v0", "v1", "u0", "u1")
FLAT = 1e-6  # of the largest: tangents below it are a pole's


@dataclass(frozen=True, slots=True, eq=False)
class Deviation:
    """What was measured between a region and its new surface.

    `largest` is a distance of closest points, `where` the (s, t) it was found at, `least_sine` the smallest sine
    between the new tangents, negative where the new surface folds against the old normal; poles are left out.
    """

    largest: float
    where: tuple[float, float]
    least_sine: float
    worst: Array
    """(k, 3) s, t and distance of the worst sample of every cell, the worst cell first."""


def deviation(chart: Chart, surface: NurbsSurface, sites: tuple[Array, Array], per_span: int) -> Deviation:
    """Measured on `per_span` squared samples in every cell between the sites, and on the sides."""
    s, t = (np.concatenate(([0.0], between(x, per_span), [1.0])) for x in sites)
    uv = chart.parameters(s, t)
    new = surface.grid(s, t)
    flat = new.reshape(-1, 3)
    to_old = closest_on_surface(chart.region.surface, flat, start=uv.reshape(-1, 2)).distance
    at = np.stack(np.meshgrid(s, t, indexing="ij"), axis=-1)
    # the sides of the old one belong to the borders below: what the new one must reach is what lies inside
    inner = (slice(1, -1), slice(1, -1))
    old = chart.region.surface(uv[inner][..., 0], uv[inner][..., 1])
    to_new = closest_on_surface(surface, old.reshape(-1, 3), start=at[inner].reshape(-1, 2)).distance
    found = to_old.reshape(new.shape[:2])
    found[inner] = np.maximum(found[inner], to_new.reshape(old.shape[:2]))
    for border, name, index in zip(chart.borders, BORDERS, BORDER, strict=True):
        x = s if name[0] == "v" else t
        curve = surface.boundary(name)
        found[index] = np.maximum(found[index], closest_on_curve(curve, border.points(x), start=x).distance)
    k = np.unravel_index(int(found.argmax()), found.shape)
    worst = _worst_of_cells(at, found, per_span)
    return Deviation(
        float(found[k]), (float(s[k[0]]), float(t[k[1]])), _least_sine(chart, surface, s[1:-1], t[1:-1]), worst
    )


def _worst_of_cells(at: Array, found: Array, per_span: int) -> Array:
    """(k, 3), the samples on the sides belonging to the cells beside them."""
    m, n = ((size - 2) // per_span for size in found.shape)
    i, j = (np.clip((np.arange(size) - 1) // per_span, 0, k - 1) for size, k in zip(found.shape, (m, n), strict=True))
    order = np.argsort(-found, axis=None, kind="stable")
    first = np.sort(np.unique((i[:, None] * n + j).ravel()[order], return_index=True)[1])
    return np.concatenate((at, found[..., None]), axis=2).reshape(-1, 3)[order[first]]


def _least_sine(chart: Chart, surface: NurbsSurface, s: Array, t: Array) -> float:
    ds, dt = surface.grid(s, t, (1, 0)), surface.grid(s, t, (0, 1))
    length_s, length_t = np.linalg.norm(ds, axis=2), np.linalg.norm(dt, axis=2)
    turn = (np.cross(ds, dt) * chart.normals(s, t)).sum(axis=2)
    live = (length_s > FLAT * length_s.max()) & (length_t > FLAT * length_t.max())
    return float((turn[live] / (length_s * length_t)[live]).min(initial=1.0))
