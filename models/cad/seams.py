"""Seams measured surface to surface: by an edge's pcurves on the two true surfaces, not by what a tolerance claims."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import nan
from typing import Any, cast

import numpy as np

from patchwright.models.arrays import Array, IntArray
from patchwright.models.assembly import Assembly
from patchwright.models.errors import GeometryError, ParameterError
from patchwright.models.extension import surface_on
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.surface import Surface
from patchwright.models.topology import Topology

_PROBES = 33  # samples per edge where only its deviation is asked
_RESOLUTION = 1e-7  # of the kernel (Precision::Confusion): no tolerance is smaller
_SUSPECT = 0.01  # of the resolution: an edge that deviates more may exceed it between two samples
_BETWEEN = 0.05  # of a deviation: what may lie between two samples


@dataclass(frozen=True, slots=True)
class Seam:
    """One edge between two faces (or of one face with itself), lengths in the model's unit.

    `gap` is the largest distance between the two surfaces at equal parameters of the edge; `across` is its part across
    the edge, which leaves out pcurves that only run at different speeds (to first order in the slip); `angle` the
    largest angle in degrees between their outward normals (0 smooth, 180 a fold), `typical` its median along the edge,
    which a singular corner of a surface does not spoil, `length` that of the edge,
    `tolerance` the kernel's own (NaN when the edge never saw the kernel), `at` the point half-way. `beyond` is how far,
    in shares of the surface's parameter range, a pcurve leaves it; the surface is then taken at its border.
    """

    edge: int
    faces: tuple[int, int]
    gap: float
    across: float
    angle: float
    length: float
    tolerance: float
    at: tuple[float, float, float]
    beyond: float
    typical: float = 0.0


def measure_seams(assembly: Assembly, samples: int = 24) -> list[Seam]:
    """Every edge that two loops use, poles aside.

    Parameters
    ----------
    samples : per edge, equally spaced in its parameter, ends included

    Raises
    ------
    ParameterError : the assembly has no topology, or fewer than two samples.
    """
    topology = _topology(assembly)
    if samples < 2:
        raise ParameterError(f"a seam needs at least 2 samples, got {samples}")
    uses = edge_uses(topology)
    counts = np.bincount(uses[:, 0], minlength=len(topology.curves))
    shared = uses[counts[uses[:, 0]] == 2]
    if not len(shared):
        return []
    points, normals, beyond = _on_surfaces(assembly, topology, shared, samples, with_normals=True)
    order = np.argsort(shared[:, 0], kind="stable")
    first, second = order[0::2], order[1::2]
    apart = points[first] - points[second]
    gaps = np.linalg.norm(apart, axis=2).max(axis=1)
    along = np.gradient(points[first], axis=1)
    size = np.linalg.norm(along, axis=2, keepdims=True)
    along = np.divide(along, size, out=np.zeros_like(along), where=size > 0.0)
    slip = np.einsum("esk,esk->es", apart, along)[..., None] * along
    across = np.linalg.norm(apart - slip, axis=2).max(axis=1)
    cosines = np.clip(np.einsum("esk,esk->es", normals[first], normals[second]), -1.0, 1.0)
    cross = np.linalg.norm(np.cross(normals[first], normals[second]), axis=2)
    defined = (np.abs(normals[first]).sum(axis=2) > 0.0) & (np.abs(normals[second]).sum(axis=2) > 0.0)
    angles = np.where(defined, np.degrees(np.arctan2(cross, cosines)), 0.0)
    chords = np.linalg.norm(np.diff(points[first], axis=1), axis=2).sum(axis=1)
    native = getattr(assembly.native, "edge_tolerances", None)
    known = native if native is not None and len(native) == len(topology.curves) else None
    out = []
    for k, (a, b) in enumerate(zip(first, second, strict=True)):
        edge = int(shared[a, 0])
        middle = points[a, samples // 2]
        if chords[k] == 0.0:
            continue  # a pole
        out.append(
            Seam(
                edge,
                (int(shared[a, 1]), int(shared[b, 1])),
                float(gaps[k]),
                float(across[k]),
                float(angles[k].max()),
                float(chords[k]),
                nan if known is None else float(known[edge]),
                (float(middle[0]), float(middle[1]), float(middle[2])),
                float(max(beyond[a], beyond[b])),
                float(np.median(angles[k])),
            )
        )
    return out


def edge_deviation(assembly: Assembly, samples: int = _PROBES) -> Array:
    """(e,) largest distance of each edge's 3-D curve from its pcurves on their surfaces; empty without topology.

    Edges that deviate by more than a hundredth of the kernel's resolution are sampled again five times as densely, and
    get a twentieth more for what lies between the samples: a tolerance that is too small makes a face invalid.
    """
    topology = assembly.topology
    if topology is None or not topology.curves:
        return np.zeros(0)
    uses = edge_uses(topology)
    off = _deviation(assembly, topology, uses, samples)
    again = uses[off[uses[:, 0]] > _SUSPECT * _RESOLUTION]
    if len(again):
        off = np.maximum(off, (1.0 + _BETWEEN) * _deviation(assembly, topology, again, 5 * (samples - 1) + 1))
    return off


def _deviation(assembly: Assembly, topology: Topology, uses: IntArray, samples: int) -> Array:
    """(e,) of `edge_deviation` at equally spaced samples of some uses, zero for the edges of no such use."""
    points, _, _ = _on_surfaces(assembly, topology, uses, samples, with_normals=False, beyond_borders=True)
    edges, place = np.unique(uses[:, 0], return_inverse=True)
    curves = np.stack([_sampled(topology.curves[int(edge)], samples) for edge in edges])
    out = np.zeros(len(topology.curves))
    np.maximum.at(out, uses[:, 0], np.linalg.norm(points - curves[place.reshape(-1)], axis=2).max(axis=1))
    return out


def edge_uses(topology: Topology) -> IntArray:
    """(k, 4) edge, face, loop and place of every use, face by face."""
    rows = [
        (use.edge, face, number, place)
        for face, loops in enumerate(topology.loops)
        for number, loop in enumerate(loops)
        for place, use in enumerate(loop)
    ]
    return np.array(rows, dtype=np.int64).reshape(-1, 4)


def _topology(assembly: Assembly) -> Topology:
    if assembly.topology is None or not assembly.is_cad:
        raise ParameterError("seams need faces with surfaces and a topology; this assembly has none")
    return assembly.topology


def _sampled(curve: NurbsCurve, samples: int) -> Array:
    """(samples, d) at equal parameters."""
    share = np.linspace(0.0, 1.0, samples)
    if curve.degree == 1 and len(curve.control_points) == 2 and curve.weights is None:
        a, b = curve.control_points
        return np.asarray(a + share[:, None] * (b - a))
    t0, t1 = curve.domain
    return curve(t0 + share * (t1 - t0))


def _on_surfaces(
    assembly: Assembly, topology: Topology, uses: IntArray, samples: int, *, with_normals: bool,
    beyond_borders: bool = False,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Points and outward unit normals (k, samples, 3) of every use on its face's surface, and `beyond` (k,).

    Beyond its ranges the surface is taken at its border, or where the kernel would take it: carried on.
    """
    points, normals = np.zeros((len(uses), samples, 3)), np.zeros((len(uses), samples, 3))
    beyond = np.zeros(len(uses))
    starts = np.flatnonzero(np.diff(uses[:, 1], prepend=-1))
    for low, high in zip(starts, [*starts[1:], len(uses)], strict=True):
        face = int(uses[low, 1])
        surface = assembly.parts[face].surface
        assert surface is not None
        uv = np.stack([_sampled(topology.loops[face][n][p].pcurve, samples) for _, _, n, p in uses[low:high]])
        bottom, top = np.array(surface.domain, dtype=np.float64).T
        inside = np.clip(uv, bottom, top)
        if beyond_borders and not np.array_equal(inside, uv):
            surface = carried_on(surface, uv)
            inside = np.clip(uv, *np.array(surface.domain, dtype=np.float64).T)
        size = np.where(np.isfinite(top - bottom), top - bottom, 1.0)
        beyond[low:high] = (np.abs(inside - uv) / size).max(axis=(1, 2))
        u, v = inside[..., 0], inside[..., 1]
        points[low:high] = surface(u, v)
        if with_normals:
            normal = np.cross(surface(u, v, (1, 0)), surface(u, v, (0, 1)))
            length = np.linalg.norm(normal, axis=2, keepdims=True)
            tiny = 1e-12 * length.max(initial=0.0)
            sign = -1.0 if topology.flipped[face] else 1.0
            normals[low:high] = np.divide(sign * normal, length, out=np.zeros_like(normal), where=length > tiny)
    return points, normals, beyond


def carried_on(surface: Surface, uv: Array) -> Surface:
    """The surface on ranges that hold all of `uv` (..., 2); as it is where it cannot be carried on so far."""
    low, high = np.array(surface.domain, dtype=np.float64).T
    least, most = uv.reshape(-1, 2).min(axis=0), uv.reshape(-1, 2).max(axis=0)
    if (np.maximum(low - least, most - high) > high - low).any():
        return surface
    (u0, v0), (u1, v1) = np.minimum(low, least).tolist(), np.maximum(high, most).tolist()
    try:
        if isinstance(surface, NurbsSurface):
            return surface_on(surface, (u0, u1), (v0, v1))
        wider: Any = surface
        return cast(Surface, replace(wider, u=(u0, u1), v=(v0, v1)))
    except GeometryError:
        return surface
