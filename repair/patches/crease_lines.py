"""Sharp curves that run straight through the vertices of a layout, and normals that agree with them.

A patch beside a sharp curve has its direction for a tangent: two patches that meet at one of its vertices can be smooth
with each other only if the direction is perpendicular to their common normal, on either side of the curve. Where both
sides turn clearly it is the line in which their tangent planes meet (`edge_curves.with_end_tangents`); where a crease
fades, or its own data say something else, the planes give way to the curve.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.repair.layout.quad_layout import QuadLayout
from patchwright.repair.patches.edge_curves import EdgeCurves
from patchwright.repair.patches.joins import edge_end_normals
from patchwright.repair.patches.stars import leaving

MOST_KINK = 40.0  # degrees: a sharp curve that bends more at a vertex has a corner there
OFF = 1e-3  # sine of the angle a curve may leave a tangent plane by


def along_creases(layout: QuadLayout, curves: EdgeCurves, sectors: Array) -> tuple[EdgeCurves, Array]:
    """Curves and sector normals (m, 4, 3) that agree where two sharp edges, and no boundary, meet in a vertex.

    Parameters
    ----------
    sectors : (m, 4, 3) unit normals at the corners, zero at cusps

    Curves turn only in vertices where they leave a tangent plane, both by half of what they bend; their legs keep their
    lengths. Corners of the sharp curve itself stay as they are.
    """
    crease = np.flatnonzero(layout.sharp & ~layout.boundary)
    ends = (2 * crease[:, None] + np.arange(2)).reshape(-1)
    vertex = layout.edges.reshape(-1)[ends]
    count = np.bincount(vertex, minlength=len(layout.vertices))
    count[layout.edges[layout.boundary]] = 0
    paired = count[vertex] == 2
    pairs = ends[paired][np.argsort(vertex[paired], kind="stable")].reshape(-1, 2)
    legs = leaving(curves).reshape(-1, 3)
    length = np.linalg.norm(legs, axis=1)
    unit = np.divide(legs, length[:, None], out=np.zeros_like(legs), where=length[:, None] > 0.0)
    off = np.max([np.abs((unit * n.reshape(-1, 3)).sum(axis=1)) for n in edge_end_normals(layout, sectors)], axis=0)
    line = unit[pairs[:, 0]] - unit[pairs[:, 1]]
    straight = np.linalg.norm(line, axis=1) > 2.0 * np.cos(np.radians(0.5 * MOST_KINK))
    some = straight & (off[pairs] > OFF).any(axis=1)
    pairs, line = pairs[some], line[some] / np.linalg.norm(line[some], axis=1, keepdims=True)
    controls = curves.controls.copy()
    for one, sign in ((0, 1.0), (1, -1.0)):
        edge, end = pairs[:, one] // 2, pairs[:, one] % 2
        tip = np.where(end == 0, curves.offsets[edge], curves.offsets[edge + 1] - 1)
        controls[tip + np.where(end == 0, 1, -1)] = controls[tip] + sign * length[pairs[:, one], None] * line
    lines = np.zeros((len(layout.vertices), 3))
    lines[layout.edges.reshape(-1)[pairs[:, 0]]] = line
    along = lines[layout.quads]
    turned = sectors - (sectors * along).sum(axis=2, keepdims=True) * along
    size = np.linalg.norm(turned, axis=2, keepdims=True)
    turned = np.divide(turned, size, out=np.zeros_like(turned), where=size > 0.5)  # beyond 60 degrees they contradict
    turned = np.where(along.any(axis=2, keepdims=True), turned, sectors)
    return EdgeCurves(curves.cells, curves.offsets, controls), turned
