"""Kernel surfaces to and from ours: Plane, Cylinder, Cone, Sphere, Torus and NURBS.

Both sides use the same parameters up to one factor on v: the kernel measures a cone's v along its generator, we along
its axis, and a left-handed kernel frame turns v round. Kinds we do not hold become NURBS with the same parameters:
extrusions exactly, revolutions to 2e-13 of the radius (see `hermite`), offset surfaces to 1e-9 of their size.
"""

from __future__ import annotations

from contextlib import suppress
from math import cos, inf, isfinite, pi
from typing import Any

import numpy as np

from patchwright.models.analytic import Cone, Cylinder, Plane, Sphere, Torus
from patchwright.models.arrays import Array
from patchwright.models.cad import kernel
from patchwright.models.cad.blocks import spline_surfaces
from patchwright.models.cad.convert_curve import curve_from_kernel
from patchwright.models.cad.hermite import circle_spline
from patchwright.models.cad.kernel_arrays import (
    kernel_knots,
    kernel_net,
    kernel_reals,
    points_3d,
)
from patchwright.models.errors import UnsupportedEntity
from patchwright.models.nurbs_surface import NurbsSurface
from patchwright.models.surface import Surface

Bounds = tuple[float, float, float, float]
_OFFSET_SHARE = 1e-9  # of its size: how far the NURBS of an offset surface may stray


def surfaces_from_kernel(surfaces: list[Any], bounds: list[Bounds]) -> list[tuple[Surface, float]]:
    """`surface_from_kernel` of many; plain B-spline surfaces, the most and the largest, in one go."""
    plain: dict[int, Any] = {}
    for i, surface in enumerate(surfaces):
        if isinstance(surface, kernel.Geom_BSplineSurface) and not (surface.IsUPeriodic() or surface.IsVPeriodic()):
            plain[i] = surface
    # copies: a surface that two faces share would be written once
    done = dict(zip(plain, spline_surfaces([s.Copy() for s in plain.values()]), strict=True)) if plain else {}
    return [
        (done[i], 1.0) if i in done else surface_from_kernel(surface, box)
        for i, (surface, box) in enumerate(zip(surfaces, bounds, strict=True))
    ]


def surface_from_kernel(surface: Any, bounds: Bounds) -> tuple[Surface, float]:
    """Our surface and the factor s of (u, v) = (u, s v_kernel).

    Parameters
    ----------
    bounds : (u0, u1, v0, v1) of the face in the kernel's parameters

    Raises
    ------
    UnsupportedEntity : a kind the kernel cannot turn into a B-spline surface.
    """
    while isinstance(surface, kernel.Geom_RectangularTrimmedSurface):
        surface = surface.BasisSurface()
    u0, u1, v0, v1 = bounds
    if not (u0 < u1 and v0 < v1):
        raise UnsupportedEntity(
            f"a face is empty in its parameters: u from {u0:.6g} to {u1:.6g}, v from {v0:.6g} to {v1:.6g}"
        )
    if isinstance(surface, kernel.Geom_Plane):
        origin, axis, xdir, _ = _frame(surface.Pln().Position())
        return Plane(origin, axis, xdir=xdir, u=(u0, u1), v=(v0, v1)), 1.0
    if isinstance(surface, kernel.Geom_CylindricalSurface):
        shape = surface.Cylinder()
        origin, axis, xdir, s = _frame(shape.Position())
        return Cylinder(origin, axis, shape.Radius(), xdir=xdir, u=_turn(u0, u1), v=_scaled(v0, v1, s)), s
    if isinstance(surface, kernel.Geom_ConicalSurface):
        shape = surface.Cone()
        origin, axis, xdir, s = _frame(shape.Position())
        angle = s * shape.SemiAngle()
        s *= cos(angle)
        return Cone(origin, axis, angle, shape.RefRadius(), xdir=xdir, u=_turn(u0, u1), v=_scaled(v0, v1, s)), s
    if isinstance(surface, kernel.Geom_SphericalSurface):
        shape = surface.Sphere()
        origin, axis, xdir, s = _frame(shape.Position())
        low, high = _scaled(max(v0, -pi / 2), min(v1, pi / 2), s)
        return Sphere(origin, shape.Radius(), axis=axis, xdir=xdir, u=_turn(u0, u1), v=(low, high)), s
    if isinstance(surface, kernel.Geom_ToroidalSurface):
        shape = surface.Torus()
        origin, axis, xdir, s = _frame(shape.Position())
        major, minor = shape.MajorRadius(), shape.MinorRadius()
        turned = _turn(*_scaled(v0, v1, s))
        return Torus(origin, axis, major, minor, xdir=xdir, u=_turn(u0, u1), v=turned), s
    return _nurbs_from_kernel(surface, bounds), 1.0


def surface_to_kernel(surface: Surface) -> tuple[Any, float]:
    """The kernel's surface of ours and the factor s of (u, v_kernel) = (u, s v)."""
    if isinstance(surface, Plane):
        return kernel.Geom_Plane(_ax3(surface.origin, surface.normal, surface.xdir)), 1.0
    if isinstance(surface, Cylinder):
        return kernel.Geom_CylindricalSurface(_ax3(surface.origin, surface.axis, surface.xdir), surface.radius), 1.0
    if isinstance(surface, Cone):
        frame = _ax3(surface.origin, surface.axis, surface.xdir)
        cone = kernel.Geom_ConicalSurface(frame, surface.half_angle, surface.ref_radius)
        return cone, 1.0 / cos(surface.half_angle)
    if isinstance(surface, Sphere):
        return kernel.Geom_SphericalSurface(_ax3(surface.center, surface.axis, surface.xdir), surface.radius), 1.0
    if isinstance(surface, Torus):
        frame = _ax3(surface.center, surface.axis, surface.xdir)
        return kernel.Geom_ToroidalSurface(frame, surface.major_radius, surface.minor_radius), 1.0
    nurbs = surface if isinstance(surface, NurbsSurface) else surface.to_nurbs()
    return _nurbs_to_kernel(nurbs), 1.0


def v_scale_of(surface: Any) -> float:
    """The factor s of (u, v) = (u, s v_kernel) for a kernel surface."""
    while isinstance(surface, kernel.Geom_RectangularTrimmedSurface):
        surface = surface.BasisSurface()
    kinds = (kernel.Geom_CylindricalSurface, kernel.Geom_SphericalSurface, kernel.Geom_ToroidalSurface)
    if isinstance(surface, kernel.Geom_ConicalSurface):
        return _frame(surface.Position())[3] * cos(surface.SemiAngle())
    return _frame(surface.Position())[3] if isinstance(surface, kinds) else 1.0


def _frame(frame: Any) -> tuple[Array, Array, Array, float]:
    """Origin, right-handed axis, x direction, and -1 where the kernel's own axis points against it."""
    origin, x, y = frame.Location(), frame.XDirection(), frame.YDirection()
    xdir, ydir = np.array([x.X(), x.Y(), x.Z()]), np.array([y.X(), y.Y(), y.Z()])
    point = np.array([origin.X(), origin.Y(), origin.Z()])
    if frame.Direct():
        z = frame.Direction()
        return point, np.array([z.X(), z.Y(), z.Z()]), xdir, 1.0
    return point, np.cross(xdir, ydir), xdir, -1.0


def _ax3(origin: Array, axis: Array, xdir: Array) -> Any:
    return kernel.gp_Ax3(
        kernel.gp_Pnt(*map(float, origin)), kernel.gp_Dir(*map(float, axis)), kernel.gp_Dir(*map(float, xdir))
    )


def _scaled(v0: float, v1: float, s: float) -> tuple[float, float]:
    a, b = s * v0, s * v1
    return (a, b) if a < b else (b, a)


def _turn(low: float, high: float) -> tuple[float, float]:
    """A range of angles; one that misses or passes a full turn by round-off is a full turn."""
    if high - low < 2.0 * pi * (1.0 - 1e-9):
        return low, high
    start = 0.0 if abs(low) < 1e-9 else low
    return start, start + 2.0 * pi


def _natural(low: float, high: float, face_low: float, face_high: float) -> tuple[float, float]:
    """A direction's own range where it is finite and holds the face's, the face's otherwise."""
    slack = 1e-9 * (high - low) if isfinite(high - low) else inf
    finite = abs(low) < 1e50 and abs(high) < 1e50
    return (low, high) if finite and low - slack <= face_low and face_high <= high + slack else (face_low, face_high)


def _nurbs_from_kernel(surface: Any, bounds: Bounds) -> NurbsSurface:
    low_u, high_u, low_v, high_v = surface.Bounds()
    u0, u1 = _natural(low_u, high_u, bounds[0], bounds[1])
    v0, v1 = _natural(low_v, high_v, bounds[2], bounds[3])
    if isinstance(surface, kernel.Geom_SurfaceOfLinearExtrusion):
        curve = curve_from_kernel(surface.BasisCurve(), u0, u1)
        d = surface.Direction()
        direction = np.array([d.X(), d.Y(), d.Z()])
        net = np.stack([curve.control_points + v0 * direction, curve.control_points + v1 * direction], axis=1)
        weights = None if curve.weights is None else np.stack([curve.weights, curve.weights], axis=1)
        return NurbsSurface((curve.degree, 1), (curve.knots, np.array([v0, v0, v1, v1])), net, weights)
    if isinstance(surface, kernel.Geom_SurfaceOfRevolution):
        curve = curve_from_kernel(surface.BasisCurve(), v0, v1)
        line = surface.Axis()
        p, d = line.Location(), line.Direction()
        knots, circle = circle_spline(u0, u1)
        net = _revolved(curve.control_points, np.array([p.X(), p.Y(), p.Z()]), np.array([d.X(), d.Y(), d.Z()]), circle)
        weights = None if curve.weights is None else np.broadcast_to(curve.weights, net.shape[:2])
        return NurbsSurface((7, curve.degree), (knots, curve.knots), net, weights)
    if isinstance(surface, kernel.Geom_BezierSurface):
        surface = kernel.GeomConvert.SurfaceToBSplineSurface_s(surface)
    if not isinstance(surface, kernel.Geom_BSplineSurface):
        surface = _approximated(surface, (u0, u1, v0, v1))
    if surface.IsUPeriodic() or surface.IsVPeriodic():
        surface = surface.Copy()
        if (u0, u1, v0, v1) != (low_u, high_u, low_v, high_v):
            with suppress(kernel.Standard_Failure):  # the kernel cannot cut there: the whole period then
                surface.Segment(u0, u1, v0, v1)
        if surface.IsUPeriodic():
            surface.SetUNotPeriodic()
        if surface.IsVPeriodic():
            surface.SetVNotPeriodic()
    return spline_surfaces([surface])[0]


def _revolved(points: Array, origin: Array, axis: Array, circle: Array) -> Array:
    """(k, n, 3) the points turned about the axis by the spline circle's control points (k, 2)."""
    foot = origin + np.outer((points - origin) @ axis, axis)
    radial = points - foot
    across = np.cross(axis, radial)
    return np.asarray(foot[None] + circle[:, 0, None, None] * radial[None] + circle[:, 1, None, None] * across[None])


def _approximated(surface: Any, bounds: Bounds) -> Any:
    u0, u1, v0, v1 = bounds
    corners = points_3d([surface.Value(u, v) for u in (u0, (u0 + u1) / 2, u1) for v in (v0, (v0 + v1) / 2, v1)])
    size = float(np.linalg.norm(np.ptp(corners, axis=0)))
    trimmed = kernel.Geom_RectangularTrimmedSurface(surface, u0, u1, v0, v1)
    c2 = kernel.GeomAbs_Shape.GeomAbs_C2
    fit = kernel.GeomConvert_ApproxSurface(trimmed, _OFFSET_SHARE * size, c2, c2, 12, 12, 400, 1)
    if not fit.HasResult():
        kind = type(surface).__name__.removeprefix("Geom_")
        raise UnsupportedEntity(f"a surface of the kind {kind} has no NURBS form within {_OFFSET_SHARE * size:.3g}")
    return fit.Surface()


def _nurbs_to_kernel(surface: NurbsSurface) -> Any:
    (U, u_counts), (V, v_counts) = kernel_knots(surface.knots[0]), kernel_knots(surface.knots[1])
    net = kernel_net(surface.control_points)
    p, q = surface.degree
    if surface.weights is None:
        return kernel.Geom_BSplineSurface(net, U, V, u_counts, v_counts, p, q)
    return kernel.Geom_BSplineSurface(net, kernel_reals(surface.weights), U, V, u_counts, v_counts, p, q)
