"""Surfaces through a grid of points: a linear scheme along the rows, then along the columns of what it gave."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from patchwright.models.arrays import Array
from patchwright.models.errors import ParameterError
from patchwright.models.interpolation.claims import Scheme, scheme_named
from patchwright.models.interpolation.parameters import Wanted, numbers, parametrize
from patchwright.models.nurbs_surface import NurbsSurface

Pair = tuple[Any, Any]


def interpolate_surface(
    points: npt.ArrayLike,
    scheme: str | tuple[str, str] = "c2-cubic",
    parameters: Wanted | Pair | None = None,
    **options: Any,
) -> NurbsSurface:
    """The surface through points (n, m, 3): row i at u_i, column j at v_j.

    Parameters
    ----------
    scheme : one name, or one for u and one for v; linear schemes only
    parameters : as for a curve, None for the scheme's own; a pair (for u, for v) where they differ. Each direction has
        one set, the mean of those of its curves; curves of zero length (a pole) are left out of it
    options : as for a curve, for both directions

    Raises
    ------
    ParameterError : points of another shape or not finite, a scheme that is not linear, a direction in which every
        curve has coincident neighbours.
    """
    P = numbers(points)
    if P.ndim != 3 or P.shape[2] != 3 or min(P.shape[:2]) < 2:
        raise ParameterError(f"points must be (n, m, 3) with n and m of at least 2, got shape {P.shape}")
    if not np.isfinite(P).all():
        at = np.argwhere(~np.isfinite(P).all(axis=2))[0]
        raise ParameterError(f"point ({at[0]}, {at[1]}) is not finite")
    names = (scheme, scheme) if isinstance(scheme, str) else scheme
    wanted = parameters if isinstance(parameters, tuple) and len(parameters) == 2 else (parameters, parameters)
    along_u, along_v = (_usable(name) for name in names)
    u = common_parameters(P.swapaxes(0, 1), along_u, wanted[0], "u")
    v = common_parameters(P, along_v, wanted[1], "v")
    n, m = P.shape[:2]
    rows = along_u(P.reshape(n, -1), u, options).curve
    k = len(rows.control_points)
    net = rows.control_points.reshape(k, m, 3).swapaxes(0, 1).reshape(m, -1)
    columns = along_v(net, v, options).curve
    full = columns.control_points.reshape(-1, k, 3).swapaxes(0, 1)
    return NurbsSurface((rows.degree, columns.degree), (rows.knots, columns.knots), full)


def common_parameters(curves: Array, scheme: Scheme, wanted: Any, name: str) -> Array:
    """One set of parameters for curves (k, n, 3) of a direction."""
    kind = scheme.parameters if wanted is None else wanted
    if not isinstance(kind, str) and np.ndim(kind) == 1:
        return parametrize(curves[0], kind)
    if kind == "abscissa":
        raise ParameterError("a surface has no abscissa; give its parameters instead")
    steps = np.linalg.norm(np.diff(curves, axis=1), axis=2)
    usable = (steps > 0.0).all(axis=1)
    partly = ~usable & (steps > 0.0).any(axis=1)
    if partly.any():
        k = int(np.argmax(partly))
        at = int(np.argmin(steps[k]))
        raise ParameterError(f"along {name}, points {at} and {at + 1} of curve {k} coincide; leave one row of them out")
    if not usable.any():
        raise ParameterError(f"every curve along {name} has zero length")
    return np.asarray(np.mean([parametrize(curve, kind) for curve in curves[usable]], axis=0))


def _usable(name: str) -> Scheme:
    found = scheme_named(name)
    if not found.linear:
        raise ParameterError(f"{name} is not linear in the points, so that rows and columns do not make one surface")
    return found
