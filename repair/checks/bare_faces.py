"""Bare faces: surfaces that came without triangles or without edges get both, so that they can be examined like others.

A face without trims covers its whole surface: its edges are the surface's four sides, each its own; two opposite sides
that coincide are one seam. Nothing is shared between faces: whether they meet is what the diagnosis is to find out.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.assembly import Assembly, Part
from patchwright.models.errors import ParameterError
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.topology import EdgeUse, Topology
from patchwright.models.triangulation import Triangulation

CELLS = 48  # per side of the tessellation of a face that has none
CLOSED = 1e-9  # of a surface's size: opposite sides so near are one seam


def tessellated(model: Assembly) -> Assembly:
    """The model with triangles on faces that have none; trims are not followed.

    Raises
    ------
    ParameterError : an unbounded surface without triangles.
    """
    if not model.is_cad or all(len(part.triangulation) for part in model.parts):
        return model
    return replace(model, parts=tuple(p if len(p.triangulation) else _tessellated(p) for p in model.parts))


def completed(model: Assembly) -> Assembly:
    """The model with triangles on faces that have none, and with edges when it has no topology and no trims.

    Raises
    ------
    ParameterError : as `tessellated`.
    """
    if not model.is_cad or model.topology is not None or any(part.trims is not None for part in model.parts):
        return tessellated(model)
    parts = []
    surfaces = []
    for part in model.parts:
        assert part.surface is not None
        surface, mesh = part.surface.to_nurbs(), part.triangulation
        if not isinstance(part.surface, NurbsSurface):
            mesh = replace(mesh, uv=None)  # its parameters are not those of the NURBS form
        parts.append(replace(part, surface=surface, triangulation=mesh))
        surfaces.append(surface)
    return tessellated(replace(model, parts=tuple(parts), topology=_sides(surfaces), native=None))


def _tessellated(part: Part) -> Part:
    """The part with an even grid of triangles over its whole surface."""
    assert part.surface is not None
    box = np.asarray(part.surface.domain, dtype=np.float64)
    if not np.isfinite(box).all():
        raise ParameterError(f"{part.name or 'a face'} is unbounded: give its surface ranges of u and v")
    u, v = (np.linspace(low, high, CELLS + 1) for low, high in box)
    points = part.surface(u[:, None], v[None, :]).reshape(-1, 3)
    node = np.arange((CELLS + 1) ** 2).reshape(CELLS + 1, CELLS + 1)
    a, b, c, d = (some.reshape(-1) for some in (node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]))
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    uv = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)
    return replace(part, triangulation=Triangulation(points, triangles, uv=uv[triangles]))


def _sides(surfaces: list[NurbsSurface]) -> Topology:
    """Every surface with its four sides as edges of its own."""
    vertices: list[Array] = []
    curves: list[NurbsCurve] = []
    ends: list[tuple[int, int]] = []
    loops = []
    for surface in surfaces:
        (u0, u1), (v0, v1) = surface.domain
        corners = np.array([[u0, v0], [u1, v0], [u1, v1], [u0, v1]])
        first = len(vertices)
        vertices += list(surface(corners[:, 0], corners[:, 1]))
        size = float(np.linalg.norm(np.ptp(surface.control_points.reshape(-1, 3), axis=0)))
        number: dict[str, int] = {}
        uses = []
        for side, opposite, start, end, backward in _ROUND:
            curve = surface.boundary(side)
            if opposite in number and _apart(curve, curves[number[opposite]]) <= CLOSED * size:
                edge = number[opposite]
            else:
                edge = number[side] = len(curves)
                curves.append(curve)
                ends.append((first + start, first + end))
            low, high = curve.domain
            line = NurbsCurve(1, np.array([low, low, high, high]), corners[[start, end]])
            uses.append(EdgeUse(edge, backward, line))
        loops.append((tuple(uses),))
    return Topology(np.array(vertices).reshape(-1, 3), tuple(curves), np.array(ends), tuple(loops))


Side = Literal["u0", "u1", "v0", "v1"]
# side, the one across, its curve's first and last corner, and whether the loop runs against the curve
_ROUND: tuple[tuple[Side, Side, int, int, bool], ...] = (
    ("v0", "v1", 0, 1, False),
    ("u1", "u0", 1, 2, False),
    ("v1", "v0", 3, 2, True),
    ("u0", "u1", 0, 3, True),
)


def _apart(a: NurbsCurve, b: NurbsCurve) -> float:
    """Largest distance of two curves at equal shares of their parameters."""
    share = np.linspace(0.0, 1.0, 17)
    one, other = (c(c.domain[0] + share * (c.domain[1] - c.domain[0])) for c in (a, b))
    return float(np.linalg.norm(one - other, axis=1).max())
