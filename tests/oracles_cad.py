"""Closed networks of bicubic patches whose neighbours share their boundary curves bit for bit."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from patchwright.models import Assembly, EdgeUse, Part, Topology, Triangulation
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface

Net = npt.NDArray[np.float64]
EMPTY = Triangulation(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))


def clamped(count: int, degree: int = 3) -> Net:
    """A clamped uniform knot vector on [0, 1] for `count` control points."""
    return np.concatenate([np.zeros(degree), np.linspace(0.0, 1.0, count - degree + 1), np.ones(degree)])


def network(nets: list[Net], names: list[str] | None = None, body: str = "") -> Assembly:
    """Patches (n, n, 3) as an assembly whose topology shares edges by equal boundary control points."""
    parts, loops, curves, ends = [], [], [], []
    corner_of: dict[bytes, int] = {}
    vertices: list[Net] = []
    edge_of: dict[bytes, int] = {}

    def corner(point: Net) -> int:
        key = point.tobytes()
        if key not in corner_of:
            corner_of[key] = len(vertices)
            vertices.append(point)
        return corner_of[key]

    for i, net in enumerate(net + 0.0 for net in nets):  # no negative zeros: the keys are bytes
        n, m = net.shape[:2]
        surface = NurbsSurface((3, 3), (clamped(n), clamped(m)), net)
        sides = [
            (net[:, 0], (0.0, 0.0), (1.0, 0.0)),
            (net[-1, :], (1.0, 0.0), (1.0, 1.0)),
            (net[::-1, -1], (1.0, 1.0), (0.0, 1.0)),
            (net[0, ::-1], (0.0, 1.0), (0.0, 0.0)),
        ]
        loop = []
        for points, start, end in sides:
            points = np.ascontiguousarray(points)
            forward, backward = points.tobytes(), np.ascontiguousarray(points[::-1]).tobytes()
            reverse = backward in edge_of
            if not reverse and forward not in edge_of:
                edge_of[forward] = len(curves)
                curves.append(NurbsCurve(3, clamped(len(points)), points))
                ends.append((corner(points[0]), corner(points[-1])))
            uv = np.array([end, start] if reverse else [start, end])
            pcurve = NurbsCurve(1, np.array([0.0, 0.0, 1.0, 1.0]), uv)
            loop.append(EdgeUse(edge_of[backward if reverse else forward], reverse, pcurve))
        loops.append((tuple(loop),))
        parts.append(Part(names[i] if names else f"patch-{i + 1}", EMPTY, surface, body=body))
    topology = Topology(np.array(vertices), tuple(curves), np.array(ends), tuple(loops))
    return Assembly(tuple(parts), unit="mm", source="network", topology=topology)


def cube_sphere(count: int = 7, radius: float = 10.0) -> Assembly:
    """Six patches; control points of neighbours' common sides are the same numbers."""
    side = np.tan(np.linspace(-np.pi / 4, np.pi / 4, count))
    side = (side - side[::-1]) / 2  # symmetric to the last bit, so that common sides agree
    side[[0, -1]] = -1.0, 1.0
    a, b = np.meshgrid(side, side, indexing="ij")
    one = np.ones_like(a)
    frames = [(one, a, b), (-one, b, a), (b, one, a), (a, -one, b), (a, b, one), (b, a, -one)]
    nets = []
    for frame in frames:
        cube = np.stack(frame, axis=2)
        ordered = np.sort(np.abs(cube), axis=2)  # the sum's order must not depend on the face
        length = np.sqrt((ordered**2).sum(axis=2, keepdims=True))
        nets.append(radius * cube / length)
    return network(nets, body="ball")


def torus(rows: int, columns: int, count: int = 7, place: Callable[[Net], Net] | None = None) -> Assembly:
    """rows x columns patches of a torus of radii 10 and 3."""
    step = count - 1
    u = np.arange(rows * step) * (2 * np.pi / (rows * step))
    v = np.arange(columns * step) * (2 * np.pi / (columns * step))
    ring = 10.0 + 3.0 * np.cos(v)
    grid = np.stack(
        [np.outer(np.cos(u), ring), np.outer(np.sin(u), ring), np.outer(np.ones_like(u), 3.0 * np.sin(v))], axis=2
    )
    grid = grid if place is None else place(grid)
    grid = np.concatenate([grid, grid[:1]])
    grid = np.concatenate([grid, grid[:, :1]], axis=1)
    nets = [
        grid[i * step : (i + 1) * step + 1, j * step : (j + 1) * step + 1] for i in range(rows) for j in range(columns)
    ]
    return network([np.ascontiguousarray(net) for net in nets], body="ring")
