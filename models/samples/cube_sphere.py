"""The unit sphere as six exact rational patches, and the same patches drawn back from their edges.

A patch is the stereographic image of a plane quadrilateral with circular sides. In homogeneous coordinates the plane
patch (X, Y, W) is biquadratic, so its image (2 X W, 2 Y W, W^2 - X^2 - Y^2, W^2 + X^2 + Y^2) is biquartic and exactly
on the sphere: the construction of Cobb, Tiling the sphere with rational Bezier patches, University of Utah, 1988.
"""

from __future__ import annotations

import numpy as np

from patchwright.models import knots as knot_tools
from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.samples.body import Body
from patchwright.models.samples.sample import Sample

AXES = {"+z": (0, 1, 2), "+x": (1, 2, 0), "+y": (2, 0, 1)}
"""Which coordinate of the top patch becomes x, y, z of each patch; an even permutation keeps the normal outwards."""


def _top() -> Array:
    """(5, 5, 4) homogeneous Bezier net of the patch about +z."""
    corner = 1.0 / (np.sqrt(3.0) + 1.0)
    w = np.cos(np.pi / 12.0)  # the sides are arcs of 30 degrees, radius sqrt(2), about (-1, 0) and its rotations
    side = np.sqrt(2.0) / w - 1.0
    weight = np.array([[1.0, w, 1.0], [w, w * w, w], [1.0, w, 1.0]])
    x = np.array([-1.0, 0.0, 1.0])[:, None] * np.array([corner, side, corner])[None]
    plane = np.stack([x * weight, x.T * weight, weight], axis=-1)
    t = np.linspace(0.0, 1.0, 5)
    quadratic = np.stack([(1 - t) ** 2, 2 * t * (1 - t), t**2], axis=1)
    X, Y, W = np.moveaxis(np.einsum("ia,jb,abk->ijk", quadratic, quadratic, plane), -1, 0)
    values = np.stack([2 * X * W, 2 * Y * W, W**2 - X**2 - Y**2, W**2 + X**2 + Y**2], axis=-1)
    quartic = np.stack([c * t**k * (1 - t) ** (4 - k) for k, c in enumerate((1, 4, 6, 4, 1))], axis=1)
    inverse = np.linalg.inv(quartic)
    return np.asarray(np.einsum("ai,bj,ijk->abk", inverse, inverse, values))


def cube_sphere_patches(gap: float = 0.0, *, cells: int = 16) -> Sample:
    """Six patches of the unit sphere, each drawn back so that neighbours are `gap` of a patch's parameter range apart.

    The patches stay on the sphere; with `gap` 0 they share their edges and form one closed body, otherwise each is an
    open body of its own. The truth is the whole sphere.
    """
    if not 0.0 <= gap < 1.0:
        raise ParameterError(f"the gap must be in [0, 1) of a patch, got {gap}")
    knots, top = knot_tools.bezier_knots(4), _top()
    surfaces: dict[str, NurbsSurface] = {}
    for name, axes in AXES.items():
        turned = top[..., [axes.index(k) for k in range(3)] + [3]]
        mirrored = turned[::-1] * [-1.0, -1.0, -1.0, 1.0]  # through the centre; u backwards keeps the normal outwards
        for label, net in ((name, turned), ("-" + name[1], mirrored)):
            surface = NurbsSurface.from_homogeneous((4, 4), (knots, knots), net, rational=True)
            surfaces[label] = surface.restricted((0.5 * gap, 1.0 - 0.5 * gap), (0.5 * gap, 1.0 - 0.5 * gap))
    line = {"edge": np.linspace(0.5 * gap, 1.0 - 0.5 * gap, cells + 1)}
    both = ("edge", "edge")
    bodies: tuple[Body, ...] = (Body("sphere", tuple(surfaces), tuple(surfaces.values()), line, (both,) * 6),)
    if gap > 0.0:
        bodies = tuple(Body(name, ("patch",), (s,), line, (both,), closed=False) for name, s in surfaces.items())

    def distance(points: Array) -> Array:
        return np.asarray(np.abs(np.linalg.norm(points, axis=1) - 1.0))

    return Sample.of(
        "cube sphere", bodies, exact_distance=distance, exact_volume=4.0 / 3.0 * np.pi, exact_area=4.0 * np.pi
    )
