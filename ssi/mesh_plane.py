"""Intersection of a triangulation with a bounded plane, which is two triangles: decided by exact predicates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from patchwright.models.analytic import Plane
from patchwright.models.arrays import Array
from patchwright.models.nurbs_curve import NurbsCurve
from patchwright.models.triangulation import Triangulation
from patchwright.ssi.intersection import Contact, Intersection, IntersectionCurve
from patchwright.ssi.mesh_mesh import intersect_meshes


def intersect_mesh_plane(mesh: Triangulation, plane: Plane) -> Intersection:
    """Curves, contacts and overlaps of a mesh (the first) with a plane of finite ranges (the second); always complete.

    The plane is that of its two triangles, exact up to the rounding of its four corners.
    """
    (u0, u1), (v0, v1) = plane.domain
    corners = np.asarray(plane(np.array([u0, u1, u1, u0]), np.array([v0, v0, v1, v1])))
    found = intersect_meshes(mesh, Triangulation(corners, np.array([[0, 1, 2], [0, 2, 3]])))
    return replace(
        found,
        curves=tuple(_placed(c, plane) for c in found.curves),
        points=tuple(_placed_contact(p, plane) for p in found.points),
        overlaps=tuple(replace(o, boundary=tuple(_placed(c, plane) for c in o.boundary)) for o in found.overlaps),
    )


def _parameters(points: Array, plane: Plane) -> Array:
    """(n, 2) parameters of the feet of points on the plane."""
    local = (points - plane.origin) @ np.stack([plane.xdir, plane.ydir], axis=1)
    low, high = np.array(plane.domain).T
    return np.asarray(np.clip(local, low, high))


def _placed(curve: IntersectionCurve, plane: Plane) -> IntersectionCurve:
    """The curve with its parameters on the plane, and their distance from it."""
    net = curve.curve.control_points
    uv = _parameters(net, plane)
    residual = float(np.linalg.norm(plane(uv[:, 0], uv[:, 1]) - net, axis=1).max())
    return replace(curve, uv_b=NurbsCurve(1, curve.curve.knots, uv), residual=residual)


def _placed_contact(contact: Contact, plane: Plane) -> Contact:
    u, v = _parameters(contact.point[None], plane)[0].tolist()
    return replace(contact, uv_b=(u, v))
