"""How far an approximant is from the geometry, sampled between its data.

Source: Hamann, Jean, Razdan, section 3.6 (HJR 17): the middles e of the cells' sides along u, those along v, f, and the
cells' centres g; samples beside a gap are left out. The distance is that to the closest point of the geometry, on the
true surface where it is known.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray
from patchwright.models.differential import normals
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.repair.ground.true_ground import TrueGround
from patchwright.repair.patches.projection import Ground


@dataclass(frozen=True, slots=True, eq=False)
class Misfit:
    """Distances and normal angles at the samples, NaN beside a gap.

    `e` (M, N + 1), `f` (M + 1, N), `g` (M, N) lengths; `angle_e`, `angle_f`, `angle_g` the same in degrees, against the
    true surfaces where these are known, else against the triangles' planes, the facets' own slant included.
    """

    e: Array
    f: Array
    g: Array
    angle_e: Array
    angle_f: Array
    angle_g: Array

    @property
    def distances(self) -> Array:
        """All distances that were taken."""
        return _taken(self.e, self.f, self.g)

    @property
    def angles(self) -> Array:
        """All angles that were taken."""
        return _taken(self.angle_e, self.angle_f, self.angle_g)

    @property
    def largest(self) -> float:
        """The largest distance, 0 where every sample is beside a gap."""
        return float(self.distances.max(initial=0.0))

    @property
    def rms(self) -> float:
        """Root mean square of the distances."""
        d = self.distances
        return float(np.sqrt(np.mean(d**2))) if len(d) else 0.0

    def crowded(self, tolerance: float, angle: float | None) -> tuple[BoolArray, BoolArray]:
        """(M,) and (N,) the intervals of u and of v that hold a sample over the tolerance (or over the angle).

        A centre counts for both directions only where no middle of a side of its cell already does.
        """
        e, f, g = (
            (d > tolerance) | ((a > angle) if angle is not None else False)
            for d, a in ((self.e, self.angle_e), (self.f, self.angle_f), (self.g, self.angle_g))
        )
        alone = g & ~(e[:, 1:] | e[:, :-1] | f[1:] | f[:-1])
        return np.asarray(e.any(axis=1) | alone.any(axis=1)), np.asarray(f.any(axis=0) | alone.any(axis=0))


def _taken(*values: Array) -> Array:
    flat = np.concatenate([v.reshape(-1) for v in values])
    return np.asarray(flat[~np.isnan(flat)])


def misfit(surface: NurbsSurface, u: Array, v: Array, data: BoolArray, ground: Ground, sign: int) -> Misfit:
    """The samples of a surface whose data lie at parameters u (M + 1,), v (N + 1,).

    Parameters
    ----------
    data : (M + 1, N + 1) where the geometry was found
    sign : of the surface's normal against the triangles'
    """
    mid_u, mid_v = 0.5 * (u[1:] + u[:-1]), 0.5 * (v[1:] + v[:-1])
    whole = data[1:, 1:] & data[:-1, 1:] & data[1:, :-1] & data[:-1, :-1]
    e = _at(surface, mid_u, v, data[1:] & data[:-1], ground, sign)
    f = _at(surface, u, mid_v, data[:, 1:] & data[:, :-1], ground, sign)
    g = _at(surface, mid_u, mid_v, whole, ground, sign)
    return Misfit(e[0], f[0], g[0], e[1], f[1], g[1])


def _at(surface: NurbsSurface, u: Array, v: Array, wanted: BoolArray, ground: Ground, sign: int) -> tuple[Array, Array]:
    """Distances and angles on the tensor grid of u and v, NaN where not wanted."""
    distance, angle = np.full(wanted.shape, np.nan), np.full(wanted.shape, np.nan)
    if not wanted.any():
        return distance, angle
    i, j = np.nonzero(wanted)
    found = ground.closest(surface(u[i], v[j]))
    distance[wanted] = found.distance
    if isinstance(ground, TrueGround):
        below = ground.normals(found.triangle, found.points)
    else:
        below = ground.triangulation.normals[found.triangle]
    cosine = sign * np.einsum("ij,ij->i", normals(surface, u[i], v[j]), below)
    angle[wanted] = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    return distance, angle
