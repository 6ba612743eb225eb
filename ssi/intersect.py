"""`intersect`: everything surfaces, faces, meshes, grids and assemblies share.

Each pair goes to the method that is right for it: closed forms for analytic surfaces (recognised also in NURBS form),
subdivision and tracing for surfaces, exact predicates for meshes. Curves are then cut back to the faces' trims, and the
places where three surfaces meet are found on the curves.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from patchwright.models.errors import ParameterError
from patchwright.models.surface import Surface
from patchwright.models.triangulation import Triangulation
from patchwright.ssi.chained import chained
from patchwright.ssi.embedded import is_embedded
from patchwright.ssi.intersection import Intersection
from patchwright.ssi.operands import Input, Operand, meeting, operands
from patchwright.ssi.trimmed import trimmed
from patchwright.ssi.triple_points import triple_points

SHARE = 1e-10  # of the smaller surface's size: the tolerance nobody gave
MEETING = 1e-8  # of the curves' extent: ends nearer than this are one place
Progress = Callable[[str, float], None]


def intersect(
    a: Input,
    b: Input | None = None,
    *others: Input,
    tolerance: float | None = None,
    progress: Progress | None = None,
) -> Intersection:
    """All curves, contacts and overlaps of every pair of inputs.

    Parameters
    ----------
    a, b, others : surfaces (NURBS, analytic; unbounded ones are clipped to the other's box), triangulations, surface
        grids, faces (`Part` with trims) and assemblies. One argument alone means self-intersection; of an assembly
        alone, all pairs of its parts that share no edge.
    tolerance : length, model unit; default 1e-10 of the smaller of two surfaces. Surfaces nearer than this touch.
    progress : called with a label and a share in [0, 1]

    Returns
    -------
    Intersection; `surfaces` of each piece count the inputs in order, an assembly's parts one by one. `complete` only
    when every pair is proved to share nothing else.

    Raises
    ------
    ParameterError : an input of another kind or without triangles, a tolerance that is not a positive length, two
        unbounded surfaces with an unbounded intersection.
    """
    check_tolerance(tolerance)
    say = progress or (lambda label, share: None)
    alone = b is None
    items = operands([a] if b is None else [a, b, *others])
    found: list[Intersection] = []
    if alone:
        for i, item in enumerate(items):
            say("self-intersections", i / len(items))
            found.append(_numbered(_self(item, tolerance), i, i))
    sizes = [item.size for item in items if np.isfinite(item.size)]
    widest = tolerance or SHARE * max(sizes, default=1.0)
    pairs = meeting(items, alone, widest)
    for k, (i, j) in enumerate(pairs.tolist()):
        say("intersecting pairs", k / len(pairs))
        found.append(_numbered(_pair(items[i], items[j], tolerance), i, j))
    merged = Intersection(
        tuple(c for f in found for c in f.curves),
        tuple(p for f in found for p in f.points),
        tuple(o for f in found for o in f.overlaps),
        tuple(u for f in found for u in f.unresolved),
    )
    if len(items) < 3:
        return merged
    say("points where three meet", 0.9)
    reach = max(widest, 2.0 * merged.residual)
    return replace(merged, points=merged.points + triple_points(merged.curves, reach))


def check_tolerance(tolerance: float | None) -> None:
    """Raises ParameterError for one that is neither None nor a positive length."""
    if tolerance is not None and not (np.isfinite(tolerance) and tolerance > 0.0):
        raise ParameterError(f"the tolerance must be a positive length, got {tolerance}")


def _tolerance(a: Operand, b: Operand, given: float | None) -> float:
    sizes = [x for x in (a.size, b.size) if np.isfinite(x) and x > 0.0]
    return given or SHARE * min(sizes, default=1.0)


def _pair(a: Operand, b: Operand, given: float | None) -> Intersection:
    """One pair by the method for its kinds, cut back to the trims."""
    from patchwright.ssi.closed_forms import clip_to
    from patchwright.ssi.mesh_mesh import intersect_meshes
    from patchwright.ssi.mesh_surface import intersect_mesh_surface

    if isinstance(a.thing, Triangulation) and isinstance(b.thing, Triangulation):
        return intersect_meshes(a.thing, b.thing)
    if isinstance(a.thing, Triangulation):
        assert isinstance(b.thing, Surface)
        found = intersect_mesh_surface(a.thing, clip_to(b.thing, a.box), given)
        return trimmed(found, b.thing, b.trims, 1)
    if isinstance(b.thing, Triangulation):
        found = intersect_mesh_surface(b.thing, clip_to(a.thing, b.box), given)
        return trimmed(_swapped(found), a.thing, a.trims, 0)
    found = _surfaces(a.thing, b.thing, _tolerance(a, b, given))
    return trimmed(trimmed(found, a.thing, a.trims, 0), b.thing, b.trims, 1)


def _surfaces(a: Surface, b: Surface, tolerance: float) -> Intersection:
    """Two surfaces: by closed form where there is one, also of analytic surfaces in NURBS form."""
    from patchwright.ssi.closed_forms import clip
    from patchwright.ssi.recognised import by_closed_form

    exact = by_closed_form(a, b, tolerance)
    if exact is not None:
        return exact
    from patchwright.ssi.surface_surface import intersect_surfaces

    a, b = clip(a, b)
    return _joined(intersect_surfaces(a, b, tolerance), tolerance)


def _joined(found: Intersection, tolerance: float) -> Intersection:
    """The result with its curves joined across seams and poles."""
    extent = max((float(np.ptp(c.points, axis=0).max()) for c in found.curves), default=0.0)
    return chained(found, MEETING * extent + 10.0 * tolerance)


def _self(item: Operand, given: float | None) -> Intersection:
    """One surface, face or mesh with itself."""
    from patchwright.ssi.mesh_mesh import intersect_meshes
    from patchwright.ssi.recognised import itself_by_closed_form
    from patchwright.ssi.self_surface import intersect_itself

    if isinstance(item.thing, Triangulation):
        return intersect_meshes(item.thing)
    tolerance = given or (SHARE * item.size if np.isfinite(item.size) else 1.0)
    found = itself_by_closed_form(item.thing, tolerance)
    if found is None and is_embedded(item.thing):
        return Intersection()
    if found is None:
        found = _joined(intersect_itself(item.thing, tolerance), tolerance)
    return trimmed(trimmed(found, item.thing, item.trims, 0), item.thing, item.trims, 1)


def _numbered(found: Intersection, i: int, j: int) -> Intersection:
    """The result with the operands' own numbers."""
    return Intersection(
        tuple(replace(c, surfaces=(i, j)) for c in found.curves),
        tuple(replace(p, surfaces=(i, j)) for p in found.points),
        tuple(
            replace(o, surfaces=(i, j), boundary=tuple(replace(c, surfaces=(i, j)) for c in o.boundary))
            for o in found.overlaps
        ),
        tuple(replace(u, surfaces=(i, j)) for u in found.unresolved),
    )


def _swapped(found: Intersection) -> Intersection:
    """The result with the two surfaces exchanged."""
    return Intersection(
        tuple(replace(c, uv_a=c.uv_b, uv_b=c.uv_a) for c in found.curves),
        tuple(replace(p, uv_a=p.uv_b, uv_b=p.uv_a) for p in found.points),
        tuple(
            replace(o, boundary=tuple(replace(c, uv_a=c.uv_b, uv_b=c.uv_a) for c in o.boundary)) for o in found.overlaps
        ),
        tuple(replace(u, box_a=u.box_b, box_b=u.box_a) for u in found.unresolved),
    )
