"""A proof that a surface does not meet itself: the cones of its two families of derivatives are apart.

Between two points of the domain S(p) - S(q) = du a + dv b, where a is a mean of S_u and b of S_v along the way. All
S_u lie in the cone of the control net's differences along u, all S_v in that of those along v (hull property of the
derivatives). When no direction of one cone is, up to sign, one of the other, du a + dv b vanishes only for p = q.
"""

from __future__ import annotations

import numpy as np

from patchwright.models.arrays import Array
from patchwright.models.surface import Surface


def is_embedded(surface: Surface) -> bool:
    """Whether it is proved that a bounded surface nowhere meets itself; False says nothing.

    Limits: rational surfaces with unequal weights are not decided, nor are closed ones.
    """
    native = surface.to_nurbs()
    if native.weights is not None and np.ptp(native.weights) > 0.0:
        return False
    net = native.clamped().control_points
    along_u, along_v = (_cone(np.diff(net, axis=axis).reshape(-1, 3)) for axis in (0, 1))
    if along_u is None or along_v is None:
        return False
    (axis_u, wide_u), (axis_v, wide_v) = along_u, along_v
    between = float(np.arccos(np.clip(abs(axis_u @ axis_v), 0.0, 1.0)))
    return between > (wide_u + wide_v) * (1.0 + 1e-9) and max(wide_u, wide_v) < 0.5 * np.pi


def _cone(vectors: Array) -> tuple[Array, float] | None:
    """Axis and half angle of a cone round all vectors; None where one is zero or they cancel."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    if not (length > 0.0).all():
        return None
    units = vectors / length
    axis = units.sum(axis=0)
    size = float(np.linalg.norm(axis))
    if size < 1e-9 * len(units):
        return None
    axis = axis / size
    return axis, float(np.arccos(np.clip((units @ axis).min(), -1.0, 1.0)))
