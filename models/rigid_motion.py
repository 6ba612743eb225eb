"""Rigid motions of points, curves and surfaces; parameters stay, so that trims and pcurves stay valid."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from patchwright.models.analytic import Cone, Cylinder, Plane, Sphere, Torus
from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.surface import Surface


@dataclass(frozen=True, slots=True, eq=False)
class RigidMotion:
    """x -> rotation @ (x - centre) + centre + shift, the rotation (3, 3) proper and orthogonal."""

    rotation: Array
    centre: Array
    shift: Array

    @classmethod
    def of(cls, turn: Array, centre: Array, shift: Array) -> RigidMotion:
        """The rotation about the axis `turn` (3,) by its length in radians, then the shift."""
        from scipy.spatial.transform import Rotation

        return cls(Rotation.from_rotvec(turn).as_matrix(), np.asarray(centre, float), np.asarray(shift, float))

    def __call__(self, points: Array) -> Array:
        """(..., 3) the moved points."""
        return np.asarray((points - self.centre) @ self.rotation.T + (self.centre + self.shift))

    def directed(self, directions: Array) -> Array:
        """(..., 3) the turned directions."""
        return np.asarray(directions @ self.rotation.T)

    def curve(self, curve: NurbsCurve) -> NurbsCurve:
        """The moved curve, parameters and weights kept."""
        return NurbsCurve(curve.degree, curve.knots, self(curve.control_points), curve.weights)

    def surface(self, surface: Surface) -> Surface:
        """The moved surface: its kind, sizes and parameters kept.

        Raises
        ------
        ParameterError : a kind of surface that is not known here.
        """
        if isinstance(surface, NurbsSurface):
            return replace(surface, control_points=self(surface.control_points))
        if isinstance(surface, Plane):
            normal, xdir = self.directed(surface.normal), self.directed(surface.xdir)
            return Plane(self(surface.origin), normal, xdir, surface.u, surface.v)
        if not isinstance(surface, Cylinder | Cone | Sphere | Torus):
            raise ParameterError(f"a {type(surface).__name__} cannot be moved")
        axis, xdir = self.directed(surface.axis), self.directed(surface.xdir)
        u, v = surface.u, surface.v
        if isinstance(surface, Cylinder):
            return Cylinder(self(surface.origin), axis, surface.radius, xdir, u, v)
        if isinstance(surface, Cone):
            return Cone(self(surface.origin), axis, surface.half_angle, surface.ref_radius, xdir, u, v)
        if isinstance(surface, Sphere):
            return Sphere(self(surface.center), surface.radius, axis=axis, xdir=xdir, u=u, v=v)
        return Torus(self(surface.center), axis, surface.major_radius, surface.minor_radius, xdir=xdir, u=u, v=v)
