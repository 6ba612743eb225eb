"""Kernel of `sizing`: a field whose growth is bounded."""

# mypy: disable-error-code="untyped-decorator,no-any-return,no-untyped-def,no-untyped-call"

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True, error_model="numpy", _nrt=False, no_cfunc_wrapper=True)
def grade(points, triangles, slope, size):
    """Lower `size` (n,) until it differs by at most `slope` times the length along every edge."""
    m = len(triangles)
    for sweep in range(400):
        changed = False
        for i in range(m):
            t = i if sweep % 2 == 0 else m - 1 - i
            for k in range(3):
                a, b = triangles[t, k], triangles[t, (k + 1) % 3]
                dx, dy, dz = points[a, 0] - points[b, 0], points[a, 1] - points[b, 1], points[a, 2] - points[b, 2]
                rise = slope * np.sqrt(dx * dx + dy * dy + dz * dz)
                if size[a] > 1.0001 * (size[b] + rise):
                    size[a] = size[b] + rise
                    changed = True
                elif size[b] > 1.0001 * (size[a] + rise):
                    size[b] = size[a] + rise
                    changed = True
        if not changed:
            break
