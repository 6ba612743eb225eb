"""Recognition gives back the surface a NURBS was made from, whatever its representation, and nothing else."""

from __future__ import annotations

import math

import numpy as np
import pytest
from oracles_closed_forms import moved, rotation, signed

from patchwright.models import Cone, Cylinder, NurbsSurface, ParameterError, Plane, Sphere, Torus
from patchwright.ssi.closed_forms import closed_form
from patchwright.ssi.recognise import recognise

P, D = (1.0, 2.0, 3.0), (1.0, 2.0, 3.0)
SURFACES = {
    "plane": Plane(P, D, u=(-1, 2), v=(0, 3)),
    "cylinder": Cylinder(P, D, 2.0, v=(0, 3)),
    "small piece of a cylinder": Cylinder(P, D, 2.0, u=(1, 1.3), v=(0, 0.3)),
    "frustum": Cone(P, D, 0.4, 1.0, v=(0, 3)),
    "narrowing piece": Cone(P, D, -0.4, 1.0, u=(0.5, 3), v=(0, 1)),
    "cone with apex": Cone(P, D, 0.4, v=(0, 1)),
    "sphere": Sphere(P, 2.0),
    "piece of a sphere": Sphere(P, 2.0, (1, 1, 0), u=(1, 2), v=(0.2, 0.9)),
    "torus": Torus(P, D, 3.0, 1.0),
    "piece of a torus": Torus(P, D, 3.0, 1.0, u=(1, 4), v=(-2, 2)),
}


def disguised(surface):
    """The same shape with turned directions, more knots."""
    n = surface.to_nurbs()
    (u0, u1), _ = n.domain
    n = n.insert_knots([u0 + 0.3 * (u1 - u0)])
    swapped = n.control_points.swapaxes(0, 1)
    weights = None if n.weights is None else n.weights.T
    return NurbsSurface(n.degree[::-1], n.knots[::-1], swapped, weights)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("name", SURFACES)
def test_round_trip(name, scale):
    rng = np.random.default_rng(len(name))
    source = moved(SURFACES[name], rotation(rng), scale * rng.normal(size=3), scale)
    native = disguised(source)
    found = recognise(native, 1e-10 * scale)
    assert found is not None
    assert type(found.surface) is type(source)
    assert found.fills
    assert found.deviation <= 1e-12 * scale
    assert found.proved == (name not in ("torus", "piece of a torus", "cone with apex"))
    for k in ("radius", "major_radius", "minor_radius"):
        if hasattr(source, k) and not isinstance(source, Cone):
            assert getattr(found.surface, k) == pytest.approx(getattr(source, k), rel=1e-11)
    # the extent: both pieces reach equally far
    box = [s.to_nurbs().grid(*(np.linspace(*r, 65) for r in s.domain)).reshape(-1, 3) for s in (found.surface, source)]
    assert np.abs(box[0].min(axis=0) - box[1].min(axis=0)).max() <= 0.02 * scale
    assert np.abs(box[0].max(axis=0) - box[1].max(axis=0)).max() <= 0.02 * scale
    (u0, u1), (v0, v1) = native.domain
    at = np.stack((rng.uniform(u0, u1, 20), rng.uniform(v0, v1, 20)), axis=1)
    points = native(at[:, 0], at[:, 1])
    uv = found.to_native(points)
    assert np.linalg.norm(native(uv[:, 0], uv[:, 1]) - points, axis=1).max() <= 1e-10 * scale


def test_extent_of_the_ranges():
    for name in ("cylinder", "small piece of a cylinder", "sphere", "piece of a torus"):
        source = SURFACES[name]
        found = recognise(source.to_nurbs(), 1e-10)
        assert found is not None
        spans = [[hi - lo for lo, hi in s.domain] for s in (found.surface, source)]
        np.testing.assert_allclose(spans[0], spans[1], atol=1e-12)


@pytest.mark.parametrize("bump", [1e-3, 1e-6])
def test_nearly_is_not_enough(bump):
    native = SURFACES["sphere"].to_nurbs()
    points = native.control_points.copy()
    points[2, 2] += bump * np.array([1.0, 2.0, 3.0])
    off = NurbsSurface(native.degree, native.knots, points, native.weights)
    assert recognise(off, 0.01 * bump) is None
    found = recognise(off, 10.0 * bump)
    assert found is not None
    assert isinstance(found.surface, Sphere)
    us, vs = (np.linspace(*r, 101) for r in off.domain)
    assert np.abs(signed(found.surface, off.grid(us, vs).reshape(-1, 3))).max() <= found.deviation * (1 + 1e-9)


def test_free_form_is_not_recognised():
    x, y = np.meshgrid(np.linspace(0, 1, 4), np.linspace(0, 1, 4), indexing="ij")
    net = np.stack((x, y, x * y * (1 - x)), axis=-1)
    assert recognise(NurbsSurface((3, 3), ([0, 0, 0, 0, 1, 1, 1, 1],) * 2, net), 1e-6) is None
    assert recognise(SURFACES["sphere"], 1e-6) is None  # analytic already
    with pytest.raises(ParameterError, match="tolerance"):
        recognise(SURFACES["sphere"].to_nurbs(), -1.0)


def test_a_plane_that_is_no_rectangle_says_so():
    net = np.array([[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [2, 3, 0]]], dtype=float)
    found = recognise(NurbsSurface((1, 1), ([0, 0, 1, 1],) * 2, net), 1e-9)
    assert found is not None
    assert not found.fills


def test_recognised_pairs_intersect_as_their_sources():
    a, b = Cylinder(np.zeros(3), (0, 0, 1), 1.0, v=(-3, 3)), Cylinder(np.zeros(3), (1, 0, 0), 1.0, v=(-3, 3))
    pair = [recognise(s.to_nurbs(), 1e-10) for s in (a, b)]
    assert pair[0] is not None
    assert pair[1] is not None
    found = closed_form(pair[0].surface, pair[1].surface, 1e-10)
    assert found is not None
    assert len(found.curves) == 4
    assert found.length == pytest.approx(closed_form(a, b, 1e-10).length, rel=1e-11)
    native = pair[0].to_native(found.points[0].point[None])
    assert math.isfinite(native.sum())
