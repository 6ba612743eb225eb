"""Analytic surfaces, with angles in radians and exact NURBS forms of their bounded pieces."""

from patchwright.models.analytic.cone import Cone
from patchwright.models.analytic.cylinder import Cylinder
from patchwright.models.analytic.plane import Plane
from patchwright.models.analytic.sphere import Sphere
from patchwright.models.analytic.torus import Torus

__all__ = ["Cone", "Cylinder", "Plane", "Sphere", "Torus"]
