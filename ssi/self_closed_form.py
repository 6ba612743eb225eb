"""Where an analytic surface meets itself: at the apexes of cones and of spindle tori, and nowhere else.

Plane, cylinder and sphere are met once at each point but for seams and poles. A cone with both nappes meets itself in
its apex. A torus with rho(v) = R + r cos v meets itself where rho = 0: in one point for R = r (horn), in two on the
axis for R < r (spindle). Its inner and outer sheet share nothing else: |rho| = R + r cos v on the one and
|rho| = -R - r cos v on the other at the same height need rho = 0. An apex at the end of the range of v is a pole and no
contact.
"""

from __future__ import annotations

import math

import numpy as np

from patchwright.models.analytic import Cone, Cylinder, Plane, Sphere, Torus
from patchwright.ssi.closed_forms.inversion import Analytic
from patchwright.ssi.intersection import Contact, Intersection

END = 1e-12  # of the range of v: an apex nearer than this to its end is a pole


def analytic_itself(surface: Analytic) -> Intersection:
    """Everything an analytic surface, bounded or not, shares with itself: isolated contacts."""
    if isinstance(surface, Plane | Cylinder | Sphere):
        return Intersection()
    return Intersection(points=tuple(_contact(surface, v) for v in _apexes(surface)))


def _apexes(surface: Cone | Torus) -> list[float]:
    """The v at which the radius vanishes inside the range."""
    low, high = surface.v
    if isinstance(surface, Cone):
        found = [float((surface.apex - surface.origin) @ surface.axis)]
    else:
        share = surface.major_radius / surface.minor_radius
        if share > 1.0:
            return []
        half = math.acos(-share)
        found = [half, 2.0 * math.pi - half] if share < 1.0 else [math.pi]
        found = [v + 2.0 * math.pi * k for v in found for k in (-1, 0, 1)]
    slack = END * (high - low) if math.isfinite(high - low) else 0.0
    return [v for v in found if low + slack < v < high - slack]


def _contact(surface: Cone | Torus, v: float) -> Contact:
    low, high = surface.u
    uv_a, uv_b = (low, v), (0.5 * (low + high), v)
    p, q = surface(*uv_a), surface(*uv_b)
    return Contact(0.5 * (p + q), uv_a, uv_b, "touch", float(np.linalg.norm(p - q)), (0, 0))
