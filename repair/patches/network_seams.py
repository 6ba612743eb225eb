"""The seams of a patch network, measured on the patches themselves."""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.repair.patches.joins import edge_uses, seam_angles, side_normals
from patchwright.repair.patches.network import PatchNetwork
from patchwright.repair.patches.patch_nets import evaluate
from patchwright.repair.patches.spline_space import uniform_collocation
from patchwright.repair.result import Seam

SAMPLES = 25


def measure(network: PatchNetwork) -> tuple[Seam, ...]:
    """One `Seam` per edge: gap and normal angle between its two patches at `SAMPLES` equal parameters."""
    layout = network.layout
    angle = seam_angles(layout, side_normals(layout, network.nets, SAMPLES))
    uses = edge_uses(layout)
    points = _side_points(network).reshape(-1, SAMPLES, 3)[uses]
    gap = np.linalg.norm(points[:, 0] - points[:, 1], axis=2).max(axis=1)
    along = network.edges.sample(SAMPLES)
    length = np.linalg.norm(np.diff(along, axis=1), axis=2).sum(axis=1)
    middle = along[:, SAMPLES // 2]
    seams = []
    for number, (first, last) in enumerate((uses // 4).tolist()):
        free = layout.boundary[number]
        kind = "free" if free else ("sharp" if layout.sharp[number] else "smooth")
        x, y, z = middle[number].tolist()
        seams.append(
            Seam(
                (first,) if free else (first, last),
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
