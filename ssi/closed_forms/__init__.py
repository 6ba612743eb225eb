"""Intersections of analytic surfaces that are points, lines and conics, exact."""

from patchwright.ssi.closed_forms.bounding import clip, clip_to
from patchwright.ssi.closed_forms.closed_form import closed_form

__all__ = ["clip", "clip_to", "closed_form"]
