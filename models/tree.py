"""`Tree`: a bounding-volume tree over triangles; rays, segments, closest points and overlapping boxes, float64-exact.

The boxes are float32 and padded; they only decide what is looked at. Every distance comes from the float64 corners in
the model's own frame. A query answers with the least (distance, triangle number), so the answer depends neither on the
tree nor on the number of threads: equal distances go to the lowest triangle.

Whether a line meets a triangle is decided as in exact arithmetic on the given coordinates, border included: the shear
of Woop, Benthin & Wald, "Watertight ray/triangle intersection", J. Computer Graphics Techniques 2(1), 2013, in double
precision with a bound on its rounding, and exact determinants where the bound does not decide. So no line slips through
a closed surface at an edge or a vertex. A ray in the plane of a triangle does not hit that triangle, nor does any ray
hit a triangle without area.

Cost: building n log n; a query log n on surfaces, times what it finds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array, BoolArray, IntArray
from patchwright.models.errors import ParameterError
from patchwright.models.triangulation import Triangulation

T = TypeVar("T")
N = TypeVar("N", bound=np.generic)

BATCH = 4096  # fewer queries than this are not worth a thread


@dataclass(frozen=True, slots=True, eq=False)
class ClosestPoints:
    """Closest points of a triangulation: (n, 3) points, (n,) distances, (n,) triangles, (n, 3) barycentric."""

    points: Array
    distance: Array
    triangle: IntArray
    barycentric: Array


@dataclass(frozen=True, slots=True, eq=False)
class RayHits:
    """First hits: (n,) distances in the length unit (inf: none), (n,) triangles (-1: none), (n, 3) barycentric."""

    distance: Array
    triangle: IntArray
    barycentric: Array

    @property
    def hit(self) -> BoolArray:
        """(n,) whether the ray hit anything."""
        found: BoolArray = self.triangle >= 0
        return found


@dataclass(frozen=True, slots=True, eq=False)
class SegmentHits:
    """All hits of segments, those of segment i in rows offsets[i] to offsets[i + 1], by rising t, then triangle.

    offsets (n + 1,), t (h,) in [0, 1] from start to end, triangle (h,), barycentric (h, 3).
    """

    offsets: IntArray
    t: Array
    triangle: IntArray
    barycentric: Array

    @property
    def segment(self) -> IntArray:
        """(h,) the segment of each hit."""
        return np.repeat(np.arange(len(self.offsets) - 1), np.diff(self.offsets))


@dataclass(frozen=True, slots=True, eq=False)
class Tree:
    """A tree over a triangulation; make it with `Tree.of` and share it.

    Parameters
    ----------
    triangulation : what the tree is over
    center : (3,) the middle the boxes are stored about
    boxes, child, corners, index : the flat tree, see the kernel
    """

    triangulation: Triangulation
    center: Array
    boxes: npt.NDArray[np.float32]
    child: npt.NDArray[np.int32]
    corners: Array
    index: npt.NDArray[np.int32]

    @classmethod
    def of(cls, triangulation: Triangulation) -> Tree:
        """Build the tree: surface-area heuristic on 16 bins, leaves of at most four triangles.

        Raises
        ------
        ParameterError : more than 2^28 triangles.
        """
        from patchwright.models import _tree_kernel as kernel

        if len(triangulation) >= 2**28:
            raise ParameterError(f"a tree holds at most {2**28 - 1} triangles, got {len(triangulation)}")
        low, high = kernel.bounds(triangulation.vertices, triangulation.triangles)
        center = 0.5 * low + 0.5 * high
        half = float(np.max(high - low)) / 2.0
        pad = max(half * 2.0**-20, 8.0 * float(np.finfo(np.float64).eps) * float(np.abs(center).max()), 1e-37)
        boxes = kernel.primitive_boxes(triangulation.vertices, triangulation.triangles, center, pad)
        nodes, child, order = kernel.build(boxes)
        nodes, child = nodes.copy(), child.copy()  # numpy's large arrays may get huge pages, those of kernels do not
        corners = np.empty((len(order), 9))
        kernel.gather(triangulation.vertices, triangulation.triangles, order, corners)
        for array in (center, nodes, child, corners, order):
            array.flags.writeable = False
        return cls(triangulation, center, nodes, child, corners, order)

    def closest(self, points: npt.ArrayLike) -> ClosestPoints:
        """The closest point of the triangulation to each of `points` (n, 3).

        Triangles without area count as the segments or points they are.

        Raises
        ------
        ParameterError : a coordinate that is not finite, or a triangulation without triangles.
        """
        from patchwright.models._nearest_kernel import closest_points

        query = query_points(points, "points")
        if not len(self.triangulation):
            raise ParameterError(
                f"the closest points of {len(query)} points were asked of a triangulation without triangles"
            )
        found = ClosestPoints(
            np.empty((len(query), 3)), np.empty(len(query)), np.empty(len(query), np.int64), np.empty((len(query), 3))
        )
        in_shares(
            closest_points,
            (*self.flat, query),
            self.coherent(query),
            (found.points, found.distance, found.triangle, found.barycentric),
        )
        return found

    def first_hit(self, origins: npt.ArrayLike, directions: npt.ArrayLike, reach: npt.ArrayLike = np.inf) -> RayHits:
        """The nearest triangle in front of each origin, both sides of a triangle counting.

        Parameters
        ----------
        origins, directions : (n, 3) or broadcasting to it; the length of a direction does not matter
        reach : the greatest distance looked at, length unit; a scalar or (n,)

        Raises
        ------
        ParameterError : a coordinate that is not finite, a direction of length zero, a reach that is NaN.
        """
        from patchwright.models._ray_kernel import first_hits

        start, ahead = _pair(origins, directions, "origins", "directions")
        limit = np.atleast_1d(np.asarray(reach, dtype=np.float64))
        if limit.shape not in ((1,), (len(start),)):
            raise ParameterError(f"the reach must be a number or one per ray ({len(start)},), got {limit.shape}")
        if np.isnan(limit).any():
            raise ParameterError(f"the reach of ray {int(np.isnan(limit).argmax())} is NaN")
        still = (ahead[:, 0] == 0.0) & (ahead[:, 1] == 0.0) & (ahead[:, 2] == 0.0)
        if still.any():
            raise ParameterError(f"the direction of ray {int(still.argmax())} has length zero")
        found = RayHits(np.full(len(start), np.inf), np.full(len(start), -1, np.int64), np.zeros((len(start), 3)))
        if len(self.triangulation):
            order = self.coherent(start, ahead)
            in_shares(
                first_hits,
                (*self.flat, start, ahead, np.ascontiguousarray(limit)),
                order,
                (found.distance, found.triangle, found.barycentric),
            )
        return found

    def all_hits(self, start: npt.ArrayLike, end: npt.ArrayLike) -> SegmentHits:
        """Every triangle each segment crosses, ends included; a hit on a shared edge may list each triangle there.

        A segment of length zero crosses nothing.

        Parameters
        ----------
        start, end : (n, 3) or broadcasting to it

        Raises
        ------
        ParameterError : a coordinate that is not finite.
        """
        from patchwright.models._ray_kernel import all_hits

        first, last = _pair(start, end, "start", "end")
        if not len(self.triangulation):
            return SegmentHits(np.zeros(len(first) + 1, np.int64), np.zeros(0), np.zeros(0, np.int64), np.zeros((0, 3)))
        jobs = zip(shares_of(first), shares_of(last), strict=True)
        found: list[tuple[IntArray, Array]] = side_by_side([partial(all_hits, *self.flat, *job) for job in jobs])
        offsets = np.concatenate([[0], np.cumsum(np.concatenate([count for count, _ in found]))])
        rows = np.concatenate([hits for _, hits in found])
        return SegmentHits(offsets, rows[:, 0].copy(), rows[:, 1].astype(np.int64), rows[:, 2:].copy())

    def pairs(self, other: Tree | None = None) -> IntArray:
        """(k, 2) triangles of this tree and of `other` whose boxes touch, in lexicographic order.

        Without `other`, the pairs within this tree, each once and lower number first.
        """
        found = self.touching(other)
        width = len(self.triangulation if other is None else other.triangulation)
        return found[np.argsort(found[:, 0] * width + found[:, 1])]

    def touching(self, other: Tree | None = None) -> IntArray:
        """`pairs` in no particular order."""
        from patchwright.models._tree_kernel import exact_boxes, overlapping

        second = self if other is None else other
        if not len(self.triangulation) or not len(second.triangulation):
            return np.zeros((0, 2), dtype=np.int64)
        mine = exact_boxes(self.corners)
        theirs = mine if other is None else exact_boxes(second.corners)
        found: IntArray = overlapping(
            self.boxes, self.child, mine, self.index, self.center,
            second.boxes, second.child, theirs, second.index, second.center, other is None,
        )  # fmt: skip
        return found

    @property
    def flat(self) -> tuple[Any, ...]:
        return self.boxes, self.child, self.corners, self.index, self.center

    def coherent(self, points: Array, directions: Array | None = None) -> IntArray:
        """The order in which to ask: near ones one after the other, where that saves more than it costs.

        Rays that all start near one point are ordered by their directions.
        """
        from patchwright.models._tree_kernel import morton_order

        if len(points) < 256 or len(self.triangulation) < 256:
            return np.arange(len(points))
        least = 1e-3 * float(np.abs(self.boxes[0]).max())
        order: IntArray = morton_order(points, points if directions is None else directions, least)
        return order


def threads() -> int:
    """How many threads to use: NUMBA_NUM_THREADS, or one per processor."""
    from numba import config  # asking for numba's own threads would start its threading layer

    return int(config.NUMBA_NUM_THREADS)


def shares_of(rows: npt.NDArray[N]) -> list[npt.NDArray[N]]:
    """`rows` cut in one piece per thread, in a single piece if there are few."""
    return np.array_split(rows, max(1, min(threads(), len(rows) // BATCH)))


def side_by_side(jobs: list[Callable[[], T]]) -> list[T]:
    """Results of the jobs, which release the interpreter lock, each in its own thread."""
    if len(jobs) == 1:
        return [jobs[0]()]
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(len(jobs)) as pool:
        return [job.result() for job in [pool.submit(job) for job in jobs]]


def in_shares(kernel: Callable[..., None], before: tuple[Any, ...], order: IntArray, after: tuple[Any, ...]) -> None:
    """Call `kernel(*before, share, *after)` for shares of `order`; the shares write to different rows."""
    side_by_side([partial(kernel, *before, share, *after) for share in shares_of(order)])


def query_points(points: npt.ArrayLike, name: str) -> Array:
    """`points` as (n, 3) finite float64."""
    array = np.ascontiguousarray(points, dtype=np.float64)
    if array.ndim == 1 and array.shape == (3,):
        array = array[None]
    if array.size == 0:
        array = array.reshape(0, 3)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ParameterError(f"{name} must be (n, 3), got {array.shape}")
    if not np.isfinite(array).all():
        bad = int(np.flatnonzero(~np.isfinite(array).all(axis=1))[0])
        raise ParameterError(f"row {bad} of {name} is not finite: {array[bad].tolist()}")
    return array


def _pair(first: npt.ArrayLike, second: npt.ArrayLike, name: str, other: str) -> tuple[Array, Array]:
    """Two (n, 3) arrays, one broadcast to the other if it has a single row."""
    a, b = query_points(first, name), query_points(second, other)
    if len(a) != len(b) and 1 not in (len(a), len(b)):
        raise ParameterError(f"{len(a)} {name} do not go with {len(b)} {other}")
    a, b = np.broadcast_arrays(a, b)
    return np.ascontiguousarray(a), np.ascontiguousarray(b)
