"""Bicubic patches: Coons, projection, filling, fitting, and smooth joins of whole networks."""
