"""`QuadLayout`: quads over a triangulation, each to become one patch, with the path every edge takes on the surface.

`quad_layout` finds one: features and sizes of the triangulation, coarse triangles along the features, pairs of them made
quads, all split once into quads only, then smoothed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray, frozen
from patchwright.models.errors import ParameterError
from patchwright.models.triangulation import Triangulation

METHODS = ("pairs", "quadriflow")


@dataclass(frozen=True, slots=True)
class LayoutReport:
    """How good a layout is.

    `folded` counts quads turned against the surface; the scaled Jacobian of a quad is the least sine of its corners'
    angles, seen along the surface normal (1 is a rectangle, 0 a triangle, negative a fold); `feature_coverage` is the share
    of the sharp and boundary length that quad edges follow; `euler` is that of the layout and of the triangulation.
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
    path_points : (k, 3) polylines on the triangulation from each edge's first to its second vertex; exactly the stretch of
        the feature where the edge is sharp or boundary
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
            put(self, name, frozen(getattr(self, name), np.float64))
        for name in ("quads", "edges", "quad_edges", "edge_quads", "path_offsets", "triangle", "tags"):
            put(self, name, frozen(getattr(self, name), np.int64))
        for name in ("edge_reversed", "sharp", "boundary"):
            put(self, name, frozen(getattr(self, name), np.bool_))
        m, e = len(self.quads), len(self.edges)
        if self.quads.shape != (m, 4) or self.quad_edges.shape != (m, 4) or self.edge_reversed.shape != (m, 4):
            raise ParameterError(f"quads, quad_edges and edge_reversed must be (m, 4), got {self.quads.shape} for quads")
        if len(self.path_offsets) != e + 1 or self.path_offsets[-1] != len(self.path_points):
            raise ParameterError(f"path_offsets must be ({e + 1},) and end at {len(self.path_points)} points")

    def __len__(self) -> int:
        return len(self.quads)

    def path(self, edge: int) -> Array:
        """(k, 3) polyline of an edge from its first to its second vertex."""
        return self.path_points[self.path_offsets[edge] : self.path_offsets[edge + 1]]


def quad_layout(
    triangulation: Triangulation,
    *,
    target: int | None = None,
    angle: float = 30.0,
    frozen: BoolArray | None = None,
    method: str = "pairs",
) -> QuadLayout:
    """A layout found automatically.

    Parameters
    ----------
    triangulation : oriented 2-manifold, closed or with boundary
    target : wanted number of quads, None takes it from size and curvature
    angle : degrees; edges that turn more are sharp and become edges of quads
    frozen : (m,) bool, reserved
    method : "pairs", or "quadriflow" (optional engine, features are not followed exactly)

    Raises
    ------
    ParameterError : an unknown method, a target below 1.
    GeometryError : the triangulation is empty, not 2-manifold or not oriented.
    EngineError : the optional engine failed.
    """
    raise NotImplementedError
