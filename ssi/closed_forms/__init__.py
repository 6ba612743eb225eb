"""Intersections of analytic surfaces that are points, lines and conics, exact."""

from patchwright.ssi.closed_forms.bounding import clip
from patchwright.ssi.closed_forms.closed_form import closed_form

__all__ = ["clip", "closed_form"]
