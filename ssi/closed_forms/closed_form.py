"""`closed_form`: the intersection of two analytic surfaces where it consists of points, lines and conics.

What there is beyond: a plane, cylinder, cone, sphere or torus against another usually gives a curve of degree four (up
to eight), which has no exact NURBS form; `closed_form` then answers None. It also answers None where a special
position holds to less than the tolerance (radii 1 and 1 - 1e-8 at 1e-10): the special answer would be wrong there. A
position is special when moving the surfaces by the tolerance makes it so; each module states the lengths compared.
"""

from __future__ import annotations

import numpy as np

from patchwright.models import Cone, Cylinder, Plane, Sphere, Torus
from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.surface import Surface
from patchwright.ssi.closed_forms.bounding import clip
from patchwright.ssi.closed_forms.carriers import NOTHING, Carriers, Coincident, Setting
from patchwright.ssi.closed_forms.clipping import clipped, contact
from patchwright.ssi.closed_forms.coaxial import coaxial
from patchwright.ssi.closed_forms.coincident import coincident
from patchwright.ssi.closed_forms.crossing_axes import ruled
from patchwright.ssi.closed_forms.extents import setting
from patchwright.ssi.closed_forms.inversion import Analytic, inside
from patchwright.ssi.closed_forms.plane_sections import (
    plane_cone,
    plane_cylinder,
    plane_plane,
    plane_sphere,
    plane_torus,
)
from patchwright.ssi.closed_forms.sphere_pairs import sphere_off_axis
from patchwright.ssi.intersection import Contact, Intersection, IntersectionCurve

KINDS = (Plane, Cylinder, Cone, Sphere, Torus)


def closed_form(a: Surface, b: Surface, tolerance: float) -> Intersection | None:
    """Everything two analytic surfaces share, exact and complete, or None where there is no closed form.

    Parameters
    ----------
    a, b : unbounded ones are cut to the other's box first, see `clip`
    tolerance : length. Surfaces this near touch; deeper inside each other than this they cross.

    Returns
    -------
    Curves are exact lines (degree 1) and conics (rational quadratics), split where branches meet and clipped to both
    ranges; `uv_a` and `uv_b` have the same parameter. Across a seam or pole they jump, at a knot of multiplicity
    degree + 1. None: other surfaces, a curve of higher degree, or a position that is nearly special.

    Raises
    ------
    ParameterError : a tolerance that is not positive, two unbounded surfaces with an unbounded intersection.
    """
    if not (np.isfinite(tolerance) and tolerance > 0.0):
        raise ParameterError(f"the tolerance must be a positive length, got {tolerance}")
    if not (isinstance(a, KINDS) and isinstance(b, KINDS)):
        return None
    a, b = clip(a, b)
    assert isinstance(a, KINDS)
    assert isinstance(b, KINDS)
    at = setting(a, b, tolerance)
    if at is None:
        return Intersection()
    found = carriers(a, b, at)
    if found is None:
        return None
    if isinstance(found, Coincident):
        return coincident(a, b, at.tolerance)
    return _assembled(a, b, found, at)


def carriers(a: Analytic, b: Analytic, at: Setting) -> Carriers | Coincident | None:
    """Whole conics and points shared by the unbounded surfaces, the order of the arguments being of no consequence."""
    if KINDS.index(type(a)) > KINDS.index(type(b)):
        a, b = b, a
    if isinstance(a, Plane):
        if isinstance(b, Plane):
            return plane_plane(a, b, at)
        if isinstance(b, Cylinder):
            return plane_cylinder(a, b, at)
        if isinstance(b, Cone):
            return plane_cone(a, b, at)
        return plane_sphere(a, b, at) if isinstance(b, Sphere) else plane_torus(a, b, at)
    assert not isinstance(b, Plane)
    shared = coaxial(a, b, at)
    if shared is not None:
        return shared
    if isinstance(a, Cylinder | Cone) and isinstance(b, Cylinder | Cone):
        return ruled(a, b, at)
    if isinstance(b, Sphere) and isinstance(a, Cylinder | Cone):
        return sphere_off_axis(b, a, at)
    if isinstance(a, Sphere) and isinstance(b, Torus):
        return sphere_off_axis(a, b, at)
    return NOTHING if isinstance(a, Sphere) and isinstance(b, Sphere) else None


def _assembled(a: Analytic, b: Analytic, found: Carriers, at: Setting) -> Intersection | None:
    tol = at.tolerance
    curves: list[IntersectionCurve] = []
    lone: list[Array] = []
    for carrier in found.curves:
        pieces, points = clipped(carrier.conic, carrier.kind, a, b, tol, found.branches)
        curves += pieces
        lone += points
    if any(c.residual > tol for c in curves):
        return None  # too large or too slender a conic for float64: nearly another special position
    contacts: list[Contact] = []

    def add(point: Array, kind: str, gap: float) -> None:
        here = bool(inside(a, point, tol)) and bool(inside(b, point, tol))
        if here and all(float(np.linalg.norm(c.point - point)) > tol for c in contacts):
            contacts.append(contact(point, "branch" if kind == "branch" else "touch", gap, a, b))

    for p in found.branches:
        add(p, "branch", 0.0)
    for p, gap in found.touches:
        add(p, "touch", gap)
    ends = [e for c in curves for e in (c.curve.control_points[0], c.curve.control_points[-1])]
    for p in lone:
        if all(float(np.linalg.norm(e - p)) > 8.0 * tol for e in ends):
            add(p, "touch", 0.0)
    return Intersection(tuple(curves), tuple(contacts))
