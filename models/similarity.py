"""Similarities of points, curves and surfaces: a rigid motion after a change of size about its centre.

Sizes are shape, parameters are not: parameters that are angles or a NURBS' own stay, those that are lengths (both of a
plane, the one along the axis of cylinders and cones) change with the size, and `factors` says so for pcurves.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from patchwright.models.analytic import Cone, Cylinder, Plane, Sphere, Torus
from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.rigid_motion import RigidMotion
from patchwright.models.surface import Surface

Range = tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Similarity:
    """x -> motion(centre + scale (x - centre)), with the motion's own centre and a positive scale."""

    motion: RigidMotion
    scale: float = 1.0

    def __call__(self, points: Array) -> Array:
        """(..., 3) the moved points."""
        return self.motion(self.motion.centre + self.scale * (points - self.motion.centre))

    def curve(self, curve: NurbsCurve) -> NurbsCurve:
        """The moved curve, parameters and weights kept."""
        return NurbsCurve(curve.degree, curve.knots, self(curve.control_points), curve.weights)

    def factors(self, surface: Surface) -> Array:
        """(2,) what the parameters of a point on the surface are to be multiplied by."""
        if isinstance(surface, Plane):
            return np.full(2, self.scale)
        return np.array([1.0, self.scale if isinstance(surface, Cylinder | Cone) else 1.0])

    def surface(self, surface: Surface) -> Surface:
        """The moved surface, its kind kept.

        Raises
        ------
        ParameterError : a kind of surface that is not known here.
        """
        if self.scale == 1.0:
            return self.motion.surface(surface)
        if isinstance(surface, NurbsSurface):
            return replace(surface, control_points=self(surface.control_points))
        u, v = (_times(own, f) for own, f in zip((surface.u, surface.v), self.factors(surface), strict=True))  # type: ignore[attr-defined]
        turned, s = self.motion.surface(surface), self.scale
        if isinstance(turned, Plane) and isinstance(surface, Plane):
            return Plane(self(surface.origin), turned.normal, turned.xdir, u, v)
        if isinstance(turned, Cylinder) and isinstance(surface, Cylinder):
            return Cylinder(self(surface.origin), turned.axis, s * turned.radius, turned.xdir, u, v)
        if isinstance(turned, Cone) and isinstance(surface, Cone):
            radius = s * turned.ref_radius
            return Cone(self(surface.origin), turned.axis, turned.half_angle, radius, turned.xdir, u, v)
        if isinstance(turned, Sphere) and isinstance(surface, Sphere):
            return Sphere(self(surface.center), s * turned.radius, axis=turned.axis, xdir=turned.xdir, u=u, v=v)
        if isinstance(turned, Torus) and isinstance(surface, Torus):
            major, minor = s * turned.major_radius, s * turned.minor_radius
            return Torus(self(surface.center), turned.axis, major, minor, xdir=turned.xdir, u=u, v=v)
        raise ParameterError(f"a {type(surface).__name__} cannot be moved")


def _times(own: Range | None, factor: float) -> Range | None:
    return None if own is None else (own[0] * float(factor), own[1] * float(factor))
