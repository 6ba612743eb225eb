"""Surface meets surface."""

from patchwright.ssi.intersect import intersect
from patchwright.ssi.intersection import Contact, Intersection, IntersectionCurve, Overlap, Unresolved

__all__ = ["Contact", "Intersection", "IntersectionCurve", "Overlap", "Unresolved", "intersect"]
