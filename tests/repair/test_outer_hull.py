from __future__ import annotations

import dirty_shapes as shapes
import numpy as np
import pytest

from patchwright.models import Triangulation
from patchwright.repair.mender.outer_hull import outer_hull


def hull_of(*parts: Triangulation):  # type: ignore[no-untyped-def]
    both = shapes.together(*parts)
    return both, outer_hull(both, np.asarray(both.tags))


def test_two_boxes_have_the_volume_of_their_union() -> None:
    both, hull = hull_of(shapes.box(), shapes.box(at=(0.5, 0.3, 0.2)))
    assert hull.triangulation.volume == pytest.approx(2.0 - 0.5 * 0.7 * 0.8, rel=1e-12)
    assert shapes.is_closed_manifold(hull.triangulation)
    # every piece lies in the plane of the triangle it was cut from, and uncut ones are that triangle
    parent = both.corners[hull.parents]
    distance = np.einsum("ijk,ik->ij", hull.triangulation.corners - parent[:, :1], both.normals[hull.parents])
    assert np.abs(distance).max() < 1e-14
    assert np.array_equal(hull.triangulation.corners[~hull.cut], parent[~hull.cut])
    # what is gone and what is left make up the whole
    assert sum(p.area for p in hull.inside) + hull.triangulation.areas.sum() == pytest.approx(both.areas.sum())


@pytest.mark.parametrize("shift", [0.5, 1.0, 1.5])
def test_two_spheres_meet_the_lens_formula(shift: float) -> None:
    _, hull = hull_of(shapes.sphere(5), shapes.sphere(5, at=(shift, 0.003, 0.002)))
    d = np.sqrt(shift**2 + 0.003**2 + 0.002**2)
    lens = np.pi * (4 + d) * (2 - d) ** 2 / 12
    assert hull.triangulation.volume == pytest.approx(8 / 3 * np.pi - lens, rel=3e-3)
    assert {p.inside for p in hull.inside} == {0, 1}


def test_bodies_apart_are_handed_through_untouched() -> None:
    both, hull = hull_of(shapes.sphere(2), shapes.sphere(2, at=(5, 0, 0)))
    assert np.array_equal(hull.triangulation.triangles, both.triangles)
    assert np.array_equal(hull.triangulation.vertices, both.vertices)
    assert not hull.cut.any()
    assert hull.inside == ()


def test_a_body_inside_goes_with_a_label_and_a_cavity_stays() -> None:
    both, hull = hull_of(shapes.sphere(3), shapes.sphere(3, radius=0.5))
    assert hull.triangulation.volume == pytest.approx(shapes.sphere(3).volume)
    assert [(p.body, p.inside) for p in hull.inside] == [(1, 0)]
    assert hull.inside[0].area == pytest.approx(shapes.sphere(3, radius=0.5).areas.sum())
    hollow = outer_hull(both, np.asarray(both.tags), np.array([False, True]))
    assert hollow.triangulation.volume == pytest.approx(both.volume * 7 / 9, rel=1e-9)
    assert shapes.is_closed_manifold(hollow.triangulation)


def test_the_order_of_the_bodies_does_not_matter() -> None:
    a, b, c = shapes.sphere(3), shapes.box(at=(0.7, 0.1, 0.05)), shapes.box((3, 0.3, 0.3))
    volumes = [hull_of(*order)[1].triangulation.volume for order in ((a, b, c), (c, a, b), (b, c, a))]
    assert np.ptp(volumes) < 1e-12


def test_an_open_body_is_refused_with_a_sentence() -> None:
    both, hull = hull_of(shapes.sphere(2), shapes.half(1, 0.0))
    assert len(hull.failed) == 1
    assert "not a closed 2-manifold" in hull.failed[0]
    assert len(hull.triangulation) == len(both)
