"""One cubic curve per edge of a layout, built once and shared by both its patches.

An edge follows its path on the geometry in arc-length speed; the curve is the least-squares C2 cubic through samples
of the path with both ends held on the layout's vertices.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from patchwright.models.arrays import Array, BoolArray, IntArray, frozen
from patchwright.repair.patches.fair_fit import curve_fit, curve_normal
from patchwright.repair.patches.spline_space import collocation, refinement, uniform_collocation

SAMPLES_PER_CELL = 6
CREASE_TURN = 0.87  # cosine of 30 degrees: planes whose line is farther from the crease are not those of its sides


@dataclass(frozen=True, slots=True, eq=False)
class EdgeCurves:
    """The curves of all edges, each in its own nested spline space.

    Parameters
    ----------
    cells : (e,) number of polynomial pieces of each edge
    offsets : (e + 1,) rows of `controls` that belong to each edge
    controls : (sum(cells + 3), 3) control points
    """

    cells: IntArray
    offsets: IntArray
    controls: Array

    @classmethod
    def pack(cls, cells: IntArray, groups: list[tuple[IntArray, Array]]) -> EdgeCurves:
        """From groups (edge indices, (k, cells + 3, 3) control points) that cover every edge once."""
        offsets = np.concatenate([[0], np.cumsum(cells + 3)])
        controls = np.empty((int(offsets[-1]), 3))
        for which, points in groups:
            rows = offsets[which][:, None] + np.arange(points.shape[1])
            controls[rows] = points
        return cls(frozen(cells, np.int64), frozen(offsets, np.int64), frozen(controls, np.float64))

    def groups(self) -> Iterator[tuple[int, IntArray, Array]]:
        """(cells, edge indices, (k, cells + 3, 3) control points) for each cell count in use."""
        for cells in np.unique(self.cells):
            which = np.flatnonzero(self.cells == cells)
            rows = self.offsets[which][:, None] + np.arange(cells + 3)
            yield int(cells), which, self.controls[rows]

    def replaced(self, other: EdgeCurves, which: BoolArray) -> EdgeCurves:
        """These curves with those of the mask (e,) taken from `other`; the rest stay bit for bit."""
        cells = np.where(which, other.cells, self.cells)
        offsets = np.concatenate([[0], np.cumsum(cells + 3)])
        controls = np.empty((int(offsets[-1]), 3))
        for source, mask in ((self, ~which), (other, which)):
            for count in np.unique(cells[mask]):
                edges = np.flatnonzero(mask & (cells == count))
                span = np.arange(count + 3)
                controls[offsets[edges][:, None] + span] = source.controls[source.offsets[edges][:, None] + span]
        return EdgeCurves(frozen(cells, np.int64), frozen(offsets, np.int64), frozen(controls, np.float64))

    def refined(self, edges: IntArray, cells: int) -> Array:
        """(len(edges), cells + 3, 3) control points of the same curves in a space of `cells` pieces."""
        out = np.empty((len(edges), cells + 3, 3))
        for own in np.unique(self.cells[edges]):
            mask = self.cells[edges] == own
            rows = self.offsets[edges[mask]][:, None] + np.arange(own + 3)
            points = self.controls[rows]
            out[mask] = points if own == cells else np.einsum("ij,kjd->kid", refinement(int(own), cells), points)
        return out

    def sample(self, count: int) -> Array:
        """(e, count, 3) points at `count` equidistant parameters of every edge."""
        out = np.empty((len(self.cells), count, 3))
        for cells, which, points in self.groups():
            out[which] = np.einsum("ij,kjd->kid", uniform_collocation(cells, count), points)
        out[:, 0] = self.controls[self.offsets[:-1]]
        out[:, -1] = self.controls[self.offsets[1:] - 1]
        return out


def fit_edges(paths: list[tuple[IntArray, Array]], cells: IntArray) -> EdgeCurves:
    """Least-squares curves through samples of the paths.

    Parameters
    ----------
    paths : groups (edge indices, (k, count, 3) equidistant samples of the path); each group shares its cell count
    cells : (e,) pieces per edge
    """
    groups = []
    for which, samples in paths:
        own, count = int(cells[which[0]]), samples.shape[1]
        from_samples, from_ends = curve_fit(own, count, 1)
        inner = from_samples @ samples + from_ends[:, [0, -1]] @ samples[:, [0, -1]]
        groups.append((which, np.concatenate([samples[:, :1], inner, samples[:, -1:]], axis=1)))
    return EdgeCurves.pack(cells, groups)


def with_end_tangents(edges: EdgeCurves, normals: Array, second: Array, fixed: BoolArray) -> EdgeCurves:
    """The curves with their end tangents turned into the tangent planes at their vertices.

    Parameters
    ----------
    normals : (e, 2, 3) unit surface normal at the start and end of each edge (zero: leave that end)
    second : (e, 2, 3) the normal on the other side of a sharp edge (equal to `normals` on a smooth one)
    fixed : (e,) edges to leave alone

    The tangent keeps its length; on a sharp edge it follows the line where both planes meet.
    """
    groups = []
    for _, which, points in edges.groups():
        points = points.copy()
        for end, (tip, arm) in enumerate(((0, 1), (-1, -2))):
            leg = points[:, arm] - points[:, tip]
            n1, n2 = normals[which, end], second[which, end]
            flat = leg - (leg * n1).sum(1, keepdims=True) * n1
            line = np.cross(n1, n2)
            size = np.linalg.norm(line, axis=1, keepdims=True)
            crease = size[:, 0] > 0.34  # 20 degrees: below it the two planes are one and their line is noise
            line = np.divide(line, size, out=np.zeros_like(line), where=size > 0)
            flat[crease] = ((leg * line).sum(1, keepdims=True) * line)[crease]
            new = np.linalg.norm(flat, axis=1, keepdims=True)
            old = np.linalg.norm(leg, axis=1, keepdims=True)
            # a leg nearly along the normal is left, and so is one that a crease's own data contradict
            sound = (new[:, 0] > np.where(crease, CREASE_TURN, 0.5) * old[:, 0]) & ~fixed[which]
            flat = np.divide(flat * old, new, out=flat.copy(), where=new > 0)
            points[sound, arm] = (points[:, tip] + flat)[sound]
        groups.append((which, points))
    return EdgeCurves.pack(np.asarray(edges.cells), groups)


def with_end_bends(edges: EdgeCurves, normals: Array, bends: Array, bent: BoolArray, most: Array) -> EdgeCurves:
    """The curves with given normal curvatures at some of their ends; ends and end tangents stay.

    Parameters
    ----------
    normals : (e, 2, 3) unit surface normals at the start and end of each edge
    bends : (e, 2) the wanted normal curvatures, 1 over length, positive where the curve bends towards the normal
    bent : (e, 2) the ends to change; of curves of fewer than three pieces only one end has room, the first is taken
    most : (e,) length no control point moves farther than; a curve that would have to keeps a part of its curvatures

    The change is the least in the mean square along the curve.
    """
    groups = []
    ends = np.array([0.0, 1.0])
    for cells, which, points in edges.groups():
        points = points.copy()
        active = bent[which].copy()
        if cells < 3:
            active[:, 1] &= ~active[:, 0]
        if cells > 1 and active.any():
            first, second = (collocation(cells, ends, order) for order in (1, 2))
            normal = normals[which]
            wanted = bends[which] * (np.einsum("ei,kid->ked", first, points) ** 2).sum(axis=-1)
            missing = np.where(active, wanted - (np.einsum("ei,kid->ked", second, points) * normal).sum(axis=-1), 0.0)
            reply = np.linalg.solve(curve_normal(cells, 4 * cells + 1)[2:-2, 2:-2], second[:, 2:-2].T)
            mutual = (second[:, 2:-2] @ reply) * np.matmul(normal, np.swapaxes(normal, 1, 2))
            mutual = np.where(active[:, :, None] & active[:, None, :], mutual, 0.0)
            mutual += np.where(active, 0.0, 1.0)[:, :, None] * np.eye(2)
            force = np.linalg.solve(mutual, missing[..., None]) * active[..., None]
            move = np.einsum("ie,ked->kid", reply, force * normal)
            size = np.linalg.norm(move, axis=2).max(axis=1)
            share = np.divide(most[which], size, out=np.ones_like(size), where=size > most[which])
            points[:, 2:-2] += share[:, None, None] * move
        groups.append((which, points))
    return EdgeCurves.pack(np.asarray(edges.cells), groups)


def with_tips(
    edges: EdgeCurves, tips: Array, groups: list[tuple[IntArray, Array]], least: float, most: Array
) -> EdgeCurves:
    """The curves fitted anew to samples, ends held and end tangents free in length alone; others stay.

    Parameters
    ----------
    tips : (e, 2, 3) unit directions in which each curve leaves its start and its end
    groups : (edge indices, (k, count, 3) samples at equidistant parameters); each group shares its cell count
    least : share of its present length below which no leg of the control polygon falls
    most : (e, 2) lengths above which the legs do not get, no less than the present ones
    """
    controls = edges.controls.copy()
    for which, samples in groups:
        cells, count = int(edges.cells[which[0]]), samples.shape[1]
        rows = edges.offsets[which][:, None] + np.arange(cells + 3)
        points = controls[rows]
        normal, basis = curve_normal(cells, count), uniform_collocation(cells, count)
        legs = [1, cells + 1]
        base = np.zeros_like(points)  # the control points without what is free
        base[:, [0, -1]], base[:, legs] = points[:, [0, -1]], points[:, [0, -1]]
        rest = (cells / count) * np.einsum("ci,kcd->kid", basis, samples) - normal @ base
        # the free numbers: both lengths, then the inner control points
        n = 2 + 3 * (cells - 1)
        matrix, right = np.zeros((len(which), n, n)), np.zeros((len(which), n))
        tip = tips[which]
        inner = normal[2:-2, 2:-2]
        matrix[:, :2, :2] = normal[np.ix_(legs, legs)] * np.matmul(tip, np.swapaxes(tip, 1, 2))
        mixed = np.einsum("ej,ked->kejd", normal[legs, 2:-2], tip).reshape(len(which), 2, n - 2)
        matrix[:, :2, 2:], matrix[:, 2:, :2] = mixed, np.swapaxes(mixed, 1, 2)
        matrix[:, 2:, 2:] = np.kron(inner, np.eye(3))
        right[:, :2] = (rest[:, legs] * tip).sum(axis=-1)
        right[:, 2:] = rest[:, 2:-2].reshape(len(which), n - 2)
        found = np.linalg.solve(matrix, right[..., None])[..., 0]
        present = np.linalg.norm(points[:, legs] - points[:, [0, -1]], axis=-1)
        length = np.clip(found[:, :2], least * present, most[which])
        if (length != found[:, :2]).any():  # the inner points answer to the lengths as they are
            right = right[:, 2:] - np.einsum("kej,ke->kj", mixed, length)
            found[:, 2:] = np.linalg.solve(matrix[:, 2:, 2:], right[..., None])[..., 0]
        points[:, legs] = points[:, [0, -1]] + length[..., None] * tip
        points[:, 2:-2] = found[:, 2:].reshape(len(which), cells - 1, 3)
        controls[rows] = points
    return EdgeCurves(edges.cells, edges.offsets, controls)
