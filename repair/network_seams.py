"""The seams of a patch network, measured on the patches themselves."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.repair.joins import side_normals
from patchwright.repair.network import PatchNetwork
from patchwright.repair.patch_nets import evaluate
from patchwright.repair.result import Seam
from patchwright.repair.spline_space import uniform_collocation

SAMPLES = 25


def measure(network: PatchNetwork) -> tuple[Seam, ...]:
    """One `Seam` per edge: gap and normal angle between its two patches at `SAMPLES` equal parameters."""
    layout = network.layout
    points, normals = _side_points(network), side_normals(layout, network.nets, SAMPLES)
    uses: list[list[tuple[int, int]]] = [[] for _ in range(len(layout.edges))]
    for (quad, side), edge in np.ndenumerate(layout.quad_edges):
        uses[int(edge)].append((quad, side))
    along = network.edges.sample(SAMPLES)
    length = np.linalg.norm(np.diff(along, axis=1), axis=2).sum(axis=1)
    middle = along[:, SAMPLES // 2]
    pair = np.array([(u[0][0], u[0][1], u[-1][0], u[-1][1]) for u in uses])
    gap = np.linalg.norm(points[pair[:, 0], pair[:, 1]] - points[pair[:, 2], pair[:, 3]], axis=2).max(axis=1)
    n1, n2 = normals[pair[:, 0], pair[:, 1]], normals[pair[:, 2], pair[:, 3]]
    angle = np.degrees(2.0 * np.arcsin(np.clip(np.linalg.norm(n1 - n2, axis=2) / 2.0, 0.0, 1.0))).max(axis=1)
    seams = []
    for number, use in enumerate(uses):
        kind = "free" if len(use) < 2 else ("sharp" if layout.sharp[number] else "smooth")
        x, y, z = middle[number].tolist()
        seams.append(
            Seam(
                tuple(q for q, _ in use),
                float(gap[number]),
                float(angle[number]),
                kind,
                float(length[number]),
                (x, y, z),
            )
        )
    return tuple(seams)


def _side_points(network: PatchNetwork) -> Array:
    """(m, 4, SAMPLES, 3) points of every patch along its sides, in the direction of the edges."""
    out = np.empty((len(network), 4, SAMPLES, 3))
    for (m, n), which, nets in network.nets.groups():
        ends = np.array([0, -1])
        along_u = evaluate(nets, uniform_collocation(m, SAMPLES), uniform_collocation(n, SAMPLES)[ends])
        along_v = evaluate(nets, uniform_collocation(m, SAMPLES)[ends], uniform_collocation(n, SAMPLES))
        out[which, 0], out[which, 2] = along_u[:, :, 0], along_u[:, :, 1]
        out[which, 3], out[which, 1] = along_v[:, 0], along_v[:, 1]
    backward = network.layout.edge_reversed != np.array([False, False, True, True])
    out[backward] = out[backward][:, ::-1]
    return out
