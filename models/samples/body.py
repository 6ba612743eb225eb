"""`Body`: named NURBS surfaces that meet in common edges, with the parameter lines they are tessellated along."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from patchwright.models import knots as knot_tools
from patchwright.models.arrays import Array, IntArray
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.triangulation import Triangulation


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """One body of a sample; the normals of its surfaces point outwards.

    Parameters
    ----------
    name : the body's name
    faces : names of the surfaces
    surfaces : as many NURBS surfaces; where two meet, their edges are the same curve in the same parameter
    lines : named, increasing parameter values; a crease of a surface must be one of its lines
    directions : per surface the names of its u lines and its v lines; surfaces that share an edge share its lines
    closed : whether the surfaces together enclose a volume
    """

    name: str
    faces: tuple[str, ...]
    surfaces: tuple[NurbsSurface, ...]
    lines: Mapping[str, Array]
    directions: tuple[tuple[str, str], ...]
    closed: bool = True

    def moved(self, change: Callable[[Array], Array]) -> Body:
        """The body with its control points mapped by `change`, an affine map of (..., 3) that keeps orientation."""
        surfaces = tuple(NurbsSurface(s.degree, s.knots, change(s.control_points), s.weights) for s in self.surfaces)
        return replace(self, surfaces=surfaces)

    def tessellate(self, *, density: float = 1.0, chord: float | None = None) -> Triangulation:
        """Structured triangles between the parameter lines, uv carried, tagged by surface, edges shared exactly.

        Parameters
        ----------
        density : factor on the number of cells between lines
        chord : largest normal distance between a surface and its triangles (length); replaces `density`
        """
        if chord is None:
            lines = {name: _divided(line, self._creases(name), density) for name, line in self.lines.items()}
        else:
            lines = self._lines_within(chord)
        grids = [(s, lines[a], lines[b]) for s, (a, b) in zip(self.surfaces, self.directions, strict=True)]
        return _welded([_structured(*grid) for grid in grids], self.faces)

    def _creases(self, name: str) -> Array:
        """The values of a line at which some surface may have a crease, both ends included."""
        found = [self.lines[name][[0, -1]]]
        for surface, directions in zip(self.surfaces, self.directions, strict=True):
            for degree, knots, direction in zip(surface.degree, surface.knots, directions, strict=True):
                if direction == name:
                    values, multiplicity = knot_tools.distinct(knots)
                    found.append(values[multiplicity >= degree])
        return np.unique(np.concatenate(found))

    def _lines_within(self, chord: float) -> dict[str, Array]:
        """Every interval of every line cut into as many equal parts as the measured normal deviation asks for."""
        parts = {name: np.ones(len(line) - 1) for name, line in self.lines.items()}
        for surface, (a, b) in zip(self.surfaces, self.directions, strict=True):
            in_u, in_v = _normal_deviation(surface, self.lines[a], self.lines[b])
            parts[a] = np.maximum(parts[a], np.ceil(np.sqrt(in_u / chord)))
            parts[b] = np.maximum(parts[b], np.ceil(np.sqrt(in_v / chord)))
        return {name: _cut(self.lines[name], n.astype(np.int64)) for name, n in parts.items()}


def _cut(line: Array, parts: IntArray) -> Array:
    """Each interval of `line` cut into its number of equal parts."""
    step = np.concatenate([np.arange(n) / n for n in parts])
    start, width = np.repeat(line[:-1], parts), np.repeat(np.diff(line), parts)
    return np.append(start + step * width, line[-1])


def _divided(line: Array, creases: Array, density: float) -> Array:
    """`line` with about `density` times its intervals between any two of its values `creases`, which stay."""
    at = np.searchsorted(line, creases)
    out = [line[:1]]
    for i, j in pairwise(at.tolist()):
        cells = max(1, round((j - i) * density))
        out.append(np.interp(np.linspace(i, j, cells + 1)[1:], np.arange(len(line)), line))
    return np.concatenate(out)


def _normal_deviation(surface: NurbsSurface, u: Array, v: Array) -> tuple[Array, Array]:
    """Per interval of u and of v the largest normal distance between surface and chords, the cells' twist included."""
    um, vm = 0.5 * (u[1:] + u[:-1]), 0.5 * (v[1:] + v[:-1])
    corner, middle = surface.grid(u, v), surface.grid(um, vm)
    normal = np.cross(surface.grid(um, vm, nu=(1, 0)), surface.grid(um, vm, nu=(0, 1)))
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    normal = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0.0)

    def off(vector: Array) -> Array:
        return np.asarray(np.abs(np.einsum("ijk,ijk->ij", vector, normal)))

    along_u, along_v = surface.grid(u, vm), surface.grid(um, v)
    in_u = off(0.5 * (along_u[1:] + along_u[:-1]) - middle)
    in_v = off(0.5 * (along_v[:, 1:] + along_v[:, :-1]) - middle)
    twist = 0.25 * off(corner[1:, 1:] - corner[1:, :-1] - corner[:-1, 1:] + corner[:-1, :-1])
    # the three contributions add up; each is given a third of the allowance
    return 3.0 * np.maximum(in_u, twist).max(axis=1), 3.0 * np.maximum(in_v, twist).max(axis=0)


def _structured(surface: NurbsSurface, u: Array, v: Array) -> tuple[Array, IntArray, Array, IntArray]:
    """Points, triangles and their uv corners of the tensor grid, and the points on its border."""
    points = surface.grid(u, v).reshape(-1, 3)
    index = np.arange(len(u) * len(v)).reshape(len(u), len(v))
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    triangles = np.stack([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)], axis=2).reshape(-1, 3)
    parameters = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)
    border = np.unique(np.concatenate([index[0], index[-1], index[:, 0], index[:, -1]]))
    return points, triangles, parameters[triangles], border


def _welded(grids: list[tuple[Array, IntArray, Array, IntArray]], names: tuple[str, ...]) -> Triangulation:
    """One triangulation of all grids: coincident border points become one, triangles collapsed at a pole go."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    offsets = np.cumsum([0] + [len(g[0]) for g in grids])
    points = np.concatenate([g[0] for g in grids])
    triangles = np.concatenate([g[1] + o for g, o in zip(grids, offsets[:-1], strict=True)])
    uv = np.concatenate([g[2] for g in grids])
    tags = np.repeat(np.arange(len(grids)), [len(g[1]) for g in grids])
    border = np.concatenate([g[3] + o for g, o in zip(grids, offsets[:-1], strict=True)])
    round_off = 1e-11 * float(np.linalg.norm(np.ptp(points, axis=0)))
    pairs = cKDTree(points[border]).query_pairs(round_off, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(border), len(border)))
    _, label = connected_components(graph, directed=False)
    _, first = np.unique(label, return_index=True)
    target = np.arange(len(points))
    target[border] = border[first[label]]
    triangles = target[triangles]
    a, b, c = triangles.T
    keep = (a != b) & (b != c) & (c != a)
    return Triangulation(points, triangles[keep], uv=uv[keep], tags=tags[keep], tag_names=names).compact()
