"""`QuadLayout`: quads over a triangulation, each to become one patch, with the path every edge takes on the surface.

`quad_layout` finds one: features and sizes of the triangulation, coarse triangles along the features, pairs of them
made quads, all split into quads only (where features crowd, no more than must be), made regular, smoothed, and opened
where they fold between their sides.
"""

from __future__ import annotations

from dataclasses import dataclass
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.arrays import frozen as own_copy
from patchwright.models.errors import GeometryError, ParameterError
from patchwright.models.triangulation import Triangulation

if TYPE_CHECKING:
    from patchwright.repair.layout.features import Features
    from patchwright.repair.layout.pairing import QuadMesh
    from patchwright.repair.layout.ridges import Ridges

METHODS = ("pairs", "quadriflow")
RETRIES = 3
NEAR_TARGET = 1.15  # number of quads against the wanted one
CROWDED = 2.0  # the same, beyond which no more edges are halved than must be
MOST_QUADS = 40_000  # more would take a fit hours; no one could work with as many patches
SPARSE = 1.5  # size of the coarse triangles then, in wanted sizes of quads: two of them make one or two quads


@dataclass(frozen=True, slots=True)
class LayoutReport:
    """How good a layout is.

    The scaled Jacobian of a quad is the least sine of the angles at its corners and between its sides, seen along the
    surface normal and measured on 4 x 4 quads that it is split into, or on itself where the surface bends over it (1 is
    a rectangle, 0 a triangle, negative a fold);
    `folded` counts quads where it is not positive; `feature_coverage` is the
    share of the sharp and boundary length that quad edges follow; `euler` is that of the layout and that of the
    triangulation.
    """

    irregular_vertices: int
    min_scaled_jacobian: float
    median_scaled_jacobian: float
    folded: int
    feature_coverage: float
    euler: tuple[int, int]
    elapsed: float


@dataclass(frozen=True, slots=True, eq=False)
class QuadLayout:
    """A pure-quad, 2-manifold, oriented mesh whose vertices and edge paths lie on a triangulation.

    Parameters
    ----------
    vertices : (n, 3) model length unit
    quads : (m, 4) int64, counter-clockwise seen from outside
    edges : (e, 2) int64, each once, lower index first
    quad_edges : (m, 4) int64, edge k joins corner k and corner k + 1
    edge_reversed : (m, 4) bool, the quad runs from the edge's second vertex to its first
    edge_quads : (e, 2) int64, the quads on either side, -1 where there is none
    sharp : (e,) bool, the two quads meet at a sharp feature
    boundary : (e,) bool, one quad only
    path_offsets : (e + 1,) int64, rows of `path_points` that belong to each edge
    path_points : (k, 3) polylines on the triangulation from each edge's first to its second vertex; exactly the stretch
        of the feature where the edge is sharp or boundary
    triangle : (n,) int64, a triangle of the input each vertex lies on, -1 unknown
    tags : (m,) int64, the tag of the input most of each quad lies on
    report : how good the layout is, None when nobody measured
    """

    vertices: Array
    quads: IntArray
    edges: IntArray
    quad_edges: IntArray
    edge_reversed: BoolArray
    edge_quads: IntArray
    sharp: BoolArray
    boundary: BoolArray
    path_offsets: IntArray
    path_points: Array
    triangle: IntArray
    tags: IntArray
    report: LayoutReport | None = None

    def __post_init__(self) -> None:
        put = object.__setattr__
        for name in ("vertices", "path_points"):
            put(self, name, own_copy(getattr(self, name), np.float64))
        for name in ("quads", "edges", "quad_edges", "edge_quads", "path_offsets", "triangle", "tags"):
            put(self, name, own_copy(getattr(self, name), np.int64))
        for name in ("edge_reversed", "sharp", "boundary"):
            put(self, name, own_copy(getattr(self, name), np.bool_))
        m, e = len(self.quads), len(self.edges)
        if self.quads.shape != (m, 4) or self.quad_edges.shape != (m, 4) or self.edge_reversed.shape != (m, 4):
            raise ParameterError(
                f"quads, quad_edges and edge_reversed must be (m, 4), got {self.quads.shape} for quads"
            )
        if len(self.path_offsets) != e + 1 or self.path_offsets[-1] != len(self.path_points):
            raise ParameterError(f"path_offsets must be ({e + 1},) and end at {len(self.path_points)} points")

    def __len__(self) -> int:
        return len(self.quads)

    def path(self, edge: int) -> Array:
        """(k, 3) polyline of an edge from its first to its second vertex."""
        return self.path_points[self.path_offsets[edge] : self.path_offsets[edge + 1]]

    @property
    def irregular_vertices(self) -> int:
        """How many inner vertices have other than four edges."""
        return _irregular(self.edges, self.boundary)


def _irregular(edges: IntArray, boundary: BoolArray) -> int:
    """How many vertices off the boundary have other than four edges."""
    degree = np.bincount(edges.reshape(-1))
    degree[edges[boundary]] = 4
    return int(((degree != 4) & (degree > 0)).sum())


def quad_layout(
    triangulation: Triangulation,
    *,
    target: int | None = None,
    angle: float = 30.0,
    frozen: IntArray | None = None,
    method: str = "pairs",
) -> QuadLayout:
    """A layout found automatically.

    Parameters
    ----------
    triangulation : oriented 2-manifold, closed or with boundary
    target : wanted number of quads, reached within about a fifth; None takes it from size and curvature
    angle : degrees; edges that turn more are sharp and become edges of quads
    frozen : (k, 2) vertex pairs of further edges that quads must follow, or None; method "pairs" only
    method : "pairs", or "quadriflow" (optional engine; features are followed only roughly and are not marked)

    Raises
    ------
    ParameterError : an unknown method, a target below 1, an angle that is not between 0 and 180.
    GeometryError : the triangulation is empty, not 2-manifold or not oriented, or asks for more than MOST_QUADS quads.
    EngineError : the optional engine failed.
    """
    if method not in METHODS:
        raise ParameterError(f"unknown layout method {method!r}; known are {', '.join(METHODS)}")
    if target is not None and target < 1:
        raise ParameterError(f"the target must be at least one quad, got {target}")
    if not 0.0 < angle < 180.0:
        raise ParameterError(f"the angle must lie between 0 and 180 degrees, got {angle}")
    from patchwright.repair.layout.features import find_features

    begin = perf_counter()
    features = find_features(triangulation, angle=angle, frozen=frozen)
    if method == "quadriflow":
        from patchwright.repair.layout.quadriflow import quadriflow

        quad_mesh, features = quadriflow(features, target)
    else:
        features, ridges = _with_ridges(features, angle)
        quad_mesh = _pairs(features, ridges, target)
    return _finish(quad_mesh, features, begin)


def _with_ridges(features: Features, angle: float) -> tuple[Features, Ridges | None]:
    """The features with the ridge lines among the curves to follow, and those ridges; None where there are none."""
    from patchwright.repair.layout.features import FOLLOWED, SHARP, find_features
    from patchwright.repair.layout.ridges import find_ridges
    from patchwright.repair.layout.sizing import surface_curvature, widest_ridge

    ridges = find_ridges(features, surface_curvature(features), widest_ridge(features))
    if not len(ridges.edges):
        return features, None
    follow = np.concatenate([features.curve_edges(FOLLOWED), ridges.edges])
    sharp = features.curve_edges(SHARP)
    return find_features(features.body, angle=angle, frozen=follow, sharp_before=sharp), ridges


def _pairs(features: Features, ridges: Ridges | None, target: int | None) -> QuadMesh:
    """Coarse triangles paired, split and made regular; once more with corrected sizes where their number is off.

    Where features make too many quads of that whatever the size, smaller triangles are paired and split as little as
    can be.
    """
    from patchwright.repair.layout.pairing import pair
    from patchwright.repair.layout.regular import regularize, simple, unfolded
    from patchwright.repair.layout.remesh import remesh
    from patchwright.repair.layout.sizing import size_field

    factor, best, error = 1.0, None, np.inf
    for turn in range(RETRIES):
        size, wanted = size_field(features, ridges, target=target, factor=factor)
        paired = pair(remesh(features, 2.0 * size))
        forced = target is None or (turn == RETRIES - 1 and error > np.log(CROWDED))  # larger triangles did not do
        if forced and len(paired.quads) > CROWDED * wanted:
            few = pair(remesh(features, SPARSE * size), few=True)
            paired = few if simple(few) else paired
        if len(paired.quads) > MOST_QUADS:
            raise GeometryError(
                f"{len(features.kind)} sharp lines with {len(features.corners)} corners ask for {len(paired.quads)} "
                f"patches or so, and {MOST_QUADS} are the most; take parts of the model, or wrap it first"
            )
        begun, smoothed = unfolded(paired)
        quad_mesh = regularize(begun)
        ratio = len(quad_mesh.quads) / wanted
        if abs(np.log(ratio)) < error:
            best, error = (quad_mesh, paired, smoothed), abs(np.log(ratio))
        if target is None or error < np.log(NEAR_TARGET):
            break
        factor *= np.sqrt(ratio)
    assert best is not None
    return _settled(*best)


def _settled(regular: QuadMesh, paired: QuadMesh, smoothed: QuadMesh | None) -> QuadMesh:
    """The regular quads smoothed, or those they were made of where fewer of these are folded."""
    from patchwright.repair.layout.quad_smooth import smooth

    smooth(regular)
    if not _folded(regular):
        return regular
    if smoothed is None:
        smooth(paired)
        smoothed = paired
    return min((regular, smoothed), key=_folded)


def _folded(quad_mesh: QuadMesh) -> int:
    """How many quads are turned against the surface."""
    from patchwright.repair.layout.quad_smooth import scaled_jacobians

    return int((scaled_jacobians(quad_mesh) <= 0.0).sum())


def _finish(quad_mesh: QuadMesh, features: Features, begin: float) -> QuadLayout:
    """Edges, paths, tags and the report of a quad mesh."""
    from patchwright.repair.layout.layout_paths import quad_tags, trace_paths
    from patchwright.repair.layout.opened_quads import opened

    own = trace_paths(quad_mesh, features)
    room = opened(quad_mesh, own.middles())
    if len(room.edges):
        quad_mesh = room.quad_mesh
        own = trace_paths(quad_mesh, features).led_along(room.edges, room.paths)
    vertices, quads = quad_mesh.mesh.X, quad_mesh.quads
    quality = room.quality
    body = features.body
    sides = (3 * len(body) + int((features.neighbours < 0).sum())) // 2
    report = LayoutReport(
        irregular_vertices=_irregular(own.edges, own.boundary),
        min_scaled_jacobian=float(quality.min()),
        median_scaled_jacobian=float(np.median(quality)),
        folded=int((quality <= 0.0).sum()),
        feature_coverage=own.coverage,
        euler=(len(vertices) - len(own.edges) + len(quads), len(body.vertices) - sides + len(body)),
        elapsed=perf_counter() - begin,
    )
    return QuadLayout(
        vertices,
        quads,
        own.edges,
        own.quad_edges,
        own.edge_reversed,
        own.edge_quads,
        own.sharp,
        own.boundary,
        own.path_offsets,
        own.path_points,
        quad_mesh.mesh.vt,
        quad_tags(quad_mesh, features),
        report,
    )
